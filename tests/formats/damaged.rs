//! Files that are damaged: every reader answers or refuses, within a time and a memory that follow the file's size.
//!
//! The damage is drawn from a generator with a fixed seed, so that a failure comes again; fuzz targets under `fuzz/` search
//! farther.

use crate::files::fixture;
use crate::random::Random;
use lampyris::formats::{
    self, Data3, Flux, LightRay, PhotometricType, Photometry, read_data1, read_data2, read_data3, read_eulumdat,
    read_ies, read_ray_set, read_rays, write_data1, write_data3, write_eulumdat, write_facets, write_ies,
    write_rays,
};
use lampyris::math::{Point, Vector};
use lampyris::simulate::Scene;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// Damaged copies of every seed.
const COPIES: u64 = 200;
/// Longest that one small file may take: none of the seeds is over 200 kB.
const LONGEST: Duration = Duration::from_secs(10);

/// Words that break readers: huge counts, signs, numbers that are none, ends of other formats.
const WORDS: [&[u8]; 14] = [
    b"99999999999999999999",
    b"4294967295",
    b"-1",
    b"0",
    b"1e308",
    b"-1e400",
    b"nan",
    b"inf",
    b"\0",
    b"\xff\xfe",
    b",,,",
    b"\"",
    b"\n\n",
    b"[[",
];

/// A copy with one to four kinds of damage.
fn damaged(seed: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len());
        let end = (at + random.below(64)).min(bytes.len());
        match random.below(7) {
            0 => bytes.truncate(at),
            1 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let piece = bytes[at..end].to_vec();
                let place = random.below(bytes.len());
                bytes.splice(place..place, piece);
            }
            4 => drop(bytes.splice(at..end, WORDS[random.below(WORDS.len())].iter().copied())),
            5 => {
                // A number in the place of a number.
                let digits = bytes[at..].iter().position(u8::is_ascii_digit).map(|k| at + k);
                if let Some(from) = digits {
                    let length = bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
                    bytes.splice(from..from + length, WORDS[random.below(8)].iter().copied());
                }
            }
            _ => {
                let random_bytes: Vec<u8> = (0..8).map(|_| random.bits() as u8).collect();
                let stop = (at + 8).min(bytes.len());
                bytes.splice(at..stop, random_bytes);
            }
        }
    }
    bytes
}

/// Reads damaged copies of a file by `read`, which returns whether it took one; some are refused.
fn assault(seed: &Path, read: impl Fn(&Path) -> bool) {
    let bytes = fs::read(seed).unwrap();
    assert!(read(seed), "{} is not read undamaged", seed.display());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(seed.file_name().unwrap());
    let mut random = Random(0x1a3b_5c7d);
    let mut refused = 0;
    for k in 0..COPIES {
        fs::write(&file, damaged(&bytes, &mut random)).unwrap();
        let start = Instant::now();
        refused += u64::from(!read(&file));
        assert!(start.elapsed() < LONGEST, "copy {k} of {} took {:?}", seed.display(), start.elapsed());
    }
    assert!(refused > COPIES / 20, "{}: {refused} refused", seed.display());
}

fn rays(n: usize) -> Vec<LightRay> {
    let ray = |i: usize| LightRay {
        origin: Point::new(i as f64, 0.5, -1.0),
        direction: Vector::new((i as f64).sin(), 0.3, 1.0).normalize(),
        power: 0.25,
        wavelength_nm: Some(450.0 + i as f64),
    };
    (0..n).map(ray).collect()
}

fn lamp() -> Photometry {
    Photometry {
        kind: PhotometricType::C,
        horizontal_deg: vec![0.0, 90.0, 180.0, 270.0, 360.0],
        vertical_deg: vec![0.0, 30.0, 60.0, 90.0],
        candela: (0..20).map(f64::from).collect(),
        lamp_lumens: Some(1000.0),
        watts: 10.0,
        opening_mm: [100.0, 50.0, 10.0],
        keywords: vec![("MANUFAC".into(), "nobody".into()), ("LUMINAIRE".into(), "a lamp".into())],
    }
}

#[test]
fn ray_files() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.csv", "a.npz"] {
        let path = folder.path().join(name);
        write_rays(&path, &rays(40)).unwrap();
        assault(&path, |p| read_rays(p).is_ok());
        assault(&path, |p| read_ray_set(p, Flux::Radiant).is_ok());
    }
}

#[test]
fn photometric_files() {
    let folder = tempfile::tempdir().unwrap();
    let [ies, ldt] = ["a.ies", "a.ldt"].map(|name| folder.path().join(name));
    write_ies(&ies, &lamp()).unwrap();
    write_eulumdat(&ldt, &lamp()).unwrap();
    assault(&ies, |p| read_ies(p).is_ok_and(|l| l.flux().is_finite() || l.candela.is_empty()));
    assault(&ldt, |p| read_eulumdat(p).is_ok_and(|l| l.flux().is_finite() || l.candela.is_empty()));
}

#[test]
fn seed_files() {
    let folder = tempfile::tempdir().unwrap();
    let [one, two, three] = ["a.data1", "a.data2", "a.data3"].map(|name| folder.path().join(name));
    write_data1(&one, &rays(40)).unwrap();
    assault(&one, |p| read_data1(p).is_ok());
    let mesh = lampyris::mesh::FacetMesh {
        positions: vec![Point::ZERO, Point::X, Point::X + Point::Y, Point::Y],
        vertices: (0..4)
            .map(|position| lampyris::mesh::MeshVertex {
                position,
                normal: Vector::Z,
                uv: lampyris::math::Uv::ZERO,
            })
            .collect(),
        facets: vec![lampyris::mesh::Facet { vertices: [0, 1, 2, 3], face: lampyris::math::FaceId(0) }],
        ..Default::default()
    };
    write_facets(&two, &formats::Facets::plain(&mesh, "square")).unwrap();
    assault(&two, |p| read_data2(p).is_ok());
    write_data3(&three, &Data3 { size: [3, 4], results: vec![1.5; 12], rays: rays(9) }).unwrap();
    assault(&three, |p| read_data3(p).is_ok());
}

#[test]
fn scenes() {
    for name in ["demo.toml", "s1_lens.toml", "s3_reflector.toml", "lens_white_light.toml"] {
        assault(&fixture("scenes").join(name), |p| Scene::read(p).is_ok());
    }
}

/// Zeros pack a thousandfold: an array that would unpack to a thousand times the file is refused by its head.
#[test]
fn a_file_of_rays_that_unpacks_to_far_more_than_it_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bomb.npz");
    let n = 3_000_000;
    let zeros = vec![0.0; 3 * n];
    let array = |name, shape, data| formats::NpyArray { name, shape, data };
    let arrays = [
        array("origin", vec![n, 3], &zeros[..]),
        array("direction", vec![n, 3], &zeros[..]),
        array("power", vec![n], &zeros[..n]),
    ];
    formats::write_npz(&path, &arrays).unwrap();
    drop(zeros);
    let start = Instant::now();
    let refused = read_rays(&path).unwrap_err().to_string();
    assert!(refused.contains("more than a file of this size can hold"), "{refused}");
    assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
}

/// A million equal rays would shrink to a thousandth.
#[test]
fn a_file_of_equal_rays_is_read_again_however_many_there_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("equal.npz");
    let ray = formats::LightRay { origin: Vector::ZERO, direction: Vector::Z, power: 1.0, wavelength_nm: None };
    let rays = vec![ray; 1_300_000];
    formats::write_rays(&path, &rays).unwrap();
    assert_eq!(read_rays(&path).unwrap().len(), rays.len());
}

/// Files without an end are refused before they are opened: a pipe would wait for a writer for ever.
#[test]
#[cfg(target_os = "linux")]
fn pipes_and_devices_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.ies");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for path in [Path::new("/dev/zero"), &pipe, folder.path()] {
        assert!(read_ies(path).is_err() && read_eulumdat(path).is_err() && read_rays(path).is_err());
        assert!(
            read_ray_set(path, Flux::Radiant).is_err() && read_data1(path).is_err() && read_data2(path).is_err()
        );
        assert!(read_data3(path).is_err() && Scene::read(path).is_err());
    }
}

/// With decimal commas every number is two, and the last intensities are left over.
#[test]
fn numbers_behind_the_last_of_an_ies_file_are_refused() {
    let parse = |text: &str| lampyris::formats::parse_ies(std::path::Path::new("lamp.ies"), text);
    let commas = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 0\n0 45 90\n0\n100,5 70,2 0,0\n";
    let error = parse(commas).unwrap_err().to_string();
    assert!(error.contains(":7") && error.contains("comma"), "{error}");
    let points = commas.replace(",5 70,2 0,0", ".5 70.2 0.0");
    // A remark or the end mark of an old system is no number.
    assert!(parse(&points).is_ok() && parse(&(points + "END\n\u{1a}")).is_ok());
}

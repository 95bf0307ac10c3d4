//! Ray files of measured sources as a user gives them to a scene: units, spectra, totals that disagree, and what a run says about them.

use crate::support::lampyris_in;
use lampyris::formats::{Flux, LightRay, SpectralData, Tm25, read_tm25, write_tm25};
use lampyris::math::{Point, Vector};
use lampyris::simulate::{Fingerprint, FingerprintHasher};
use serde_json::Value;
use std::path::Path;

const SCREEN: &str =
    "[[receiver]]\nname = 'x'\nat = [0, 0, 20]\nsize = [10, 10]\ncells = [1, 1]\nbins_nm = [400, 500, 600]\n";

/// Two rays along z, one of the power 1 at x = −1 and one of the power 3 at x = 2.
fn rays(nm: [Option<f64>; 2]) -> Vec<LightRay> {
    let ray = |x: f64, power: f64, wavelength_nm| LightRay {
        origin: Point::new(x, 0.0, 0.0),
        direction: Vector::Z,
        power,
        wavelength_nm,
    };
    vec![ray(-1.0, 1.0, nm[0]), ray(2.0, 3.0, nm[1])]
}

/// Traces a scene whose only source is `source.dat`, with further keys.
fn trace(folder: &Path, unit: &str, keys: &str) -> (i32, String, String) {
    let scene = format!(
        "[run]\nrays = 4000\nunit = '{unit}'\n[[source]]\nkind = 'rays'\nfile = 'source.dat'\n{keys}{SCREEN}"
    );
    std::fs::write(folder.join("scene.toml"), scene).unwrap();
    lampyris_in(folder, &["trace", "scene.toml", "-o", "out", "--json", "--no-report"])
}

fn results(folder: &Path, unit: &str, keys: &str) -> Value {
    let (code, out, err) = trace(folder, unit, keys);
    assert_eq!(code, 0, "{err}");
    serde_json::from_str(&out).unwrap()
}

fn power(found: &Value) -> f64 {
    found["receivers"][0]["power"].as_f64().unwrap()
}

/// Mean of the two places, weighted 1 to 3.
fn assert_places(found: &Value) {
    let x = found["receivers"][0]["centroid"][0].as_f64().unwrap();
    assert!((x - 1.25).abs() < 1e-9, "{x}");
}

#[test]
fn tm25_rays_are_a_source_and_a_total_that_disagrees_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = Tm25::from_rays(&rays([None; 2]), Flux::Luminous);
    file.header.luminous_flux = 8.0;
    write_tm25(&folder.path().join("source.dat"), &file).unwrap();
    let found = results(folder.path(), "lm", "");
    assert!((power(&found) - 8.0).abs() < 1e-9, "{found}");
    assert_places(&found);
    let notes = found["notes"].to_string();
    assert!(notes.contains("[[source]] 1: the header states 8 lumens but the rays add up to 4"), "{notes}");
}

#[test]
fn a_file_of_the_other_unit_is_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("source.dat");
    for (flux, unit, says, advice) in [
        (Flux::Luminous, "W", "gives lumens and no wavelengths, but the run counts watts", "unit = \"lm\""),
        (Flux::Radiant, "lm", "gives watts and no wavelengths", "unit = \"W\""),
    ] {
        write_tm25(&path, &Tm25::from_rays(&rays([None; 2]), flux)).unwrap();
        let (code, _, err) = trace(folder.path(), unit, "");
        assert_eq!(code, 2, "{err}");
        assert!(err.contains("scene.toml:6") && err.contains(says) && err.contains(advice), "{err}");
        // With a power of its own the file's powers are relative.
        let found = results(folder.path(), unit, "power = 5\n");
        assert!((power(&found) - 5.0).abs() < 1e-9);
        assert_places(&found);
    }
}

/// At 555 nm a watt is 683.000 lm, at 510 nm 0.503 of that (CIE 1924).
#[test]
fn watts_with_wavelengths_are_lumens() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("source.dat");
    write_tm25(&path, &Tm25::from_rays(&rays([Some(555.0), Some(510.0)]), Flux::Radiant)).unwrap();
    let found = results(folder.path(), "lm", "");
    let expected = 683.0 * (1.0 + 3.0 * 0.503);
    assert!((power(&found) / expected - 1.0).abs() < 1e-4, "{} {expected}", power(&found));
    assert!(found["notes"].to_string().contains("each ray by its wavelength"), "{}", found["notes"]);

    write_tm25(&path, &Tm25::from_rays(&rays([None; 2]), Flux::Radiant)).unwrap();
    let found = results(folder.path(), "lm", "spectrum = { kind = 'lines', values = [[555, 2]] }\n");
    assert!((power(&found) / (4.0 * 683.0) - 1.0).abs() < 1e-4);
    assert!(found["notes"].to_string().contains("by the scene's spectrum"), "{}", found["notes"]);
}

/// Blue light of one line, written by a run and read by the next, is the same lumens: 0.038 of 683 lm/W at 450 nm (CIE 1924). Of light
/// in lumens that no wavelength was said of, the file says none.
#[test]
fn the_one_wavelength_of_a_run_goes_with_its_rays() {
    let folder = tempfile::tempdir().unwrap();
    let wall = |z: f64| {
        format!(
            "[[receiver]]\nname = 'p'\nat = [0, 0, {z}]\nsize = [10, 10]\ncells = [1, 1]\nchannels = 'photometric'\n"
        )
    };
    let lines = "spectrum = { kind = 'lines', values = [[450, 1]] }\n";
    let lamp = format!("[run]\nrays = 4000\n[[source]]\nkind = 'collimated'\nradius = 1\n{lines}{}", wall(10.0));
    let again =
        "[run]\nrays = 4000\n[[source]]\nkind = 'rays'\nfile = 'first/p.tm25ray'\n".to_owned() + &wall(20.0);
    for (name, scene) in [("first", &lamp), ("second", &again)] {
        std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let (code, out, err) =
            lampyris_in(folder.path(), &["trace", "scene.toml", "-o", name, "--json", "--no-report"]);
        assert_eq!(code, 0, "{err}");
        let found: Value = serde_json::from_str(&out).unwrap();
        let lumens = found["receivers"][0]["channels"][0]["total"].as_f64().unwrap();
        assert!((lumens / (0.038 * 683.0) - 1.0).abs() < 1e-3, "{name}: {lumens} lm");
        let header = read_tm25(&folder.path().join(name).join("p.tm25ray")).unwrap().header;
        assert_eq!((header.spectral, header.wavelengths[0]), (SpectralData::Single, 450.0), "{name}");
    }
    let lumens =
        lamp.replace(lines, "").replace("[run]", "[run]\nunit = 'lm'").replace("channels = 'photometric'", "");
    std::fs::write(folder.path().join("scene.toml"), lumens).unwrap();
    let (code, _, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "third", "--no-report"]);
    assert_eq!(code, 0, "{err}");
    let header = read_tm25(&folder.path().join("third/p.tm25ray")).unwrap().header;
    assert_eq!(header.spectral, SpectralData::None);
}

/// One table for all rays: even from 400 to 600 nm, so that half of the light is in each bin.
#[test]
fn the_spectral_table_of_a_file_is_the_spectrum_of_its_source() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = Tm25::from_rays(&rays([None; 2]), Flux::Radiant);
    file.header.spectral = SpectralData::Table;
    file.header.spectra = vec![vec![[400.0, 1.0], [600.0, 1.0]]];
    write_tm25(&folder.path().join("source.dat"), &file).unwrap();
    let found = results(folder.path(), "W", "");
    for bin in 0..2 {
        let total = found["receivers"][0]["channels"][bin]["total"].as_f64().unwrap();
        assert!((total - 2.0).abs() < 0.02, "{total}");
    }
    // The scene's own spectrum comes before it.
    let found = results(folder.path(), "W", "spectrum = { kind = 'lines', values = [[550, 1]] }\n");
    assert!((found["receivers"][0]["channels"][1]["total"].as_f64().unwrap() - 4.0).abs() < 1e-9);
}

/// A Zemax binary file in inches, written field by field.
#[test]
fn zemax_rays_are_a_source() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes: Vec<u8> = 1010i32.to_le_bytes().into();
    bytes.extend(2u32.to_le_bytes());
    bytes.extend([0; 100]);
    bytes.extend([0.0f32; 7].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(1u32.to_le_bytes());
    bytes.extend([0; 52]);
    bytes.extend([2i32, 0, 0, 0].iter().flat_map(|x| x.to_le_bytes()));
    for ray in [[-0.1f32, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.45], [0.1, 0.0, 0.0, 0.0, 0.0, 1.0, 3.0, 0.55]] {
        bytes.extend(ray.iter().flat_map(|x| x.to_le_bytes()));
    }
    std::fs::write(folder.path().join("source.dat"), bytes).unwrap();
    let found = results(folder.path(), "W", "");
    assert!((power(&found) - 4.0).abs() < 1e-9);
    let x = found["receivers"][0]["centroid"][0].as_f64().unwrap();
    assert!((x - 1.27).abs() < 1e-6, "{x}");
    assert!((found["receivers"][0]["channels"][0]["total"].as_f64().unwrap() - 1.0).abs() < 1e-9);
}

#[test]
fn a_damaged_file_is_refused_by_its_byte() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("source.dat");
    write_tm25(&path, &Tm25::from_rays(&rays([None; 2]), Flux::Radiant)).unwrap();
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() - 5]).unwrap();
    let (code, _, err) = trace(folder.path(), "W", "");
    assert_eq!(code, 3, "{err}");
    assert!(err.contains("source.dat") && err.contains("byte"), "{err}");
}

/// Both rays of the list, with the power of each, whatever was drawn; what cannot be listed is refused before anything is traced.
#[test]
fn every_ray_of_a_list_has_its_end() {
    let folder = tempfile::tempdir().unwrap();
    write_tm25(&folder.path().join("source.dat"), &Tm25::from_rays(&rays([None; 2]), Flux::Luminous)).unwrap();
    let scene = "[run]\nrays = 400\nunit = 'lm'\n[[source]]\nkind = 'rays'\nfile = 'source.dat'\n";
    std::fs::write(folder.path().join("scene.toml"), format!("{scene}{SCREEN}")).unwrap();
    let ends = |scene: &str, file: &str| {
        lampyris_in(folder.path(), &["trace", scene, "-o", "out", "-q", "--no-report", "--ends", file])
    };
    let (code, _, err) = ends("scene.toml", "ends.csv");
    assert_eq!(code, 0, "{err}");
    let text = std::fs::read_to_string(folder.path().join("ends.csv")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "source,ray,branch,event,face,bounces,x_mm,y_mm,z_mm,dx,dy,dz,power");
    assert_eq!(lines[1..], ["0,0,0,received,-1,0,-1,0,20,0,0,1,1", "0,1,0,received,-1,0,2,0,20,0,0,1,3"]);
    let (code, _, err) = ends("scene.toml", "ends.npz");
    assert_eq!(code, 0, "{err}");
    let mut zip = zip::ZipArchive::new(std::fs::File::open(folder.path().join("ends.npz")).unwrap()).unwrap();
    let mut power = Vec::new();
    std::io::Read::read_to_end(&mut zip.by_name("power.npy").unwrap(), &mut power).unwrap();
    assert_eq!(power[power.len() - 16..], [1f64.to_le_bytes(), 3f64.to_le_bytes()].concat());

    let (code, _, err) = ends("scene.toml", "ends.txt");
    assert!(code == 2 && err.contains(".npz or .csv"), "{err}");
    std::fs::write(folder.path().join("point.toml"), format!("[run]\nrays = 400\n[[source]]\n{SCREEN}")).unwrap();
    // Before facets are made, for which the part is looked for.
    let early = ["trace", "point.toml", "--ends", "ends.csv", "--part", "none=0.1", "-o", "out"];
    let (code, _, err) = lampyris_in(folder.path(), &early);
    assert!(code == 2 && err.contains("no source of this scene is a list of rays"), "{err}");
}

/// Parts of a run belong together by a hash of its files, which are read block by block: the same hash as of their bytes at once, so that
/// a ray file is not in memory a second time.
#[test]
fn a_file_that_is_read_in_blocks_hashes_as_its_bytes() {
    let bytes: Vec<u8> = (0..200_005u32).map(|k| (k * 7 % 251) as u8).collect();
    let mut hasher = FingerprintHasher::default();
    hasher.add(b"scene");
    hasher.add_read(bytes.len() as u64, &mut bytes.as_slice()).unwrap();
    assert_eq!(hasher.finish(), Fingerprint::new(&[b"scene", &bytes]));
    let mut hasher = FingerprintHasher::default();
    assert!(hasher.add_read(8, &mut [1, 2].as_slice()).is_err(), "a file that became shorter");
}

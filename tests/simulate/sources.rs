//! Sources on faces and from files, and the honesty of stated errors.

use crate::support::{Shape, World};
use lampyris::formats::{LightRay, PhotometricType, Photometry, write_data1, write_ies, write_rays};
use lampyris::math::{Frame, Homogeneous, Point, Uv, Vector};
use lampyris::model::{EdgeUse, Face, Model, TrimLoop};
use lampyris::nurbs::{Surface, UvCurve};
use lampyris::simulate::{RunSettings, Scene, rays_of_run, simulate};
use std::f64::consts::PI;
use std::path::Path;

const ALL: &str = "[[receiver]]\nname = 'all'\nkind = 'far_field'\nh_deg = [-180, 180]\ncells = [4, 2]\n";

/// A Lambertian sphere looks the same from everywhere: P/4π in every direction, and no ray meets its own surface.
#[test]
fn a_shining_sphere_shines_evenly() {
    let mut world = World::default();
    world.sphere("bulb", Point::new(3.0, 0.0, 0.0), 5.0);
    let text = format!(
        "[run]\nrays = 100_000\n[[source]]\nkind = 'lambertian'\npower = 12\non = {{ part = 'bulb' }}\n{ALL}"
    );
    let r = &world.run(&text, |_| ());
    assert_eq!(r.segments, r.rays, "no ray hits the sphere it leaves");
    for (cell, error) in r.receivers[0].cells.iter().zip(&r.receivers[0].errors) {
        assert!((cell - 12.0 / (4.0 * PI)).abs() < 4.0 * error + 1e-3, "{cell} ± {error}");
    }
}

/// Only the face that is named shines, outward.
#[test]
fn a_shining_face_of_a_box() {
    let mut world = World::default();
    world.cuboid("led", Point::new(-2.0, -1.0, 0.0), Point::new(2.0, 1.0, 0.3));
    let screen = "[[receiver]]\nname = 'near'\nat = [0, 0, 0.31]\nsize = [10, 10]\ncells = [10, 10]\n";
    let text = format!(
        "[run]\nrays = 50_000\n[[source]]\nkind = 'cosine'\nexponent = 1\non = {{ part = 'led', face = 'z1' }}\n{screen}{ALL}"
    );
    let r = world.run(&text, |_| ());
    assert_eq!(r.power.absorbed, 0.0);
    // 0.01 mm above the face the light is still where it left: RMS of an even 4 × 2 rectangle is 2/√3 and 1/√3.
    let rms = r.receivers[0].rms;
    assert!((rms[0] - 2.0 / 3f64.sqrt()).abs() < 0.02 && (rms[1] - 1.0 / 3f64.sqrt()).abs() < 0.02, "{rms:?}");
}

/// Knots say nothing of lengths: a flat face of 101 even spans, of which one is 18 of its 20 mm long, shines by area. The root mean square
/// of an even line of ±10 mm is 10/√3; of its ends alone it would be 9.5.
#[test]
fn a_face_shines_evenly_whatever_its_knots() {
    const SPANS: usize = 101;
    let mut world = World::default();
    world.part("sheet", false, &[("z1", Shape::Rectangle { frame: Frame::IDENTITY, half: [10.0, 1.0] })]);
    let x = |i: usize| if i < 50 { -10.0 + i as f64 / 49.0 } else { 9.0 + (i - 50) as f64 / 51.0 };
    let corners = (0..=SPANS).flat_map(|i| [-1.0, 1.0].map(|y| Point::new(x(i), y, 0.0)));
    let inner = (0..=SPANS).map(|knot| knot as f64);
    let surface = Surface {
        degree: [1, 1],
        knots: [std::iter::once(0.0).chain(inner).chain([SPANS as f64]).collect(), vec![-1.0, -1.0, 1.0, 1.0]],
        points: corners.map(|p| Homogeneous::new(p.x, p.y, p.z, 1.0)).collect(),
    };
    world.model.parts[0].shells[0].faces[0] = Face { name: "z1".into(), ..Face::whole(surface) };
    let text = "[run]\nrays = 50_000\n[[source]]\nkind = 'lambertian'\non = { part = 'sheet' }\n\
        [[receiver]]\nname = 'near'\nat = [0, 0, 0.001]\nsize = [22, 4]\ncells = [22, 4]\n";
    let rms = world.run(text, |_| ()).receivers[0].rms;
    assert!((rms[0] - 10.0 / 3f64.sqrt()).abs() < 0.05, "{rms:?}");
}

/// A face of 0.4 × 0.4 mm that is trimmed from a plane of 100 × 100 mm shines from where it is, and in no time.
#[test]
fn a_small_part_of_a_large_surface_shines_alone() {
    let mut world = World::default();
    world.part("patch", false, &[("z1", Shape::Rectangle { frame: Frame::IDENTITY, half: [50.0, 50.0] })]);
    let corners = [[19.8, 19.8], [20.2, 19.8], [20.2, 20.2], [19.8, 20.2]].map(Uv::from);
    let line = |k: usize| UvCurve::line(corners[k], corners[(k + 1) % 4], [0.0, 1.0]);
    let side = |k: usize| EdgeUse { edge: None, reversed: false, uv: line(k) };
    world.model.parts[0].shells[0].faces[0].loops = vec![TrimLoop { uses: (0..4).map(side).collect() }];
    let text = "[run]\nrays = 20_000\n[[source]]\nkind = 'lambertian'\non = { part = 'patch' }\n\
        [[receiver]]\nname = 'near'\nat = [0, 0, 0.001]\nsize = [100, 100]\ncells = [4, 4]\n";
    let r = &world.run(text, |_| ()).receivers[0];
    assert!((r.centroid[0] - 20.0).abs() < 0.02 && (r.centroid[1] - 20.0).abs() < 0.02, "{:?}", r.centroid);
}

#[test]
fn ray_lists_are_drawn_by_power() {
    let folder = tempfile::tempdir().unwrap();
    let ray = |x: f64, power: f64, nm: f64| LightRay {
        origin: Point::new(x, 0.0, 0.0),
        direction: Vector::Z,
        power,
        wavelength_nm: Some(nm),
    };
    let rays = [ray(-1.0, 1.0, 450.0), ray(2.0, 3.0, 650.0), ray(0.0, 0.0, 500.0)];
    let (csv, data) = (folder.path().join("rays.csv"), folder.path().join("rays.txt"));
    write_rays(&csv, &rays).unwrap();
    write_data1(&data, &rays).unwrap();
    let screen =
        "[[receiver]]\nname = 'x'\nat = [0, 0, 20]\nsize = [10, 10]\ncells = [1, 1]\nbins_nm = [400, 600, 700]\n";
    for (file, kind) in [(&csv, "rays"), (&data, "data_1")] {
        let source = format!("[[source]]\nkind = '{kind}'\nfile = '{}'\nat = [0, 0, 5]\n", file.display());
        let r = World::default().run(&format!("[run]\nrays = 4000\n{source}{screen}"), |_| ());
        let x = &r.receivers[0];
        assert!((r.power.emitted - 4.0).abs() < 1e-9 && (x.power - 4.0).abs() < 1e-9);
        assert!((x.centroid[0] - 1.25).abs() < 1e-9, "{:?}", x.centroid);
        if kind == "rays" {
            assert!((x.channels[0].total - 1.0).abs() < 1e-9 && (x.channels[1].total - 3.0).abs() < 1e-9);
        }
    }
}

/// A beam of one ray draws its wavelength alone, neither a place nor a direction, beside a point that draws its direction: half of the
/// power of two watts goes straight on, and few rays of each are all made together.
#[test]
fn rays_that_draw_a_wavelength_alone_are_made() {
    let beam = "[[source]]\nkind = 'collimated'\nat = [0, 0, 0]\ndirection = [0, 0, 1]\nspectrum = { kind = 'white_led' }\n";
    let point = "[[source]]\nkind = 'point'\nat = [0, 0, -30]\n";
    let ahead = "[[receiver]]\nname = 'ahead'\nat = [0, 0, 5]\nsize = [1e-3, 1e-3]\ncells = [1, 1]\n";
    for rays in [1000, 640_000] {
        let r = World::default().run(&format!("[run]\nrays = {rays}\n{beam}{point}{ahead}{ALL}"), |_| ());
        assert!((r.power.emitted - 2.0).abs() < 1e-9);
        assert!((r.receivers[0].power - 1.0).abs() < 1e-3, "{rays}: {}", r.receivers[0].power);
    }
}

/// What goes in as candela comes out as candela: an IES file of cosⁿ about its axis, n = 2, 100 cd at the peak.
#[test]
fn an_ies_file_comes_out_as_it_went_in() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("spot.ies");
    let gamma: Vec<f64> = (0..=90).map(f64::from).collect();
    let candela: Vec<f64> = gamma.iter().map(|g| 100.0 * g.to_radians().cos().powi(2)).collect();
    let photometry = Photometry {
        kind: PhotometricType::C,
        horizontal_deg: vec![0.0],
        vertical_deg: gamma,
        candela,
        lamp_lumens: None,
        watts: 1.0,
        opening_mm: [0.0; 3],
        keywords: vec![("TEST".into(), "none".into()), ("MANUFAC".into(), "none".into())],
    };
    write_ies(&path, &photometry).unwrap();
    let source = format!("[[source]]\nkind = 'ies'\nfile = '{}'\ndirection = [0, 0, -1]\n", path.display());
    let far = "[[receiver]]\nname = 'far'\nkind = 'far_field'\nangles = 'C'\nnormal = [0, 0, -1]\nv_deg = [0, 90]\ncells = [1, 9]\n";
    let r = World::default().run(&format!("[run]\nrays = 100_000\nunit = 'lm'\n{source}{far}"), |_| ());
    // Flux 2π·100/3; piecewise linear in γ, so a little less.
    assert!((r.power.emitted - 200.0 * PI / 3.0).abs() < 0.05, "{}", r.power.emitted);
    assert_eq!(r.receivers[0].unit, "cd");
    for (j, cell) in r.receivers[0].cells.iter().enumerate() {
        let c = |k: usize| (10.0 * k as f64).to_radians().cos();
        let mean = 100.0 / 3.0 * (c(j).powi(3) - c(j + 1).powi(3)) / (c(j) - c(j + 1));
        assert!((cell - mean).abs() < 0.3, "{j}: {cell} {mean}");
    }
}

/// A photometry with light around one direction alone: a thousand candela there, and none at the other angles.
fn single_peak(
    kind: PhotometricType,
    horizontal_deg: &[f64],
    vertical_deg: &[f64],
    peak: [usize; 2],
) -> Photometry {
    let rows = vertical_deg.len();
    let mut candela = vec![0.0; horizontal_deg.len() * rows];
    candela[peak[0] * rows + peak[1]] = 1000.0;
    Photometry {
        kind,
        horizontal_deg: horizontal_deg.to_vec(),
        vertical_deg: vertical_deg.to_vec(),
        candela,
        lamp_lumens: None,
        watts: 1.0,
        opening_mm: [0.0; 3],
        keywords: vec![("TEST".into(), "none".into()), ("MANUFAC".into(), "none".into())],
    }
}

/// The first side of a rectangle of 10 × 0.1 mm lies along `x` whatever the type of the file: along a side a the root mean square is a/√12.
#[test]
fn the_first_side_of_a_measured_source_lies_along_x() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("beam.ies");
    let across = [-90.0, -5.0, 0.0, 5.0, 90.0];
    for photometry in [
        single_peak(PhotometricType::A, &across, &across, [2, 2]),
        single_peak(PhotometricType::B, &across, &across, [2, 2]),
        single_peak(PhotometricType::C, &[0.0], &[0.0, 5.0, 90.0], [0, 0]),
    ] {
        write_ies(&path, &photometry).unwrap();
        for x in ["[1, 0, 0]", "[0, 1, 0]", "[3, 4, 0]"] {
            let source =
                format!("[[source]]\nkind = 'ies'\nfile = '{}'\nsize = [10, 0.1]\nx = {x}\n", path.display());
            let wall = format!("[[receiver]]\nname = 'wall'\nat = [0, 0, 1e-3]\nsize = [20, 20]\nx = {x}\n");
            let r = World::default().run(&format!("[run]\nrays = 20_000\nunit = 'lm'\n{source}{wall}"), |_| ());
            let [first, second] = r.receivers[0].rms;
            let told = format!("{:?}, {x}: {first} × {second} mm", photometry.kind);
            assert!((first - 10.0 / 12f64.sqrt()).abs() < 0.05, "{told}");
            assert!((second - 0.1 / 12f64.sqrt()).abs() < 5e-4, "{told}");
        }
    }
}

/// Type C as a source has the planes of a far field about the same direction where its `x` is what lies to the right of one who looks
/// along it, `normal` × `up`: light at C 60°, γ 30° comes there, 5° wide to all sides.
#[test]
fn a_source_of_type_c_has_the_planes_of_a_far_field() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lobe.ies");
    let planes = [0.0, 50.0, 60.0, 70.0, 360.0];
    let lobe = single_peak(PhotometricType::C, &planes, &[0.0, 25.0, 30.0, 35.0, 90.0], [2, 2]);
    write_ies(&path, &lobe).unwrap();
    let (up, slanted) = (Vector::Y, Vector::new(0.3, -0.2, 0.9));
    for (normal, up, key) in [
        (Vector::Z, up, ""),
        (-Vector::Z, up, ""),
        (Vector::X, up, ""),
        (Vector::new(1.0, 2.0, -2.0), up, ""),
        (Vector::new(1.0, 2.0, -2.0), slanted, "up = [0.3, -0.2, 0.9]\n"),
        // There is no upward along +y: +x stands for it.
        (Vector::Y, Vector::X, ""),
    ] {
        let (n, x) = (normal.to_array(), normal.cross(up).to_array());
        let source =
            format!("[[source]]\nkind = 'ies'\nfile = '{}'\ndirection = {n:?}\nx = {x:?}\n", path.display());
        let far = format!(
            "[[receiver]]\nname = 'far'\nkind = 'far_field'\nangles = 'C'\nnormal = {n:?}\n{key}h_deg = [0, 120]\nv_deg = [0, 60]\n"
        );
        let r = World::default().run(&format!("[run]\nrays = 20_000\nunit = 'lm'\n{source}{far}"), |_| ());
        let receiver = &r.receivers[0];
        let [c, gamma] = receiver.centroid;
        assert!((receiver.power / r.power.emitted - 1.0).abs() < 1e-9, "{n:?}: {}", receiver.power);
        // Rings of larger γ are longer, by some per cent over the width of the lobe.
        assert!((c - 60.0).abs() < 0.2 && (gamma - 30.0).abs() < 0.5, "{n:?}: C {c}°, γ {gamma}°");
    }
}

/// Stated errors cover the truth in 68 % and 95 % of 200 seeds, for random numbers and for nets.
#[test]
fn stated_errors_are_honest() {
    let mut world = World::default();
    world.cuboid("glass", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 3.0));
    // Half of the light of a cone meets the glass; Walsh's share is replaced by a plain count on half a plane.
    let receivers = "[[receiver]]\nname = 'quarter'\nat = [5, 5, -10]\nsize = [10, 10]\ncells = [1, 1]\n";
    let source = "[[source]]\nkind = 'lambertian'\nat = [0.3, 0.1, -20]\n";
    // Power on a rectangle from a Lambertian point: (1/2π) Σ edges γ (e·n), the exact form factor of a polygon.
    let truth = {
        let p = Vector::new(0.3, 0.1, -20.0);
        let corners = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]]
            .map(|[x, y]| (Vector::new(x, y, -10.0) - p).normalize());
        let edge = |i: usize| {
            let (a, b) = (corners[i], corners[(i + 1) % 4]);
            a.cross(b).normalize().z * a.dot(b).acos()
        };
        (0..4).map(edge).sum::<f64>() / (2.0 * PI)
    };
    for sampling in ["random", "sobol"] {
        let text = format!("[run]\nrays = 4096\nsampling = '{sampling}'\n{source}{receivers}");
        let scene = Scene::parse(&text, "test.toml", std::path::Path::new(".")).unwrap();
        let bound = scene.bind(&world.model).unwrap();
        let (mut one, mut two) = (0, 0);
        for seed in 0..200 {
            let settings = RunSettings { seed, threads: 1, ..RunSettings::from(&scene.run) };
            let r = &simulate(&bound, &world, &settings, &|_| true).receivers[0];
            let away = (r.power - truth).abs() / r.power_error;
            one += i32::from(away < 1.0);
            two += i32::from(away < 2.0);
        }
        // Binomial of 200: 136.5 ± 6.6 within one and 190.9 ± 2.9 within two standard errors; 3 sigma allowed.
        assert!((117..=156).contains(&one), "{sampling}: {one} of 200 within one standard error");
        assert!((182..=200).contains(&two), "{sampling}: {two} of 200 within two standard errors");
    }
}

/// The error of every cell of a map, over 200 seeds: cells of one run are not independent, so the share is that of all together.
#[test]
fn errors_of_cells_are_honest() {
    let world = World::default();
    let source = "[[source]]\nkind = 'lambertian'\nat = [0.3, 0.1, -20]\n";
    let receiver = "[[receiver]]\nname = 'map'\nat = [5, 5, -10]\nsize = [12, 12]\ncells = [4, 4]\n";
    let p = Vector::new(0.3, 0.1, -20.0);
    let truth = |k: usize| {
        let [x, y] = [(k % 4) as f64, (k / 4) as f64].map(|i| 3.0 * i - 1.0);
        let corners = [[x, y], [x + 3.0, y], [x + 3.0, y + 3.0], [x, y + 3.0]]
            .map(|[x, y]| (Vector::new(x, y, -10.0) - p).normalize());
        let edge = |i: usize| {
            let (a, b) = (corners[i], corners[(i + 1) % 4]);
            a.cross(b).normalize().z * a.dot(b).acos()
        };
        // W/m² on 9 mm².
        (0..4).map(edge).sum::<f64>() / (2.0 * PI) / 9e-6
    };
    for sampling in ["random", "sobol"] {
        let text = format!("[run]\nrays = 16384\nsampling = '{sampling}'\n{source}{receiver}");
        let scene = Scene::parse(&text, "test.toml", std::path::Path::new(".")).unwrap();
        let bound = scene.bind(&world.model).unwrap();
        let (mut one, mut two, mut all) = (0.0, 0.0, 0.0);
        for seed in 0..200 {
            let settings = RunSettings { seed, threads: 1, ..RunSettings::from(&scene.run) };
            let r = &simulate(&bound, &world, &settings, &|_| true).receivers[0];
            for k in 0..16 {
                let away = (r.cells[k] - truth(k)).abs() / r.errors[k];
                one += f64::from(away < 1.0);
                two += f64::from(away < 2.0);
                all += 1.0;
            }
        }
        // 3200 of them: ±0.025 and ±0.011 at three sigma were they independent; cells of one seed are nearly so.
        assert!((one / all - 0.6827f64).abs() < 0.03, "{sampling}: {} within one standard error", one / all);
        assert!((two / all - 0.9545f64).abs() < 0.015, "{sampling}: {} within two standard errors", two / all);
    }
}

/// Solid angle of a triangle seen from the origin (Van Oosterom and Strackee 1983).
fn solid_angle([a, b, c]: [Vector; 3]) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let below = la * lb * lc + a.dot(b) * lc + a.dot(c) * lb + b.dot(c) * la;
    2.0 * a.dot(b.cross(c)).abs().atan2(below)
}

/// The error of what a box absorbs on three faces together, whose ups and downs are not independent.
#[test]
fn errors_of_absorbed_flux_are_honest() {
    let mut world = World::default();
    world.cuboid("box", Point::splat(-1.0), Point::splat(1.0));
    let from = Vector::new(3.0, 2.5, 2.0);
    let truth = {
        let side = |axis: usize| {
            let corner = |u: f64, v: f64| {
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (1.0, u, v);
                Vector::from_array(p) - from
            };
            let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            solid_angle([a, b, c]) + solid_angle([a, c, d])
        };
        (0..3).map(side).sum::<f64>() / (4.0 * PI)
    };
    for sampling in ["random", "sobol"] {
        let text =
            format!("[run]\nrays = 4096\nsampling = '{sampling}'\n[[source]]\nkind = 'point'\nat = [3, 2.5, 2]\n");
        let scene = Scene::parse(&text, "test.toml", std::path::Path::new(".")).unwrap();
        let bound = scene.bind(&world.model).unwrap();
        let (mut one, mut two, mut sum) = (0, 0, 0.0);
        for seed in 0..200 {
            let settings = RunSettings { seed, threads: 1, ..RunSettings::from(&scene.run) };
            let r = simulate(&bound, &world, &settings, &|_| true);
            let absorbed = &r.absorbed[0];
            assert_eq!(absorbed.power, r.power.absorbed);
            let away = (absorbed.power - truth).abs() / absorbed.error;
            sum += absorbed.power / 200.0;
            one += i32::from(away < 1.0);
            two += i32::from(away < 2.0);
        }
        assert!((sum / truth - 1.0).abs() < 5e-3, "{sampling}: {sum}, not {truth}");
        // Binomial of 200: 136.5 ± 6.6 within one and 190.9 ± 2.9 within two standard errors; 3 sigma allowed.
        assert!((117..=156).contains(&one), "{sampling}: {one} of 200 within one standard error");
        assert!((182..=200).contains(&two), "{sampling}: {two} of 200 within two standard errors");
    }
}

/// 1 W at 450 nm and 1 W at 555 nm are lumens in the ratio of V(λ), 0.038 to 1; what a red filter lets through of a black body's lumens
/// is what the eye sees of that part.
#[test]
fn lumens_of_a_spectrum_are_those_that_the_eye_sees() {
    let bins = |spectrum: &str, bins: &str| -> Vec<f64> {
        let text = format!(
            "[run]\nrays = 100_000\nunit = 'lm'\n[[source]]\nkind = 'collimated'\npower = 100\nspectrum = {spectrum}\n\
             [[receiver]]\nname = 'r'\nat = [0, 0, 5]\nsize = [1, 1]\ncells = [1, 1]\nbins_nm = {bins}\n"
        );
        let scene = Scene::parse(&text, "test.toml", std::path::Path::new(".")).unwrap();
        let world = World::default();
        let bound = scene.bind(&world.model).unwrap();
        let r = simulate(&bound, &world, &RunSettings::from(&scene.run), &|_| true);
        r.receivers[0].channels.iter().map(|c| c.total).collect()
    };
    let lines = bins("{ kind = 'lines', values = [[450, 1], [555, 1]] }", "[400, 500, 600]");
    assert!(
        (lines[0] - 100.0 * 0.038 / 1.038).abs() < 0.01 && (lines[1] - 100.0 / 1.038).abs() < 0.01,
        "{lines:?}"
    );
    // 2856 K (illuminant A) from 620 nm on: 12.47 % of its lumens, by the CIE's table at 5 nm and Planck's law.
    let warm = bins("{ kind = 'black_body', kelvin = 2856 }", "[360, 620, 830]");
    assert!((warm[1] - 12.47).abs() < 0.05, "{warm:?}");
}

/// With two replicates only three quarters of all runs lie within two errors, which a reader must know.
#[test]
fn few_replicates_are_named() {
    let notes = |replicates: u32| {
        let scene = Scene::parse("[[source]]\nkind = 'point'\n", "test.toml", std::path::Path::new(".")).unwrap();
        let world = World::default();
        let settings = RunSettings { rays: 1000, replicates, ..RunSettings::from(&scene.run) };
        simulate(&scene.bind(&world.model).unwrap(), &world, &settings, &|_| true).notes
    };
    assert!(notes(2)[0].contains("12.71") && notes(8)[0].contains("2.36") && notes(32).is_empty());
}

/// A beam of radius 5 of which what lies beyond 3 from its axis, (arccos 0.6 − 0.48)/π = 0.1424 of it, starts half-way up a plate of 3 mm
/// that absorbs 1/mm: 1 − e^(−1.5) on the way out, and 1 − e^(−3) of what is left and reflected, 4 %.
#[test]
fn a_source_that_straddles_a_boundary_is_seen_with_two_replicates() {
    let mut world = World::default();
    world.cuboid("glass", Point::new(3.0, -50.0, 0.0), Point::new(50.0, 50.0, 3.0));
    let within = (0.6f64.acos() - 0.48) / std::f64::consts::PI;
    let expected = within * (1.0 - (-1.5f64).exp() + 0.04 * (-1.5f64).exp() * (1.0 - (-3.0f64).exp()));
    for seed in 1..5 {
        let text = format!(
            "[run]\nrays = 20000\nreplicates = 2\nseed = {seed}\n[[medium]]\nname = 'glass'\nindex = 1.5\n\
             absorption_per_mm = 1\n[[material]]\npart = 'glass'\nmedium = 'glass'\n\
             [[source]]\nkind = 'collimated'\nat = [0, 0, 1.5]\ndirection = [0, 0, 1]\nradius = 5\n"
        );
        let absorbed = world.run(&text, |_| ()).power.absorbed;
        assert!((absorbed / expected - 1.0).abs() < 0.03, "seed {seed}: {absorbed} {expected}");
    }
}

/// Of 120 beams 30 start within a plate of 3 mm that absorbs 1/mm, 30 before it, 30 on a black die, and 30 pass beside both: boxes show
/// which of so many start clear of all solids, and only those get no probe rays. What a pass absorbs is 1 − e^(−3), and 4 % turn back at
/// each face.
#[test]
fn of_many_sources_those_in_and_on_solids_are_seen() {
    let mut world = World::default();
    world.cuboid("glass", Point::new(0.0, -50.0, 0.0), Point::new(50.0, 50.0, 3.0));
    world.cuboid("die", Point::new(-50.0, -50.0, -2.0), Point::new(-40.0, 50.0, 0.0));
    let mut text = "[run]\nrays = 24000\n[[medium]]\nname = 'glass'\nindex = 1.5\nabsorption_per_mm = 1\n\
        [[material]]\npart = 'glass'\nmedium = 'glass'\n[[material]]\npart = 'die'\nsurface = 'absorber'\n"
        .to_string();
    for k in 0..30 {
        for [x, z] in [[25.0, 1.5], [25.0, -5.0], [-45.0, 0.0], [-20.0, 1.5]] {
            let at = format!("at = [{x}, {}, {z}]", 3 * k - 45);
            text +=
                &format!("[[source]]\nkind = 'collimated'\n{at}\ndirection = [0, 0, 1]\nradius = 1\npower = 1\n");
        }
    }
    let (reflected, passed) = (0.04, (-3.0f64).exp());
    let entered = (1.0 - passed) / (1.0 - reflected * passed);
    let half = (-1.5f64).exp();
    let expected = 30.0 * (0.96 * entered + 1.0 - half + half * reflected * entered);
    let r = world.run(&text, |_| ());
    let (absorbed, error) = (r.power.absorbed, r.power_errors.absorbed);
    assert!((absorbed - expected).abs() < 3.0 * error && error < 0.15, "{absorbed} ± {error}, not {expected}");
}

/// A source of a millionth of the power has one ray of 100,000: a note says which, and with rays of its own it says nothing.
#[test]
fn a_source_that_sends_next_to_no_rays_is_named() {
    let scene = |weak: &str| {
        format!(
            "[run]\nrays = 100_000\n[[source]]\npower = 1000\n[[source]]\nname = 'pilot lamp'\nat = [0, 0, 9]\npower = 0.001\n{weak}\n\
             [[receiver]]\nname = 'all'\nkind = 'far_field'\n"
        )
    };
    let notes = |weak: &str| World::default().run(&scene(weak), |_| ()).notes.join("\n");
    let note = notes("");
    assert!(note.contains("'pilot lamp' sends 1 of the") && note.contains("`rays`"), "{note}");
    assert_eq!(notes("rays = 10_000"), "");
}

/// The power of a source that is weak beside another is right where whole quanta resolve it, and else a note says so.
#[test]
fn a_source_that_is_weak_beside_another_keeps_its_power_or_is_named() {
    let mut world = World::default();
    world.sphere("ball", Point::new(50.0, 0.0, 0.0), 1.0);
    for (weak, share, is_told) in [(1e-3, 1e-6, false), (1e-7, 1e-3, true)] {
        let text = format!(
            "[run]\nrays = 20_000\n[[material]]\nsurface = 'absorber'\n\
             [[source]]\nkind = 'cone'\nhalf_angle_deg = 10\npower = 1e6\n\
             [[source]]\nname = 'weak'\nkind = 'cone'\nhalf_angle_deg = 10\ndirection = [0, 0, -1]\npower = {weak:e}\nrays = 20_000\n\
             [[receiver]]\nname = 'down'\nat = [0, 0, -10]\nsize = [10, 10]\n"
        );
        let found = world.run(&text, |_| ());
        let power = found.receivers[0].power;
        assert!((power / weak - 1.0).abs() < share, "{weak}: {power}");
        let notes = found.notes.join("; ");
        assert_eq!(notes.contains("the light of the source 'weak' is counted as"), is_told, "{weak}: {notes}");
    }
}

/// Each source has a ray in every part of a run: in 200 parts for as many replicates twenty thousand would have four million.
#[test]
fn many_sources_trace_as_many_rays_as_are_asked_for() {
    let source = "[[source]]\nkind = 'point'\n";
    let scene = Scene::parse(&source.repeat(20_000), "many.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&Model::default()).unwrap();
    for rays in [999_999, 1_000_000] {
        let traced = rays_of_run(&bound, &RunSettings { rays, ..RunSettings::default() });
        assert!(traced.abs_diff(rays) < 1000, "{traced} for {rays}");
    }
}

/// 200 beams of 100 rays each, in 128 replicates: all light arrives, and no replicate has much more of it than another.
#[test]
fn few_rays_of_many_sources_lie_in_all_replicates() {
    let beam = "[[source]]\nkind = 'collimated'\nat = [0, 0, 0]\ndirection = [0, 0, 1]\nradius = 1\n";
    let screen = "[[receiver]]\nname = 'screen'\nat = [0, 0, 5]\nsize = [4, 4]\ncells = [1, 1]\n";
    let r = World::default().run(&format!("[run]\nrays = 20_000\n{}{screen}", beam.repeat(200)), |_| ());
    let screen = &r.receivers[0];
    assert!(
        (screen.power - 200.0).abs() < 1e-6 && screen.power_error < 0.2,
        "{} {}",
        screen.power,
        screen.power_error
    );
}

/// Few rays have most of the power, and all may miss a place that gets much of it.
#[test]
fn a_source_of_few_heavy_rays_is_named() {
    let beams = |rays: u64| {
        format!(
            "[[source]]\nname = 'strong'\npower = 2\nrays = {rays}\nat = [0, 0, 0]\n[[source]]\nname = 'weak'\nrays = 10_000\nat = [0, 0, 1]\n"
        )
    };
    let notes = |rays| World::default().run(&format!("{}{ALL}", beams(rays)), |_| ()).notes.join("\n");
    // Two thirds of the power, of which n rays all miss a share of 1 − 0.05^(1/n) in one run of twenty: 0.776 of 2 and 0.0464 of 63.
    for (rays, missed) in [(2, "52"), (63, "3.1")] {
        let (notes, says) = (notes(rays), format!("'strong' has 67 % of the power in {rays} rays: printed errors"));
        let missing = format!("up to {missed} % of the power may be missing");
        assert!(notes.contains(&says) && notes.contains(&missing), "{notes}");
    }
    assert!(!notes(1000).contains("strong"), "{}", notes(1000));
    // All light of both arrives. Of 10 rays in 10 of 128 replicates the spread is √((1 − 10/128) / 10 · 128/127) all the same: 0.3048 of
    // two thirds; of 100 rays, each in a replicate of its own as well, 0.0470.
    for (rays, scatter, percent) in [(10, 0.304_82, "20"), (100, 0.046_96, "3.1")] {
        let run = World::default().run(&format!("{}{ALL}", beams(rays)), |_| ());
        let all = &run.receivers[0];
        assert!(
            (all.power - 3.0).abs() < 1e-9 && (all.power_error - 2.0 * scatter).abs() < 1e-3,
            "{}",
            all.power_error
        );
        let told =
            format!("too large by up to {percent} % where all arrive, as they lie in {rays} of 128 replicates");
        assert!(run.notes.iter().any(|note| note.contains(&told)), "{:?}", run.notes);
    }
    // One ray of next to no power: what it does is below the error of the others.
    let pilot = format!(
        "[[source]]\npower = 1000\nrays = 100_000\n[[source]]\nname = 'pilot'\npower = 0.02\nrays = 1\n{ALL}"
    );
    assert_eq!(World::default().run(&pilot, |_| ()).notes, Vec::<String>::new());
}

//! Scatter, coatings, colours, polarisation and bulk scatter in the path kernel, against closed forms.

use crate::support::{Shape, World};
use lampyris::math::{Frame, Point, Vector};
use lampyris::pipeline::ErrorTarget;
use lampyris::simulate::{QUANTA, RequiredEffects, Results, Scene};
use std::f64::consts::PI;

fn slab() -> World {
    let mut world = World::default();
    world.cuboid("glass", Point::new(-1e3, -1e3, -1e3), Point::new(1e3, 1e3, 0.0));
    world
}

/// A ray from above that meets the plane z = 0 at an angle of incidence, and the light that comes back up.
fn at_angle(incidence_deg: f64, materials: &str, source: &str) -> String {
    let a = incidence_deg.to_radians();
    let (x, z) = (a.sin(), -a.cos());
    format!(
        "{materials}
        [[source]]\nkind = 'collimated'\nat = [{}, 0, {}]\ndirection = [{x}, 0, {z}]\n{source}
        [[receiver]]\nname = 'up'\nkind = 'far_field'\nangles = 'C'\nv_deg = [0, 90]\ncells = [36, 18]\n",
        -10.0 * x,
        -10.0 * z
    )
}

const GLASS: &str = "[[medium]]\nname = 'glass'\nindex = 1.5\n[[material]]\npart = 'glass'\nmedium = 'glass'
    [[material]]\npart = 'glass'\nface = ['x*', 'y*', 'z0']\nsurface = 'absorber'\n";

fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() < tolerance, "{found}, not {expected}");
}

/// Goebel's multiplier: ρ/(1 − ρ(1 − f)) of the flux that first meets the wall, of which the port of share f gets f.
#[test]
fn an_integrating_sphere_multiplies_as_it_must() {
    for (rho, f, multiplier) in [(0.98, 0.05, 14.20290), (0.95, 0.02, 13.76812), (0.80, 0.01, 3.84615)] {
        let mut world = World::default();
        world.part("wall", false, &[("", Shape::Sphere { centre: Point::ZERO, radius: 10.0, outward: false })]);
        let z = 10.0 * (1.0 - 2.0 * f);
        // The port is the plane that cuts the cap of share f off.
        let text = format!(
            "default_surface = 'absorber'\n[run]\nrays = 50_000\npower_floor = 1e-8\n
            [[material]]\npart = 'wall'\nsurface = 'diffuse'\nreflectance = {rho}
            [[source]]\nkind = 'collimated'\ndirection = [0.6, 0, -0.8]
            [[receiver]]\nname = 'port'\nat = [0, 0, {z}]\nsize = [20, 20]\ncells = [1, 1]\n"
        );
        let r = world.run(&text, |_| ());
        let (power, error) = (r.receivers[0].power, r.receivers[0].power_error);
        assert!(
            error < 6e-3 && (power - f * multiplier).abs() < 4.0 * error,
            "{power} ± {error}, not {}",
            f * multiplier
        );
    }
}

/// In a closed diffuse room with a grey wall everything ends in the wall, after 1/(1 − ρ) hits on average.
#[test]
fn a_grey_enclosure_keeps_its_flux() {
    let mut world = World::default();
    world.cuboid("room", Point::splat(-1e3), Point::splat(1e3));
    // The faces of a box point outward; the light is inside, so the part must not be a sealed solid.
    world.model.parts[0].shells[0].closed = false;
    let text = "[run]\nrays = 20_000\npower_floor = 1e-9\n[[material]]\npart = 'room'\nsurface = 'diffuse'\nreflectance = 0.8\n[[source]]\nkind = 'point'\n";
    let r = world.run(text, |_| ());
    assert_eq!(r.lost_rays, 0);
    close(r.power.absorbed, 1.0, 1e-8);
}

/// Half-Gaussian: within 2σ of the specular direction lies 1 − e⁻² = 0.864665.
#[test]
fn a_gaussian_lobe_about_the_mirrored_ray() {
    let materials =
        "[[material]]\npart = 'glass'\nsurface = 'mirror'\nscatter = { lobe = 'gaussian', sigma_deg = 1 }\n";
    let text = format!("[run]\nrays = 400_000\n{}", at_angle(0.0, materials, ""))
        + "[[receiver]]\nname = 'core'\nkind = 'far_field'\nangles = 'C'\nv_deg = [0, 2]\ncells = [1, 1]\n";
    let r = slab().run(&text, |_| ());
    close(r.receivers[1].power, 0.864665, 4.0 * r.receivers[1].power_error + 1e-4);
    close(r.receivers[0].power, 1.0, 1e-12);
}

#[test]
fn a_mixed_surface_keeps_its_specular_share() {
    let materials =
        "[[material]]\npart = 'glass'\nsurface = 'mirror'\nreflectance = 0.9\nscatter = { share = 0.3 }\n";
    let text = format!("[run]\nrays = 100_000\n{}", at_angle(0.0, materials, ""))
        + "[[receiver]]\nname = 'specular'\nkind = 'far_field'\nangles = 'C'\nv_deg = [0, 0.01]\ncells = [1, 1]\n";
    let r = slab().run(&text, |_| ());
    close(r.receivers[0].power, 0.9, 1e-9);
    close(r.receivers[1].power, 0.63, 4.0 * r.receivers[1].power_error);
    // Lambertian part: 0.27 within γ has the share sin²γ.
    let within_30: f64 = (0..6)
        .flat_map(|j| (0..36).map(move |i| (i, j)))
        .map(|(i, j)| {
            let g = |k: usize| (k as f64 * 5.0).to_radians().cos();
            r.receivers[0].cell(i, j) * (2.0 * PI / 36.0) * (g(j) - g(j + 1))
        })
        .sum();
    close(within_30 - r.receivers[1].power, 0.27 * 0.25, 4e-3);
}

#[test]
fn coatings_reflect_transmit_and_absorb_their_shares() {
    let coat = |key: &str| format!("{GLASS}[[material]]\npart = 'glass'\nface = 'z1'\n{key}\n");
    for (key, angle, reflected) in [
        ("surface = 'coating'\nreflectance = 0.25\ntransmittance = 0.7", 30.0, 0.25),
        ("surface = 'coating'\ncoating = [[0, 550, 0.1, 0.8], [60, 550, 0.4, 0.4]]", 30.0, 0.25),
        ("surface = 'metal'\nmetal = [0.2, 3.0]", 0.0, 9.64 / 10.44),
        ("surface = 'mirror'\nreflectance = [[0, 0.5], [90, 0.95]]", 60.0, 0.8),
        ("surface = 'coating'\ntransmittance = 1.0", 45.0, 0.0),
    ] {
        let text = format!("[run]\nrays = 1000\ninterfaces = 'split'\n{}", at_angle(angle, &coat(key), ""));
        let r = slab().run(&text, |_| ());
        close(r.receivers[0].power, reflected, 1e-9);
        close(r.power.received + r.power.absorbed, 1.0, 1e-9);
    }
}

/// At Brewster's angle nothing polarised in the plane of incidence is reflected, and 0.147929 of what is polarised across it.
#[test]
fn polarised_light_at_brewsters_angle() {
    let brewster = 1.5f64.atan().to_degrees();
    for (field, reflected) in [("[0, 1, 0]", 0.147929), ("[1, 0, 1]", 0.0), ("[0.5, 1, 0.75]", f64::NAN)] {
        let text = at_angle(brewster, GLASS, &format!("polarised = {field}\n"));
        let text = format!("[run]\nrays = 1000\ninterfaces = 'split'\npolarisation = true\n{text}");
        let r = slab().run(&text, |_| ());
        if reflected.is_nan() {
            // The field's part along the plane is 0.5·cos + ... : the s share of the power is what the square of y says.
            let (d, e) = (Vector::new(1.5, 0.0, -1.0).normalize(), Vector::new(0.5, 1.0, 0.75));
            let across = e - d * e.dot(d);
            close(r.receivers[0].power, 0.147929 * across.y.powi(2) / across.length_squared(), 1e-6);
        } else {
            close(r.receivers[0].power, reflected, 1e-6);
        }
        assert_eq!(r.effects.kernel, "full");
    }
}

/// Unpolarised light reflected at Brewster's angle is wholly polarised: a second plate across it reflects nothing.
#[test]
fn two_crossed_plates_at_brewsters_angle_are_dark() {
    let b = 1.5f64.atan();
    // Light down the −z axis meets a plate that tilts it towards −x …
    let first = Frame::from_axis(Point::ZERO, Vector::new(b.sin(), 0.0, b.cos()), None);
    // … then along d1 meets a plate whose plane of incidence contains y: its normal is between −d1 and y.
    let d0 = -Vector::Z;
    let d1 = d0 - first.z * (2.0 * d0.dot(first.z));
    for (angle, name) in [(0.0f64, "parallel"), (0.5 * PI, "crossed")] {
        // A direction across d1, in the first plane of incidence or across it.
        let in_plane = d1.cross(Vector::Y).normalize();
        let across = in_plane * angle.cos() + Vector::Y * angle.sin();
        let normal = -d1 * b.cos() + across * b.sin();
        let second = Frame::from_axis(d1 * 50.0, normal, None);
        let plate = |f: Frame| [("front", Shape::Rectangle { frame: f, half: [20.0, 20.0] })];
        let mut world = World::default();
        world.part("first", false, &plate(first)).part("second", false, &plate(second));
        let out = d1 - normal * (2.0 * d1.dot(normal));
        let text = format!(
            "[run]\nrays = 1000\ninterfaces = 'split'\npolarisation = true\n
            [[medium]]\nname = 'glass'\nindex = 1.5\n[[material]]\npart = '*'\nmedium = 'glass'
            [[source]]\nkind = 'collimated'\nat = [0, 0, 30]\ndirection = [0, 0, -1]
            [[receiver]]\nname = 'out'\nat = [{}, {}, {}]\nnormal = [{}, {}, {}]\nsize = [5, 5]\ncells = [1, 1]\ninteractions = 2\n",
            d1.x * 50.0 + out.x * 30.0, d1.y * 50.0 + out.y * 30.0, d1.z * 50.0 + out.z * 30.0, out.x, out.y, out.z
        );
        let scene = text.as_str();
        let r = world.run(scene, |_| ());
        let expected = if name == "parallel" { 0.5 * 0.147929 * 0.147929 } else { 0.0 };
        close(r.receivers[0].power, expected, 1e-6);
    }
}

/// The refracted ray of each line of N-BK7, from its published indices, 10 mm below the surface at 45°.
#[test]
fn dispersion_parts_the_lines() {
    let depth = |n: f64| 10.0 * (0.5f64.sqrt() / n).asin().tan();
    let run = |lines: &str| -> Results {
        let text = at_angle(
            45.0,
            "[[material]]\npart = 'glass'\nmedium = 'N-BK7'\n[[material]]\nface = ['x*', 'y*', 'z0']\nsurface = 'absorber'\n",
            &format!("spectrum = {{ values = {lines} }}\n"),
        );
        let inside = "[[receiver]]\nname = 'in'\nat = [0, 0, -10]\nsize = [40, 40]\nbins_nm = [400, 600, 700]\ncells = [1, 1]\n";
        slab().run(&format!("[run]\nrays = 2048\ninterfaces = 'split'\n{text}{inside}"), |_| ())
    };
    let (f, c) = (1.522376, 1.514322);
    let blue = run("[[486.1327, 1]]");
    assert_eq!(blue.effects.kernel, "clear");
    close(blue.receivers[1].centroid[0], depth(f), 1e-5);
    close(run("[[656.2725, 1]]").receivers[1].centroid[0], depth(c), 1e-5);
    let both = run("[[486.1327, 1], [656.2725, 1]]");
    assert_eq!(both.effects.kernel, "coloured");
    let bins: Vec<f64> = both.receivers[1].channels.iter().map(|c| c.total).collect();
    let mean = (bins[0] * depth(f) + bins[1] * depth(c)) / (bins[0] + bins[1]);
    // Indices are published to six digits.
    close(both.receivers[1].centroid[0], mean, 1e-5);
    close(bins[0] / bins[1], 1.0, 5e-3);
}

/// D65 has the chromaticity (0.31272, 0.32903) of CIE 15.
#[test]
fn daylight_has_its_chromaticity() {
    let text = "[run]\nrays = 200_000\n[[source]]\nkind = 'collimated'\nspectrum = { kind = 'd65' }
        [[receiver]]\nname = 'screen'\nat = [0, 0, 10]\nsize = [1, 1]\ncells = [1, 1]\nchannels = 'xyz'\n";
    let r = World::default().run(text, |_| ());
    let xyz: Vec<f64> = r.receivers[0].channels.iter().map(|c| c.total).collect();
    let sum: f64 = xyz.iter().sum();
    close(xyz[0] / sum, 0.31272, 3e-4);
    close(xyz[1] / sum, 0.32903, 3e-4);
}

/// A ball of radius 10 and 0.05 events per mm: e^(−0.5) leaves unscattered from the middle, and nothing is lost.
#[test]
fn bulk_scatter_leaves_the_ballistic_share() {
    let mut world = World::default();
    world.sphere("fog", Point::ZERO, 10.0);
    for g in [0.0, 0.8] {
        let text = format!(
            "[run]\nrays = 200_000\n[[medium]]\nname = 'fog'\nindex = 1\nscatter_per_mm = 0.05\nanisotropy = {g}
            [[material]]\npart = 'fog'\nmedium = 'fog'
            [[source]]\nkind = 'collimated'\ninside = 'fog'
            [[receiver]]\nname = 'direct'\nkind = 'far_field'\nh_deg = [-180, 180]\ninteractions = 1
            [[receiver]]\nname = 'all'\nkind = 'far_field'\nh_deg = [-180, 180]\n"
        );
        let r = world.run(&text, |_| ());
        let direct = &r.receivers[0];
        assert!((direct.power - (-0.5f64).exp()).abs() < 4.0 * direct.power_error, "{}", direct.power);
        close(r.receivers[1].power, 1.0, 1e-9);
    }
}

/// A plane before a mirror that counts light after one reflection ends all of it on the way there, and says so; one that lets it pass
/// counts it on the way back.
#[test]
fn a_receiver_in_its_own_way_is_told() {
    let mut world = World::default();
    world.cuboid("plate", Point::new(-9.0, -9.0, 0.0), Point::new(9.0, 9.0, 1.0));
    for (absorbs, reflected) in [(true, 0.0), (false, 0.8)] {
        let r = world.run(
            &format!(
                "[run]\nrays = 200\n[[material]]\npart = 'plate'\nsurface = 'mirror'\nreflectance = 0.8
                [[source]]\nkind = 'collimated'\nat = [0, 0, -20]
                [[receiver]]\nname = 'back'\nat = [0, 0, -5]\nsize = [4, 4]\ncells = [1, 1]\ninteractions = 1\nabsorbs = {absorbs}\n"
            ),
            |_| (),
        );
        close(r.receivers[0].power, reflected, 1e-9);
        assert_eq!(r.notes.iter().any(|note| note.starts_with("'back' counts")), absorbs, "{:?}", r.notes);
    }
}

/// A ball of water inside a ball of glass inside air: a central ray meets all four faces and loses what Fresnel says.
#[test]
fn nested_bodies() {
    let mut world = World::default();
    world.sphere("glass", Point::ZERO, 10.0).sphere("water", Point::ZERO, 4.0);
    let text = "[run]\nrays = 1000\ninterfaces = 'split'\n
        [[medium]]\nname = 'glass'\nindex = 1.5\n[[medium]]\nname = 'wet'\nindex = 1.3333333333333333
        [[material]]\npart = 'glass'\nmedium = 'glass'\n[[material]]\npart = 'water'\nmedium = 'wet'
        [[source]]\nkind = 'collimated'\nat = [0, 0, -30]
        [[receiver]]\nname = 'on'\nat = [0, 0, 30]\nsize = [1, 1]\ncells = [1, 1]\ninteractions = 4\n";
    let r = world.run(text, |_| ());
    let t = |n: f64| 1.0 - ((n - 1.0) / (n + 1.0)).powi(2);
    close(r.receivers[0].power, (t(1.5) * t(1.125)).powi(2), 1e-9);
    assert_eq!((r.effects.kernel, r.lost_rays), ("nested", 0));
}

/// Two plates that touch, exactly or within the glue distance, and overlap by as much: one interface between them, no light lost.
#[test]
fn touching_plates_are_one_interface() {
    for gap in [0.0, 5e-4, -5e-4, 1e-13, -1e-13] {
        let mut world = World::default();
        world.cuboid("crown", Point::new(-50.0, -50.0, 0.0), Point::new(50.0, 50.0, 3.0));
        world.cuboid("flint", Point::new(-50.0, -50.0, 3.0 + gap), Point::new(50.0, 50.0, 7.0));
        for tilt in [0.0, 0.5] {
            let text = format!(
                "[run]\nrays = 200\nmax_bounces = 100\ninterfaces = 'split'\nsplit_floor = 0\n[[medium]]\nname = 'crown'\nindex = 1.5\n[[medium]]\nname = 'flint'\nindex = 1.7
                [[material]]\npart = 'crown'\nmedium = 'crown'\n[[material]]\npart = 'flint'\nmedium = 'flint'
                [[source]]\nkind = 'collimated'\nat = [0, 0, -20]\ndirection = [{tilt}, 0, 1]\nradius = 3
                [[receiver]]\nname = 'on'\nat = [0, 0, 40]\nsize = [200, 200]\ncells = [1, 1]\n"
            );
            let r = world.run(&text, |_| ());
            assert_eq!(r.lost_rays, 0, "gap {gap}, tilt {tilt}");
            if tilt == 0.0 {
                // All orders between three interfaces, by adding reflections of incoherent plates.
                let r12 = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
                let (a, b, c) = (r12(1.0, 1.5), r12(1.5, 1.7), r12(1.7, 1.0));
                let pair = |r: f64, s: f64| (r + s - 2.0 * r * s) / (1.0 - r * s);
                close(r.receivers[0].power, 1.0 - pair(pair(a, b), c), 1e-5);
            }
        }
    }
}

/// What a scene calls for is what its light can meet: a scatter of no share is none, a rough mirror is no coating, and a mirror that
/// reflects nothing is black.
#[test]
fn only_what_happens_is_said_to_be_simulated() {
    let effects = |material: &str| -> Vec<String> {
        let mut world = World::default();
        world.cuboid("box", Point::splat(-1.0), Point::splat(1.0));
        let text = format!("[[source]]\nat = [5, 4, 3]\n[[material]]\npart = 'box'\n{material}\n");
        let scene = Scene::parse(&text, "test.toml", std::path::Path::new(".")).unwrap();
        let required = RequiredEffects::new(&scene.bind(&world.model).unwrap());
        required.simulated.iter().map(|b| format!("{:?}", b.effect)).collect()
    };
    for (material, expected) in [
        ("surface = 'mirror'\nscatter = { lobe = 'gaussian', sigma_deg = 1, share = 0 }", &["Reflection"][..]),
        ("surface = 'mirror'\nscatter = { lobe = 'abg', abg = [0, 0.1, 2] }", &["Reflection"]),
        ("surface = 'mirror'\nscatter = { lobe = 'gaussian', sigma_deg = 1 }", &["Reflection", "SurfaceScatter"]),
        ("surface = 'diffuse'\nreflectance = 0.5", &["Reflection", "SurfaceScatter"]),
        ("surface = 'mirror'\nreflectance = 0", &[]),
        ("surface = 'coating'\nmedium = 'PMMA'\nreflectance = 1", &["Reflection", "Coating"]),
    ] {
        assert_eq!(effects(material), expected, "{material}");
    }
}

/// Bare faces count where they bound a medium: not those of a sheet in air beside a body that is coated all around.
#[test]
fn bare_faces_without_a_medium_are_none_for_light() {
    let mut world = World::default();
    world.cuboid("box", Point::splat(-1.0), Point::splat(1.0));
    world.cuboid("frame", Point::splat(5.0), Point::splat(6.0));
    for (coated, expected) in [("reflectance = 0.5\ntransmittance = 0.5\n", false), ("", true)] {
        let surface = if expected { "interface" } else { "coating" };
        let text = format!(
            "default_surface = 'interface'\n[[source]]\nat = [5, 4, 3]
            [[material]]\npart = 'box'\nmedium = 'PMMA'\nsurface = '{surface}'\n{coated}"
        );
        let scene = Scene::parse(&text, "test.toml", std::path::Path::new(".")).unwrap();
        let required = RequiredEffects::new(&scene.bind(&world.model).unwrap());
        let fresnel = required.simulated.iter().find(|b| format!("{:?}", b.effect) == "Fresnel");
        assert_eq!(fresnel.map(|b| b.because.as_str()), expected.then_some("6 bare or metal faces"));
    }
}

/// A filter leaves 2.6 quanta of each ray, which are counted as 3: no spread shows it, and the error is half a quantum of each. That is
/// 1/6 of what arrives, however many rays are traced.
#[test]
fn what_rounding_changes_behind_a_dense_filter_is_in_the_error() {
    let mut world = World::default();
    world.cuboid("filter", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 10.0));
    let text = format!(
        "[run]\nrays = 64_000\npower_floor = 0\n[[medium]]\nname = 'dense'\nindex = 1\nabsorption_per_mm = {}
        [[material]]\npart = 'filter'\nmedium = 'dense'
        [[source]]\nkind = 'collimated'\nat = [0, 0, -20]\nsize = [2, 2]
        [[receiver]]\nname = 'behind'\nat = [0, 0, 30]\nsize = [10, 10]\n",
        (QUANTA / 2.6).ln() / 10.0
    );
    let results = world.run(&text, |_| ());
    let behind = &results.receivers[0];
    let [off, error] = [behind.power - 2.6 / QUANTA, behind.power_error].map(|power| power * QUANTA);
    assert!((off - 0.4).abs() < 1e-6 && (error - 0.5).abs() < 1e-6, "{off} ± {error}");
    for (target, reached) in [("17%@behind", true), ("16%@behind", false)] {
        let result = ErrorTarget::parse(target).unwrap().result(&results);
        assert_eq!((result.reached, result.missing_rays), (reached, 0), "{result:?}");
    }
}

//! Closed forms through the path kernel: deviations, rainbows, retarders, photometry.

use crate::support::{Shape, World};
use lampyris::math::{Frame, Point, Vector};
use lampyris::simulate::{Results, Scene};
use std::f64::consts::PI;
use std::path::Path;

const GLASS: &str = "[[medium]]\nname = 'glass'\nindex = 1.5\n[[material]]\npart = 'glass'\nmedium = 'glass'\n";

fn rectangle(origin: Point, normal: Vector, half: [f64; 2]) -> Shape {
    Shape::Rectangle { frame: Frame::from_axis(origin, normal, Some(Vector::Y)), half }
}

/// Direction of the last segment of the path that was never split off.
fn main_way_out(r: &Results) -> Vector {
    let path: Vec<_> = r.paths.iter().filter(|v| v.ray == 0 && v.branch == 0).collect();
    (path[path.len() - 1].point - path[path.len() - 2].point).normalize()
}

/// An equilateral prism turns light by at least 37.180756° at n = 1.5 and 38.646699° in N-BK7 at 587.56 nm, and by what Snell's
/// law says twice at any other angle.
#[test]
fn a_prism_deviates_as_it_must() {
    let mut world = World::default();
    let (apex, half) = (60f64.to_radians(), 10.0);
    let side = |sign: f64| {
        let normal = Vector::new(sign * (0.5 * apex).cos(), 0.0, (0.5 * apex).sin());
        // The apex lies in the origin, the base below it.
        let down = Vector::new(sign * (0.5 * apex).sin(), 0.0, -(0.5 * apex).cos());
        rectangle(Point::ZERO + down * half, normal, [half, half])
    };
    let depth = 2.0 * half * (0.5 * apex).cos();
    let base = rectangle(Point::new(0.0, 0.0, -depth), -Vector::Z, [half, half]);
    world.part("glass", false, &[("left", side(-1.0)), ("right", side(1.0)), ("base", base)]);
    let deviation = |medium: &str, n: f64, incidence: Option<f64>| {
        // At least deviation inside runs along x; else by the incidence on the left side.
        let i = incidence.unwrap_or((n * (0.5 * apex).sin()).asin());
        let normal = Vector::new(-(0.5 * apex).cos(), 0.0, (0.5 * apex).sin());
        // Light comes from the base's side of the normal.
        let along = Vector::new(-(0.5 * apex).sin(), 0.0, -(0.5 * apex).cos());
        let d = -normal * i.cos() - along * i.sin();
        let from = Point::new(-(0.5 * apex).sin(), 0.0, -(0.5 * apex).cos()) * half - d * 20.0;
        let text = format!(
            "[run]\nrays = 16\ninterfaces = 'split'\n[[material]]\npart = 'glass'\nmedium = '{medium}'\n[[medium]]\nname = 'plain'\nindex = 1.5
            [[source]]\nkind = 'collimated'\nat = [{}, {}, {}]\ndirection = [{}, {}, {}]\n",
            from.x, from.y, from.z, d.x, d.y, d.z
        );
        let r = world.run(&text, |s| s.path_samples = 1);
        assert_eq!(r.lost_rays, 0);
        main_way_out(&r).angle_between(d).to_degrees()
    };
    let least = deviation("plain", 1.5, None);
    assert!((least - 37.180756).abs() < 1e-6, "{least}");
    let least = deviation("N-BK7", 1.5168, None);
    assert!((least - 38.646699).abs() < 1e-4, "{least}");
    for degrees in [35.0f64, 45.0, 60.0, 75.0] {
        let i = degrees.to_radians();
        let inside = (i.sin() / 1.5).asin();
        let out = (1.5 * (apex - inside).sin()).asin();
        let expected = (i + out - apex).to_degrees();
        let found = deviation("plain", 1.5, Some(i));
        assert!((found - expected).abs() < 1e-9, "{degrees}: {found}, not {expected}");
    }
}

/// A drop of n = 4/3 turns light by π + 2i − 4r after one reflection inside, 2π + 2i − 6r after two; extremes 137.9703° at
/// i = 59.3911° and 230.9781° at 71.8320°.
#[test]
fn rainbows_stand_where_they_must() {
    let mut world = World::default();
    world.sphere("drop", Point::ZERO, 1.0);
    let turned = |i: f64, inner: u32| {
        let text = format!(
            "[run]\nrays = 64\ninterfaces = 'split'\nsplit_floor = 0\npower_floor = 0\nmax_bounces = 8\n[[medium]]\nname = 'wet'\nindex = 1.3333333333333333
            [[material]]\npart = 'drop'\nmedium = 'wet'
            [[source]]\nkind = 'collimated'\nat = [{}, 0, -5]
            [[receiver]]\nname = 'sky'\nkind = 'far_field'\nangles = 'C'\ncells = [36, 18]\ninteractions = {}\n",
            i.sin(),
            inner + 2
        );
        let r = world.run(&text, |_| ());
        assert!(r.receivers[0].power > 0.0 && r.lost_rays == 0);
        r.receivers[0].centroid[1]
    };
    let closed = |i: f64, inner: u32| {
        let r = (0.75 * i.sin()).asin();
        let d = f64::from(inner) * PI + 2.0 * i - 2.0 * f64::from(inner + 1) * r;
        d.cos().acos().to_degrees()
    };
    for (inner, at, extreme) in [(1, 59.3911f64, 137.9703), (2, 71.8320, 360.0 - 230.9781)] {
        let bow = turned(at.to_radians(), inner);
        assert!((bow - extreme).abs() < 1e-4, "{inner}: {bow}, not {extreme}");
        for degrees in [10.0f64, 40.0, at - 5.0, at + 5.0, 85.0] {
            let i = degrees.to_radians();
            assert!((turned(i, inner) - closed(i, inner)).abs() < 1e-6, "{inner} at {degrees}");
        }
        let (before, after) = (turned((at - 3.0).to_radians(), inner), turned((at + 3.0).to_radians(), inner));
        // The first bow is a least deviation; of the second, what is seen from the front is the largest angle.
        let sign = if inner == 1 { 1.0 } else { -1.0 };
        assert!(sign * (before - bow) > 0.0 && sign * (after - bow) > 0.0, "{before} {bow} {after}");
    }
}

/// Two total reflections at 53.2585° or 50.2296° in n = 1.5 make linear light at 45° circular: behind the rhomb a plate at
/// Brewster's angle reflects half of 0.147929 whichever way it is turned. At another angle it depends on the way.
#[test]
fn a_fresnel_rhomb_makes_circular_light() {
    let reflected = |incidence_deg: f64, azimuth_deg: f64| {
        let a = incidence_deg.to_radians();
        let d = Vector::new(a.sin(), 0.0, a.cos());
        // Between the walls z = ±5: up, reflected, down, reflected, and out up again through a face across the light.
        let run = 10.0 * a.tan();
        let start = Point::new(-0.5 * run, 0.0, 0.0);
        let exit = Point::new(1.5 * run, 0.0, 0.0);
        let mut world = World::default();
        world.part(
            "glass",
            false,
            &[
                ("top", rectangle(Point::new(0.0, 0.0, 5.0), Vector::Z, [3.0, 3.0])),
                ("bottom", rectangle(Point::new(run, 0.0, -5.0), -Vector::Z, [3.0, 3.0])),
                ("exit", rectangle(exit - d * 1.0, d, [2.0, 2.0])),
            ],
        );
        // A plate behind it, turned about the light.
        let b = 1.5f64.atan();
        let (u, v) = (Vector::Y, d.cross(Vector::Y));
        let turn = azimuth_deg.to_radians();
        let across = u * turn.cos() + v * turn.sin();
        let normal = -d * b.cos() + across * b.sin();
        let at = exit + d * 30.0;
        let plate = Shape::Rectangle { frame: Frame::from_axis(at, normal, None), half: [8.0, 8.0] };
        world.part("plate", false, &[("front", plate)]);
        let out = d - normal * (2.0 * d.dot(normal));
        let screen = at + out * 20.0;
        // Linear at 45° to the plane of incidence: as much along y as across y and d.
        let field = u + v;
        let text = format!(
            "[run]\nrays = 64\ninterfaces = 'split'\npolarisation = true\n{GLASS}[[material]]\npart = 'plate'\nmedium = 'glass'
            [[source]]\nkind = 'collimated'\ninside = 'glass'\nat = [{}, 0, {}]\ndirection = [{}, 0, {}]\npolarised = [{}, {}, {}]
            [[receiver]]\nname = 'out'\nat = [{}, {}, {}]\nnormal = [{}, {}, {}]\nsize = [8, 8]\ncells = [1, 1]\ninteractions = 4\n",
            start.x, start.z, d.x, d.z, field.x, field.y, field.z,
            screen.x, screen.y, screen.z, out.x, out.y, out.z
        );
        let r = world.run(&text, |_| ());
        r.receivers[0].power / 0.96
    };
    let half = 0.5 * (5.0f64 / 13.0).powi(2);
    for incidence in [53.258512, 50.229561] {
        for azimuth in [0.0, 30.0, 45.0, 90.0, 135.0] {
            let found = reflected(incidence, azimuth);
            assert!((found - half).abs() < 1e-6, "{incidence} at {azimuth}: {found}, not {half}");
        }
    }
    let (along, across) = (reflected(70.0, 45.0), reflected(70.0, 135.0));
    assert!((along - across).abs() > 0.02 && (along + across - 2.0 * half).abs() < 1e-6, "{along} {across}");
}

/// A Lambertian disc of L = 1 and r = 1, seen from h = 2 on its axis, gives E = πr²/(r² + h²) = 0.628319: by reciprocity π times
/// the share of a small Lambertian patch that goes through the disc.
#[test]
fn a_lambertian_disc_on_its_axis() {
    let world = World::default();
    let text = "[run]\nrays = 400_000\n[[source]]\nkind = 'lambertian'\n
        [[receiver]]\nname = 'disc'\nkind = 'far_field'\nangles = 'C'\nv_deg = [0, 26.56505117707799]\ncells = [1, 1]\n";
    let r = &world.run(text, |_| ()).receivers[0];
    assert!((PI * r.power - 0.628319).abs() < 4.0 * PI * r.power_error + 1e-6, "{} ± {}", r.power, r.power_error);
}

/// A closed diffuse sphere of S = 96 m² with 10,000 lm: its wall gets Φρ/(S(1 − ρ)) from the wall.
#[test]
fn a_diffuse_enclosure_is_lit_by_itself() {
    let radius = (96e6 / (4.0 * PI)).sqrt();
    let mut world = World::default();
    world.part("wall", false, &[("", Shape::Sphere { centre: Point::ZERO, radius, outward: false })]);
    for (rho, lux) in [(0.2, 26.04), (0.5, 104.17), (0.8, 416.67), (0.9, 937.50), (0.95, 1979.17)] {
        let text = format!(
            "[run]\nrays = 20_000\nunit = 'lm'\npower_floor = 1e-8\n[[material]]\npart = 'wall'\nsurface = 'diffuse'\nreflectance = {rho}
            [[source]]\nkind = 'point'\npower = 10_000
            [[receiver]]\nname = 'inside'\nkind = 'sphere'\nradius = {}\nabsorbs = false\ncells = [4, 2]\n",
            radius * (1.0 - 1e-9)
        );
        let r = world.run(&text, |_| ());
        // Light crosses a sphere just inside the wall once on its first way and twice for every reflection.
        let inside = &r.receivers[0];
        let again = 0.5 * (inside.power - 10_000.0) / 96.0;
        let error = 0.5 * inside.power_error / 96.0;
        assert!((again - lux).abs() < 4.0 * error + 0.006, "{rho}: {again} ± {error}, not {lux}");
    }
}

/// A closed void holds what is around the solid: water, where the scene lies in water. In air nobody expects anything else.
#[test]
fn a_void_within_a_scene_under_water_is_told_to_be_full_of_it() {
    let ball = |radius, outward| Shape::Sphere { centre: Point::ZERO, radius, outward };
    let mut hollow = World::default();
    hollow.part("glass", true, &[("outside", ball(5.0, true))]);
    hollow.part("void", true, &[("inside", ball(3.0, false))]);
    hollow.model.instances.pop();
    let mut void = hollow.model.parts.pop().unwrap().shells.pop().unwrap();
    void.void = true;
    hollow.model.parts[0].shells.push(void);
    let notes_with = |world: &World, surroundings: &str, core: &str| {
        let text = format!("{surroundings}\n{GLASS}[[source]]\nat = [0, 0, 20]\n{core}");
        Scene::parse(&text, "void.toml", Path::new(".")).unwrap().bind(&world.model).unwrap().notes().join("\n")
    };
    let notes = |world: &World, surroundings: &str| notes_with(world, surroundings, "");
    let water = "ambient = 'water'";
    let told = notes(&hollow, water);
    assert!(told.contains("the closed void in 'glass' (glass) holds 'water'"), "{told}");
    assert_eq!(notes(&hollow, "ambient = 'air'\n[[medium]]\nname = 'air'\nindex = 1.0003"), "");
    // A solid that fills the void, clear or opaque.
    hollow.sphere("core", Point::ZERO, 3.0);
    for optics in ["medium = 'PMMA'", "surface = 'absorber'"] {
        assert_eq!(notes_with(&hollow, water, &format!("[[material]]\npart = 'core'\n{optics}\n")), "");
    }
}

/// Light that leaves the scene has a way without end before it: in surroundings that absorb or scatter no far field gets any, which is
/// reported.
#[test]
fn a_far_field_in_surroundings_that_absorb_or_scatter_is_told_to_be_dark() {
    let world = World::default();
    let notes = |medium: &str, kind: &str| {
        let text = format!(
            "ambient = 'fog'\n[run]\nrays = 100\n[[medium]]\nname = 'fog'\nindex = 1.0\n{medium}\n\
             [[source]]\n[[receiver]]\nname = 'r'\n{kind}\n"
        );
        Scene::parse(&text, "fog.toml", Path::new(".")).unwrap().bind(&world.model).unwrap().notes().join("\n")
    };
    let far = "kind = 'far_field'";
    for (medium, does) in [
        ("absorption_per_mm = 1e-5", "absorbs light"),
        ("scatter_per_mm = 1e-5", "scatters light"),
        ("absorption_per_mm = 1e-5\nscatter_per_mm = 1e-5", "absorbs and scatters light"),
    ] {
        let told = notes(medium, far);
        assert!(told.contains("the far field 'r' lies without end away in 'fog'") && told.contains(does), "{told}");
        assert_eq!(notes(medium, "kind = 'sphere'\nradius = 10"), "");
    }
    assert_eq!(notes("", far), "");
}

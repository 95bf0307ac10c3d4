//! Light through curved faces of two bodies that touch, on facets of the default tolerance: none is lost or misled between them.

use crate::turned::{assembly, ball_in_cup, doublet, lens, ring_in_groove, rod_in_hole, rod_in_plate, turned};
use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Intersector, NormalMode};
use lampyris::math::{Frame, Point, Vector};
use lampyris::model::Model;
use lampyris::nurbs::{Curve, conic};
use lampyris::simulate::{BoundScene, Results, RunSettings, Scene, simulate};
use lampyris::tessellate::{self, tessellate};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

/// Traces a scene on facets of the default tolerance.
pub(crate) fn on_facets(model: &Model, text: &str) -> Results {
    let (scene, bound) = bind(model, text);
    let mesh = tessellate(model, &tessellate::Settings { glue_mm: scene.run.glue_mm, ..Default::default() }).mesh;
    run(&scene, &bound, &Octree::build(&mesh, &octree::Settings::default()))
}

/// Traces a scene on the spline.
pub(crate) fn on_spline(model: &Model, text: &str) -> Results {
    let (scene, bound) = bind(model, text);
    run(&scene, &bound, &Exact::build(model, &exact::Settings::default()))
}

fn bind(model: &Model, text: &str) -> (Scene, BoundScene) {
    let scene = Scene::parse(text, "test.toml", Path::new(".")).unwrap();
    let bound = scene.bind(model).unwrap();
    (scene, bound)
}

fn run(scene: &Scene, bound: &BoundScene, intersector: &dyn Intersector) -> Results {
    let settings = RunSettings { threads: 2, ..RunSettings::from(&scene.run) };
    simulate(bound, intersector, &settings, &|_| true)
}

fn scene(parts: [(&str, f64); 2], source: &str) -> String {
    let medium = |(part, index): (&str, f64)| {
        format!(
            "[[medium]]\nname = 'of {part}'\nindex = {index}\n[[material]]\npart = '{part}'\nmedium = 'of {part}'\n"
        )
    };
    let receiver =
        "[[receiver]]\nname = 'far'\nat = [0, 0, 60]\nnormal = [0, 0, 1]\nsize = [60, 60]\ncells = [4, 4]\n";
    let [a, b] = parts.map(medium);
    format!("[run]\nrays = 20000\n{a}{b}{receiver}[[source]]\n{source}\n")
}

/// What is lost, as a share of what is emitted, and how far the receiver's power is from that on the spline.
fn check(name: &str, model: &Model, text: &str) {
    let [facets, spline] = [on_facets(model, text), on_spline(model, text)];
    let emitted = facets.power.emitted;
    assert!(facets.power.lost <= 1e-6 * emitted, "{name}: {:?} {:?}", facets.power, facets.ledger.first());
    assert!(facets.notes.is_empty(), "{name}: {:?}", facets.notes);
    let [on_facets, on_spline] = [&facets, &spline].map(|r| r.receivers[0].power / emitted);
    assert!((on_facets - on_spline).abs() < 0.01, "{name}: {on_facets} on facets, {on_spline} on the spline");
}

#[test]
fn light_passes_a_cemented_doublet() {
    let text = scene(
        [("crown", 1.517), ("flint", 1.62)],
        "kind = 'collimated'\nat = [0, 0, -10]\ndirection = [0, 0, 1]\nradius = 9\npower = 1",
    );
    check("doublet", &doublet(12.0, 0.7), &text);
}

#[test]
fn light_passes_a_rod_in_its_hole() {
    let text = scene(
        [("rod", 1.5), ("block", 1.6)],
        "kind = 'cone'\nhalf_angle_deg = 40\nat = [0.3, 0.2, 4]\ndirection = [0, 0, 1]",
    );
    check("rod", &rod_in_hole(0.4), &text);
}

/// A block turned so that samples of both rims lie nearly, but not quite, together: within the glue distance.
#[test]
fn light_passes_a_rod_whose_rims_are_divided_nearly_alike() {
    let text = scene(
        [("rod", 1.5), ("block", 1.6)],
        "kind = 'cone'\nhalf_angle_deg = 40\nat = [0.3, 0.2, 4]\ndirection = [0, 0, 1]",
    );
    for parts in [2.0, 3.0, 4.0, 6.0, 8.0, 12.0] {
        check("rod", &rod_in_hole(TAU / parts + 1e-4), &text);
    }
}

/// A rod that stands in its hole with one end, or not to the ends of the hole: only a part of one or of both faces is shared.
#[test]
fn light_passes_a_rod_partly_in_its_hole() {
    let cone = "kind = 'cone'\nhalf_angle_deg = 60\nat = [0.4, 0.3, 1.2]\ndirection = [0, 0, 1]";
    let text =
        scene([("rod", 1.5), ("plate", 1.6)], cone).replace("rays = 20000", "rays = 2000\nmax_bounces = 100");
    for (name, ends) in [("half", [1.0, 7.0]), ("one end flush", [0.0, 7.0]), ("short", [0.5, 2.5])] {
        for from in [0.0, 0.6] {
            check(name, &rod_in_plate(ends, from), &text);
        }
    }
}

/// Rods of radius 2 end to end in plates one on the other, between these heights; each is turned by `turn` against the one before, and
/// each plate is wider than the one before.
fn stack(rods: &[[f64; 2]], plates: &[[f64; 2]], turn: f64) -> Model {
    let rod = |&[bottom, top]: &[f64; 2]| profile(&[[0.0, bottom], [2.0, bottom], [2.0, top], [0.0, top]]);
    let plate = |(k, &[bottom, top]): (i32, &[f64; 2])| {
        let rim = 6.0 + 0.5 * f64::from(k);
        profile(&[[2.0, bottom], [rim, bottom], [rim, top], [2.0, top], [2.0, bottom]])
    };
    let plates = (0..).zip(plates).map(|p| ("plate", plate(p)));
    let all = rods.iter().map(|r| ("rod", rod(r))).chain(plates);
    assembly((0..).zip(all).map(|(k, (name, p))| turned(name, &p, turn * f64::from(k))).collect())
}

/// Each plate touches two rods, or each rod two plates, or both: a chain in which every face touches the next. Seams lie far apart, nearly
/// where the other is divided, or nearly, within the glue distance, on each other.
#[test]
fn light_passes_bodies_that_touch_in_turn() {
    let cone = "kind = 'cone'\nhalf_angle_deg = 60\nat = [0.4, 0.3, 1.2]\ndirection = [0, 0, 1]";
    let text =
        scene([("rod", 1.5), ("plate", 1.6)], cone).replace("rays = 20000", "rays = 2000\nmax_bounces = 100");
    for (name, rods, plates) in [
        ("two plates", vec![[0.0, 8.0]], vec![[0.0, 3.0], [3.0, 8.0]]),
        ("two rods", vec![[0.0, 3.0], [3.0, 8.0]], vec![[0.0, 8.0]]),
        ("two by two", vec![[0.0, 5.0], [5.0, 8.0]], vec![[0.0, 3.0], [3.0, 8.0]]),
        ("in turn", vec![[-1.0, 4.0], [4.0, 8.0]], vec![[0.0, 2.0], [2.0, 6.0], [6.0, 9.0]]),
    ] {
        for turn in [0.0, 0.4, TAU / 4.0 + 1e-4, 1e-4] {
            check(&format!("{name}, {turn}"), &stack(&rods, &plates, turn), &text);
        }
    }
}

#[test]
fn light_passes_a_ball_in_its_cup() {
    let text = scene(
        [("ball", 1.5), ("cup", 1.6)],
        "kind = 'collimated'\nat = [0, 0, -20]\ndirection = [0, 0, 1]\nradius = 7\npower = 1",
    );
    check("ball", &ball_in_cup(1.1), &text);
}

/// A ball keeps the incidence of light that goes round in it, so that what came in can get out. Bilinear normals do not, and catch some of
/// it near the critical angle; cubic ones do.
#[test]
fn cubic_normals_catch_no_light_in_a_ball() {
    let text = scene(
        [("ball", 1.7), ("cup", 1.52)],
        "kind = 'collimated'\nat = [0, 0, -20]\ndirection = [0.05, 0.02, 1]\nradius = 9\npower = 1",
    );
    let model = ball_in_cup(1.1);
    let (scene, bound) = bind(&model, &text.replace("rays = 20000", "rays = 200000"));
    let mesh = tessellate(&model, &tessellate::Settings { glue_mm: scene.run.glue_mm, ..Default::default() }).mesh;
    let [bilinear, cubic] = [NormalMode::Bilinear, NormalMode::Cubic].map(|normals| {
        run(&scene, &bound, &Octree::build(&mesh, &octree::Settings { normals, ..Default::default() }))
    });
    assert_eq!((cubic.caught_rays, cubic.power.lost), (0, 0.0), "{:?}", cubic.power);
    assert!(bilinear.power.cut_off < 1e-3 && bilinear.power.lost == 0.0, "{:?}", bilinear.power);
    println!("caught with bilinear normals: {}", bilinear.power.cut_off);
}

#[test]
fn light_passes_a_ring_in_its_groove() {
    let text = scene(
        [("ring", 1.4), ("groove", 1.6)],
        "kind = 'collimated'\nat = [20, 0, -8]\ndirection = [0, 0, 1]\nradius = 1.5\npower = 1",
    );
    check("ring", &ring_in_groove(0.9), &text);
}

fn at(r: f64, z: f64) -> Point {
    Point::new(r, 0.0, z)
}

fn profile(points: &[[f64; 2]]) -> Vec<Curve> {
    points.windows(2).map(|w| Curve::line(at(w[0][0], w[0][1]), at(w[1][0], w[1][1]), [0.0, 1.0])).collect()
}

/// An arc about (0, z) from an angle over the horizontal up to the axis.
fn cap(z: f64, radius: f64, from: f64) -> Curve {
    conic::arc(&Frame::from_axis(at(0.0, z), -Vector::Y, Some(Vector::X)), radius, [from, FRAC_PI_2])
}

/// The second lens ends within the first, or is a cubic spline through the sphere that they share, with a parametrisation of its own.
#[test]
fn light_passes_doublets_whose_faces_differ() {
    let text = scene(
        [("crown", 1.517), ("flint", 1.62)],
        "kind = 'collimated'\nat = [0, 0, -10]\ndirection = [0, 0, 1]\nradius = 9\npower = 1",
    );
    check("smaller flint", &doublet(10.0, 0.7), &text);
    let angles: Vec<f64> = (0..=16).map(|k| (12.0f64 / 40.0).asin() * f64::from(k) / 16.0).collect();
    let points: Vec<Point> = angles.iter().map(|t| at(40.0 * t.sin(), 40.0 * t.cos() - 32.0)).collect();
    let slopes: Vec<Vector> = angles.iter().map(|t| at(40.0 * t.cos(), -40.0 * t.sin())).collect();
    let front = Curve::hermite(&angles, &points, &slopes);
    let back = cap(-109.0, 120.0, (12.0f64 / 120.0).acos());
    let rim = Curve::line(front.evaluate(angles[16]), back.evaluate(back.domain()[0]), [0.0, 1.0]);
    let crown = lens("crown", [0.0, 8.0], [60.0, -40.0], 12.0, 0.0);
    check("fitted flint", &assembly(vec![crown, turned("flint", &[front, rim, back], 0.7)]), &text);
}

/// A round die with a flat or a curved top in the pocket of its dome.
#[test]
fn light_passes_from_a_die_into_its_dome() {
    let text = scene([("die", 2.4), ("dome", 1.41)], "kind = 'point'\nat = [0.1, 0.2, 0.2]\npower = 1");
    let text = text.replace("rays = 20000", "rays = 2000");
    let top = cap(0.4 - 3f64.sqrt(), 2.0, (3f64.sqrt() / 2.0).asin());
    let flat = Curve::line(at(1.0, 0.4), at(0.0, 0.4), [0.0, 1.0]);
    for (name, top) in [("flat die", flat), ("curved die", top)] {
        let mut die = profile(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.4]]);
        die.push(top.clone());
        let mut dome = vec![top.reversed()];
        dome.extend(profile(&[[1.0, 0.4], [1.0, 0.0], [5.0, 0.0]]));
        dome.push(cap(0.0, 5.0, 0.0));
        let model = assembly(vec![turned("die", &die, 0.0), turned("dome", &dome, 0.9)]);
        for (surface, found) in [("facets", on_facets(&model, &text)), ("spline", on_spline(&model, &text))] {
            let power = &found.power;
            assert!(power.lost <= 1e-6 * power.emitted, "{name}, {surface}: {:?}", found.ledger.first());
            assert!(found.notes.is_empty(), "{name}, {surface}: {:?}", found.notes);
            assert!(found.receivers[0].power > 0.04 * power.emitted, "{name}, {surface}: {power:?}");
        }
    }
}

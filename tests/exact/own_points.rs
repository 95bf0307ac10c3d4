//! Rays that leave a face at a small sine and meet it again nearby, on parts of a micrometre, of 100 mm and of 10 km: on the spline, and by
//! facets that are polished.

use crate::support::*;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::polish::Polished;
use lampyris::intersect::{Certainty, Cost, Intersector};
use lampyris::math::{Departure, FaceId, Frame, Homogeneous, Point, Ray, Uv, Vector};
use lampyris::nurbs::{Surface, sweep};
use lampyris::tessellate;
use std::f64::consts::{FRAC_PI_2, PI};

/// The bowl `z = (x² + y²) / 2` over the square of ±0.5, times `size` and moved by `shift`. The weights of its rows and columns grow by
/// `speed` from one to the next: a place of the plane keeps its height, and parameters run unevenly.
struct Bowl {
    size: f64,
    shift: Vector,
    speed: [f64; 2],
}

impl Bowl {
    fn surface(&self) -> Surface {
        // Control points of x and of x² over [−0.5, 0.5].
        let (x, square) = ([-0.5, 0.0, 0.5], [0.25, -0.25, 0.25]);
        let mut points = Vec::new();
        for i in 0..3 {
            for j in 0..3 {
                let p = self.size * Point::new(x[i], x[j], 0.5 * (square[i] + square[j])) + self.shift;
                let weight = self.speed[0].powi(i as i32) * self.speed[1].powi(j as i32);
                points.push(Homogeneous::from((p * weight, weight)));
            }
        }
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        Surface { degree: [2, 2], knots: [knots.clone(), knots], points }
    }

    /// The parameter, in direction `d`, of a place that is a share `x` of the way through.
    fn parameter(&self, d: usize, x: f64) -> f64 {
        // B₁/B₀-weights of w^i: the projective map of the unit interval that takes s to w·s / (1 − s + w·s).
        x / (x + self.speed[d] * (1.0 - x))
    }
}

/// How many chords were asked for, flagged and lost.
#[derive(Debug, Default, PartialEq)]
struct Count {
    asked: usize,
    flagged: usize,
    wrong: Vec<String>,
}

/// Leaves a bowl inward and outward at sines down to 1e-7: inward the ray meets it again after twice the sine over the curvature.
fn leave(bowl: &Bowl, rays: usize, seed: u64) -> Count {
    let surface = bowl.surface();
    let exact = Exact::build(&model([surface.clone()]), &Settings::default());
    let mut s = Random(seed);
    let mut count = Count::default();
    for _ in 0..rays {
        let share = [s.within(0.1, 0.9), s.within(0.1, 0.9)];
        let uv = Uv::new(bowl.parameter(0, share[0]), bowl.parameter(1, share[1]));
        let origin = surface.evaluate(uv);
        let at = (origin - bowl.shift) / bowl.size;
        let (x, y) = (at.x, at.y);
        let normal = Vector::new(-x, -y, 1.0).normalize();
        let tangent = normal.cross(s.direction()).normalize();
        let sine = 10f64.powf(s.within(-7.0, -1.0)) * if s.unit() < 0.2 { -1.0 } else { 1.0 };
        let d = (tangent + normal * sine).normalize();
        let ray =
            Ray::new(origin, d).with_departure(Departure { face: FaceId(0), primitive: 0, uv, triangle: None });
        // The height over the bowl, τ·rise − τ²·bend/2, vanishes at the start and once more.
        let (rise, bend) = (d.z - x * d.x - y * d.y, d.x * d.x + d.y * d.y);
        let chord = 2.0 * rise / bend;
        let end = [x + chord * d.x, y + chord * d.y];
        let meets = chord > 0.0 && end.iter().all(|x| x.abs() < 0.499);
        // Shorter chords are the own point to the ninth digit and some; beside the rim nothing is checked.
        if chord.abs() < 2e-6 || chord > 0.0 && !meets && end.iter().all(|x| x.abs() < 0.501) {
            continue;
        }
        count.asked += 1;
        let answer = exact.first(&ray, &mut Cost::default());
        if answer.certainty != Certainty::Certified {
            count.flagged += 1;
            continue;
        }
        // The start is rounded where it stands, and strays along the ray by that over the sine.
        let reach = bowl.size + bowl.shift.abs().max_element();
        let tolerance = 1e-9 * bowl.size + 64.0 * f64::EPSILON * reach / sine.abs();
        let t = chord * bowl.size;
        if chord.abs() * bowl.size < 8.0 * tolerance {
            continue;
        }
        let right = answer.hit.map_or(!meets, |hit| meets && (hit.t - t).abs() <= tolerance);
        if !right {
            count.wrong.push(format!("{:?} for {t} at {sine:e}, {uv}", answer.hit.map(|h| h.t)));
        }
    }
    count
}

#[test]
fn a_chord_is_found_whatever_the_size_of_its_part() {
    for (seed, size) in (1u64..).zip([1e-3, 0.05, 100.0, 1e7]) {
        for speed in [[1.0, 1.0], [7.0, 0.3], [0.02, 9.0]] {
            let bowl = Bowl { size, shift: Vector::ZERO, speed };
            let count = leave(&bowl, 3000, seed);
            let Count { asked, flagged, wrong } = &count;
            assert!(
                wrong.is_empty(),
                "{} of {asked} on {size} mm: {:?}",
                wrong.len(),
                &wrong[..wrong.len().min(5)]
            );
            assert!(*asked > 1500 && flagged * 50 < *asked, "{flagged} of {asked} flagged on {size} mm");
        }
    }
}

#[test]
fn a_chord_is_found_far_from_the_origin() {
    let shift = Vector::new(3e5, -2e5, 1e5);
    let count = leave(&Bowl { size: 100.0, shift, speed: [3.0, 0.5] }, 3000, 9);
    assert!(count.wrong.is_empty() && count.asked > 1500 && count.flagged * 20 < count.asked, "{count:?}");
}

/// Leaves a bowl inward from polished hits, at sines down to 1e-5.
fn leave_polished(bowl: &Bowl, rays: usize, seed: u64) -> Count {
    let model = model([bowl.surface()]);
    let settings = tessellate::Settings { measure: false, ..tessellate::Settings::uniform(1e-5 * bowl.size) };
    let mesh = tessellate::tessellate(&model, &settings).mesh;
    let exact = Exact::build(&model, &Settings::default());
    let facets = Octree::build(&mesh, &octree::Settings::default());
    let polished = Polished::new(&facets, &mesh, &exact);
    let mut s = Random(seed);
    let mut count = Count::default();
    for _ in 0..rays {
        let place = Point::new(s.within(-0.4, 0.4), s.within(-0.4, 0.4), 2.0);
        let down = Ray::new(bowl.size * place, -Vector::Z);
        let first = polished.intersect(&down, &mut Cost::default()).expect("the bowl lies below");
        let origin = down.point_at(first.t);
        let (x, y) = (place.x, place.y);
        let normal = Vector::new(-x, -y, 1.0).normalize();
        let sine = 10f64.powf(s.within(-5.0, -1.0));
        let d = (normal.cross(s.direction()).normalize() + normal * sine).normalize();
        let (rise, bend) = (d.z - x * d.x - y * d.y, d.x * d.x + d.y * d.y);
        let chord = 2.0 * rise / bend;
        if !(2e-6..0.09).contains(&chord) {
            continue;
        }
        // A hit lies within 1e-11 of the patch across its ray, and the next one strays along it by that over the sine.
        let tolerance = (1e-9 + 2e-11 / sine) * bowl.size;
        let t = chord * bowl.size;
        if t < 8.0 * tolerance {
            continue;
        }
        count.asked += 1;
        let hit = polished.intersect(&Ray::new(origin, d).with_departure(first.departure()), &mut Cost::default());
        if hit.is_some_and(|h| !matches!(h.certainty, Certainty::Polished | Certainty::Certified)) {
            count.flagged += 1;
        } else if hit.is_none_or(|h| (h.t - t).abs() > tolerance) {
            count.wrong.push(format!("{:?} for {t} at {sine:e}", hit.map(|h| h.t)));
        }
    }
    count
}

#[test]
fn a_polished_chord_is_found_whatever_the_size_of_its_part() {
    for (seed, size) in (1u64..).zip([1e-6, 1e-5, 1e-3, 0.05, 100.0, 1e6]) {
        let count = leave_polished(&Bowl { size, shift: Vector::ZERO, speed: [1.0, 1.0] }, 3000, seed);
        let Count { asked, flagged, wrong } = &count;
        assert!(wrong.is_empty(), "{} of {asked} on {size} mm: {:?}", wrong.len(), &wrong[..wrong.len().min(5)]);
        assert!(*asked > 1000 && flagged * 50 < *asked, "{flagged} of {asked} flagged on {size} mm");
    }
}

/// Chords of a fillet in the plane across its axis, on leaves so coarse that both ends of a chord lie on one: boxes are cut as thin as
/// rounding along the axis long before they are short along the arc, and a chord's end was taken for its start.
#[test]
fn chords_of_a_coarse_fillet_are_found() {
    let center = Point::new(8.9, 0.0, 3.89);
    let frame = Frame::from_axis(center, -Vector::Y, Some(Vector::new(1.0, 0.0, 1.0)));
    let fillet = sweep::cylinder(&frame, 2.0, [1.75 * PI, 2.25 * PI], [0.05, 1.65]);
    let exact = Exact::build(&model([fillet]), &Settings { most_leaves: Some(0), ..Settings::default() });
    let mut asked = 0;
    for k in 1..240 {
        let angle = FRAC_PI_2 * f64::from(k) / 240.0;
        for graze in [0.5f64, 1.0, 2.0, 4.05, 8.0, 16.0].map(f64::to_radians) {
            if angle + 2.0 * graze > 0.99 * FRAC_PI_2 {
                continue;
            }
            let height = [-0.3, -0.85, -1.181576][asked % 3];
            let middle = center.with_y(height);
            let ((sin, cos), (rise, along)) = (angle.sin_cos(), graze.sin_cos());
            let (out, onward) = (Vector::new(cos, 0.0, sin), Vector::new(-sin, 0.0, cos));
            let from = exact.intersect(&Ray::new(middle, out), &mut Cost::default()).unwrap().departure();
            let ray = Ray::new(middle + 2.0 * out, along * onward - rise * out).with_departure(from);
            let hit = exact.intersect(&ray, &mut Cost::default());
            // 2 r sin θ.
            assert!(hit.is_some_and(|hit| (hit.t - 4.0 * rise).abs() < 1e-9), "{angle} {graze}: {hit:?}");
            asked += 1;
        }
    }
    assert!(asked > 1000);
}

/// Chords of a cone beside its knot lines, near the tip, where a quarter of a turn is less than a micrometre to some millimetres wide: its
/// own start is no hit, whichever side of the line it is said to lie on.
#[test]
fn chords_near_the_tip_of_a_cone_are_found() {
    let (slope, height) = (30.0 / 80.0, 80.0);
    let tip = Frame::from_axis(Point::new(0.0, 0.0, height), -Vector::Z, Some(Vector::X));
    let surface = sweep::cone(&tip, 0.0, f64::atan(slope), [0.0, 2.0 * PI], [0.0, height]);
    let exact = Exact::build(&model([surface.clone()]), &Settings::default());
    let [[u0, u1], [v0, v1]] = surface.domain();
    let mut s = Random(41);
    let mut asked = 0;
    for _ in 0..4000 {
        let beside = 10f64.powf(s.within(-10.0, -7.0)) * if s.unit() < 0.5 { -1.0 } else { 1.0 };
        let u = u0 + (u1 - u0) * (1.0 + (3.0 * s.unit()).floor()) / 4.0 + beside;
        let uv = Uv::new(u, v0 + (v1 - v0) * 10f64.powf(s.within(-5.0, -1.0)));
        let origin = surface.evaluate(uv);
        let inward = Vector::new(-origin.x, -origin.y, -slope * slope * (height - origin.z)).normalize();
        let along = inward.cross(s.direction()).normalize();
        let sine = 10f64.powf(s.within(-2.0, -0.2));
        let d = (along + sine * inward).normalize();
        // On `x² + y² = slope² (height − z)²` the start is one root, and the other is linear over quadratic.
        let fall = slope * slope * (height - origin.z);
        let linear = origin.x * d.x + origin.y * d.y + fall * d.z;
        let square = d.x * d.x + d.y * d.y - slope * slope * d.z * d.z;
        let t = -2.0 * linear / square;
        let end = origin.z + t * d.z;
        if !(t > 1e-5 && (0.1..height - 1e-4).contains(&end)) {
            continue;
        }
        asked += 1;
        let from = Departure { face: FaceId(0), primitive: 0, uv, triangle: None };
        let hit = exact.first(&Ray::new(origin, d).with_departure(from), &mut Cost::default()).hit;
        // The start is rounded at 80 mm, and strays along the ray by that over both sines.
        assert!(hit.is_some_and(|hit| (hit.t - t).abs() < 1e-9 * t + 1e-10), "{uv} {d}: {hit:?} for {t}");
    }
    assert!(asked > 1000, "{asked}");
}

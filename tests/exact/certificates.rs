//! A certified hit lies in the face, and a ray that passes beside one meets what stands behind.

use crate::referee;
use crate::support::*;
use lampyris::intersect::exact::{Exact, Passage, Settings};
use lampyris::intersect::{Certainty, Cost};
use lampyris::math::{Departure, FaceId, Frame, Point, Ray, Uv, Vector};
use lampyris::nurbs::{Surface, sweep};

/// A sheet of 100 mm in degree `p` that rises by `slope` about the line x = `pivot`.
fn tilted(p: usize, slope: f64, pivot: f64) -> Surface {
    let knots = [vec![0.0; p + 1], vec![1.0; p + 1]].concat();
    let at = |k: usize| 100.0 * k as f64 / p as f64 - 50.0;
    let points = (0..=p).flat_map(|i| (0..=p).map(move |j| Point::new(at(i), at(j), slope * (at(i) - pivot))));
    Surface { degree: [p, p], knots: [knots.clone(), knots], points: points.map(|x| x.extend(1.0)).collect() }
}

#[test]
fn a_nearly_flat_face_is_not_hit_beside_its_border() {
    let wall = sweep::plane(&Frame::from_axis(Point::new(-60.0, 0.0, 0.0), Vector::X, None), [[-100.0, 100.0]; 2]);
    for (p, pivot) in [(1, 55.0), (3, 55.0), (3, 50.5), (1, 50.000_003), (3, 50.000_003)] {
        for slope in [1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9] {
            let exact = Exact::build(&model([tilted(p, slope, pivot), wall.clone()]), &Settings::default());
            // The sheet would be met at z = 0 beyond its border alone.
            let answer = exact.first(&Ray::new(Point::new(200.0, 7.0, 0.0), -Vector::X), &mut Cost::default());
            let what = format!("degree {p}, slope {slope:e} about {pivot}: {answer:?}");
            let hit = answer.hit.unwrap_or_else(|| panic!("{what}"));
            assert!(hit.face == FaceId(1) && (hit.t - 260.0).abs() < 1e-9, "{what}");
        }
    }
}

#[test]
fn a_nearly_flat_face_is_hit_inside_its_border_at_the_right_place() {
    let mut found = 0;
    for (p, pivot) in [(1, 45.0), (3, 45.0), (3, 49.5)] {
        for slope in [1e-13, 1e-12, 1e-11, 1e-10, 1e-9] {
            let exact = Exact::build(&model([tilted(p, slope, pivot)]), &Settings::default());
            let answer = exact.first(&Ray::new(Point::new(200.0, 7.0, 0.0), -Vector::X), &mut Cost::default());
            // The control points' heights are rounded: the line at z = 0 lies where it should within their last bit.
            let right = answer.hit.is_some_and(|hit| (hit.t - (200.0 - pivot)).abs() < 1e-9);
            assert!(right || answer.certainty != Certainty::Certified, "degree {p}, {slope:e}: {answer:?}");
            found += usize::from(right);
        }
    }
    assert_eq!(found, 15, "of 15");
}

#[test]
fn what_a_budget_leaves_open_is_flagged() {
    // Without any clipping: at grazing entries and at poles the first crossing stays open, and often a later one is found.
    let exact = Exact::build(&model([sphere(50.0)]), &Settings { budget: 0, ..Settings::default() });
    let mut s = Random(31);
    let (mut later, mut none, mut passed, mut unseen) = (0, 0, 0, 0);
    for k in 0..3000 {
        let (ray, truths) = if k % 2 == 0 {
            let depth = 10f64.powf(s.within(-8.0, 1.0));
            let (d, half) = (s.direction(), (depth * (100.0 - depth)).sqrt());
            let across = d.cross(s.direction()).normalize();
            (Ray::new(across * (50.0 - depth) - d * 150.0, d), [150.0 - half, 150.0 + half])
        } else {
            let d = (s.direction() * Vector::new(1.0, 1.0, 0.0) - Vector::Z).normalize();
            (Ray::new(Vector::Z * 50.0 - d * 150.0, d), [150.0, 150.0 - 100.0 * d.z])
        };
        let is_right = |t: f64, k: usize| (t - truths[k]).abs() < 1e-6;
        let answer = exact.first(&ray, &mut Cost::default());
        match answer.hit {
            Some(hit) if is_right(hit.t, 0) => {}
            Some(_) => later += 1,
            None => none += 1,
        }
        let right = answer.hit.is_some_and(|hit| is_right(hit.t, 0));
        assert!(right || answer.certainty != Certainty::Certified, "{answer:?} for {truths:?} by {ray:?}");
        assert!(answer.hit.is_none_or(|hit| hit.certainty == answer.certainty), "{answer:?}");
        let Passage { crossings, undecided_from, .. } = exact.passage(&ray, &mut Cost::default());
        passed += usize::from(crossings.first().is_some_and(|hit| is_right(hit.t, 1)));
        for (k, hit) in crossings.iter().enumerate() {
            let right = k < 2 && is_right(hit.t, k);
            assert!(right || hit.certainty != Certainty::Certified, "{crossings:?} for {truths:?} by {ray:?}");
        }
        // What is missing behind the last one shows in no crossing.
        for truth in truths.iter().filter(|truth| crossings.iter().all(|hit| (hit.t - **truth).abs() >= 1e-6)) {
            assert!(
                undecided_from < truth + 1e-6,
                "{crossings:?} until {undecided_from} for {truths:?} by {ray:?}"
            );
            unseen += usize::from(crossings.iter().all(|hit| hit.certainty == Certainty::Certified));
        }
    }
    // Each of the four would be an answer wrong in silence.
    let found = [later, none, passed, unseen];
    assert!(found.iter().all(|&n| n > 20), "later, none, passages, missing in them: {found:?}");
}

/// Lines that pass a torus at sines of 1e-5, aimed at corners of the boxes that clipping halves: what goes in comes out, and no crossing
/// counts twice.
#[test]
fn a_flat_crossing_counts_once() {
    let exact = Exact::build(&model([torus(50.0, 15.0)]), &Settings::default());
    let known = Ray::new(
        Point::new(-105.70334496711197, 20.569009661019663, 5.2060306727883106),
        Vector::new(0.9729884962591708, 0.21639194264262263, 0.08042333807216569),
    );
    let mut s = Random(23);
    let aimed = (0..4000).map(|_| {
        let [a, b] = [0, 1].map(|_| (64.0 * s.unit()).floor() * std::f64::consts::PI / 32.0);
        let normal = Vector::new(b.cos() * a.cos(), b.cos() * a.sin(), b.sin());
        let place = Point::new(50.0 * a.cos(), 50.0 * a.sin(), 0.0) + 15.0 * normal;
        let sine = 10f64.powf(-4.0 - 1.5 * s.unit());
        let direction = (s.direction().cross(normal).normalize() + sine * normal).normalize();
        Ray::new(place - 100.0 * direction, direction)
    });
    let rays: Vec<Ray> = std::iter::once(known).chain(aimed).collect();
    for ray in &rays {
        let ray = ray.with_range(f64::NEG_INFINITY, f64::INFINITY);
        let Passage { crossings, undecided_from, .. } = exact.passage(&ray, &mut Cost::default());
        let is_open =
            undecided_from < f64::INFINITY || crossings.iter().any(|c| c.certainty != Certainty::Certified);
        let sides: Vec<bool> = crossings.iter().map(|c| c.normal.dot(ray.direction) > 0.0).collect();
        let in_turn = sides.iter().enumerate().all(|(k, &leaves)| leaves == (k % 2 == 1));
        assert!(is_open || in_turn && sides.len().is_multiple_of(2), "{ray:?} {crossings:?}");
    }
}

/// A ray that leaves the middle of a plane of a metre, but starts at `height` over it.
fn from_the_middle(exact: &Exact, height: f64, direction: Vector) -> Ray {
    let down = Ray::new(Point::new(0.3, 0.2, 10.0), -Vector::Z);
    let left = exact.first(&down, &mut Cost::default()).hit.expect("the plane lies below");
    Ray::new(Point::new(0.3, 0.2, height), direction.normalize()).with_departure(left.departure())
}

#[test]
fn only_the_point_that_a_ray_leaves_is_left_out() {
    let exact = Exact::build(&model([sweep::plane(&Frame::IDENTITY, [[-500.0, 500.0]; 2])]), &Settings::default());
    // A start a micrometre over its point, or a hundredth: at a slope of 1 : 20 the plane is met twenty times as far ahead.
    for height in [1e-3, 1e-2, 5.0] {
        let ray = from_the_middle(&exact, height, Vector::new(1.0, 0.0, -0.05));
        let hit = exact.first(&ray, &mut Cost::default()).hit.expect("the plane lies ahead");
        assert!((hit.t - height * 401f64.sqrt()).abs() < 1e-9, "{hit:?}");
    }
    // A start within rounding of its point is that point, however far ahead so small a height puts the plane.
    for (height, slope) in [(5e-10, 1e-7), (9e-10, 1e-8), (1e-12, 1e-11)] {
        let ray = from_the_middle(&exact, height, Vector::new(1.0, 0.0, -slope));
        let answer = exact.first(&ray, &mut Cost::default());
        assert_eq!((answer.hit, answer.certainty), (None, Certainty::Certified), "{height} at {slope}");
    }
}

/// A floor and a wall in one face, of patches of a metre: a ray that starts on the floor a micrometre from the wall meets it, however
/// nearly it runs along it.
#[test]
fn a_ray_that_starts_beside_a_crease_meets_the_wall_beyond() {
    let at = |x: f64, z: f64| [0.0, 1000.0].map(|y| Point::new(x, y, z).extend(1.0));
    let surface = Surface {
        degree: [1, 1],
        knots: [vec![0.0, 0.0, 1.0, 2.0, 2.0], vec![0.0, 0.0, 1.0, 1.0]],
        points: [at(0.0, 0.0), at(1000.0, 0.0), at(1000.0, 1000.0)].concat(),
    };
    let exact = Exact::build(&model([surface.clone()]), &Settings::default());
    for beside in [1e-8, 1.1e-9, 9e-10, 1e-10, 2e-11] {
        let uv = Uv::new(1.0 - beside, 0.5);
        let start = surface.evaluate(uv);
        for slope in [1e-3, 1e-5, 1e-6, 1e-7] {
            let d = Vector::new(slope, 0.0, 1.0).normalize();
            let departure = Departure { face: FaceId(0), primitive: 0, uv, triangle: None };
            let answer = exact.first(&Ray::new(start, d).with_departure(departure), &mut Cost::default());
            let t = (1000.0 - start.x) / d.x;
            let hit = answer.hit.filter(|hit| (hit.t - t).abs() < 1e-12 / slope + 1e-9);
            assert!(t > 1000.0 || hit.is_some(), "{beside} at {slope}: {answer:?} for {t}");
        }
    }
}

#[test]
fn a_face_is_met_inside_its_border_from_a_thousand_kilometres() {
    let turned = Frame::from_axis(Point::new(3.1, -2.7, 1.3), Vector::new(0.3, 0.5, 0.8), None);
    let surface = sweep::plane(&turned, [[0.0, 100.0]; 2]);
    let exact = Exact::build(&model([surface.clone()]), &Settings::default());
    let mut s = Random(83);
    let mut near = 0;
    for k in 0..3000 {
        // Across the border by up to 10 µm, at sines where rounding blurs the place along the ray by as much.
        let beside = 10f64.powf(s.within(-6.0, -2.0));
        let x = if k % 2 == 0 { beside } else { 100.0 - beside };
        let target = turned.point(Point::new(x, s.within(10.0, 90.0), 0.0));
        let along = turned.x * if k % 4 < 2 { 1.0 } else { -1.0 } + turned.y * s.within(-0.5, 0.5);
        let d = (along.normalize() - turned.z * 10f64.powf(s.within(-5.0, -3.0))).normalize();
        let ray = Ray::new(target - d * 1e9, d);
        let [u, v] = surface.domain();
        let start = Uv::new(u[0] + (u[1] - u[0]) * x / 100.0, 0.5 * (v[0] + v[1]));
        let Some(truth) = referee::root(&surface, &ray, start) else { continue };
        if truth.inside > 1e-6 {
            near += usize::from(truth.inside < 0.02);
            let answer = exact.first(&ray, &mut Cost::default());
            let met = answer.hit.is_some_and(|hit| (hit.t - truth.t).abs() < 1e-5);
            assert!(met || answer.certainty != Certainty::Certified, "{truth:?} by {ray:?}: {answer:?}");
        }
    }
    assert!(near > 1000, "{near} near the border");
}

#[test]
fn tangencies_are_told_to_the_last_bit() {
    // z = x²/64 in powers of two: a ray at height h meets it at x = ±8 √h, or not.
    let knots = [vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]];
    let points = [(-64.0, 64.0), (0.0, -64.0), (64.0, 64.0)];
    let points = points.iter().flat_map(|&(x, z)| [-32.0, 32.0].map(|y| Point::new(x, y, z).extend(1.0))).collect();
    let exact = Exact::build(&model([Surface { degree: [2, 1], knots, points }]), &Settings::default());
    let mut s = Random(85);
    for k in 0..400 {
        let height = 10f64.powf(s.within(-16.0, -7.0)) * if k % 2 == 0 { 1.0 } else { -1.0 };
        let d = if k % 3 == 0 { Vector::X } else { Vector::new(1.0, s.within(-0.3, 0.3), 0.0).normalize() };
        // Powers of two keep the origin exact.
        let ray = Ray::new(Point::new(-96.0, s.within(-1.0, 1.0) - 96.0 * d.y / d.x, height), d);
        let answer = exact.first(&ray, &mut Cost::default());
        assert_eq!(answer.certainty, Certainty::Certified, "height {height:e}: {answer:?}");
        let half = 8.0 * height.max(0.0).sqrt();
        let truths = if height > 0.0 { vec![(96.0 - half) / d.x, (96.0 + half) / d.x] } else { Vec::new() };
        let found: Vec<f64> = exact.crossings(&ray, &mut Cost::default()).iter().map(|hit| hit.t).collect();
        assert_eq!(found.len(), truths.len(), "height {height:e}: {found:?} for {truths:?}");
        for (t, truth) in found.iter().zip(&truths) {
            assert!((t - truth).abs() < 1e-8, "height {height:e}: {found:?} for {truths:?}");
        }
        assert_eq!(answer.hit.map(|hit| hit.t), found.first().copied());
    }
}

#[test]
fn a_contact_of_fourth_order_is_told_as_tangent() {
    // z = x⁴/2¹⁸: at x = 0 the sheet does not bend, so that no box decides whether it is met there; 64·(2u − 1)⁴ has Bézier points of ±64.
    let knots = [vec![0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]];
    let places = [(-64.0, 64.0), (-32.0, -64.0), (0.0, 64.0), (32.0, -64.0), (64.0, 64.0)];
    let points = places.iter().flat_map(|&(x, z)| [-32.0, 32.0].map(|y| Point::new(x, y, z).extend(1.0))).collect();
    let exact = Exact::build(&model([Surface { degree: [4, 1], knots, points }]), &Settings::default());
    let mut s = Random(87);
    let mut tangent = 0;
    for _ in 0..100 {
        // Below the sheet: nothing is met, and what is reported as met within rounding is no certified hit.
        let height = 10f64.powf(s.within(-18.0, -14.0));
        let ray = Ray::new(Point::new(-96.0, s.within(-16.0, 16.0), -height), Vector::X);
        let answer = exact.first(&ray, &mut Cost::default());
        let certified_miss = answer.hit.is_none() && answer.certainty == Certainty::Certified;
        assert!(certified_miss || answer.certainty != Certainty::Certified, "{height:e} below: {answer:?}");
        tangent += usize::from(answer.certainty == Certainty::Tangent);
    }
    assert!(tangent > 50, "{tangent} tangent");
}

#[test]
fn a_face_that_a_ray_runs_along_is_met_inside_its_border_from_far_away() {
    let turned = Frame::from_axis(Point::new(3.1, -2.7, 1.3), Vector::new(0.3, 0.5, 0.8), None);
    let surface = sweep::plane(&turned, [[0.0, 100.0]; 2]);
    let exact = Exact::build(&model([surface.clone()]), &Settings::default());
    let mut s = Random(89);
    let mut near = 0;
    for k in 0..2000 {
        // At sines where the rounding of the way to the face moves the place along it by a hundredth of a millimetre to some.
        let beside = 10f64.powf(s.within(-3.0, 0.0));
        let x = if k % 2 == 0 { beside } else { 100.0 - beside };
        let target = turned.point(Point::new(x, s.within(10.0, 90.0), 0.0));
        let along = turned.x * if k % 4 < 2 { 1.0 } else { -1.0 } + turned.y * s.within(-0.5, 0.5);
        let d = (along.normalize() - turned.z * 10f64.powf(s.within(-10.0, -8.0))).normalize();
        let ray = Ray::new(target - d * 10f64.powf(s.within(5.0, 6.5)), d);
        let [u, v] = surface.domain();
        let start = Uv::new(u[0] + (u[1] - u[0]) * x / 100.0, 0.5 * (v[0] + v[1]));
        let Some(truth) = referee::root(&surface, &ray, start) else { continue };
        if truth.inside > 1e-6 {
            near += usize::from(truth.inside < 1.0);
            let answer = exact.first(&ray, &mut Cost::default());
            let met = answer.hit.is_some_and(|hit| (hit.t - truth.t).abs() < 1e-5);
            assert!(met || answer.certainty != Certainty::Certified, "{truth:?} by {ray:?}: {answer:?}");
        }
    }
    assert!(near > 500, "{near} near the border");
}

#[test]
fn of_a_sheet_that_bends_by_less_than_its_rounding_no_later_root_is_certified() {
    // z = bend·(x/64)²: across a ray that runs along it obliquely, both coordinates are of the sheet's size and round by more than it
    // bends.
    let knots = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let mut s = Random(91);
    let mut double = 0;
    for _ in 0..800 {
        let bend = 10f64.powf(s.within(-20.0, -16.0));
        let height = [bend, -bend, bend];
        let at = |k: usize| 64.0 * k as f64 - 64.0;
        let points = (0..9).map(|k| Point::new(at(k / 3), at(k % 3), height[k / 3]).extend(1.0)).collect();
        let surface = Surface { degree: [2, 2], knots: [knots.to_vec(), knots.to_vec()], points };
        let exact = Exact::build(&model([surface.clone()]), &Settings::default());
        let along = Vector::new(1.0, s.within(-0.8, 0.8), 0.0).normalize();
        let d = (along + Vector::Z * bend * s.within(-2e-3, 2e-3)).normalize();
        let (half, y) = (10f64.powf(s.within(-1.5, 1.7)), s.within(-16.0, 16.0));
        let ray = Ray::new(Point::new(0.0, y, bend * (half / 64.0).powi(2)) - d * 150.0, d);
        let mut roots: Vec<f64> = [-60.0, -30.0, -10.0, -3.0, -1.0, 0.1, 1.0, 3.0, 10.0, 30.0, 60.0]
            .iter()
            .filter_map(|x| referee::root(&surface, &ray, Uv::new(0.5 + x / 128.0, 0.5 + y / 128.0)))
            .filter(|root| root.inside > 1e-3)
            .map(|root| root.t)
            .collect();
        roots.sort_by(f64::total_cmp);
        let [Some(&first), Some(&last)] = [roots.first(), roots.last()] else { continue };
        if last - first > 1e-2 {
            double += 1;
            let answer = exact.first(&ray, &mut Cost::default());
            let met = answer.hit.is_some_and(|hit| (hit.t - first).abs() < 1e-5);
            assert!(
                met || answer.certainty != Certainty::Certified,
                "bend {bend:e}: {answer:?} for {first} and {last}"
            );
        }
    }
    assert!(double > 200, "{double} with two roots");
}

//! A certified hit lies in the face, and a ray that passes beside one meets what stands behind.

use crate::support::*;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::{Certainty, Cost};
use lampyris::math::{FaceId, Frame, Point, Ray, Vector};
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
    for (p, pivot) in [(1, 45.0), (3, 45.0), (3, 49.5)] {
        for slope in [1e-13, 1e-12, 1e-11, 1e-10, 1e-9] {
            let exact = Exact::build(&model([tilted(p, slope, pivot)]), &Settings::default());
            let answer = exact.first(&Ray::new(Point::new(200.0, 7.0, 0.0), -Vector::X), &mut Cost::default());
            // The control points' heights are rounded: the line at z = 0 lies where it should within their last bit.
            let right = answer.hit.is_some_and(|hit| (hit.t - (200.0 - pivot)).abs() < 1e-9);
            assert!(right || answer.certainty != Certainty::Certified, "degree {p}, {slope:e}: {answer:?}");
        }
    }
}

#[test]
fn what_a_budget_leaves_open_is_flagged() {
    // Without any clipping: at grazing entries and at poles the first crossing stays open, and often a later one is found.
    let exact = Exact::build(&model([sphere(50.0)]), &Settings { budget: 0, ..Settings::default() });
    let mut s = Stream(31);
    let (mut later, mut none, mut passed) = (0, 0, 0);
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
        let crossings = exact.crossings(&ray, &mut Cost::default());
        passed += usize::from(crossings.first().is_some_and(|hit| is_right(hit.t, 1)));
        for (k, hit) in crossings.iter().enumerate() {
            let right = k < 2 && is_right(hit.t, k);
            assert!(right || hit.certainty != Certainty::Certified, "{crossings:?} for {truths:?} by {ray:?}");
        }
    }
    // Each of the three would be an answer wrong in silence.
    assert!(later > 20 && none > 20 && passed > 20, "{later} later, {none} none, {passed} passages");
}

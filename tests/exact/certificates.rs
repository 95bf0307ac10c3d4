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
    for (p, pivot) in [(1, 55.0), (3, 55.0), (3, 50.5)] {
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

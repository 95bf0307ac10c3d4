//! Rays aimed at the borders of patches and leaves, where two of them must agree on which has the root.

use crate::support::*;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::{Certainty, Cost};
use lampyris::math::{FaceId, Homogeneous, Point, Ray, Vector};
use lampyris::nurbs::Surface;
use lampyris::step;
use std::f64::consts::FRAC_PI_4;

/// Onto the front of a lens, radius 51.68 mm, at borders of its patches: Newton's method ended by what its first two steps foretold, and
/// where the first came near by chance it was 4e-10 mm off, in the neighbour's eyes.
#[test]
fn no_ray_passes_between_two_leaves_of_a_lens() {
    let (radius, center) = (51.68, Point::new(0.0, 0.0, -44.653_146_800_6));
    let import = step::read("fixtures/step/lens_planoconvex_analytic.stp".as_ref(), &step::Settings::default());
    let exact = Exact::build(&import.expect("the lens").model, &Settings::default());
    let mut s = Random(5);
    for _ in 0..20_000 {
        let border = (2 * s.below(4) + 1) as f64 * FRAC_PI_4;
        let aside = 10f64.powf(s.within(-14.0, -9.0)) * if s.below(2) == 0 { 1.0 } else { -1.0 };
        let (sin, cos) = (border + aside / 19.9).sin_cos();
        let normal = Vector::new(19.9 * cos, 19.9 * sin, (radius * radius - 19.9 * 19.9f64).sqrt()) / radius;
        let d = (0.6 * s.direction() - Vector::Z).normalize();
        if -d.dot(normal) < 0.3 {
            continue;
        }
        let ray = Ray::new(center + radius * normal - 80.0 * d, d);
        let answer = exact.first(&ray, &mut Cost::default());
        let t = answer.hit.map_or(f64::NAN, |hit| hit.t);
        assert!((t - 80.0).abs() < 1e-6, "{aside:e} mm from the border: {t}, {:?}", answer.certainty);
    }
}

/// A sheet whose second knot span is a billionth of its first, with a weight of 9000: where the spans meet the control point of both is the same.
#[test]
fn no_ray_passes_between_a_long_span_and_a_short_one() {
    let (size, short, weight) = (1e5, 3e-9, 9e3);
    let points = [(-size, 0.0, 1.0), (0.0, 0.3 * size, weight), (size, 0.0, 1.0), (2.0 * size, -0.5 * size, 1.0)];
    let points = points
        .into_iter()
        .flat_map(|(x, z, w)| [-size, size].map(|y| Homogeneous::from((Point::new(x, y, z) * w, w))));
    let knots = [vec![0.0, 0.0, 0.0, 3.0 - short, 3.0, 3.0, 3.0], vec![0.0, 0.0, 1.0, 1.0]];
    let sheet = Surface { degree: [2, 1], knots, points: points.collect() };
    let exact = Exact::build(&model([sheet]), &Settings::default());
    // The second control point of the long span less its share of the last one, by hand: x = S·s / (9000 (1 − s) + s), s = 1 − 1e-9.
    let rest = (3.0 - (3.0 - short)) / 3.0;
    let border = size * (1.0 - rest) / (weight * rest + 1.0 - rest);
    for k in -200..=200 {
        let origin = Point::new(border + 1e-9 * f64::from(k), 123.0, 2.0 * size);
        let answer = exact.first(&Ray::new(origin, -Vector::Z), &mut Cost::default());
        assert_eq!(answer.hit.map(|hit| hit.face), Some(FaceId(0)), "{k} nm from the border: {answer:?}");
    }
}

/// A direction in single precision, 8e-8 too long: the ray that is traced is the one that is given, and so is the unit of t.
#[test]
fn a_direction_that_is_not_quite_of_unit_length_is_followed() {
    let d = Vector::new(f64::from(0.558_906_5f32), f64::from(-0.827_958_2f32), f64::from(-0.045_921_5f32));
    assert!((1e-8..1e-6).contains(&(d.length() - 1.0).abs()));
    let exact = Exact::build(&model([sphere(50.0)]), &Settings::default());
    let mut s = Random(9);
    for _ in 0..2_000 {
        let normal = s.direction();
        if d.dot(normal) > -0.2 {
            continue;
        }
        let answer = exact.first(&Ray::new(50.0 * normal - 2_000.0 * d, d), &mut Cost::default());
        let hit = answer.hit.expect("the near side");
        assert_eq!(answer.certainty, Certainty::Certified);
        assert!((hit.t - 2_000.0).abs() < 1e-8 && hit.normal.distance(normal) < 1e-9, "{hit:?}");
    }
}

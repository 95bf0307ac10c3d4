//! Models in closed form, and deterministic rays.

pub(crate) use crate::random::Random;
use lampyris::math::{Frame, Homogeneous, Point};
use lampyris::model::{Analytic, Face, Model, Part, Shell};
use lampyris::nurbs::{Surface, sweep};
use std::f64::consts::{FRAC_PI_2, PI};

pub(crate) fn face(surface: Surface) -> Face {
    Face { analytic: Analytic::Rational, ..Face::whole(surface) }
}

pub(crate) fn model(surfaces: impl IntoIterator<Item = Surface>) -> Model {
    let faces = surfaces.into_iter().map(face).collect();
    Model::from_part(Part { shells: vec![Shell { faces, ..Shell::default() }], ..Part::default() })
}

pub(crate) fn sphere(radius: f64) -> Surface {
    sweep::sphere(&Frame::IDENTITY, radius, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2])
}

pub(crate) fn torus(major: f64, minor: f64) -> Surface {
    sweep::torus(&Frame::IDENTITY, major, minor, [0.0, 2.0 * PI], [0.0, 2.0 * PI])
}

/// A clamped uniform B-spline over `[0, 1]²` from a function of the control point's place.
pub(crate) fn freeform(
    degree: [usize; 2],
    count: [usize; 2],
    mut at: impl FnMut(f64, f64) -> (Point, f64),
) -> Surface {
    let knots = |p: usize, n: usize| {
        let inner = (1..n - p).map(|k| k as f64 / (n - p) as f64);
        std::iter::repeat_n(0.0, p + 1).chain(inner).chain(std::iter::repeat_n(1.0, p + 1)).collect::<Vec<f64>>()
    };
    let [nu, nv] = count;
    let mut points = Vec::new();
    for i in 0..nu {
        for j in 0..nv {
            let (p, w) = at(i as f64 / (nu - 1) as f64, j as f64 / (nv - 1) as f64);
            points.push(Homogeneous::from((p * w, w)));
        }
    }
    Surface { degree, knots: [knots(degree[0], nu), knots(degree[1], nv)], points }
}

/// A wavy reflector of 200 mm × 200 mm with `n × n` control points.
pub(crate) fn reflector(n: usize) -> Surface {
    let mut s = Random(11);
    freeform([3, 3], [n, n], |u, v| {
        let (x, y) = (200.0 * u - 100.0, 200.0 * v - 100.0);
        let z = (x * x + y * y) / 400.0 + 1.5 * (x / 9.0).sin() * (y / 11.0).cos() + s.within(-0.6, 0.6);
        (Point::new(x, y, z), 1.0)
    })
}

/// One bicubic patch of 100 mm with heights of ±30 mm.
pub(crate) fn bicubic() -> Surface {
    let mut s = Random(7);
    freeform([3, 3], [4, 4], |u, v| (Point::new(100.0 * u - 50.0, 100.0 * v - 50.0, s.within(-30.0, 30.0)), 1.0))
}

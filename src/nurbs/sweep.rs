//! Revolution, extrusion and the analytic surfaces, exact as rational B-splines.
//!
//! Parametrisations follow ISO 10303-42: u is the angle of a revolution (with knots at angles, see
//! [`super::conic`]), v the height, latitude or minor angle. The normal `Su × Sv` points out of the solid for cylinder, sphere, torus and a
//! cone before its apex; else it follows the sense of the profile.

use super::{ControlPoint, Curve, Surface, conic};
use crate::math::{Frame, Homogeneous, Point, Vector};

/// Makes the plane rectangle `origin + u·x + v·y` over ranges of u and v.
pub fn plane(frame: &Frame, [[u0, u1], [v0, v1]]: [[f64; 2]; 2]) -> Surface {
    let at = |u: f64, v: f64| Homogeneous::weighted(frame.point(Point::new(u, v, 0.0)), 1.0);
    Surface {
        degree: [1, 1],
        knots: [vec![u0, u0, u1, u1], vec![v0, v0, v1, v1]],
        points: vec![at(u0, v0), at(u0, v1), at(u1, v0), at(u1, v1)],
    }
}

/// Makes the surface `curve(u) + v·direction`, v in the given range; `direction` need not be of unit length.
pub fn extrusion(curve: &Curve, direction: Vector, [v0, v1]: [f64; 2]) -> Surface {
    let at = |p: &Homogeneous, v: f64| Homogeneous::weighted(p.project() + v * direction, p.w);
    Surface {
        degree: [curve.degree, 1],
        knots: [curve.knots.clone(), vec![v0, v0, v1, v1]],
        points: curve.points.iter().flat_map(|p| [at(p, v0), at(p, v1)]).collect(),
    }
}

/// Turns `curve(v)`, in the coordinates that `axis` is in, about the z axis of `axis` by the angle u in `angles`, radians, rising.
pub fn revolution(curve: &Curve, axis: &Frame, angles: [f64; 2]) -> Surface {
    let (knots, arc) = conic::unit_arc(angles);
    let meridian: Vec<(Point, f64)> = curve.points.iter().map(|p| (axis.local_point(p.project()), p.w)).collect();
    let points = arc
        .iter()
        .flat_map(|&(c, s, w)| {
            meridian.iter().map(move |&(m, weight)| {
                // The control points of the arc stand for cosine and sine: turning is linear in the two, so that
                // the product of both nets is exact.
                let turned = Point::new(c * m.x - s * m.y, s * m.x + c * m.y, m.z);
                Homogeneous::weighted(axis.point(turned), w * weight)
            })
        })
        .collect();
    Surface { degree: [2, curve.degree], knots: [knots, curve.knots.clone()], points }
}

/// Makes a cylinder about the z axis of `frame`: u the angle, radians, v the height; lengths are in units of the frame.
pub fn cylinder(frame: &Frame, radius: f64, angles: [f64; 2], heights: [f64; 2]) -> Surface {
    cone(frame, radius, 0.0, angles, heights)
}

/// Makes a cone about the z axis: `radius` at height 0, growing by `tan(half_angle)` per unit of v along the axis; angles in radians,
/// lengths in units of the frame. Beyond the apex, where it would be negative, the surface goes on turned over.
pub fn cone(frame: &Frame, radius: f64, half_angle: f64, angles: [f64; 2], heights: [f64; 2]) -> Surface {
    let at = |v: f64| frame.point(Point::new(radius + v * half_angle.tan(), 0.0, v));
    revolution(&Curve::line(at(heights[0]), at(heights[1]), heights), frame, angles)
}

/// Makes a sphere about the frame's origin: u the longitude about z, v the latitude in `[-π/2, π/2]`, radians.
pub fn sphere(frame: &Frame, radius: f64, longitudes: [f64; 2], latitudes: [f64; 2]) -> Surface {
    torus(frame, 0.0, radius, longitudes, latitudes)
}

/// Makes a torus: u the angle about z, v the angle about the tube, 0 on the outer equator, radians; lengths in units of the frame.
pub fn torus(frame: &Frame, major: f64, minor: f64, angles: [f64; 2], minor_angles: [f64; 2]) -> Surface {
    // The meridian lies in the x–z plane.
    let meridian =
        Frame { origin: frame.point(major * Vector::X), x: frame.x, y: frame.z, z: -frame.y, scale: frame.scale };
    revolution(&conic::arc(&meridian, minor, minor_angles), frame, angles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Uv;
    use std::f64::consts::PI;

    #[test]
    fn cone_and_torus_satisfy_their_equations() {
        let f = Frame::from_axis(Point::new(1.0, 2.0, 3.0), Vector::new(0.2, 0.5, 1.0), None);
        let c = cone(&f, 4.0, 0.3, [0.5, 5.0], [-2.0, 3.0]);
        let t = torus(&f, 5.0, 1.5, [0.0, 2.0 * PI], [0.0, 2.0 * PI]);
        for i in 0..=10 {
            for j in 0..=10 {
                let (a, b) = (i as f64 / 10.0, j as f64 / 10.0);
                let p = f.local_point(c.evaluate(Uv::new(0.5 + 4.5 * a, -2.0 + 5.0 * b)));
                assert!((p.x.hypot(p.y) - (4.0 + p.z * 0.3f64.tan())).abs() < 1e-13);
                let q = f.local_point(t.evaluate(Uv::new(2.0 * PI * a, 2.0 * PI * b)));
                assert!((((q.x.hypot(q.y) - 5.0).powi(2) + q.z * q.z).sqrt() - 1.5).abs() < 1e-13);
            }
        }
        let n = t.normal(Uv::ZERO).unwrap();
        assert!((n - f.x).length() < 1e-12, "outward on the outer equator");
    }

    /// Rounding leaves a derivative around the apex, which grows with the cone.
    #[test]
    fn the_normal_at_the_apex_of_a_long_cone_is_that_of_its_meridian() {
        let f = Frame::from_axis(Point::ZERO, Vector::new(-0.0566, 0.1699, 0.9838), None);
        for half_angle in [0.0306f64, 0.5] {
            for r in [1.0, 25_970.769_083] {
                let (turn, apex) = ([0.0, 2.0 * PI], -r / half_angle.tan());
                let c = cone(&f, r, half_angle, turn, [apex, 0.5 * r]);
                for k in 0..40 {
                    let u = 2.0 * PI * k as f64 / 40.0;
                    let (sin, cos) = conic::angle_of_parameter(turn, u).sin_cos();
                    let out = f.vector(Vector::new(cos, sin, 0.0)) * half_angle.cos();
                    let want = out - f.vector(Vector::Z) * half_angle.sin();
                    let off = c.normal(Uv::new(u, apex)).unwrap().angle_between(want);
                    assert!(off < 1e-6, "{r} {half_angle} {u}: {off}");
                }
            }
        }
    }

    #[test]
    fn an_extruded_line_is_a_plane() {
        let e = extrusion(&Curve::line(Point::ZERO, Point::X, [0.0, 1.0]), Vector::Y, [0.0, 2.0]);
        assert_eq!(e.evaluate(Uv::new(0.25, 1.5)), Point::new(0.25, 1.5, 0.0));
    }
}

//! Closed forms: plane, cone and cylinder, torus and sphere.

use crate::math::{Frame, Point, Uv, Vector};
use crate::nurbs::Derivatives;
use std::f64::consts::FRAC_PI_2;

/// Returns the parameters, in units of the frame, of the foot of `p` on a plane.
pub(super) fn locate_plane(frame: &Frame, p: Point) -> Uv {
    let q = frame.local_point(p);
    Uv::new(q.x, q.y)
}

/// Returns the longitude of a point in the frame's coordinates, radians in (−π, π]; that of the opposite side where `radius` is negative.
fn longitude(q: Point, radius: f64) -> f64 {
    if radius < 0.0 { (-q.y).atan2(-q.x) } else { q.y.atan2(q.x) }
}

/// Returns the parameters of the nearest point of a cone: the longitude in radians, and the height of the foot along the axis in units of
/// the frame.
pub(super) fn locate_cone(frame: &Frame, radius: f64, half_angle: f64, p: Point) -> Uv {
    let q = frame.local_point(p);
    let slope = half_angle.tan();
    let distance = q.x.hypot(q.y);
    // On the nappe that the height selects; then the perpendicular foot in the half plane.
    let signed = if radius + q.z * slope < 0.0 { -distance } else { distance };
    // The foot on the line `r = radius + v·slope`: its direction is (slope, 1), hence the 1 + slope².
    let v = (q.z + (signed - radius) * slope) / (1.0 + slope * slope);
    Uv::new(longitude(q, signed), v)
}

/// Returns the point and first derivatives of a cone of `radius` at v = 0: u is the longitude and `half_angle` its slope, both in radians,
/// v the height along the axis in units of the frame. Beyond the apex the radius is negative.
pub(super) fn cone(frame: &Frame, radius: f64, half_angle: f64, uv: Uv) -> Derivatives {
    let (s, c) = uv.x.sin_cos();
    let slope = half_angle.tan();
    let r = radius + uv.y * slope;
    Derivatives {
        point: frame.point(Point::new(r * c, r * s, uv.y)),
        du: frame.vector(Vector::new(-r * s, r * c, 0.0)),
        dv: frame.vector(Vector::new(slope * c, slope * s, 1.0)),
    }
}

/// Returns the angles v between −π and π, radians, at which a torus meets its axis; `None` for a torus with a hole.
///
/// A negative `major` stands for the inner (lemon) part of a self-touching torus.
pub(super) fn minor_range(major: f64, minor: f64) -> Option<[f64; 2]> {
    if major == 0.0 {
        return Some([-FRAC_PI_2, FRAC_PI_2]);
    }
    if major.abs() > minor {
        return None;
    }
    // Where major + minor·cos v = 0.
    let v = (-major / minor).clamp(-1.0, 1.0).acos();
    Some([-v, v])
}

/// Returns the longitude and angle about the tube, radians, of the point of a torus that is nearest to `p`; an infinite `range` does not
/// bound v.
pub(super) fn locate_torus(frame: &Frame, major: f64, range: [f64; 2], p: Point) -> Uv {
    let q = frame.local_point(p);
    let distance = q.x.hypot(q.y);
    let v = q.z.atan2(distance - major);
    // The inner part of a lemon ends at its poles; a point beyond belongs to them.
    let v = if range[0].is_finite() { v.clamp(range[0], range[1]) } else { v };
    Uv::new(longitude(q, 1.0), v)
}

/// Returns the point and derivatives of a torus: u is the longitude, v the angle about the tube, both in radians. `major` is 0 for a
/// sphere, negative for the inner part of one that touches itself.
pub(super) fn torus(frame: &Frame, major: f64, minor: f64, uv: Uv) -> Derivatives {
    let (s, c) = uv.x.sin_cos();
    let (sv, cv) = uv.y.sin_cos();
    let r = major + minor * cv;
    Derivatives {
        point: frame.point(Point::new(r * c, r * s, minor * sv)),
        du: frame.vector(Vector::new(-r * s, r * c, 0.0)),
        dv: frame.vector(Vector::new(-minor * sv * c, -minor * sv * s, minor * cv)),
    }
}

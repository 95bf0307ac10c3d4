//! Revolution and extrusion of any curve: one parameter in closed form, the other by projection to the curve.

use super::tolerances::{
    EXPECTED_MM, EXPECTED_SHARE, GOLDEN_CUT, GOLDEN_ROUNDS, NEAR_AXIS_SHARE, PLANE_SHARE, PROFILE_SAMPLES,
    PROFILE_SAMPLES_PER_SPAN,
};
use crate::math::{Frame, Point, Uv, Vector};
use crate::nurbs::{ControlPoint, Curve, Derivatives, project};
use std::f64::consts::{PI, TAU};

/// The half plane through the axis in which a meridian lies.
#[derive(Clone, Copy, Debug)]
pub(in crate::step) struct Plane {
    /// Its azimuth, radians.
    azimuth: f64,
    /// Whether the meridian is on both sides of the axis.
    crosses: bool,
}

/// Returns the parameters of a nearest point of a surface of revolution, not moved to the hint's period: u from the azimuth, v from the
/// projection to the meridian in its plane, or in the half plane of radius and height. `size` is the meridian's, mm.
pub(super) fn locate_revolution(
    (frame, meridian, plane): (&Frame, &Curve, Option<Plane>),
    p: Point,
    hint: Option<Uv>,
    size: f64,
) -> Uv {
    let q = frame.local_point(p);
    // Seen in the half plane of radius and height the surface is its profile.
    let target = Vector::new(q.x.hypot(q.y), 0.0, q.z);
    let expected = EXPECTED_SHARE * size + EXPECTED_MM;
    let Some(Plane { azimuth, crosses }) = plane else {
        let v = nearest_profile(frame, meridian, target);
        let m = frame.local_point(meridian.evaluate(v));
        return Uv::new(q.y.atan2(q.x) - m.y.atan2(m.x), v);
    };
    let (s, c) = azimuth.sin_cos();
    let foot = |radius: f64| {
        let turned = frame.point(Point::new(radius * c, radius * s, target.z));
        match hint {
            Some(h) => project::nearest_from(meridian, turned, h.y, expected),
            None => project::nearest(meridian, turned),
        }
    };
    let ahead = foot(target.x);
    let u = q.y.atan2(q.x) - azimuth;
    if !crosses {
        return Uv::new(u, ahead.0);
    }
    // On the other side of the axis half a turn on; where both fit, near the axis, what is expected decides.
    let behind = foot(-target.x);
    // How far a turn lies from one of the copies that are expected, as a share of a turn.
    let turn = |u: f64| hint.map_or(0.0, |h| ((u - h.x) / TAU - ((u - h.x) / TAU).round()).abs());
    let both = ahead.1.max(behind.1) <= expected.max(NEAR_AXIS_SHARE * target.x);
    let back = if both { turn(u + PI) < turn(u) } else { behind.1 < ahead.1 };
    if back { Uv::new(u + PI, behind.0) } else { Uv::new(u, ahead.0) }
}

/// Returns the parameter of the profile `(radius, height)` nearest to `target`, whose x and z these are, for a meridian that leaves every
/// plane through the axis: samples, then golden sections.
fn nearest_profile(frame: &Frame, meridian: &Curve, target: Vector) -> f64 {
    let distance = |v: f64| {
        let m = frame.local_point(meridian.evaluate(v));
        (Vector::new(m.x.hypot(m.y), 0.0, m.z) - target).length()
    };
    let [a, b] = meridian.domain();
    let n = (PROFILE_SAMPLES_PER_SPAN * meridian.breakpoints().len()).min(PROFILE_SAMPLES);
    let sample = |i: usize| a + (b - a) * i as f64 / n as f64;
    // The samples find the branch; sections around the best of them need no derivative, which a profile at the axis
    // has not.
    let best = (0..=n).map(|i| (i, distance(sample(i)))).min_by(|x, y| x.1.total_cmp(&y.1)).map_or(0, |x| x.0);
    let (mut lo, mut hi) = (sample(best.saturating_sub(1)), sample((best + 1).min(n)));
    for _ in 0..GOLDEN_ROUNDS {
        let x = lo + GOLDEN_CUT * (hi - lo);
        let y = hi - GOLDEN_CUT * (hi - lo);
        if distance(x) < distance(y) { hi = y } else { lo = x }
    }
    0.5 * (lo + hi)
}

/// Returns the distance of a target, radius in x and height in z, from the profile of a meridian, in units of the frame.
pub(in crate::step) fn profile_distance(frame: &Frame, meridian: &Curve, target: Vector) -> f64 {
    let m = frame.local_point(meridian.evaluate(nearest_profile(frame, meridian, target)));
    (Vector::new(m.x.hypot(m.y), 0.0, m.z) - target).length()
}

/// Returns the plane through the axis that holds a meridian; `None` if there is none, or the meridian lies on the axis.
pub(super) fn plane(frame: &Frame, meridian: &Curve) -> Option<Plane> {
    let local: Vec<Point> = meridian.points.iter().map(|p| frame.local_point(p.position())).collect();
    // The point farthest from the axis determines the plane best.
    let far = local.iter().copied().max_by(|a, b| a.x.hypot(a.y).total_cmp(&b.x.hypot(b.y)))?;
    let r = far.x.hypot(far.y);
    let near = PLANE_SHARE * r * r;
    let flat = local.iter().all(|p| (far.x * p.y - far.y * p.x).abs() <= near);
    let crosses = local.iter().any(|p| far.x * p.x + far.y * p.y < -near);
    (flat && r > 0.0).then(|| Plane { azimuth: far.y.atan2(far.x), crosses })
}

/// Returns the point (mm) and first derivatives of the surface that `meridian` makes, turned about the frame's z axis. The meridian is in
/// the model's coordinates, not in the frame's; u is the angle in radians, v the meridian's parameter.
pub(super) fn revolution(frame: &Frame, meridian: &Curve, uv: Uv) -> Derivatives {
    let d = meridian.derivatives(uv.y);
    let (m, t) = (frame.local_point(d.point), frame.local_direction(d.first) / frame.scale);
    let (s, c) = uv.x.sin_cos();
    let turn = |p: Vector| Vector::new(c * p.x - s * p.y, s * p.x + c * p.y, p.z);
    let p = turn(m);
    Derivatives { point: frame.point(p), du: frame.vector(Vector::new(-p.y, p.x, 0.0)), dv: frame.vector(turn(t)) }
}

/// Returns the parameters of a nearest point of an extrusion: u by projecting `base` along the direction, from `hint` where given; v from
/// what remains. `size` is the profile's, mm.
pub(super) fn locate_extrusion(base: &Curve, direction: Vector, p: Point, hint: Option<f64>, size: f64) -> Uv {
    let square = direction.length_squared();
    // Along the direction nothing counts: what is left of the distance is the curve's own.
    let flat = |q: Point| {
        let d = q - p;
        d - direction * (d.dot(direction) / square)
    };
    let start = hint.map(|u| (u, EXPECTED_SHARE * size + EXPECTED_MM));
    let u = project::nearest_by(base, flat, start).0;
    Uv::new(u, (p - base.evaluate(u)).dot(direction) / square)
}

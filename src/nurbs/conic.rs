//! Circular arcs as rational quadratics whose knots are angles, and the closed form between angle and parameter.

use super::{ControlPoint, Curve};
use crate::math::{Frame, Homogeneous, Point};
use std::f64::consts::FRAC_PI_2;

/// An arc longer than a multiple of 90° by this share of 90° still has that many pieces: a full turn in rounded radians has four.
const PIECE_SLACK: f64 = 1e-9;

/// Angles at which an arc from `a` to `b`, radians, is divided, both ends included: equal pieces of at most 90°.
fn breakpoints([a, b]: [f64; 2]) -> Vec<f64> {
    let pieces = ((b - a) / FRAC_PI_2 - PIECE_SLACK).ceil().max(1.0) as usize;
    (0..=pieces).map(|i| if i == pieces { b } else { a + (b - a) * i as f64 / pieces as f64 }).collect()
}

/// Makes the arc `radius·(cos φ, sin φ, 0)` in a frame, mm, `φ` in `[a, b]` radians with `a < b ≤ a + 2π`; its domain is `[a, b]`.
///
/// At every breakpoint the parameter is the angle; between them see [`parameter_of_angle`].
///
/// ```
/// use lampyris::{math::Frame, nurbs::conic};
/// let quarter = conic::arc(&Frame::IDENTITY, 2.0, [0.0, std::f64::consts::FRAC_PI_2]);
/// // A rational spline is a circle to the last digits, wherever it is evaluated.
/// let [a, b] = quarter.domain();
/// assert!((0..=10).all(|k| (quarter.evaluate(a + (b - a) * k as f64 / 10.0).length() - 2.0).abs() < 1e-14));
/// ```
pub fn arc(frame: &Frame, radius: f64, range: [f64; 2]) -> Curve {
    let (knots, local) = unit_arc(range);
    let points = local
        .iter()
        .map(|&(x, y, w)| Homogeneous::weighted(frame.point(radius * Point::new(x, y, 0.0)), w))
        .collect();
    Curve { degree: 2, knots, points }
}

/// Knots, and control points `(x, y, weight)` of the unit arc in the plane over a range of angles, radians; x and y are not weighted.
pub(super) fn unit_arc(range: [f64; 2]) -> (Vec<f64>, Vec<(f64, f64, f64)>) {
    let breaks = breakpoints(range);
    let mut knots = vec![breaks[0]; 3];
    let mut points = vec![(breaks[0].cos(), breaks[0].sin(), 1.0)];
    for (k, pair) in breaks.windows(2).enumerate() {
        let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        // The middle control point lies where the tangents cross, 1/cos out from the centre, with weight cos (*The
        // NURBS Book*, chapter 7).
        let w = half.cos();
        points.push((middle.cos() / w, middle.sin() / w, w));
        points.push((pair[1].cos(), pair[1].sin(), 1.0));
        knots.extend(std::iter::repeat_n(pair[1], if k + 2 == breaks.len() { 3 } else { 2 }));
    }
    (knots, points)
}

/// Spline parameter of an angle, radians, on the arc over `range`: `τ = tan(φ/2)/tan(h/2)` in each piece of half-angle `h`. Nothing is
/// clamped: beyond the ends the outer pieces go on, which holds to 180° from the middle of an outer piece.
pub fn parameter_of_angle(range: [f64; 2], angle: f64) -> f64 {
    in_piece(range, angle, |phi, half| half * (0.5 * phi).tan() / (0.5 * half).tan())
}

/// Angle, radians, of a spline parameter on the arc over `range`: the inverse of [`parameter_of_angle`].
#[cfg(test)]
pub(crate) fn angle_of_parameter(range: [f64; 2], parameter: f64) -> f64 {
    in_piece(range, parameter, |tau, half| 2.0 * (tau / half * (0.5 * half).tan()).atan())
}

/// Maps the offset of `x` from the middle of the piece that holds it, given with the piece's half-angle, and adds the middle again.
fn in_piece(range: [f64; 2], x: f64, map: impl Fn(f64, f64) -> f64) -> f64 {
    let breaks = breakpoints(range);
    // Inner breakpoints alone: angles beyond the ends belong to the first and last piece.
    let piece = breaks[1..breaks.len() - 1].partition_point(|&b| b <= x);
    let (a, b) = (breaks[piece], breaks[piece + 1]);
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    middle + map(x - middle, half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn angle_and_parameter_are_inverse_and_true() {
        for range in [[0.0, 2.0 * PI], [-1.3, 1.9], [0.2, 0.3]] {
            let c = arc(&Frame::IDENTITY, 1.0, range);
            for i in 0..=40 {
                let angle = range[0] + (range[1] - range[0]) * i as f64 / 40.0;
                let t = parameter_of_angle(range, angle);
                assert!((c.evaluate(t) - Point::new(angle.cos(), angle.sin(), 0.0)).length() < 1e-14);
                assert!((angle_of_parameter(range, t) - angle).abs() < 1e-14);
            }
        }
    }
}

//! Nearest points on curves: a sampled start and safeguarded Newton steps.
//!
//! Guarantee: the result is a stationary point of the distance, and the global minimum whenever the distance has a single dip within every
//! eighth of a Bézier span. Known weakness: a curve that folds more finely than that.

// Negated comparisons refuse NaN together with what is out of range.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

use super::{ControlPoint, Curve};
use crate::math::{Homogeneous, Point};

/// Samples of each Bézier span that seed the search.
const SEEDS: usize = 8;
/// Steps below this share of the domain end: a few units in the last place.
const CONVERGED_SHARE: f64 = 1e-15;

/// Finds the parameter of the point of the curve that is nearest to `p`, and the distance, mm.
///
/// ```
/// use lampyris::math::Point;
/// use lampyris::nurbs::{Curve, project};
/// let line = Curve::line(Point::ZERO, Point::new(10.0, 0.0, 0.0), [0.0, 1.0]);
/// let (t, distance) = project::nearest(&line, Point::new(3.0, 4.0, 0.0));
/// assert!((t - 0.3).abs() < 1e-12 && (distance - 4.0).abs() < 1e-12);
/// ```
pub fn nearest(curve: &Curve, p: Point) -> (f64, f64) {
    nearest_by(curve, |q| q - p, None)
}

/// As [`nearest`], from the parameter `start`; searches the whole curve only when the distance found from there is above `expected`, mm.
pub fn nearest_from(curve: &Curve, p: Point, start: f64, expected: f64) -> (f64, f64) {
    nearest_by(curve, |q| q - p, Some((start, expected)))
}

/// Finds the parameter that minimises the length of `offset(curve(t))`, and that length. `offset` must be affine; `start` is a parameter
/// with the length at which its local minimum is taken, as for [`nearest_from`].
pub fn nearest_by(curve: &Curve, offset: impl Fn(Point) -> Point, start: Option<(f64, f64)>) -> (f64, f64) {
    // Followed along a curve, the nearest point is mostly near the last one; only where it is not are all pieces
    // sampled.
    if let Some((t, expected)) = start {
        let found = descend_from(curve, &offset, t);
        if found.1 <= expected {
            return found;
        }
    }
    let [t0, t1] = curve.domain();
    let mut best = (t0, f64::INFINITY);
    let pieces = curve.bezier_pieces();
    let mut seeds = Vec::with_capacity(pieces.len() * SEEDS + 1);
    let reaches: Vec<f64> = pieces.iter().map(|piece| reach_of_an_eighth(piece, &offset)).collect();
    for (piece, pair) in pieces.iter().zip(curve.breakpoints().windows(2)) {
        let mut work = piece.clone();
        for k in 0..SEEDS {
            let s = k as f64 / SEEDS as f64;
            work.copy_from_slice(piece);
            // De Casteljau: `work[0]` ends as the point.
            for r in 1..work.len() {
                for j in 0..work.len() - r {
                    work[j] = work[j] * (1.0 - s) + work[j + 1] * s;
                }
            }
            seeds.push((pair[0] + s * (pair[1] - pair[0]), offset(work[0].position()).length_squared()));
        }
    }
    seeds.push((t1, offset(curve.evaluate(t1)).length_squared()));
    for i in 0..seeds.len() {
        let d = seeds[i].1;
        let lower = (i == 0 || d <= seeds[i - 1].1) && (i + 1 == seeds.len() || d <= seeds[i + 1].1);
        // A dip lies within the eighths at its sample's either side, and cannot be deeper than the longer of them is long.
        let [before, after] = [i.saturating_sub(1), i.min(seeds.len() - 2)].map(|k| reaches[k / SEEDS]);
        if lower && d.sqrt() - before.max(after) <= best.1 {
            let found = descend_from(curve, &offset, seeds[i].0);
            if found.1 < best.1 {
                best = found;
            }
        }
    }
    best
}

/// Returns a length, after `offset`, that no eighth of a Bézier piece exceeds.
fn reach_of_an_eighth(piece: &[Homogeneous], offset: &impl Fn(Point) -> Point) -> f64 {
    let corners: Vec<Point> = piece.iter().map(|p| offset(p.position())).collect();
    let steps = || corners.windows(2).map(|pair| (pair[1] - pair[0]).length());
    // Without weights the speed is at most that along the longest side of the control polygon; with them the whole polygon bounds the
    // piece.
    let is_polynomial = piece.iter().all(|p| p.weight() == piece[0].weight());
    let by_speed = steps().fold(0.0, f64::max) * (piece.len() - 1) as f64 / SEEDS as f64;
    if is_polynomial { by_speed } else { steps().sum() }
}

/// Descends from `start`, clamped to the domain, by Newton steps on the derivative of the squared length, halved while they do not
/// descend; returns the parameter and the length there.
fn descend_from(curve: &Curve, offset: &impl Fn(Point) -> Point, start: f64) -> (f64, f64) {
    let [t0, t1] = curve.domain();
    let zero = offset(Point::ZERO);
    let mut t = start.clamp(t0, t1);
    let mut at = offset(curve.evaluate(t)).length();
    for _ in 0..40 {
        let d = curve.derivatives(t);
        let (r, first, second) = (offset(d.point), offset(d.first) - zero, offset(d.second) - zero);
        let slope = r.dot(first);
        let newton = first.length_squared() + r.dot(second);
        let gauss = first.length_squared();
        // Far from the foot the second derivative may point uphill; Gauss–Newton's part of it never does.
        let curvature = if newton > 0.1 * gauss { newton } else { gauss };
        if !(curvature > 0.0) {
            break;
        }
        let mut step = -slope / curvature;
        let mut moved = false;
        // A step that does not descend is halved; after twelve times the place is as good as stationary.
        for _ in 0..12 {
            let next = (t + step).clamp(t0, t1);
            let distance = offset(curve.evaluate(next)).length();
            if distance <= at {
                moved = (next - t).abs() > CONVERGED_SHARE * (t1 - t0) && distance < at;
                t = next;
                at = distance;
                break;
            }
            step *= 0.5;
        }
        if !moved {
            break;
        }
    }
    (t, at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::conic;
    use std::f64::consts::PI;

    #[test]
    fn points_off_a_circle_project_radially() {
        let c = conic::arc(&Frame::IDENTITY, 3.0, [0.0, 2.0 * PI]);
        for i in 0..50 {
            let angle = 0.1 + 0.12 * f64::from(i);
            let direction = Point::new(angle.cos(), angle.sin(), 0.0);
            let (t, distance) = nearest(&c, 4.0 * direction);
            assert!((distance - 1.0).abs() < 1e-12);
            assert!((c.evaluate(t) - 3.0 * direction).length() < 1e-7);
        }
    }

    /// The near stretch lies between two samples that are far away: each piece is as long as it goes past the point.
    #[test]
    fn a_long_piece_that_passes_close_by_is_found() {
        let points = [[-1.0, 1.0], [1.0, 1.0], [47.0, 0.1], [-53.0, 0.1]].map(|[x, y]| Point::new(x, y, 0.0));
        let knots = vec![0.0, 0.0, 1.0, 2.0, 3.0, 3.0];
        let (c, _) = crate::nurbs::sanitise::curve(1, knots, &points, None).unwrap();
        let (t, distance) = nearest(&c, Point::ZERO);
        assert!((distance - 0.1).abs() < 1e-12, "{distance} at {t}");
        assert!((t - 2.47).abs() < 1e-12);
    }
}

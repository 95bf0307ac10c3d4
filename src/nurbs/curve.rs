//! Curves in space and in the parameter plane: one rational spline over either kind of control point.

use super::basis::{BROAD, MIDDLE, NARROW, WIDE, basis, find_span};
use crate::math::{Aabb, Homogeneous, Point};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::ops::{Add, Mul, Sub};

/// A homogeneous control point: `DVec4` of a space curve, `DVec3` of a curve in the parameter plane.
pub trait ControlPoint:
    Copy + PartialEq + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self>
{
    /// The type of its projection.
    type Position: Copy
        + PartialEq
        + Add<Output = Self::Position>
        + Sub<Output = Self::Position>
        + Mul<f64, Output = Self::Position>;
    /// All components zero, the weight too.
    const ZERO: Self;
    /// The control point at a position with a weight.
    fn weighted(position: Self::Position, weight: f64) -> Self;
    /// The numerator, weight times position.
    fn numerator(self) -> Self::Position;
    /// The weight.
    fn weight(self) -> f64;
    /// Numerator over weight, which must not be zero.
    fn position(self) -> Self::Position {
        self.numerator() * (1.0 / self.weight())
    }
}

impl ControlPoint for Homogeneous {
    type Position = Point;
    const ZERO: Self = Self::ZERO;
    fn weighted(position: Point, weight: f64) -> Self {
        (position * weight).extend(weight)
    }
    fn numerator(self) -> Point {
        self.truncate()
    }
    fn weight(self) -> f64 {
        self.w
    }
}

impl ControlPoint for DVec3 {
    type Position = DVec2;
    const ZERO: Self = Self::ZERO;
    fn weighted(position: DVec2, weight: f64) -> Self {
        (position * weight).extend(weight)
    }
    fn numerator(self) -> DVec2 {
        self.truncate()
    }
    fn weight(self) -> f64 {
        self.z
    }
}

/// A rational B-spline curve with clamped ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spline<P> {
    /// Polynomial degree, 1 to [`MAX_DEGREE`](super::MAX_DEGREE).
    pub degree: usize,
    /// Non-decreasing, `points.len() + degree + 1` of them.
    pub knots: Vec<f64>,
    /// Homogeneous control points, weights positive.
    pub points: Vec<P>,
}

/// A curve in space, mm.
pub type Curve = Spline<Homogeneous>;
/// A curve in the parameter plane of a surface.
pub type UvCurve = Spline<DVec3>;

/// Position and first two derivatives with respect to the curve parameter.
#[derive(Clone, Copy, Debug)]
pub struct CurveDerivatives<V> {
    /// Position.
    pub point: V,
    /// First derivative.
    pub first: V,
    /// Second derivative.
    pub second: V,
}

impl<P: ControlPoint> Spline<P> {
    /// The straight segment from `a` to `b` over the parameters `[t0, t1]`.
    pub fn line(a: P::Position, b: P::Position, [t0, t1]: [f64; 2]) -> Self {
        Self { degree: 1, knots: vec![t0, t0, t1, t1], points: vec![P::weighted(a, 1.0), P::weighted(b, 1.0)] }
    }

    /// The polyline through positions at strictly increasing parameters, as many of both; at least two.
    pub fn polyline(parameters: &[f64], positions: &[P::Position]) -> Self {
        let mut knots = Vec::with_capacity(parameters.len() + 2);
        knots.push(parameters[0]);
        knots.extend_from_slice(parameters);
        knots.push(parameters[parameters.len() - 1]);
        Self { degree: 1, knots, points: positions.iter().map(|&p| P::weighted(p, 1.0)).collect() }
    }

    /// The cubic Hermite spline (C¹) through positions with derivatives at strictly increasing parameters, as many of each; at least two.
    pub fn hermite(parameters: &[f64], positions: &[P::Position], derivatives: &[P::Position]) -> Self {
        let n = parameters.len();
        let (mut knots, mut points) = (vec![parameters[0]; 4], vec![P::weighted(positions[0], 1.0)]);
        for i in 0..n - 1 {
            let third = (parameters[i + 1] - parameters[i]) / 3.0;
            points.push(P::weighted(positions[i] + derivatives[i] * third, 1.0));
            points.push(P::weighted(positions[i + 1] - derivatives[i + 1] * third, 1.0));
            if i + 2 < n {
                knots.extend([parameters[i + 1]; 2]);
            }
        }
        points.push(P::weighted(positions[n - 1], 1.0));
        knots.extend([parameters[n - 1]; 4]);
        Self { degree: 3, knots, points }
    }

    /// First and last parameter.
    pub fn domain(&self) -> [f64; 2] {
        [self.knots[self.degree], self.knots[self.points.len()]]
    }

    /// Position at `t`, which is clamped to the domain.
    pub fn evaluate(&self, t: f64) -> P::Position {
        self.homogeneous_at(t).position()
    }

    /// Position and first two derivatives at `t`, which is clamped to the domain.
    pub fn derivatives(&self, t: f64) -> CurveDerivatives<P::Position> {
        // The quotient rule for S = A/w: S′ = (A′ − S·w′)/w and S″ = (A″ − 2·S′·w′ − S·w″)/w.
        let [a, a1, a2] = self.homogeneous::<2>(t);
        let inv = 1.0 / a.weight();
        let point = a.numerator() * inv;
        let first = (a1.numerator() - point * a1.weight()) * inv;
        let second = (a2.numerator() - first * (2.0 * a1.weight()) - point * a2.weight()) * inv;
        CurveDerivatives { point, first, second }
    }

    /// Homogeneous point at `t`, which is clamped to the domain.
    pub(crate) fn homogeneous_at(&self, t: f64) -> P {
        self.homogeneous::<0>(t)[0]
    }

    /// Homogeneous point and derivatives up to `ORDER` (at most 2) at `t`, which is clamped to the domain; zero beyond the order.
    fn homogeneous<const ORDER: usize>(&self, t: f64) -> [P; 3] {
        // Known degrees leave no loops, as for surfaces.
        match self.degree {
            1 => self.homogeneous_of_degree::<ORDER, NARROW>(t, 1),
            2 => self.homogeneous_of_degree::<ORDER, NARROW>(t, 2),
            3 => self.homogeneous_of_degree::<ORDER, NARROW>(t, 3),
            p @ 0..MIDDLE => self.homogeneous_of_degree::<ORDER, MIDDLE>(t, p),
            p @ MIDDLE..BROAD => self.homogeneous_of_degree::<ORDER, BROAD>(t, p),
            p => self.homogeneous_of_degree::<ORDER, WIDE>(t, p),
        }
    }

    /// As [`Spline::homogeneous`], with room for `W` basis functions; `degree` is the curve's, below `W`.
    #[inline(always)]
    fn homogeneous_of_degree<const ORDER: usize, const W: usize>(&self, t: f64, degree: usize) -> [P; 3] {
        let [t0, t1] = self.domain();
        let t = t.clamp(t0, t1);
        let span = find_span(&self.knots, degree, t);
        let b = basis::<ORDER, W>(&self.knots, degree, span, t);
        let active = &self.points[span - degree..=span];
        std::array::from_fn(|k| {
            if k > ORDER {
                return P::ZERO;
            }
            active.iter().zip(&b[k]).fold(P::ZERO, |sum, (&p, &w)| sum + p * w)
        })
    }

    /// Whether the first `degree + 1` knots coincide, and the last: the curve then ends at its outer control points.
    pub fn is_clamped(&self) -> bool {
        let (p, n) = (self.degree, self.points.len());
        self.knots[0] == self.knots[p] && self.knots[n] == self.knots[n + p]
    }

    /// The distinct knots of the domain, both ends included.
    pub fn breakpoints(&self) -> Vec<f64> {
        let mut b = self.knots[self.degree..=self.points.len()].to_vec();
        b.dedup();
        b
    }

    /// The same curve run backwards over the same domain, with `t` mapped to `t0 + t1 − t`.
    pub fn reversed(&self) -> Self {
        let [t0, t1] = self.domain();
        let mirrored = |k: f64| {
            // The ends are set, not computed: the domain stays to the bit.
            if k == t0 {
                t1
            } else if k == t1 {
                t0
            } else {
                t0 + (t1 - k)
            }
        };
        let knots = self.knots.iter().rev().map(|&k| mirrored(k)).collect();
        Self { degree: self.degree, knots, points: self.points.iter().rev().copied().collect() }
    }

    /// The same curve with its parameter mapped affinely onto `[a, b]`, `a < b`. The curve must be clamped: knots beyond the domain are
    /// moved to its ends.
    pub fn reparametrised(&self, [a, b]: [f64; 2]) -> Self {
        let [t0, t1] = self.domain();
        let map = |k: f64| {
            // The ends are set, not computed: knots that were equal must stay so to the bit.
            if k <= t0 {
                a
            } else if k >= t1 {
                b
            } else {
                a + (k - t0) * ((b - a) / (t1 - t0))
            }
        };
        Self {
            degree: self.degree,
            knots: self.knots.iter().map(|&k| map(k)).collect(),
            points: self.points.clone(),
        }
    }
}

impl Curve {
    /// A box that contains the curve: that of its control points.
    pub fn bounds(&self) -> Aabb {
        Aabb::from_points(self.points.iter().map(|p| p.position()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::conic;

    fn wavy() -> Curve {
        let xs =
            [(0.0, 0.0, 1.0), (1.0, 2.0, 0.5), (2.0, -1.0, 2.0), (3.0, 1.0, 1.0), (4.0, 0.0, 3.0), (5.0, 5.0, 1.0)];
        let points = xs.iter().map(|&(x, y, w)| Homogeneous::weighted(Point::new(x, y, x * y), w)).collect();
        Curve { degree: 3, knots: vec![0.0, 0.0, 0.0, 0.0, 1.0, 2.5, 3.0, 3.0, 3.0, 3.0], points }
    }

    #[test]
    fn cutting_keeps_the_curve() {
        let c = wavy();
        let cut = c.restricted(0.4, 2.7);
        assert_eq!(cut.domain(), [0.4, 2.7]);
        for i in 0..=50 {
            let t = 0.4 + 2.3 * i as f64 / 50.0;
            assert!((cut.evaluate(t) - c.evaluate(t)).length() < 1e-13);
        }
        for [a, b] in
            [[0.4, 2.7], [0.1, 0.3], [1.0, 2.5], [2.6, 3.0], [0.0, 2.6], [0.4, 2.5], [1.0, 3.0], [0.0, 3.0]]
        {
            let (all, own) = (c.restricted(a, b).points, c.restricted_points(a, b));
            assert_eq!(all.len(), own.len());
            assert!(all.iter().zip(&own).all(|(x, y)| (*x - *y).length() < 1e-13));
        }
    }

    #[test]
    fn an_unclamped_curve_is_clamped_to_its_domain() {
        let c = Curve { knots: vec![-1.0, -0.5, -0.2, 0.0, 1.0, 2.5, 3.0, 3.1, 3.2, 4.0], ..wavy() };
        let [a, b] = c.domain();
        let k = c.restricted(a, b);
        assert!(k.is_clamped() && !c.is_clamped());
        for i in 0..=30 {
            let t = a + (b - a) * i as f64 / 30.0;
            assert!((k.evaluate(t) - c.evaluate(t)).length() < 1e-13);
        }
        assert!((k.points[0].position() - c.evaluate(a)).length() < 1e-13);
    }

    #[test]
    fn a_reversed_curve_has_the_same_domain_to_the_bit() {
        // 12.42 + (−6.19 − −6.19) is no trouble, but −6.19 + (12.42 − −6.19) is an ulp below 12.42.
        let c = wavy().reparametrised([-6.19, 12.42]);
        let r = c.reversed();
        assert_eq!(r.domain(), c.domain());
        assert!((r.evaluate(1.0) - c.evaluate(-6.19 + 12.42 - 1.0)).length() < 1e-13);
    }

    #[test]
    fn bezier_pieces_meet_at_the_breakpoints() {
        let c = wavy();
        let pieces = c.bezier_pieces();
        assert_eq!(pieces.len(), 3);
        for (piece, t) in pieces.iter().zip(c.breakpoints()) {
            assert!((piece[0].position() - c.evaluate(t)).length() < 1e-14);
        }
    }

    #[test]
    fn derivatives_match_differences() {
        let c = wavy();
        let (t, h) = (1.7, 1e-5);
        let d = c.derivatives(t);
        let (a, b) = (c.evaluate(t - h), c.evaluate(t + h));
        assert!(((b - a) / (2.0 * h) - d.first).length() < 1e-7);
        assert!(((a + b - 2.0 * d.point) / (h * h) - d.second).length() < 1e-3);
    }

    #[test]
    fn hermite_converges_with_fourth_order_and_reverses() {
        let c = conic::arc(&Frame::IDENTITY, 2.0, [0.0, 1.0]);
        let error = |n: usize| {
            let ts: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
            let d: Vec<_> = ts.iter().map(|&t| c.derivatives(t)).collect();
            let points: Vec<_> = d.iter().map(|d| d.point).collect();
            let first: Vec<_> = d.iter().map(|d| d.first).collect();
            let h = Curve::hermite(&ts, &points, &first);
            let r = h.reversed();
            let samples = (0..=200).map(|i| i as f64 / 200.0);
            samples.fold(0f64, |e, t| {
                assert!((r.evaluate(1.0 - t) - h.evaluate(t)).length() < 1e-14);
                e.max((h.evaluate(t) - c.evaluate(t)).length())
            })
        };
        let ratio = error(8) / error(16);
        assert!((14.0..18.0).contains(&ratio), "{ratio}");
    }
}

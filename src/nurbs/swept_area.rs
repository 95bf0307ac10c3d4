//! Areas that curves sweep about a point, which add up to the area within a loop.
//!
//! By Green's theorem along the curves themselves: polygons of two circles in different numbers of arcs hide a ring that is narrower than
//! their sag, and take the inner circle for the larger one.

use super::curve::{ControlPoint, Curve, Spline, UvCurve};
use crate::math::quadrature::GAUSS;
use crate::math::{Point, Uv, Vector};
use std::iter::Sum;
use std::ops::Mul;

/// Parts of a span of knots that are integrated one by one where weights differ: of quarter circles the area is then right to 2e-10.
const RATIONAL_PARTS: usize = 2;
/// Highest degree of a polynomial whose spans one rule of [`GAUSS`] integrates exactly: the integrand's is twice that less one.
const EXACT_DEGREE: usize = 5;

impl<P: ControlPoint> Spline<P> {
    /// Sums up the `product` of where a point of the curve is, seen from `center`, and how it moves on, as it runs along the curve.
    fn swept_product<T: Sum + Mul<f64, Output = T>>(
        &self,
        center: P::Position,
        product: impl Fn(P::Position, P::Position) -> T,
    ) -> T {
        if self.degree == 1 {
            // Weights change how fast the point runs, not where: sides of a polygon are exact.
            return self
                .points
                .windows(2)
                .map(|side| {
                    let [from, to] = [side[0], side[1]].map(P::position);
                    product(from - center, to - from)
                })
                .sum();
        }
        let breaks = self.breakpoints();
        let is_polynomial = self.points.iter().all(|p| p.weight() == self.points[0].weight());
        let parts = if is_polynomial && self.degree <= EXACT_DEGREE { 1 } else { RATIONAL_PARTS };
        let nodes = breaks.windows(2).flat_map(|span| {
            let width = (span[1] - span[0]) / parts as f64;
            let start = move |part: usize| span[0] + part as f64 * width;
            (0..parts).flat_map(move |part| GAUSS.map(|(x, weight)| (start(part) + x * width, weight * width)))
        });
        nodes
            .map(|(t, weight)| {
                let d = self.derivatives(t);
                product(d.point - center, d.first) * weight
            })
            .sum()
    }

    /// First and last point.
    fn ends(&self) -> [P::Position; 2] {
        [self.points[0], self.points[self.points.len() - 1]].map(P::position)
    }
}

impl Curve {
    /// Returns the area, mm², that the line from `center` to a point of the curve sweeps as the point runs along it: the vector whose
    /// product with the unit normal of a plane is the area swept in it.
    pub(crate) fn swept_area(&self, center: Point) -> Vector {
        0.5 * self.swept_product(center, Vector::cross)
    }
}

/// Returns the area, in parameters, within a loop of curves, each with whether the loop runs against it; positive where the loop runs
/// counter-clockwise, 0 without curves. Straight steps join those that miss one another.
pub(crate) fn area_within<'a>(curves: impl Iterator<Item = (&'a UvCurve, bool)>) -> f64 {
    area_of_loop(curves, |center, curve, _, reversed| {
        let along = curve.swept_product(center, Uv::perp_dot);
        if reversed { -along } else { along }
    })
}

/// Returns a number that the area of [`area_within`] is not below: the polygon of the curves' ends, less what lies between each curve and
/// its chord at most. A twentieth of the time.
pub(crate) fn least_area_within<'a>(curves: impl Iterator<Item = (&'a UvCurve, bool)>) -> f64 {
    area_of_loop(curves, |center, curve, [start, end], _| {
        (start - center).perp_dot(end - center) - chord_area(curve)
    })
}

/// Adds up the area within a loop of curves, as [`area_within`], of what `along` says that each sweeps twice about a center: it is given
/// the curve with its ends in the order of the loop, and whether the loop runs against it.
fn area_of_loop<'a>(
    curves: impl Iterator<Item = (&'a UvCurve, bool)>,
    along: impl Fn(Uv, &UvCurve, [Uv; 2], bool) -> f64,
) -> f64 {
    let mut area = 0.0;
    let mut corner: Option<Uv> = None;
    let mut last = Uv::ZERO;
    for (curve, reversed) in curves {
        let mut ends = curve.ends();
        if reversed {
            ends.swap(0, 1);
        }
        // About the first corner: far from the origin the products would cancel.
        let center = *corner.get_or_insert(ends[0]);
        area += along(center, curve, ends, reversed);
        // The step from the curve before; about its own start nothing is swept by the first.
        area += (last - center).perp_dot(ends[0] - center);
        last = ends[1];
    }
    // A last step closes the loop at the corner itself, which sweeps nothing.
    0.5 * area
}

/// Bounds twice the area between a curve and its chord: about the middle of the chord, the control polygon's reach along it times the way
/// across, and the reach across times the way along.
fn chord_area(curve: &UvCurve) -> f64 {
    let [a, b] = curve.ends();
    if curve.degree == 1 && curve.points.len() == 2 {
        return 0.0;
    }
    let (middle, along) = (0.5 * (a + b), (b - a).try_normalize().unwrap_or(Uv::X));
    let (mut reach, mut way) = (Uv::ZERO, Uv::ZERO);
    let mut before = None;
    for p in &curve.points {
        let away = p.position() - middle;
        let local = Uv::new(away.dot(along), along.perp_dot(away));
        reach = reach.max(local.abs());
        way += (local - before.unwrap_or(local)).abs();
        before = Some(local);
    }
    reach.x * way.y + reach.y * way.x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::conic;
    use std::f64::consts::PI;

    #[test]
    fn sectors_have_their_area_whatever_arcs_they_are_made_of() {
        let center = Vector::new(3.0, -2.0, 1.0);
        let frame = Frame::translation(center);
        for angle in [0.4, 1.9, 2.0 * PI] {
            let area = conic::arc(&frame, 5.0, [0.3, 0.3 + angle]).swept_area(center);
            // r²φ/2 about the centre.
            assert!((area - Vector::Z * (12.5 * angle)).length() < 1e-7, "{angle}: {area}");
        }
    }

    #[test]
    fn steps_between_curves_that_miss_one_another_count_and_straight_sides_are_exact() {
        let line = |from: [f64; 2], to: [f64; 2]| UvCurve::line(from.into(), to.into(), [0.0, 7.0]);
        let mut unevenly_fast = line([1.0, 1.0], [0.0, 1.0]);
        unevenly_fast.points[1] *= 3.0;
        let sides = [line([0.0, 0.0], [1.0, 0.0]), unevenly_fast];
        assert_eq!(area_within(sides.iter().map(|side| (side, false))), 1.0);
        assert_eq!(area_within(sides.iter().rev().map(|side| (side, true))), -1.0);
        assert_eq!(area_within(std::iter::empty()), 0.0);
    }

    #[test]
    fn the_least_area_is_below_the_area_and_near_it_where_sides_are_nearly_straight() {
        let curve = |degree: usize, points: &[[f64; 3]]| UvCurve {
            degree,
            knots: [vec![0.0; degree + 1], vec![1.0; degree + 1]].concat(),
            points: points.iter().map(|&[x, y, w]| glam::DVec3::new(x * w, y * w, w)).collect(),
        };
        let least = |sides: &[UvCurve]| least_area_within(sides.iter().map(|side| (side, false)));
        // A disc of quarter arcs: π; its square has 2.
        let w = 0.5f64.sqrt();
        let corners = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        let quarter = |k: usize| {
            let ([a, b], [c, d]) = (corners[k], corners[(k + 1) % 4]);
            curve(2, &[[a, b, 1.0], [a + c, b + d, w], [c, d, 1.0]])
        };
        let disc: Vec<UvCurve> = (0..4).map(quarter).collect();
        assert!(least(&disc) <= PI && least(&disc) > -PI, "{}", least(&disc));
        // Run the other way the area is −π.
        assert!(least_area_within(disc.iter().rev().map(|side| (side, true))) <= -PI);
        // Three turns go round more than their hull.
        let turns: Vec<UvCurve> = (0..12).map(|k| quarter(k % 4)).collect();
        assert!(least(&turns) <= 3.0 * PI);
        // Sides of 10 × 1 that bend inwards, parabolas 0.02 high at most.
        let bent = [
            curve(2, &[[0.0, 0.0, 1.0], [5.0, 0.04, 1.0], [10.0, 0.0, 1.0]]),
            UvCurve::line([10.0, 0.0].into(), [10.0, 1.0].into(), [0.0, 1.0]),
            curve(2, &[[10.0, 1.0, 1.0], [5.0, 0.96, 1.0], [0.0, 1.0, 1.0]]),
            UvCurve::line([0.0, 1.0].into(), [0.0, 0.0].into(), [0.0, 1.0]),
        ];
        let area = 10.0 - 2.0 * (2.0 / 3.0) * 10.0 * 0.02;
        assert!(least(&bent) <= area && least(&bent) > 9.0, "{}", least(&bent));
    }
}

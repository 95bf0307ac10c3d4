//! Areas that curves sweep about a point, which add up to the area within a loop.
//!
//! By Green's theorem along the curves themselves: polygons of two circles in different numbers of arcs hide a ring that is narrower than
//! their sag, and take the inner circle for the larger one.

use super::curve::{ControlPoint, Curve, Spline, UvCurve};
use crate::math::quadrature::GAUSS;
use crate::math::{Point, Uv, Vector};
use std::iter::Sum;
use std::ops::Mul;

/// Parts of a span of knots that are integrated one by one: of quarter circles the area is then right to 2e-10.
const PARTS: usize = 2;

impl<P: ControlPoint> Spline<P> {
    /// Integral, over the parameter, of what `integrand` makes of place and first derivative.
    fn integral<T: Sum + Mul<f64, Output = T>>(&self, integrand: impl Fn(P::Position, P::Position) -> T) -> T {
        let breaks = self.breakpoints();
        let nodes = breaks.windows(2).flat_map(|span| {
            let width = (span[1] - span[0]) / PARTS as f64;
            let start = move |part: usize| span[0] + part as f64 * width;
            (0..PARTS).flat_map(move |part| GAUSS.map(|(x, weight)| (start(part) + x * width, weight * width)))
        });
        nodes
            .map(|(t, weight)| {
                let d = self.derivatives(t);
                integrand(d.point, d.first) * weight
            })
            .sum()
    }
}

impl UvCurve {
    /// Area, in parameters, that the line from `center` to a point of the curve sweeps as the point runs along it: positive
    /// counter-clockwise.
    pub(crate) fn swept_area(&self, center: Uv) -> f64 {
        0.5 * self.integral(|point, first| (point - center).perp_dot(first))
    }
}

impl Curve {
    /// As for curves of parameters, mm²: the vector whose product with the unit normal of a plane is the area swept in it.
    pub(crate) fn swept_area(&self, center: Point) -> Vector {
        0.5 * self.integral(|point, first| (point - center).cross(first))
    }
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
        let line = UvCurve::line(Uv::new(1.0, 0.0), Uv::new(0.0, 2.0), [0.0, 7.0]);
        assert!((line.swept_area(Uv::ZERO) - 1.0).abs() < 1e-15);
    }
}

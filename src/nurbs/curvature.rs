//! Curvatures of a surface at a point, by its fundamental forms.

use super::{SecondDerivatives, Surface};
use crate::math::{Uv, Vector};

/// Derivatives whose product, or whose ratio, is below this share span no plane: curvatures would be rounding.
const SINGULAR: f64 = 1e-9;

/// First and second fundamental form of a surface at a point, with respect to `Su × Sv`.
///
/// ```
/// use lampyris::{math::Frame, math::Uv, nurbs::sweep};
/// let tube = sweep::cylinder(&Frame::IDENTITY, 4.0, [0.0, 3.0], [0.0, 10.0]);
/// // Straight along the axis, and away from the outward normal with 1/r around it.
/// let [along, around] = tube.forms(Uv::new(1.0, 5.0)).unwrap().principal();
/// assert!(along.abs() < 1e-12 && (around + 0.25).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FundamentalForms {
    /// `Su·Su`, `Su·Sv`, `Sv·Sv`, mm² per parameter².
    pub first: [f64; 3],
    /// `Suu·n`, `Suv·n`, `Svv·n`, mm per parameter².
    pub second: [f64; 3],
    /// The unit normal along `Su × Sv`.
    pub normal: Vector,
}

impl FundamentalForms {
    /// Computes the forms from derivatives; `None` where the first ones span no plane: one is zero beside the other, or both are parallel.
    pub fn new(d: &SecondDerivatives) -> Option<Self> {
        let n = d.du.cross(d.dv);
        let (lu, lv) = (d.du.length(), d.dv.length());
        let spans = n.length() > SINGULAR * lu * lv && lu.min(lv) > SINGULAR * lu.max(lv);
        let normal = n.try_normalize().filter(|_| spans)?;
        Some(Self {
            first: [d.du.dot(d.du), d.du.dot(d.dv), d.dv.dot(d.dv)],
            second: [d.duu.dot(normal), d.duv.dot(normal), d.dvv.dot(normal)],
            normal,
        })
    }

    /// Principal curvatures, 1/mm, the larger one first; positive where the surface bends towards its normal.
    pub fn principal(&self) -> [f64; 2] {
        let ([e, f, g], [l, m, n]) = (self.first, self.second);
        let det = e * g - f * f;
        let mean = (e * n - 2.0 * f * m + g * l) / (2.0 * det);
        let gauss = (l * n - m * m) / det;
        // Rounding may make it negative where both curvatures are equal.
        let root = (mean * mean - gauss).max(0.0).sqrt();
        [mean + root, mean - root]
    }

    /// The largest absolute normal curvature, 1/mm.
    pub fn largest_curvature(&self) -> f64 {
        let [a, b] = self.principal();
        a.abs().max(b.abs())
    }

    /// Normal curvature in a direction of the parameter plane, of any length, 1/mm; 0 for a zero direction.
    pub fn normal_curvature(&self, d: Uv) -> f64 {
        let form = |q: [f64; 3]| q[0] * d.x * d.x + 2.0 * q[1] * d.x * d.y + q[2] * d.y * d.y;
        let length = form(self.first);
        if length > 0.0 { form(self.second) / length } else { 0.0 }
    }

    /// How far the normal turns about a direction of the parameter plane, of any length, on a saddle, 1/mm: the geodesic torsion,
    /// `√((k₁ − k)(k − k₂))`, or that of an asymptotic direction, `√(−k₁k₂)`, where it is less. 0 for a zero direction and where the
    /// surface bends one way: there a line that is oblique to the principal directions has torsion too, but facets along these have none.
    pub(crate) fn saddle_torsion(&self, d: Uv) -> f64 {
        if d == Uv::ZERO {
            return 0.0;
        }
        let ([most, least], along) = (self.principal(), self.normal_curvature(d));
        let torsion = ((most - along) * (along - least)).max(0.0).sqrt();
        torsion.min((-most * least).max(0.0).sqrt())
    }
}

impl Surface {
    /// The fundamental forms at `uv`, which is clamped to the domain; `None` at poles and cusps.
    pub fn forms(&self, uv: Uv) -> Option<FundamentalForms> {
        FundamentalForms::new(&self.second_derivatives(uv))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Homogeneous};
    use crate::nurbs::sweep;
    use std::f64::consts::PI;

    #[test]
    fn a_torus_has_its_closed_form_curvatures() {
        let (major, minor) = (5.0, 2.0);
        let s = sweep::torus(&Frame::IDENTITY, major, minor, [0.0, 2.0 * PI], [0.0, 2.0 * PI]);
        for i in 0..16 {
            let v = 2.0 * PI * i as f64 / 16.0;
            let phi = crate::nurbs::conic::angle_of_parameter([0.0, 2.0 * PI], v);
            let forms = s.forms(Uv::new(1.1, v)).unwrap();
            let around = -phi.cos() / (major + minor * phi.cos());
            let mut expected = [around, -1.0 / minor];
            expected.sort_by(|a, b| b.total_cmp(a));
            for (k, e) in forms.principal().iter().zip(expected) {
                assert!((k - e).abs() < 1e-11, "{k} {e}");
            }
            assert!((forms.normal_curvature(Uv::Y) + 1.0 / minor).abs() < 1e-11);
            // Lines of curvature have no torsion.
            assert!(forms.saddle_torsion(Uv::X).max(forms.saddle_torsion(Uv::Y)) < 1e-6);
        }
    }

    /// Of z = x y / c at the origin both parameter lines are straight, and the normal turns about them by 1 / c; the lines between them are
    /// those of curvature. A tube has none of it in any direction.
    #[test]
    fn a_hyperbolic_paraboloid_twists_along_its_straight_lines() {
        let c = 50.0;
        let row = |x: f64| [0.0, 3.0].map(|y| Homogeneous::new(x, y, x * y / c, 1.0));
        let knots = vec![0.0, 0.0, 1.0, 1.0];
        let points = [row(0.0), row(2.0)].as_flattened().to_vec();
        let saddle = Surface { degree: [1, 1], knots: [knots.clone(), knots], points };
        let forms = saddle.forms(Uv::ZERO).unwrap();
        // A step of (3, 2) in the parameters goes as far along x as along y.
        let expected = [(Uv::X, 1.0 / c), (Uv::Y, 1.0 / c), (Uv::new(3.0, 2.0), 0.0), (Uv::ZERO, 0.0)];
        for (direction, expected) in expected {
            assert!((forms.saddle_torsion(direction) - expected).abs() < 1e-8, "{direction}");
        }
        let tube = sweep::cylinder(&Frame::IDENTITY, 4.0, [0.0, 3.0], [0.0, 10.0]);
        assert!(tube.forms(Uv::new(1.0, 5.0)).unwrap().saddle_torsion(Uv::new(1.0, 2.0)) < 1e-6);
    }
}

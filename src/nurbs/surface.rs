//! Rational B-spline surfaces: evaluation, derivatives, normals also at poles, isolines, parts.

use super::basis::{BROAD, MIDDLE, NARROW, WIDE, basis, find_span};
use super::{ControlPoint, Curve};
use crate::math::{Aabb, Homogeneous, Point, Uv, Vector};
use serde::{Deserialize, Serialize};

/// Derivatives whose product, or whose ratio over the whole domain, is below this share span no plane of their own.
const NO_PLANE: f64 = 1e-10;
/// A derivative below this share of the other vanishes: the limit along the mixed derivative is taken.
const VANISHING: f64 = 1e-8;
/// How far inside the domain the normal is taken where no limit exists, as a share of it.
const INSIDE_SHARE: f64 = 1e-4;
/// Derivatives inside the domain whose product is below this share have no normal.
const NO_NORMAL: f64 = 1e-12;

/// A rational B-spline surface with clamped ends in both directions.
///
/// ```
/// use lampyris::math::{Frame, Uv};
/// use lampyris::nurbs::sweep;
///
/// let ball = sweep::sphere(&Frame::IDENTITY, 10.0, [0.0, 6.0], [-1.5, 1.5]);
/// let uv = Uv::new(1.0, 0.5);
/// let (point, normal) = (ball.evaluate(uv), ball.normal(uv).unwrap());
/// assert!((point.length() - 10.0).abs() < 1e-13 && (normal - point / 10.0).length() < 1e-13);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// Polynomial degrees in u and v, 1 to [`super::MAX_DEGREE`].
    pub degree: [usize; 2],
    /// Knots in u and in v, non-decreasing.
    pub knots: [Vec<f64>; 2],
    /// Homogeneous control points, `points[i * count_v + j]`, weights positive.
    pub points: Vec<Homogeneous>,
}

/// Position and first partial derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Derivatives {
    /// Position, mm.
    pub point: Point,
    /// ∂S/∂u.
    pub du: Vector,
    /// ∂S/∂v.
    pub dv: Vector,
}

/// Position, first and second partial derivatives.
#[derive(Clone, Copy, Debug)]
pub struct SecondDerivatives {
    /// Position, mm.
    pub point: Point,
    /// ∂S/∂u.
    pub du: Vector,
    /// ∂S/∂v.
    pub dv: Vector,
    /// ∂²S/∂u².
    pub duu: Vector,
    /// ∂²S/∂u∂v.
    pub duv: Vector,
    /// ∂²S/∂v².
    pub dvv: Vector,
}

impl SecondDerivatives {
    /// Divides by the weight: from homogeneous S, Su, Sv, Suu, Suv and Svv to those of the surface in space.
    pub(super) fn projected([a, au, av, auu, auv, avv]: [Homogeneous; 6]) -> Self {
        let inv = 1.0 / a.w;
        let point = a.truncate() * inv;
        let du = (au.truncate() - point * au.w) * inv;
        let dv = (av.truncate() - point * av.w) * inv;
        Self {
            point,
            du,
            dv,
            duu: (auu.truncate() - du * (2.0 * au.w) - point * auu.w) * inv,
            duv: (auv.truncate() - du * av.w - dv * au.w - point * auv.w) * inv,
            dvv: (avv.truncate() - dv * (2.0 * av.w) - point * avv.w) * inv,
        }
    }
}

impl Surface {
    /// Number of control points in u and v.
    pub fn counts(&self) -> [usize; 2] {
        [self.knots[0].len() - self.degree[0] - 1, self.knots[1].len() - self.degree[1] - 1]
    }

    /// Parameter ranges `[[u0, u1], [v0, v1]]`.
    pub fn domain(&self) -> [[f64; 2]; 2] {
        let [nu, nv] = self.counts();
        [[self.knots[0][self.degree[0]], self.knots[0][nu]], [self.knots[1][self.degree[1]], self.knots[1][nv]]]
    }

    /// The nearest parameters inside the domain.
    pub fn clamp(&self, uv: Uv) -> Uv {
        let [[u0, u1], [v0, v1]] = self.domain();
        Uv::new(uv.x.clamp(u0, u1), uv.y.clamp(v0, v1))
    }

    /// The distinct knots of the domain in `direction`, 0 for u and 1 for v, both ends included.
    pub fn breakpoints(&self, direction: usize) -> Vec<f64> {
        let mut breaks = self.knots[direction][self.degree[direction]..=self.counts()[direction]].to_vec();
        breaks.dedup();
        breaks
    }

    /// Position at `uv`, which is clamped to the domain.
    pub fn evaluate(&self, uv: Uv) -> Point {
        self.homogeneous_at(uv).project()
    }

    /// Homogeneous point at `uv`, which is clamped to the domain.
    pub(crate) fn homogeneous_at(&self, uv: Uv) -> Homogeneous {
        let [a] = self.sums::<0, 1>(uv);
        a
    }

    /// Position and first derivatives at `uv`, which is clamped to the domain.
    pub fn derivatives(&self, uv: Uv) -> Derivatives {
        let [a, au, av] = self.sums::<1, 3>(uv);
        let inv = 1.0 / a.w;
        let point = a.truncate() * inv;
        Derivatives { point, du: (au.truncate() - point * au.w) * inv, dv: (av.truncate() - point * av.w) * inv }
    }

    /// Position, first and second derivatives at `uv`, which is clamped to the domain.
    pub fn second_derivatives(&self, uv: Uv) -> SecondDerivatives {
        SecondDerivatives::projected(self.sums::<2, 6>(uv))
    }

    /// Homogeneous S, Su, Sv, Suu, Suv and Svv at `uv`, which is clamped to the domain: the `N` of them up to `ORDER`.
    fn sums<const ORDER: usize, const N: usize>(&self, uv: Uv) -> [Homogeneous; N] {
        // Known degrees leave no loops: meshing spends a third of its time here.
        match self.degree {
            [1, 1] => self.sums_of_degree::<ORDER, N, NARROW>(uv, [1, 1]),
            [1, 2] => self.sums_of_degree::<ORDER, N, NARROW>(uv, [1, 2]),
            [1, 3] => self.sums_of_degree::<ORDER, N, NARROW>(uv, [1, 3]),
            [2, 1] => self.sums_of_degree::<ORDER, N, NARROW>(uv, [2, 1]),
            [2, 2] => self.sums_of_degree::<ORDER, N, NARROW>(uv, [2, 2]),
            [3, 1] => self.sums_of_degree::<ORDER, N, NARROW>(uv, [3, 1]),
            [3, 3] => self.sums_of_degree::<ORDER, N, NARROW>(uv, [3, 3]),
            degree => match degree[0].max(degree[1]) {
                0..NARROW => self.sums_of_degree::<ORDER, N, NARROW>(uv, degree),
                NARROW..MIDDLE => self.sums_of_degree::<ORDER, N, MIDDLE>(uv, degree),
                MIDDLE..BROAD => self.sums_of_degree::<ORDER, N, BROAD>(uv, degree),
                _ => self.sums_of_degree::<ORDER, N, WIDE>(uv, degree),
            },
        }
    }

    /// As [`Surface::sums`], with room for `W` basis functions; `p` and `q` are the surface's degrees, below `W`.
    #[inline(always)]
    fn sums_of_degree<const ORDER: usize, const N: usize, const W: usize>(
        &self,
        uv: Uv,
        [p, q]: [usize; 2],
    ) -> [Homogeneous; N] {
        const DERIVATIVE: [(usize, usize); 6] = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)];
        let uv = self.clamp(uv);
        let count_v = self.counts()[1];
        let (span_u, span_v) = (find_span(&self.knots[0], p, uv.x), find_span(&self.knots[1], q, uv.y));
        let bu = basis::<ORDER, W>(&self.knots[0], p, span_u, uv.x);
        let bv = basis::<ORDER, W>(&self.knots[1], q, span_v, uv.y);
        let mut sums = [Homogeneous::ZERO; N];
        for i in 0..=p {
            let start = (span_u - p + i) * count_v + span_v - q;
            let mut row = [Homogeneous::ZERO; 3];
            for (j, &c) in self.points[start..=start + q].iter().enumerate() {
                for k in 0..=ORDER {
                    row[k] += c * bv[k][j];
                }
            }
            // `row` holds the sums over v of all orders, so that each of the mixed derivatives costs p + 1 products
            // more.
            for (sum, (a, b)) in sums.iter_mut().zip(DERIVATIVE) {
                *sum += row[b] * bu[a][i];
            }
        }
        sums
    }

    /// Unit normal along `Su × Sv` at `uv`, which is clamped to the domain; at a pole or collapsed edge the limit from inside; `None` where
    /// there is none.
    pub fn normal(&self, uv: Uv) -> Option<Vector> {
        let d = self.derivatives(uv);
        let n = d.du.cross(d.dv);
        if n.length() > NO_PLANE * d.du.length() * d.dv.length() && n.length_squared() > 0.0 {
            // Over the whole domain, in lengths that compare: at the apex of a cone 850 m long what rounding leaves of Su was 1e-10 of Sv.
            let [[u0, u1], [v0, v1]] = self.domain();
            let (lu, lv) = (d.du.length() * (u1 - u0), d.dv.length() * (v1 - v0));
            if lu.min(lv) > NO_PLANE * lu.max(lv) {
                return n.try_normalize();
            }
        }
        self.limit_normal(uv)
    }

    /// The unit normal just inside the domain, seen from a singular point, clamped to the domain: along the mixed derivative where one
    /// partial derivative vanishes, otherwise at a point moved 1e-4 of the domain towards its centre. `None` where that has none either.
    pub(crate) fn limit_normal(&self, uv: Uv) -> Option<Vector> {
        let [[u0, u1], [v0, v1]] = self.domain();
        let uv = uv.clamp(Uv::new(u0, v0), Uv::new(u1, v1));
        let d = self.second_derivatives(uv);
        let inward_u = if uv.x > 0.5 * (u0 + u1) { -1.0 } else { 1.0 };
        let inward_v = if uv.y > 0.5 * (v0 + v1) { -1.0 } else { 1.0 };
        // Comparable lengths: derivatives times the extent of the domain.
        let (lu, lv) = (d.du.length() * (u1 - u0), d.dv.length() * (v1 - v0));
        // At a pole Su = 0 all along v; just inside Su ≈ h·Suv, so that Su × Sv tends to the direction of ±Suv × Sv. The other way round
        // where Sv vanishes.
        let n = if lu < VANISHING * lv { d.duv.cross(d.dv) * inward_v } else { d.du.cross(d.duv) * inward_u };
        let reference = d.duv.length() * d.du.length().max(d.dv.length());
        if lu.min(lv) < VANISHING * lu.max(lv) && n.length() > VANISHING * reference {
            return n.try_normalize();
        }
        let moved = uv + INSIDE_SHARE * Uv::new((u1 - u0) * inward_u, (v1 - v0) * inward_v);
        let d = self.derivatives(moved);
        let n = d.du.cross(d.dv);
        (n.length() > NO_NORMAL * d.du.length() * d.dv.length()).then(|| n.try_normalize()).flatten()
    }

    /// A box that contains the surface: that of its control points.
    pub fn bounds(&self) -> Aabb {
        Aabb::from_points(self.points.iter().map(|p| p.project()))
    }

    /// The line of constant u for `direction` 0 (a curve in v), or of constant v for 1 (a curve in u); `at` is that parameter, clamped to
    /// the domain.
    pub fn isoline(&self, direction: usize, at: f64) -> Curve {
        // `direction` is the one held constant.
        let lines = self.lines(direction);
        let other = 1 - direction;
        let points = lines
            .into_iter()
            .map(|points| {
                let c = Curve { degree: self.degree[direction], knots: self.knots[direction].clone(), points };
                let [a, b] = c.domain();
                let at = at.clamp(a, b);
                c.homogeneous_at(at)
            })
            .collect();
        Curve { degree: self.degree[other], knots: self.knots[other].clone(), points }
    }

    /// Control polygons that run along `direction`, 0 for u and 1 for v.
    fn lines(&self, direction: usize) -> Vec<Vec<Homogeneous>> {
        let [nu, nv] = self.counts();
        if direction == 0 {
            (0..nv).map(|j| (0..nu).map(|i| self.points[i * nv + j]).collect()).collect()
        } else {
            self.points.chunks(nv).map(<[_]>::to_vec).collect()
        }
    }

    /// Applies a change (cutting, refining, reversing) to the lines of control points along one direction, 0 for u and 1 for v, each given
    /// as a curve. What it does must depend on degree and knots alone, and give all lines the same degree, knots and number of points.
    ///
    /// # Panics
    /// For another direction; may panic where numbers of points differ, or else gives a wrong surface.
    pub fn map_direction(&self, direction: usize, change: impl Fn(Curve) -> Curve) -> Self {
        let (degree, knots) = (self.degree[direction], &self.knots[direction]);
        let lines: Vec<Curve> = self
            .lines(direction)
            .into_iter()
            .map(|points| change(Curve { degree, knots: knots.clone(), points }))
            .collect();
        // A change of the knots is the same for every line: the first one gives degree and knots of all.
        let first = &lines[0];
        let mut s = self.clone();
        s.degree[direction] = first.degree;
        s.knots[direction] = first.knots.clone();
        let n = first.points.len();
        s.points = if direction == 0 {
            (0..n).flat_map(|i| lines.iter().map(move |l| l.points[i])).collect()
        } else {
            lines.iter().flat_map(|l| l.points.iter().copied()).collect()
        };
        s
    }

    /// The part over a rectangle inside the domain, of positive width both ways; an unclamped surface comes out clamped.
    pub fn restricted(&self, [[u0, u1], [v0, v1]]: [[f64; 2]; 2]) -> Self {
        self.map_direction(0, |c| c.restricted(u0, u1)).map_direction(1, |c| c.restricted(v0, v1))
    }

    /// The surface with every control point's position changed by `place` and weights kept: exact for affine maps.
    pub fn transformed(&self, place: impl Fn(Point) -> Point) -> Self {
        let points = self.points.iter().map(|p| Homogeneous::weighted(place(p.project()), p.w)).collect();
        Self { points, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::sweep;
    use std::f64::consts::PI;

    #[test]
    fn a_sphere_is_a_sphere_with_normals_outward_also_at_its_poles() {
        let s = sweep::sphere(&Frame::IDENTITY, 3.0, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]);
        for i in 0..=24 {
            for j in 0..=12 {
                let uv = Uv::new(2.0 * PI * i as f64 / 24.0, PI * (j as f64 / 12.0 - 0.5));
                let p = s.evaluate(uv);
                assert!((p.length() - 3.0).abs() < 1e-14);
                assert!((s.normal(uv).unwrap() - p / 3.0).length() < 1e-6, "{uv}");
            }
        }
    }

    /// Loops over a degree and the straight code for it, on nets of pseudo-random points and weights over uneven knots.
    #[test]
    fn a_degree_known_to_the_compiler_gives_the_same_bits() {
        let unit = |k: usize| (k as f64 * 0.618_033_988_75).fract();
        for degree @ [p, q] in [[1, 1], [1, 2], [1, 3], [2, 1], [2, 2], [3, 1], [3, 3], [2, 3], [4, 2], [9, 5]] {
            let knots = |d: usize| [vec![0.0; d + 1], vec![0.3, 0.7, 0.7], vec![1.0; d + 1]].concat();
            let count = (p + 4) * (q + 4);
            let points = (0..count).map(|k| Homogeneous::new(unit(k), unit(3 * k), unit(7 * k), 0.5 + unit(5 * k)));
            let s = Surface { degree, knots: [knots(p), knots(q)], points: points.collect() };
            for k in 0..40 {
                let uv = Uv::new(unit(11 * k), unit(13 * k));
                let looped = s.sums_of_degree::<2, 6, WIDE>(uv, std::hint::black_box(degree));
                assert_eq!(s.sums::<2, 6>(uv), looped, "{degree:?} at {uv}");
                assert_eq!(s.sums::<1, 3>(uv), looped[..3], "{degree:?} at {uv}");
                assert_eq!(s.sums::<0, 1>(uv), looped[..1], "{degree:?} at {uv}");
            }
        }
    }

    #[test]
    fn second_derivatives_match_differences() {
        let s = sweep::torus(&Frame::IDENTITY, 5.0, 2.0, [0.0, 2.0 * PI], [0.0, 2.0 * PI]);
        let (uv, h) = (Uv::new(0.7, 2.2), 1e-5);
        let d = s.second_derivatives(uv);
        let (u, v) = (Uv::new(h, 0.0), Uv::new(0.0, h));
        let (pu, pv) = (s.derivatives(uv + u), s.derivatives(uv + v));
        let (mu, mv) = (s.derivatives(uv - u), s.derivatives(uv - v));
        assert!(((pu.du - mu.du) / (2.0 * h) - d.duu).length() < 1e-6);
        assert!(((pv.du - mv.du) / (2.0 * h) - d.duv).length() < 1e-6);
        assert!(((pv.dv - mv.dv) / (2.0 * h) - d.dvv).length() < 1e-6);
    }

    #[test]
    fn restrictions_and_isolines_keep_the_points() {
        let s = sweep::torus(&Frame::IDENTITY, 5.0, 2.0, [0.0, 2.0 * PI], [0.0, 2.0 * PI]);
        let r = s.restricted([[0.3, 4.0], [1.0, 5.5]]);
        assert_eq!(r.domain(), [[0.3, 4.0], [1.0, 5.5]]);
        let uv = Uv::new(2.9, 3.3);
        assert!((r.evaluate(uv) - s.evaluate(uv)).length() < 1e-13);
        assert!((s.isoline(0, 2.9).evaluate(3.3) - s.evaluate(uv)).length() < 1e-13);
        assert!((s.isoline(1, 3.3).evaluate(2.9) - s.evaluate(uv)).length() < 1e-13);
    }
}

//! Bézier patches: the polynomial pieces of a surface, evaluated in Bernstein form.

use super::basis::{BROAD, MIDDLE, NARROW, WIDE};
use super::blossom::append_bezier_pieces;
use super::{SecondDerivatives, Surface};
use crate::math::{Aabb, Homogeneous, Uv};

/// A rational Bézier patch: one polynomial piece of a surface, over local parameters `[0, 1]²`.
///
/// ```
/// use lampyris::{math::Frame, math::Uv, nurbs::sweep};
/// let patch = &sweep::sphere(&Frame::IDENTITY, 1.0, [0.0, 1.0], [0.0, 1.0]).bezier_patches()[0];
/// let [low, high] = patch.halves(0);
/// // Both halves end in the middle.
/// let [a, b, c] = [(patch, 0.5), (&low, 1.0), (&high, 0.0)].map(|(p, u)| p.local_jet(Uv::new(u, 0.3))[0]);
/// assert!((a - b).length() < 1e-14 && (a - c).length() < 1e-14);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BezierPatch {
    /// Polynomial degrees in u and v.
    pub degree: [usize; 2],
    /// Homogeneous control points, `points[i * (degree[1] + 1) + j]`.
    pub points: Vec<Homogeneous>,
    /// The rectangle `[[u0, u1], [v0, v1]]` of the surface's domain that the patch covers.
    pub domain: [[f64; 2]; 2],
}

/// Calls a method with tables of basis functions just wide enough for both degrees: clearing wider ones took a quarter of meshing. The
/// degrees of most surfaces are known to the compiler, which leaves no loops.
macro_rules! as_wide_as_needed {
    ($patch:ident.$method:ident($($argument:expr),*)) => {
        match $patch.degree {
            [1, 1] => $patch.$method::<NARROW>([1, 1], $($argument),*),
            [1, 2] => $patch.$method::<NARROW>([1, 2], $($argument),*),
            [2, 1] => $patch.$method::<NARROW>([2, 1], $($argument),*),
            [2, 2] => $patch.$method::<NARROW>([2, 2], $($argument),*),
            [1, 3] => $patch.$method::<NARROW>([1, 3], $($argument),*),
            [3, 1] => $patch.$method::<NARROW>([3, 1], $($argument),*),
            [3, 3] => $patch.$method::<NARROW>([3, 3], $($argument),*),
            degree => match degree[0].max(degree[1]) {
                0..NARROW => $patch.$method::<NARROW>(degree, $($argument),*),
                NARROW..MIDDLE => $patch.$method::<MIDDLE>(degree, $($argument),*),
                MIDDLE..BROAD => $patch.$method::<BROAD>(degree, $($argument),*),
                _ => $patch.$method::<WIDE>(degree, $($argument),*),
            },
        }
    };
}

impl Surface {
    /// Returns the Bézier patches over the knot rectangles that are not empty, v fastest, by knot insertion.
    pub fn bezier_patches(&self) -> Vec<BezierPatch> {
        let [p, q] = self.degree;
        let [nu, nv] = self.counts();
        let (us, vs) = (self.breakpoints(0), self.breakpoints(1));
        // First in u, then each row in v: knot insertion in one direction does not see the other.
        let mut line: Vec<Homogeneous> = Vec::with_capacity(nu.max(nv));
        // Bézier points in u of every column of control points, column by column.
        let mut in_u = Vec::with_capacity(nv * (us.len() - 1) * (p + 1));
        for j in 0..nv {
            line.clear();
            line.extend((0..nu).map(|i| self.points[i * nv + j]));
            append_bezier_pieces(p, &self.knots[0], &line, &mut in_u);
        }
        let column = (us.len() - 1) * (p + 1);
        let mut patches = Vec::with_capacity((us.len() - 1) * (vs.len() - 1));
        let mut rows = Vec::new();
        for a in 0..us.len() - 1 {
            // Bézier points in both directions, row by row.
            rows.clear();
            for i in 0..=p {
                line.clear();
                line.extend(in_u.iter().skip(a * (p + 1) + i).step_by(column));
                append_bezier_pieces(q, &self.knots[1], &line, &mut rows);
            }
            let row = (vs.len() - 1) * (q + 1);
            for b in 0..vs.len() - 1 {
                let mut points = Vec::with_capacity((p + 1) * (q + 1));
                rows.chunks_exact(row).for_each(|r| points.extend_from_slice(&r[b * (q + 1)..][..=q]));
                patches.push(BezierPatch {
                    degree: [p, q],
                    points,
                    domain: [[us[a], us[a + 1]], [vs[b], vs[b + 1]]],
                });
            }
        }
        patches
    }
}

impl BezierPatch {
    /// Homogeneous `[S, S_u, S_v]`, derivatives by the local parameters, not the surface's. These are in `[0, 1]²`; beyond it the
    /// polynomial goes on.
    pub fn local_jet(&self, local: Uv) -> [Homogeneous; 3] {
        as_wide_as_needed!(self.jet_of_width(local))
    }

    /// As [`BezierPatch::local_jet`], with room for `W` basis functions, which the degree, the patch's own, must stay below.
    #[inline(always)]
    fn jet_of_width<const W: usize>(&self, [p, q]: [usize; 2], local: Uv) -> [Homogeneous; 3] {
        let (bu, du) = bernstein_to_first::<W>(p, local.x);
        let (bv, dv) = bernstein_to_first::<W>(q, local.y);
        let mut sums = [Homogeneous::ZERO; 3];
        // Sums over v first: p + 1 rows of q + 1 terms, each used for the point and both derivatives.
        for i in 0..=p {
            let (mut row, mut row_v) = (Homogeneous::ZERO, Homogeneous::ZERO);
            for j in 0..=q {
                let c = self.points[i * (q + 1) + j];
                row += c * bv[j];
                row_v += c * dv[j];
            }
            sums[0] += row * bu[i];
            sums[1] += row * du[i];
            sums[2] += row_v * bu[i];
        }
        sums
    }

    /// Homogeneous point at local parameters in `[0, 1]²`: the first of [`BezierPatch::local_jet`], in a third of its time.
    pub fn homogeneous_point(&self, local: Uv) -> Homogeneous {
        as_wide_as_needed!(self.point_of_width(local))
    }

    /// As [`BezierPatch::homogeneous_point`], with room for `W` basis functions, which the degree, the patch's own, must stay below.
    #[inline(always)]
    fn point_of_width<const W: usize>(&self, [p, q]: [usize; 2], local: Uv) -> Homogeneous {
        let bu = bernstein::<W>(p, local.x);
        let bv = bernstein::<W>(q, local.y);
        let mut sum = Homogeneous::ZERO;
        for (row, &b) in self.points.chunks_exact(q + 1).zip(&bu[..=p]) {
            sum += row.iter().zip(&bv).fold(Homogeneous::ZERO, |s, (&c, &v)| s + c * v) * b;
        }
        sum
    }

    /// Homogeneous points at three local parameters of each direction, `[i][j]` at `(u[i], v[j])`; the same bits as
    /// [`BezierPatch::homogeneous_point`].
    pub fn homogeneous_lattice(&self, u: [f64; 3], v: [f64; 3]) -> [[Homogeneous; 3]; 3] {
        as_wide_as_needed!(self.lattice_of_width(u, v))
    }

    /// As [`BezierPatch::homogeneous_lattice`], with room for `W` basis functions, which the degree, the patch's own, must stay below.
    #[inline(always)]
    fn lattice_of_width<const W: usize>(
        &self,
        [p, q]: [usize; 2],
        u: [f64; 3],
        v: [f64; 3],
    ) -> [[Homogeneous; 3]; 3] {
        let (bu, bv) = (u.map(|x| bernstein::<W>(p, x)), v.map(|x| bernstein::<W>(q, x)));
        let mut sums = [[Homogeneous::ZERO; 3]; 3];
        for (i, row) in self.points.chunks_exact(q + 1).enumerate() {
            for b in 0..3 {
                let along = row.iter().zip(&bv[b]).fold(Homogeneous::ZERO, |s, (&c, &v)| s + c * v);
                for a in 0..3 {
                    sums[a][b] += along * bu[a][i];
                }
            }
        }
        sums
    }

    /// Position, first and second derivatives with respect to the surface's parameters, at local parameters in `[0, 1]²`.
    pub fn second_derivatives(&self, local: Uv) -> SecondDerivatives {
        as_wide_as_needed!(self.second_of_width(local))
    }

    /// As [`BezierPatch::second_derivatives`], with room for `W` basis functions, which the degree, the patch's own, must stay below.
    #[inline(always)]
    fn second_of_width<const W: usize>(&self, [p, q]: [usize; 2], local: Uv) -> SecondDerivatives {
        let (bu, bv) = (bernstein_to_second::<W>(p, local.x), bernstein_to_second::<W>(q, local.y));
        let mut sums = [Homogeneous::ZERO; 6];
        for (i, row) in self.points.chunks_exact(q + 1).enumerate() {
            let mut along = [Homogeneous::ZERO; 3];
            for (j, &c) in row.iter().enumerate() {
                for k in 0..3 {
                    along[k] += c * bv[k][j];
                }
            }
            for (sum, (a, b)) in sums.iter_mut().zip([(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]) {
                *sum += along[b] * bu[a][i];
            }
        }
        // Chain rule: derivatives by local parameters are those by the domain times its width.
        let [hu, hv] = self.domain.map(|[a, b]| 1.0 / (b - a));
        let scale = [1.0, hu, hv, hu * hu, hu * hv, hv * hv];
        SecondDerivatives::projected(std::array::from_fn(|k| sums[k] * scale[k]))
    }

    /// Parameters of the surface at local parameters in `[0, 1]²`.
    pub fn surface_uv(&self, local: Uv) -> Uv {
        let [[u0, u1], [v0, v1]] = self.domain;
        Uv::new(u0 + local.x * (u1 - u0), v0 + local.y * (v1 - v0))
    }

    /// A box that contains the patch: that of its control points.
    pub fn bounds(&self) -> Aabb {
        Aabb::from_points(self.points.iter().map(|p| p.project()))
    }

    /// Halves the patch in `direction` (0: u, 1: v) by de Casteljau; the lower half first.
    pub fn halves(&self, direction: usize) -> [Self; 2] {
        let q = self.degree[1];
        let n = self.degree[direction];
        let (mut low, mut high) = (self.clone(), self.clone());
        for line in 0..=self.degree[1 - direction] {
            let at = |k: usize| {
                if direction == 0 { k * (q + 1) + line } else { line * (q + 1) + k }
            };
            let mut w: Vec<Homogeneous> = (0..=n).map(|k| self.points[at(k)]).collect();
            for r in 0..=n {
                low.points[at(r)] = w[0];
                for k in 0..n - r {
                    w[k] = 0.5 * (w[k] + w[k + 1]);
                }
            }
            // w[k] now holds the right half's control points.
            for (k, &point) in w.iter().enumerate() {
                high.points[at(k)] = point;
            }
        }
        let [a, b] = self.domain[direction];
        let middle = 0.5 * (a + b);
        low.domain[direction] = [a, middle];
        high.domain[direction] = [middle, b];
        [low, high]
    }
}

/// Bernstein polynomials of degree `n < W` at `t`, 0 beyond the degree.
fn bernstein<const W: usize>(n: usize, t: f64) -> [f64; W] {
    let s = 1.0 - t;
    let mut b = [0.0; W];
    b[0] = 1.0;
    for k in 1..=n {
        let mut saved = 0.0;
        for x in &mut b[..k] {
            let value = *x;
            *x = saved + s * value;
            saved = t * value;
        }
        b[k] = saved;
    }
    b
}

/// Bernstein polynomials of degree `n < W` and their first two derivatives at `t`.
fn bernstein_to_second<const W: usize>(n: usize, t: f64) -> [[f64; W]; 3] {
    let (b, d) = bernstein_to_first::<W>(n, t);
    let mut dd = [0.0; W];
    if n > 1 {
        let c = bernstein::<W>(n - 2, t);
        let at = |i: usize, back: usize| if i >= back && i - back + 2 <= n { c[i - back] } else { 0.0 };
        // n(n − 1) times the second differences of the polynomials two degrees lower.
        for i in 0..=n {
            dd[i] = (n * (n - 1)) as f64 * (at(i, 2) - 2.0 * at(i, 1) + at(i, 0));
        }
    }
    [b, d, dd]
}

/// Bernstein polynomials of degree `n < W` and their derivatives at `t`.
fn bernstein_to_first<const W: usize>(n: usize, t: f64) -> ([f64; W], [f64; W]) {
    let mut d = [0.0; W];
    if n > 0 {
        // Derivatives from degree n − 1: n (B_{i−1} − B_i).
        let b = bernstein::<W>(n - 1, t);
        for i in 0..=n {
            let before = if i > 0 { b[i - 1] } else { 0.0 };
            let here = if i < n { b[i] } else { 0.0 };
            d[i] = n as f64 * (before - here);
        }
    }
    (bernstein::<W>(n, t), d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::sweep;
    use std::f64::consts::PI;

    #[test]
    fn patches_and_their_halves_agree_with_the_surface() {
        let s = sweep::torus(&Frame::IDENTITY, 5.0, 2.0, [0.0, 2.0 * PI], [0.0, 2.0 * PI]);
        let patches = s.bezier_patches();
        assert_eq!(patches.len(), 16);
        let local = Uv::new(0.3, 0.8);
        for patch in &patches {
            let d = s.derivatives(patch.surface_uv(local));
            let [a, au, _] = patch.local_jet(local);
            assert!((a.project() - d.point).length() < 1e-13);
            let du = (au.truncate() - a.project() * au.w) / a.w / (patch.domain[0][1] - patch.domain[0][0]);
            assert!((du - d.du).length() < 1e-12);
            let (own, all) = (patch.second_derivatives(local), s.second_derivatives(patch.surface_uv(local)));
            for (x, y) in
                [(own.du, all.du), (own.dv, all.dv), (own.duu, all.duu), (own.duv, all.duv), (own.dvv, all.dvv)]
            {
                assert!((x - y).length() < 1e-11, "{x} {y}");
            }
            for half in patch.halves(0).iter().chain(&patch.halves(1)) {
                let uv = half.surface_uv(local);
                assert!((half.local_jet(local)[0].project() - s.evaluate(uv)).length() < 1e-13);
            }
        }
    }
}

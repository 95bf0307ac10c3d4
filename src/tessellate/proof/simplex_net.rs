//! A piece of a Bézier patch over a triangle or a segment of its parameters, as a Bézier triangle or curve.
//!
//! De Casteljau's steps are taken with linear forms in place of numbers; each step raises the degree by one, so a
//! patch of degrees (p, q) gives total degree p + q. All steps are convex combinations when the triangle lies in the
//! patch, so weights stay positive and the control points hull the piece. On the way coefficients are those of plain
//! powers, multiplied by their multinomials, which spares each step a factor.
//! With AVX2 the same steps are compiled a second time, four numbers at once; no operation is fused or reordered, so the bits are
//! the same.
//! Source: T. D. DeRose, *Composing Bézier simplexes*, ACM TOG 7 (1988).

use crate::math::simd::{self, Instructions, Kernel};
use crate::math::{Homogeneous, Uv};
use crate::nurbs::BezierPatch;
use std::sync::OnceLock;

/// Buffers reused from piece to piece.
#[derive(Default)]
pub(in crate::tessellate) struct SimplexNets {
    /// Nets of one step and of the next, one after another.
    work: [Vec<Homogeneous>; 2],
    /// What the first direction leaves.
    columns: Vec<Homogeneous>,
    out: Vec<Homogeneous>,
    /// One over the multinomials of a degree, for segments or triangles.
    shares: Vec<f64>,
    /// Corners and degree that these belong to.
    shares_for: (usize, usize),
    /// Sums of two control points that were taken so far.
    pub(in crate::tessellate) steps: u64,
}

/// Degree up to which halves of rectangles have tables.
pub(in crate::tessellate) const MAX_HALVED: usize = 3;
static HALVES: [OnceLock<Half>; MAX_HALVED * MAX_HALVED] = [const { OnceLock::new() }; MAX_HALVED * MAX_HALVED];

/// How the net of a rectangle makes that of a half of it, for one pair of degrees: along the sides at the right angle.
struct Half {
    /// The first term of each coefficient, and the end.
    starts: Vec<usize>,
    /// Which control point, counted along both sides, times what.
    terms: Vec<([isize; 2], f64)>,
}

/// Which half of a rectangle a triangle with corners A, B, C and its right angle at B is.
#[derive(Clone, Copy)]
pub(in crate::tessellate) struct RightAngle {
    /// The parameter that changes from A to B.
    pub(in crate::tessellate) direction: usize,
    /// Whether A in that direction, and B in the other, lie at the rectangle's upper end.
    pub(in crate::tessellate) upper: [bool; 2],
}

/// Returns the index of the corner before the right angle of a triangle that is half of the rectangle around it, and which half; `None` for
/// any other.
pub(super) fn right_angle(at: &[Uv; 3]) -> Option<(usize, RightAngle)> {
    (0..3).find_map(|r| {
        let [a, b, c] = [0, 1, 2].map(|k| at[(k + r) % 3]);
        let d = if a.y == b.y && b.x == c.x {
            0
        } else if a.x == b.x && b.y == c.y {
            1
        } else {
            return None;
        };
        Some((r, RightAngle { direction: d, upper: [a[d] > b[d], b[1 - d] > c[1 - d]] }))
    })
}

/// Returns the number of coefficients of degree `d` over a simplex of 2 or 3 corners.
const fn size(corners: usize, d: usize) -> usize {
    if corners == 2 { d + 1 } else { (d + 1) * (d + 2) / 2 }
}

/// A piece of a patch whose net is wanted.
struct Expansion<'a, const N: usize> {
    nets: &'a mut SimplexNets,
    patch: &'a BezierPatch,
    corners: [Uv; N],
}

impl<const N: usize> Kernel for Expansion<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        self.nets.expand_plain(self.patch, self.corners);
    }
}

impl SimplexNets {
    /// Returns the control points of the patch over the simplex with 2 or 3 corners, given in local parameters: of degree p + q, row by row
    /// as in [`blend`]. Counts `steps`.
    pub(in crate::tessellate) fn expand<const N: usize>(
        &mut self,
        patch: &BezierPatch,
        corners: [Uv; N],
    ) -> &[Homogeneous] {
        let degree = patch.degree[0] + patch.degree[1];
        // Multinomials are the same for all pieces of a degree, and faces have few degrees.
        if self.shares_for != (N, degree) {
            self.shares_for = (N, degree);
            inverse_multinomials::<N>(degree, &mut self.shares);
        }
        self.steps += steps_of_expansion(N, patch.degree);
        simd::dispatch(Expansion { nets: self, patch, corners });
        &self.out
    }

    /// Returns the control points over half of the rectangle that `net`, of degrees 1 to [`MAX_HALVED`], stands for; positions relative to
    /// what its are. Of cells cut along a diagonal it takes a seventh of the time of [`Self::expand`]: each coefficient is a mean of few
    /// control points with fixed weights.
    pub(in crate::tessellate) fn half_of_rectangle(
        &mut self,
        net: &[Homogeneous],
        degree: [usize; 2],
        corner: RightAngle,
    ) -> &[Homogeneous] {
        let (d, e) = (corner.direction, 1 - corner.direction);
        let [p, q] = [degree[d], degree[e]];
        let half = HALVES[(p - 1) * MAX_HALVED + q - 1].get_or_init(|| Half::new([p, q]));
        let width = degree[1] as isize + 1;
        let mut step = if d == 0 { [width, 1] } else { [1, width] };
        let mut first = 0;
        for (step, (n, upper)) in step.iter_mut().zip([p, q].into_iter().zip(corner.upper)) {
            // Backwards from the other end: one table serves all four corners.
            if upper {
                first += n as isize * *step;
                *step = -*step;
            }
        }
        self.out.clear();
        self.out.extend(half.starts.windows(2).map(|w| {
            half.terms[w[0]..w[1]].iter().fold(Homogeneous::ZERO, |sum, &([i, j], share)| {
                sum + net[(first + i * step[0] + j * step[1]) as usize] * share
            })
        }));
        &self.out
    }

    /// Fills `out` with the control points over the simplex; `shares` must be those of its degree.
    #[inline(always)]
    fn expand_plain<const N: usize>(&mut self, patch: &BezierPatch, corners: [Uv; N]) {
        let [p, q] = patch.degree;
        let (mut u, mut v) = ([0.0; N], [0.0; N]);
        for c in 0..N {
            (u[c], v[c]) = (corners[c].x, corners[c].y);
        }
        let (one, all) = (size(N, p), size(N, p + q));
        let most = ((p + 1) * one).max((q + 1) * all);
        // Buffers only grow, so that no piece allocates once the largest has come.
        for work in &mut self.work {
            if work.len() < most {
                work.resize(most, Homogeneous::ZERO);
            }
        }
        self.columns.clear();
        // The blossom in u alone, column by column: each becomes a net over the corners.
        for j in 0..=q {
            for i in 0..=p {
                self.work[0][i * one] = patch.points[i * (q + 1) + j];
            }
            let last = de_casteljau::<N>(&mut self.work, p, 0, u, one);
            self.columns.extend_from_slice(&self.work[last][..one]);
        }
        // Then in v, on top of it: the columns are the coefficients of a polynomial in v, and the degrees add up.
        for (column, to) in self.columns.chunks_exact(one).zip(self.work[0].chunks_exact_mut(all)) {
            to[..one].copy_from_slice(column);
        }
        let last = de_casteljau::<N>(&mut self.work, q, p, v, all);
        self.out.clear();
        // Back from plain powers to Bernstein coefficients.
        self.out.extend(self.work[last][..all].iter().zip(&self.shares).map(|(&c, &s)| c * s));
    }
}

/// Sums that an expansion over a simplex takes, a little fewer than there are: its cost grows with the fourth power of the degree.
fn steps_of_expansion(corners: usize, [p, q]: [usize; 2]) -> u64 {
    let first: usize = (0..p).map(|d| (p - d) * size(corners, d)).sum();
    let second: usize = (0..q).map(|d| (q - d) * size(corners, p + d)).sum();
    ((q + 1) * first + second) as u64
}

/// Takes all de Casteljau steps of one direction over `steps + 1` nets of a degree, which stand `stride` apart in `work[0]`: the two
/// buffers take turns. Returns the index of the one that begins with the resulting net, of degree `degree + steps`; both are overwritten.
#[inline(always)]
fn de_casteljau<const N: usize>(
    work: &mut [Vec<Homogeneous>; 2],
    steps: usize,
    degree: usize,
    at: [f64; N],
    stride: usize,
) -> usize {
    let [first, second] = work;
    let (mut from, mut to) = (first.as_mut_slice(), second.as_mut_slice());
    for step in 0..steps {
        let d = degree + step;
        let (before, after) = (size(N, d), size(N, d + 1));
        for i in 0..steps - step {
            let (a, b) = (&from[i * stride..][..before], &from[(i + 1) * stride..][..before]);
            blend::<N>(a, b, d, at, &mut to[i * stride..][..after]);
        }
        std::mem::swap(&mut from, &mut to);
    }
    steps % 2
}

/// Writes `(1 − ℓ)·a + ℓ·b` to `out`, for the linear form ℓ with values `at` at the corners; degree `d` becomes `d + 1`.
///
/// The coefficient with exponents (i, j, k) stands at `(j + k)(j + k + 1)/2 + k`, whatever i is.
#[inline(always)]
fn blend<const N: usize>(a: &[Homogeneous], b: &[Homogeneous], d: usize, at: [f64; N], out: &mut [Homogeneous]) {
    let mut carry = Homogeneous::ZERO;
    if N == 2 {
        for ((&a, &b), out) in a.iter().zip(b).zip(out.iter_mut()) {
            let e = b - a;
            *out = carry + (a + e * at[0]);
            carry = a + e * at[1];
        }
        out[d + 1] = carry;
        return;
    }
    // Row m gets terms of row m and of row m − 1 of the degree before: they are added up as they come.
    out[0] = Homogeneous::ZERO;
    let mut row = 0;
    for m in 0..=d {
        let (here, below) = out[row..].split_at_mut(m + 1);
        carry = Homogeneous::ZERO;
        let lines = a[row..][..m + 1].iter().zip(&b[row..][..m + 1]);
        for ((&a, &b), (here, below)) in lines.zip(here.iter_mut().zip(below.iter_mut())) {
            let e = b - a;
            *here += a + e * at[0];
            *below = carry + (a + e * at[1]);
            carry = a + e * at[2];
        }
        below[m + 1] = carry;
        row += m + 1;
    }
}

impl Half {
    /// Makes the table that turns the net of a rectangle of degrees p and q into the net of the Bézier triangle over its half: each
    /// coefficient as a sum of control points with weights, which hold binomials and multinomials already. With s = λ_B + λ_C along the
    /// first side and t = λ_C along the second, (λ_B + λ_C)^i λ_A^(p−i) λ_C^j (λ_A + λ_B)^(q−j) is multiplied out.
    fn new([p, q]: [usize; 2]) -> Self {
        // Divided by the multinomials here once, and not for each net.
        let mut shares = Vec::new();
        inverse_multinomials::<3>(p + q, &mut shares);
        let mut of: Vec<Vec<([isize; 2], f64)>> = vec![Vec::new(); shares.len()];
        for i in 0..=p {
            for j in 0..=q {
                for a in 0..=i {
                    for c in 0..=q - j {
                        let (m, k) = (q + i - c, a + j);
                        let at = m * (m + 1) / 2 + k;
                        let times = binomial(p, i) * binomial(q, j) * binomial(i, a) * binomial(q - j, c);
                        of[at].push(([i as isize, j as isize], times * shares[at]));
                    }
                }
            }
        }
        let mut starts = vec![0];
        starts.extend(of.iter().scan(0, |sum, terms| {
            *sum += terms.len();
            Some(*sum)
        }));
        Self { starts, terms: of.into_iter().flatten().collect() }
    }
}

/// Returns the binomial coefficient of `n` over `k`, rounded where it is large.
fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64)
}

/// Fills `out` with one over each multinomial of a degree, in the order of the coefficients over `N` corners.
fn inverse_multinomials<const N: usize>(degree: usize, out: &mut Vec<f64>) {
    out.clear();
    for m in 0..=degree {
        if N == 2 {
            out.push(1.0 / binomial(degree, m));
        } else {
            out.extend((0..=m).map(|k| 1.0 / (binomial(degree, m) * binomial(m, k))));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::sweep;

    #[test]
    fn the_nets_evaluate_to_the_patch() {
        let s = sweep::torus(&Frame::IDENTITY, 5.0, 2.0, [0.0, 1.2], [0.3, 1.5]);
        let patch = &s.bezier_patches()[0];
        let corners = [Uv::new(0.1, 0.2), Uv::new(0.9, 0.35), Uv::new(0.4, 1.0)];
        let mut nets = SimplexNets::default();
        let net = nets.expand(patch, corners).to_vec();
        let n = patch.degree[0] + patch.degree[1];
        let b = [0.2, 0.5, 0.3f64];
        let factorial = |k: usize| (1..=k).map(|x| x as f64).product::<f64>();
        let mut sum = Homogeneous::ZERO;
        for m in 0..=n {
            for k in 0..=m {
                let (i, j) = (n - m, m - k);
                let c = factorial(n) / factorial(i) / factorial(j) / factorial(k);
                sum +=
                    net[m * (m + 1) / 2 + k] * c * b[0].powi(i as i32) * b[1].powi(j as i32) * b[2].powi(k as i32);
            }
        }
        let at = corners[0] * b[0] + corners[1] * b[1] + corners[2] * b[2];
        assert!((sum.project() - patch.local_jet(at)[0].project()).length() < 1e-13);
        let mut plain = SimplexNets::default();
        inverse_multinomials::<3>(n, &mut plain.shares);
        plain.expand_plain(patch, corners);
        assert_eq!(plain.out, net);
        let segment = nets.expand(patch, [corners[0], corners[1]]).to_vec();
        let middle = (0..=n).fold(Homogeneous::ZERO, |s, j| {
            s + segment[j] * (factorial(n) / factorial(j) / factorial(n - j) * 0.5f64.powi(n as i32))
        });
        let at = 0.5 * (corners[0] + corners[1]);
        assert!((middle.project() - patch.local_jet(at)[0].project()).length() < 1e-13);
    }

    #[test]
    fn halves_are_what_the_steps_give() {
        let points = |[p, q]: [usize; 2]| -> Vec<Homogeneous> {
            let all = (0..(p + 1) * (q + 1)).map(|k| k as f64);
            all.map(|k| Homogeneous::new(k.sin(), (1.7 * k).cos(), 0.1 * k, 1.0 + 0.3 * k.cos())).collect()
        };
        let rectangle = [Uv::new(0.0, 0.0), Uv::new(1.0, 0.0), Uv::new(1.0, 1.0), Uv::new(0.0, 1.0)];
        let mut nets = SimplexNets::default();
        for degree in [[2, 2], [3, 1], [2, 3]] {
            let patch = BezierPatch { degree, points: points(degree), domain: [[0.0, 1.0]; 2] };
            for k in 0..4 {
                for turned in [false, true] {
                    let step = if turned { 3 } else { 1 };
                    let [a, b, c] = [k, k + step, k + 2 * step].map(|i| rectangle[i % 4]);
                    let direction = if a.x != b.x { 0 } else { 1 };
                    let upper = [a[direction] == 1.0, b[1 - direction] == 1.0];
                    let want = nets.expand(&patch, [a, b, c]).to_vec();
                    let found = nets.half_of_rectangle(&patch.points, degree, RightAngle { direction, upper });
                    assert!(want.iter().zip(found).all(|(x, y)| (*x - *y).length() < 1e-13), "{degree:?} {k}");
                }
            }
        }
    }
}

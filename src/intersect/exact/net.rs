//! Bernstein control nets of homogeneous points: evaluation, subdivision, hulls.
//!
//! A net of degrees `[p, q]` is a slice of `(p + 1)(q + 1)` four-vectors, `net[i * (q + 1) + j]`, over `[0, 1]²`. The degrees that
//! real files use most have kernels of fixed size; all others run through loops.

use crate::math::simd::{self, Instructions, Kernel};
use crate::nurbs::MAX_DEGREE;
use smallvec::SmallVec;

/// Four numbers that are combined alike: `(w·x, w·y, w·z, w)`, or its image in a ray's frame.
pub(super) type V4 = [f64; 4];
/// A net that lives on the stack up to bicubic.
pub(super) type Net = SmallVec<[V4; 16]>;

/// Number of control points of a net of these degrees.
#[inline(always)]
pub(super) fn len([p, q]: [u8; 2]) -> usize {
    (usize::from(p) + 1) * (usize::from(q) + 1)
}

/// Value and first derivatives with respect to the local parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jet {
    /// Homogeneous, as its derivatives are.
    pub(super) s: V4,
    pub(super) su: V4,
    pub(super) sv: V4,
}

/// `a += k x`, each rounded once: the same bits with and without an instruction for it. Where there is none this is slow, so
/// hot loops reach it through [`crate::math::simd`].
#[inline(always)]
pub(super) fn axpy(a: &mut V4, k: f64, x: &V4) {
    for c in 0..4 {
        a[c] = k.mul_add(x[c], a[c]);
    }
}

/// Runs `$body(args…, p, q)`, compiled for the most frequent degrees with `p` and `q` known.
macro_rules! by_degree {
    ($degree:expr, $body:ident($($arg:expr),*)) => {
        match $degree {
            [1, 1] => $body($($arg,)* 1, 1),
            [2, 2] => $body($($arg,)* 2, 2),
            [3, 3] => $body($($arg,)* 3, 3),
            [2, 1] => $body($($arg,)* 2, 1),
            [1, 2] => $body($($arg,)* 1, 2),
            [p, q] => $body($($arg,)* p as usize, q as usize),
        }
    };
}
pub(super) use by_degree;

/// A net to be evaluated at `(u, v)`.
struct Evaluation<'a> {
    net: &'a [V4],
    degree: [u8; 2],
    u: f64,
    v: f64,
}

impl Kernel for Evaluation<'_> {
    type Output = Jet;

    #[inline(always)]
    fn run<I: Instructions>(self) -> Jet {
        evaluate_inlined(self.net, self.degree, self.u, self.v)
    }
}

/// Homogeneous value and first derivatives of a net at `(u, v)`, which may lie outside `[0, 1]²`.
#[inline]
pub(super) fn evaluate(net: &[V4], degree: [u8; 2], u: f64, v: f64) -> Jet {
    simd::dispatch(Evaluation { net, degree, u, v })
}

/// As [`evaluate`], for the one hot loop that is dispatched as a whole: each further copy, of all degrees, pushes others out of the
/// processor's cache of instructions.
#[inline(always)]
pub(super) fn evaluate_inlined(net: &[V4], degree: [u8; 2], u: f64, v: f64) -> Jet {
    match degree {
        [1, 1] => fixed::<2, 2>(net, u, v),
        [2, 2] => fixed::<3, 3>(net, u, v),
        [3, 3] => fixed::<4, 4>(net, u, v),
        [2, 1] => fixed::<3, 2>(net, u, v),
        [1, 2] => fixed::<2, 3>(net, u, v),
        [3, 1] => fixed::<4, 2>(net, u, v),
        [1, 3] => fixed::<2, 4>(net, u, v),
        [2, 3] => fixed::<3, 4>(net, u, v),
        [3, 2] => fixed::<4, 3>(net, u, v),
        _ => any_degree(net, degree, u, v),
    }
}

/// Bernstein values and derivatives at `t` of degree `N - 1`, one to three.
#[inline(always)]
fn bernstein_fixed<const N: usize>(t: f64) -> ([f64; N], [f64; N]) {
    let s = 1.0 - t;
    let (mut b, mut d) = ([0.0; N], [0.0; N]);
    // Written out for the degrees of nearly all surfaces: the recurrence would wait for itself.
    match N {
        2 => {
            (b[0], b[1]) = (s, t);
            (d[0], d[1]) = (-1.0, 1.0);
        }
        3 => {
            (b[0], b[1], b[2]) = (s * s, 2.0 * s * t, t * t);
            (d[0], d[1], d[2]) = (-2.0 * s, 2.0 * (s - t), 2.0 * t);
        }
        _ => {
            let (t2, s2, st) = (t * t, s * s, s * t);
            (b[0], b[1], b[2], b[3]) = (s2 * s, 3.0 * s2 * t, 3.0 * s * t2, t2 * t);
            (d[0], d[1], d[2], d[3]) = (-3.0 * s2, 3.0 * s2 - 6.0 * st, 6.0 * st - 3.0 * t2, 3.0 * t2);
        }
    }
    (b, d)
}

/// Evaluates a net of degrees `N − 1` and `M − 1`, one to three.
#[inline(always)]
fn fixed<const N: usize, const M: usize>(net: &[V4], u: f64, v: f64) -> Jet {
    tensor_product(&net[..N * M], bernstein_fixed::<N>(u), bernstein_fixed::<M>(v), [N, M])
}

/// As [`fixed`] for degrees up to [`MAX_DEGREE`].
#[inline(always)]
fn any_degree(net: &[V4], [p, q]: [u8; 2], u: f64, v: f64) -> Jet {
    let [p, q] = [p, q].map(usize::from);
    tensor_product(net, bernstein(p, u), bernstein(q, v), [p + 1, q + 1])
}

/// Homogeneous value and first derivatives of a net of `counts` control points, row after row, from the Bernstein values and derivatives in
/// u and in v; entries of these beyond `counts` are not read.
#[inline(always)]
fn tensor_product<const N: usize, const M: usize>(
    net: &[V4],
    (bu, du): ([f64; N], [f64; N]),
    (bv, dv): ([f64; M], [f64; M]),
    counts: [usize; 2],
) -> Jet {
    let mut jet = Jet { s: [0.0; 4], su: [0.0; 4], sv: [0.0; 4] };
    for i in 0..counts[0] {
        let (mut row, mut row_v) = ([0.0; 4], [0.0; 4]);
        for j in 0..counts[1] {
            let point = &net[i * counts[1] + j];
            axpy(&mut row, bv[j], point);
            axpy(&mut row_v, dv[j], point);
        }
        axpy(&mut jet.s, bu[i], &row);
        axpy(&mut jet.su, du[i], &row);
        axpy(&mut jet.sv, bu[i], &row_v);
    }
    jet
}

/// Bernstein values and derivatives of degree `n` at `t`, up to [`MAX_DEGREE`]; 0 beyond the degree.
fn bernstein(n: usize, t: f64) -> ([f64; MAX_DEGREE + 1], [f64; MAX_DEGREE + 1]) {
    let s = 1.0 - t;
    let (mut b, mut d) = ([0.0; MAX_DEGREE + 1], [0.0; MAX_DEGREE + 1]);
    b[0] = 1.0;
    for k in 1..=n {
        // Derivatives are n times the differences of the values one degree lower, which stand in `b` just now.
        if k == n {
            for i in 0..=n {
                let before = if i > 0 { b[i - 1] } else { 0.0 };
                d[i] = n as f64 * (before - if i < n { b[i] } else { 0.0 });
            }
        }
        let mut saved = 0.0;
        for x in &mut b[..k] {
            let value = *x;
            *x = saved + s * value;
            saved = t * value;
        }
        b[k] = saved;
    }
    (b, d)
}

/// Index of control point `k` of the line `line` that runs in `direction`.
#[inline(always)]
fn point_index(direction: usize, q: usize, k: usize, line: usize) -> usize {
    if direction == 0 { k * (q + 1) + line } else { line * (q + 1) + k }
}

/// Halves a net in `direction`, 0 for u and 1 for v, by de Casteljau; the lower half first.
#[inline]
pub(super) fn halves(net: &[V4], degree: [u8; 2], direction: usize) -> [Net; 2] {
    let (mut low, mut high) = (Net::from_slice(net), Net::from_slice(net));
    if direction == 0 {
        by_degree!(degree, halve_u(&mut low, &mut high));
    } else {
        by_degree!(degree, halve_v(&mut low, &mut high));
    }
    [low, high]
}

/// As [`halve`] in u of a net of degrees `p` and `q`.
#[inline(always)]
fn halve_u(low: &mut [V4], high: &mut [V4], p: usize, q: usize) {
    halve(low, high, [p, q, 0]);
}

/// As [`halve`] in v of a net of degrees `p` and `q`.
#[inline(always)]
fn halve_v(low: &mut [V4], high: &mut [V4], p: usize, q: usize) {
    halve(low, high, [q, p, 1]);
}

/// Halves the `lines + 1` lines of degree `n` that run in `direction`; both nets hold the whole on entry, and their half afterwards.
#[inline(always)]
fn halve(low: &mut [V4], high: &mut [V4], [n, lines, direction]: [usize; 3]) {
    let q = if direction == 0 { lines } else { n };
    for line in 0..=lines {
        // The high net is halved in place: after round r its first n − r points have moved.
        for r in 0..=n {
            low[point_index(direction, q, r, line)] = high[point_index(direction, q, 0, line)];
            for k in 0..n - r {
                let (i, j) = (point_index(direction, q, k, line), point_index(direction, q, k + 1, line));
                for c in 0..4 {
                    high[i][c] = 0.5 * (high[i][c] + high[j][c]);
                }
            }
        }
    }
}

/// Replaces a net by its part over the range `[a, b]` of `direction`, which may reach outside `[0, 1]`; `b` must not be 0.
#[inline]
pub(super) fn restrict(net: &mut [V4], degree: [u8; 2], direction: usize, range: [f64; 2]) {
    if direction == 0 {
        by_degree!(degree, restrict_u(net, range));
    } else {
        by_degree!(degree, restrict_v(net, range));
    }
}

/// As [`restrict`] in u of a net of degrees `p` and `q`.
#[inline(always)]
fn restrict_u(net: &mut [V4], range: [f64; 2], p: usize, q: usize) {
    restrict_lines(net, [p, q, 0], range);
}

/// As [`restrict`] in v of a net of degrees `p` and `q`.
#[inline(always)]
fn restrict_v(net: &mut [V4], range: [f64; 2], p: usize, q: usize) {
    restrict_lines(net, [q, p, 1], range);
}

/// Restricts the `lines + 1` lines of degree `n` that run in `direction` to the part from `a` to `b` of `[0, 1]`, which may reach beyond
/// it; `b` must not be 0.
#[inline(always)]
fn restrict_lines(net: &mut [V4], [n, lines, direction]: [usize; 3], [a, b]: [f64; 2]) {
    let q = if direction == 0 { lines } else { n };
    let lerp = |x: V4, y: V4, t: f64| -> V4 { std::array::from_fn(|c| x[c] + (y[c] - x[c]) * t) };
    for line in 0..=lines {
        if b != 1.0 {
            for r in 1..=n {
                for k in (r..=n).rev() {
                    let i = point_index(direction, q, k, line);
                    // De Casteljau at b keeps the lower part in place…
                    net[i] = lerp(net[point_index(direction, q, k - 1, line)], net[i], b);
                }
            }
        }
        if a != 0.0 {
            for r in 1..=n {
                for k in 0..=n - r {
                    let i = point_index(direction, q, k, line);
                    // …and at a/b, which is a within what is left, the upper one.
                    net[i] = lerp(net[i], net[point_index(direction, q, k + 1, line)], a / b);
                }
            }
        }
    }
}

/// Middles and radii of boxes around the two first derivatives over `[0, 1]²`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Slopes {
    /// Middle of the box around ∂/∂u.
    pub(super) u: V4,
    /// Middle of the box around ∂/∂v.
    pub(super) v: V4,
    /// Radius of the box around ∂/∂u.
    pub(super) ru: V4,
    /// Radius of the box around ∂/∂v.
    pub(super) rv: V4,
}

/// Bounds the homogeneous derivatives over `[0, 1]²` by boxes, from the hulls of the difference nets.
#[inline]
pub(super) fn slopes(net: &[V4], degree: [u8; 2]) -> Slopes {
    by_degree!(degree, slopes_in(net))
}

/// As [`slopes`] of a net of degrees `p` and `q`.
#[inline(always)]
fn slopes_in(net: &[V4], p: usize, q: usize) -> Slopes {
    let m = q + 1;
    let net = &net[..(p + 1) * m];
    let (mut lo, mut hi) = ([[f64::INFINITY; 4]; 2], [[f64::NEG_INFINITY; 4]; 2]);
    // By comparison: one instruction each, where `f64::min` has to mind NaN.
    let mut grow = |d: usize, a: &V4, b: &V4| {
        for c in 0..4 {
            let x = b[c] - a[c];
            lo[d][c] = if x < lo[d][c] { x } else { lo[d][c] };
            hi[d][c] = if x > hi[d][c] { x } else { hi[d][c] };
        }
    };
    for i in 0..=p {
        for j in 0..=q {
            let here = &net[i * m + j];
            if i < p {
                grow(0, here, &net[(i + 1) * m + j]);
            }
            if j < q {
                grow(1, here, &net[i * m + j + 1]);
            }
        }
    }
    // The derivative's control points are `p` times the differences of the net's; here as the middle and the radius of their box.
    let half = [0.5 * p as f64, 0.5 * q as f64];
    let middle = |d: usize| -> V4 { std::array::from_fn(|c| half[d] * (lo[d][c] + hi[d][c])) };
    let radius = |d: usize| -> V4 { std::array::from_fn(|c| half[d] * (hi[d][c] - lo[d][c])) };
    Slopes { u: middle(0), v: middle(1), ru: radius(0), rv: radius(1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(p: usize, q: usize) -> Net {
        (0..(p + 1) * (q + 1))
            .map(|k| {
                let x = k as f64;
                [(x * 1.3).sin(), (x * 0.7).cos(), (x * 2.1).sin() * 0.5, 1.0 + 0.3 * (x * 0.9).sin()]
            })
            .collect()
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        for (p, q) in [(1, 1), (2, 2), (3, 3), (2, 3), (5, 4), (13, 6)] {
            let control = sample(p, q);
            for k in 0..50 {
                let (u, v) = (k as f64 / 49.0, (k * 17 % 50) as f64 / 49.0);
                let degree = [p as u8, q as u8];
                let a = evaluate(&control, degree, u, v);
                let b = evaluate_inlined(&control, degree, u, v);
                assert_eq!((a.s, a.su, a.sv), (b.s, b.su, b.sv), "degree {p} {q}");
            }
        }
    }

    #[test]
    fn fixed_kernels_halves_and_restrictions_agree_with_loops() {
        for (p, q) in [(1, 1), (2, 1), (3, 1), (1, 2), (1, 3), (2, 2), (2, 3), (3, 2), (3, 3), (5, 7), (13, 2)] {
            let (net, degree) = (sample(p, q), [p as u8, q as u8]);
            let close = |a: V4, b: V4| (0..4).all(|c| (a[c] - b[c]).abs() < 1e-11);
            let (u, v) = (0.37, 0.81);
            let f = evaluate(&net, degree, u, v);
            let g = any_degree(&net, degree, u, v);
            assert!(close(f.s, g.s) && close(f.su, g.su) && close(f.sv, g.sv), "{p} {q}");
            for direction in 0..2 {
                let [low, high] = halves(&net, degree, direction);
                let (x, half) = if direction == 0 { (u, [2.0 * u, v]) } else { (v, [u, 2.0 * v - 1.0]) };
                let piece = if x < 0.5 { &low } else { &high };
                assert!(close(evaluate(piece, degree, half[0], half[1]).s, f.s));
                let mut cut = net.clone();
                restrict(&mut cut, degree, direction, [-0.1, 1.1]);
                let back = (x + 0.1) / 1.2;
                let (a, b) = if direction == 0 { (back, v) } else { (u, back) };
                assert!(close(evaluate(&cut, degree, a, b).s, f.s));
            }
            let boxes = slopes(&net, degree);
            for c in 0..4 {
                assert!((f.su[c] - boxes.u[c]).abs() <= boxes.ru[c] + 1e-12);
                assert!((f.sv[c] - boxes.v[c]).abs() <= boxes.rv[c] + 1e-12);
            }
        }
    }
}

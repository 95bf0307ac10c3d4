//! B-spline basis functions and their derivatives: *The NURBS Book*, A2.1 to A2.3.

/// Highest polynomial degree the program handles; real files go to 13.
pub const MAX_DEGREE: usize = 25;

/// Widths of tables that callers choose among: degrees below 4, below 8, below 14, all. Tables of the full width would have to be cleared
/// for every evaluation, which took a quarter of the time of meshing.
pub(super) const NARROW: usize = 4;
/// See [`NARROW`].
pub(super) const MIDDLE: usize = 8;
/// See [`NARROW`].
pub(super) const BROAD: usize = 14;
/// See [`NARROW`].
pub(super) const WIDE: usize = MAX_DEGREE + 1;

/// Spans among which the right one is found by counting.
const FEW_SPANS: usize = 16;

/// Finds the index `k` of the knot span `[knots[k], knots[k + 1])` that holds `t`, never an empty one. Knots must not decrease, and leave
/// a domain.
///
/// `t` outside the domain gives the first or last span; the end of the domain belongs to the last span.
pub fn find_span(knots: &[f64], degree: usize, t: f64) -> usize {
    let last = knots.len() - degree - 2;
    if last == degree {
        return degree;
    }
    let inner = &knots[degree..=last];
    // A few are counted without a branch, of which a search among them would guess every other one wrong.
    let before = if inner.len() <= FEW_SPANS {
        inner.iter().map(|&x| usize::from(x <= t)).sum()
    } else {
        inner.partition_point(|&x| x <= t)
    };
    let mut k = before + degree;
    k = k.saturating_sub(1).clamp(degree, last);
    // A span without length holds no parameter: back to the last one that has, or on to the first.
    while k > degree && knots[k] == knots[k + 1] {
        k -= 1;
    }
    while k < last && knots[k] == knots[k + 1] {
        k += 1;
    }
    k
}

/// Values at `t` of the `degree + 1 ≤ W` basis functions that are not zero in a span, and their derivatives up to `ORDER` (at most 2), 0
/// beyond: the k-th derivative of the i-th of them is `[k][i]`. *The NURBS Book*, A2.3, with its rows of coefficients written out.
///
/// Inlined, so that callers who know the degree have no loops.
#[inline(always)]
pub(super) fn basis<const ORDER: usize, const W: usize>(
    knots: &[f64],
    degree: usize,
    span: usize,
    t: f64,
) -> [[f64; W]; 3] {
    let p = degree;
    let LowerDegrees { functions: [own, lower, lowest], widths: [widths, lower_widths] } =
        lower_degrees::<W>(knots, p, span, t);
    let mut value = [own, [0.0; W], [0.0; W]];
    // Derivatives beyond the degree vanish.
    if ORDER == 0 || p == 0 {
        return value;
    }
    let mut inverse = [0.0; W];
    for r in 0..p {
        inverse[r] = 1.0 / widths[r];
    }
    // At the ends fewer functions of lower degree overlap: a function's neighbour there is none.
    for r in 0..=p {
        let mut sum = if r > 0 { inverse[r - 1] * lower[r - 1] } else { 0.0 };
        if r < p {
            sum -= inverse[r] * lower[r];
        }
        value[1][r] = p as f64 * sum;
    }
    if ORDER == 1 || p == 1 {
        return value;
    }
    for r in 0..=p {
        // The coefficients of the two functions of the degree below, of which this one is the difference.
        let before = if r > 0 { inverse[r - 1] } else { 0.0 };
        let behind = if r < p { -inverse[r] } else { 0.0 };
        let mut sum = if r > 1 { before / lower_widths[r - 2] * lowest[r - 2] } else { 0.0 };
        if r > 0 && r < p {
            sum += (behind - before) / lower_widths[r - 1] * lowest[r - 1];
        }
        if r + 2 <= p {
            sum -= behind / lower_widths[r] * lowest[r];
        }
        value[2][r] = (p * (p - 1)) as f64 * sum;
    }
    value
}

/// The basis functions of a span and of the two degrees below.
struct LowerDegrees<const W: usize> {
    /// Values of the functions of the degree, of one less and of two less; 0 beyond the last.
    functions: [[f64; W]; 3],
    /// Lengths of the supports of the functions of one degree less, and of two less, over which they are divided.
    widths: [[f64; W]; 2],
}

/// Evaluates at `t` the functions of a span and of the two degrees below by Cox–de Boor (*The NURBS Book*, A2.2): all terms are positive
/// inside the span, so that nothing cancels.
#[inline(always)]
fn lower_degrees<const W: usize>(knots: &[f64], degree: usize, span: usize, t: f64) -> LowerDegrees<W> {
    assert!(degree < W && span >= degree && span + degree < knots.len());
    let (mut own, mut lower, mut lowest) = ([0.0; W], [0.0; W], [0.0; W]);
    let (mut widths, mut lower_widths) = ([0.0; W], [0.0; W]);
    let (mut left, mut right) = ([0.0; W], [0.0; W]);
    own[0] = 1.0;
    for j in 1..=degree {
        left[j] = t - knots[span + 1 - j];
        right[j] = knots[span + j] - t;
        (lowest, lower, lower_widths) = (lower, own, widths);
        let mut saved = 0.0;
        for r in 0..j {
            // Never zero: between the two knots lies the span, which is not empty.
            let width = right[r + 1] + left[j - r];
            let term = own[r] / width;
            widths[r] = width;
            own[r] = saved + right[r + 1] * term;
            saved = left[j - r] * term;
        }
        own[j] = saved;
    }
    LowerDegrees { functions: [own, lower, lowest], widths: [widths, lower_widths] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_never_empty() {
        let knots = [0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0];
        for (t, k) in [(-1.0, 2), (0.0, 2), (0.5, 2), (1.0, 4), (1.5, 4), (2.0, 4), (3.0, 4)] {
            assert_eq!(find_span(&knots, 2, t), k, "t = {t}");
        }
    }

    /// On one span they are Bernstein's polynomials, whose derivatives are known.
    #[test]
    fn on_one_span_they_are_bernstein_polynomials() {
        let knots = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
        for i in 0..=20 {
            let t = i as f64 / 20.0;
            let s = 1.0 - t;
            let values = [s * s * s, 3.0 * t * s * s, 3.0 * t * t * s, t * t * t];
            let first = [-3.0 * s * s, 3.0 * s * s - 6.0 * s * t, 6.0 * s * t - 3.0 * t * t, 3.0 * t * t];
            let second = [6.0 * s, 6.0 * t - 12.0 * s, 6.0 * s - 12.0 * t, 6.0 * t];
            for (got, wanted) in basis::<2, NARROW>(&knots, 3, 3, t).iter().zip([values, first, second]) {
                assert!(got.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-14), "{t}: {got:?} {wanted:?}");
            }
        }
    }

    #[test]
    fn basis_sums_to_one_and_its_derivatives_to_zero() {
        let knots = [0.0, 0.0, 0.0, 0.0, 0.3, 0.7, 0.7, 1.0, 1.0, 1.0, 1.0];
        for i in 0..=20 {
            let t = i as f64 / 20.0;
            let b = basis::<2, NARROW>(&knots, 3, find_span(&knots, 3, t), t);
            let sum = |k: usize| b[k].iter().sum::<f64>();
            assert!((sum(0) - 1.0).abs() < 1e-14 && sum(1).abs() < 1e-12 && sum(2).abs() < 1e-11);
        }
    }
}

//! B-spline basis functions and their derivatives: *The NURBS Book*, A2.1 to A2.3.

/// Highest polynomial degree the program handles; real files go to 13.
pub const MAX_DEGREE: usize = 25;

/// Values of the `degree + 1 ≤ W` non-zero basis functions and of their first two derivatives.
///
/// Tables of the full width would have to be cleared for every evaluation, which took a quarter of the time of meshing.
pub(super) struct Basis<const W: usize> {
    /// `value[k][i]`: k-th derivative of the i-th non-zero basis function.
    pub(super) value: [[f64; W]; 3],
}

/// Widths of tables that callers choose among: degrees below 4, below 8, below 14, all.
pub(super) const NARROW: usize = 4;
/// See [`NARROW`].
pub(super) const MIDDLE: usize = 8;
/// See [`NARROW`].
pub(super) const BROAD: usize = 14;
/// See [`NARROW`].
pub(super) const WIDE: usize = MAX_DEGREE + 1;

/// Finds the index `k` of the knot span `[knots[k], knots[k + 1])` that holds `t`, never an empty one. Knots must not decrease, and leave
/// a domain.
///
/// `t` outside the domain gives the first or last span; the end of the domain belongs to the last span.
pub fn find_span(knots: &[f64], degree: usize, t: f64) -> usize {
    let last = knots.len() - degree - 2;
    let mut k = knots[degree..=last].partition_point(|&x| x <= t) + degree;
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

/// Values at `t` of the `degree + 1` basis functions that are not zero in a span, 0 beyond: the same bits as [`basis`] gives for them.
/// Meshing asks for little else.
#[inline]
pub(super) fn basis_functions<const W: usize>(knots: &[f64], degree: usize, span: usize, t: f64) -> [f64; W] {
    assert!(degree < W && span >= degree && span + degree < knots.len());
    let mut value = [0.0; W];
    let (mut left, mut right) = ([0.0; W], [0.0; W]);
    value[0] = 1.0;
    // Cox–de Boor (*The NURBS Book*, A2.2): all terms are positive inside the span, so that nothing cancels.
    for j in 1..=degree {
        left[j] = t - knots[span + 1 - j];
        right[j] = knots[span + j] - t;
        let mut saved = 0.0;
        for r in 0..j {
            // Never zero: between the two knots lies the span, which is not empty.
            let term = value[r] / (right[r + 1] + left[j - r]);
            value[r] = saved + right[r + 1] * term;
            saved = left[j - r] * term;
        }
        value[j] = saved;
    }
    value
}

/// Values at `t` of the basis functions that are not zero in a span, and derivatives up to `order` (at most 2), 0 beyond: *The NURBS
/// Book*, A2.3.
#[inline]
pub(super) fn basis<const W: usize>(knots: &[f64], degree: usize, span: usize, t: f64, order: usize) -> Basis<W> {
    let p = degree;
    assert!(p < W);
    let mut table = [[0.0; W]; W];
    let (mut left, mut right) = ([0.0; W], [0.0; W]);
    table[0][0] = 1.0;
    for j in 1..=p {
        left[j] = t - knots[span + 1 - j];
        right[j] = knots[span + j] - t;
        let mut saved = 0.0;
        for r in 0..j {
            // Lower triangle: knot differences; upper triangle: basis functions.
            table[j][r] = right[r + 1] + left[j - r];
            let term = table[r][j - 1] / table[j][r];
            table[r][j] = saved + right[r + 1] * term;
            saved = left[j - r] * term;
        }
        table[j][j] = saved;
    }
    let mut value = [[0.0; W]; 3];
    // The last column holds the functions themselves; derivatives follow from the differences left in the lower triangle.
    for r in 0..=p {
        value[0][r] = table[r][p];
    }
    // Derivatives beyond the degree vanish, as the table already says.
    let order = order.min(p);
    if order == 0 {
        return Basis { value };
    }
    for r in 0..=p {
        // Two rows of the coefficients a(k, j) of A2.3, each of which needs the one before alone.
        let mut a = [[0.0; W]; 2];
        let (mut s1, mut s2) = (0, 1);
        a[0][0] = 1.0;
        for k in 1..=order {
            let mut d = 0.0;
            let pk = p - k;
            if r >= k {
                a[s2][0] = a[s1][0] / table[pk + 1][r - k];
                d = a[s2][0] * table[r - k][pk];
            }
            // At the ends of the table fewer functions of lower degree overlap.
            let j1 = if r + 1 >= k { 1 } else { k - r };
            let j2 = if r <= pk + 1 { k - 1 } else { p - r };
            for j in j1..=j2 {
                a[s2][j] = (a[s1][j] - a[s1][j - 1]) / table[pk + 1][r + j - k];
                d += a[s2][j] * table[r + j - k][pk];
            }
            if r <= pk {
                a[s2][k] = -a[s1][k - 1] / table[pk + 1][r];
                d += a[s2][k] * table[r][pk];
            }
            value[k][r] = d;
            std::mem::swap(&mut s1, &mut s2);
        }
    }
    // The k-th derivative has the factor p!/(p − k)!.
    let mut factor = p as f64;
    for k in 1..=order {
        for x in &mut value[k][..=p] {
            *x *= factor;
        }
        factor *= (p - k) as f64;
    }
    Basis { value }
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

    #[test]
    fn functions_alone_have_the_same_bits() {
        let knots = [0.0, 0.0, 0.0, 0.0, 0.3, 0.7, 0.7, 1.0, 1.0, 1.0, 1.0];
        for i in 0..=50 {
            let t = i as f64 / 50.0;
            let span = find_span(&knots, 3, t);
            let b: Basis<NARROW> = basis(&knots, 3, span, t, 0);
            assert_eq!(basis_functions::<NARROW>(&knots, 3, span, t), b.value[0]);
        }
    }

    #[test]
    fn basis_sums_to_one_and_its_derivatives_to_zero() {
        let knots = [0.0, 0.0, 0.0, 0.0, 0.3, 0.7, 0.7, 1.0, 1.0, 1.0, 1.0];
        for i in 0..=20 {
            let t = i as f64 / 20.0;
            let b: Basis<NARROW> = basis(&knots, 3, find_span(&knots, 3, t), t, 2);
            let sum = |k: usize| b.value[k][..4].iter().sum::<f64>();
            assert!((sum(0) - 1.0).abs() < 1e-14 && sum(1).abs() < 1e-12 && sum(2).abs() < 1e-11);
        }
    }
}

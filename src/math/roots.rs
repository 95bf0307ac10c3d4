//! Roots of quadratics and of monotonic functions, without cancellation.

/// Real roots of `a·x² + b·x + c`, ascending, without cancellation; a double one twice. With `a = 0` the first alone, with `b = 0` too
/// none, whatever `c` is.
///
/// Source: Press et al., *Numerical Recipes*, 5.6, with the discriminant by fused multiply-add (Kahan).
///
/// ```
/// // The small root of x² − 10⁸x + 1 is 10⁻⁸; the school's formula loses most of its digits.
/// let (small, _) = lampyris::math::quadratic_roots(1.0, -1e8, 1.0);
/// assert!((small.unwrap() - 1e-8).abs() < 1e-22);
/// ```
pub fn quadratic_roots(a: f64, b: f64, c: f64) -> (Option<f64>, Option<f64>) {
    if a == 0.0 {
        return if b == 0.0 { (None, None) } else { (Some(-c / b), None) };
    }
    let p = 4.0 * a * c;
    // The second difference is what rounding took from 4ac (Kahan).
    let discriminant = f64::mul_add(b, b, -p) - f64::mul_add(4.0 * a, c, -p);
    if discriminant < 0.0 || discriminant.is_nan() {
        return (None, None);
    }
    // Both terms have one sign, so that nothing cancels; the other root is c/q by Vieta.
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    let (x, y) = (q / a, if q == 0.0 { 0.0 } else { c / q });
    (Some(x.min(y)), Some(x.max(y)))
}

/// A root of `f` in `[lo, hi]` by Newton steps that fall back to bisection, so that it always ends.
///
/// `f` returns the value and the derivative. `None` when the values at the ends have the same sign or are NaN. It ends at a step of at
/// most `tolerance` in `x` (or of the last bit of `x` where that is more), or after 200 steps.
///
/// ```
/// let root = lampyris::math::safe_newton(|x| (x * x - 2.0, 2.0 * x), 0.0, 2.0, 1e-15);
/// assert!((root.unwrap() - std::f64::consts::SQRT_2).abs() < 1e-15);
/// ```
pub fn safe_newton(mut f: impl FnMut(f64) -> (f64, f64), lo: f64, hi: f64, tolerance: f64) -> Option<f64> {
    let ((f_lo, _), (f_hi, _)) = (f(lo), f(hi));
    if f_lo == 0.0 {
        return Some(lo);
    }
    if f_hi == 0.0 {
        return Some(hi);
    }
    if f_lo.is_nan() || f_hi.is_nan() || f_lo.signum() == f_hi.signum() {
        return None;
    }
    // `below` keeps the end where f is negative.
    let (mut below, mut above) = if f_lo < 0.0 { (lo, hi) } else { (hi, lo) };
    let mut x = 0.5 * (lo + hi);
    for _ in 0..200 {
        let (value, slope) = f(x);
        if value == 0.0 {
            return Some(x);
        }
        if value < 0.0 {
            below = x
        } else {
            above = x
        }
        let newton = x - value / slope;
        let (left, right) = (below.min(above), below.max(above));
        // A step out of the bracket, or one that is no number where the slope vanishes, is replaced by a bisection.
        let next = if newton > left && newton < right { newton } else { 0.5 * (left + right) };
        if (next - x).abs() <= tolerance.max(f64::EPSILON * x.abs()) {
            return Some(next);
        }
        x = next;
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_a_nearly_cancelling_quadratic() {
        // x² − 1e8·x + 1: the small root is 1e-8·(1 + 1e-16 + …).
        let (small, large) = quadratic_roots(1.0, -1e8, 1.0);
        assert!((small.unwrap() - 1e-8).abs() < 1e-23);
        assert!((large.unwrap() - 1e8).abs() < 1e-7);
        assert_eq!(quadratic_roots(1.0, 0.0, 1.0), (None, None));
        assert_eq!(quadratic_roots(0.0, 2.0, -1.0), (Some(0.5), None));
    }

    #[test]
    fn newton_survives_a_flat_start() {
        let root = safe_newton(|x| (x * x * x - 2.0, 3.0 * x * x), -1.0, 3.0, 0.0).unwrap();
        assert!((root - 2f64.cbrt()).abs() < 1e-15);
        assert!(safe_newton(|x| (x * x + 1.0, 2.0 * x), -1.0, 1.0, 1e-12).is_none());
    }
}

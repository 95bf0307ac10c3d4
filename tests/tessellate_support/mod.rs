//! What the property tests of meshing share.

/// A clamped knot vector with uneven spans, inner knots of any multiplicity up to the degree.
pub(crate) fn knots(degree: usize, inner: &[(u8, u8)]) -> Vec<f64> {
    let mut t = vec![0.0; degree + 1];
    let mut at = 0.0;
    for &(step, times) in inner {
        at += 0.25 + step as f64 / 256.0;
        t.extend(std::iter::repeat_n(at, 1 + times as usize % degree));
    }
    t.extend(std::iter::repeat_n(at + 1.0, degree + 1));
    t
}

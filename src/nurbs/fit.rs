//! Cubic curves through what can be evaluated.

use super::Curve;
use crate::math::{Point, Vector, largest_distance};

/// Most pieces of a fitted curve.
const MAX_PIECES: u32 = 4096;

/// Fits a C¹ cubic to a curve over `[a, b]` that `at` gives by position, mm, and derivative: its pieces are doubled until their middles
/// agree to `tolerance` mm or there are [`MAX_PIECES`]. Returns it with the largest error of these middles, mm; NaN where one is no number.
pub(crate) fn fit_cubic([a, b]: [f64; 2], at: impl Fn(f64) -> (Point, Vector), tolerance: f64) -> (Curve, f64) {
    let mut n = 8u32;
    loop {
        let t = |i: f64| a + (b - a) * i / f64::from(n);
        let ts: Vec<f64> = (0..=n).map(|i| t(f64::from(i))).collect();
        let (points, slopes): (Vec<Point>, Vec<Vector>) = ts.iter().map(|&t| at(t)).unzip();
        let curve = Curve::hermite(&ts, &points, &slopes);
        // The error of a cubic with the right ends and slopes goes as s²(1 − s)² over a piece: it is greatest in
        // the middle.
        let middles = (0..n).map(|i| t(f64::from(i) + 0.5));
        let errors = middles.map(|t| (curve.evaluate(t) - at(t).0).length());
        let error = largest_distance(errors);
        // More pieces do not bring back a place that is no number.
        if error < tolerance || error.is_nan() || n >= MAX_PIECES {
            return (curve, error);
        }
        n *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_without_a_place_is_no_perfect_fit() {
        let torn = |t: f64| (if t > 0.4 && t < 0.6 { Point::NAN } else { t * Point::X }, Vector::X);
        assert!(fit_cubic([0.0, 1.0], torn, 1e-3).1.is_nan());
        assert!(fit_cubic([0.0, 1.0], |t| (t * Point::X, Vector::X), 1e-3).1 < 1e-12);
    }
}

//! The largest of many noisy values, and how far it lies above the largest true one.

/// Steps of the integral over possible maxima: its ends are 12 standard errors apart, and a tenth of one is near enough.
const STEPS: usize = 128;
/// Standard errors beyond which a value is taken as never to be the largest.
const REACH: f64 = 6.0;

/// Returns the largest of distances, 0 without any, and NaN where one is no number: `f64::max` would drop it, and take a curve without a
/// place for a perfect fit.
pub(crate) fn largest_distance(distances: impl Iterator<Item = f64>) -> f64 {
    distances.fold(0.0, |largest, d| if d > largest || d.is_nan() { d } else { largest })
}

/// Returns the error of the largest of `values`, each with its standard error: the root of the sum of squares of its own and of what the
/// largest of noisy values exceeds the largest true one by. 0 without values.
///
/// The excess is that of the largest after the noise is added once more (Efron, *Bootstrap Methods*, 1979), by the integral of the
/// distribution of a maximum of independent normal values.
pub(crate) fn error_of_maximum(values: impl Iterator<Item = [f64; 2]> + Clone) -> f64 {
    let Some([largest, own]) = values.clone().max_by(|a, b| a[0].total_cmp(&b[0])) else { return 0.0 };
    // Below this the maximum nearly certainly does not lie.
    let low = largest - REACH * own;
    let rivals: Vec<[f64; 2]> = values.filter(|[v, e]| *e > 0.0 && v + REACH * e > largest).collect();
    let high = rivals.iter().map(|[v, e]| v + REACH * e).fold(largest, f64::max);
    if high <= low {
        return own;
    }
    let step = (high - low) / STEPS as f64;
    let exceeded = (0..STEPS).map(|k| {
        // The mean of a maximum is what its distribution function lacks to 1, integrated.
        let x = low + (k as f64 + 0.5) * step;
        let below: f64 = rivals.iter().map(|[v, e]| standard_normal_cdf((x - v) / e)).product();
        (1.0 - below) * step
    });
    let expected = low + exceeded.sum::<f64>();
    own.hypot((expected - largest).max(0.0))
}

/// Returns the distribution function of the standard normal distribution, within 1e-5 (Abramowitz and Stegun, *Handbook*, 26.2.16).
fn standard_normal_cdf(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.33267 * x.abs());
    let density = (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let beyond = density * t * (0.436_183_6 + t * (-0.120_167_6 + t * 0.937_298_0));
    if x > 0.0 { 1.0 - beyond } else { beyond }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_distribution_is_that_of_the_tables() {
        for (x, expected) in [(0.0, 0.5), (1.0, 0.841_345), (-1.0, 0.158_655), (2.0, 0.977_250), (3.0, 0.998_650)] {
            assert!((standard_normal_cdf(x) - expected).abs() < 2e-5, "{x}");
        }
    }

    #[test]
    fn a_distance_that_is_no_number_is_not_dropped() {
        assert_eq!(largest_distance([1.0, 3.0, 2.0].into_iter()), 3.0);
        assert_eq!(largest_distance(std::iter::empty()), 0.0);
        assert!(largest_distance([1.0, f64::NAN, 2.0].into_iter()).is_nan());
    }

    /// The mean of the largest of two equal normal values is 1/√π of their standard error above each.
    #[test]
    fn the_largest_of_two_equal_values_is_too_large_by_known_noise() {
        let error = error_of_maximum([[10.0, 1.0], [10.0, 1.0]].into_iter());
        let excess = 1.0 / std::f64::consts::PI.sqrt();
        assert!((error - 1f64.hypot(excess)).abs() < 2e-3, "{error}");
        let alone = error_of_maximum([[10.0, 1.0], [1.0, 1.0]].into_iter());
        assert!((alone - 1.0).abs() < 2e-3, "{alone}");
    }
}

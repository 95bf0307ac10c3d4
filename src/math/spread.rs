//! The standard error of a sum of independent parts, from how much the parts differ.
//!
//! Convention: a single part counts as two of which the other is 0, so that the sum's error is the sum itself. Its spread is not known,
//! and 100 % is what nobody takes for an accuracy.

/// Returns the variance of a sum of so many independent parts, from the sum of the parts' squares, which may leave out parts of 0, and the
/// parts' sum.
pub(crate) fn variance_of_sum(squares: f64, sum: f64, parts: usize) -> f64 {
    let n = parts.max(2) as f64;
    variance_from_residuals((squares - sum * sum / n).max(0.0), parts)
}

/// Returns the variance of a sum of so many independent parts, from the sum of the squares of their distances from the mean: n/(n − 1)
/// times that, as the mean was taken from the same parts. Fewer than two count as two: of one part the residual is 0 and says nothing,
/// which callers answer first.
pub(crate) fn variance_from_residuals(residuals: f64, parts: usize) -> f64 {
    let n = parts.max(2) as f64;
    residuals * n / (n - 1.0)
}

/// Returns the standard error of the sum of independent parts; 0 without parts. More exact than [`variance_of_sum`] where the parts
/// differ by little.
pub(crate) fn error_of_sum(parts: &[f64]) -> f64 {
    if let [part] = parts {
        return part.abs();
    }
    let mean = parts.iter().sum::<f64>() / parts.len().max(1) as f64;
    // A product, which is rounded the same everywhere: of powers that is not promised.
    variance_from_residuals(parts.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>(), parts.len()).sqrt()
}

/// Returns the standard error of the mean of parts that count different rays, each `[value, error]`. A part of 0 states as its error what
/// one ray would bring it: beside others that have light this is no spread of theirs, and where all are 0, one ray in any of them is what
/// the mean may have missed. 0 without parts.
pub(crate) fn error_of_mean(parts: impl ExactSizeIterator<Item = [f64; 2]> + Clone) -> f64 {
    let count = parts.len().max(1) as f64;
    if parts.clone().all(|[value, _]| value == 0.0) {
        return parts.fold(0.0, |largest, [_, error]| error.max(largest)) / count;
    }
    parts.filter(|[value, _]| *value != 0.0).map(|[_, error]| error * error).sum::<f64>().sqrt() / count
}

/// Rays below which it is open whether heavier ones might have come: of none 6.6 are the limit at three standard errors.
const FEW_RAYS: f64 = 7.0;
/// Share of the heaviest ray's power below which those that came are of another kind.
const LIGHT_RAY: f64 = 0.2;

/// Returns the standard error of a power, given with that of its spread, to which the heaviest ray adds `ray`: that itself where no ray
/// came, and beside the spread of a few much lighter ones, which says nothing about heavy rays that did not come.
pub(crate) fn error_beside_unseen_ray(power: f64, spread: f64, ray: f64) -> f64 {
    if power <= 0.0 {
        return ray;
    }
    // Independent rays spread by the root of their number.
    let rays = (power / spread.max(f64::MIN_POSITIVE)).powi(2).max(1.0);
    let is_light = power < LIGHT_RAY * ray * rays;
    // Fading, so that the error does not jump where one ray more came.
    if is_light && rays < FEW_RAYS { spread.hypot(ray * (1.0 - rays / FEW_RAYS)) } else { spread }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parts 10 and 14: their variance is 8, that of the sum 16. A single part is as uncertain as it is large.
    #[test]
    fn both_forms_follow_one_convention() {
        for (parts, expected) in [(vec![10.0, 14.0], 4.0), (vec![7.0], 7.0), (vec![-7.0], 7.0), (vec![3.0; 5], 0.0)]
        {
            let squares = parts.iter().map(|p| p * p).sum::<f64>();
            let from_sums = variance_of_sum(squares, parts.iter().sum(), parts.len()).sqrt();
            assert_eq!([error_of_sum(&parts), from_sums], [expected; 2], "{parts:?}");
        }
        assert_eq!([error_of_sum(&[]), variance_of_sum(0.0, 0.0, 0)], [0.0; 2]);
    }

    /// One ray of a twentieth of the heaviest: without any the error is the heaviest, and with ten it is their spread.
    #[test]
    fn a_light_ray_does_not_tell_that_no_heavy_one_comes() {
        assert_eq!(error_beside_unseen_ray(0.0, 0.0, 1.0), 1.0);
        assert!((0.8..1.0).contains(&error_beside_unseen_ray(0.05, 0.05, 1.0)));
        assert_eq!(error_beside_unseen_ray(0.5, 0.158, 1.0), 0.158);
        // One heavy ray is as uncertain as it is, and smooth light is known.
        assert_eq!(error_beside_unseen_ray(1.0, 1.0, 1.0), 1.0);
        assert_eq!(error_beside_unseen_ray(1e-6, 1e-12, 1.0), 1e-12);
    }

    /// Nine rays of weight 1 in nine of a hundred cells are 9 ± 3 rays in all; without any, one ray may have been missed.
    #[test]
    fn dark_parts_are_no_spread_of_a_mean() {
        let cells = |lit: usize| (0..100).map(move |k| if k < lit { [1.0, 1.0] } else { [0.0, 1.0] });
        assert!((error_of_mean(cells(9)) - 0.03).abs() < 1e-15);
        assert!((error_of_mean(cells(0)) - 0.01).abs() < 1e-15);
        assert_eq!(error_of_mean([].into_iter()), 0.0);
    }
}

//! The largest of many noisy values, and how far it lies above the largest true one.

/// Halvings of the interval in which the excess of a maximum is sought: a billionth of the largest error is left, which is fine also beside
/// a value a million times as certain.
const HALVINGS: usize = 32;
/// Standard errors beyond which a value is taken as never to be the largest.
const REACH: f64 = 6.0;
/// Standard errors by which the true value behind each noisy one is taken to lie above it, as far as the level allows. Within one error lay
/// of 250 runs and more of each field 61 to 72 % on even ones of 2 to 2500 cells, 76 to 94 % on slopes and on spots wider than a few cells,
/// 58 % and more on two levels; with 0 even fields had 46 to 69 %.
const LIFT: f64 = 1.0;

/// Returns the largest of distances, 0 without any, and NaN where one is no number: `f64::max` would drop it, and take a curve without a
/// place for a perfect fit.
pub(crate) fn largest_distance(distances: impl Iterator<Item = f64>) -> f64 {
    distances.fold(0.0, |largest, d| if d > largest || d.is_nan() { d } else { largest })
}

/// Returns the error of the largest of `values`, each with its standard error: the root of the sum of squares of its own and of what the
/// largest of noisy values exceeds the largest true one by. 0 without values.
///
/// Noise has spread the values already: were they taken for the true ones and noise added once more (Efron, *Bootstrap Methods*, 1979),
/// most of the excess would be missed, as the luckiest of them would be believed. So no true value is taken to lie above a level, that
/// above which noise brings the largest of values under it as often as not. One value far above all others is its own level.
pub(crate) fn error_of_maximum(values: impl Iterator<Item = [f64; 2]> + Clone) -> f64 {
    let by_value = |a: &(usize, [f64; 2]), b: &(usize, [f64; 2])| a.1[0].total_cmp(&b.1[0]);
    let Some((place, [largest, own])) = values.clone().enumerate().max_by(by_value) else { return 0.0 };
    let may_be_largest = |[v, e]: [f64; 2]| e > 0.0 && e.is_finite() && v + REACH * e > largest;
    let rivals: Vec<[f64; 2]> = values.clone().filter(|value| may_be_largest(*value)).collect();
    // A rival that is known far worse than the largest value may be above it in truth, and the level does not show that.
    let others = values.enumerate().filter(|(k, value)| *k != place && may_be_largest(*value));
    let missed = others.map(|(_, [v, e])| e * mean_beyond((largest - v) / e)).fold(0.0, f64::max);
    own.hypot(excess_of_maximum(largest, &rivals).max(missed))
}

/// Returns by how much the level of the true values lies below the largest noisy one, from all values with their errors, above 0, that may
/// be the largest.
fn excess_of_maximum(largest: f64, rivals: &[[f64; 2]]) -> f64 {
    let below_largest = |excess: f64| -> f64 {
        let level = largest - excess;
        let share = |[v, e]: &[f64; 2]| standard_normal_cdf((largest - (v + LIFT * e).min(level)) / e);
        rivals.iter().map(share).product()
    };
    let mut excess = [0.0, REACH * rivals.iter().map(|[_, e]| *e).fold(0.0, f64::max)];
    for _ in 0..HALVINGS {
        let middle = 0.5 * (excess[0] + excess[1]);
        // The lower the level, the likelier are all values below the largest one.
        excess[usize::from(below_largest(middle) >= 0.5)] = middle;
    }
    excess[0]
}

/// Returns the mean of what a standard normal value lies above `x`, counted as 0 where it lies below.
fn mean_beyond(x: f64) -> f64 {
    (standard_normal_density(x) - x * standard_normal_cdf(-x)).max(0.0)
}

/// Returns the density of the standard normal distribution.
fn standard_normal_density(x: f64) -> f64 {
    (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt()
}

/// Returns the distribution function of the standard normal distribution, within 1e-5 (Abramowitz and Stegun, *Handbook*, 26.2.16).
fn standard_normal_cdf(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.33267 * x.abs());
    let beyond = standard_normal_density(x) * t * (0.436_183_6 + t * (-0.120_167_6 + t * 0.937_298_0));
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

    /// The largest of n equal normal values is below x of their standard errors with probability Φ(x)ⁿ: as often as not with
    /// Φ(x) = 2^(−1/n), of which the tables have x = 0 for one, 0.544952 for two and 2.462 for a hundred.
    #[test]
    fn the_largest_of_equal_values_is_too_large_by_known_noise() {
        for (count, excess) in [(1, 0.0), (2, 0.544_952), (100, 2.462_038)] {
            let error = error_of_maximum(std::iter::repeat_n([10.0, 1.0], count));
            assert!((error - 1f64.hypot(excess)).abs() < 2e-3, "{count}: {error}");
        }
        // A peak above a dim field is what it is.
        let dim = std::iter::repeat_n([4.0, 1.0], 99).chain([[10.0, 1.0]]);
        let peak = error_of_maximum(dim);
        assert!((peak - 1.0).abs() < 2e-3, "{peak}");
    }

    /// A normal value exceeds its mean by 1/√(2π) of its standard error on average, falls short of it not counted.
    #[test]
    fn a_certain_value_beside_an_uncertain_one_may_not_be_the_largest() {
        let error = error_of_maximum([[10.0, 1e-3], [10.0 - 1e-9, 5.0]].into_iter());
        let missed = 5.0 / (2.0 * std::f64::consts::PI).sqrt();
        assert!((error / missed - 1.0).abs() < 1e-3, "{error} {missed}");
    }

    /// Of an even field of n cells with the standard error 1 the largest lies less than x above the true value in a share of Φ(x)ⁿ of the
    /// runs: with 100 cells and x = √(1 + 2.462²) in 67.4 %. The level that is found scatters beside, as do 400 runs, by 2.3 %.
    #[test]
    fn the_error_of_an_even_field_holds_in_as_many_runs_as_it_says() {
        let mut state = 7u64;
        // SplitMix64 (Steele, Lea and Flood, 2014), of its first 53 bits.
        let mut uniform = || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (((mixed ^ (mixed >> 31)) >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        };
        // Box and Muller, 1958.
        let mut normal = || (-2.0 * uniform().ln()).sqrt() * (2.0 * std::f64::consts::PI * uniform()).cos();
        let mut held = 0;
        for _ in 0..400 {
            let cells: Vec<[f64; 2]> = (0..100).map(|_| [1000.0 + normal(), 1.0]).collect();
            let largest = cells.iter().map(|[value, _]| *value).fold(0.0, f64::max);
            held += u32::from((largest - 1000.0).abs() < error_of_maximum(cells.into_iter()));
        }
        assert!((215..=310).contains(&held), "{held} of 400");
    }
}

//! Quanta turned into powers, and the spread of replicates into their standard errors.

use super::tally::{CUT, Sum};

/// Quanta of a replicate below which its square is cut to none, and with it its share of a spread.
const SQUARELESS: f64 = (1u32 << CUT) as f64;

/// The most that rounding to whole quanta changes of the power of a ray.
pub(super) const HALF_QUANTUM: f64 = 0.5;

/// Converts the sums of a run to figures.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PowerScale {
    /// Power of a quantum, in the unit of the sources.
    pub(crate) quantum: f64,
    /// Number of replicates that were summed.
    pub(crate) replicates: u32,
    /// Number of rays that were summed, wherever they went.
    pub(crate) rays: u64,
}

impl PowerScale {
    /// Returns the power of a sum.
    pub(crate) fn power(&self, sum: &Sum) -> f64 {
        sum.total as f64 * self.quantum
    }

    /// Returns the standard error of [`Self::power`]: that of the spread of replicates, at least what rounding may hide.
    pub(crate) fn error(&self, sum: &Sum) -> f64 {
        // Most cells of a short run, whose results took longer than a fifth of its rays.
        if sum.total == 0 {
            return 0.0;
        }
        let spread = sum.error(self.replicates);
        spread.max(self.rounding(sum.total as f64, spread)) * self.quantum
    }

    /// Returns how many of `total` quanta, above 0, may be rounding, where replicates differ by `spread`. Rays that a dense filter leaves a
    /// few quanta each are rounded alike, which no spread shows.
    fn rounding(&self, total: f64, spread: f64) -> f64 {
        // The cut of their squares hides a spread of up to that of as many replicates that have light next to none without.
        let of_squares = f64::from(self.replicates.max(2)).sqrt() * SQUARELESS;
        // Independent rays spread by the root of their number; each has a quantum at least.
        let share = total / spread.max(f64::MIN_POSITIVE);
        let by_spread = if spread > of_squares { share * share } else { f64::INFINITY };
        let rays = (self.rays as f64).min(by_spread).min(total);
        of_squares.max(HALF_QUANTUM * rays).min(total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::QUANTA;

    fn sum(replicates: impl Iterator<Item = u128>) -> Sum {
        let mut sum = Sum::default();
        replicates.for_each(|quanta| sum.add_replicate(quanta));
        sum
    }

    /// A filter leaves 0.1 of a ray of 2⁴⁰ quanta, or 2.6 quanta, each rounded to the next whole number, by 0.4: of 100 replicates with 10⁵
    /// rays each this is 4·10⁶ in all, and half a quantum a ray 5·10⁶.
    #[test]
    fn rays_that_are_all_rounded_alike_have_an_error() {
        let scale = PowerScale { quantum: 1.0, replicates: 100, rays: 10_000_000 };
        for true_ray in [0.1 * QUANTA, 2.6] {
            let counted = true_ray.round() as u128;
            let all = sum((0..100).map(|_| 100_000 * counted));
            assert_eq!(all.error(100), 0.0, "they do not differ");
            let off = 1e7 * (true_ray.round() - true_ray);
            assert!(off > 3.99e6 && scale.error(&all) == 5e6, "{off} {}", scale.error(&all));
        }
    }

    /// Of 128 replicates every other one has 1000 quanta, whose square is cut to none: their spread makes an error of 500·128/√127 = 5679.
    /// What the cut may hide is 1024·√128 = 11585, and of a few quanta at most all of them.
    #[test]
    fn a_spread_that_is_cut_away_is_stated_as_what_the_cut_may_hide() {
        let scale = PowerScale { quantum: 1.0, replicates: 128, rays: 640 };
        let half = sum((0..128).map(|k| 1000 * (k % 2)));
        assert!(half.error(128) == 0.0 && (scale.error(&half) - 11_585.2).abs() < 0.1, "{}", scale.error(&half));
        let few = sum((0..128).map(|k| u128::from(k == 5) * 700));
        assert_eq!(scale.error(&few), 700.0);
    }

    /// Half of 100 replicates with 2⁴⁰ quanta, half with three times as many: an error of 100/√99 rays, beside which nothing is rounded.
    #[test]
    fn a_spread_that_is_known_is_the_error() {
        let scale = PowerScale { quantum: 2.0, replicates: 100, rays: 1_000_000 };
        let known = sum((0..100).map(|k| (1u128 + 2 * (k % 2)) << 40));
        assert_eq!(scale.error(&known), 2.0 * known.error(100));
        assert!((known.error(100) / QUANTA * 99f64.sqrt() / 100.0 - 1.0).abs() < 1e-9);
        assert_eq!(scale.error(&Sum::default()), 0.0);
    }
}

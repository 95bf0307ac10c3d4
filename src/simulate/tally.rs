//! Order-free sums.
//!
//! The power of every path is a whole number of quanta, [`QUANTA`] to an average ray at the source, held in an `f64` (exact
//! below 2⁵³). Interfaces and mirrors divide it into whole numbers, so energy closes to the last quantum by construction,
//! and sums of whole numbers do not depend on order: any threads, batches or shards give the same bits.
//!
//! The run is divided into replicates, each with its own scramble of the sampling net. Errors are those of the mean over
//! replicates, which is honest for random numbers, nets and split rays alike (batch means; with 128 replicates the
//! error of the error is 6 %).

use crate::math::{variance_from_residuals, variance_of_sum};
use serde::{Deserialize, Serialize};

/// Quanta of an average ray when it leaves its source: 9.1e-13 of a ray is the finest share of power. Fewer, by a power of two, in runs
/// with rays so heavy, or so many, that sums of as many would not fit their words.
pub const QUANTA: f64 = (1u64 << 40) as f64;

/// Squares are kept without these lowest bits of theirs, so that a replicate of 2³⁰ rays cannot overflow.
const SQUARE_CUT: u32 = 20;
/// What half of these bits cut from a number whose square would fill two words.
pub(super) const CUT: u32 = SQUARE_CUT / 2;

/// What added to a number below 2⁵¹ leaves the nearest whole number in the lowest bits.
const SHIFT: f64 = 6_755_399_441_055_744.0;

/// Returns the nearest whole number, of halves the even one below 2⁵¹. One addition there: `f64::round` is a call for the baseline of
/// x86-64, 3 ns each of the five on a path that is received.
#[inline(always)]
pub(crate) fn round_quanta(x: f64) -> f64 {
    // Adding and taking away 1.5·2⁵² leaves the whole number, rounded to even.
    if x.abs() < 2_251_799_813_685_248.0 { (x + SHIFT) - SHIFT } else { x.round() }
}

/// Returns a whole number of quanta, from 0 to below 2⁶³, as an integer; a cast to a signed one is one instruction, to an unsigned one ten.
#[inline(always)]
pub(crate) fn quanta_as_integer(quanta: f64) -> u64 {
    quanta as i64 as u64
}

/// Returns the whole number nearest to one below 2⁵¹, as an integer: a conversion with all its cases would be eight instructions more.
#[inline(always)]
fn nearest_integer(x: f64) -> i64 {
    (x + SHIFT).to_bits().wrapping_sub(SHIFT.to_bits()) as i64
}

/// A sum over all rays and the sum of squares of its replicates.
///
/// ```
/// use lampyris::simulate::Sum;
/// // Two replicates of 10 and 14 units of 2²⁰ quanta: their spread makes a standard error of the sum of 4.
/// let mut sum = Sum::default();
/// [10u128, 14].iter().for_each(|n| sum.add_replicate(n << 20));
/// assert_eq!((sum.total >> 20, sum.error(2)), (24, 4.0 * 1_048_576.0));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sum {
    /// Quanta of all rays.
    pub total: u128,
    /// Sum over replicates of the square of the replicate's quanta, in units of 2²⁰ quanta².
    pub squares: u128,
}

impl Sum {
    /// Adds what one whole replicate gathered.
    pub fn add_replicate(&mut self, quanta: u128) {
        self.total += quanta;
        let square = |x: u64| u128::from(x) * u128::from(x);
        // Nearly all fit a word, whose square is one multiplication. The square is cut, and not what is squared: that would show in the
        // error of replicates that differ by less than 1e-6. What does not fit at all has no error, as `error` says.
        let cut = match (u64::try_from(quanta), u64::try_from(quanta >> CUT)) {
            (Ok(quanta), _) => square(quanta) >> SQUARE_CUT,
            (_, Ok(half_cut)) => square(half_cut),
            _ => u128::MAX,
        };
        self.squares = self.squares.saturating_add(cut);
    }

    /// Adds the sum of other replicates.
    pub fn merge(&mut self, o: &Self) {
        self.total += o.total;
        self.squares = self.squares.saturating_add(o.squares);
    }

    /// Returns the standard error of the total, in quanta, from the spread of `replicates` replicates. The total itself for a single one
    /// and where the sum of squares is full: neither gives a spread.
    pub fn error(&self, replicates: u32) -> f64 {
        if self.squares == u128::MAX {
            return self.total as f64;
        }
        // Light that passes a receiver many times counts for more than was emitted: what no word holds is known to 1e-8.
        let Some(residuals) = self.residuals(replicates) else {
            let squares = self.squares as f64 * f64::from(1u32 << SQUARE_CUT);
            return variance_of_sum(squares, self.total as f64, replicates as usize).sqrt();
        };
        variance_from_residuals(residuals, replicates as usize).sqrt()
    }

    /// Returns the sum of the squares of the replicates' distances from their mean, in quanta²; `None` where no words hold what is needed.
    ///
    /// In whole numbers: of replicates that differ by 1e-8 of themselves, as those of a smooth figure do, an `f64` would leave nothing.
    fn residuals(&self, replicates: u32) -> Option<f64> {
        let n = u128::from(replicates.max(2));
        let (mean, rest) = (self.total / n, self.total % n);
        // With the total T = m·n + r, T²/n is m·(T + r) + r²/n, of which the last term is far below the unit of squares.
        let expected = cut_product(u64::try_from(mean).ok()?, self.total + rest, SQUARE_CUT)?;
        Some(self.squares.saturating_sub(expected) as f64 * f64::from(1u32 << SQUARE_CUT))
    }
}

/// Returns a product without so many of its lowest bits, up to 63; `None` where it would be more than two words.
fn cut_product(a: u64, b: u128, cut: u32) -> Option<u128> {
    let [high, low] = [b >> 64, b & u128::from(u64::MAX)].map(|word| word * u128::from(a));
    high.checked_mul(1 << (64 - cut))?.checked_add(low >> cut)
}

/// Returns what a sum of products over `n` replicates would be if all of them were equal: a·b/n of the sums `a` and `b` of the factors,
/// without so many of its lowest bits; `None` where no words hold it.
fn product_of_equal_parts(a: u128, b: u128, n: u128, cut: u32) -> Option<u128> {
    let [mean_a, mean_b] = [a / n, b / n].map(|mean| u64::try_from(mean).ok());
    // With a = m·n + r, a·b/n is m·b + r·b/n.
    cut_product(mean_a?, b, cut)?.checked_add(cut_product(mean_b?, a % n, cut)?)
}

/// First and second moments of where light arrives, in fixed point, so that spot sizes are order-free too.
///
/// Coordinates are counted in units of 2⁻³² of the receiver's half side, which is finer than 1e-9 of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Moments {
    /// Σ w·x and Σ w·y.
    pub first: [i128; 2],
    /// Σ w·x² and Σ w·y².
    pub second: [u128; 2],
    /// Largest x² + y², in units of 2⁻⁶⁰ of the square of the half side.
    pub farthest: u64,
}

/// Fixed-point units of a coordinate.
const GRAIN: f64 = Moments::GRAIN;

impl Moments {
    /// Units of a coordinate, and of its square, to a half side.
    pub const GRAIN: f64 = (1u64 << 32) as f64;
    /// What [`Self::farthest`] is less than the largest distance at most.
    pub(crate) const FARTHEST_UNIT: f64 = 1.0 / (1u64 << 30) as f64;

    /// Adds `quanta` at `x`, `y` in units of the half sides, both within ±1; `radius2` as a share of the half side squared.
    #[inline]
    pub(crate) fn add(&mut self, quanta: f64, [x, y]: [f64; 2], radius2: f64) {
        let w = quanta_as_integer(quanta);
        let (x2, y2) = (nearest_integer(x * x * GRAIN) as u64, nearest_integer(y * y * GRAIN) as u64);
        // Signed by signed is one multiplication.
        self.first[0] += i128::from(w as i64) * i128::from(nearest_integer(x * GRAIN));
        self.first[1] += i128::from(w as i64) * i128::from(nearest_integer(y * GRAIN));
        self.second[0] += u128::from(w) * u128::from(x2);
        self.second[1] += u128::from(w) * u128::from(y2);
        // The largest and no sum: nothing is added up, which leaves room for finer units.
        self.farthest = self.farthest.max(quanta_as_integer(radius2 * (1u64 << 60) as f64));
    }

    /// Adds the moments of other rays, of which the farthest counts where it is farther.
    pub fn merge(&mut self, o: &Self) {
        for axis in 0..2 {
            self.first[axis] += o.first[axis];
            self.second[axis] += o.second[axis];
        }
        self.farthest = self.farthest.max(o.farthest);
    }

    /// Returns first and second moments of both coordinates in one list; no sum of a run reaches 2¹²⁷.
    fn as_list(&self) -> [i128; 4] {
        let [x, y] = self.second.map(|s| i128::try_from(s).unwrap_or(i128::MAX));
        [self.first[0], self.first[1], x, y]
    }

    /// Returns mean and mean square of each coordinate in units of the half sides, for `quanta` in all; zeros where there are none.
    pub fn means(&self, quanta: u128) -> [[f64; 2]; 2] {
        let w = quanta.max(1) as f64;
        let first = self.first.map(|s| s as f64 / GRAIN / w);
        let second = self.second.map(|s| s as f64 / GRAIN / w);
        [[first[0], second[0]], [first[1], second[1]]]
    }

    /// Returns the largest distance from the centre, in units of the half side it was counted in.
    pub fn farthest(&self) -> f64 {
        (self.farthest as f64 / (1u64 << 60) as f64).sqrt()
    }
}

/// How power and moments go together from replicate to replicate: what the errors of mean positions and spot sizes are worked out
/// from. Products of whole numbers, cut, so that these errors are order-free as well.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MomentSpread {
    /// For both coordinates of the first moments, then of the second: Σ m·p and Σ m² over replicates.
    pub products: [[i128; 2]; 4],
}

/// Bits that a moment is cut by: a coordinate's 32 and two more.
const CUT_MOMENT: u32 = 34;

impl MomentSpread {
    /// Adds what one whole replicate gathered: its power in quanta and its moments.
    pub fn add_replicate(&mut self, quanta: u128, m: &Moments) {
        let power = i128::try_from(quanta).unwrap_or(i128::MAX);
        for (sums, moment) in self.products.iter_mut().zip(m.as_list()) {
            let moment = moment >> CUT_MOMENT;
            // As squares of the power are: the product is cut, and not what is multiplied.
            let product = match moment.checked_mul(power) {
                Some(product) => product >> CUT,
                None => moment.saturating_mul(power >> CUT),
            };
            sums[0] = sums[0].saturating_add(product);
            sums[1] = sums[1].saturating_add(moment.saturating_mul(moment));
        }
    }

    /// Adds the products of other replicates.
    pub fn merge(&mut self, o: &Self) {
        let pairs = self.products.iter_mut().flatten().zip(o.products.iter().flatten());
        pairs.for_each(|(a, b)| *a = a.saturating_add(*b));
    }

    /// Returns the standard errors of the two means, then of the two mean squares of [`Moments::means`], as ratios of sums over replicates;
    /// 1, the half side itself, where a sum is full or there is a single replicate: neither gives a spread.
    pub fn errors(&self, power: &Sum, m: &Moments, replicates: u32) -> [f64; 4] {
        let total = power.total.max(1) as f64;
        let unit = [f64::from(1u32 << CUT), 2f64.powi(CUT_MOMENT as i32) / GRAIN];
        let moments = m.as_list();
        let full = |sum: i128| sum == i128::MAX || sum == i128::MIN;
        std::array::from_fn(|i| {
            // A single replicate's moments are the mean times its power: what is left of them is always 0.
            if (replicates < 2 && power.total > 0)
                || self.products[i].into_iter().any(full)
                || power.squares == u128::MAX
            {
                return 1.0;
            }
            let mean = moments[i] as f64 / GRAIN / total;
            // What no words hold is known to 1e-8, as it is of the power.
            let [with_power, with_self, squares] =
                self.residuals(i, moments[i], power, replicates).unwrap_or_else(|| {
                    let [with_power, with_self] = self.products[i].map(|x| x as f64);
                    [with_power, with_self, power.squares as f64 * unit[0] * unit[0]]
                });
            let [with_power, with_self] = [with_power * unit[1], with_self * unit[1]];
            // First order in the fluctuations of a ratio (the delta method): the moment less the mean times the
            // power.
            let spread = with_self * unit[1] - 2.0 * mean * with_power * unit[0] + mean * mean * squares;
            variance_from_residuals(spread.max(0.0), replicates as usize).sqrt() / total
        })
    }

    /// Returns the products of moment `i`, whose sum is `moment`, with the power and with itself, in their units, and the squares of the
    /// power in quanta², each less what replicates that are all equal would have: all three terms of a spread lose the same by that, and
    /// their difference keeps its digits, as in [`Sum::residuals`]. `None` where no words hold what is needed.
    fn residuals(&self, i: usize, moment: i128, power: &Sum, replicates: u32) -> Option<[f64; 3]> {
        let n = u128::from(replicates.max(2));
        let moment = moment >> CUT_MOMENT;
        let size = moment.unsigned_abs();
        let of_power = i128::try_from(product_of_equal_parts(size, power.total, n, CUT)?).ok()? * moment.signum();
        let of_self = i128::try_from(product_of_equal_parts(size, size, n, 0)?).ok()?;
        let [with_power, with_self] = self.products[i];
        Some([
            with_power.checked_sub(of_power)? as f64,
            with_self.checked_sub(of_self)? as f64,
            power.residuals(replicates)?,
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_equal_replicates_is_nothing() {
        let mut s = Sum::default();
        (0..128).for_each(|_| s.add_replicate(1 << 50));
        assert_eq!(s.error(128), 0.0);
        assert_eq!(s.total, 128 << 50);
    }

    #[test]
    fn the_error_is_that_of_a_mean_over_replicates() {
        // Half of 100 replicates at 2⁴⁰, half at 3·2⁴⁰: variance of a replicate 2⁸⁰·100/99, of the total 100 times that.
        let mut s = Sum::default();
        (0..100).for_each(|i| s.add_replicate((1 + 2 * (i % 2)) << 40));
        let expected = (100.0f64 * 100.0 / 99.0).sqrt() * (1u64 << 40) as f64;
        assert!((s.error(100) / expected - 1.0).abs() < 1e-12);
    }

    /// Of 128 replicates half lie `d` above 2⁵⁰, down to 1.5e-11 of it, half as much below: the total's error is d·n/√(n − 1).
    #[test]
    fn replicates_that_are_nearly_equal_keep_their_error() {
        for d in [1u128 << 14, 1 << 22, 1 << 30] {
            let mut s = Sum::default();
            (0..128).for_each(|k| s.add_replicate(if k % 2 == 0 { (1 << 50) + d } else { (1 << 50) - d }));
            let expected = d as f64 * 128.0 / 127.0f64.sqrt();
            assert!((s.error(128) / expected - 1.0).abs() < 2e-3, "{d}: {} {expected}", s.error(128));
        }
    }

    /// Replicates of 2⁶⁵ and 2⁶⁵ + 2⁵⁵ quanta, more than words hold: the error of the sum is their difference.
    #[test]
    fn replicates_beyond_a_word_have_an_error() {
        let (d, mut sum) = (1u128 << 55, Sum::default());
        [1 << 65, (1 << 65) + d].iter().for_each(|quanta| sum.add_replicate(*quanta));
        assert!((sum.error(2) / d as f64 - 1.0).abs() < 1e-6, "{}", sum.error(2));
    }

    /// A moment below zero times a power may be more than two words hold: the sum stays below zero.
    #[test]
    fn products_keep_their_sign_where_they_are_cut_first() {
        let m = Moments { first: [-(1 << 104), 1 << 104], ..Moments::default() };
        let mut spread = MomentSpread::default();
        spread.add_replicate(1 << 60, &m);
        let expected = 1i128 << (104 - CUT_MOMENT + 60 - CUT);
        assert_eq!([0, 1].map(|axis| spread.products[axis][0]), [-expected, expected]);
    }

    #[test]
    fn quanta_are_the_nearest_whole_numbers() {
        for x in [0.5, 1.5, 2.5, 2.6, 1e9 + 0.75, 2f64.powi(51) - 0.25, 4.5e15] {
            assert_eq!([round_quanta(x), round_quanta(-x)], [x.round_ties_even(), -x.round_ties_even()]);
        }
    }

    #[test]
    fn sums_that_are_full_state_no_small_error() {
        let mut sum = Sum::default();
        [1u128 << 80, 1 << 80].iter().for_each(|quanta| sum.add_replicate(*quanta));
        assert_eq!(sum.error(2), 2f64.powi(81));
        let (mut spread, mut whole) = (MomentSpread::default(), Moments::default());
        for _ in 0..2 {
            let m = Moments { first: [1 << 110, 0], second: [1 << 110, 0], farthest: 0 };
            spread.add_replicate(1 << 80, &m);
            whole.merge(&m);
        }
        assert_eq!(spread.errors(&sum, &whole, 2), [1.0; 4]);
    }

    /// What a single replicate brought is its mean, whose spread is not known: its power is stated as uncertain as it is large, its place
    /// as anywhere on the receiver.
    #[test]
    fn a_single_replicate_states_no_small_error() {
        let (mut sum, mut spread, mut whole) = (Sum::default(), MomentSpread::default(), Moments::default());
        assert_eq!((sum.error(1), spread.errors(&sum, &whole, 1)), (0.0, [0.0; 4]));
        whole.add(QUANTA, [0.5, 0.25], 0.3125);
        spread.add_replicate(QUANTA as u128, &whole);
        sum.add_replicate(QUANTA as u128);
        assert_eq!((sum.error(1), spread.errors(&sum, &whole, 1)), (QUANTA, [1.0; 4]));
    }

    /// Two replicates of equal power, at 0.5 and at 0.25: mean 0.375 ± 0.125, mean square 0.15625 ± 0.09375.
    #[test]
    fn errors_of_means_are_those_of_ratios() {
        let (mut whole, mut spread, mut power) = (Moments::default(), MomentSpread::default(), Sum::default());
        for x in [0.5, 0.25] {
            let mut m = Moments::default();
            m.add(QUANTA, [x, 0.0], x * x);
            spread.add_replicate(QUANTA as u128, &m);
            power.add_replicate(QUANTA as u128);
            whole.merge(&m);
        }
        for (found, expected) in spread.errors(&power, &whole, 2).into_iter().zip([0.125, 0.0, 0.09375, 0.0]) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    /// Half of 128 replicates lie `d` half sides on one side of their mean, half as much on the other: the mean's error is d/√127, down to
    /// 1e-10 of it.
    #[test]
    fn places_that_are_nearly_equal_keep_their_error() {
        for bits in [20, 27, 33] {
            let (mut whole, mut spread, mut power) = (Moments::default(), MomentSpread::default(), Sum::default());
            for k in 0..128 {
                let (middle, d) = (1i128 << 81, 1i128 << (82 - bits));
                let x = if k % 2 == 0 { middle + d } else { middle - d };
                let first = [x, -x];
                let m = Moments { first, second: first.map(i128::unsigned_abs), farthest: 0 };
                spread.add_replicate(1 << 50, &m);
                power.add_replicate(1 << 50);
                whole.merge(&m);
            }
            let expected = 0.5f64.powi(bits) / 127f64.sqrt();
            for error in spread.errors(&power, &whole, 128) {
                assert!((error / expected - 1.0).abs() < 2e-3, "{bits}: {error} {expected}");
            }
        }
    }

    #[test]
    fn moments_of_two_points() {
        let mut m = Moments::default();
        m.add(QUANTA, [0.5, 0.0], 0.25);
        m.add(QUANTA, [-0.25, 0.25], 0.125);
        let [[x, xx], [y, yy]] = m.means(2 * QUANTA as u128);
        assert_eq!([x, xx, y, yy], [0.125, 0.15625, 0.125, 0.03125]);
        assert_eq!(m.farthest(), 0.5);
    }
}

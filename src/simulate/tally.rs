//! Order-free sums.
//!
//! The power of every path is a whole number of quanta, [`QUANTA`] to an average ray at the source, held in an `f64` (exact
//! below 2⁵³). Interfaces and mirrors divide it into whole numbers, so energy closes to the last quantum by construction,
//! and sums of whole numbers do not depend on order: any threads, batches or shards give the same bits.
//!
//! The run is divided into replicates, each with its own scramble of the sampling net. Errors are those of the mean over
//! replicates, which is honest for random numbers, nets and split rays alike (batch means; with 128 replicates the
//! error of the error is 6 %).

use crate::intersect::prefetch;
use serde::{Deserialize, Serialize};

/// Quanta of an average ray when it leaves its source: 9.1e-13 of a ray is the finest share of power.
pub const QUANTA: f64 = (1u64 << 40) as f64;

/// Squares are kept of numbers cut by this many bits, so that a replicate of 2³⁰ rays cannot overflow.
const CUT: u32 = 10;

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
/// [10u64, 14].iter().for_each(|n| sum.add_replicate(n << 20));
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
    pub fn add_replicate(&mut self, quanta: u64) {
        self.total += u128::from(quanta);
        // Saturating: of a replicate that overflows the error is wrong, not the run.
        self.squares = self.squares.saturating_add(u128::from(quanta >> CUT).pow(2));
    }

    /// Adds the sum of other replicates.
    pub fn merge(&mut self, o: &Self) {
        self.total += o.total;
        self.squares = self.squares.saturating_add(o.squares);
    }

    /// Returns the standard error of the total, in quanta, from the spread of `replicates` replicates; fewer than two count as two.
    pub fn error(&self, replicates: u32) -> f64 {
        let k = f64::from(replicates.max(2));
        let squares = self.squares as f64 * f64::from(1u32 << (2 * CUT));
        let total = self.total as f64;
        // The spread of replicates about their mean, and from it the error of the sum of all: k/(k − 1) for the
        // mean that was taken from the same numbers.
        ((squares - total * total / k).max(0.0) * k / (k - 1.0)).sqrt()
    }
}

/// Cells ahead of the one that is added whose memory is asked for.
const PREFETCH_AHEAD: usize = 16;

/// A grid of sums: many cells, most of them untouched in any one replicate.
#[derive(Clone, Debug, Default)]
pub(crate) struct Grid {
    cells: Vec<u64>,
    /// The cells that hold something, of which the first `count` mean something; as long as the cells and one more.
    touched: Vec<u32>,
    count: usize,
    /// What [`Self::add_deferred`] has still to add, and where.
    waiting: (usize, f64),
}

impl Grid {
    pub(crate) fn new(cells: usize) -> Self {
        Self { cells: vec![0; cells], touched: vec![0; cells + 1], count: 0, waiting: (0, 0.0) }
    }

    /// Adds quanta to a cell. Without a branch on whether it is empty: half the cells of a picture are, and to wait for the answer was 7 %
    /// of a run.
    #[inline]
    pub(crate) fn add(&mut self, cell: usize, quanta: f64) {
        let quanta = quanta_as_integer(quanta);
        let c = &mut self.cells[cell];
        self.touched[self.count] = cell as u32;
        // The place is written in any case and kept by the count, so that no branch has to be foretold.
        self.count += usize::from((*c == 0) & (quanta > 0));
        *c += quanta;
    }

    /// Adds quanta to a cell when the next ones come, and asks for its memory now: for a grid larger than the nearest cache. What waits is
    /// part of what [`Self::flush`] moves, not of what the others tell before [`Self::add_pending`]. To add at once was 10 % of the
    /// kernel's time.
    #[inline(always)]
    pub(crate) fn add_deferred(&mut self, cell: usize, quanta: f64) {
        prefetch(&self.cells, cell);
        let (earlier_cell, earlier_quanta) = std::mem::replace(&mut self.waiting, (cell, quanta));
        self.add(earlier_cell, earlier_quanta);
    }

    /// Goes through the cells that hold something, each once, with what they hold.
    pub(crate) fn touched(&self) -> impl Iterator<Item = (usize, u64)> {
        self.touched[..self.count].iter().map(|&c| (c as usize, self.cells[c as usize]))
    }

    pub(crate) fn get(&self, cell: usize) -> u64 {
        self.cells[cell]
    }

    /// Adds what [`Self::add_deferred`] has still to add.
    pub(crate) fn add_pending(&mut self) {
        if !self.cells.is_empty() {
            let (cell, quanta) = std::mem::take(&mut self.waiting);
            self.add(cell, quanta);
        }
    }

    /// Forgets what it holds and what waits, without adding it anywhere; costs what was touched, not what there is.
    pub(crate) fn clear(&mut self) {
        self.waiting = (0, 0.0);
        for &cell in &self.touched[..self.count] {
            self.cells[cell as usize] = 0;
        }
        self.count = 0;
    }

    /// Adds what the replicate gathered to the sums of the run, and empties the grid.
    pub(crate) fn flush(&mut self, sums: &mut [Sum]) {
        self.add_pending();
        let touched = &self.touched[..self.count];
        for (k, &cell) in touched.iter().enumerate() {
            // The sums of a picture of 200 × 200 cells take a megabyte.
            if let Some(&later) = touched.get(k + PREFETCH_AHEAD) {
                prefetch(sums, later as usize);
                prefetch(&self.cells, later as usize);
            }
            sums[cell as usize].add_replicate(std::mem::take(&mut self.cells[cell as usize]));
        }
        self.count = 0;
    }
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
/// from. Products of numbers cut to 51 and 59 bits, exact, so that these errors are order-free as well.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MomentSpread {
    /// For both coordinates of the first moments, then of the second: Σ m·p and Σ m² over replicates.
    pub products: [[i128; 2]; 4],
}

/// Bits that a moment is cut by: a coordinate's 32 and two more.
const CUT_MOMENT: u32 = 34;

impl MomentSpread {
    /// Adds what one whole replicate gathered: its power in quanta and its moments.
    pub fn add_replicate(&mut self, quanta: u64, m: &Moments) {
        let power = i128::from(quanta >> CUT);
        for (sums, moment) in self.products.iter_mut().zip(m.as_list()) {
            let moment = moment >> CUT_MOMENT;
            sums[0] = sums[0].saturating_add(moment * power);
            sums[1] = sums[1].saturating_add(moment.saturating_mul(moment));
        }
    }

    /// Adds the products of other replicates.
    pub fn merge(&mut self, o: &Self) {
        let pairs = self.products.iter_mut().flatten().zip(o.products.iter().flatten());
        pairs.for_each(|(a, b)| *a = a.saturating_add(*b));
    }

    /// Returns the standard errors of the two means, then of the two mean squares of [`Moments::means`], as ratios of sums over replicates.
    pub fn errors(&self, power: &Sum, m: &Moments, replicates: u32) -> [f64; 4] {
        let k = f64::from(replicates.max(2));
        let total = power.total.max(1) as f64;
        let unit = [f64::from(1u32 << CUT), 2f64.powi(CUT_MOMENT as i32) / GRAIN];
        let squares = power.squares as f64 * unit[0] * unit[0];
        let moments = m.as_list();
        std::array::from_fn(|i| {
            let mean = moments[i] as f64 / GRAIN / total;
            let [with_power, with_self] = self.products[i].map(|x| x as f64 * unit[1]);
            // First order in the fluctuations of a ratio (the delta method): the moment less the mean times the
            // power.
            let spread = with_self * unit[1] - 2.0 * mean * with_power * unit[0] + mean * mean * squares;
            (spread.max(0.0) * k / (k - 1.0)).sqrt() / total
        })
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

    #[test]
    fn quanta_are_the_nearest_whole_numbers() {
        for x in [0.5, 1.5, 2.5, 2.6, 1e9 + 0.75, 2f64.powi(51) - 0.25, 4.5e15] {
            assert_eq!([round_quanta(x), round_quanta(-x)], [x.round_ties_even(), -x.round_ties_even()]);
        }
    }

    #[test]
    fn what_waits_is_part_of_what_is_flushed() {
        let (mut grid, mut sums) = (Grid::new(3), vec![Sum::default(); 3]);
        for (cell, quanta) in [(2, 5.0), (0, 7.0), (2, 11.0)] {
            grid.add_deferred(cell, quanta);
        }
        grid.flush(&mut sums);
        assert_eq!([0, 1, 2].map(|k: usize| sums[k].total), [7, 0, 16]);
    }

    #[test]
    fn sums_do_not_depend_on_order() {
        let quanta: Vec<f64> = (0..1000u64).map(|i| (i * 7919 % 1009) as f64 * 1e9).collect();
        let run = |order: &mut dyn Iterator<Item = usize>| {
            let (mut grid, mut sums) = (Grid::new(7), vec![Sum::default(); 7]);
            order.for_each(|i| grid.add(i % 7, quanta[i]));
            grid.flush(&mut sums);
            sums
        };
        assert_eq!(run(&mut (0..1000)), run(&mut (0..1000).rev()));
    }

    /// Two replicates of equal power, at 0.5 and at 0.25: mean 0.375 ± 0.125, mean square 0.15625 ± 0.09375.
    #[test]
    fn errors_of_means_are_those_of_ratios() {
        let (mut whole, mut spread, mut power) = (Moments::default(), MomentSpread::default(), Sum::default());
        for x in [0.5, 0.25] {
            let mut m = Moments::default();
            m.add(QUANTA, [x, 0.0], x * x);
            spread.add_replicate(QUANTA as u64, &m);
            power.add_replicate(QUANTA as u64);
            whole.merge(&m);
        }
        for (found, expected) in spread.errors(&power, &whole, 2).into_iter().zip([0.125, 0.0, 0.09375, 0.0]) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
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

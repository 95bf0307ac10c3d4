//! Grids of sums within one replicate: the cells of a receiver, the faces of a model.

use super::tally::{Sum, quanta_as_integer};
use crate::intersect::prefetch;
use std::collections::BTreeMap;

/// A cell of a grid that reaches twice this many quanta hands so many over: it never holds 2⁶⁴, as no more are added at once, and never
/// nothing again.
const CARRIED: u64 = 1 << 62;

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
    /// How often cells handed [`CARRIED`] over: those that light passes thousands of times a ray.
    carried: BTreeMap<u32, u64>,
}

impl Grid {
    /// Makes a grid of so many empty cells.
    pub(crate) fn new(cells: usize) -> Self {
        Self { cells: vec![0; cells], touched: vec![0; cells + 1], count: 0, ..Self::default() }
    }

    /// Adds a whole number of quanta, from 0 to [`CARRIED`], to a cell. Panics for a cell beyond the grid.
    #[inline]
    pub(crate) fn add(&mut self, cell: usize, quanta: f64) {
        self.add_integer(cell, quanta_as_integer(quanta));
    }

    /// Adds at most [`CARRIED`] quanta to a cell.
    #[inline]
    pub(crate) fn add_integer(&mut self, cell: usize, quanta: u64) {
        debug_assert!(quanta <= CARRIED, "{quanta} quanta at once");
        let c = &mut self.cells[cell];
        self.touched[self.count] = cell as u32;
        // The place is written in any case and kept by the count. With a branch on whether the cell is empty, as half the cells of a
        // picture are, mispredictions took 7 % of a run.
        self.count += usize::from((*c == 0) & (quanta > 0));
        *c += quanta;
        if *c >= 2 * CARRIED {
            self.carry(cell);
        }
    }

    /// Hands a part of a cell over before a word is too small for it.
    #[cold]
    fn carry(&mut self, cell: usize) {
        self.cells[cell] -= CARRIED;
        *self.carried.entry(cell as u32).or_default() += 1;
    }

    /// Returns the quanta that a cell handed over.
    fn carried(&self, cell: usize) -> u128 {
        // Empty but for cavities: a look at its length is all that others pay.
        if self.carried.is_empty() {
            return 0;
        }
        self.carried.get(&(cell as u32)).map_or(0, |times| u128::from(*times) * u128::from(CARRIED))
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
    pub(crate) fn touched(&self) -> impl Iterator<Item = (usize, u128)> {
        self.touched[..self.count].iter().map(|&c| (c as usize, self.get(c as usize)))
    }

    /// Returns the quanta of a cell, without what [`Self::add_deferred`] has still to add.
    pub(crate) fn get(&self, cell: usize) -> u128 {
        u128::from(self.cells[cell]) + self.carried(cell)
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
        self.carried.clear();
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
            let carried = self.carried(cell as usize);
            let quanta = std::mem::take(&mut self.cells[cell as usize]);
            sums[cell as usize].add_replicate(u128::from(quanta) + carried);
        }
        self.count = 0;
        self.carried.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_waits_is_part_of_what_is_flushed() {
        let (mut grid, mut sums) = (Grid::new(3), vec![Sum::default(); 3]);
        for (cell, quanta) in [(2, 5.0), (0, 7.0), (2, 11.0)] {
            grid.add_deferred(cell, quanta);
        }
        grid.flush(&mut sums);
        assert_eq!([0, 1, 2].map(|k: usize| sums[k].total), [7, 0, 16]);
    }

    /// 2⁶⁶ quanta, of which words of 64 bits would know nothing, and all that is listed is listed once.
    #[test]
    fn a_cell_holds_more_than_a_word() {
        let (mut grid, mut sums) = (Grid::new(2), vec![Sum::default(); 2]);
        for _ in 0..1 << 14 {
            grid.add_deferred(1, (1u64 << 52) as f64);
        }
        grid.add_pending();
        assert_eq!(grid.touched().collect::<Vec<_>>(), [(1, 1 << 66)]);
        grid.flush(&mut sums);
        assert_eq!((sums[1].total, sums[1].squares), (1 << 66, 1 << 112));
        // What was handed over is not counted again.
        grid.add(1, 3.0);
        grid.flush(&mut sums);
        assert_eq!(sums[1].total, (1 << 66) + 3);
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
}

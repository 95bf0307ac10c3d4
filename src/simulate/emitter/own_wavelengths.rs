//! The wavelengths that the rays of a list have of their own, in memory that does not grow with the list.

use rustc_hash::{FxHashMap, FxHashSet};

/// Wavelengths that are kept apart; of more, one in each [`CELL_BITS`]-bit cell is.
const MOST_EXACT: usize = 1 << 16;

/// Bits of a wavelength's exponent and mantissa that give its cell: 4,096 cells to an octave, 0.13 nm at 550 nm, which is finer than any
/// index changes.
const CELL_BITS: u32 = 12 + 12;

/// A set of wavelengths, nm: exact up to some number, then thinned out, with both ends kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct OwnWavelengths {
    /// Their bits, as long as they are few.
    exact: FxHashSet<u64>,
    /// One of each cell.
    cells: FxHashMap<u64, f64>,
    range: Option<[f64; 2]>,
    last: f64,
}

impl OwnWavelengths {
    /// Adds a positive wavelength.
    pub(super) fn add(&mut self, nm: f64) {
        // Most lists have few, one after another.
        if self.range.is_some() && nm == self.last {
            return;
        }
        self.last = nm;
        self.range = Some(self.range.map_or([nm; 2], |[a, b]| [a.min(nm), b.max(nm)]));
        if self.cells.is_empty() {
            self.exact.insert(nm.to_bits());
            if self.exact.len() <= MOST_EXACT {
                return;
            }
            for bits in std::mem::take(&mut self.exact) {
                self.keep_in_cell(f64::from_bits(bits));
            }
        }
        self.keep_in_cell(nm);
    }

    /// Keeps the least wavelength of each cell, in whatever order they come.
    fn keep_in_cell(&mut self, nm: f64) {
        let kept = self.cells.entry(nm.to_bits() >> (64 - CELL_BITS)).or_insert(nm);
        *kept = kept.min(nm);
    }

    /// Returns the least and the greatest; `None` without any.
    pub(crate) fn range(&self) -> Option<[f64; 2]> {
        self.range
    }

    /// Returns them ascending, each once; of very many those that were kept.
    pub(crate) fn ascending(&self) -> Vec<f64> {
        let exact = self.exact.iter().map(|bits| f64::from_bits(*bits));
        let mut all: Vec<f64> =
            exact.chain(self.cells.values().copied()).chain(self.range.into_iter().flatten()).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_are_kept_as_they_are_and_of_many_one_in_each_cell() {
        let mut few = OwnWavelengths::default();
        [550.0, 450.0, 550.0, 450.0].iter().for_each(|nm| few.add(*nm));
        assert_eq!((few.ascending(), few.range()), (vec![450.0, 550.0], Some([450.0, 550.0])));
        assert!(OwnWavelengths::default().ascending().is_empty());

        let mut many = OwnWavelengths::default();
        (0..200_000).rev().for_each(|k| many.add(400.0 + f64::from(k) * 1e-3));
        let kept = many.ascending();
        assert!((kept[0], kept[kept.len() - 1]) == (400.0, 400.0 + 199_999.0 * 1e-3), "{:?}", many.range());
        assert!(kept.len() < 5000, "{}", kept.len());
        // No gap: a cell of an octave from 512 nm on is 512/4096 nm wide.
        assert!(kept.windows(2).all(|w| w[1] - w[0] <= 0.126));
    }
}

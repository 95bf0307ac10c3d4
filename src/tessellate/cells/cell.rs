//! Rectangles of the parameter plane, and those that are proved as facets.

use crate::math::{Point, Uv};

/// A rectangle `[lo, hi]` of the parameter plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::tessellate) struct Cell {
    pub(in crate::tessellate) lo: Uv,
    pub(in crate::tessellate) hi: Uv,
}

impl Cell {
    /// Returns the corners counter-clockwise from `lo`.
    pub(in crate::tessellate) fn corners(&self) -> [Uv; 4] {
        [self.lo, Uv::new(self.hi.x, self.lo.y), self.hi, Uv::new(self.lo.x, self.hi.y)]
    }

    /// Returns the place on side `side`, which begins at that one of [`Self::corners`], where the parameter that changes along it is `at`;
    /// the other is the side's own to the bit.
    pub(in crate::tessellate) fn on_side(&self, side: usize, at: f64) -> Uv {
        let mut uv = self.corners()[side];
        uv[side % 2] = at;
        uv
    }

    pub(in crate::tessellate) fn center(&self) -> Uv {
        0.5 * (self.lo + self.hi)
    }
}

/// A cell that is proved as a facet.
#[derive(Clone, Copy, Debug)]
pub(in crate::tessellate) struct ProvedCell {
    pub(in crate::tessellate) cell: Cell,
    /// Proved distance between facet and surface, mm, at most `slack` times the tolerance.
    pub(in crate::tessellate) bound: f64,
    /// The tightest tolerance at its corners and middle, mm.
    pub(in crate::tessellate) tolerance: f64,
    /// The multiple of the tolerance that it was held to: 1, more once the budget has ended.
    pub(in crate::tessellate) slack: f64,
    /// The corner at which the traced diagonal starts: 0 or 1.
    pub(in crate::tessellate) first: usize,
    /// The surface at [`Cell::corners`], in the part's coordinates.
    pub(in crate::tessellate) places: [Point; 4],
}

/// Cells of a face after division by the tree.
#[derive(Default)]
pub(in crate::tessellate) struct Subdivision {
    /// Wholly inside, not cut by the border, and proved.
    pub(in crate::tessellate) inside: Vec<ProvedCell>,
    /// Those that the border cuts or comes near to.
    pub(in crate::tessellate) border: Vec<Cell>,
    /// Whether splitting ended before all cells fitted.
    pub(in crate::tessellate) exhausted: bool,
    /// Whether it did so because a branch had used up its share of the budget.
    pub(super) out_of_share: bool,
}

impl Subdivision {
    /// Returns how many cells there are.
    pub(super) fn len(&self) -> usize {
        self.inside.len() + self.border.len()
    }

    /// Adds the cells of another branch to these; either branch's flags count for both.
    pub(super) fn append(&mut self, other: Self) {
        self.inside.extend(other.inside);
        self.border.extend(other.border);
        self.exhausted |= other.exhausted;
        self.out_of_share |= other.out_of_share;
    }
}

/// Share of a face's extent within which parameters are one: trims that were fitted to the surface meet its parameter lines no better.
const SAME_PARAMETER: f64 = 1e-7;

/// Returns how near parameters are one, in u and v, for a face that spans the box from `lo` to `hi`.
pub(in crate::tessellate) fn parameter_resolution(lo: Uv, hi: Uv) -> Uv {
    SAME_PARAMETER * (hi - lo)
}

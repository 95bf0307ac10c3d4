//! Packing the facets of a leaf cell into blocks of four: object splits by the surface-area heuristic, exact sweeps.

use super::cell::{Cell, ClippedFacet, Content, bounds};
use super::clip::Box32;
use std::ops::Range;

/// Facets in a block.
const WIDTH: usize = 4;
/// From here down halves are equal, so that the depth stays logarithmic whatever the facets are.
const BALANCED_FROM: u32 = 12;

/// Facets to be packed, by their places in one slice, with room to work in.
struct Packing<'a> {
    facets: &'a [ClippedFacet],
    /// Places of facets, for each axis in the order of their middles; the same places in each stretch that is being packed. Sorted once:
    /// sorting anew in each half took a third of the build.
    orders: [Vec<u32>; 3],
    /// By place: whether the facet goes left.
    goes_left: Vec<bool>,
    /// By place in a range: half the area of the box around it and all behind it.
    areas: Vec<f32>,
    /// Room for the places that go right.
    spare: Vec<u32>,
}

/// Packs facets into blocks of up to four under binary cells; `facets` must not be empty.
pub(super) fn pack(facets: Vec<ClippedFacet>) -> Cell {
    let n = facets.len();
    if n <= WIDTH {
        return block_cell(bounds(&facets), facets.iter());
    }
    let mut packing = Packing {
        facets: &facets,
        orders: std::array::from_fn(|axis| places_by_middle(&facets, axis)),
        goes_left: vec![false; n],
        areas: vec![0.0; n],
        spare: vec![0; n],
    };
    packing.pack(0..n, 0)
}

/// Lists the places of facets in the order of their middles along an axis; equal ones keep the order of the facets.
fn places_by_middle(facets: &[ClippedFacet], axis: usize) -> Vec<u32> {
    let mut keys: Vec<u64> = (facets.iter().enumerate())
        .map(|(place, p)| {
            let bits = (p.bounds.low[axis] + p.bounds.high[axis]).to_bits();
            // As integers in the order of the numbers.
            let ordered = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
            u64::from(ordered) << 32 | place as u64
        })
        .collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| key as u32).collect()
}

/// A cell with one block of one to four facets; lanes that are left name none.
fn block_cell<'a>(bounds: Box32, facets: impl ExactSizeIterator<Item = &'a ClippedFacet>) -> Cell {
    let count = facets.len() as u8;
    let mut lanes = [u32::MAX; WIDTH];
    for (lane, clipped) in lanes.iter_mut().zip(facets) {
        *lane = clipped.facet;
    }
    Cell { bounds, content: Content::Block(count, lanes) }
}

/// Blocks that `n` facets fill.
fn block_count(n: usize) -> f32 {
    n.div_ceil(WIDTH) as f32
}

impl Packing<'_> {
    /// Splits the facets of a range in two until a block holds what is left; `depth` counts the splits above.
    fn pack(&mut self, range: Range<usize>, depth: u32) -> Cell {
        let mut bounds = Box32::EMPTY;
        for &place in &self.orders[0][range.clone()] {
            bounds.union(&self.facets[place as usize].bounds);
        }
        if range.len() <= WIDTH {
            let places = &self.orders[0][range];
            return block_cell(bounds, places.iter().map(|&place| &self.facets[place as usize]));
        }
        let (axis, left) = if depth >= BALANCED_FROM {
            let widest = (0..3).fold(0, |w, a| if extent(&bounds, a) > extent(&bounds, w) { a } else { w });
            (widest, range.len() / 2)
        } else {
            self.best_split(range.clone())
        };
        self.partition_orders(range.clone(), axis, left);
        let middle = range.start + left;
        let halves = vec![self.pack(range.start..middle, depth + 1), self.pack(middle..range.end, depth + 1)];
        Cell::of_cells(bounds, halves)
    }

    /// Moves the first `left` places of a range along `axis` to the front of it in the other orders too; each half keeps its order.
    fn partition_orders(&mut self, range: Range<usize>, axis: usize, left: usize) {
        for (k, &place) in self.orders[axis][range.clone()].iter().enumerate() {
            self.goes_left[place as usize] = k < left;
        }
        for other in (0..3).filter(|&a| a != axis) {
            let order = &mut self.orders[other][range.clone()];
            let (mut first, mut second) = (0, 0);
            for k in 0..order.len() {
                let place = order[k];
                let goes_left = self.goes_left[place as usize];
                // Both are written and one is kept: no branch on what cannot be foretold. What is overwritten was read before.
                order[first] = place;
                self.spare[second] = place;
                first += usize::from(goes_left);
                second += usize::from(!goes_left);
            }
            order[first..].copy_from_slice(&self.spare[..second]);
        }
    }

    /// The axis along which a range is best split by the surface-area heuristic, and the number of facets that go left.
    fn best_split(&mut self, range: Range<usize>) -> (usize, usize) {
        let n = range.len();
        let mut best = (f32::INFINITY, 2, n / 2);
        for axis in 0..3 {
            let order = &self.orders[axis][range.clone()];
            let areas = &mut self.areas[..n];
            let mut right = Box32::EMPTY;
            for (area, &place) in areas.iter_mut().zip(order).rev() {
                right.union(&self.facets[place as usize].bounds);
                *area = right.half_area();
            }
            let mut left = Box32::EMPTY;
            for i in 1..n {
                left.union(&self.facets[order[i - 1] as usize].bounds);
                let cost = left.half_area() * block_count(i) + areas[i] * block_count(n - i);
                if cost < best.0 {
                    best = (cost, axis, i);
                }
            }
        }
        (best.1, best.2)
    }
}

/// Length of a box along an axis, mm.
fn extent(b: &Box32, axis: usize) -> f32 {
    b.high[axis] - b.low[axis]
}

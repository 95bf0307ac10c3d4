//! Packing the facets of a leaf cell into blocks of four: object splits by the surface-area heuristic, exact sweeps.

use super::cell::{Cell, ClippedFacet, Content, bounds};
use super::clip::Box32;

/// Facets in a block.
const WIDTH: usize = 4;
/// From here down halves are equal, so that the depth stays logarithmic whatever the facets are.
const BALANCED_FROM: u32 = 12;

/// Room to work in, as long as the facets at hand.
struct Workspace {
    areas: Vec<f32>,
    /// For each axis the middles of the facets, ordered as integers, with the place of the facet below: sorting whole
    /// facets took a third of the build.
    keys: [Vec<u64>; 3],
    facets: Vec<ClippedFacet>,
}

/// A tree of blocks over the facets.
pub(super) fn pack(mut facets: Vec<ClippedFacet>) -> Cell {
    let n = facets.len();
    let mut workspace =
        Workspace { areas: vec![0.0; n], keys: std::array::from_fn(|_| vec![0; n]), facets: facets.clone() };
    pack_slice(&mut facets, &mut workspace, 0)
}

impl Workspace {
    /// Sorts the keys of an axis; equal middles keep the order of the facets.
    fn sort(&mut self, facets: &[ClippedFacet], axis: usize) -> &[u64] {
        let keys = &mut self.keys[axis][..facets.len()];
        for (place, (key, p)) in keys.iter_mut().zip(facets).enumerate() {
            let bits = (p.bounds.low[axis] + p.bounds.high[axis]).to_bits();
            let ordered = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
            *key = u64::from(ordered) << 32 | place as u64;
        }
        keys.sort_unstable();
        keys
    }

    /// Puts the facets into the order of the sorted keys of an axis.
    fn reorder(&mut self, facets: &mut [ClippedFacet], axis: usize) {
        let copy = &mut self.facets[..facets.len()];
        copy.copy_from_slice(facets);
        for (facet, key) in facets.iter_mut().zip(&self.keys[axis]) {
            *facet = copy[key_place(*key)];
        }
    }
}

fn key_place(key: u64) -> usize {
    (key & 0xFFFF_FFFF) as usize
}

fn block_count(n: usize) -> f32 {
    n.div_ceil(WIDTH) as f32
}

fn pack_slice(facets: &mut [ClippedFacet], workspace: &mut Workspace, depth: u32) -> Cell {
    let n = facets.len();
    let bounds = bounds(facets);
    if n <= WIDTH {
        let mut lanes = [u32::MAX; WIDTH];
        for (lane, clipped) in lanes.iter_mut().zip(facets.iter()) {
            *lane = clipped.facet;
        }
        return Cell { bounds, content: Content::Block(n as u8, lanes) };
    }
    let middle = if depth >= BALANCED_FROM {
        let widest = (0..3).fold(0, |w, a| if extent(&bounds, a) > extent(&bounds, w) { a } else { w });
        workspace.sort(facets, widest);
        workspace.reorder(facets, widest);
        n / 2
    } else {
        best_split(facets, workspace)
    };
    let (left, right) = facets.split_at_mut(middle);
    let halves = vec![pack_slice(left, workspace, depth + 1), pack_slice(right, workspace, depth + 1)];
    Cell { bounds, content: Content::Cells(halves) }
}

fn extent(b: &Box32, axis: usize) -> f32 {
    b.high[axis] - b.low[axis]
}

/// Sorts the facets along the best axis and gives the number that go left.
fn best_split(facets: &mut [ClippedFacet], workspace: &mut Workspace) -> usize {
    let n = facets.len();
    let mut best = (f32::INFINITY, 2, n / 2);
    for axis in 0..3 {
        workspace.sort(facets, axis);
        let keys = &workspace.keys[axis][..n];
        let mut right = Box32::EMPTY;
        for (area, key) in workspace.areas[..n].iter_mut().zip(keys).rev() {
            right.union(&facets[key_place(*key)].bounds);
            *area = right.half_area();
        }
        let mut left = Box32::EMPTY;
        for i in 1..n {
            left.union(&facets[key_place(keys[i - 1])].bounds);
            let cost = left.half_area() * block_count(i) + workspace.areas[i] * block_count(n - i);
            if cost < best.0 {
                best = (cost, axis, i);
            }
        }
    }
    workspace.reorder(facets, best.1);
    best.2
}

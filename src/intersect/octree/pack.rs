//! Packing the facets of a leaf cell into blocks of four: object splits by the surface-area heuristic, exact sweeps.

use super::build::{Cell, Content, Part, bounds};
use super::clip::Box32;

/// Facets in a block.
const WIDTH: usize = 4;
/// From here down halves are equal, so that the depth stays logarithmic whatever the facets are.
const BALANCED_FROM: u32 = 12;

/// A tree of blocks over the parts.
pub(super) fn pack(mut parts: Vec<Part>) -> Cell {
    let mut areas = vec![0.0; parts.len()];
    pack_slice(&mut parts, &mut areas, 0)
}

fn middle(p: &Part, axis: usize) -> f32 {
    p.bounds.low[axis] + p.bounds.high[axis]
}

fn sort(parts: &mut [Part], axis: usize) {
    parts.sort_unstable_by(|p, q| middle(p, axis).total_cmp(&middle(q, axis)).then(p.facet.cmp(&q.facet)));
}

fn blocks(n: usize) -> f32 {
    n.div_ceil(WIDTH) as f32
}

fn pack_slice(parts: &mut [Part], areas: &mut [f32], depth: u32) -> Cell {
    let n = parts.len();
    let bounds = bounds(parts);
    if n <= WIDTH {
        let mut facets = [u32::MAX; WIDTH];
        for (slot, part) in facets.iter_mut().zip(parts.iter()) {
            *slot = part.facet;
        }
        return Cell { bounds, content: Content::Block(n as u8, facets) };
    }
    let at = if depth >= BALANCED_FROM {
        let widest = (0..3).fold(0, |w, a| if extent(&bounds, a) > extent(&bounds, w) { a } else { w });
        sort(parts, widest);
        n / 2
    } else {
        best_split(parts, areas)
    };
    let (left, right) = parts.split_at_mut(at);
    let (left_areas, right_areas) = areas.split_at_mut(at);
    let halves = vec![pack_slice(left, left_areas, depth + 1), pack_slice(right, right_areas, depth + 1)];
    Cell { bounds, content: Content::Cells(halves) }
}

fn extent(b: &Box32, axis: usize) -> f32 {
    b.high[axis] - b.low[axis]
}

/// Sorts the parts along the best axis and gives the number that go left.
fn best_split(parts: &mut [Part], areas: &mut [f32]) -> usize {
    let n = parts.len();
    let mut best = (f32::INFINITY, 2, n / 2);
    for axis in 0..3 {
        sort(parts, axis);
        let mut right = Box32::EMPTY;
        for i in (0..n).rev() {
            right.union(&parts[i].bounds);
            areas[i] = right.half_area();
        }
        let mut left = Box32::EMPTY;
        for i in 1..n {
            left.union(&parts[i - 1].bounds);
            let cost = left.half_area() * blocks(i) + areas[i] * blocks(n - i);
            if cost < best.0 {
                best = (cost, axis, i);
            }
        }
    }
    if best.1 != 2 {
        sort(parts, best.1);
    }
    best.2
}

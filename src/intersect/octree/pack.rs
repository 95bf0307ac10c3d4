//! Packing the facets of a leaf cell into blocks of four: object splits by the surface-area heuristic, exact sweeps.

use super::build::{Cell, Content, Part, bounds};
use super::clip::Box32;

/// Facets in a block.
const WIDTH: usize = 4;
/// From here down halves are equal, so that the depth stays logarithmic whatever the facets are.
const BALANCED_FROM: u32 = 12;

/// Room to work in, as long as the parts at hand.
struct Desk {
    areas: Vec<f32>,
    /// For each axis the middles of the parts, ordered as integers, with the place of the part below: sorting whole
    /// parts took a third of the build.
    keys: [Vec<u64>; 3],
    parts: Vec<Part>,
}

/// A tree of blocks over the parts.
pub(super) fn pack(mut parts: Vec<Part>) -> Cell {
    let n = parts.len();
    let mut desk = Desk { areas: vec![0.0; n], keys: std::array::from_fn(|_| vec![0; n]), parts: parts.clone() };
    pack_slice(&mut parts, &mut desk, 0)
}

impl Desk {
    /// Sorts the keys of an axis; equal middles keep the order of the parts.
    fn sort(&mut self, parts: &[Part], axis: usize) -> &[u64] {
        let keys = &mut self.keys[axis][..parts.len()];
        for (place, (key, p)) in keys.iter_mut().zip(parts).enumerate() {
            let bits = (p.bounds.low[axis] + p.bounds.high[axis]).to_bits();
            let ordered = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
            *key = u64::from(ordered) << 32 | place as u64;
        }
        keys.sort_unstable();
        keys
    }

    /// Puts the parts into the order of the sorted keys of an axis.
    fn arrange(&mut self, parts: &mut [Part], axis: usize) {
        let copy = &mut self.parts[..parts.len()];
        copy.copy_from_slice(parts);
        for (part, key) in parts.iter_mut().zip(&self.keys[axis]) {
            *part = copy[place(*key)];
        }
    }
}

fn place(key: u64) -> usize {
    (key & 0xFFFF_FFFF) as usize
}

fn blocks(n: usize) -> f32 {
    n.div_ceil(WIDTH) as f32
}

fn pack_slice(parts: &mut [Part], desk: &mut Desk, depth: u32) -> Cell {
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
        desk.sort(parts, widest);
        desk.arrange(parts, widest);
        n / 2
    } else {
        best_split(parts, desk)
    };
    let (left, right) = parts.split_at_mut(at);
    let halves = vec![pack_slice(left, desk, depth + 1), pack_slice(right, desk, depth + 1)];
    Cell { bounds, content: Content::Cells(halves) }
}

fn extent(b: &Box32, axis: usize) -> f32 {
    b.high[axis] - b.low[axis]
}

/// Sorts the parts along the best axis and gives the number that go left.
fn best_split(parts: &mut [Part], desk: &mut Desk) -> usize {
    let n = parts.len();
    let mut best = (f32::INFINITY, 2, n / 2);
    for axis in 0..3 {
        desk.sort(parts, axis);
        let keys = &desk.keys[axis][..n];
        let mut right = Box32::EMPTY;
        for (area, key) in desk.areas[..n].iter_mut().zip(keys).rev() {
            right.union(&parts[place(*key)].bounds);
            *area = right.half_area();
        }
        let mut left = Box32::EMPTY;
        for i in 1..n {
            left.union(&parts[place(keys[i - 1])].bounds);
            let cost = left.half_area() * blocks(i) + desk.areas[i] * blocks(n - i);
            if cost < best.0 {
                best = (cost, axis, i);
            }
        }
    }
    desk.arrange(parts, best.1);
    best.2
}

//! Two facets of a map asked at once.
//!
//! A square holds two facets where the map is not divided further, and which of them is met is a matter of chance: asked one after
//! the other, what the processor guesses wrong costs more than the test of the second. The arithmetic is that of [`Line::quad`], step by
//! step, so that the hits are the same; where an edge function is zero that decides.

use super::Slot;
use crate::intersect::facet::{Line, Nearest};
use crate::intersect::octree::engine::Lanes;
use std::hint::select_unpredictable;

/// Corners of a facet, axis by axis in the order of the ray's.
pub(in crate::intersect::octree) type Corners = [[f64; 4]; 3];

/// Edge functions of two facets, four numbers for each.
#[derive(Default)]
#[repr(C, align(64))]
pub(in crate::intersect::octree) struct Edges {
    /// From each corner to the one before.
    pub(in crate::intersect::octree) outline: [f64; 8],
    /// The same four times.
    pub(in crate::intersect::octree) diagonal: [f64; 8],
    /// Of the corners, along the main axis.
    pub(in crate::intersect::octree) heights: [f64; 8],
    /// One bit for each that is negative, of the outline and of the diagonal; then for each that is positive.
    pub(in crate::intersect::octree) below: [u8; 2],
    pub(in crate::intersect::octree) above: [u8; 2],
}

impl Edges {
    /// In plain Rust.
    #[inline(always)]
    pub(in crate::intersect::octree) fn set(&mut self, corners: [&Corners; 2], line: &Line) {
        let ([ox, oy, oz], [sx, sy, _]) = (line.origin, line.shear);
        (self.below, self.above) = ([0; 2], [0; 2]);
        for (facet, c) in corners.into_iter().enumerate() {
            let (mut x, mut y) = ([0.0; 4], [0.0; 4]);
            for k in 0..4 {
                let z = c[2][k] - oz;
                x[k] = (c[0][k] - ox) - sx * z;
                y[k] = (c[1][k] - oy) - sy * z;
                self.heights[4 * facet + k] = z;
            }
            let diagonal = x[0] * y[2] - y[0] * x[2];
            for k in 0..4 {
                let (next, lane) = ((k + 1) % 4, 4 * facet + k);
                let edge = x[next] * y[k] - y[next] * x[k];
                self.outline[lane] = edge;
                self.diagonal[lane] = diagonal;
                self.below[0] |= u8::from(edge < 0.0) << lane;
                self.above[0] |= u8::from(edge > 0.0) << lane;
                self.below[1] |= u8::from(diagonal < 0.0) << lane;
                self.above[1] |= u8::from(diagonal > 0.0) << lane;
            }
        }
    }
}

/// Tests two facets, or one if there is no other, and keeps the nearest hit. Bits of triangles are two apart, as their sides are.
#[inline(always)]
pub(super) fn test<L: Lanes>(
    first: &Slot,
    other: Option<&Slot>,
    line: &Line,
    edges: &mut Edges,
    best: &mut Nearest,
) {
    let second = other.unwrap_or(first);
    let there = first.sides() | select_unpredictable(other.is_some(), second.sides() << 4, 0);
    L::edges([&first.corners, &second.corners], line, edges);
    let sides = |outline: u8, diagonal: u8, against: u8| {
        (outline | outline >> 1) & 0x55 | (diagonal & 0x11) | (against & 0x44)
    };
    let ([below, left], [above, right]) = (edges.below, edges.above);
    if sides(!(below | above), !(left | right), !(left | right)) & there != 0 {
        first.test(line, best);
        if let Some(second) = other {
            second.test(line, best);
        }
        return;
    }
    let mut met = !(sides(below, left, right) & sides(above, right, left)) & there;
    while met != 0 {
        let bit = met.trailing_zeros() as usize;
        met &= met - 1;
        let (at, latter) = (bit & 4, bit & 2 != 0);
        let shift = at + usize::from(latter);
        let diagonal = edges.diagonal[at];
        let sides = [
            edges.outline[shift + 1],
            select_unpredictable(latter, edges.outline[at + 3], diagonal),
            select_unpredictable(latter, -diagonal, edges.outline[at]),
        ];
        let heights = [edges.heights[at], edges.heights[shift + 1], edges.heights[shift + 2]];
        let facet = select_unpredictable(at == 0, first.facet, second.facet);
        line.keep(facet, latter, sides, heights, best);
    }
}

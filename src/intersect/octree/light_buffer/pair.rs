//! Two facets of a light buffer tested at once.
//!
//! A square holds two facets where the buffer is not divided further, and which of them is met is a matter of chance: tested one after
//! the other, what the processor guesses wrong costs more than the test of the second. The arithmetic is that of [`Line::test_quad`], step
//! by step, so that the hits are the same; where an edge function is zero that decides.

use super::buffer_facet::BufferFacet;
use crate::intersect::facet::{Line, Nearest};
use crate::intersect::octree::facet_pair::Edges;
use crate::intersect::octree::lanes::Lanes;
use std::hint::select_unpredictable;

/// Tests all triangles of two facets, or of `first` alone, against a line and offers every hit to `best`, which keeps the nearest; `edges`
/// is overwritten. Where an edge function is zero both facets are tested one by one, as the walk does it.
#[inline(always)]
pub(super) fn test_facet_pair<L: Lanes>(
    first: &BufferFacet,
    other: Option<&BufferFacet>,
    line: &Line,
    edges: &mut Edges,
    best: &mut Nearest,
) {
    // A missing other repeats the first, and its bits are not present.
    let second = other.unwrap_or(first);
    // Bits of triangles are two apart, as their sides are.
    let present = first.triangle_bits() | select_unpredictable(other.is_some(), second.triangle_bits() << 4, 0);
    L::pair_edges([&first.corners, &second.corners], line, edges);
    // Of each triangle: two edges of the outline, and the diagonal from this side or from the other.
    let sides = |outline: u8, diagonal: u8, against: u8| {
        (outline | outline >> 1) & 0x55 | (diagonal & 0x11) | (against & 0x44)
    };
    let ([below, left], [above, right]) = (edges.below, edges.above);
    // An edge function of zero decides nothing by its sign; the careful test breaks the tie as the walk does.
    if sides(!(below | above), !(left | right), !(left | right)) & present != 0 {
        first.test(line, best);
        if let Some(second) = other {
            second.test(line, best);
        }
        return;
    }
    // A triangle is missed where edge functions of both signs occur.
    let mut met = !(sides(below, left, right) & sides(above, right, left)) & present;
    while met != 0 {
        let bit = met.trailing_zeros() as usize;
        met &= met - 1;
        let lane = bit & 4;
        let latter = bit & 2 != 0;
        let shift = lane + usize::from(latter);
        let diagonal = edges.diagonal[lane];
        let sides = [
            edges.outline[shift + 1],
            select_unpredictable(latter, edges.outline[lane + 3], diagonal),
            select_unpredictable(latter, -diagonal, edges.outline[lane]),
        ];
        let heights = [edges.heights[lane], edges.heights[shift + 1], edges.heights[shift + 2]];
        let facet = select_unpredictable(lane == 0, first.facet, second.facet);
        line.keep(facet, latter, sides, heights, best);
    }
}

//! What the walk of a ray alone and that of a batch do alike.

use super::lanes::Lanes;
use super::node::{Block, Link, Node};
use super::ray::SieveLimits;
use super::ray_state::RayState;
use super::tree::Tree;
use crate::intersect::prefetch::prefetch_lines;
use crate::math::Point;

/// The arrays of a tree. Read once for many rays: that writing the state of a ray leaves where they lie as it was is more than a
/// compiler can infer.
#[derive(Clone, Copy)]
pub(super) struct Arrays<'t> {
    pub(super) nodes: &'t [Node],
    pub(super) blocks: &'t [Block],
    pub(super) positions: &'t [Point],
    /// Where the nodes or blocks begin that a link leads to, by its kind; at the end of a ray any.
    starts: [*const u8; 4],
}

impl<'t> Arrays<'t> {
    #[inline(always)]
    pub(super) fn new(tree: &'t Tree) -> Self {
        let (nodes, blocks) = (tree.nodes.as_ptr().cast(), tree.blocks.as_ptr().cast());
        Self {
            nodes: &tree.nodes,
            blocks: &tree.blocks,
            positions: &tree.surroundings.mesh.positions,
            starts: [nodes, nodes, blocks, nodes],
        }
    }
}

/// Returns the triangles of a block of `count` facets that the ray may meet, bits as in [`Lanes::sift`], without those of the facet that it
/// leaves and is known not to meet.
#[inline(always)]
pub(super) fn sift<L: Lanes, const STACK: usize>(
    block: &Block,
    count: usize,
    s: &RayState<STACK>,
    limits: &SieveLimits,
) -> u32 {
    L::sift(block, &s.sieve, limits, s.unmet_facet) & used_lanes(count)
}

/// The bits of both triangles of the first `count` lanes of a block.
#[inline(always)]
fn used_lanes(count: usize) -> u32 {
    ((1 << count) - 1) * 0x11
}

/// Prefetches the memory of a node or block, three lines of the cache each; at the end for the first node.
#[inline(always)]
pub(super) fn prefetch_step(arrays: &Arrays, link: Link) {
    const { assert!(size_of::<Node>() == size_of::<Block>(), "one stride for both") };
    let start = arrays.starts[link.kind()].wrapping_add(link.index() * size_of::<Node>());
    prefetch_lines::<{ size_of::<Node>() / 64 }>(start);
}

/// Tests a facet by [`crate::intersect::facet::FacetRay::test`], where more than the signs of its edge functions decides.
#[cold]
#[inline(never)]
pub(super) fn test_with_care<const STACK: usize>(
    tree: &Tree,
    s: &mut RayState<STACK>,
    facet: u32,
    triangles: u32,
    corners: [&Point; 4],
) {
    s.facets.test(facet, triangles, corners, &tree.surroundings, &mut s.best);
}

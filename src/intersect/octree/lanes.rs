//! What the walk does eight or sixteen lanes at a time, to be written once for each instruction set.

use super::facet_pair::{Corners, Edges};
use super::mesh_box::MeshBox;
use super::node::{Block, Node};
use super::quad_edges::QuadEdges;
use super::ray::{BoxRay, Entry, SieveLimits, SieveRay};
use super::ray_start;
use crate::intersect::facet::{FacetRay, Line};
use crate::math::Ray;

/// What is done eight at a time. Implementations may round differently: boxes and sieve keep more than needed.
pub(super) trait Lanes {
    /// As [`ray_start::start`].
    #[inline(always)]
    fn start(ray: &Ray, mesh_box: &MeshBox, slack: f64, boxes: &mut BoxRay, sieve: &mut SieveRay) -> Option<f64> {
        ray_start::start(ray, mesh_box, slack, boxes, sieve)
    }
    /// Overwrites `entry` with what [`Self::enter`] needs to know of a ray at a node.
    #[inline(always)]
    fn prepare<'t>(entry: &mut Entry<'t>, node: &'t Node, ray: &BoxRay) {
        entry.prepare(node, ray);
    }
    /// Writes where the ray enters the children that it may meet within its range, and their links, mostly the farthest first; what lies
    /// beyond their number is of no meaning. Returns which they are, 0 for none: bit `k` for the child in slot `15 ^ k ^ entry.order`.
    fn enter(entry: &Entry, ray: &BoxRay, enters: &mut [f32; 16], links: &mut [u32; 16]) -> u32;
    /// Returns where a ray is against a block and how wrong its sieve may be; [`Self::sift`] is given it.
    #[inline(always)]
    fn sieve_limits(block: &Block, ray: &SieveRay, boxes: &BoxRay) -> SieveLimits {
        SieveLimits::new(block, ray, boxes)
    }
    /// Returns which triangles of the block the ray may meet: bits 0–3 the first ones of its facets, 4–7 the second; without those of the
    /// facet `unmet`. Lanes without a facet have any bit.
    fn sift(block: &Block, ray: &SieveRay, limits: &SieveLimits, unmet: u32) -> u32;
    /// Overwrites `edges` with the edge functions of two facets; every implementation gives the same bits.
    #[inline(always)]
    fn pair_edges(corners: [&Corners; 2], line: &Line, edges: &mut Edges) {
        edges.compute(corners, line);
    }
    /// Computes the edge functions of a facet with these corners, mm, as [`QuadEdges::new`]; every implementation gives the same bits.
    #[inline(always)]
    fn quad_edges(corners: [&[f64; 3]; 4], ray: &FacetRay, reach: f64) -> QuadEdges {
        QuadEdges::new(corners, ray, reach)
    }
    /// Returns which distances do not lie beyond `t_max`, one bit each; lower ones than the highest may be left out.
    fn open(enters: &[f32; 16], t_max: f32) -> u32;
}

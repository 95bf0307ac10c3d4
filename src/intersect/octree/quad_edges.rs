//! The f64 edge functions of one facet, for the exact test of what the sieve left: the arithmetic of
//! [`crate::intersect::line::Line::test_quad`] step by step, so that all instruction sets have its bits, but without the branches and the
//! copies that cost more than the arithmetic.

use crate::intersect::facet::{FacetRay, LONGEST_NUDGE, Nearest};
use std::hint::select_unpredictable;

/// The size, mm², above which an edge function of a facet whose farthest corner lies so far from the start along an axis, mm, keeps its
/// sign when the start is moved as [`LONGEST_NUDGE`] allows for this reach of starts, mm.
///
/// A move of `δ` an axis shears to `2δ`, since no slope is above one, and changes an edge function by at most that times the sum of
/// what its corners differ by in both sheared coordinates: each is below four times the farthest corner's distance from the start
/// along an axis. The sum is doubled, for the rounding and the reach of the start.
#[inline(always)]
pub(super) fn margin(farthest: f64, reach: f64) -> f64 {
    2.0 * 2.0 * LONGEST_NUDGE * reach * (2.0 * 4.0 * farthest)
}

/// Edge functions of the two triangles of a facet.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub(super) struct QuadEdges {
    /// From each corner to the one before.
    pub(super) outline: [f64; 4],
    /// Of the corners, along the main axis.
    pub(super) heights: [f64; 4],
    /// From the third corner to the first.
    pub(super) diagonal: f64,
    /// One bit for each edge function of the outline that is negative, and for each that is positive.
    pub(super) below: u32,
    pub(super) above: u32,
    /// Whether the facet is near the start of the ray.
    pub(super) near: bool,
}

impl QuadEdges {
    /// Computes the edge functions of a facet with these corners, mm in the order of x, y, z, in plain Rust. It is near the start when its
    /// box, grown by `reach` mm, holds it.
    #[inline(always)]
    pub(super) fn new(corners: [&[f64; 3]; 4], ray: &FacetRay, reach: f64) -> Self {
        let [sx, sy, _] = ray.shear();
        let origin = ray.origin;
        let mut edges = Self { near: true, ..Self::default() };
        let mut x = [0.0; 4];
        let mut y = [0.0; 4];
        for a in 0..3 {
            let along = corners.map(|c| c[a]);
            let low = along.into_iter().fold(f64::INFINITY, f64::min);
            let high = along.into_iter().fold(f64::NEG_INFINITY, f64::max);
            edges.near &= (origin[a] >= low - reach) & (origin[a] <= high + reach);
        }
        let [kx, ky, kz] = ray.axes();
        let [ox, oy, oz] = [origin[kx], origin[ky], origin[kz]];
        for k in 0..4 {
            let z = corners[k][kz] - oz;
            x[k] = (corners[k][kx] - ox) - sx * z;
            y[k] = (corners[k][ky] - oy) - sy * z;
            edges.heights[k] = z;
        }
        for k in 0..4 {
            let next = (k + 1) % 4;
            let edge = x[next] * y[k] - y[next] * x[k];
            edges.outline[k] = edge;
            edges.below |= u32::from(edge < 0.0) << k;
            edges.above |= u32::from(edge > 0.0) << k;
        }
        edges.diagonal = x[0] * y[2] - y[0] * x[2];
        edges
    }

    /// Whether none of these triangles (bits 0 and 1) of a facet is met, wherever within `reach` mm of its start the ray begins; `false`
    /// says nothing.
    #[inline(always)]
    pub(super) fn misses_clearly(
        &self,
        triangles: u32,
        corners: [&[f64; 3]; 4],
        ray: &FacetRay,
        reach: f64,
    ) -> bool {
        let mut farthest = 0.0;
        for corner in corners {
            for a in 0..3 {
                let distance = (corner[a] - ray.origin[a]).abs();
                farthest = if distance > farthest { distance } else { farthest };
            }
        }
        let margin = margin(farthest, reach);
        let [e0, e1, e2, e3] = self.outline;
        let first = has_both_signs([e0, e1, self.diagonal], margin);
        let second = has_both_signs([e2, e3, -self.diagonal], margin);
        triangles & !(u32::from(first) | u32::from(second) << 1) == 0
    }

    /// Offers hits on these triangles (bits 0 and 1) of a facet to `best`. Returns `false`, and offers none, where an edge function of one
    /// of them is zero: the exact test must decide.
    #[inline(always)]
    pub(super) fn keep_hits(&self, facet: u32, triangles: u32, ray: &FacetRay, best: &mut Nearest) -> bool {
        let left = u32::from(self.diagonal < 0.0);
        let right = u32::from(self.diagonal > 0.0);
        let below = any_edge(self.below, left, right);
        let above = any_edge(self.above, right, left);
        let zeros = !(self.below | self.above) & 15;
        let level = (left | right) ^ 1;
        if any_edge(zeros, level, level) & triangles != 0 {
            return false;
        }
        let met = triangles & !(below & above);
        let line = ray.line();
        let [e0, e1, e2, e3] = self.outline;
        let [z0, z1, z2, z3] = self.heights;
        if met == 3 {
            line.keep(facet, false, [e1, self.diagonal, e0], [z0, z1, z2], best);
        }
        if met != 0 {
            let second = met & 2 != 0;
            let pick = |first: f64, other: f64| select_unpredictable(second, other, first);
            let edges = [pick(e1, e2), pick(self.diagonal, e3), pick(e0, -self.diagonal)];
            line.keep(facet, second, edges, [z0, pick(z1, z2), pick(z2, z3)], best);
        }
        true
    }
}

/// Which triangles have one of these edges: bit 0 for the first, bit 1 for the second, which the diagonal bounds from its other side.
#[inline(always)]
fn any_edge(outline: u32, first: u32, second: u32) -> u32 {
    (outline | outline >> 1 | first) & 1 | (outline >> 1 | outline >> 2 | second << 1) & 2
}

/// Whether two of these edge functions have opposite signs and both are larger than a margin.
#[inline(always)]
fn has_both_signs([a, b, c]: [f64; 3], margin: f64) -> bool {
    ((a > margin) | (b > margin) | (c > margin)) & ((a < -margin) | (b < -margin) | (c < -margin))
}

//! The two triangles of a facet against a ray that leaves nothing: the arithmetic that decides, and the signs where it cannot.

use super::facet_hit::{EdgeHit, Nearest};
use robust::{Coord, orient2d};
use std::hint::select_unpredictable;

/// A ray with its coordinates in the order of its axes, the main one last.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub(crate) origin: [f64; 3],
    /// As [`super::facet::FacetRay::shear`].
    pub(crate) shear: [f64; 3],
    pub(crate) t_min: f64,
}

impl Line {
    /// Tests the chosen triangles of a facet (bits as in [`super::facet::FacetRay::test`]) and offers hits to `best`; corners are axis by
    /// axis in the order of the ray's axes. Departures play no part. The steps are loops over four, so that compilers make one
    /// instruction of each.
    #[inline(always)]
    pub(crate) fn test_quad(&self, (facet, triangles): (u32, u32), corners: &[[f64; 4]; 3], best: &mut Nearest) {
        let ([ox, oy, oz], [sx, sy, _]) = (self.origin, self.shear);
        let (mut x, mut y, mut z, mut outline) = ([0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]);
        for k in 0..4 {
            z[k] = corners[2][k] - oz;
            x[k] = (corners[0][k] - ox) - sx * z[k];
            y[k] = (corners[1][k] - oy) - sy * z[k];
        }
        for k in 0..4 {
            let next = (k + 1) % 4;
            outline[k] = x[next] * y[k] - y[next] * x[k];
        }
        let diagonal = x[0] * y[2] - y[0] * x[2];
        let first = [outline[1], diagonal, outline[0]];
        let second = [outline[2], outline[3], -diagonal];
        // Where an edge function is zero, the sign it has been rounded from decides, in exact arithmetic: of two
        // facets at an edge one is hit.
        let zero = |e: [f64; 3]| (e[0] == 0.0) | (e[1] == 0.0) | (e[2] == 0.0);
        if triangles & (u32::from(zero(first)) | u32::from(zero(second)) << 1) != 0 {
            return self.test_with_exact_signs((facet, triangles), [first, second], [x, y, z], best);
        }
        let met = triangles & (u32::from(one_sided(first)) | u32::from(one_sided(second)) << 1);
        if met == 3 {
            self.keep(facet, false, first, [z[0], z[1], z[2]], best);
        }
        if met != 0 {
            let other = met & 2 != 0;
            let edges = std::array::from_fn(|k| select_unpredictable(other, second[k], first[k]));
            let heights = [z[0], select_unpredictable(other, z[2], z[1]), select_unpredictable(other, z[3], z[2])];
            self.keep(facet, other, edges, heights, best);
        }
    }

    /// Tests the chosen triangles again where an edge function is zero, with exact signs; `x`, `y` are sheared, `z` the heights.
    #[cold]
    #[inline(never)]
    fn test_with_exact_signs(
        &self,
        (facet, triangles): (u32, u32),
        edges: [[f64; 3]; 2],
        [x, y, z]: [[f64; 4]; 3],
        best: &mut Nearest,
    ) {
        let at = |k: usize| [x[k], y[k], z[k]];
        for (bit, edges, [a, b, c]) in [(1, edges[0], [0, 1, 2]), (2, edges[1], [0, 2, 3])] {
            if triangles & bit != 0 {
                let edges = if edges.contains(&0.0) { edges_with_exact_signs(at(a), at(b), at(c)) } else { edges };
                if one_sided(edges) {
                    self.keep(facet, bit == 2, edges, [z[a], z[b], z[c]], best);
                }
            }
        }
    }

    /// Offers `best` the hit with these edge functions and corner heights if its `t` lies between `t_min` and the nearest hit so far.
    #[inline(always)]
    pub(crate) fn keep(&self, facet: u32, second: bool, edges: [f64; 3], heights: [f64; 3], best: &mut Nearest) {
        let [u, v, w] = edges;
        let det = u + v + w;
        let t = (u * heights[0] + v * heights[1] + w * heights[2]) * self.shear[2] / det;
        // A NaN (det = 0, or no direction) fails the comparisons.
        if t >= self.t_min && t <= best.t {
            best.offer(EdgeHit { t, facet, second, edges });
        }
    }
}

/// Whether no two edge functions have opposite signs; zero has none, so that all zero is one-sided.
#[inline(always)]
fn one_sided(e: [f64; 3]) -> bool {
    let below = (e[0] < 0.0) | (e[1] < 0.0) | (e[2] < 0.0);
    let above = (e[0] > 0.0) | (e[1] > 0.0) | (e[2] > 0.0);
    !(below & above)
}

/// The edge functions c × b, a × c and b × a of sheared corners (of x and y alone), in the order and with the sign that `test_quad` uses.
/// Their signs are exact, zero means on the line; their sizes are rounded.
#[cold]
fn edges_with_exact_signs(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> [f64; 3] {
    let zero = Coord { x: 0.0, y: 0.0 };
    // The shear has rounded already, but alike for all facets at the edge; from there on the signs are exact.
    let edge = |p: [f64; 3], q: [f64; 3]| orient2d(Coord { x: p[0], y: p[1] }, Coord { x: q[0], y: q[1] }, zero);
    [edge(c, b), edge(a, c), edge(b, a)]
}

//! The f64 edge functions of two facets at once, with the arithmetic of [`Line::test_quad`] step by step, so that they have the same bits.

use crate::intersect::facet::Line;

/// Corners of a facet, axis by axis in the order of the ray's.
pub(super) type Corners = [[f64; 4]; 3];

/// Edge functions of two facets, four numbers for each.
#[derive(Default)]
#[repr(C, align(64))]
pub(super) struct Edges {
    /// Of each side, by its first corner k: the edge function from corner k + 1 (mod 4) to corner k.
    pub(super) outline: [f64; 8],
    /// That of the diagonal between corners 0 and 2, four times.
    pub(super) diagonal: [f64; 8],
    /// Of the corners, along the main axis.
    pub(super) heights: [f64; 8],
    /// One bit for each that is negative, of the outline and of the diagonal; then for each that is positive.
    pub(super) below: [u8; 2],
    pub(super) above: [u8; 2],
}

impl Edges {
    /// Overwrites all with the edge functions of two facets: lanes 0 to 3 are the first facet's, 4 to 7 the second's. In plain Rust.
    #[inline(always)]
    pub(super) fn compute(&mut self, corners: [&Corners; 2], line: &Line) {
        let ([ox, oy, oz], [sx, sy, _]) = (line.origin, line.shear);
        (self.below, self.above) = ([0; 2], [0; 2]);
        for (facet, c) in corners.into_iter().enumerate() {
            let (mut x, mut y) = ([0.0; 4], [0.0; 4]);
            for k in 0..4 {
                // Sheared so that the ray is the main axis: what is left is a test in two dimensions (Woop, Benthin
                // and Wald 2013).
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

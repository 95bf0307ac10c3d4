//! The piece of the spline that a facet stands for, by its parameters.

use crate::math::Uv;
use crate::mesh::FacetMesh;

/// Part of the parameters of a facet's piece: a rectangle, rounded inward; empty where the piece is none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    low: [f32; 2],
    high: [f32; 2],
}

impl Piece {
    const EMPTY: Self = Self { low: [f32::INFINITY; 2], high: [f32::NEG_INFINITY; 2] };

    /// The parameters between the corners of this facet, where they are those of a rectangle.
    pub(super) fn of_facet(mesh: &FacetMesh, facet: usize) -> Self {
        let [a, b, c, d] = mesh.facets[facet].vertices.map(|v| mesh.vertices[v as usize].uv);
        let (low, high) = (a.min(c), a.max(c));
        // Opposite corners, and the other two between them.
        let is_rectangle = [[b, d], [d, b]].contains(&[Uv::new(a.x, c.y), Uv::new(c.x, a.y)]);
        if !is_rectangle || !low.is_finite() || !high.is_finite() {
            return Self::EMPTY;
        }
        Self {
            low: low.to_array().map(|x| (x as f32).next_up()),
            high: high.to_array().map(|x| (x as f32).next_down()),
        }
    }

    /// Whether these parameters are known to lie in the piece.
    #[inline(always)]
    pub(super) fn holds(&self, uv: Uv) -> bool {
        let [u, v] = uv.to_array();
        (u > f64::from(self.low[0]))
            & (u < f64::from(self.high[0]))
            & (v > f64::from(self.low[1]))
            & (v < f64::from(self.high[1]))
    }
}

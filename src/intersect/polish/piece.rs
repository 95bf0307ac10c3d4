//! The piece of the spline that a facet stands for, by its parameters.

use crate::math::Uv;
use crate::mesh::FacetMesh;

/// Roundings of single precision, in units of the largest term, that a side is moved inward by: two for each product, and the sum.
const ROUNDINGS: f64 = 8.0;

/// The polygon between the parameters of a facet's corners, as far as all its sides can see it, and rounded inward; empty where it has no
/// area.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Edge functions: inside, `normal_u·u + normal_v·v` is above `offset` for every side.
    normal_u: [f32; 4],
    normal_v: [f32; 4],
    offset: [f32; 4],
}

impl Piece {
    /// Returns the edge functions of a facet's corners.
    pub(super) fn of_facet(mesh: &FacetMesh, facet: usize) -> Self {
        let corners = mesh.facets[facet].vertices.map(|v| mesh.vertices[v as usize].uv);
        Self::between(corners)
    }

    /// Returns the edge functions of four corners, in one or the other turn; two may be the same.
    fn between(corners: [Uv; 4]) -> Self {
        let [a, b, c, d] = corners;
        let turn = (c - a).perp_dot(d - b);
        let mut piece = Self { normal_u: [0.0; 4], normal_v: [0.0; 4], offset: [f32::INFINITY; 4] };
        if !turn.is_finite() || turn == 0.0 {
            return piece;
        }
        let largest = corners.into_iter().fold(Uv::ZERO, |largest, corner| largest.max(corner.abs()));
        for k in 0..4 {
            let (from, side) = (corners[k], corners[(k + 1) % 4] - corners[k]);
            // A side without length bounds nothing.
            if side == Uv::ZERO {
                piece.offset[k] = f32::NEG_INFINITY;
                continue;
            }
            let inward = side.perp() * turn.signum() / side.abs().max_element();
            let room = ROUNDINGS * f64::from(f32::EPSILON) * (inward.abs() * largest).element_sum();
            piece.normal_u[k] = inward.x as f32;
            piece.normal_v[k] = inward.y as f32;
            piece.offset[k] = (inward.dot(from) + room) as f32;
        }
        piece
    }

    /// Whether these parameters are known to lie in the piece.
    #[inline(always)]
    pub(super) fn contains(&self, uv: Uv) -> bool {
        let [u, v] = uv.as_vec2().to_array();
        let mut inside = true;
        for k in 0..4 {
            inside &= self.normal_u[k] * u + self.normal_v[k] * v > self.offset[k];
        }
        inside
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quads, triangles and slivers of either turn, near the origin and far from it: what is held lies left of all sides, or right, and
    /// most of what does is held.
    #[test]
    fn what_is_held_lies_inside() {
        let shapes = [
            [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]],
            [[0.0, 0.0], [0.1, 1.0], [2.0, 1.0], [1.5, 0.2]],
            [[0.0, 0.0], [2.0, 0.3], [1.0, 1.0], [1.0, 1.0]],
            [[0.0, 0.0], [2.0, 1e-3], [2.0, 2e-3], [0.0, 1e-3]],
        ];
        for (shape, origin) in shapes.into_iter().flat_map(|shape| [0.0, -7.0, 1e3].map(|origin| (shape, origin))) {
            let corners = shape.map(|corner| Uv::from_array(corner) + Uv::splat(origin));
            let piece = Piece::between(corners);
            let (mut inside, mut held) = (0, 0);
            for k in 0..20_000u32 {
                let unit = |m: f64| (f64::from(k) * m).fract();
                let place = Uv::new(2.0 * unit(0.618_033_988), unit(0.754_877_666)) + Uv::splat(origin);
                let sides = (0..4).map(|k| [corners[k], corners[(k + 1) % 4]]).filter(|[from, to]| from != to);
                let sides: Vec<f64> = sides.map(|[from, to]| (to - from).perp_dot(place - from)).collect();
                let is_inside = sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s < 0.0);
                inside += u32::from(is_inside);
                held += u32::from(piece.contains(place));
                assert!(is_inside || !piece.contains(place), "{shape:?} {place}");
            }
            assert!(f64::from(held) > 0.9 * f64::from(inside) || origin == 1e3, "{held} of {inside}");
        }
        assert!(!Piece::between([Uv::ONE; 4]).contains(Uv::ONE));
        assert!(!Piece::between([Uv::ZERO, Uv::NAN, Uv::ONE, Uv::ONE]).contains(Uv::ONE));
    }
}

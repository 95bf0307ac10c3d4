//! What the corners of a facet and its vertices say where it is hit: flat and bilinear normal, and parameters.
//!
//! Facet parameters are `(0,0), (1,0), (1,1), (0,1)` at the corners, carried over the two traced triangles linearly.

use super::facet::FacetHit;
use crate::math::{Uv, Vector};
use crate::mesh::{Facet, FacetMesh};
use std::hint::select_unpredictable;

/// Flat and bilinear normal of a hit, and its parameters.
pub(super) struct CornerNormals {
    /// Of the triangle that is hit; zero where it has no area.
    pub(super) flat: Vector,
    /// Bilinear, of the vertices; the flat one where theirs cancel.
    pub(super) smooth: Vector,
    /// Parameters on the face's surface.
    pub(super) uv: Uv,
}

/// Flat and bilinear normal of a hit, and its parameters, without branches on which triangle was hit.
#[inline(always)]
pub(super) fn corner_normals(mesh: &FacetMesh, hit: &FacetHit) -> CornerNormals {
    let facet = &mesh.facets[hit.facet as usize];
    let [v0, v1, v2, v3] = facet.vertices.map(|v| &mesh.vertices[v as usize]);
    let positions = [v0, v1, v2, v3].map(|v| v.position);
    let [a, b, c] = triangle(hit.second, positions).map(|p| mesh.positions[p as usize]);
    let flat = (b - a).cross(c - a).normalize_or_zero();
    let [w0, w1, w2, w3] = weights(facet, hit);
    let sum = v0.normal * w0 + v1.normal * w1 + v2.normal * w2 + v3.normal * w3;
    // Opposed normals may cancel; the facet's own is left then.
    let smooth = sum.normalize_or(flat);
    CornerNormals { flat, smooth, uv: v0.uv * w0 + v1.uv * w1 + v2.uv * w2 + v3.uv * w3 }
}

/// Weights of the four corners of a facet at a hit.
#[inline(always)]
pub(super) fn weights(facet: &Facet, hit: &FacetHit) -> [f64; 4] {
    if facet.is_triangle() { [hit.b[0], hit.b[1], hit.b[2], 0.0] } else { bilinear_weights(parameters(hit)) }
}

/// Of four values at the corners of a facet, picks the three of the triangle (0, 1, 2), or of (0, 2, 3) where `second`.
#[inline(always)]
pub(super) fn triangle<T: Copy>(second: bool, corners: [T; 4]) -> [T; 3] {
    let [a, b, c, d] = corners;
    [a, select_unpredictable(second, c, b), select_unpredictable(second, d, c)]
}

/// Facet parameters of a hit, in the unit square.
#[inline(always)]
pub(super) fn parameters(hit: &FacetHit) -> Uv {
    let [_, b1, b2] = hit.b;
    let sum = b1 + b2;
    Uv::new(select_unpredictable(hit.second, b1, sum), select_unpredictable(hit.second, sum, b2))
}

/// Weights of the four corners at facet parameters `p`; their sum is one.
#[inline(always)]
fn bilinear_weights(p: Uv) -> [f64; 4] {
    let q = 1.0 - p;
    [q.x * q.y, p.x * q.y, p.x * p.y, q.x * p.y]
}

//! The sheet around a facet: what of its own surface a ray that leaves the spline over it cannot meet again.
//!
//! The spline lies up to a sag off its facets, so that a ray may start below its own facet and come through a neighbour from behind. That
//! facet says nothing: the sheet of facets around the start, as the sheet of spline that they stand for, is crossed once by a line that
//! all normals of the sheet look along, and the spline is crossed at the start. Facets of other faces at the same corner are no such
//! sheet, for where faces meet the spline may fold.

use crate::math::Vector;
use crate::mesh::FacetMesh;

/// A normal of the spline over a facet is off the facet's by no more than at the corners where the curvature does not change; this is room
/// for one that does.
const NORMAL_ROOM: f64 = 2.0;
/// The least sine of a ray to a facet of the sheet, for what rounding takes.
const LEAST_SINE: f64 = 1e-3;

/// A facet and those of its face that share a corner with it.
pub(super) struct Sheet<'m> {
    mesh: &'m FacetMesh,
    facet: usize,
    positions: [u32; 4],
}

impl<'m> Sheet<'m> {
    /// Makes the sheet around a facet of the mesh.
    pub(super) fn new(mesh: &'m FacetMesh, facet: usize) -> Self {
        Self { mesh, facet, positions: mesh.corner_positions(facet) }
    }

    /// Whether a facet is of the sheet.
    pub(super) fn holds(&self, other: usize) -> bool {
        self.mesh.facets[other].face == self.mesh.facets[self.facet].face
            && self.mesh.corner_positions(other).iter().any(|p| self.positions.contains(p))
    }

    /// Half the angle, radians, of the widest cone about the unit vector `axis` whose directions all normals of the spline over this facet
    /// of the sheet look along; 0 where they do not look along the axis, or the facet has no area.
    pub(super) fn half_angle(&self, facet: usize, axis: Vector) -> f64 {
        let [a, b, c, d] = self.mesh.corners(facet);
        let mut triangles = [(b - a).cross(c - a).normalize_or(Vector::NAN); 2];
        if !self.mesh.facets[facet].is_triangle() {
            triangles[1] = (c - a).cross(d - a).normalize_or(Vector::NAN);
        }
        let corners = self.mesh.facets[facet].vertices.map(|v| self.mesh.vertices[v as usize].normal);
        let half_angles = triangles.map(|normal| {
            let stray = corners.iter().map(|n| (*n - normal).length()).fold(0.0, f64::max);
            let least = NORMAL_ROOM * stray + LEAST_SINE;
            normal.dot(axis).asin() - least.asin()
        });
        // NaN closes the cone: `min` would drop it.
        if half_angles.iter().all(|a| *a > 0.0) { half_angles[0].min(half_angles[1]) } else { 0.0 }
    }
}

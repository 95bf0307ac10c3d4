//! Quad facets with vertex normals: what the tessellator makes and the tracers trace.
//!
//! A facet has four corners on the surface. As traced it is the two flat triangles `(0, 1, 2)` and `(0, 2, 3)`,
//! so that neighbours meet exactly; its own parameters are `(0,0), (1,0), (1,1), (0,1)` at the corners. A triangle is a
//! facet whose last two corners are the same vertex. Positions are shared across faces, normals are each face's own,
//! so creases stay sharp.

pub(crate) mod arrays;
mod stored;
mod topology;

use crate::math::{Aabb, FaceId, Point, Uv, Vector};
use bytemuck::{AnyBitPattern, NoUninit};
use serde::{Deserialize, Serialize};
pub use topology::Topology;

/// A mesh of quad facets; a triangle is a quad whose last two corners coincide.
///
/// ```
/// use lampyris::math::{FaceId, Point, Uv, Vector};
/// use lampyris::mesh::{Facet, FacetMesh, MeshVertex};
///
/// let positions = vec![Point::ZERO, Point::X, Point::new(1.0, 1.0, 0.0), Point::Y];
/// let vertices = (0..4).map(|position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO }).collect();
/// let facets = vec![Facet { vertices: [0, 1, 2, 3], face: FaceId(0) }];
/// let square = FacetMesh { positions, vertices, facets, sag: vec![] };
/// assert_eq!((square.area(), square.topology(0..1).open_edges), (1.0, 4));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FacetMesh {
    /// Distinct points, mm; bit-equal where faces meet.
    pub positions: Vec<Point>,
    /// Corners of facets, each of one face.
    pub vertices: Vec<MeshVertex>,
    /// The facets, those of a face together.
    pub facets: Vec<Facet>,
    /// Upper bound of the distance between each facet as traced and its piece of the spline, mm; infinite where
    /// none could be proved, empty when the mesh comes from no spline.
    pub sag: Vec<f64>,
}

/// A corner of facets: a position with the normal and parameters that one face has there.
#[derive(Clone, Copy, Debug, PartialEq, AnyBitPattern, Serialize, Deserialize)]
// As it is kept from run to run.
#[repr(C)]
pub struct MeshVertex {
    /// Index into [`FacetMesh::positions`].
    pub position: u32,
    /// Outward unit normal of the spline.
    pub normal: Vector,
    /// Parameters on the face's surface.
    pub uv: Uv,
}

/// One quad, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, NoUninit, AnyBitPattern, Serialize, Deserialize)]
// As it is kept from run to run.
#[repr(C)]
pub struct Facet {
    /// Indices into [`FacetMesh::vertices`]; the traced diagonal runs from the first to the third.
    pub vertices: [u32; 4],
    /// The placed face it belongs to.
    pub face: FaceId,
}

impl Facet {
    /// Whether the last two corners are one vertex; two vertices at one position are distinct.
    pub fn is_triangle(&self) -> bool {
        self.vertices[2] == self.vertices[3]
    }

    /// Number of triangles that the facet is drawn and traced as: 1 or 2.
    pub fn triangle_count(&self) -> usize {
        if self.is_triangle() { 1 } else { 2 }
    }
}

impl FacetMesh {
    /// The four corner positions of a facet, mm; the last two are equal for a triangle.
    #[inline]
    pub fn corners(&self, facet: usize) -> [Point; 4] {
        // Spelled out: a `map` over the array is not unrolled and took a tenth of building an octree.
        let [a, b, c, d] = self.corner_positions(facet);
        let position = |p: u32| self.positions[p as usize];
        [position(a), position(b), position(c), position(d)]
    }

    /// Indices into [`FacetMesh::positions`] of the four corners of a facet.
    #[inline]
    pub fn corner_positions(&self, facet: usize) -> [u32; 4] {
        let [a, b, c, d] = self.facets[facet].vertices;
        let position = |v: u32| self.vertices[v as usize].position;
        [position(a), position(b), position(c), position(d)]
    }

    /// A box around all positions, also those that no facet uses; empty without any.
    pub fn bounds(&self) -> Aabb {
        Aabb::from_points(self.positions.iter().copied())
    }

    /// Area of the facets as traced, mm².
    pub fn area(&self) -> f64 {
        (0..self.facets.len()).map(|f| self.facet_area(f)).sum()
    }

    /// Area of one facet as traced, mm².
    pub fn facet_area(&self, facet: usize) -> f64 {
        let [a, b, c, d] = self.corners(facet);
        0.5 * ((b - a).cross(c - a).length() + (c - a).cross(d - a).length())
    }

    /// Volume enclosed by the facets as traced, mm³, positive when they run counter-clockwise seen from outside; meaningful only for a
    /// closed mesh.
    pub fn volume(&self) -> f64 {
        // About the middle of the mesh: far from the origin the terms would cancel to nothing.
        let origin = self.bounds().center();
        let signed = |a: Point, b: Point, c: Point| (a - origin).dot((b - origin).cross(c - origin)) / 6.0;
        (0..self.facets.len())
            .map(|f| {
                let [a, b, c, d] = self.corners(f);
                signed(a, b, c) + if c == d { 0.0 } else { signed(a, c, d) }
            })
            .sum()
    }

    /// Returns the facets of the faces that are kept, in their order, with only the corners and positions that they use.
    pub fn of_faces(&self, is_kept: impl Fn(FaceId) -> bool) -> Self {
        let mut kept = Self::default();
        // Where each corner and position went.
        let mut vertices = vec![u32::MAX; self.vertices.len()];
        let mut positions = vec![u32::MAX; self.positions.len()];
        for (k, facet) in self.facets.iter().enumerate().filter(|(_, facet)| is_kept(facet.face)) {
            for v in facet.vertices {
                if vertices[v as usize] != u32::MAX {
                    continue;
                }
                let vertex = self.vertices[v as usize];
                let position = &mut positions[vertex.position as usize];
                if *position == u32::MAX {
                    *position = kept.positions.len() as u32;
                    kept.positions.push(self.positions[vertex.position as usize]);
                }
                vertices[v as usize] = kept.vertices.len() as u32;
                kept.vertices.push(MeshVertex { position: *position, ..vertex });
            }
            kept.facets.push(Facet { vertices: facet.vertices.map(|v| vertices[v as usize]), face: facet.face });
            // Meshes that come from no spline have none.
            kept.sag.extend(self.sag.get(k));
        }
        kept
    }

    /// Number of facets that are no triangles.
    pub fn quad_count(&self) -> usize {
        self.facets.iter().filter(|f| !f.is_triangle()).count()
    }

    /// Bytes of the mesh's arrays, without spare room.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.positions)
            + size_of_val(&*self.vertices)
            + size_of_val(&*self.facets)
            + size_of_val(&*self.sag)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_of_quads_has_its_area_and_volume() {
        let positions: Vec<Point> = Aabb { min: Point::ZERO, max: Point::splat(2.0) }.corners().into();
        let sides = [
            ([0, 2, 3, 1], -Vector::Z),
            ([4, 5, 7, 6], Vector::Z),
            ([0, 1, 5, 4], -Vector::Y),
            ([2, 6, 7, 3], Vector::Y),
            ([0, 4, 6, 2], -Vector::X),
            ([1, 3, 7, 5], Vector::X),
        ];
        let mut mesh = FacetMesh { positions, ..FacetMesh::default() };
        for (face, (corners, normal)) in sides.into_iter().enumerate() {
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(corners.map(|position| MeshVertex { position, normal, uv: Uv::ZERO }));
            mesh.facets.push(Facet { vertices: [0, 1, 2, 3].map(|k| first + k), face: FaceId(face as u32) });
        }
        assert_eq!(mesh.quad_count(), 6);
        assert!((mesh.area() - 24.0).abs() < 1e-14);
        assert!((mesh.volume() - 8.0).abs() < 1e-14);
    }
}

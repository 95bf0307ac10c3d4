//! Embree over the facets of a mesh, as triangles or as quads.

use super::embree_library::{EmbreeError, EmbreeLibrary, RayHit, Scene};
use crate::intersect::facet_triangles::TriangleCode;
use crate::intersect::{Cost, Footprint, Hit, Intersector, NormalMode, normals};
use crate::math::Ray;
use crate::mesh::FacetMesh;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// By how much later a ray begins that leaves a facet, in sizes of the mesh: a hundred times what f32 rounds starts by. The point of
/// departure lies within it; so may, rarely, a true hit.
const START_ROOM: f64 = 1e-5;

/// `RTC_INVALID_GEOMETRY_ID`.
const NO_GEOMETRY: u32 = u32::MAX;

/// The primitives passed to Embree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Primitives {
    /// Two of most facets.
    Triangles,
    /// One a facet, split along the same diagonal as ours.
    Quads,
}

/// Embree's hierarchy over the facets of a mesh, of high quality and robust.
pub struct Embree<'m> {
    mesh: &'m FacetMesh,
    scene: Scene,
    primitives: Primitives,
    /// The first triangle of each primitive.
    codes: Vec<TriangleCode>,
    start_room: f32,
    bytes: usize,
    build_seconds: f64,
}

impl<'m> Embree<'m> {
    /// Builds the hierarchy on Embree's own threads; facets with corners that are not finite or beyond 1e12 mm are left out. `path` is that
    /// of the library, for messages.
    ///
    /// # Errors
    /// When the library lacks a function, or Embree has no memory for the mesh.
    pub fn build(
        library: &Arc<EmbreeLibrary>,
        path: &Path,
        mesh: &'m FacetMesh,
        primitives: Primitives,
    ) -> Result<Self, EmbreeError> {
        let started = Instant::now();
        let held = library.held_bytes();
        let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.as_vec3().to_array()).collect();
        let mut codes = TriangleCode::enumerate(mesh);
        if primitives == Primitives::Quads {
            codes.retain(|code| !code.is_second());
        }
        let indices: Vec<u32> = codes.iter().flat_map(|&code| corner_indices(mesh, code, primitives)).collect();
        let size = if primitives == Primitives::Quads { 4 } else { 3 };
        let scene = library.new_scene(path, &positions, &indices, size)?;
        let bounds = mesh.bounds();
        let extent = if bounds.is_empty() { 0.0 } else { bounds.size().max_element() };
        Ok(Self {
            mesh,
            scene,
            primitives,
            codes,
            start_room: (START_ROOM * extent) as f32,
            bytes: library.held_bytes().saturating_sub(held),
            build_seconds: started.elapsed().as_secs_f64(),
        })
    }
}

/// Where the corners of a primitive, three or four, stand among the positions of the mesh, in the order that Embree splits quads by.
fn corner_indices(mesh: &FacetMesh, code: TriangleCode, primitives: Primitives) -> Vec<u32> {
    let [a, b, c, d] =
        mesh.facets[code.facet() as usize].vertices.map(|vertex| mesh.vertices[vertex as usize].position);
    match primitives {
        // Embree splits from its second corner to its fourth, we from the first to the third.
        Primitives::Quads => vec![b, c, d, a],
        Primitives::Triangles if code.is_second() => vec![a, c, d],
        Primitives::Triangles => vec![a, b, c],
    }
}

impl Intersector for Embree<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        let begin = ray.t_min as f32;
        let mut query = RayHit {
            origin: ray.origin.as_vec3().to_array(),
            direction: ray.direction.as_vec3().to_array(),
            t_near: if ray.departure.is_some() { begin.max(self.start_room) } else { begin },
            // Beyond what `f32` holds a range is as good as endless.
            t_far: if ray.t_max < f64::from(f32::MAX) { ray.t_max as f32 } else { f32::INFINITY },
            mask: u32::MAX,
            geometry: NO_GEOMETRY,
            ..RayHit::default()
        };
        self.scene.intersect(&mut query);
        if query.geometry == NO_GEOMETRY {
            return None;
        }
        let (t, u, v) = (f64::from(query.t_far), f64::from(query.u), f64::from(query.v));
        let first = self.codes[query.primitive as usize];
        let hit = match self.primitives {
            Primitives::Triangles => first.hit(t, [u, v]),
            // Embree's corners are our 1, 2, 3 and 0. On its first half, 1, 2 and 0, the weights are 1 − u − v, u and v; the second
            // half, 3, 0 and 1, … is 3, 0 and 2 for us: its weights of 3, 0 and 2 are u + v − 1, 1 − u and 1 − v.
            Primitives::Quads if u + v <= 1.0 => first.hit(t, [1.0 - u - v, u]),
            Primitives::Quads => first.second().hit(t, [1.0 - v, u + v - 1.0]),
        };
        Some(normals::describe(self.mesh, ray, &hit, NormalMode::default()))
    }

    fn footprint(&self) -> Footprint {
        let bytes = self.bytes + size_of_val(&*self.codes);
        Footprint { bytes, primitives: self.mesh.facets.len(), build_seconds: self.build_seconds }
    }
}

//! Meshes of parts are copied to where their instances stand.

use super::assemble::PartMesh;
use super::face_mesh::FaceMesh;
use super::nodes::Position;
use super::repairs::PlacedRepair;
use super::tessellation::{FacetQuality, Tessellation};
use crate::math::{FaceId, Frame, huge_pages};
use crate::mesh::{Facet, FacetMesh, MeshVertex};
use crate::model::{Instance, Model, PartId, TessellatedFace};
use rustc_hash::FxHashMap;

/// Result of placing.
pub(super) struct Placed {
    pub(super) made: Tessellation,
    /// Placed faces without facets.
    pub(super) failed: Vec<FaceId>,
    /// Faces of which something was given up.
    pub(super) repairs: Vec<PlacedRepair>,
    /// Of each placed face the first one that has the same facets at another place: itself where there is none before it.
    pub(super) originals: Vec<FaceId>,
}

/// Copies the facets of all instances into the scene's coordinates. `parts` are by part; `joined` are, by instance, meshes that replace
/// them. Instances of parts without a mesh add nothing.
pub(super) fn place_instances(
    model: &Model,
    parts: &[Option<PartMesh>],
    joined: &FxHashMap<usize, PartMesh>,
) -> Placed {
    let mesh_of = |i: usize, instance: &Instance| joined.get(&i).or(parts[instance.part.0 as usize].as_ref());
    let placed =
        model.instances.iter().enumerate().filter_map(|(i, instance)| Some((instance, mesh_of(i, instance)?)));
    let made = Tessellation { mesh: with_room(model, placed), ..Tessellation::default() };
    let originals = (0..model.placed_face_count() as u32).map(FaceId).collect();
    let mut out = Placed { made, failed: Vec::new(), repairs: Vec::new(), originals };
    // Turned and moved facets are as far from the spline as they were; scaled ones are not, and mirrored ones have other corners first.
    let mut first_copies: FxHashMap<(PartId, u64, bool), FaceId> = FxHashMap::default();
    for (i, (instance, first)) in model.instances.iter().zip(model.first_faces()).enumerate() {
        let part = model.part(instance.part);
        let Some(mesh) = mesh_of(i, instance) else { continue };
        if !joined.contains_key(&i) {
            let kind = (instance.part, instance.placement.scale.to_bits(), instance.placement.is_mirrored());
            let original = *first_copies.entry(kind).or_insert(first);
            for k in 0..part.face_count() as u32 {
                out.originals[(first.0 + k) as usize] = FaceId(original.0 + k);
            }
        }
        // All shared positions of the instance come first, so that faces refer to them by their number in the part.
        let shared = out.made.mesh.positions.len() as u32;
        out.made.mesh.positions.extend(mesh.shared.iter().map(|&p| instance.placement.point(p)));
        for (k, face) in mesh.faces.iter().enumerate() {
            let id = FaceId(first.0 + k as u32);
            match face {
                Some(face) => {
                    let left_out_mm = face.left_out_mm * instance.placement.scale.abs();
                    out.repairs.extend(face.repaired.map(|how| PlacedRepair { face: id, how, left_out_mm }));
                    place_face(&mut out.made, instance, shared, face, id);
                }
                None => out.failed.push(id),
            }
        }
        for (k, ready) in part.tessellated.iter().enumerate() {
            let id = FaceId(first.0 + (mesh.faces.len() + k) as u32);
            place_ready(&mut out.made, &instance.placement, ready, id);
        }
    }
    drop_unused(&mut out.made.mesh);
    out
}

/// Allocates an empty mesh with room for the meshes of all instances, in huge pages where it is large: rays read its corners at random.
fn with_room<'a>(model: &Model, placed: impl Iterator<Item = (&'a Instance, &'a PartMesh)>) -> FacetMesh {
    let (mut positions, mut vertices, mut facets) = (0, 0, 0);
    for (instance, mesh) in placed {
        positions += mesh.shared.len();
        for face in mesh.faces.iter().flatten() {
            positions += face.own.len();
            vertices += face.corners.len();
            facets += face.facets.len();
        }
        for ready in &model.part(instance.part).tessellated {
            positions += ready.mesh.positions.len();
            vertices += ready.mesh.vertices.len();
            facets += ready.mesh.facets.len();
        }
    }
    FacetMesh {
        positions: huge_pages::with_capacity(positions),
        vertices: huge_pages::with_capacity(vertices),
        facets: huge_pages::with_capacity(facets),
        sag: huge_pages::with_capacity(facets),
    }
}

/// Appends the facets of face `id` with its own positions. `shared` is the index at which the instance's shared positions begin; bounds and
/// tolerances are scaled to the scene.
fn place_face(out: &mut Tessellation, instance: &Instance, shared: u32, face: &FaceMesh, id: FaceId) {
    let frame = &instance.placement;
    let own = out.mesh.positions.len() as u32;
    out.mesh.positions.extend(face.own.iter().map(|&p| frame.point(p)));
    let first = out.mesh.vertices.len() as u32;
    out.mesh.vertices.extend(face.corners.iter().map(|corner| MeshVertex {
        position: match corner.position {
            Position::Shared(p) => shared + p,
            Position::Own(p) => own + p,
        },
        normal: frame.normal(corner.normal),
        uv: corner.uv,
    }));
    for facet in &face.facets {
        let vertices = oriented_corners(facet.corners.map(|c| c + first), frame);
        out.mesh.facets.push(Facet { vertices, face: id });
        let (bound, tolerance) = (facet.bound * frame.scale, facet.tolerance * frame.scale);
        // Compared after scaling, as a reader of both numbers would.
        let certified = bound <= tolerance;
        out.mesh.sag.push(if certified { bound } else { f64::INFINITY });
        out.quality.push(FacetQuality { tolerance, bound, certified });
    }
}

/// Returns the corners of a facet, turned around by a mirrored placement so that it stays counter-clockwise from outside; a triangle
/// repeats its last.
pub(super) fn oriented_corners([a, b, c, d]: [u32; 4], frame: &Frame) -> [u32; 4] {
    if !frame.is_mirrored() {
        [a, b, c, d]
    } else if c == d {
        [a, c, b, b]
    } else {
        [a, d, c, b]
    }
}

/// Appends a face that is a mesh in the file, as it is. It is its own truth: sag and tolerance 0, certified.
fn place_ready(out: &mut Tessellation, frame: &Frame, ready: &TessellatedFace, id: FaceId) {
    let (p, v) = (out.mesh.positions.len() as u32, out.mesh.vertices.len() as u32);
    out.mesh.positions.extend(ready.mesh.positions.iter().map(|&x| frame.point(x)));
    out.mesh.vertices.extend(ready.mesh.vertices.iter().map(|x| MeshVertex {
        position: x.position + p,
        normal: frame.normal(x.normal),
        uv: x.uv,
    }));
    for f in &ready.mesh.facets {
        out.mesh.facets.push(Facet { vertices: oriented_corners(f.vertices.map(|c| c + v), frame), face: id });
        // The file has nothing else to be measured against.
        out.mesh.sag.push(0.0);
        out.quality.push(FacetQuality { tolerance: 0.0, bound: 0.0, certified: true });
    }
}

/// Removes positions that no facet uses, such as those of failed faces, and renumbers the rest.
fn drop_unused(mesh: &mut FacetMesh) {
    let mut name = vec![u32::MAX; mesh.positions.len()];
    for v in mesh.facets.iter().flat_map(|f| f.vertices) {
        name[mesh.vertices[v as usize].position as usize] = 0;
    }
    let (mut names, mut kept) = (name.iter_mut(), 0);
    mesh.positions.retain(|_| {
        let Some(name) = names.next().filter(|name| **name == 0) else { return false };
        *name = kept;
        kept += 1;
        true
    });
    for v in &mut mesh.vertices {
        // A corner without facets can only come with a ready mesh; it may point anywhere.
        v.position = name[v.position as usize].min(mesh.positions.len().saturating_sub(1) as u32);
    }
}

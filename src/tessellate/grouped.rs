//! Facets of a model whose parts that are placed often have coordinates of their own: each group is meshed by itself, once.

use super::settings::{FaceSelector, Settings};
use super::tessellation::Tessellation;
use crate::math::{Aabb, FaceId, Point, Uv, Vector};
use crate::mesh::{Facet, FacetMesh, MeshVertex};
use crate::model::{Instancing, Placement};
use std::borrow::Cow;
use std::sync::Arc;

/// Facets of all groups of a model.
#[derive(Clone, Debug, Default)]
pub struct GroupedFacets {
    /// Of each group, in its own coordinates, with its own numbers of faces; of a model in one piece the only one.
    pub groups: Vec<Tessellation>,
    /// Where the groups stand; `None` for a model in one piece.
    pub instancing: Option<Arc<Instancing>>,
}

impl From<Tessellation> for GroupedFacets {
    fn from(whole: Tessellation) -> Self {
        Self { groups: vec![whole], instancing: None }
    }
}

/// Sides of a box, by its corners, counter-clockwise from outside.
const SIDES: [[usize; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

impl GroupedFacets {
    /// The meshes of the groups.
    pub fn meshes(&self) -> impl Iterator<Item = &FacetMesh> {
        self.groups.iter().map(|g| &g.mesh)
    }

    /// Whether nothing has facets.
    pub fn is_empty(&self) -> bool {
        self.meshes().all(|mesh| mesh.facets.is_empty())
    }

    /// The meshes, each with how often it stands in the scene.
    pub fn counted(&self) -> impl Iterator<Item = (&FacetMesh, usize)> {
        let counts = self.instancing.as_ref().map_or_else(|| vec![1], |i| i.counts());
        self.meshes().zip(counts)
    }

    /// Number of facets, counted as often as they stand.
    pub fn facet_count(&self) -> usize {
        self.counted().map(|(mesh, count)| mesh.facets.len() * count).sum()
    }

    /// Bytes held by the meshes and their places.
    pub fn bytes(&self) -> usize {
        let places = self.instancing.as_ref().map_or(0, |i| size_of_val(&*i.placements));
        self.meshes().map(FacetMesh::bytes).sum::<usize>() + places
    }

    /// A box around all facets.
    pub fn bounds(&self) -> Aabb {
        let placed = self.instancing.iter().flat_map(|i| &i.placements).map(|p| p.bounds);
        placed.fold(self.groups.first().map_or(Aabb::EMPTY, |g| g.mesh.bounds()), Aabb::union)
    }

    /// All facets where they stand, with the model's numbers of faces.
    pub fn whole(&self) -> Cow<'_, FacetMesh> {
        self.drawn(usize::MAX)
    }

    /// Facets to be looked at, with the model's numbers of faces: all, where they are at most so many. Of more, what is placed often is
    /// drawn as boxes, so many as there is room for and spread evenly, but for the first place of each part.
    pub fn drawn(&self, most: usize) -> Cow<'_, FacetMesh> {
        let Some(instancing) = self.instancing.as_deref() else {
            return self.groups.first().map_or_else(Cow::default, |g| Cow::Borrowed(&g.mesh));
        };
        let mut mesh = self.groups[0].mesh.clone();
        mesh.facets.iter_mut().for_each(|f| f.face = instancing.single_face(f.face));
        let has_room = self.facet_count() <= most;
        let step = (instancing.placements.len() * SIDES.len()).div_ceil(most.max(1)).max(1);
        let mut is_drawn = vec![false; self.groups.len()];
        for (k, place) in instancing.placements.iter().enumerate() {
            let group = place.group as usize;
            if has_room || !std::mem::replace(&mut is_drawn[group], true) {
                append(&mut mesh, &self.groups[group].mesh, place);
            } else if k % step == 0 {
                append_box(&mut mesh, place);
            }
        }
        Cow::Owned(mesh)
    }
}

/// Adds a group's facets in one of its places.
fn append(mesh: &mut FacetMesh, group: &FacetMesh, place: &Placement) {
    let frame = &place.frame;
    let (positions, vertices) = (mesh.positions.len() as u32, mesh.vertices.len() as u32);
    mesh.positions.extend(group.positions.iter().map(|&p| frame.point(p)));
    mesh.vertices.extend(group.vertices.iter().map(|v| MeshVertex {
        position: v.position + positions,
        normal: frame.normal(v.normal),
        ..*v
    }));
    mesh.facets.extend(group.facets.iter().map(|f| Facet {
        vertices: super::placement::turned(f.vertices.map(|v| v + vertices), frame),
        face: FaceId(place.first_face.0 + f.face.0),
    }));
    mesh.sag.extend(&group.sag);
}

/// Adds the box around one place of a group, as facets of its first face without a proof.
fn append_box(mesh: &mut FacetMesh, place: &Placement) {
    let corners: [Point; 8] = place.bounds.corners();
    let position = mesh.positions.len() as u32;
    mesh.positions.extend(corners);
    for side in SIDES {
        let [a, b, c, _] = side.map(|k| corners[k]);
        let normal: Vector = (b - a).cross(c - a).normalize_or_zero();
        let first = mesh.vertices.len() as u32;
        let vertex = |k: usize| MeshVertex { position: position + k as u32, normal, uv: Uv::ZERO };
        mesh.vertices.extend(side.map(vertex));
        mesh.facets.push(Facet { vertices: [0, 1, 2, 3].map(|k| first + k), face: place.first_face });
        mesh.sag.push(f64::INFINITY);
    }
}

impl Settings {
    /// The settings for one group of a model, whose faces have other numbers there.
    pub fn of_group(&self, instancing: &Instancing, group: usize) -> Self {
        let mut settings = self.clone();
        for o in &mut settings.overrides {
            let FaceSelector::Placed(faces) = &mut o.place else { continue };
            let local = |face: &FaceId| {
                let (place, local) = instancing.locate(*face);
                (place.map_or(0, |k| instancing.placements[k].group as usize) == group).then_some(local)
            };
            *faces = faces.iter().filter_map(local).collect();
            // What is placed often has each of its faces once here.
            faces.sort_unstable();
            faces.dedup();
        }
        settings
    }
}

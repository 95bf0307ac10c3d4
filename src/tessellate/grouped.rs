//! Facets of a model whose parts that are placed often have coordinates of their own: each group is meshed by itself, once.

use super::angles::steep_faces;
use super::extent::has_no_area;
use super::settings::{Settings, ToleranceScope};
use super::tessellation::Tessellation;
use crate::math::{Aabb, FaceId, Point, Uv, Vector};
use crate::mesh::{Facet, FacetMesh, MeshVertex};
use crate::model::{Instancing, Model, PlacedFace, Placement};
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
    /// Returns the meshes of the groups.
    pub fn meshes(&self) -> impl Iterator<Item = &FacetMesh> {
        self.groups.iter().map(|g| &g.mesh)
    }

    /// Whether no group has facets.
    pub fn is_empty(&self) -> bool {
        self.meshes().all(|mesh| mesh.facets.is_empty())
    }

    /// Returns the meshes, each with the number of places at which it stands in the scene.
    pub fn counted(&self) -> impl Iterator<Item = (&FacetMesh, usize)> {
        let counts = self.instancing.as_ref().map_or_else(|| vec![1], |i| i.counts());
        self.meshes().zip(counts)
    }

    /// Returns the number of facets in the scene, each counted at all places of its group.
    pub fn facet_count(&self) -> usize {
        self.counted().map(|(mesh, count)| mesh.facets.len() * count).sum()
    }

    /// Returns how many faces of the scene have no facet though they have an area, each counted at all places of its group; `model` is the
    /// one that was meshed.
    pub fn faces_without_facets(&self, model: &Model) -> usize {
        let models = self.instancing.as_ref().map_or(std::slice::from_ref(model), |i| &i.groups);
        let bare = |(model, (mesh, count)): (&Model, (&FacetMesh, usize))| {
            let mut is_bare = vec![true; model.placed_face_count()];
            mesh.facets.iter().for_each(|f| is_bare[f.face.index()] = false);
            if !is_bare.contains(&true) {
                return 0;
            }
            let has_area = |placed: &PlacedFace| placed.face.is_none_or(|face| !has_no_area(&face.surface));
            let faces = model.placed_faces().zip(is_bare);
            faces.filter(|(placed, bare)| *bare && has_area(placed)).count() * count
        };
        models.iter().zip(self.counted()).map(bare).sum()
    }

    /// Returns how many facets of the scene turn farther from the surface normals at their corners than [`Settings::angle_deg`], each
    /// counted at all places of its group, and the largest such angle, degrees; `None` where none does, and where no angle was requested.
    /// `model` is the one that was meshed.
    pub fn facets_over_angle(&self, model: &Model, settings: &Settings) -> Option<(usize, f64)> {
        let models = self.instancing.as_ref().map_or(std::slice::from_ref(model), |i| &i.groups);
        let steep = |(model, (mesh, count)): (&Model, (&FacetMesh, usize))| {
            let faces = steep_faces(mesh, model, settings).unwrap_or_default();
            faces.into_iter().map(move |face| (face.facets * count, face.largest_deg))
        };
        let all = models.iter().zip(self.counted()).flat_map(steep);
        all.reduce(|(facets, largest), (more, deg)| (facets + more, largest.max(deg)))
    }

    /// Returns how many bytes the meshes and the list of places hold.
    pub fn bytes(&self) -> usize {
        let places = self.instancing.as_ref().map_or(0, |i| size_of_val(&*i.placements));
        self.meshes().map(FacetMesh::bytes).sum::<usize>() + places
    }

    /// Returns a box around all facets in the scene's coordinates; empty without any.
    pub fn bounds(&self) -> Aabb {
        let placed = self.instancing.iter().flat_map(|i| &i.placements).map(|p| p.bounds);
        placed.fold(self.groups.first().map_or(Aabb::EMPTY, |g| g.mesh.bounds()), Aabb::union)
    }

    /// Returns all facets where they stand, in the scene's coordinates and with the model's numbers of faces; borrowed for a model in one
    /// piece.
    pub fn whole(&self) -> Cow<'_, FacetMesh> {
        self.drawn(usize::MAX)
    }

    /// Returns the facets to be looked at, in the scene's coordinates and with the model's numbers of faces: all of them if they are at
    /// most `most`, or the model is in one piece. Otherwise the first group and the first place of every other are whole, and further
    /// places are boxes, spread evenly, of about `most` facets together.
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
                append_group(&mut mesh, &self.groups[group].mesh, place);
            } else if k % step == 0 {
                append_box(&mut mesh, place);
            }
        }
        Cow::Owned(mesh)
    }
}

/// Appends a group's facets at one of its places, in the scene's coordinates, turned around where the place is mirrored.
fn append_group(mesh: &mut FacetMesh, group: &FacetMesh, place: &Placement) {
    let frame = &place.frame;
    let (positions, vertices) = (mesh.positions.len() as u32, mesh.vertices.len() as u32);
    mesh.positions.extend(group.positions.iter().map(|&p| frame.point(p)));
    mesh.vertices.extend(group.vertices.iter().map(|v| MeshVertex {
        position: v.position + positions,
        normal: frame.normal(v.normal),
        ..*v
    }));
    mesh.facets.extend(group.facets.iter().map(|f| Facet {
        vertices: super::placement::oriented_corners(f.vertices.map(|v| v + vertices), frame),
        face: FaceId(place.first_face.0 + f.face.0),
    }));
    mesh.sag.extend(&group.sag);
}

/// Appends the box around a place of a group: six quads of its first face, with infinite sag.
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
    /// Returns these settings for the faces of one group: [`ToleranceScope::Placed`] holds the group's own numbers, each once for all its
    /// places, and drops other groups' faces; other selectors stay.
    pub fn of_group(&self, instancing: &Instancing, group: usize) -> Self {
        let mut settings = self.clone();
        for o in &mut settings.overrides {
            let ToleranceScope::Placed(faces) = &mut o.scope else { continue };
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

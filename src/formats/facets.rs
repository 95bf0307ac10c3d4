//! A mesh with what its file may say beside the facets: groups, colours, measured errors, ray paths.

use super::Polylines;
use crate::math::{FaceId, Vector};
use crate::mesh::FacetMesh;

/// A mesh with what its file may say beside the facets.
#[derive(Clone, Debug)]
pub struct Facets<'a> {
    /// The facets.
    pub mesh: &'a FacetMesh,
    /// What faces belong to: parts, usually. Never empty.
    pub groups: Vec<Group>,
    /// Index into `groups` for every face, by [`FaceId`]; faces beyond its end are of group 0.
    pub group_of_face: Vec<u32>,
    /// Angle between the interpolated normal and the spline's, degrees, one a facet; empty when not measured.
    pub normal_error_deg: Vec<f64>,
    /// Largest absolute principal curvature, 1/mm, one a facet; empty when not measured.
    pub curvature_per_mm: Vec<f64>,
    /// Ray paths to show with the facets (GLB alone).
    pub paths: Option<&'a Polylines>,
    /// What identifies each face, by [`FaceId`], for views that show it; empty when not requested.
    pub labels: Vec<String>,
}

/// A named set of faces.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Name of the part.
    pub name: String,
    /// Red, green, blue in `[0, 1]`, as displayed (sRGB).
    pub colour: [f64; 3],
    /// From 0, invisible, to 1: how solid viewers show it.
    pub opacity: f64,
    /// Refractive index in front of the facet over the one behind it (Data_2); 1 where light does not pass.
    pub index_ratio: f64,
}

impl Group {
    /// An opaque group through which no light passes; `colour` is sRGB in `[0, 1]`.
    pub fn solid(name: &str, colour: [f64; 3]) -> Self {
        Self { name: name.into(), colour, opacity: 1.0, index_ratio: 1.0 }
    }
}

impl<'a> Facets<'a> {
    /// A mesh of one group in a light grey-blue, with nothing measured and nothing beside the facets.
    pub fn plain(mesh: &'a FacetMesh, name: &str) -> Self {
        let group = Group::solid(name, [0.62, 0.68, 0.75]);
        Self {
            mesh,
            groups: vec![group],
            group_of_face: Vec::new(),
            normal_error_deg: Vec::new(),
            curvature_per_mm: Vec::new(),
            paths: None,
            labels: Vec::new(),
        }
    }

    /// Index into `groups` of a face: 0 where none is stated for it, or one that is not there.
    pub fn group_of(&self, face: FaceId) -> usize {
        let g = self.group_of_face.get(face.index()).map_or(0, |&g| g as usize);
        // A face without a group belongs to the first: files for show must not fail for it.
        if g < self.groups.len() { g } else { 0 }
    }

    /// Indices of the facets of each group, in the mesh's order; a list may be empty.
    pub(crate) fn by_group(&self) -> Vec<Vec<usize>> {
        let mut lists = vec![Vec::new(); self.groups.len()];
        for (i, facet) in self.mesh.facets.iter().enumerate() {
            lists[self.group_of(facet.face)].push(i);
        }
        lists
    }
}

/// Unit normal of a facet taken as flat, by its two diagonals; zero for a facet without area.
pub(super) fn flat_normal(mesh: &FacetMesh, facet: usize) -> Vector {
    let [a, b, c, d] = mesh.corners(facet);
    // With c = d the diagonals are two edges of the triangle, so one formula serves both.
    (c - a).cross(d - b).normalize_or_zero()
}

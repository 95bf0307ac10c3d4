use super::{Error, ErrorKind, Polylines, data2, glb, obj, ply, stl, vtk};
use crate::math::{FaceId, Vector};
use crate::mesh::FacetMesh;
use std::path::Path;

/// Extensions [`write_facets`] knows, for people.
pub const FACET_EXTENSIONS: &str = ".obj .ply .stl .vtu .glb .data2";

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
    /// An opaque group.
    pub fn solid(name: &str, colour: [f64; 3]) -> Self {
        Self { name: name.into(), colour, opacity: 1.0, index_ratio: 1.0 }
    }
}

impl<'a> Facets<'a> {
    /// A mesh of one group.
    pub fn plain(mesh: &'a FacetMesh, name: &str) -> Self {
        let group = Group::solid(name, [0.62, 0.68, 0.75]);
        Self {
            mesh,
            groups: vec![group],
            group_of_face: Vec::new(),
            normal_error_deg: Vec::new(),
            curvature_per_mm: Vec::new(),
            paths: None,
        }
    }

    /// Index into `groups` of a face.
    pub fn group_of(&self, face: FaceId) -> usize {
        let g = self.group_of_face.get(face.index()).map_or(0, |&g| g as usize);
        if g < self.groups.len() { g } else { 0 }
    }

    /// The facets of each group, in the mesh's order.
    pub(crate) fn by_group(&self) -> Vec<Vec<usize>> {
        let mut lists = vec![Vec::new(); self.groups.len()];
        for (i, facet) in self.mesh.facets.iter().enumerate() {
            lists[self.group_of(facet.face)].push(i);
        }
        lists
    }
}

/// Unit normal of a flat quad (of its two diagonals), zero for a facet without area.
pub(super) fn flat_normal(mesh: &FacetMesh, facet: usize) -> Vector {
    let [a, b, c, d] = mesh.corners(facet);
    // With c = d the diagonals are two edges of the triangle, so one formula serves both.
    (c - a).cross(d - b).normalize_or_zero()
}

/// Writes facets in the format that the extension names: one of [`FACET_EXTENSIONS`].
///
/// # Errors
/// For an unknown extension, and when the file cannot be written.
pub fn write_facets(path: &Path, facets: &Facets) -> Result<(), Error> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    match extension.as_str() {
        "obj" => obj::write(path, facets),
        "ply" => ply::write(path, facets),
        "stl" => stl::write(path, facets),
        "vtu" => vtk::write_vtu(path, facets),
        "glb" => glb::write(path, facets),
        "data2" => data2::write(path, facets),
        _ => Err(Error::new(path, ErrorKind::Extension { given: extension, known: FACET_EXTENSIONS })),
    }
}

/// Whether [`write_facets`] knows the extension of this name.
pub fn is_facet_file(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    FACET_EXTENSIONS.split(' ').any(|known| known[1..] == extension)
}

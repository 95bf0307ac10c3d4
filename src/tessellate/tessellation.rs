//! Facets with the account of what they hold to.

use super::report::Report;
use crate::mesh::FacetMesh;

/// What [`super::tessellate`] makes.
#[derive(Clone, Debug, Default)]
pub struct Tessellation {
    /// The facets of all placed faces; the id of a facet's face is its index in [`crate::model::Model::placed_faces`].
    pub mesh: FacetMesh,
    /// Counts of the result.
    pub report: Report,
    /// For each facet of the mesh: what it had to hold to, and whether it does.
    pub quality: Vec<FacetQuality>,
}

/// A facet's quality against its tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FacetQuality {
    /// Tolerance at the facet's place, mm; 0 for faces that are meshes in the file.
    pub tolerance: f64,
    /// Upper bound of the distance to its piece of the spline, mm, where certified; otherwise a value above the tolerance, perhaps
    /// infinite.
    pub bound: f64,
    /// Whether the bound is proved to be within the tolerance.
    pub certified: bool,
}

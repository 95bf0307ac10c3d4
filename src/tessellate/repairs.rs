//! Names the faces of which something was given up, and measures what was reached there.

use super::report::{Repair, RepairedFace};
use super::sample_budget::sample_lists;
use super::tessellation::Tessellation;
use crate::math::FaceId;
use crate::model::Model;

/// A placed face of which something was given up.
pub(super) struct PlacedRepair {
    pub(super) face: FaceId,
    pub(super) how: Repair,
    /// How far facets are at least from what was left out of its border, mm; 0 where nothing was.
    pub(super) left_out_mm: f64,
}

/// Names the repaired faces, in their order, and measures how far their facets are from the spline, and from what was left out of their
/// border, mm: proved where certified, sampled elsewhere, a share of the facets where all would take too long. Looks at nothing if there
/// are none.
pub(super) fn repaired_faces(made: &Tessellation, model: &Model, repairs: &[PlacedRepair]) -> Vec<RepairedFace> {
    if repairs.is_empty() {
        return Vec::new();
    }
    let entities: Vec<Option<u64>> = model.placed_faces().map(|f| f.entity()).collect();
    let facets = &made.mesh.facets;
    let split = |id: FaceId| -> (Vec<usize>, Vec<usize>) {
        // Facets stand in the order of their faces.
        let range = facets.partition_point(|f| f.face < id)..facets.partition_point(|f| f.face <= id);
        range.partition(|&f| made.quality[f].certified)
    };
    let (proved, open): (Vec<Vec<usize>>, Vec<Vec<usize>>) = repairs.iter().map(|r| split(r.face)).unzip();
    // What is proved needs no samples.
    let sampled = sample_lists(&made.mesh, model, &open);
    let one = |(k, &PlacedRepair { face: id, how, left_out_mm }): (usize, &PlacedRepair)| {
        let bounds = proved[k].iter().map(|&f| made.quality[f].bound);
        let reached_mm = sampled[k].iter().map(|s| s.sag).chain(bounds).fold(left_out_mm, f64::max);
        RepairedFace { face: id.0, entity: entities[id.index()], how, reached_mm }
    };
    repairs.iter().enumerate().map(one).collect()
}

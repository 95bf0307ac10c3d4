//! Names the faces of which something was given up, and measures what was reached there.

use super::report::{Repair, RepairedFace};
use super::sample;
use super::tessellation::Tessellation;
use crate::math::FaceId;
use crate::model::Model;

/// Names the repaired faces, in their order, and measures how far their facets are from the spline, mm: proved where certified, sampled
/// elsewhere. Looks at nothing if there are none.
pub(super) fn repaired_faces(
    made: &Tessellation,
    model: &Model,
    repairs: &[(FaceId, Repair)],
) -> Vec<RepairedFace> {
    if repairs.is_empty() {
        return Vec::new();
    }
    let entities: Vec<Option<u64>> = model.placed_faces().map(|f| f.entity()).collect();
    let reached = |id: FaceId| {
        let facets = &made.mesh.facets;
        // Facets stand in the order of their faces.
        let range = facets.partition_point(|f| f.face < id)..facets.partition_point(|f| f.face <= id);
        let (proved, open): (Vec<usize>, Vec<usize>) = range.partition(|&f| made.quality[f].certified);
        // What is proved needs no samples.
        let proved = proved.into_iter().map(|f| made.quality[f].bound).fold(0.0, f64::max);
        sample::sample_facets(&made.mesh, model, &open).iter().map(|s| s.sag).fold(proved, f64::max)
    };
    let one = |&(id, how): &(FaceId, Repair)| RepairedFace {
        face: id.0,
        entity: entities[id.index()],
        how,
        reached_mm: reached(id),
    };
    repairs.iter().map(one).collect()
}

//! Faces of which something was given up, and what was reached there.

use super::{Tessellation, sample};
use crate::math::FaceId;
use crate::model::Model;
use serde::Serialize;

/// What was given up on a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Repair {
    /// Its budget of facets ended: what was left has coarser cells.
    CoarserCells,
    /// Its border crosses itself in the parameter plane: parts of it are not kept.
    CrossingBorder,
    /// Its parameter plane gave nothing: only its border was triangulated.
    BorderOnly,
}

/// A face of which something was given up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RepairedFace {
    /// Index of the placed face.
    pub face: u32,
    /// The `#id` in the file.
    pub entity: Option<u64>,
    /// What was given up.
    pub how: Repair,
    /// The largest distance to its spline: proved for certified facets, sampled for the others, mm.
    pub reached_mm: f64,
}

/// Names the faces and measures what was reached.
pub(super) fn named(made: &Tessellation, model: &Model, repairs: &[(FaceId, Repair)]) -> Vec<RepairedFace> {
    if repairs.is_empty() {
        return Vec::new();
    }
    let entities: Vec<Option<u64>> = model.placed_faces().map(|f| f.entity()).collect();
    let reached = |id: FaceId| {
        let facets = &made.mesh.facets;
        let range = facets.partition_point(|f| f.face < id)..facets.partition_point(|f| f.face <= id);
        let (proved, open): (Vec<usize>, Vec<usize>) = range.partition(|&f| made.quality[f].certified);
        let proved = proved.into_iter().map(|f| made.quality[f].bound).fold(0.0, f64::max);
        sample::some(&made.mesh, model, &open).iter().map(|s| s.sag).fold(proved, f64::max)
    };
    let one = |&(id, how): &(FaceId, Repair)| RepairedFace {
        face: id.0,
        entity: entities[id.index()],
        how,
        reached_mm: reached(id),
    };
    repairs.iter().map(one).collect()
}

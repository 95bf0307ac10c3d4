//! A run that asks for no tolerance, normals or intersector is given them: what a pilot of its own rays finds sufficient.

use super::intersectors::IntersectorChoice;
use super::monitor::{Monitor, Stage, in_stage};
use super::settings::{IntersectorKind, MeshingSettings, TracingSettings};
use crate::intersect::exact::Exact;
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::simulate::{BoundScene, RunSettings, Scene};
use crate::study::default_accuracy::{self, Chosen, Undecided};
use crate::study::{MeasuredMesh, ModelMeshSource};
use crate::tessellate;
use std::sync::Arc;

/// What was chosen, as far as it changes the run.
pub(super) struct AccuracyChoice {
    pub(super) chosen: Chosen,
    pub(super) intersector: IntersectorChoice,
    /// Facets finer than the default ones, where these are taken.
    pub(super) finer: Option<MeasuredMesh>,
}

/// Whether settings or scene say how fine the facets are, what normals they carry or what finds the hits.
pub(super) fn is_asked(meshing: &MeshingSettings, tracing: &TracingSettings, scene: &Scene) -> bool {
    let accuracy = &scene.accuracy;
    let in_scene = accuracy.tolerance_mm.is_some()
        || accuracy.angle_deg.is_some()
        || accuracy.normals.is_some()
        || accuracy.intersector.is_some();
    // Tolerances of single places are a choice too.
    let places = !(meshing.part.is_empty() && meshing.face.is_empty() && meshing.role.is_empty());
    let facets = meshing.tolerance.is_some() || meshing.angle_deg.is_some() || meshing.plan.is_some() || places;
    in_scene || facets || tracing.normals.is_some() || tracing.intersector.is_some()
}

/// Chooses for a run whose facets of the default tolerance are made.
pub(super) fn choose(
    (model, spline): (&Model, Arc<Exact>),
    bound: &BoundScene,
    run: &RunSettings,
    (mesh, mesher): (&FacetMesh, &tessellate::Settings),
    monitor: &dyn Monitor,
) -> AccuracyChoice {
    let (chosen, finer) = in_stage(monitor, Stage::Choosing, || {
        let mut source = ModelMeshSource::with_spline(model, spline);
        source.mesher = mesher.clone();
        let tolerance = mesher.tolerance;
        default_accuracy::choose(&Undecided { model, bound, run, source: &source, facets: mesh, tolerance })
    });
    monitor.chosen(&chosen);
    let intersector = match chosen.intersector {
        "exact" => IntersectorKind::Exact,
        _ => IntersectorKind::Octree,
    };
    AccuracyChoice { intersector: IntersectorChoice { intersector, normals: chosen.normals }, chosen, finer }
}

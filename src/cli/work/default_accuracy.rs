//! A run that asks for no tolerance, normals or intersector is given them: what a pilot of its own rays finds sufficient.

use super::intersectors::IntersectorChoice;
use crate::cli::arguments::options::{IntersectorKind, MeshingOptions, TracingOptions};
use crate::cli::console::Console;
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::report::figures;
use crate::simulate::{BoundScene, RunSettings, Scene};
use crate::study::default_accuracy::{self, Chosen, Undecided};
use crate::study::{MeasuredMesh, ModelMeshSource};
use crate::tessellate;

/// What was chosen, as far as it changes the run.
pub(crate) struct AccuracyChoice {
    pub(crate) chosen: Chosen,
    pub(crate) intersector: IntersectorChoice,
    /// Facets finer than the default ones, where these are taken.
    pub(crate) finer: Option<MeasuredMesh>,
}

/// Whether options or scene say how fine the facets are, what normals they carry or what finds the hits.
pub(crate) fn is_asked(meshing: &MeshingOptions, tracing: &TracingOptions, scene: &Scene) -> bool {
    let accuracy = &scene.accuracy;
    let in_scene = accuracy.tolerance_mm.is_some()
        || accuracy.angle_deg.is_some()
        || accuracy.normals.is_some()
        || accuracy.intersector.is_some();
    let places = !(meshing.part.is_empty() && meshing.face.is_empty() && meshing.role.is_empty());
    let facets = meshing.tolerance.is_some() || meshing.angle.is_some() || meshing.plan.is_some() || places;
    in_scene || facets || tracing.normals.is_some() || tracing.intersector.is_some()
}

/// Chooses for a run whose facets of the default tolerance are made, and says what it took.
pub(crate) fn choose(
    model: &Model,
    bound: &BoundScene,
    run: &RunSettings,
    (mesh, mesher): (&FacetMesh, &tessellate::Settings),
    console: &Console,
) -> AccuracyChoice {
    let spinner = console.spinner("choosing facets or spline by a pilot");
    let mut source = ModelMeshSource::new(model);
    source.mesher = mesher.clone();
    let undecided = Undecided { model, bound, run, source: &source, facets: mesh, tolerance: mesher.tolerance };
    let (chosen, finer) = default_accuracy::choose(&undecided);
    spinner.finish_and_clear();
    console.say(in_words(&chosen));
    let intersector = match chosen.intersector {
        "exact" => IntersectorKind::Exact,
        _ => IntersectorKind::Octree,
    };
    AccuracyChoice { intersector: IntersectorChoice { intersector, normals: chosen.normals }, chosen, finer }
}

/// One line on what was chosen.
fn in_words(chosen: &Chosen) -> String {
    let [low, high] = chosen.tolerance_mm.map(|t| figures(t, 2));
    let how = match chosen.intersector {
        "exact" => "on the spline".to_owned(),
        _ => format!("on facets of {low}..{high} mm with {} normals", chosen.normals),
    };
    format!("tracing {how}: {}", chosen.because)
}

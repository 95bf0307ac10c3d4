//! The studies of what accuracy costs, on models that were read.

use crate::background::interruptible;
use crate::errors::{SceneError, of_json};
use crate::model::Model;
use crate::names::{normal_mode, require_tolerance};
use lampyris::intersect::NormalMode;
use lampyris::intersect::bvh::{self, Bvh};
use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::model::Model as Splines;
use lampyris::pipeline::Monitor;
use lampyris::study::cross_check::{self, Intersectors, cross_check};
use lampyris::study::rays::mixed_rays;
use lampyris::study::{FacetTree, MeshSource, ModelMeshSource, Progress, accuracy, interpolation};
use lampyris::tessellate::{self, tessellate};
use pyo3::prelude::*;
use serde_json::{Value, json};
use std::sync::Arc;

/// The settings of a study; each study takes those that it uses.
#[derive(Clone)]
struct Request {
    name: String,
    tolerances: Vec<[f64; 2]>,
    normals: Option<Vec<NormalMode>>,
    rays: Option<u64>,
    repetitions: Option<usize>,
    seed: u64,
}

/// Works out the document of a study.
type Run = fn(&Splines, &Request, &dyn Monitor) -> serde_json::Result<Value>;

/// Runs a study on a model and gives its document as JSON: `accuracy`, `interpolation` or `check`.
#[pyfunction]
#[pyo3(signature = (kind, model, name, tolerances = Vec::new(), normals = None, rays = None, repetitions = None, seed = 1, threads = None, progress = None))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn study(
    py: Python<'_>,
    kind: &str,
    model: &Model,
    name: String,
    tolerances: Vec<[f64; 2]>,
    normals: Option<Vec<String>>,
    rays: Option<u64>,
    repetitions: Option<usize>,
    seed: u64,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    tolerances.iter().try_for_each(|[low, high]| require_tolerance(*low, *high))?;
    let normals =
        normals.map(|n| n.iter().map(|name| normal_mode(name)).collect::<PyResult<Vec<_>>>()).transpose()?;
    let request = Request { name, tolerances, normals, rays, repetitions, seed };
    let (stage, run): (&'static str, Run) = match kind {
        "accuracy" => ("accuracy study", study_accuracy),
        "interpolation" => ("interpolation study", study_interpolation),
        "check" => ("cross-check", study_check),
        _ => return Err(SceneError::new_err(format!("study {kind}: use accuracy, interpolation or check"))),
    };
    let import = Arc::clone(&model.import);
    let outcome = interruptible(py, progress.as_ref(), threads, move |shared| {
        // How much there is to do is known once the study tells how far it is.
        shared.begin_stage(stage, 0);
        run(&import.model, &request, shared)
    })?;
    match outcome.stopped {
        Some(e) => Err(e),
        None => Ok(outcome.made.map_err(of_json)?.to_string()),
    }
}

/// Tolerance, kind of normals and intersector against the exact hits of the same rays.
fn study_accuracy(model: &Splines, request: &Request, monitor: &dyn Monitor) -> serde_json::Result<Value> {
    let source = ModelMeshSource::measuring(model);
    let mut settings = accuracy::Settings { seed: request.seed, ..accuracy::Settings::default() };
    if !request.tolerances.is_empty() {
        settings.tolerances = request.tolerances.clone();
    }
    settings.normals = request.normals.clone().unwrap_or(settings.normals);
    settings.trees = vec![FacetTree::Octree, FacetTree::CwBvh];
    settings.rays = request.rays.unwrap_or(settings.rays);
    settings.rounds = request.repetitions.unwrap_or(settings.rounds);
    let progress = |p: Progress| monitor.study_progress(&p);
    serde_json::to_value(accuracy::accuracy(&request.name, &source, &settings, &progress))
}

/// Errors and times of the ways to get normals.
fn study_interpolation(model: &Splines, request: &Request, monitor: &dyn Monitor) -> serde_json::Result<Value> {
    let source = ModelMeshSource::new(model);
    let mut settings = interpolation::Settings { seed: request.seed, ..interpolation::Settings::default() };
    settings.rays = request.rays.unwrap_or(settings.rays);
    settings.repetitions = request.repetitions.unwrap_or(settings.repetitions);
    let sources = [(request.name.as_str(), &source as &dyn MeshSource)];
    let progress = |p: Progress| monitor.study_progress(&p);
    serde_json::to_value(interpolation::interpolation(&sources, &settings, &progress))
}

/// The same rays through octree, BVH and spline, with a cause for every difference.
fn study_check(model: &Splines, request: &Request, monitor: &dyn Monitor) -> serde_json::Result<Value> {
    let mut mesher = tessellate::Settings::default();
    if let Some(tolerance) = request.tolerances.first() {
        mesher.tolerance = *tolerance;
    }
    let mesh = tessellate(model, &mesher).mesh;
    let octree = Octree::build(&mesh, &octree::Settings::default());
    let bvh = Bvh::build(&mesh, &bvh::Settings::default());
    let exact = Exact::build(model, &exact::Settings::default());
    let count = request.rays.unwrap_or(100_000);
    let rays = mixed_rays(&mesh.bounds(), &octree, mesher.loosest(), request.seed, count);
    let settings = cross_check::Settings { fallback_band_mm: mesher.loosest(), ..cross_check::Settings::default() };
    let intersectors = Intersectors { model, mesh: &mesh, octree: &octree, bvh: &bvh, exact: &exact };
    let progress = |p: Progress| monitor.study_progress(&p);
    let found = cross_check(&intersectors, &rays, &settings, &progress);
    let mut document = serde_json::to_value(&found)?;
    document["rows"] = json!([]);
    Ok(document)
}

//! `--accuracy 0.05deg`: a direction error asked for in place of a tolerance.

use super::intersectors::IntersectorChoice;
use super::ray_sampler::RaySampler;
use crate::cli::arguments::options::{self, IntersectorKind, MeshingOptions, TracingOptions};
use crate::cli::console::{Console, show_progress};
use crate::cli::failure::Failure;
use crate::intersect::{Intersector, NormalMode};
use crate::math::Ray;
use crate::model::Model;
use crate::simulate::{RunSettings, Scene, simulate};
use crate::study::ModelMeshSource;
use crate::study::accuracy_target::{AccuracyPlan, AccuracyTarget, meet_target, meet_target_for_rays};

/// How far above a surface a ray starts that left it, mm: facets lie at most 0.8 mm off the surface here.
const RAY_LIFT_MM: f64 = 1.0;

/// The options with tolerances and normals put in that reach what was asked, and how that went; unchanged when nothing was asked.
/// With a scene, its own rays are what the accuracy is about.
pub(crate) fn meshing_for(
    accuracy: Option<&str>,
    (meshing, tracing): (&MeshingOptions, &TracingOptions),
    scene: Option<&Scene>,
    model: &Model,
    console: &Console,
) -> Result<(MeshingOptions, TracingOptions, Option<AccuracyPlan>), Failure> {
    let Some(mut ask) = request(accuracy, meshing)? else { return Ok((meshing.clone(), tracing.clone(), None)) };
    let (mut meshing, mut tracing) = (meshing.clone(), tracing.clone());
    let choice = IntersectorChoice::new(&tracing, scene)?;
    if choice.intersector == IntersectorKind::Exact {
        let failure = Failure::arguments("--accuracy with the exact intersector: there is nothing to choose");
        return Err(failure.with_help("leave out --accuracy, or the intersector"));
    }
    ask.seed = tracing.seed.unwrap_or(ask.seed);
    ask.job_rays = tracing.rays().or(scene.map(|s| s.run.rays)).map_or(ask.job_rays, |n| n as f64);
    if let Some(normals) = tracing.normals {
        ask.kinds = vec![normals];
    }
    let product = ModelMeshSource::new(model);
    let bar = console.stage_bar("aiming");
    let progress = |p: crate::study::Progress| show_progress(&bar, &p);
    let found = match scene {
        None => meet_target(model, &product, &ask, &progress),
        Some(scene) => {
            let bound = scene.bind(model)?;
            let rays = |seed: u64, count: u64| {
                let settings = RunSettings { rays: count, seed, path_samples: 0, ..RunSettings::from(&scene.run) };
                scene_rays(&product, model, &settings, &bound)
            };
            meet_target_for_rays(model, &product, &ask, &rays, &progress)
        }
    };
    bar.finish_and_clear();
    console.say(&found.answer);
    meshing.plan = Some(found.plan.clone());
    tracing.normals = Some(found.normals);
    Ok((meshing, tracing, Some(found)))
}

/// The same for facets alone, whose readers interpolate the normals of their corners.
pub(crate) fn meshing_for_facets(
    accuracy: Option<&str>,
    meshing: &MeshingOptions,
    model: &Model,
    console: &Console,
) -> Result<(MeshingOptions, Option<AccuracyPlan>), Failure> {
    let Some(ask) = request(accuracy, meshing)? else { return Ok((meshing.clone(), None)) };
    let ask = AccuracyTarget { kinds: vec![NormalMode::Bilinear], job_rays: 0.0, ..ask };
    let bar = console.stage_bar("aiming");
    let found = meet_target(model, &ModelMeshSource::new(model), &ask, &|p| show_progress(&bar, &p));
    bar.finish_and_clear();
    console.say(&found.answer);
    Ok((MeshingOptions { plan: Some(found.plan.clone()), ..meshing.clone() }, Some(found)))
}

/// What the option asks for; `None` without it.
fn request(accuracy: Option<&str>, meshing: &MeshingOptions) -> Result<Option<AccuracyTarget>, Failure> {
    let Some(text) = accuracy else { return Ok(None) };
    let degrees = options::accuracy(text).map_err(|e| Failure::arguments(format!("--accuracy {text}: {e}")))?;
    if meshing.tolerance.is_some() {
        let failure = Failure::arguments("--accuracy and --tolerance both say how fine the facets are to be");
        return Err(failure.with_help("leave one of them out; --part NAME=MIN..MAX may stand beside --accuracy"));
    }
    Ok(Some(AccuracyTarget::degrees(degrees)))
}

/// Rays of the scene's own run on the spline, from the sources and from where they were turned; about as many as asked.
fn scene_rays(
    product: &ModelMeshSource<'_>,
    model: &Model,
    settings: &RunSettings,
    bound: &crate::simulate::BoundScene,
) -> Vec<Ray> {
    let exact: &dyn Intersector = product.spline();
    let sampler = RaySampler::new(exact, settings.rays, settings.rays);
    simulate(bound, &sampler, settings, &|_| true);
    sampler.rays(settings.rays as usize, model, RAY_LIFT_MM)
}

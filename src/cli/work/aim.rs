//! `--accuracy 0.05deg`: a direction error asked for in place of a tolerance.

use super::witness::Witness;
use crate::cli::Failure;
use crate::cli::arguments::options::{self, IntersectorKind, Meshing, Tracing};
use crate::cli::context::{Context, show};
use crate::intersect::{Intersector, NormalMode};
use crate::math::Ray;
use crate::model::Model;
use crate::simulate::{RunSettings, Scene, simulate};
use crate::study::ModelMeshSource;
use crate::study::accuracy_target::{AccuracyPlan, AccuracyTarget, meet_target, meet_target_for_rays};

/// The options with tolerances and normals put in that reach what was asked, and how that went; unchanged when nothing was asked.
/// With a scene, its own rays are what the accuracy is about.
pub(crate) fn meshing(
    asked: Option<&str>,
    (meshing, tracing): (&Meshing, &Tracing),
    scene: Option<&Scene>,
    model: &Model,
    context: &Context,
) -> Result<(Meshing, Tracing, Option<AccuracyPlan>), Failure> {
    let Some(mut ask) = ask(asked, meshing)? else { return Ok((meshing.clone(), tracing.clone(), None)) };
    let (mut meshing, mut tracing) = (meshing.clone(), tracing.clone());
    let choice = super::engine::Choice::new(&tracing, scene)?;
    if choice.intersector == IntersectorKind::Exact {
        let failure = Failure::arguments("--accuracy with the exact intersector: there is nothing to choose");
        return Err(failure.help("leave out --accuracy, or the intersector"));
    }
    ask.seed = tracing.seed.unwrap_or(ask.seed);
    ask.job_rays = tracing.rays.or(scene.map(|s| s.run.rays)).map_or(ask.job_rays, |n| n as f64);
    if let Some(normals) = tracing.normals {
        ask.kinds = vec![normals];
    }
    let product = ModelMeshSource::new(model);
    let bar = context.stages("aiming");
    let progress = |p: crate::study::Progress| show(&bar, &p);
    let found = match scene {
        None => meet_target(model, &product, &ask, &progress),
        Some(scene) => {
            let bound = scene.bind(model)?;
            let rays = |seed: u64, count: u64| {
                let settings = RunSettings { rays: count, seed, path_samples: 0, ..RunSettings::from(&scene.run) };
                rays_of(&product, model, &settings, &bound)
            };
            meet_target_for_rays(model, &product, &ask, &rays, &progress)
        }
    };
    bar.finish_and_clear();
    context.say(&found.answer);
    meshing.plan = Some(found.plan.clone());
    tracing.normals = Some(found.normals);
    Ok((meshing, tracing, Some(found)))
}

/// The same for facets alone, whose readers interpolate the normals of their corners.
pub(crate) fn facets(
    asked: Option<&str>,
    meshing: &Meshing,
    model: &Model,
    context: &Context,
) -> Result<(Meshing, Option<AccuracyPlan>), Failure> {
    let Some(ask) = ask(asked, meshing)? else { return Ok((meshing.clone(), None)) };
    let ask = AccuracyTarget { kinds: vec![NormalMode::Bilinear], job_rays: 0.0, ..ask };
    let bar = context.stages("aiming");
    let found = meet_target(model, &ModelMeshSource::new(model), &ask, &|p| show(&bar, &p));
    bar.finish_and_clear();
    context.say(&found.answer);
    Ok((Meshing { plan: Some(found.plan.clone()), ..meshing.clone() }, Some(found)))
}

fn ask(asked: Option<&str>, meshing: &Meshing) -> Result<Option<AccuracyTarget>, Failure> {
    let Some(text) = asked else { return Ok(None) };
    let degrees = options::accuracy(text).map_err(|e| Failure::arguments(format!("--accuracy {text}: {e}")))?;
    if meshing.tolerance.is_some() {
        let failure = Failure::arguments("--accuracy and --tolerance both say how fine the facets are to be");
        return Err(failure.help("leave one of them out; --part NAME=MIN..MAX may stand beside --accuracy"));
    }
    Ok(Some(AccuracyTarget::degrees(degrees)))
}

/// Rays of the scene's own run on the spline, from the sources and from where they were turned; about as many as asked.
fn rays_of(
    product: &ModelMeshSource<'_>,
    model: &Model,
    settings: &RunSettings,
    bound: &crate::simulate::BoundScene,
) -> Vec<Ray> {
    let exact: &dyn Intersector = product.spline();
    let witness = Witness::new(exact, settings.rays, settings.rays);
    simulate(bound, &witness, settings, &|_| true);
    // Facets lie at most 0.8 mm off the surface here.
    witness.rays(settings.rays as usize, model, 1.0)
}

//! A direction error asked for in place of a tolerance.

use super::error::Error;
use super::facets::mesh_settings;
use super::intersectors::IntersectorChoice;
use super::monitor::{Monitor, Stage, in_stage};
use super::ray_recorder::RayRecorder;
use super::settings::{IntersectorKind, MeshingSettings, TracingSettings};
use crate::intersect::{Cost, Intersector, NormalMode};
use crate::math::{Ray, Vector};
use crate::model::Model;
use crate::simulate::{MediaBeside, RunSettings, Scene, simulate};
use crate::study::accuracy_target::{
    AccuracyResult, AccuracyTarget, AngleError, JobLight, meet_target, meet_target_for_light,
};
use crate::study::{MeshSource, ModelMeshSource, Progress};

/// How far above a surface a ray starts that left it and meets nothing more, mm: facets lie at most 0.8 mm off the surface here.
const RAY_LIFT_MM: f64 = 1.0;
/// Where a ray starts that left a surface, as a share of its way to the next: in the middle, in free space whatever the facets. On its own
/// line: lifted off the wall of a light guide by a tenth of that way it met the next wall less flat, and 0.42° were claimed for 0.51°.
const STARTING_SHARE: f64 = 0.5;
/// Rays by which the number of segments of a path is estimated.
const PROBED_RAYS: u64 = 64;
/// Segments that are traced for each that is wanted, where paths are long: enough that those taken are of many paths.
const SEGMENTS_A_WANTED_RAY: f64 = 16.0;

/// Settings that keep an accuracy, and how that was reached; unchanged where none was asked for.
#[derive(Clone, Debug)]
pub struct AccurateSettings {
    /// How to make facets.
    pub meshing: MeshingSettings,
    /// How to trace.
    pub tracing: TracingSettings,
    /// How the accuracy was reached; `None` where none was asked for.
    pub plan: Option<AccuracyResult>,
}

/// Finds the tolerances and normals that keep the direction error of light within so many degrees, for random rays or, with a scene, for
/// its own, by tracing on facets and spline, and puts them into the settings; `None` leaves these as they are. Tells the monitor.
///
/// # Errors
/// When the angle is not above 0 and below 90 degrees, the settings give a tolerance too, ask for the exact intersector, or do not fit the
/// scene, or the scene does not fit the model.
pub fn settings_for_accuracy(
    accuracy_deg: Option<f64>,
    (mut meshing, mut tracing): (MeshingSettings, TracingSettings),
    scene: Option<&Scene>,
    model: &Model,
    monitor: &dyn Monitor,
) -> Result<AccurateSettings, Error> {
    // Without an accuracy nothing is looked for, and the settings go on as they are.
    let Some(mut ask) = target(accuracy_deg, &meshing)? else {
        return Ok(AccurateSettings { meshing, tracing, plan: None });
    };
    let choice = IntersectorChoice::new(&tracing, scene)?;
    // The spline has no direction error to be kept.
    if choice.intersector == IntersectorKind::Exact {
        let error = Error::setting("accuracy", "with the exact intersector: there is nothing to choose");
        return Err(error.help("leave out the accuracy, or the intersector"));
    }
    ask.seed = tracing.seed.unwrap_or(ask.seed);
    // What the job costs decides between finer facets and dearer normals.
    ask.job_rays = tracing.rays().or(scene.map(|s| s.run.rays)).map_or(ask.job_rays, |n| n as f64);
    // Who asks for a kind of normals gets that kind.
    if let Some(normals) = tracing.normals {
        ask.kinds = vec![normals];
    }
    let source = mesh_source(&meshing, scene, model)?;
    let progress = |p: Progress| monitor.study_progress(&p);
    let bound = scene.map(|scene| scene.bind(model).map(|bound| (scene, bound))).transpose()?;
    let found = in_stage(monitor, Stage::Aiming, || match &bound {
        None => meet_target(model, &source, &ask, &progress),
        Some((scene, bound)) => {
            let settings = RunSettings::from(&scene.run);
            let rays = |traced_on: &dyn Intersector, seed: u64, count: u64| {
                let run = RunSettings { rays: count, seed, path_samples: 0, ..settings.clone() };
                scene_rays(traced_on, model, &run, bound)
            };
            let media = MediaBeside::new(bound, source.exact(), &settings);
            let light = JobLight { rays: &rays, index_ratio: &|ray, hit| media.index_ratio(ray, hit) };
            meet_target_for_light(model, &source, &ask, light, &progress)
        }
    });
    let found = found.map_err(refused_angle)?;
    monitor.aimed(&found.answer);
    meshing.plan = Some(found.plan.clone());
    tracing.normals = Some(found.normals);
    Ok(AccurateSettings { meshing, tracing, plan: Some(found) })
}

/// Finds the local tolerances that keep the direction error within so many degrees with bilinear normals, for facets whose readers
/// interpolate those of their corners, and puts them into the settings; `None` leaves these as they are, without a plan. Tells the monitor.
///
/// # Errors
/// When the angle is not above 0 and below 90 degrees, or the settings give a tolerance too.
pub fn settings_for_accurate_facets(
    accuracy_deg: Option<f64>,
    meshing: MeshingSettings,
    model: &Model,
    monitor: &dyn Monitor,
) -> Result<(MeshingSettings, Option<AccuracyResult>), Error> {
    let Some(ask) = target(accuracy_deg, &meshing)? else { return Ok((meshing, None)) };
    // Readers of the facets interpolate between corners, and trace elsewhere: neither normals nor rays count.
    let ask = AccuracyTarget { kinds: vec![NormalMode::Bilinear], job_rays: 0.0, ..ask };
    let source = mesh_source(&meshing, None, model)?;
    monitor.begin(Stage::Aiming);
    let found = meet_target(model, &source, &ask, &|p| monitor.study_progress(&p));
    monitor.end();
    let found = found.map_err(refused_angle)?;
    monitor.aimed(&found.answer);
    Ok((MeshingSettings { plan: Some(found.plan.clone()), ..meshing }, Some(found)))
}

/// Returns what makes the facets of the search: with the angle and the tolerances of single places of the run itself.
///
/// # Errors
/// As of [`mesh_settings`].
fn mesh_source<'m>(
    meshing: &MeshingSettings,
    scene: Option<&Scene>,
    model: &'m Model,
) -> Result<ModelMeshSource<'m>, Error> {
    let mesher = mesh_settings(meshing, scene, model)?;
    let mut source = ModelMeshSource::new(model);
    source.mesher = mesher;
    Ok(source)
}

/// Returns the error of an angle that nothing can be aimed at.
fn refused_angle(error: AngleError) -> Error {
    Error::setting("accuracy", error.to_string())
}

/// Returns the target for a direction error, degrees; `None` without one.
///
/// # Errors
/// When the angle is not above 0 and below 90 degrees, or a tolerance is given too.
fn target(accuracy_deg: Option<f64>, meshing: &MeshingSettings) -> Result<Option<AccuracyTarget>, Error> {
    let Some(degrees) = accuracy_deg else { return Ok(None) };
    if meshing.tolerance.is_some() {
        let error = Error::setting("accuracy", "and the tolerance both say how fine the facets are to be");
        return Err(error.help("leave one of them out; tolerances of single parts may stand beside an accuracy"));
    }
    let target = AccuracyTarget::for_angle_deg(degrees);
    // Before the spline is built and rays are traced.
    target.check_angle().map_err(refused_angle)?;
    Ok(Some(target))
}

/// Traces the scene's run and returns a sample of its segments, from the sources and from surfaces, lifted off the latter: at most as many
/// as the run has rays.
fn scene_rays(
    traced_on: &dyn Intersector,
    model: &Model,
    settings: &RunSettings,
    bound: &crate::simulate::BoundScene,
) -> Vec<Ray> {
    // Some rays show how long paths are: in an integrating sphere they have a thousand segments, and as many are wanted as of others.
    let few = RunSettings { rays: settings.rays.min(PROBED_RAYS), ..settings.clone() };
    let segments = simulate(bound, traced_on, &few, &|_| true).segments.max(1);
    let enough = SEGMENTS_A_WANTED_RAY * settings.rays as f64 * few.rays as f64 / segments as f64;
    let run = RunSettings { rays: (enough as u64).clamp(few.rays, settings.rays), ..settings.clone() };
    // As many as are traced: about every ray meets one surface.
    let recorder = RayRecorder::new(traced_on, settings.rays, settings.rays);
    simulate(bound, &recorder, &run, &|_| true);
    let start = |ray: &Ray, up: Vector| match traced_on.intersect(ray, &mut Cost::default()) {
        Some(hit) => ray.point_at(STARTING_SHARE * hit.t),
        None => ray.origin + RAY_LIFT_MM * up,
    };
    recorder.rays(settings.rays as usize, model, start)
}

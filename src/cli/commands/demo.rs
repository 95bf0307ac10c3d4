//! `lampyris demo`: the main job on the built-in three-cavity lamp, in any folder, with nothing else installed.

use super::trace;
use crate::cli::arguments::options::{Meshing, Tracing};
use crate::cli::context::{Context, print};
use crate::cli::work::job::{self, Job};
use crate::cli::work::load;
use crate::cli::work::load::Loaded;
use crate::cli::{Failure, Outcome};
use crate::report::{figures, grouped, seconds};
use crate::simulate::Scene;
use crate::step;
use std::path::Path;

/// The lamp: housing with three paraboloids, clear cover, three LED blocks.
const LAMP: &[u8] = include_bytes!("../../../fixtures/step/lamp_multicavity.stp");
/// LEDs, media, mirrors and receivers around it.
const SCENE: &str = include_str!("../../../fixtures/scenes/demo.toml");

/// Share of the power that meets the wall at 25 m, and segments a ray, as other programs found them on facets of 0.001 mm
/// (Mitsuba 3.9, 2e7 rays).
const ELSEWHERE: [f64; 2] = [0.75595, 3.694];

pub(crate) fn run(
    folder: &Path,
    meshing: &Meshing,
    tracing: &Tracing,
    context: &Context,
) -> Result<Outcome, Failure> {
    context.say(context.strong("lampyris demo: a three-cavity lamp, from its STEP file to its light"));
    let (scene, loaded) = lamp()?;
    let faces: usize = loaded.reports.iter().map(|r| r.faces.converted).sum();
    let step_of = |name: &str, what: String, time: f64| {
        context.say(format_args!("  {name:<12} {what:<58} {:>9}", seconds(time)));
    };
    step_of("read", format!("{faces} faces of {} parts", loaded.model.parts.len()), loaded.seconds);
    let job = Job { scene: &scene, loaded: &loaded, meshing, tracing, recheck: 10_000, aimed: None };
    let prepared = job::prepare(job, context)?;
    let mesh = &prepared.tessellation.mesh;
    let [low, high] = prepared.mesh_settings.tolerance;
    let what = format!("{} facets within {low}..{high} mm of the splines", grouped(mesh.facets.len() as u64));
    step_of("tessellate", what, prepared.seconds);
    let start = std::time::Instant::now();
    let mut outcome = prepared.trace(job::Ways::default(), context);
    let both = start.elapsed().as_secs_f64();
    let (s, r) = (outcome.results.seconds, &outcome.results);
    step_of("build", format!("the {}", prepared.choice.intersector), s.build);
    let what = format!("{} rays, {} segments", grouped(r.rays), grouped(r.segments));
    step_of("trace", what, s.trace);
    if let Some(check) = &outcome.check {
        let what = format!("{} rays asked again of BVH and exact spline", grouped(check.rays));
        step_of("check", what, both - s.build - s.trace);
    }
    let comparison = comparison(r);
    let start = std::time::Instant::now();
    let (document, report) = prepared.write(folder, &mut outcome, comparison, context)?;
    step_of("write", format!("report, pictures, data into {}", folder.display()), start.elapsed().as_secs_f64());
    if context.json {
        print(&format!("{document:#}\n"))?;
    } else {
        trace::closing(&report.answer, folder, &outcome.results, context);
    }
    Ok(Outcome::Done)
}

/// The built-in lamp with its scene.
pub(crate) fn lamp() -> Result<(Scene, Loaded), Failure> {
    let scene = Scene::parse(SCENE, "demo.toml", Path::new("."))?;
    let loaded = load::scene_models(&scene, |_| {
        Ok(step::read_bytes("lamp_multicavity.stp", LAMP, &step::Settings::default())?)
    })?;
    Ok((scene, loaded))
}

/// How the run compares with what other programs found.
fn comparison(r: &crate::simulate::Results) -> Vec<String> {
    let Some(wall) = r.receivers.iter().find(|x| x.kind == "plane") else { return Vec::new() };
    let share = wall.power / r.power.emitted;
    let error = wall.power_error / r.power.emitted;
    let segments = r.segments as f64 / r.rays as f64;
    vec![format!(
        "An independent renderer (Mitsuba 3.9, 2·10⁷ rays on facets of 0.001 mm) finds **{} %** of the light on the wall at 25 m and \
         {} segments a ray; this run finds **{} ± {} %** and {}.",
        figures(100.0 * ELSEWHERE[0], 5),
        ELSEWHERE[1],
        figures(100.0 * share, 5),
        figures(100.0 * error, 2),
        figures(segments, 4)
    )]
}

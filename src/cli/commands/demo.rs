//! `lampyris demo`: the main job on the built-in three-cavity lamp, in any folder, with nothing else installed.

use crate::cli::arguments::command::ReportOption;
use crate::cli::console::Console;
use crate::cli::output::closing;
use crate::cli::work::output_place::{OutputPlace, try_folder};
use crate::cli::work::results_folder::{self, RunRemarks};
use crate::cli::work::run_commands::RunCommands;
use crate::cli::work::terminal_monitor::TerminalMonitor;
use crate::cli::work::threads::set_threads;
use crate::cli::{completion::Completion, failure::Failure};
use crate::formats::{read_bytes, write_atomic};
use crate::pipeline::{
    LoadedModel, MeshingSettings, PreparedScene, SceneJob, TraceRequest, TracingSettings, read_models,
};
use crate::report::{seconds, tolerance_text};
use crate::simulate::Scene;
use crate::step;
use crate::text::{figures, grouped};
use std::path::Path;

/// The lamp: housing with three paraboloids, clear cover, three LED blocks.
const LAMP: &[u8] = include_bytes!("../../../fixtures/step/lamp_multicavity.stp");
/// Its name in the scene.
const LAMP_FILE: &str = "../step/lamp_multicavity.stp";
/// LEDs, media, mirrors and receivers around it.
const SCENE: &str = include_str!("../../../fixtures/scenes/demo.toml");

/// Names of model and scene in the folder of results.
const MODEL_NAME: &str = "lamp.stp";
const SCENE_NAME: &str = "lamp.toml";

/// Share of the power that meets the wall at 25 m, and segments a ray, as other programs found them on facets of 0.001 mm
/// (Mitsuba 3.9, 2e7 rays).
const REFERENCE: [f64; 2] = [0.75595, 3.694];

/// Does the main job on the built-in lamp and writes everything into the folder, the lamp and its scene included.
pub(crate) fn run(
    folder: &Path,
    meshing: MeshingSettings,
    tracing: TracingSettings,
    report: ReportOption,
    console: &Console,
) -> Result<Completion, Failure> {
    console.say(console.bold("lampyris demo: a three-cavity lamp, from its STEP file to its light"));
    let scene_text = SCENE.replace(LAMP_FILE, MODEL_NAME);
    for (name, content) in [(MODEL_NAME, LAMP), (SCENE_NAME, scene_text.as_bytes())] {
        refuse_replacing(&folder.join(name), content)?;
    }
    try_folder(folder)?;
    set_threads(tracing.threads)?;
    let (scene, loaded) = lamp()?;
    let faces: usize = loaded.reports.iter().map(|r| r.faces.converted).sum();
    let say_step = |name: &str, what: String, time: f64| {
        console.say(format_args!("  {name:<12} {what:<58} {:>9}", seconds(time)));
    };
    say_step("read", format!("{faces} faces of {} parts", loaded.model.parts.len()), loaded.seconds);
    let monitor = TerminalMonitor::new(console);
    let job = SceneJob { meshing, tracing, ..SceneJob::new(scene, loaded) };
    let prepared = PreparedScene::new(job, &monitor)?;
    let facets = grouped(prepared.facets.facet_count() as u64);
    let what = format!("{facets} facets within {} of the splines", tolerance_text(prepared.mesh_settings.range()));
    say_step("tessellate", what, prepared.tessellation_seconds);
    // Claimed before the trace, which would be lost on a folder that cannot be written.
    let _owned = OutputPlace::folder(folder)?;
    let with_report = report.is_wanted();
    results_folder::try_folder(&prepared, folder, with_report)?;
    let mut run = prepared
        .trace(TraceRequest::default(), &monitor)
        .map_err(|_| Failure::running("demo: the run was stopped"))?;
    let r = &run.results;
    let s = r.seconds;
    say_step("build", format!("the {}", prepared.choice.intersector.in_words()), s.build);
    let what = format!("{} rays, {} segments", grouped(r.rays), grouped(r.segments));
    say_step("trace", what, s.trace);
    if let Some(check) = &run.check {
        let what = format!("{} ray segments traced again by BVH and exact spline", grouped(check.rays));
        say_step("check", what, s.check);
    }
    let commands = RunCommands::new(None, console);
    let remarks = RunRemarks { sentences: reference_comparison(r), target: None, commands };
    let start = std::time::Instant::now();
    let (document, answer) = results_folder::write(&prepared, folder, &mut run, &remarks, with_report, console)?;
    write_atomic(&folder.join(MODEL_NAME), |w| w.write_all(LAMP))?;
    // The scene beside its model, as a user would keep them.
    write_atomic(&folder.join(SCENE_NAME), |w| w.write_all(scene_text.as_bytes()))?;
    say_step("write", format!("report, pictures, data into {}", folder.display()), start.elapsed().as_secs_f64());
    closing::print_results(&document, &answer, folder, &run.results, with_report, console)?;
    console.say(format_args!(
        "  {}",
        console.dim("lamp.stp and lamp.toml beside them are yours to copy: `lampyris trace lamp.toml`")
    ));
    Ok(Completion::Complete)
}

/// Refuses to replace a file that is there and holds anything but `content`: somebody's own lamp.
fn refuse_replacing(file: &Path, content: &[u8]) -> Result<(), Failure> {
    if !file.exists() || read_bytes(file).is_ok_and(|bytes| bytes == content) {
        return Ok(());
    }
    let message = format!("{} already exists, and is not what the demo writes", file.display());
    Err(Failure::arguments(message).with_help("give another folder with -o"))
}

/// Reads the built-in lamp, as scene and model, from what is compiled in.
pub(crate) fn lamp() -> Result<(Scene, LoadedModel), Failure> {
    let scene = Scene::parse(SCENE, "demo.toml", Path::new("."))?;
    let settings = step::Settings { measure_box: false, ..step::Settings::default() };
    let loaded = read_models(&scene, |_| Ok(step::read_bytes("lamp_multicavity.stp", LAMP, &settings)?))?;
    Ok((scene, loaded))
}

/// Returns how the run compares with what other programs found, as a sentence for the report; none without a plane receiver.
fn reference_comparison(r: &crate::simulate::Results) -> Vec<String> {
    let Some(wall) = r.receivers.iter().find(|x| x.kind == "plane") else { return Vec::new() };
    let share = wall.power / r.power.emitted;
    let error = wall.power_error / r.power.emitted;
    let segments = r.segments as f64 / r.rays as f64;
    vec![format!(
        "An independent renderer (Mitsuba 3.9, 2·10⁷ rays on facets of 0.001 mm) finds **{} %** of the light on the wall at 25 m and \
         {} segments a ray; this run finds **{} ± {} %** and {}.",
        figures(100.0 * REFERENCE[0], 5),
        REFERENCE[1],
        figures(100.0 * share, 5),
        figures(100.0 * error, 2),
        figures(segments, 4)
    )]
}

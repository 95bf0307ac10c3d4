//! STEP files and scenes from disk.

use super::terminal_monitor::TerminalMonitor;
use crate::cli::arguments::command::PlacedLimit;
use crate::cli::console::Console;
use crate::cli::{completion::Completion, failure::Failure};
use crate::formats::lower_extension;
use crate::pipeline::{LoadedModel, PreparedScene, read_scene};
use crate::simulate::Scene;
use crate::step::{self, Import};
use crate::text::{count_of, grouped};
use std::path::Path;
use std::time::Instant;

/// Problems of files that are said in full; `lampyris info` has all of them.
const NAMED_PROBLEMS: usize = 3;

/// What a FILE argument turned out to be.
pub(crate) enum Input {
    /// A CAD model.
    Step(LoadedModel),
    /// A scene with its models in one.
    Scene(Box<Scene>, LoadedModel),
}

impl Input {
    /// The scene, if it is one.
    pub(crate) fn scene(&self) -> Option<&Scene> {
        if let Self::Scene(scene, _) = self { Some(scene) } else { None }
    }

    /// The model, or those of the scene in one.
    pub(crate) fn loaded(&self) -> &LoadedModel {
        let (Self::Step(loaded) | Self::Scene(_, loaded)) = self;
        loaded
    }
}

/// Reads one STEP file, showing a spinner meanwhile.
pub(crate) fn step_file(path: &Path, settings: &step::Settings, console: &Console) -> Result<Import, Failure> {
    let spinner = console.spinner(&format!("reading {}", path.display()));
    let import = step::read(path, settings);
    spinner.finish_and_clear();
    // That it is to be exported as STEP would be no advice on a scene.
    let is_scene = lower_extension(path) == "toml" && path.is_file();
    import.map_err(|error| if is_scene { scene_in_place_of_step(path) } else { error.into() })
}

/// Returns the failure of a command that takes STEP files alone and was given a scene.
fn scene_in_place_of_step(path: &Path) -> Failure {
    let failure = Failure::input(format!("{}: a scene, where a STEP file is needed", path.display()));
    failure
        .with_help("give the `file` of its [[model]]; `lampyris trace`, `check` and `study` take the scene itself")
}

/// Reads a STEP file as a model, in mm; fails where it holds no face that can be traced.
pub(crate) fn model_file(path: &Path, placed: PlacedLimit, console: &Console) -> Result<LoadedModel, Failure> {
    let start = Instant::now();
    let settings = step::Settings { measure_box: false, ..placed.settings() };
    let Import { model, report } = step_file(path, &settings, console)?;
    // Said here: a tracer without faces would answer with darkness.
    if model.placed_face_count() == 0 {
        let failure = Failure::input(format!("{}: the file holds no face that can be traced", path.display()));
        return Err(failure.with_help("run `lampyris info` on it to see what it holds and what was refused"));
    }
    Ok(LoadedModel { model, reports: vec![report], seconds: start.elapsed().as_secs_f64(), left_out: Vec::new() })
}

/// Reads a scene with its models when the name ends in `.toml`, and a STEP file otherwise; the limit holds for the latter alone.
pub(crate) fn scene_or_model(path: &Path, placed: PlacedLimit, console: &Console) -> Result<Input, Failure> {
    // By the name: a STEP file has several, a scene one.
    if lower_extension(path) == "toml" {
        let (scene, loaded) = read_scene(path, &TerminalMonitor::new(console))?;
        return Ok(Input::Scene(Box::new(scene), loaded));
    }
    Ok(Input::Step(model_file(path, placed, console)?))
}

/// Whether of so many faces that were found more were refused than the share `most`, or a file was cut off: how much of that is missing
/// is unknown, but it is less than all.
pub(crate) fn is_too_much_missing([refused, found]: [usize; 2], is_cut_off: bool, most: f64) -> bool {
    refused as f64 > most * found as f64 || is_cut_off && most < 1.0
}

/// Says how many of the faces found were refused, if any, quiet or not where that is why the exit code is not 0; `listing` goes on with
/// where they are named.
pub(crate) fn say_refused_faces([refused, found]: [usize; 2], is_reason: bool, listing: &str, console: &Console) {
    if refused > 0 {
        let verb = if refused == 1 { "was" } else { "were" };
        let [refused, found] = [refused, found].map(|count| grouped(count as u64));
        console.say_or_insist(is_reason, format!("{refused} of {found} faces {verb} refused{listing}"));
    }
}

/// Says what could not be read of the files, what they hide and how many faces were refused, if any; incomplete where the refused are a
/// larger share of all faces than `max_refused`, or a file was cut off or holds no face.
pub(crate) fn report_refusals(loaded: &LoadedModel, max_refused: f64, console: &Console) -> Completion {
    let [refused, found] = loaded.refused_faces();
    let problems: Vec<&String> = loaded.reports.iter().flat_map(|r| &r.problems).collect();
    for problem in problems.iter().take(NAMED_PROBLEMS) {
        console.say(format_args!("problem: {problem}"));
    }
    let rest = problems.len().saturating_sub(NAMED_PROBLEMS);
    if rest > 0 {
        console.say(format_args!("and {}; `lampyris info` lists them", count_of(rest as u64, "more problem")));
    }
    let hidden: usize = loaded.reports.iter().map(|r| r.hidden.len()).sum();
    if hidden > 0 {
        let items = count_of(hidden as u64, "item");
        console.say(format_args!("light meets {items} that the model hides; `lampyris info` lists them"));
    }
    let cut_off: Vec<&str> = loaded.reports.iter().filter(|r| r.cut_off).map(|r| r.file.as_str()).collect();
    let is_incomplete = is_too_much_missing([refused, found], !cut_off.is_empty(), max_refused);
    // Few enough to be allowed they are no more than a remark, which a file that was cut off does not make graver.
    let is_reason = is_too_much_missing([refused, found], false, max_refused);
    say_refused_faces([refused, found], is_reason, "; `lampyris info` lists them with the reasons", console);
    for file in cut_off.iter().filter(|_| max_refused < 1.0) {
        console.insist(format_args!("{file} ends before its end section: what is missing is unknown"));
    }
    let mut is_empty = false;
    for file in loaded.empty_files() {
        console.insist(format_args!("nothing of {file} is traced: it holds no face"));
        is_empty = true;
    }
    Completion::incomplete_if(is_incomplete || is_empty && max_refused < 1.0)
}

/// Says how many faces of a run that is traced on facets have none, if any: light passes where they are. Incomplete where that is a larger
/// share of all than `max_refused`.
pub(crate) fn report_bare_faces(prepared: &PreparedScene, max_refused: f64, console: &Console) -> Completion {
    let [bare, all] = prepared.bare_faces();
    if bare == 0 {
        return Completion::Complete;
    }
    let is_incomplete = bare as f64 > max_refused * all as f64;
    let [have, they_are, them] = if bare == 1 {
        ["has", "it is", "it with the reason"]
    } else {
        ["have", "they are", "them with the reasons"]
    };
    let [bare, all] = [bare, all].map(|count| grouped(count as u64));
    let message = format!(
        "{bare} of {all} faces {have} no facets, and light passes where {they_are}; `lampyris facet` names {them}"
    );
    console.say_or_insist(is_incomplete, message);
    Completion::incomplete_if(is_incomplete)
}

//! STEP files and scenes from disk, with the exit codes that their errors deserve.

use crate::cli::console::Console;
use crate::cli::{completion::Completion, failure::Failure};
use crate::model::Model;
use crate::simulate::scene::ModelUse;
use crate::simulate::{self, Scene};
use crate::step::{self, Import, ImportReport};
use std::path::Path;
use std::time::Instant;

/// A model with the accounts of the files it was read from.
pub(crate) struct LoadedModel {
    pub(crate) model: Model,
    pub(crate) reports: Vec<ImportReport>,
    pub(crate) seconds: f64,
}

/// What a FILE argument turned out to be.
pub(crate) enum Input {
    /// A CAD model.
    Step(LoadedModel),
    /// A scene with its models in one.
    Scene(Box<Scene>, LoadedModel),
}

/// Reads one STEP file, its lengths in the file's own unit or in one of so many mm.
pub(crate) fn step_file(path: &Path, unit_mm: Option<f64>, console: &Console) -> Result<Import, Failure> {
    let spinner = console.spinner(&format!("reading {}", path.display()));
    let import = step::read(path, &step::Settings { length_unit_mm: unit_mm, ..step::Settings::default() });
    spinner.finish_and_clear();
    Ok(import?)
}

/// A STEP file as a model.
pub(crate) fn model_file(path: &Path, console: &Console) -> Result<LoadedModel, Failure> {
    let start = Instant::now();
    let Import { model, report } = step_file(path, None, console)?;
    if model.placed_face_count() == 0 {
        let failure = Failure::input(format!("{}: the file holds no face that can be traced", path.display()));
        return Err(failure.with_help("run `lampyris info` on it to see what it holds and what was refused"));
    }
    Ok(LoadedModel { model, reports: vec![report], seconds: start.elapsed().as_secs_f64() })
}

/// Reads the models of a scene with `read`, which gets each entry of the scene.
pub(crate) fn scene_models(
    scene: &Scene,
    read: impl Fn(&ModelUse) -> Result<Import, Failure>,
) -> Result<LoadedModel, Failure> {
    let start = Instant::now();
    let (mut models, mut reports) = (Vec::new(), Vec::new());
    for (i, entry) in scene.models.iter().enumerate() {
        let shown = |failure: Failure| match scene.place_of_model(i) {
            Some(e) => failure.with_excerpt(e.0, e.1, e.2, "named here"),
            None => failure,
        };
        // Of a file that stands in many places one reading is enough: 4 ms each for a thousand lenses.
        let same = |e: &ModelUse| (&e.file, e.unit_mm) == (&entry.file, entry.unit_mm);
        let import = match scene.models[..i].iter().position(same) {
            Some(k) => Import { model: Model::clone(&models[k]), report: ImportReport::clone(&reports[k]) },
            None => read(entry).map_err(shown)?,
        };
        models.push(import.model);
        reports.push(import.report);
    }
    let model = scene.assemble(models)?;
    Ok(LoadedModel { model, reports, seconds: start.elapsed().as_secs_f64() })
}

/// Reads a scene file and the models it names.
pub(crate) fn scene_file(path: &Path, console: &Console) -> Result<(Scene, LoadedModel), Failure> {
    let is = |ending: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    if ["stp", "step", "p21"].into_iter().any(is) {
        let failure =
            Failure::arguments(format!("{}: a STEP file, where a scene (.toml) is needed", path.display()));
        let advice = "a STEP file alone has no light: name it under [[model]] of a scene with sources and receivers \
            (`lampyris schema` says how), or use `lampyris info`, `facet` or `check` on it";
        return Err(failure.with_help(advice));
    }
    let scene = Scene::read(path)?;
    let loaded = scene_models(&scene, |entry| step_file(&scene.resolve(&entry.file), entry.unit_mm, console))?;
    Ok((scene, loaded))
}

/// A scene when the name ends in `.toml`, a STEP file otherwise.
pub(crate) fn either(path: &Path, console: &Console) -> Result<Input, Failure> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        let (scene, loaded) = scene_file(path, console)?;
        return Ok(Input::Scene(Box::new(scene), loaded));
    }
    Ok(Input::Step(model_file(path, console)?))
}

/// Says what was refused and whether that is more than allowed.
pub(crate) fn report_refusals(reports: &[ImportReport], max_refused: f64, console: &Console) -> Completion {
    let (found, refused) = reports.iter().fold((0, 0), |(f, r), i| (f + i.faces.found, r + i.faces.refused));
    if refused == 0 {
        return Completion::Complete;
    }
    console
        .say(format_args!("{refused} of {found} faces were refused; `lampyris info` lists them with the reasons"));
    Completion::incomplete_if(refused as f64 > max_refused * found as f64)
}

impl From<step::Error> for Failure {
    fn from(e: step::Error) -> Self {
        Self::input(e.to_string())
    }
}

impl From<simulate::Error> for Failure {
    fn from(e: simulate::Error) -> Self {
        use simulate::ErrorKind;
        let place = match (e.file(), e.line()) {
            ("", _) => String::new(),
            (file, None) => format!("{file}: "),
            (file, Some((line, column))) => format!("{file}:{line}:{column}: "),
        };
        let message = format!("{place}{}", e.message());
        let mut failure = match e.kind() {
            ErrorKind::Unreadable => Self::input(e.message()),
            _ => Self::arguments(message),
        };
        if let Some(advice) = e.advice() {
            failure = failure.with_help(advice);
        }
        match (e.text(), e.span()) {
            (Some(text), Some(span)) => failure.with_excerpt(e.file(), text, span, "here"),
            _ => failure,
        }
    }
}

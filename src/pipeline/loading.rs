//! Scenes and the models that they name.

use super::cache::Cache;
use super::cached_model::read_step;
use super::error::Error;
use super::monitor::{Monitor, Stage, in_stage};
use crate::formats::lower_extension;
use crate::model::Model;
use crate::simulate::scene::ModelUse;
use crate::simulate::{LeftOut, Scene};
use crate::step::{self, Import, ImportReport};
use std::path::Path;
use std::time::Instant;

/// A model with the accounts of the files it was read from.
#[derive(Clone, Debug, Default)]
pub struct LoadedModel {
    /// All models of the scene in one.
    pub model: Model,
    /// What each file held, in the order of the scene.
    pub reports: Vec<ImportReport>,
    /// Seconds that reading took.
    pub seconds: f64,
    /// What the scene leaves out of the files.
    pub left_out: Vec<LeftOut>,
}

impl LoadedModel {
    /// Returns how many faces of the files were refused, and how many they hold.
    pub fn refused_faces(&self) -> [usize; 2] {
        let faces = || self.reports.iter().map(|report| &report.faces);
        [faces().map(|faces| faces.refused).sum(), faces().map(|faces| faces.found).sum()]
    }

    /// Returns the names of the files without a face that light could meet.
    pub fn empty_files(&self) -> impl Iterator<Item = &str> {
        self.reports.iter().filter(|report| report.faces_placed.converted == 0).map(|report| report.file.as_str())
    }

    /// Whether the model is what the files of the scene held when they were read, so that they stand for it; one without parts needs none.
    pub(super) fn is_from_files(&self, scene: &Scene) -> bool {
        let files = scene.models.len();
        self.model.instances.is_empty() || (files > 0 && self.reports.len() == files)
    }
}

/// Reads the models of a scene with `read`, which is called with an entry of each file, unit and limit, and puts them together.
///
/// # Errors
/// Those of `read`, and where the models cannot be put together.
pub fn read_models(scene: &Scene, read: impl Fn(&ModelUse) -> Result<Import, Error>) -> Result<LoadedModel, Error> {
    let start = Instant::now();
    let (mut models, mut reports) = (Vec::new(), Vec::new());
    for (i, entry) in scene.models.iter().enumerate() {
        // An error about a file is shown where the scene names it.
        let shown = |error: Error| match scene.place_of_model(i) {
            Some(place) => error.excerpt_of(place, "named here"),
            None => error,
        };
        // Of a file that stands in many places one reading is enough: 4 ms each for a thousand lenses.
        let same =
            |e: &ModelUse| (&e.file, e.unit_mm, e.max_placed) == (&entry.file, entry.unit_mm, entry.max_placed);
        let import = match scene.models[..i].iter().position(same) {
            Some(k) => Import { model: Model::clone(&models[k]), report: ImportReport::clone(&reports[k]) },
            None => read(entry).map_err(shown)?,
        };
        models.push(import.model);
        reports.push(import.report);
    }
    let mut left_out = Vec::new();
    for (i, model) in models.iter().enumerate() {
        left_out.extend(scene.left_out(i, model)?);
    }
    let model = scene.assemble(models)?;
    Ok(LoadedModel { model, reports, seconds: start.elapsed().as_secs_f64(), left_out })
}

/// Reads the models that a scene names, from its folder, or takes those from the cache that it keeps.
///
/// # Errors
/// When one cannot be read, or they cannot be put together.
pub fn read_scene_models(
    scene: &Scene,
    cache: Option<&Cache>,
    monitor: &dyn Monitor,
) -> Result<LoadedModel, Error> {
    read_models(scene, |entry| {
        let path = scene.resolve(&entry.file);
        let import =
            in_stage(monitor, Stage::Reading(&path), || read_step(&path, &step_settings(entry), cache, monitor));
        import.map_err(|e| {
            let is_limit = matches!(e.kind(), step::ErrorKind::TooManyPlaced { .. });
            let error = Error::from(e);
            if is_limit { error.help("`max_placed` under this [[model]] raises the limit") } else { error }
        })
    })
}

/// Returns how the file of a scene's model is read: with its unit and limit, and without a box of the model.
pub fn step_settings(entry: &ModelUse) -> step::Settings {
    let usual = step::Settings::default();
    step::Settings {
        length_unit_mm: entry.unit_mm,
        max_placed: entry.max_placed.unwrap_or(usual.max_placed),
        // The box of the model is not asked for in a scene, and costs a look at every surface.
        measure_box: false,
        ..usual
    }
}

/// Reads a scene file and the models it names.
///
/// # Errors
/// When the file is no scene, or a model cannot be read.
pub fn read_scene(path: &Path, monitor: &dyn Monitor) -> Result<(Scene, LoadedModel), Error> {
    read_cached_scene(path, None, monitor)
}

/// As [`read_scene`], but takes models from the cache that it keeps, and keeps those that it does not.
///
/// # Errors
/// As [`read_scene`].
pub fn read_cached_scene(
    path: &Path,
    cache: Option<&Cache>,
    monitor: &dyn Monitor,
) -> Result<(Scene, LoadedModel), Error> {
    // The likely slip: the CAD file in place of the scene.
    if matches!(lower_extension(path).as_str(), "stp" | "step" | "p21") {
        let error = Error::request(format!("{}: a STEP file, where a scene (.toml) is needed", path.display()));
        let advice = "a STEP file alone has no light: `lampyris init` writes a scene for it, with a source and receivers; `lampyris info`, \
                      `facet` and `check` take the file itself";
        return Err(error.help(advice));
    }
    let scene = Scene::read(path)?;
    let loaded = read_scene_models(&scene, cache, monitor)?;
    Ok((scene, loaded))
}

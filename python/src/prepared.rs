//! Scenes that are bound, faceted and ready to be traced.

use crate::accounts::model_notes;
use crate::arrays::{flat, shaped};
use crate::background::{Outcome, interruptible};
use crate::errors::{of_json, of_pipeline, of_scene};
use crate::mesh::Mesh;
use crate::model::Model;
use crate::part::{self, KeptRun, Part, PartHeader, PreparedRun, keeping};
use crate::results::Results;
use crate::settings::Settings;
use lampyris::pipeline::{
    self, AccurateSettings, ErrorTarget, GrowingSearch, LoadedModel, PreparedScene, SceneJob, TraceRequest,
    read_models, settings_for_accuracy,
};
use lampyris::simulate::{MOST_LISTED_RAYS, PartialRun, RunSettings, Scene, listed_ends, ray_lists};
use lampyris::step::{self, Import};
use numpy::PyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Results, or the part that was done, and the exception that stopped it.
type Traced = (Option<Results>, Option<Part>, Option<PyErr>);
/// The same with what came of the error that was asked for, as JSON.
type TracedUntil = (Option<Results>, Option<Part>, Option<PyErr>, Option<String>);

/// An array of whole or real numbers.
type Array<'py, T> = Bound<'py, PyArrayDyn<T>>;
/// Ends of listed rays: source, ray, branch, event, face, bounces; point, direction, power; the words of events.
type Ends<'py> = (
    (Array<'py, u32>, Array<'py, u64>, Array<'py, u32>, Array<'py, u8>, Array<'py, i64>, Array<'py, u32>),
    (Array<'py, f64>, Array<'py, f64>, Array<'py, f64>),
    Vec<(u8, String)>,
);

/// A scene whose facets are made and whose intersector is chosen.
#[pyclass(frozen, module = "lampyris")]
pub(crate) struct Prepared {
    scene: Arc<PreparedScene>,
    fingerprint: String,
    threads: Option<usize>,
}

#[pymethods]
impl Prepared {
    /// Reads the models of a scene, binds it, makes facets, and chooses how to trace where nobody asks.
    #[new]
    #[pyo3(signature = (text, name, folder, models, settings, progress = None))]
    fn new(
        py: Python<'_>,
        text: &str,
        name: &str,
        folder: PathBuf,
        models: Vec<Py<Model>>,
        settings: Settings,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let scene = Scene::parse(text, name, &folder).map_err(of_scene)?;
        let (meshing, tracing) = (settings.meshing()?, settings.tracing()?);
        let accuracy_deg = settings.accuracy_deg;
        let threads = tracing.threads;
        let read: Vec<ReadModel> = models.iter().map(|m| ReadModel::new(m.get())).collect();
        let prepare = move |monitor: &dyn pipeline::Monitor| {
            let loaded = load(&scene, &read, monitor)?;
            let requested = (meshing, tracing);
            let AccurateSettings { meshing, tracing, plan } =
                settings_for_accuracy(accuracy_deg, requested, Some(&scene), &loaded.model, monitor)?;
            let job = SceneJob { meshing, tracing, accuracy: plan, ..SceneJob::new(scene, loaded) };
            let prepared = PreparedScene::new(job, monitor)?;
            let hash = prepared.fingerprint()?.0;
            Ok((prepared, hash))
        };
        let outcome = interruptible(py, progress.as_ref(), threads, move |shared| prepare(shared))?;
        if let Some(e) = outcome.stopped {
            return Err(e);
        }
        let (scene, fingerprint) = outcome.made.map_err(of_pipeline)?;
        Ok(Self { scene: Arc::new(scene), fingerprint, threads })
    }

    /// Traces; gives results, or the part that was done when it was stopped, and the exception that stopped it.
    #[pyo3(signature = (resume = None, progress = None, verify = false))]
    fn trace(
        &self,
        py: Python<'_>,
        resume: Option<&Part>,
        progress: Option<Py<PyAny>>,
        verify: bool,
    ) -> PyResult<Traced> {
        let (from, scene) = self.start(resume)?;
        let kept = Arc::new(KeptRun::default());
        let (for_work, keeper) = (scene.clone(), kept.clone());
        let work = move |monitor: &dyn pipeline::Monitor| {
            let keep = |run: &PartialRun| keeper.keep(run, &for_work);
            for_work.trace(TraceRequest { verify_pruning: verify, from, ..keeping(&keep) }, monitor)
        };
        match interruptible(py, progress.as_ref(), self.threads, move |s| work(s)) {
            Ok(Outcome { made: Ok(found), stopped: None }) => Ok((Some(Results::new(scene, found)), None, None)),
            Ok(Outcome { made: Err(run), stopped }) => Ok((None, Some(self.part(*run, scene)?), stopped)),
            Ok(Outcome { made: Ok(_), stopped: Some(e) }) | Err(e) => {
                let (part, e) = self.kept_part(&kept, e)?;
                Ok((None, Some(part), Some(e)))
            }
        }
    }

    /// Traces part `index` (from 0) of `count` but for the replicates, rising, that are done elsewhere; gives what was done, and the
    /// exception that stopped it.
    #[pyo3(signature = (index, count, elsewhere = Vec::new(), progress = None))]
    fn trace_part(
        &self,
        py: Python<'_>,
        index: u32,
        count: u32,
        elsewhere: Vec<u32>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(Part, Option<PyErr>)> {
        if index >= count {
            return Err(PyValueError::new_err(format!(
                "part {index} of {count}: the index counts from 0 and is less than the count, as in (0, 4) to (3, 4)"
            )));
        }
        let scene = self.scene.clone();
        let work = move |monitor: &dyn pipeline::Monitor| {
            let replicates = scene.replicate_range().end;
            let from = PartialRun::done_elsewhere(&scene.bound, replicates, elsewhere.clone());
            let request = TraceRequest { from: Some(from), shard: Some([index, count]), ..TraceRequest::default() };
            let mut run = scene.trace_part(request, monitor);
            run.leave_out(&elsewhere);
            run
        };
        let Outcome { made, stopped } = interruptible(py, progress.as_ref(), self.threads, move |s| work(s))?;
        Ok((self.part(made, self.scene.clone())?, stopped))
    }

    /// Traces as many rays as the error asks for, from where an earlier search was stopped; gives what was found of it as JSON too.
    #[pyo3(signature = (until, resume = None, progress = None))]
    fn trace_until(
        &self,
        py: Python<'_>,
        until: &str,
        resume: Option<&Part>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<TracedUntil> {
        let (from, start) = self.start(resume)?;
        let target = ErrorTarget::new(until, &self.scene.job.scene).map_err(of_pipeline)?;
        let mut scene = PreparedScene::clone(&self.scene);
        let resume_rays = from.as_ref().map(|_| start.run_settings().rays);
        let kept = Arc::new(KeptRun::starting_from(from));
        let keeper = kept.clone();
        let work = move |monitor: &dyn pipeline::Monitor| {
            let (run, result) = target.trace(&mut scene, GrowingSearch { resume_rays, keeper: &*keeper }, monitor);
            if !run.is_whole() {
                return (Err(Box::new(run)), scene, result);
            }
            let request = TraceRequest { from: Some(run), ..TraceRequest::default() };
            (scene.trace(request, monitor), scene, result)
        };
        let outcome = interruptible(py, progress.as_ref(), self.threads, move |s| work(s));
        let Outcome { made: (found, scene, result), stopped } = match outcome {
            Ok(outcome) => outcome,
            Err(e) => {
                let (part, e) = self.kept_part(&kept, e)?;
                return Ok((None, Some(part), Some(e), None));
            }
        };
        let (scene, words) = (Arc::new(scene), Some(serde_json::to_string(&result).map_err(of_json)?));
        match (found, stopped) {
            (Ok(found), None) => Ok((Some(Results::new(scene, found)), None, None, words)),
            (Ok(_), Some(e)) => {
                let (part, e) = self.kept_part(&kept, e)?;
                Ok((None, Some(part), Some(e), words))
            }
            (Err(run), stopped) => Ok((None, Some(self.part(*run, scene)?), stopped, words)),
        }
    }

    /// Where every ray of the scene's lists ended: arrays of source, ray, branch, event, face (-1 for none), bounces, point, direction,
    /// power, and the numbers of events with their words.
    ///
    /// Raises `ValueError` where no source is a list, and for lists of too many rays.
    #[pyo3(signature = (progress = None))]
    fn ends<'py>(&self, py: Python<'py>, progress: Option<Py<PyAny>>) -> PyResult<Ends<'py>> {
        let lists = ray_lists(&self.scene.bound);
        if lists.is_empty() {
            return Err(PyValueError::new_err(
                "no source of this scene is a list of rays, as lampyris.rays(…); run.paths has some paths of any source",
            ));
        }
        let rays: u64 = lists.iter().map(|(_, rays)| rays).sum();
        if rays > MOST_LISTED_RAYS {
            return Err(PyValueError::new_err(format!(
                "the lists have {rays} rays, of which at most {MOST_LISTED_RAYS} can be followed one by one; give shorter lists"
            )));
        }
        let scene = self.scene.clone();
        let work = move |monitor: &dyn pipeline::Monitor| {
            let settings = RunSettings { threads: scene.threads, ..scene.run_settings() };
            scene.with_intersector(monitor, |intersector, _| listed_ends(&scene.bound, intersector, &settings))
        };
        let Outcome { made: ends, stopped } = interruptible(py, progress.as_ref(), self.threads, move |s| work(s))?;
        if let Some(e) = stopped {
            return Err(e);
        }
        let n = ends.len();
        let mut words: Vec<(u8, String)> = Vec::new();
        for event in ends.iter().map(|end| end.event) {
            if words.iter().all(|(code, _)| *code != event as u8) {
                let word = serde_json::to_value(event).map_err(of_json)?;
                words.push((event as u8, word.as_str().unwrap_or("unknown").to_owned()));
            }
        }
        let numbers = (
            shaped(py, ends.iter().map(|end| end.source).collect(), &[n])?,
            shaped(py, ends.iter().map(|end| end.ray).collect(), &[n])?,
            shaped(py, ends.iter().map(|end| end.branch).collect(), &[n])?,
            shaped(py, ends.iter().map(|end| end.event as u8).collect(), &[n])?,
            shaped(py, ends.iter().map(|end| end.face.map_or(-1, i64::from)).collect(), &[n])?,
            shaped(py, ends.iter().map(|end| end.bounces).collect(), &[n])?,
        );
        let places = (
            shaped(py, flat(ends.iter().map(|end| end.point)), &[n, 3])?,
            shaped(py, flat(ends.iter().map(|end| end.direction)), &[n, 3])?,
            shaped(py, ends.iter().map(|end| end.power).collect(), &[n])?,
        );
        Ok((numbers, places, words))
    }

    /// A part from its bytes.
    ///
    /// Raises `ValueError` when they are damaged or of another run.
    fn read_part(&self, bytes: &[u8]) -> PyResult<Part> {
        let scene = match part::rays_found(bytes)? {
            // The part of a search for the number of rays knows how far that had come.
            Some(rays) => {
                let mut scene = PreparedScene::clone(&self.scene);
                scene.rays = Some(rays);
                Arc::new(scene)
            }
            None => self.scene.clone(),
        };
        let run = part::read(bytes, &self.fingerprint_of(&scene)?, &scene)?;
        self.part(run, scene)
    }

    /// A hash of all that decides the bits of the run.
    #[getter]
    fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    /// The number of rays.
    #[getter]
    fn rays(&self) -> u64 {
        self.scene.run_settings().rays
    }

    /// The facets.
    #[getter]
    fn mesh(&self) -> Mesh {
        Mesh::of_scene(self.scene.facets.whole().into_owned())
    }

    /// Sentences on what the models of the scene lack.
    fn model_notes(&self) -> Vec<String> {
        model_notes(&self.scene)
    }

    /// How it is traced and why, what is in the scene, as JSON.
    fn summary_json(&self) -> PyResult<String> {
        let scene = &self.scene;
        let [finest, loosest] = scene.mesh_settings.range();
        let settings = scene.run_settings();
        let summary = json!({
            "rays": settings.rays, "seed": settings.seed, "threads": scene.threads,
            "tolerance_mm": [finest, loosest], "facets": scene.facets.facet_count(),
            "intersector": scene.choice.intersector.name(), "normals": scene.choice.normals.name(),
            "unit": scene.power_unit(), "chosen": scene.chosen, "notes": scene.bound.notes(),
            "accounts": scene.job.loaded.reports,
        });
        serde_json::to_string(&summary).map_err(of_json)
    }
}

impl Prepared {
    /// What to go on from, and the scene with the number of rays of that run; `None` with this scene where nothing is done.
    ///
    /// # Errors
    /// `ValueError` for a part of another run.
    fn start(&self, part: Option<&Part>) -> PyResult<(Option<PartialRun>, Arc<PreparedScene>)> {
        let Some(part) = part else { return Ok((None, self.scene.clone())) };
        let Some(of) = &part.of else {
            let own = self.read_part(&part.bytes()?)?;
            let scene = own.of.map_or_else(|| self.scene.clone(), |of| of.scene);
            return Ok((Some(own.run), scene));
        };
        if of.asked != self.fingerprint {
            return Err(PyValueError::new_err(format!(
                "resume: this part is of another run ({}); trace it with the same scene, files, settings and version",
                part.header.fingerprint
            )));
        }
        Ok((Some(part.run.clone()), of.scene.clone()))
    }

    /// The hash of this scene with another number of rays, or with its own.
    fn fingerprint_of(&self, scene: &Arc<PreparedScene>) -> PyResult<String> {
        if Arc::ptr_eq(scene, &self.scene) {
            return Ok(self.fingerprint.clone());
        }
        Ok(scene.fingerprint().map_err(of_pipeline)?.0)
    }

    /// A part of this run; `scene` has the number of rays where it was found by tracing.
    fn part(&self, run: PartialRun, scene: Arc<PreparedScene>) -> PyResult<Part> {
        let header = PartHeader::new(self.fingerprint_of(&scene)?, &scene);
        Ok(Part { run, header, of: Some(PreparedRun { scene, asked: self.fingerprint.clone() }) })
    }

    /// What was traced in full before the work was stopped.
    ///
    /// # Errors
    /// The exception that stopped it, where nothing was.
    fn kept_part(&self, kept: &KeptRun, stopped: PyErr) -> Result<(Part, PyErr), PyErr> {
        let Some((run, of)) = kept.take() else { return Err(stopped) };
        Ok((self.part(run, of)?, stopped))
    }
}

/// A model that was read already.
struct ReadModel {
    path: PathBuf,
    unit_mm: Option<f64>,
    import: Arc<Import>,
}

impl ReadModel {
    fn new(model: &Model) -> Self {
        let (path, unit_mm) = model.source();
        Self { path, unit_mm, import: model.import.clone() }
    }
}

/// The models of a scene: those that were read already, and the others from their files.
fn load(
    scene: &Scene,
    read: &[ReadModel],
    monitor: &dyn pipeline::Monitor,
) -> Result<LoadedModel, pipeline::Error> {
    read_models(scene, |entry| {
        let path = scene.resolve(&entry.file);
        let same = |m: &&ReadModel| m.path == path && m.unit_mm == entry.unit_mm;
        if let Some(known) = read.iter().find(same) {
            return Ok(Import { model: known.import.model.clone(), report: known.import.report.clone() });
        }
        let settings = pipeline::step_settings(entry);
        monitor.begin(pipeline::Stage::Reading(&path));
        let import = step::read(Path::new(&path), &settings);
        monitor.end();
        Ok(import?)
    })
}

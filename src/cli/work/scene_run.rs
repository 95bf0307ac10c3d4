//! The main job: a scene that is read, bound, faceted and traced. `trace`, `merge` and `demo` share it.

use super::default_accuracy;
use super::facets;
use super::input_files::LoadedModel;
use super::intersectors::{self, IntersectorChoice};
use super::path_file::PathFile;
use super::threads;
use crate::cli::arguments::options::{MeshingOptions, TracingOptions};
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::cli::interruption::{self, SaveableRun};
use crate::intersect::Intersector;
use crate::simulate::{
    BoundScene, Hooks, PartialRun, PathSink, PathVertex, Progress, RunSettings, Scene, Traced, trace,
};
use crate::study::accuracy_target::AccuracyPlan;
use crate::study::default_accuracy::Chosen;
use crate::tessellate::{self, Tessellation};
use std::time::Duration;

/// Ray paths kept for the page and for `paths.vtp`.
const RECORDED_PATHS: u64 = 2000;

/// A scene with its model, and what to do beside tracing it.
pub(crate) struct SceneJob<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) loaded: &'a LoadedModel,
    pub(crate) meshing: &'a MeshingOptions,
    pub(crate) tracing: &'a TracingOptions,
    /// How an accuracy that was asked for was reached.
    pub(crate) accuracy: Option<&'a AccuracyPlan>,
}

/// A job whose scene fits its model and whose facets are made.
pub(crate) struct PreparedScene<'a> {
    pub(crate) job: SceneJob<'a>,
    pub(crate) bound: BoundScene,
    pub(crate) tessellation: Tessellation,
    pub(crate) mesh_settings: tessellate::Settings,
    /// Seconds that the facets took.
    pub(crate) tessellation_seconds: f64,
    pub(crate) choice: IntersectorChoice,
    pub(crate) threads: usize,
    /// Rays to trace from the first on, in place of what the options and the scene say.
    pub(crate) rays: Option<u64>,
    /// Why it is traced as it is, where nobody asked for it.
    pub(crate) chosen: Option<Chosen>,
}

/// How to trace beside the settings.
#[derive(Clone, Default)]
pub(crate) struct TraceRequest<'a> {
    /// With the full kernel too.
    pub(crate) verify_pruning: bool,
    /// What is done already.
    pub(crate) from: Option<PartialRun>,
    /// Which part of how many, from 0.
    pub(crate) shard: Option<[u32; 2]>,
    /// Told of all that is done, each thread after so long.
    pub(crate) finished: Option<&'a (dyn Fn(&PartialRun) + Sync)>,
    pub(crate) every: Duration,
    /// Whether what is traced is saved when a signal asks the run to stop.
    pub(crate) is_saveable: bool,
    /// Takes every path.
    pub(crate) paths: Option<&'a PathFile>,
}

/// Binds the scene (so that its mistakes come before any work) and makes the facets.
pub(crate) fn prepare<'a>(job: SceneJob<'a>, console: &Console) -> Result<PreparedScene<'a>, Failure> {
    let threads = threads::set_threads(job.tracing.threads)?;
    let choice = IntersectorChoice::new(job.tracing, Some(job.scene))?;
    let bound = job.scene.bind(&job.loaded.model)?;
    let mesh_settings = facets::mesh_settings(job.meshing, Some(job.scene), &job.loaded.model)?;
    let (tessellation, tessellation_seconds) = facets::facets(&job.loaded.model, &mesh_settings, console);
    let mut prepared = PreparedScene {
        job,
        bound,
        tessellation,
        mesh_settings,
        tessellation_seconds,
        choice,
        threads,
        rays: None,
        chosen: None,
    };
    if !default_accuracy::is_asked(prepared.job.meshing, prepared.job.tracing, prepared.job.scene) {
        prepared.choose_accuracy(console);
    }
    Ok(prepared)
}

impl PreparedScene<'_> {
    /// Takes the facets or the spline that a pilot of the run's own rays finds sufficient.
    fn choose_accuracy(&mut self, console: &Console) {
        let run = self.run_settings();
        let facets = (&self.tessellation.mesh, &self.mesh_settings);
        let choice = default_accuracy::choose(&self.job.loaded.model, &self.bound, &run, facets, console);
        if let Some(finer) = choice.finer {
            self.tessellation.mesh = finer.mesh;
            self.tessellation_seconds += finer.seconds;
            self.mesh_settings.tolerance = choice.chosen.tolerance_mm;
        }
        self.choice = choice.intersector;
        self.chosen = Some(choice.chosen);
    }

    /// The run's settings: the scene's, with the options over them.
    pub(crate) fn run_settings(&self) -> RunSettings {
        let mut settings = RunSettings::from(&self.job.scene.run);
        settings.rays = self.rays.or(self.job.tracing.rays()).unwrap_or(settings.rays);
        if let Some(first) = self.job.tracing.ray_range.and_then(|range| range.first) {
            settings.first_ray = if self.rays.is_some() { 0 } else { first };
            settings.grows = true;
        }
        settings.seed = self.job.tracing.seed.unwrap_or(settings.seed);
        settings.threads = self.threads;
        settings.path_samples = RECORDED_PATHS.min(settings.rays);
        settings
    }

    /// The replicates that are asked for: those of the rays from the first up to the last.
    pub(crate) fn replicate_range(&self) -> std::ops::Range<u32> {
        crate::simulate::replicate_range(&self.bound, &self.run_settings())
    }

    /// Traces the replicates that are asked for and gives their sums.
    pub(crate) fn trace_part(&self, request: TraceRequest, console: &Console) -> PartialRun {
        let settings = RunSettings { shard: request.shard.unwrap_or([0, 1]), ..self.run_settings() };
        self.with_intersector(console, |intersector, _| self.run(intersector, &settings, request, console).partial)
    }

    /// Builds the intersector of the run for `work`, which also gets the seconds that it took.
    pub(crate) fn with_intersector<T>(
        &self,
        console: &Console,
        work: impl FnOnce(&dyn Intersector, f64) -> T,
    ) -> T {
        let (model, mesh) = (&self.job.loaded.model, &self.tessellation.mesh);
        intersectors::with_intersector(self.choice, model, mesh, console, |intersector, footprint| {
            work(intersector, footprint.build_seconds)
        })
    }

    /// Traces with progress on the terminal; ends early when the paths can no longer be written, and when a signal asks a run to
    /// stop that can be saved.
    pub(crate) fn run(
        &self,
        intersector: &dyn Intersector,
        settings: &RunSettings,
        request: TraceRequest,
        console: &Console,
    ) -> Traced {
        let saveable = request.is_saveable.then(SaveableRun::begin);
        let bar = console.progress_bar("tracing", "rays", settings.rays);
        let progress = |p: Progress| {
            bar.set_length(p.total);
            bar.set_position(p.rays);
            let is_stopped = saveable.is_some() && interruption::is_requested();
            !is_stopped && request.paths.is_none_or(|paths| !paths.has_failed())
        };
        let take = request.paths.map(|paths| |vertices: &[PathVertex]| paths.take(vertices));
        let hooks = Hooks {
            finished: request.finished,
            every: request.every,
            paths: take.as_ref().map(|take| take as PathSink<'_>),
            ..Hooks::with_progress(&progress)
        };
        let traced = trace(&self.bound, intersector, settings, request.from, &hooks);
        bar.finish_and_clear();
        traced
    }
}

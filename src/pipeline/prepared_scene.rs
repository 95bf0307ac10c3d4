//! A scene that is bound and faceted, and the tracing of it.

use super::cache::{Cache, CachedFacets, facets_key};
use super::default_accuracy;
use super::error::Error;
use super::facets::{mesh_settings, tessellate_model};
use super::intersectors::{self, IntersectorChoice};
use super::loading::LoadedModel;
use super::monitor::{Monitor, Stage};
use super::settings::{IntersectorKind, MeshingSettings, TracingSettings};
use crate::intersect::Intersector;
use crate::intersect::exact::{self, Exact};
use crate::intersect::octree::{self, Octree};
use crate::simulate::scene::PowerUnit;
use crate::simulate::{
    BoundScene, Fingerprint, Hooks, PartialRun, PathSink, Progress, RunSettings, Scene, Traced, replicate_range,
    trace,
};
use crate::study::accuracy_target::AccuracyPlan;
use crate::study::default_accuracy::Chosen;
use crate::tessellate::{self, Tessellation};
use std::ops::Range;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// Ray paths kept for pictures.
const RECORDED_PATHS: u64 = 2000;

/// A scene with its model, and what is asked of it.
#[derive(Clone, Debug)]
pub struct SceneJob {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its models.
    pub loaded: Arc<LoadedModel>,
    /// How its facets are made.
    pub meshing: MeshingSettings,
    /// How it is traced.
    pub tracing: TracingSettings,
    /// How an accuracy that was asked for was reached.
    pub accuracy: Option<AccuracyPlan>,
    /// What another part of the same run chose. The spline is taken from it; facets come with an error that only a pilot of this
    /// process measures.
    pub chosen: Option<Chosen>,
    /// Where facets and octree are kept for other runs; built anew where there is none.
    pub cache: Option<Cache>,
}

impl SceneJob {
    /// A scene as it stands, with all that it does not say left to choose.
    pub fn new(scene: impl Into<Arc<Scene>>, loaded: impl Into<Arc<LoadedModel>>) -> Self {
        Self {
            scene: scene.into(),
            loaded: loaded.into(),
            meshing: MeshingSettings::default(),
            tracing: TracingSettings::default(),
            accuracy: None,
            chosen: None,
            cache: None,
        }
    }

    /// The facets of the model with these settings, and the seconds that they took; those that are kept have no report.
    fn facets(&self, settings: &tessellate::Settings, monitor: &dyn Monitor) -> (Tessellation, f64) {
        let (start, model) = (Instant::now(), &self.loaded.model);
        // Without a cache, or where a file of the scene has gone since, facets are made anew.
        let Some((cache, key)) = self.cached(settings) else { return tessellate_model(model, settings, monitor) };
        let kept = CachedFacets { cache, key: &key, monitor };
        if let Some(mesh) = kept.mesh(model.placed_faces().count()) {
            return (Tessellation { mesh, ..Tessellation::default() }, start.elapsed().as_secs_f64());
        }
        let (made, seconds) = tessellate_model(model, settings, monitor);
        kept.keep_mesh(&made.mesh);
        (made, seconds)
    }

    /// The cache, and the name that facets of these settings have in it.
    fn cached(&self, settings: &tessellate::Settings) -> Option<(&Cache, Fingerprint)> {
        let cache = self.cache.as_ref()?;
        Some((cache, facets_key(&self.scene, settings)?))
    }
}

/// A job whose scene fits its model and whose facets are made.
#[derive(Clone, Debug)]
pub struct PreparedScene {
    /// What was asked.
    pub job: SceneJob,
    /// The scene on its model.
    pub bound: BoundScene,
    /// The facets.
    pub tessellation: Tessellation,
    /// What they were made with.
    pub mesh_settings: tessellate::Settings,
    /// Seconds that the facets took.
    pub tessellation_seconds: f64,
    /// What finds the hits.
    pub choice: IntersectorChoice,
    /// Threads that trace.
    pub threads: usize,
    /// Rays to trace from the first on, in place of what the settings and the scene say.
    pub rays: Option<u64>,
    /// Why it is traced as it is, where nobody asked for it.
    pub chosen: Option<Chosen>,
    /// Built once for pilot, run and check.
    spline: OnceLock<Arc<Exact>>,
}

/// How to trace beside the settings.
#[derive(Clone, Default)]
pub struct TraceRequest<'a> {
    /// With the full kernel too.
    pub verify_pruning: bool,
    /// What is done already.
    pub from: Option<PartialRun>,
    /// Which part of how many, from 0.
    pub shard: Option<[u32; 2]>,
    /// Told of all that is done, each thread after so long.
    pub finished: Option<&'a (dyn Fn(&PartialRun) + Sync)>,
    /// How long each thread keeps what it has done from `finished`.
    pub every: Duration,
    /// Takes every path.
    pub paths: Option<PathSink<'a>>,
}

impl PreparedScene {
    /// Finest and loosest tolerance of the facets that the run is traced on, mm; `None` where it is traced on the spline.
    pub fn tolerance_mm(&self) -> Option<[f64; 2]> {
        (self.choice.intersector != IntersectorKind::Exact).then_some(self.mesh_settings.tolerance)
    }

    /// Binds the scene (so that its mistakes come before any work), makes the facets, and chooses how to trace where nobody asks.
    ///
    /// # Errors
    /// When the scene does not fit its model, or the settings do not fit the scene.
    pub fn new(job: SceneJob, monitor: &dyn Monitor) -> Result<Self, Error> {
        // All that can be refused is refused before facets are made, which may take minutes.
        let threads = job.tracing.thread_count()?;
        let choice = IntersectorChoice::new(&job.tracing, Some(&job.scene))?;
        let bound = job.scene.bind(&job.loaded.model)?;
        let mesh_settings = mesh_settings(&job.meshing, Some(&job.scene), &job.loaded.model)?;
        let (tessellation, tessellation_seconds) = job.facets(&mesh_settings, monitor);
        let mut prepared = Self {
            job,
            bound,
            tessellation,
            mesh_settings,
            tessellation_seconds,
            choice,
            threads,
            rays: None,
            chosen: None,
            spline: OnceLock::new(),
        };
        // Whoever asks for anything of how it is traced gets just that.
        if !default_accuracy::is_asked(&prepared.job.meshing, &prepared.job.tracing, &prepared.job.scene) {
            prepared.choose_accuracy(monitor);
        }
        Ok(prepared)
    }

    /// Takes the facets or the spline that a pilot of the run's own rays finds sufficient.
    fn choose_accuracy(&mut self, monitor: &dyn Monitor) {
        if let Some(chosen) = self.job.chosen.take_if(|chosen| chosen.intersector == "exact") {
            self.choice = IntersectorChoice { intersector: IntersectorKind::Exact, normals: chosen.normals };
            self.chosen = Some(chosen);
            return;
        }
        let run = RunSettings { sequences: false, ..self.run_settings() };
        let facets = (&self.tessellation.mesh, &self.mesh_settings);
        let model = (&self.job.loaded.model, self.spline());
        let choice = default_accuracy::choose(model, &self.bound, &run, facets, monitor);
        if let Some(finer) = choice.finer {
            self.tessellation.mesh = finer.mesh;
            self.tessellation_seconds += finer.seconds;
            // The settings tell what the facets are: those of the finer ones.
            self.mesh_settings.tolerance = choice.chosen.tolerance_mm;
        }
        self.choice = choice.intersector;
        self.chosen = Some(choice.chosen);
    }

    /// The exact spline of the model.
    fn spline(&self) -> Arc<Exact> {
        let build = || Arc::new(Exact::build(&self.job.loaded.model, &exact::Settings::default()));
        self.spline.get_or_init(build).clone()
    }

    /// The exact spline of the model, for some thousands of rays: the one of pilot or run, else one that is built sooner.
    pub(super) fn spline_for_few_rays(&self) -> Arc<Exact> {
        let build = || Arc::new(Exact::build(&self.job.loaded.model, &exact::Settings::for_few_rays()));
        self.spline.get().cloned().unwrap_or_else(build)
    }

    /// The run's settings: the scene's, with what was asked over them.
    pub fn run_settings(&self) -> RunSettings {
        let mut settings = RunSettings::from(&self.job.scene.run);
        settings.rays = self.rays.or(self.job.tracing.rays()).unwrap_or(settings.rays);
        if let Some(first) = self.job.tracing.ray_range.and_then(|range| range.first) {
            // A run that grows to an error begins with its first ray, whatever range was asked.
            settings.first_ray = if self.rays.is_some() { 0 } else { first };
            settings.grows = true;
        }
        settings.seed = self.job.tracing.seed.unwrap_or(settings.seed);
        settings.threads = self.threads;
        // No more paths than rays.
        settings.path_samples = RECORDED_PATHS.min(settings.rays);
        settings
    }

    /// The replicates that are asked for: those of the rays from the first up to the last.
    pub fn replicate_range(&self) -> Range<u32> {
        replicate_range(&self.bound, &self.run_settings())
    }

    /// Unit of powers: `W` or `lm`.
    pub fn power_unit(&self) -> &'static str {
        match self.job.scene.run.unit {
            PowerUnit::Lumen => "lm",
            PowerUnit::Watt => "W",
        }
    }

    /// Traces the replicates that are asked for and gives their sums.
    pub fn trace_part(&self, request: TraceRequest<'_>, monitor: &dyn Monitor) -> PartialRun {
        let settings = RunSettings { shard: request.shard.unwrap_or([0, 1]), ..self.run_settings() };
        self.with_intersector(monitor, |intersector, _| self.run(intersector, &settings, request, monitor).partial)
    }

    /// Builds the intersector of the run for `work`, which also gets the seconds that it took.
    pub fn with_intersector<T>(&self, monitor: &dyn Monitor, work: impl FnOnce(&dyn Intersector, f64) -> T) -> T {
        let mesh = &self.tessellation.mesh;
        let octree = |settings: &octree::Settings| match self.job.cached(&self.mesh_settings) {
            Some((cache, key)) => CachedFacets { cache, key: &key, monitor }.octree(mesh, settings),
            None => Octree::build(mesh, settings),
        };
        let builders = intersectors::Builders { octree: &octree, spline: &|| self.spline() };
        intersectors::with_built_intersector(self.choice, builders, mesh, monitor, |intersector, footprint| {
            work(intersector, footprint.build_seconds)
        })
    }

    /// Traces; ends early when the monitor asks for it.
    pub(super) fn run(
        &self,
        intersector: &dyn Intersector,
        settings: &RunSettings,
        request: TraceRequest<'_>,
        monitor: &dyn Monitor,
    ) -> Traced {
        monitor.begin(Stage::Tracing(settings.rays));
        let progress = |p: Progress| monitor.advance(p.rays, p.total);
        let hooks = Hooks {
            finished: request.finished,
            every: request.every,
            paths: request.paths,
            ..Hooks::with_progress(&progress)
        };
        let traced = trace(&self.bound, intersector, settings, request.from, &hooks);
        monitor.end();
        traced
    }
}

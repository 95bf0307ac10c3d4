//! A scene that is bound and faceted, and the tracing of it.

use super::cache::{Cache, CachedFacets, facets_key, group_keys};
use super::default_accuracy;
use super::error::Error;
use super::facets::{mesh_settings, tessellate_groups};
use super::intersectors::{self, IntersectorChoice, TrueSurface};
use super::loading::LoadedModel;
use super::monitor::{Monitor, Stage, in_stage};
use super::settings::{IntersectorKind, MeshingSettings, TracingSettings};
use crate::intersect::Intersector;
use crate::intersect::exact;
use crate::intersect::octree::{self, Octree};
use crate::mesh::FacetMesh;
use crate::model::{Instancing, Model};
use crate::simulate::scene::PowerUnit;
use crate::simulate::{
    BoundScene, Fingerprint, Hooks, PartialRun, PathSink, Progress, RunSettings, Scene, Traced, replicate_range,
    trace,
};
use crate::study::accuracy_target::AccuracyPlan;
use crate::study::default_accuracy::Chosen;
use crate::tessellate::{self, GroupedFacets, Tessellation};
use std::ops::Range;
use std::slice;
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
    /// Makes the job of a scene as it stands, with all that it does not say left to choose, and without a cache.
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

    /// Reads the facets of the model or of its groups from the cache, or makes and keeps them; returns them with the seconds that took.
    /// Those from the cache have no report.
    fn facets(
        &self,
        instancing: Option<&Arc<Instancing>>,
        settings: &tessellate::Settings,
        monitor: &dyn Monitor,
    ) -> (GroupedFacets, f64) {
        let (start, model) = (Instant::now(), &self.loaded.model);
        let make = || in_stage(monitor, Stage::Tessellating, || tessellate_groups(model, instancing, settings));
        // Without a cache, or where a file of the scene has gone since, facets are made anew.
        let Some((cache, key)) = self.cached(settings) else { return make() };
        let groups = instancing.map_or(slice::from_ref(model), |i| &i.groups);
        let keys = group_keys(&key, groups.len());
        let kept = |key| CachedFacets { cache, key, monitor };
        let meshes = groups.iter().zip(&keys).map(|(group, key)| kept(key).mesh(group.placed_face_count()));
        if let Some(meshes) = meshes.collect::<Option<Vec<_>>>() {
            let groups = meshes.into_iter().map(|mesh| Tessellation { mesh, ..Tessellation::default() }).collect();
            return (GroupedFacets { groups, instancing: instancing.cloned() }, start.elapsed().as_secs_f64());
        }
        let (made, seconds) = make();
        made.meshes().zip(&keys).for_each(|(mesh, key)| kept(key).keep_mesh(mesh));
        (made, seconds)
    }

    /// Returns the cache, and the name that facets of these settings have in it; `None` without a cache, or where a file of the scene is
    /// gone.
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
    /// The facets; parts that are placed often have them once.
    pub facets: GroupedFacets,
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
    surfaces: OnceLock<Vec<Arc<TrueSurface>>>,
}

/// How to trace beside the settings.
#[derive(Clone, Default)]
pub struct TraceRequest<'a> {
    /// Whether to trace with the full kernel too and compare.
    pub verify_pruning: bool,
    /// What is done already, of the same run; it is not traced again.
    pub from: Option<PartialRun>,
    /// Which part of how many, from 0; all for `None`.
    pub shard: Option<[u32; 2]>,
    /// Told of all that is done, each thread after so long.
    pub finished: Option<&'a (dyn Fn(&PartialRun) + Sync)>,
    /// How long each thread keeps what it has done from `finished`.
    pub every: Duration,
    /// Takes every path.
    pub paths: Option<PathSink<'a>>,
}

impl PreparedScene {
    /// Returns the finest and loosest tolerance of the facets that the run is traced on, mm; `None` where it is traced on the spline.
    pub fn tolerance_mm(&self) -> Option<[f64; 2]> {
        (self.choice.intersector != IntersectorKind::Exact).then_some(self.mesh_settings.tolerance)
    }

    /// Binds the scene (so that its mistakes come before any work), makes the facets, and chooses how to trace where nobody asks: by a
    /// pilot that traces some of the run's rays.
    ///
    /// # Errors
    /// When the scene does not fit its model, or the settings do not fit the scene.
    pub fn new(job: SceneJob, monitor: &dyn Monitor) -> Result<Self, Error> {
        // All that can be refused is refused before facets are made, which may take minutes.
        let threads = job.tracing.thread_count()?;
        let choice = IntersectorChoice::new(&job.tracing, Some(&job.scene))?;
        let bound = job.scene.bind(&job.loaded.model)?;
        let mesh_settings = mesh_settings(&job.meshing, Some(&job.scene), &job.loaded.model)?;
        let instancing = Instancing::new(&job.loaded.model, mesh_settings.glue_mm).map(Arc::new);
        let (facets, tessellation_seconds) = job.facets(instancing.as_ref(), &mesh_settings, monitor);
        let mut prepared = Self {
            job,
            bound,
            facets,
            mesh_settings,
            tessellation_seconds,
            choice,
            threads,
            rays: None,
            chosen: None,
            surfaces: OnceLock::new(),
        };
        // Whoever asks for anything of how it is traced gets just that.
        if !default_accuracy::is_asked(&prepared.job.meshing, &prepared.job.tracing, &prepared.job.scene) {
            prepared.choose_accuracy(monitor);
        }
        Ok(prepared)
    }

    /// Takes what another part of the run chose, if that was the spline, else the facets or the spline that a pilot finds sufficient. May
    /// put finer facets in place of those that were made.
    fn choose_accuracy(&mut self, monitor: &dyn Monitor) {
        if let Some(chosen) = self.job.chosen.take_if(|chosen| chosen.intersector == "exact") {
            self.choice = IntersectorChoice { intersector: IntersectorKind::Exact, normals: chosen.normals };
            self.chosen = Some(chosen);
            return;
        }
        let run = RunSettings { sequences: false, ..self.run_settings() };
        let model = (&self.job.loaded.model, &*self.true_surfaces());
        let facets = (&self.facets, &self.mesh_settings);
        let choice = default_accuracy::choose(model, &self.bound, &run, facets, monitor);
        if let Some(finer) = choice.finer {
            self.facets = finer.facets;
            self.tessellation_seconds += finer.seconds;
            // The settings tell what the facets are: those of the finer ones.
            self.mesh_settings.tolerance = choice.chosen.tolerance_mm;
        }
        self.choice = choice.intersector;
        self.chosen = Some(choice.chosen);
    }

    /// The models of the groups; of a scene in one piece the whole one.
    pub(super) fn models(&self) -> &[Model] {
        self.facets.instancing.as_ref().map_or(slice::from_ref(&self.job.loaded.model), |i| &i.groups)
    }

    /// Returns the true surface of each group, built when first asked for.
    fn true_surfaces(&self) -> Vec<Arc<TrueSurface>> {
        self.surfaces.get_or_init(|| self.build_surfaces(&exact::Settings::default())).clone()
    }

    /// Returns true surfaces for some thousands of rays: those of pilot or run, else ones that are built sooner and not kept.
    pub(super) fn surfaces_for_few_rays(&self) -> Vec<Arc<TrueSurface>> {
        self.surfaces.get().cloned().unwrap_or_else(|| self.build_surfaces(&exact::Settings::for_few_rays()))
    }

    /// Builds the true surface of each group.
    fn build_surfaces(&self, settings: &exact::Settings) -> Vec<Arc<TrueSurface>> {
        let groups = self.models().iter().zip(self.facets.meshes());
        groups.map(|(model, mesh)| Arc::new(TrueSurface::new(model, mesh, settings))).collect()
    }

    /// Returns the run's settings: the scene's, with what was asked over them; the whole run, no shard.
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

    /// Returns the replicates that are asked for: those of the rays from the first up to the last.
    pub fn replicate_range(&self) -> Range<u32> {
        replicate_range(&self.bound, &self.run_settings())
    }

    /// Returns the unit of powers: `W` or `lm`.
    pub fn power_unit(&self) -> &'static str {
        match self.job.scene.run.unit {
            PowerUnit::Lumen => "lm",
            PowerUnit::Watt => "W",
        }
    }

    /// Traces the replicates that are asked for, of the request's shard, and returns their sums with those it goes on from; fewer where the
    /// monitor ends it early.
    pub fn trace_part(&self, request: TraceRequest<'_>, monitor: &dyn Monitor) -> PartialRun {
        let settings = RunSettings { shard: request.shard.unwrap_or([0, 1]), ..self.run_settings() };
        self.with_intersector(monitor, |intersector, _| self.run(intersector, &settings, request, monitor).partial)
    }

    /// Builds the intersector of the run, or takes its octree from the cache, and calls `work` with it and the seconds that this took.
    pub fn with_intersector<T>(&self, monitor: &dyn Monitor, work: impl FnOnce(&dyn Intersector, f64) -> T) -> T {
        let meshes: Vec<&FacetMesh> = self.facets.meshes().collect();
        let kept = self.job.cached(&self.mesh_settings).map(|(cache, key)| (cache, group_keys(&key, meshes.len())));
        let octree = |group: usize, settings: &octree::Settings| match &kept {
            Some((cache, keys)) => {
                CachedFacets { cache, key: &keys[group], monitor }.octree(meshes[group], settings)
            }
            None => Octree::build(meshes[group], settings),
        };
        let builders = intersectors::Builders { octree: &octree, surfaces: &|| self.true_surfaces() };
        let facets = (meshes.as_slice(), self.facets.instancing.as_deref());
        intersectors::with_built_intersector(self.choice, builders, facets, monitor, |intersector, footprint| {
            work(intersector, footprint.build_seconds)
        })
    }

    /// Traces on an intersector; ends early when the monitor asks for it. Of the request, `shard` and `verify_pruning` are not looked at.
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

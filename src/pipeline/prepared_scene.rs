//! A scene that is bound and faceted, and the tracing of it.

use super::cache::{CachedFacets, group_keys};
use super::default_accuracy::{self, OpenRun, is_accuracy_asked};
use super::error::Error;
use super::expected_facets::expected_facets;
use super::facets::{angle_note, mesh_settings};
use super::fingerprint::run_fingerprint;
use super::intersectors::{self, IntersectorChoice, TrueSurface, farthest_start, refuse_facet_normals};
use super::loading::LoadedModel;
use super::monitor::{Monitor, Stage};
use super::scene_job::SceneJob;
use super::settings::IntersectorKind;
use super::turn::Turn;
use crate::intersect::exact;
use crate::intersect::octree::{self, Octree};
use crate::intersect::{Intersector, NormalMode};
use crate::mesh::FacetMesh;
use crate::model::{Instancing, Model};
use crate::simulate::{
    BoundScene, Fingerprint, Hooks, PartialRun, PathSink, Progress, RunSettings, Scene, TracedRun, grows,
    replicate_range, trace,
};
use crate::study::default_accuracy::TracingChoice;
use crate::tessellate::{self, GroupedFacets};
use std::ops::Range;
use std::slice;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// Facets that are made before it is chosen how to trace: a second or two. Far more of them cost more than the spline does.
const MOST_BEFORE_CHOICE: f64 = 1e5;

/// Segments that the true surfaces of a run are built for, for each of its rays: most scenes have two to five.
const SEGMENTS_A_RAY: u64 = 4;
/// Segments that the true surfaces of a pilot or a check are built for.
const FEW_SEGMENTS: u64 = 65_536;

/// Ray paths kept for pictures.
const RECORDED_PATHS: u64 = 2000;

/// A job whose scene fits its model and whose facets are made.
#[derive(Clone, Debug)]
pub struct PreparedScene {
    /// The scene with its model and settings.
    pub job: SceneJob,
    /// The scene on its model.
    pub bound: BoundScene,
    /// The facets; parts that are placed often have them once.
    pub facets: GroupedFacets,
    /// The settings that the facets were made with.
    pub mesh_settings: tessellate::Settings,
    /// Seconds that the facets took.
    pub tessellation_seconds: f64,
    /// The intersector.
    pub choice: IntersectorChoice,
    /// Threads that trace.
    pub threads: usize,
    /// Rays of the run, from the first on, in place of the number in the settings and the scene; set while a run grows.
    pub rays: Option<u64>,
    /// How it is traced and why, where settings and scene left that open.
    pub chosen: Option<TracingChoice>,
    /// Built once for the run, where it uses the spline.
    surfaces: OnceLock<Vec<Arc<TrueSurface>>>,
    /// Built once for pilot and check; a run on the spline takes those of them that are not coarser than its own.
    few_ray_surfaces: OnceLock<Vec<Arc<TrueSurface>>>,
}

/// What a caller requests of a trace besides its settings.
#[derive(Clone, Default)]
pub struct TraceRequest<'a> {
    /// Whether to trace with the full kernel too and compare.
    pub verify_pruning: bool,
    /// The part of the same run that is done already; it is not traced again.
    pub from: Option<PartialRun>,
    /// Which part, from 0, of how many [`PreparedScene::trace_part`] traces; the whole run for `None`.
    pub shard: Option<[u32; 2]>,
    /// Called with all that is done so far, as [`Hooks::finished`].
    pub finished: Option<&'a (dyn Fn(&PartialRun) + Sync)>,
    /// How long each thread holds back what it has done from `finished`, as [`Hooks::every`].
    pub every: Duration,
    /// Takes every path.
    pub paths: Option<PathSink<'a>>,
}

impl PreparedScene {
    /// Returns the finest and loosest tolerance of the facets that the run is traced on, those of single parts and faces among them, mm;
    /// `None` where it is traced on the spline.
    pub fn tolerance_mm(&self) -> Option<[f64; 2]> {
        (self.choice.intersector != IntersectorKind::Exact).then(|| self.mesh_settings.range())
    }

    /// Binds the scene, so that its mistakes come before any work, chooses how to trace where that is open, and makes the facets of that
    /// choice. The choice sets tolerance, normals and intersector: that of another part of the run, else of the cache, else of a pilot that
    /// traces some of the run's rays.
    ///
    /// # Errors
    /// When the scene does not fit its model, or the settings do not fit the scene or ask for 0 threads.
    pub fn new(job: SceneJob, monitor: &dyn Monitor) -> Result<Self, Error> {
        // All that can be refused is refused before facets are made, which may take minutes.
        let threads = job.tracing.thread_count()?;
        let choice = IntersectorChoice::new(&job.tracing, Some(&job.scene))?;
        refuse_facet_normals(&job.tracing, Some(&job.scene))?;
        let own_rays = job.tracing.own_rays_note(&job.scene)?;
        let mut bound = job.scene.bind(&job.loaded.model)?;
        bound.notes.extend(own_rays);
        bound.notes.extend(job.loaded.empty_files().map(|file| {
            format!("{file} holds no face that light could meet; `lampyris info` on it shows what it holds")
        }));
        let mesh_settings = mesh_settings(&job.meshing, Some(&job.scene), &job.loaded.model)?;
        let instancing = Instancing::new(&job.loaded.model, mesh_settings.glue_mm).map(Arc::new);
        let mut prepared = Self {
            job,
            bound,
            facets: GroupedFacets::default(),
            mesh_settings,
            tessellation_seconds: 0.0,
            choice,
            threads,
            rays: None,
            chosen: None,
            surfaces: OnceLock::new(),
            few_ray_surfaces: OnceLock::new(),
        };
        // No choice is made for a run with any setting of how to trace it.
        let is_open = !is_accuracy_asked(&prepared.job.meshing, &prepared.job.tracing, &prepared.job.scene);
        let known = if is_open { prepared.known_choice(monitor) } else { None };
        if let Some(chosen) = known {
            // Before any facets are made: it says how fine they are.
            prepared.take_choice(chosen, monitor);
            prepared.make_facets(instancing.as_ref(), monitor);
        } else if is_open {
            prepared.choose_and_make_facets(instancing.as_ref(), monitor);
        } else {
            prepared.make_facets(instancing.as_ref(), monitor);
        }
        if prepared.choice.intersector != IntersectorKind::Exact {
            let note = angle_note(&prepared.facets, &prepared.job.loaded.model, &prepared.mesh_settings);
            prepared.bound.notes.extend(note);
        }
        Ok(prepared)
    }

    /// Makes the tolerance of the settings as much coarser as leaves [`MOST_BEFORE_CHOICE`] facets; returns how many the default would
    /// take, `None`, and nothing changed, where these are not too many.
    fn coarsen_to_limit(&mut self, instancing: Option<&Instancing>) -> Option<f64> {
        let [_, loosest] = self.mesh_settings.tolerance;
        let models = instancing.map_or(slice::from_ref(&self.job.loaded.model), |i| &i.groups);
        let expected: f64 = models.iter().map(|model| expected_facets(model, loosest)).sum();
        let factor = expected / MOST_BEFORE_CHOICE;
        (factor > 1.0).then(|| {
            self.mesh_settings.tolerance = self.mesh_settings.tolerance.map(|t| t * factor);
            expected
        })
    }

    /// Chooses by a pilot how to trace, or takes what another process finds that chooses for the same run, and makes the facets of that.
    fn choose_and_make_facets(&mut self, instancing: Option<&Arc<Instancing>>, monitor: &dyn Monitor) {
        // Named by the run before anything of it is decided: that is all that other processes know when they look it up.
        let undecided = self.job.cache.as_ref().and(self.fingerprint().ok());
        let excess = self.coarsen_to_limit(instancing.map(Arc::as_ref));
        self.make_facets(instancing, monitor);
        let run = RunSettings { sequences: false, ..self.run_settings() };
        // Without a pilot to choose is cheaper than to wait.
        let needs_pilot = default_accuracy::needs_pilot(self.open_run(&run));
        let cached = self.job.cache.clone().zip(undecided).filter(|_| needs_pilot);
        let turn = match cached.as_ref().map(|(cache, undecided)| cache.choice_or_turn(undecided, monitor)) {
            Some(Ok(chosen)) => {
                let made = self.mesh_settings.tolerance;
                self.take_choice(chosen, monitor);
                if self.mesh_settings.tolerance != made {
                    self.make_facets(instancing, monitor);
                }
                return;
            }
            Some(Err(turn)) => turn,
            None => Turn::default(),
        };
        let chosen = self.choose_accuracy(run, excess, monitor);
        if let Some((cache, undecided)) = &cached {
            cache.keep_choice(undecided, &chosen, monitor);
        }
        drop(turn);
        self.take_choice(chosen, monitor);
    }

    /// Makes the facets of the settings, or takes them from the cache, in place of those that are there.
    fn make_facets(&mut self, instancing: Option<&Arc<Instancing>>, monitor: &dyn Monitor) {
        (self.facets, self.tessellation_seconds) = self.job.facets(instancing, &self.mesh_settings, monitor);
    }

    /// Takes from the job what a part of the same run chose and returns it, or else what the cache keeps of the same choice; `None` where
    /// there is neither.
    fn known_choice(&mut self, monitor: &dyn Monitor) -> Option<TracingChoice> {
        if let Some(part) = self.job.chosen.take() {
            // Program, scene, files and settings are the same: so would be what a pilot of this process finds.
            let run = self.run_settings();
            let (mesher, choice) = self.settings_of(&part.chosen);
            let own = run_fingerprint(self.scene_and_model(), &run, (&mesher, &choice));
            if own.is_ok_and(|own| own == part.fingerprint) {
                return Some(part.chosen);
            }
        }
        let cache = self.job.cache.as_ref()?;
        cache.choice(&self.fingerprint().ok()?, monitor)
    }

    /// Returns the scene, the same bound, and its model.
    fn scene_and_model(&self) -> (&Scene, &BoundScene, &LoadedModel) {
        (&self.job.scene, &self.bound, &self.job.loaded)
    }

    /// Returns the mesher's settings and the intersector that a choice stands for.
    fn settings_of(&self, chosen: &TracingChoice) -> (tessellate::Settings, IntersectorChoice) {
        let mesher = tessellate::Settings { tolerance: chosen.tolerance_mm, ..self.mesh_settings.clone() };
        (mesher, default_accuracy::intersector_choice(chosen))
    }

    /// Takes tolerance, normals and intersector of a choice and notifies the monitor. The facets are left as they are: the caller makes
    /// those of the choice.
    fn take_choice(&mut self, chosen: TracingChoice, monitor: &dyn Monitor) {
        monitor.chosen(&chosen);
        (self.mesh_settings, self.choice) = self.settings_of(&chosen);
        self.chosen = Some(chosen);
    }

    /// Hashes all that decides the bits of a run: program, values of the scene, its files, facets, intersector, settings; of a run that
    /// grows not the number of rays.
    ///
    /// # Errors
    /// When a file of the scene cannot be read.
    pub fn fingerprint(&self) -> Result<Fingerprint, Error> {
        run_fingerprint(self.scene_and_model(), &self.run_settings(), (&self.mesh_settings, &self.choice))
    }

    /// Chooses the facets or the spline that a pilot finds sufficient. May put finer facets in place of those that were made. `excess` is
    /// the number of facets that the default tolerance would make, where those were too many to be tried.
    fn choose_accuracy(&mut self, run: RunSettings, excess: Option<f64>, monitor: &dyn Monitor) -> TracingChoice {
        let surfaces = || self.surfaces_for_few_rays();
        let (mut chosen, finer) = default_accuracy::choose(self.open_run(&run), &surfaces, monitor);
        if let Some(expected) = excess {
            let [finest, loosest] = tessellate::Settings::default().range();
            chosen.because += &format!(
                "; facets of {finest} to {loosest} mm would be some {expected:.1e}, so that coarser ones were tried"
            );
        }
        if let Some(finer) = finer {
            self.facets = finer.facets;
            self.tessellation_seconds += finer.seconds;
        }
        chosen
    }

    /// Returns what a choice of how to trace is made from.
    fn open_run<'a>(&'a self, run: &'a RunSettings) -> OpenRun<'a> {
        OpenRun {
            model: &self.job.loaded.model,
            bound: &self.bound,
            run,
            facets: &self.facets,
            mesher: &self.mesh_settings,
        }
    }

    /// Returns the models of the groups; of a scene in one piece the whole one.
    pub(super) fn models(&self) -> &[Model] {
        self.facets.instancing.as_ref().map_or(slice::from_ref(&self.job.loaded.model), |i| &i.groups)
    }

    /// Whether the run may get more rays than it has: how many is not known, and all of its parts have one structure.
    fn may_grow(&self) -> bool {
        self.rays.is_some() || grows(&self.bound, &self.run_settings())
    }

    /// Returns the true surface of each group for a run on the spline, or whose hits are moved to it, built when first asked for: of many
    /// patches for few rays as coarse as these are worth.
    fn true_surfaces(&self) -> &[Arc<TrueSurface>] {
        self.surfaces.get_or_init(|| {
            let rays = if self.may_grow() { u64::MAX } else { self.run_settings().rays };
            self.build_surfaces(rays.saturating_mul(SEGMENTS_A_RAY).max(FEW_SEGMENTS))
        })
    }

    /// Returns the true surface of each group for the thousands of rays of a pilot or a check, built when first asked for. One for millions
    /// of rays may take eight times as long, more than many runs.
    fn surfaces_for_few_rays(&self) -> &[Arc<TrueSurface>] {
        self.few_ray_surfaces.get_or_init(|| self.build_surfaces(FEW_SEGMENTS))
    }

    /// Returns the true surfaces that the run is traced on, or that its hits on facets are moved to, and that it is checked with. Which
    /// these are goes by its choice alone, so that merged parts have the digits of one run.
    pub(super) fn surfaces_of_choice(&self) -> &[Arc<TrueSurface>] {
        let is_asked =
            self.choice.intersector == IntersectorKind::Exact || self.choice.normals == NormalMode::Exact;
        if is_asked { self.true_surfaces() } else { self.surfaces_for_few_rays() }
    }

    /// Builds the true surface of each group for so many segments, no fewer than [`FEW_SEGMENTS`], or takes one for few that is no coarser.
    fn build_surfaces(&self, segments: u64) -> Vec<Arc<TrueSurface>> {
        let groups = self.models().iter().zip(self.facets.meshes()).enumerate();
        let for_few =
            |group: usize| self.few_ray_surfaces.get()?.get(group).filter(|surface| !surface.is_shallow());
        let surface = |(group, (model, mesh)): (usize, (&Model, &FacetMesh))| match for_few(group) {
            Some(surface) => surface.clone(),
            None => {
                let farthest_start = farthest_start(self.facets.instancing.as_deref(), group);
                let settings = exact::Settings { farthest_start, ..exact::Settings::for_rays(segments) };
                Arc::new(TrueSurface::new(model, mesh, &settings))
            }
        };
        groups.map(surface).collect()
    }

    /// Returns how many placed faces of a run on facets have none, and how many there are; on the spline none counts, because it needs no
    /// facets.
    pub fn bare_faces(&self) -> [usize; 2] {
        let model = &self.job.loaded.model;
        let is_on_facets = self.choice.intersector != IntersectorKind::Exact;
        let bare = if is_on_facets { self.facets.faces_without_facets(model) } else { 0 };
        [bare, model.placed_face_count()]
    }

    /// Returns the run's settings: the scene's, overridden by those of the request; the whole run, no shard.
    pub fn run_settings(&self) -> RunSettings {
        let mut settings = RunSettings::from(&self.job.scene.run);
        settings.rays = self.rays.or(self.job.tracing.rays()).unwrap_or(settings.rays);
        if let Some(first) = self.job.tracing.ray_range.and_then(|range| range.first) {
            // A run that grows to an error begins with its first ray, whatever range was requested.
            settings.first_ray = if self.rays.is_some() { 0 } else { first };
            settings.grows = true;
        }
        settings.seed = self.job.tracing.seed.unwrap_or(settings.seed);
        settings.threads = self.threads;
        // No more paths than rays.
        settings.path_samples = RECORDED_PATHS.min(settings.rays);
        settings
    }

    /// Returns the replicates that the run is to trace: all, or those from the first ray that was asked for on; shards are ignored.
    pub fn replicate_range(&self) -> Range<u32> {
        replicate_range(&self.bound, &self.run_settings())
    }

    /// Returns the unit of powers: `W` or `lm`.
    pub fn power_unit(&self) -> &'static str {
        self.job.scene.run.unit.symbol()
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
        let builders = intersectors::Builders { octree: &octree, surfaces: &|| self.surfaces_of_choice().to_vec() };
        let facets = (meshes.as_slice(), self.facets.instancing.as_deref());
        intersectors::with_built_intersector(self.choice, builders, facets, monitor, |intersector, footprint| {
            work(intersector, footprint.build_seconds)
        })
    }

    /// Traces on an intersector; ends early when the monitor asks for it. Ignores `shard` and `verify_pruning` of the request.
    pub(super) fn run(
        &self,
        intersector: &dyn Intersector,
        settings: &RunSettings,
        request: TraceRequest<'_>,
        monitor: &dyn Monitor,
    ) -> TracedRun {
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

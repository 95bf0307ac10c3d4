use super::bind::BoundScene;
use super::effects::{self, KernelKind};
use super::emitter::Emitter;
use super::gather::{Gather, Own};
use super::kernel::{
    self, Coloured, Context, Everything, Local, Mirrors, Nothing, OneBody, PathSink, Plain, Stack, Which,
};
use super::plan::{Plan, SourceShare};
use super::portion::Portion;
use super::receiver::Shape;
use super::recorder::Recorder;
use super::results::Results;
use super::scene::{Interfaces, Run, Sampling};
use crate::intersect::{Cost, ExpectedRays, Intersector};
use crate::optics::Effects;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// What a simulation is run with: the scene's own settings, which the command may override, and how to spread the work.
#[derive(Clone, Debug, PartialEq)]
pub struct RunSettings {
    /// Number of rays that leave the sources.
    pub rays: u64,
    /// Seed of all random numbers.
    pub seed: u64,
    /// How sources are sampled.
    pub sampling: Sampling,
    /// What happens at a partly reflecting interface.
    pub interfaces: Interfaces,
    /// Below this share of its first power a ray is no longer split.
    pub split_floor: f64,
    /// Hits after which a path is cut off.
    pub max_bounces: u32,
    /// Length after which a path is cut off, mm.
    pub max_length_mm: f64,
    /// Share of its first power below which a path is cut off.
    pub power_floor: f64,
    /// Independent parts the run is divided into.
    pub replicates: u32,
    /// Threads; 0 for as many as the machine has. Changes no bit of a result.
    pub threads: usize,
    /// Rays in one wavefront. Changes no bit of a result.
    pub batch: usize,
    /// About how many paths to record.
    pub path_samples: u64,
    /// Which kernel to use: the smallest that the scene needs, or the one that can do everything. Changes no bit of a result.
    pub kernel: KernelChoice,
    /// Which part of the replicates to run: the `i`-th of `n`, from 0.
    pub shard: [u32; 2],
}

/// Which kernel to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KernelChoice {
    /// The smallest that the scene needs.
    #[default]
    Pruned,
    /// The smallest that the scene needs and that could do these effects too.
    With(Effects),
    /// The one that can do everything.
    Full,
}

impl From<&Run> for RunSettings {
    fn from(r: &Run) -> Self {
        Self {
            rays: r.rays,
            seed: r.seed,
            sampling: r.sampling,
            interfaces: r.interfaces,
            split_floor: r.split_floor,
            max_bounces: r.max_bounces,
            max_length_mm: r.max_length_mm,
            power_floor: r.power_floor,
            replicates: r.replicates,
            threads: 0,
            batch: 1024,
            path_samples: 0,
            kernel: KernelChoice::Pruned,
            shard: [0, 1],
        }
    }
}

impl Default for RunSettings {
    fn default() -> Self {
        Self::from(&Run::default())
    }
}

/// How far a run has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Rays finished.
    pub rays: u64,
    /// Rays to trace in all.
    pub total: u64,
    /// Seconds since the start.
    pub seconds: f64,
}

/// What a run tells while it runs.
#[derive(Clone, Copy)]
pub struct Hooks<'a> {
    /// Called from the worker threads after each replicate; it ends the run early by returning `false`.
    pub progress: &'a (dyn Fn(Progress) -> bool + Sync),
    /// Called with all that is done so far, one call at a time.
    pub finished: Option<&'a (dyn Fn(&Portion) + Sync)>,
    /// How long each thread keeps what it has done from `finished`; zero for a call after each replicate.
    pub every: Duration,
    /// Takes the vertices of every path, in pieces and in no particular order, from any thread.
    pub paths: Option<PathSink<'a>>,
}

/// A run, or the part of it that was asked for.
#[derive(Clone, Debug, Default)]
pub struct Traced {
    /// The replicates that are done, and their sums.
    pub portion: Portion,
    /// Work of the intersector.
    pub cost: Cost,
    /// Threads used.
    pub threads: usize,
}

/// Simulates a bound scene on any intersector.
///
/// `progress` is called from the worker threads after each replicate; it ends the run early by returning `false`, and the
/// results are then those of the replicates that were finished.
pub fn simulate(
    bound: &BoundScene,
    intersector: &dyn Intersector,
    settings: &RunSettings,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Results {
    let hooks = Hooks { progress, finished: None, every: Duration::ZERO, paths: None };
    Results::of(bound, settings, trace(bound, intersector, settings, None, &hooks))
}

/// Traces the replicates of a run (those of its shard) that are not done yet, and adds them to what is.
pub fn trace(
    bound: &BoundScene,
    intersector: &dyn Intersector,
    settings: &RunSettings,
    from: Option<Portion>,
    hooks: &Hooks<'_>,
) -> Traced {
    let start = Instant::now();
    let alone = RunSettings { batch: 1, ..settings.clone() };
    let mut context = Context::new(bound, intersector, settings);
    context.paths = hooks.paths;
    let recording = match hooks.paths {
        Some(_) => {
            context.plan.record_mask = Some(0);
            None
        }
        None => context.plan.recording().map(|plan| Context { plan, settings: &alone, ..context.clone() }),
    };
    let replicates = context.plan.replicates;
    let [shard, shards] = settings.shard;
    let mine = |k: u32| (u64::from(replicates) * u64::from(k) / u64::from(shards.max(1))) as u32;
    let (first, last) = (mine(shard), mine(shard.saturating_add(1)).min(replicates));
    let before = from.unwrap_or_else(|| Portion::none(bound, replicates));
    let todo: Vec<u32> = (first..last).filter(|r| before.done.binary_search(r).is_err()).collect();
    let threads = threads_of(settings);
    let kind = kernel_of(bound, settings);
    announce(&context, threads);
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let share = context.plan.rays * u64::from(last.saturating_sub(first)) / u64::from(replicates);
    let rays_done = AtomicU64::new(before.tallies.counts.rays);
    let all = Gather::new(before, hooks, start);
    let work = || {
        let mut local = Local::new(bound);
        let mut own = Own::new(&all, bound, replicates);
        let mut recorder = recording.as_ref().map(|context| Recorder::new(context, kind));
        while !stop.load(Ordering::Relaxed) {
            let Some(&replicate) = todo.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
            let cost = dispatch(kind, &context, Which::Replicate(replicate), &mut local);
            if let Some(recorder) = &mut recorder {
                recorder.record(replicate, &mut local);
            }
            let rays = local.counts.rays + rays_done.fetch_add(local.counts.rays, Ordering::Relaxed);
            own.take(replicate, &mut local, &context, cost);
            let so_far = Progress { rays, total: share, seconds: start.elapsed().as_secs_f64() };
            if !(hooks.progress)(so_far) {
                stop.store(true, Ordering::Relaxed);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads.min(todo.len()) {
            scope.spawn(work);
        }
        work();
    });
    let (portion, cost) = all.into_whole();
    Traced { portion, cost, threads }
}

/// Tells the intersector which rays a run is going to ask.
fn announce(context: &Context<'_>, threads: usize) {
    let own = |rays: u64| rays / u64::from(context.settings.shard[1].max(1));
    let beam = |(e, s): (&Emitter, &SourceShare)| Some((e.beam()?, own(s.rays)));
    let beams: Vec<_> = context.bound.emitters.iter().zip(&context.plan.shares).filter_map(beam).collect();
    context.intersector.prepare_for(&ExpectedRays { rays: own(context.plan.rays), threads, beams: &beams });
}

/// Lets the intersector work out beforehand what it will know of a run, so that two runs on it compare.
pub(crate) fn prepare(bound: &BoundScene, intersector: &dyn Intersector, settings: &RunSettings) {
    announce(&Context::new(bound, intersector, settings), threads_of(settings));
}

fn threads_of(settings: &RunSettings) -> usize {
    match settings.threads {
        0 => std::thread::available_parallelism().map_or(1, |n| n.get()),
        n => n,
    }
}

/// Traces some rays of a run once more, by their number, and records their whole paths; `paths` and `ledger` of the results
/// are theirs.
pub fn replay(bound: &BoundScene, intersector: &dyn Intersector, settings: &RunSettings, rays: &[u64]) -> Results {
    let start = Instant::now();
    let mut context = Context::new(bound, intersector, settings);
    context.plan.record_mask = Some(0);
    let kind = kernel_of(bound, settings);
    let mut portion = Portion::none(bound, context.plan.replicates);
    let mut cost = Cost::default();
    let mut local = Local::new(bound);
    for &ray in rays {
        cost += dispatch(kind, &context, Which::Ray(ray), &mut local);
    }
    portion.tallies.take(&mut local, &context);
    portion.tallies.sort();
    portion.seconds = start.elapsed().as_secs_f64();
    Results::of(bound, settings, Traced { portion, cost, threads: 1 })
}

/// Number of replicates that a run is divided into.
pub fn replicates(bound: &BoundScene, settings: &RunSettings) -> u32 {
    Plan::new(bound, settings).replicates
}

/// Name of the kernel that a run with these settings uses; runs of one kernel are the same code.
pub fn kernel_name(bound: &BoundScene, settings: &RunSettings) -> &'static str {
    kernel_of(bound, settings).name()
}

pub(crate) fn kernel_of(bound: &BoundScene, settings: &RunSettings) -> KernelKind {
    let required = effects::required(bound).kernel;
    match settings.kernel {
        KernelChoice::Pruned => required,
        KernelChoice::With(effects) => required.max(KernelKind::of(effects)),
        KernelChoice::Full => KernelKind::Full,
    }
}

pub(super) fn dispatch(kind: KernelKind, context: &Context<'_>, which: Which, local: &mut Local) -> Cost {
    match kind {
        KernelKind::Mirror if context.plain() => kernel::trace::<Plain<Mirrors>>(context, which, local),
        KernelKind::Mirror => kernel::trace::<Mirrors>(context, which, local),
        KernelKind::Opaque if context.plain() => kernel::trace::<Plain<Nothing>>(context, which, local),
        KernelKind::Opaque => kernel::trace::<Nothing>(context, which, local),
        KernelKind::Clear if context.plain() => kernel::trace::<Plain<OneBody>>(context, which, local),
        KernelKind::Clear => kernel::trace::<OneBody>(context, which, local),
        KernelKind::Nested => kernel::trace::<Stack>(context, which, local),
        KernelKind::Coloured => kernel::trace::<Coloured>(context, which, local),
        KernelKind::Full => kernel::trace::<Everything>(context, which, local),
    }
}

impl<'a> Context<'a> {
    fn new(bound: &'a BoundScene, intersector: &'a dyn Intersector, settings: &'a RunSettings) -> Self {
        let select = |wanted: &dyn Fn(&super::receiver::Receiver) -> bool| -> Vec<u32> {
            (0..bound.receivers.len()).filter(|&i| wanted(&bound.receivers[i])).map(|i| i as u32).collect()
        };
        let region = bound.region;
        let stands = |r: &super::receiver::Receiver| matches!(r.shape, Shape::Plane { .. } | Shape::Sphere { .. });
        let mut context = Self {
            bound,
            intersector,
            settings,
            around: Vec::new(),
            plan: Plan::new(bound, settings),
            blocking: select(&|r| r.absorbs && stands(r) && r.meets(&region)),
            outside: select(&|r| r.absorbs && stands(r) && !r.meets(&region)),
            region,
            passing: select(&|r| !r.absorbs && stands(r)),
            far: select(&|r| matches!(r.shape, Shape::FarField { .. })),
            paths: None,
        };
        context.around = kernel::around_sources(&context);
        context
    }
}

//! A run: replicates handed out to threads, traced by the kernel that the scene needs, and summed.

use super::bind::BoundScene;
use super::dispatch::{self, kernel_kind};
use super::effects::KernelKind;
use super::emitter::Emitter;
use super::gather::{Gathering, ThreadSums};
use super::hooks::{Hooks, Progress, TracedRun};
use super::kernel::{Context, RaySelection};
use super::partial_run::PartialRun;
use super::path_sample::PathSample;
use super::plan::Plan;
use super::recorder::Recorder;
use super::results::Results;
use super::sequence_recorder::SequenceRecorder;
use super::settings::RunSettings;
use super::tallies::ReplicateTally;
use crate::intersect::{Cost, ExpectedRays, Intersector};
use crate::math::run_on_threads;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

/// Rays that are recorded together: of a replicate of the usual 128 some sixteen are, and room for more would have to be emptied each time.
const RECORDED_TOGETHER: usize = 16;

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
    Results::new(bound, settings, trace(bound, intersector, settings, None, &Hooks::with_progress(progress)))
}

/// Traces the replicates of a run (those of its shard) that are not done yet, and adds them to `from`, which must be a part of the same
/// run; `None` begins anew. Ends early, with whole replicates, where the progress hook says so.
pub fn trace(
    bound: &BoundScene,
    intersector: &dyn Intersector,
    settings: &RunSettings,
    from: Option<PartialRun>,
    hooks: &Hooks<'_>,
) -> TracedRun {
    let start = Instant::now();
    let single = RunSettings { batch: 1, ..settings.clone() };
    let mut context = Context::new(bound, intersector, settings);
    context.paths = hooks.paths;
    // Where few paths are recorded, their rays are traced once more by a kernel that records.
    let few = RunSettings { batch: RECORDED_TOGETHER, ..settings.clone() };
    let recording = if hooks.paths.is_some() {
        context.plan.record_all();
        None
    } else {
        context.plan.take_recording_plan().map(|plan| context.with_plan(plan, &few))
    };
    let mut all = context.plan.clone();
    all.record_all();
    let grouping = settings.sequences.then(|| context.with_plan(all, &single).without_path_sink());
    let mut before = from.unwrap_or_else(|| PartialRun::empty(bound, context.plan.replicates));
    // What was traced of a run that has grown since is a part of the larger one.
    before.grows = context.plan.grows();
    before.replicates = before.replicates.max(context.plan.replicates);
    // A smaller run kept the paths of more of its rays, among them all that are kept of this one.
    if before.grows && settings.path_samples > 0 {
        before.tallies.paths.retain(|ray| context.plan.samples(ray));
    }
    let shard = shard_replicates(context.plan.first_replicate..context.plan.replicates, settings.shard);
    let todo: Vec<u32> = shard.clone().filter(|r| before.done.binary_search(r).is_err()).collect();
    let threads = settings.thread_count();
    announce(&context, todo.len(), threads);
    let work = Work {
        context: &context,
        recording: recording.as_ref(),
        grouping: grouping.as_ref(),
        kind: kernel_kind(bound, settings),
        hooks,
        start,
        // Of a shard, its share of the rays: progress counts what this run traces.
        total: rays_of_replicates(context.plan.rays, shard.len(), context.plan.replicates),
        next: AtomicUsize::new(0),
        stop: AtomicBool::new(false),
        rays_done: AtomicU64::new(before.tallies.counts.rays),
        todo,
    };
    let gathering = Gathering::new(before, hooks, start);
    // No more threads than replicates, of which each takes one after the other: those that the system refuses leave none undone.
    let wanted = threads.min(work.todo.len()).max(1);
    let given = run_on_threads(wanted, || work.run(&gathering));
    let (partial, cost) = gathering.into_partial_run();
    TracedRun { partial, cost, threads: if given < wanted { given } else { threads } }
}

/// Returns the contiguous part of `all` that shard number `shard`, from 0, of `shards` traces: the parts are disjoint and make up `all`.
/// Empty from number `shards` on; 0 shards count as one.
pub fn shard_replicates(all: Range<u32>, [shard, shards]: [u32; 2]) -> Range<u32> {
    let count = u64::from(all.end.saturating_sub(all.start));
    let first = |k: u32| all.start + (count * u64::from(k) / u64::from(shards.max(1))).min(count) as u32;
    first(shard)..first(shard.saturating_add(1))
}

/// Returns the number of rays in some of the `replicates` replicates of a run of so many rays, to within one.
fn rays_of_replicates(rays: u64, some: usize, replicates: u32) -> u64 {
    // Of a run of 3·10¹¹ rays that grows the product does not fit into 64 bits.
    (u128::from(rays) * some as u128 / u128::from(replicates)) as u64
}

/// Data that the threads of a run share.
struct Work<'w, 'a> {
    context: &'w Context<'a>,
    /// For the rays that are traced once more to record their paths.
    recording: Option<&'w Context<'a>>,
    /// For the rays that are traced once more to group their light by sequence.
    grouping: Option<&'w Context<'a>>,
    kind: KernelKind,
    hooks: &'w Hooks<'w>,
    start: Instant,
    /// Rays to trace in all.
    total: u64,
    /// Replicates to trace, and the place of the next one to take.
    todo: Vec<u32>,
    next: AtomicUsize,
    stop: AtomicBool,
    rays_done: AtomicU64,
}

impl Work<'_, '_> {
    /// Takes replicates, traces them and adds them up, until none is left or the run is stopped: the work of one thread.
    fn run(&self, gathering: &Gathering<'_>) {
        let bound = self.context.bound;
        let mut tally = ReplicateTally::new(bound);
        let mut sums = ThreadSums::new(gathering, bound, self.context.plan.replicates);
        let mut recorder = self.recording.map(|context| Recorder::new(context, self.kind));
        let mut sequences = self.grouping.map(|context| SequenceRecorder::new(context, self.kind));
        // Whole replicates alone: which thread has which then changes no sum.
        while !self.stop.load(Ordering::Relaxed) {
            let Some(&replicate) = self.todo.get(self.next.fetch_add(1, Ordering::Relaxed)) else { break };
            let cost = dispatch::trace(self.kind, self.context, RaySelection::Replicate(replicate), &mut tally);
            if let Some(recorder) = &mut recorder {
                recorder.record(replicate, &mut tally);
            }
            if let Some(sequences) = &mut sequences {
                sequences.record(replicate, &mut tally);
            }
            tally.finish(bound);
            if let Some(hook) = self.hooks.replicate {
                hook(replicate, &tally);
            }
            let rays = tally.counts.rays + self.rays_done.fetch_add(tally.counts.rays, Ordering::Relaxed);
            sums.take(replicate, &mut tally, cost);
            let seconds = self.start.elapsed().as_secs_f64();
            if !(self.hooks.progress)(Progress { rays, total: self.total, seconds }) {
                self.stop.store(true, Ordering::Relaxed);
            }
        }
    }
}

/// Tells the intersector how many rays are to be traced in so many replicates, and which of them share an origin or direction. What pays
/// for that many it works out at once, on so many threads; the results stay the same.
fn announce(context: &Context<'_>, replicates: usize, threads: usize) {
    // Of a shard, a range or a run that is resumed not all rays are left, and what is worked out beforehand must pay for these.
    let left = |rays: u64| rays_of_replicates(rays, replicates, context.plan.replicates);
    let beam = |(k, e): (usize, &Emitter)| Some((e.beam()?, left(context.plan.rays_of_source(k))));
    let beams: Vec<_> = context.bound.emitters.iter().enumerate().filter_map(beam).collect();
    context.intersector.prepare_for(&ExpectedRays {
        rays: left(context.plan.rays),
        threads,
        beams: &beams,
        sag: 0.0,
    });
}

/// Does the work that the intersector does once for a run now, so that the times of two runs on it are comparable.
pub(crate) fn prepare(bound: &BoundScene, intersector: &dyn Intersector, settings: &RunSettings) {
    let context = Context::new(bound, intersector, settings);
    let replicates = (context.plan.first_replicate..context.plan.replicates).len();
    announce(&context, replicates, settings.thread_count());
}

/// Traces some rays of a run once more, by their number, and records their whole paths: `paths` and `ledger` of the results are theirs.
/// Numbers that the run does not have are passed over; powers are scaled as if these rays were all.
pub fn replay(bound: &BoundScene, intersector: &dyn Intersector, settings: &RunSettings, rays: &[u64]) -> Results {
    let start = Instant::now();
    // Each ray is traced alone, so that a wavefront needs a single place.
    let single = RunSettings { batch: 1, ..settings.clone() };
    let mut context = Context::new(bound, intersector, &single);
    context.plan.record_all();
    let kind = kernel_kind(bound, settings);
    let mut partial = PartialRun::empty(bound, context.plan.replicates);
    partial.tallies.paths = PathSample::whole();
    let mut cost = Cost::default();
    let mut tally = ReplicateTally::new(bound);
    for &ray in rays {
        cost += dispatch::trace(kind, &context, RaySelection::Ray(ray), &mut tally);
    }
    tally.finish(bound);
    partial.tallies.take(&mut tally, bound);
    partial.tallies.sort_paths();
    partial.seconds = start.elapsed().as_secs_f64();
    Results::new(bound, settings, TracedRun { partial, cost, threads: 1 })
}

/// Rays that are traced together where nothing of them is kept: their paths are a few megabytes.
const ASKED_TOGETHER: u64 = 1024;

/// Traces `count` rays of a run once more, every `step`-th from the first on, only to put their segments to the intersector, in batches.
/// The segments are those of [`replay`]; no results are kept.
pub fn ask_again(
    bound: &BoundScene,
    intersector: &dyn Intersector,
    settings: &RunSettings,
    (step, count): (u64, u64),
) {
    let mut context = Context::new(bound, intersector, settings);
    context.plan.record_all();
    let kind = kernel_kind(bound, settings);
    let mut tally = ReplicateTally::new(bound);
    for begin in (0..count).step_by(ASKED_TOGETHER as usize) {
        let count = ASKED_TOGETHER.min(count - begin);
        dispatch::trace(kind, &context, RaySelection::Spread { first: begin * step, step, count }, &mut tally);
        tally.discard();
    }
}

/// Returns the number of replicates that a run is divided into, those before its first ray included.
pub fn replicates(bound: &BoundScene, settings: &RunSettings) -> u32 {
    Plan::new(bound, settings).replicates
}

/// Returns the replicates of a run that its settings ask for: all of them, or those from its first ray on; shards are ignored.
pub fn replicate_range(bound: &BoundScene, settings: &RunSettings) -> Range<u32> {
    let plan = Plan::new(bound, settings);
    plan.first_replicate..plan.replicates
}

/// Whether a run is divided into replicates of [`GROWING_REPLICATE`](super::GROWING_REPLICATE) rays, so that further ones may follow.
pub fn grows(bound: &BoundScene, settings: &RunSettings) -> bool {
    Plan::new(bound, settings).grows()
}

/// Returns the rays that a run traces: more than are asked for where sources have numbers of their own.
pub fn rays_of_run(bound: &BoundScene, settings: &RunSettings) -> u64 {
    Plan::new(bound, settings).rays
}

#[cfg(test)]
mod tests {
    use super::rays_of_replicates;

    #[test]
    fn rays_of_a_huge_run_are_counted() {
        // 80 million replicates of 5000 rays, and the second half of them.
        let (rays, replicates) = (400_000_000_000, 80_000_000);
        assert_eq!(rays_of_replicates(rays, 80_000_000, replicates), rays);
        assert_eq!(rays_of_replicates(rays, 40_000_000, replicates), rays / 2);
    }
}

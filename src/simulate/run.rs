use super::bind::BoundScene;
use super::effects::{self, KernelKind};
use super::kernel::{self, Coloured, Context, Everything, Local, Nothing, OneBody, Stack, Tallies};
use super::receiver::Shape;
use super::results::Results;
use super::scene::{Interfaces, Run, Sampling};
use super::tally::QUANTA;
use crate::intersect::{Cost, Intersector};
use crate::optics::Effects;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::time::Instant;

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

/// The rays of one source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SourceShare {
    first: u64,
    rays: u64,
    pub(crate) quanta: f64,
}

impl SourceShare {
    /// The rays of one of `n` replicates.
    pub(crate) fn range(&self, replicate: u32, n: u32) -> [u64; 2] {
        let at = |k: u32| self.first + (u128::from(self.rays) * u128::from(k) / u128::from(n)) as u64;
        [at(replicate), at(replicate + 1)]
    }
}

/// How the rays of a run are divided among sources and replicates.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) shares: Vec<SourceShare>,
    pub(crate) replicates: u32,
    pub(crate) rays: u64,
    /// Power of a quantum, in the unit of the sources.
    pub(crate) quantum: f64,
    pub(crate) emitted: f64,
    /// Every 2ᵏ-th ray is recorded; none when absent.
    record_mask: Option<u64>,
    /// How far an escaping ray is drawn, mm.
    pub(crate) reach: f64,
}

impl Plan {
    fn new(bound: &BoundScene, settings: &RunSettings) -> Self {
        let emitted: f64 = bound.emitters.iter().map(|e| e.power).sum();
        // Rounded sums, not rounded shares: three equal sources share a million rays without losing one.
        let (mut share, mut given) = (0.0, 0);
        let counts: Vec<u64> = bound
            .emitters
            .iter()
            .map(|e| {
                share += e.power / emitted;
                let upto = (settings.rays as f64 * share).round() as u64;
                let own = upto.saturating_sub(given);
                given = upto;
                e.rays.unwrap_or(own).max(1)
            })
            .collect();
        let rays: u64 = counts.iter().sum();
        let mut first = 0;
        let shares = bound
            .emitters
            .iter()
            .zip(&counts)
            .map(|(e, &n)| {
                // Each source emits exactly its power: its rays weigh a little more or less than the average one.
                let quanta = (QUANTA * (e.power / emitted) * (rays as f64 / n as f64)).round().max(1.0);
                let share = SourceShare { first, rays: n, quanta };
                first += n;
                share
            })
            .collect();
        // At least 16 rays of the run in each replicate, so that a small run still has an error to state.
        let replicates = settings.replicates.clamp(2, (rays / 16).clamp(2, 1 << 16) as u32);
        let record_mask =
            (settings.path_samples > 0).then(|| (rays / settings.path_samples.min(rays)).next_power_of_two() - 1);
        let quantum = emitted / (rays as f64 * QUANTA);
        Self { shares, replicates, rays, quantum, emitted, record_mask, reach: 100.0 }
    }

    #[inline]
    pub(crate) fn records(&self, ray: u64) -> bool {
        self.record_mask.is_some_and(|m| ray & m == 0)
    }
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
    let required = effects::required(bound);
    let kind = match settings.kernel {
        KernelChoice::Pruned => required.kernel,
        KernelChoice::With(effects) => required.kernel.max(KernelKind::of(effects)),
        KernelChoice::Full => KernelKind::Full,
    };
    let (tallies, plan, cost, seconds, threads) = run(bound, intersector, settings, kind, progress);
    Results::new(bound, &plan, &required, kind, tallies, cost, seconds, threads)
}

fn run(
    bound: &BoundScene,
    intersector: &dyn Intersector,
    settings: &RunSettings,
    kind: KernelKind,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> (Tallies, Plan, Cost, f64, usize) {
    let start = Instant::now();
    let select = |wanted: &dyn Fn(&super::receiver::Receiver) -> bool| -> Vec<u32> {
        (0..bound.receivers.len()).filter(|&i| wanted(&bound.receivers[i])).map(|i| i as u32).collect()
    };
    let region = bound.region;
    let stands = |r: &super::receiver::Receiver| matches!(r.shape, Shape::Plane { .. } | Shape::Sphere { .. });
    let outside = select(&|r| r.absorbs && stands(r) && !r.meets(&region));
    let context = Context {
        bound,
        intersector,
        settings,
        plan: Plan::new(bound, settings),
        blocking: select(&|r| r.absorbs && stands(r) && r.meets(&region)),
        outside,
        region,
        passing: select(&|r| !r.absorbs && stands(r)),
        far: select(&|r| matches!(r.shape, Shape::FarField { .. })),
    };
    let replicates = context.plan.replicates;
    let [shard, shards] = settings.shard;
    let mine = |k: u32| (u64::from(replicates) * u64::from(k) / u64::from(shards.max(1))) as u32;
    let (first, last) = (mine(shard), mine(shard + 1).min(replicates));
    let threads = match settings.threads {
        0 => std::thread::available_parallelism().map_or(1, |n| n.get()),
        n => n,
    };
    let next = AtomicU32::new(first);
    let (done, stop) = (AtomicU64::new(0), AtomicBool::new(false));
    let total = Mutex::new((Tallies::new(bound), Cost::default()));
    let share = context.plan.rays * u64::from(last.saturating_sub(first)) / u64::from(replicates);
    let work = || {
        let mut local = Local::new(bound);
        while !stop.load(Ordering::Relaxed) {
            let replicate = next.fetch_add(1, Ordering::Relaxed);
            if replicate >= last {
                break;
            }
            let cost = match kind {
                KernelKind::Opaque => kernel::trace::<Nothing>(&context, replicate, &mut local),
                KernelKind::Clear => kernel::trace::<OneBody>(&context, replicate, &mut local),
                KernelKind::Nested => kernel::trace::<Stack>(&context, replicate, &mut local),
                KernelKind::Coloured => kernel::trace::<Coloured>(&context, replicate, &mut local),
                KernelKind::Full => kernel::trace::<Everything>(&context, replicate, &mut local),
            };
            let rays = done.fetch_add(local.counts.rays, Ordering::Relaxed) + local.counts.rays;
            let mut sums = total.lock().unwrap_or_else(|e| e.into_inner());
            sums.0.take(&mut local, &context);
            sums.1 += cost;
            drop(sums);
            if !progress(Progress { rays, total: share, seconds: start.elapsed().as_secs_f64() }) {
                stop.store(true, Ordering::Relaxed);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(work);
        }
        work();
    });
    let (mut tallies, cost) = total.into_inner().unwrap_or_else(|e| e.into_inner());
    tallies.sort();
    (tallies, context.plan, cost, start.elapsed().as_secs_f64(), threads)
}

//! The sums of all threads: each keeps its own and hands them over now and then.
//!
//! A replicate touches some thousand cells of a receiver; were all threads to add to one set of sums, its memory would wander
//! from core to core after each replicate, one thread at a time.

use super::bind::BoundScene;
use super::hooks::Hooks;
use super::partial_run::PartialRun;
use super::tallies::ReplicateTally;
use crate::intersect::Cost;
use std::sync::{Mutex, MutexGuard};
use std::time::Instant;

/// Cells of all receivers, faces and bodies up to which each thread has sums of its own: 32 MB.
const MOST_THREAD_CELLS: usize = 1 << 20;

/// The total of what all threads have handed over, behind a lock, and the hooks that are notified of it.
pub(super) struct Gathering<'a> {
    total: Mutex<(PartialRun, Cost)>,
    hooks: &'a Hooks<'a>,
    start: Instant,
    /// Seconds of earlier runs.
    spent: f64,
}

impl<'a> Gathering<'a> {
    /// Begins with what earlier runs have done; `start` is when this run began.
    pub(super) fn new(before: PartialRun, hooks: &'a Hooks<'a>, start: Instant) -> Self {
        let spent = before.seconds;
        Self { total: Mutex::new((before, Cost::default())), hooks, start, spent }
    }

    /// Waits for the lock and takes it; sums that a panicked thread left are whole, and used.
    fn lock(&self) -> MutexGuard<'_, (PartialRun, Cost)> {
        // A thread that panicked while it held the lock has left whole sums or none: they are added under it in one
        // go.
        self.total.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Changes the total by `add` under the lock, brings its seconds up to date, and calls the hook `finished`, still under the lock.
    fn add(&self, add: impl FnOnce(&mut PartialRun), cost: Cost) {
        let mut sums = self.lock();
        add(&mut sums.0);
        sums.0.seconds = self.spent + self.start.elapsed().as_secs_f64();
        sums.1 += cost;
        if let Some(finished) = self.hooks.finished {
            finished(&sums.0);
        }
    }

    /// Returns the total, its paths in order of their rays, and the intersector's work. Threads must have dropped their sums before.
    pub(super) fn into_partial_run(self) -> (PartialRun, Cost) {
        let (mut partial, cost) = self.total.into_inner().unwrap_or_else(|e| e.into_inner());
        // Only here: paths come from all threads as they end, and are kept in order of their rays.
        partial.tallies.sort_paths();
        partial.seconds = self.spent + self.start.elapsed().as_secs_f64();
        (partial, cost)
    }
}

/// The sums of one thread.
pub(super) struct ThreadSums<'a, 'g> {
    all: &'g Gathering<'a>,
    bound: &'g BoundScene,
    /// None where one set of sums has to do.
    partial: Option<PartialRun>,
    /// Number of replicates of the whole run.
    replicates: u32,
    cost: Cost,
    /// When it last handed its sums over.
    handed: Instant,
}

impl<'a, 'g> ThreadSums<'a, 'g> {
    /// Makes empty sums for a thread; none of its own where a set has more than [`MOST_THREAD_CELLS`] cells.
    pub(super) fn new(all: &'g Gathering<'a>, bound: &'g BoundScene, replicates: u32) -> Self {
        let receivers: usize = bound.receivers.iter().map(|r| r.sum_count()).sum();
        let fits = receivers + bound.faces.len() + bound.bodies.len() <= MOST_THREAD_CELLS;
        let partial = fits.then(|| PartialRun::empty(bound, replicates));
        Self { all, bound, partial, replicates, cost: Cost::default(), handed: Instant::now() }
    }

    /// Adds a finished replicate and empties its `tally`. Hands the thread's sums over when `every` has passed and someone listens; without
    /// sums of its own, adds to the total at once.
    pub(super) fn take(&mut self, replicate: u32, tally: &mut ReplicateTally, cost: Cost) {
        match &mut self.partial {
            Some(partial) => {
                partial.take(replicate, tally, self.bound);
                self.cost += cost;
                if self.all.hooks.finished.is_some() && self.handed.elapsed() >= self.all.hooks.every {
                    self.hand_over();
                    self.partial = Some(PartialRun::empty(self.bound, self.replicates));
                }
            }
            // Large sums are kept once for all, and each replicate is added under the lock.
            None => self.all.add(|total| total.take(replicate, tally, self.bound), cost),
        }
    }

    /// Adds what this thread has gathered to the total, and leaves the thread without sums; does nothing where no replicate is done.
    fn hand_over(&mut self) {
        if let Some(partial) = self.partial.take()
            && !partial.done.is_empty()
        {
            self.all.add(|total| total.add(&partial), std::mem::take(&mut self.cost));
        }
        self.handed = Instant::now();
    }
}

impl Drop for ThreadSums<'_, '_> {
    fn drop(&mut self) {
        self.hand_over();
    }
}

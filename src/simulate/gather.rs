//! The sums of all threads: each keeps its own and hands them over now and then.
//!
//! A replicate touches some thousand cells of a receiver; were all threads to add to one set of sums, its memory would wander
//! from core to core after each replicate, one thread at a time.

use super::bind::BoundScene;
use super::kernel::{Context, Local};
use super::portion::Portion;
use super::run::Hooks;
use crate::intersect::Cost;
use std::sync::{Mutex, MutexGuard};
use std::time::Instant;

/// Cells of all receivers, faces and bodies up to which each thread has sums of its own: 32 MB.
const MOST_OWN: usize = 1 << 20;

/// What all threads have handed over.
pub(super) struct Gather<'a> {
    total: Mutex<(Portion, Cost)>,
    hooks: &'a Hooks<'a>,
    start: Instant,
    /// Seconds of earlier runs.
    spent: f64,
}

impl<'a> Gather<'a> {
    pub(super) fn new(before: Portion, hooks: &'a Hooks<'a>, start: Instant) -> Self {
        let spent = before.seconds;
        Self { total: Mutex::new((before, Cost::default())), hooks, start, spent }
    }

    fn lock(&self) -> MutexGuard<'_, (Portion, Cost)> {
        self.total.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Adds to what all have gathered, and tells.
    fn add(&self, add: impl FnOnce(&mut Portion), cost: Cost) {
        let mut sums = self.lock();
        add(&mut sums.0);
        sums.0.seconds = self.spent + self.start.elapsed().as_secs_f64();
        sums.1 += cost;
        if let Some(finished) = self.hooks.finished {
            finished(&sums.0);
        }
    }

    /// All of it.
    pub(super) fn into_whole(self) -> (Portion, Cost) {
        let (mut portion, cost) = self.total.into_inner().unwrap_or_else(|e| e.into_inner());
        portion.tallies.sort();
        portion.seconds = self.spent + self.start.elapsed().as_secs_f64();
        (portion, cost)
    }
}

/// The sums of one thread.
pub(super) struct Own<'a, 'g> {
    all: &'g Gather<'a>,
    bound: &'g BoundScene,
    /// None where one set of sums has to do.
    portion: Option<Portion>,
    replicates: u32,
    cost: Cost,
    handed: Instant,
}

impl<'a, 'g> Own<'a, 'g> {
    pub(super) fn new(all: &'g Gather<'a>, bound: &'g BoundScene, replicates: u32) -> Self {
        let receivers: usize = bound.receivers.iter().map(|r| r.sum_count()).sum();
        let small = receivers + bound.faces.len() + bound.bodies.len() <= MOST_OWN;
        let portion = small.then(|| Portion::none(bound, replicates));
        Self { all, bound, portion, replicates, cost: Cost::default(), handed: Instant::now() }
    }

    /// Takes in what a whole replicate gathered, and empties it.
    pub(super) fn take(&mut self, replicate: u32, local: &mut Local, context: &Context<'_>, cost: Cost) {
        match &mut self.portion {
            Some(portion) => {
                portion.take(replicate, local, context);
                self.cost += cost;
                if self.all.hooks.finished.is_some() && self.handed.elapsed() >= self.all.hooks.every {
                    self.hand_over();
                    self.portion = Some(Portion::none(self.bound, self.replicates));
                }
            }
            None => self.all.add(|total| total.take(replicate, local, context), cost),
        }
    }

    fn hand_over(&mut self) {
        if let Some(portion) = self.portion.take()
            && !portion.done.is_empty()
        {
            self.all.add(|total| total.add(&portion), std::mem::take(&mut self.cost));
        }
        self.handed = Instant::now();
    }
}

impl Drop for Own<'_, '_> {
    fn drop(&mut self) {
        self.hand_over();
    }
}

//! What a run reports while it runs, and what it returns.

use super::outcome::PathSink;
use super::partial_run::PartialRun;
use super::tallies::ReplicateTally;
use crate::intersect::Cost;
use std::time::Duration;

/// How far a run has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Rays finished, those of earlier runs that it goes on from included.
    pub rays: u64,
    /// Rays to trace in all.
    pub total: u64,
    /// Seconds since this run started.
    pub seconds: f64,
}

/// Takes the number and the tally of a replicate, from any thread.
pub type ReplicateHook<'a> = &'a (dyn Fn(u32, &ReplicateTally) + Sync);

/// What a run reports while it runs.
#[derive(Clone, Copy)]
pub struct Hooks<'a> {
    /// Called from the worker threads after each replicate; it ends the run early by returning `false`.
    pub progress: &'a (dyn Fn(Progress) -> bool + Sync),
    /// Called with all that is done so far, one call at a time.
    pub finished: Option<&'a (dyn Fn(&PartialRun) + Sync)>,
    /// How long each thread holds back what it has done from `finished`; zero for a call after each replicate, which runs with receivers of
    /// more than a million cells get in any case.
    pub every: Duration,
    /// Called with the tally of each replicate when it is done, from any thread and in no particular order; each replicate comes once.
    pub replicate: Option<ReplicateHook<'a>>,
    /// Takes the vertices of every path, in pieces and in no particular order, from any thread.
    pub paths: Option<PathSink<'a>>,
}

impl<'a> Hooks<'a> {
    /// Makes hooks that report progress alone.
    pub fn with_progress(progress: &'a (dyn Fn(Progress) -> bool + Sync)) -> Self {
        Self { progress, finished: None, every: Duration::ZERO, replicate: None, paths: None }
    }
}

/// A run, or the part of it that was asked for.
#[derive(Clone, Debug, Default)]
pub struct TracedRun {
    /// The replicates that are done, and their sums.
    pub partial: PartialRun,
    /// Work of the intersector.
    pub cost: Cost,
    /// Threads used.
    pub threads: usize,
}

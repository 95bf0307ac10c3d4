//! What a job reports while it runs.

use super::settings::IntersectorKind;
use crate::study;
use crate::study::default_accuracy::TracingChoice;
use std::path::Path;

/// A stage of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage<'a> {
    /// A model is read from this file.
    Reading(&'a Path),
    /// Facets are made.
    Tessellating,
    /// A pilot chooses between facets and spline.
    Choosing,
    /// Facets that keep an accuracy are looked for; [`Monitor::study_progress`] reports how far.
    Aiming,
    /// An intersector is built.
    Building(IntersectorKind),
    /// What the results are checked with is built: the spline or a BVH.
    BuildingCheck(&'static str),
    /// Rays are traced, so many at most.
    Tracing(u64),
    /// So many rays are traced again by the other intersectors.
    Checking(u64),
}

/// Receives the progress of a job. Every method does nothing unless it is overridden.
pub trait Monitor: Sync {
    /// Called when a stage begins.
    fn begin(&self, _stage: Stage<'_>) {}

    /// Reports that so many rays of the stage are done, of so many; called from any thread. `false` ends tracing early.
    fn advance(&self, _done: u64, _total: u64) -> bool {
        true
    }

    /// Called when verdicts leave so many rows unsure and the run goes on with so many rays.
    fn unsettled(&self, _rows: usize, _rays: u64) {}

    /// Reports how far a study has come.
    fn study_progress(&self, _progress: &study::Progress) {}

    /// Called when the stage is over.
    fn end(&self) {}

    /// Called when something went wrong that changes no result.
    fn warns(&self, _message: &str) {}

    /// Called when tolerance, normals and intersector were chosen.
    fn chosen(&self, _chosen: &TracingChoice) {}

    /// Called when facets that keep an accuracy are found, with a sentence about them.
    fn aimed(&self, _answer: &str) {}

    /// Reports that a run goes on with so many rays, as its error was so many per cent, or unknown where nothing arrived.
    fn grows(&self, _found_percent: Option<f64>, _rays: u64) {}
}

/// A monitor that ignores everything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Monitor for Silent {}

/// Does a piece of work and notifies the monitor when it begins and ends.
pub(super) fn in_stage<T>(monitor: &dyn Monitor, stage: Stage<'_>, work: impl FnOnce() -> T) -> T {
    monitor.begin(stage);
    let made = work();
    monitor.end();
    made
}

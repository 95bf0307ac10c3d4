//! The recorded paths of a run that records few: their rays are traced once more.
//!
//! Random numbers are keyed by ray, so it takes the same path again, bit by bit. The run itself then needs no kernel that can record:
//! to record 2,000 paths of a reflector cost all its four million rays 5 % of their time.

use super::dispatch;
use super::effects::KernelKind;
use super::kernel::{Context, RaySelection};
use super::tallies::ReplicateTally;

/// Traces the rays that are recorded.
pub(super) struct Recorder<'c, 'a> {
    context: &'c Context<'a>,
    kind: KernelKind,
    /// Where their light ends, which was counted already.
    tally: ReplicateTally,
}

impl<'c, 'a> Recorder<'c, 'a> {
    /// Serves a run whose plan says which rays are recorded; `kind` must be a kernel that records.
    pub(super) fn new(context: &'c Context<'a>, kind: KernelKind) -> Self {
        Self { context, kind, tally: ReplicateTally::new(context.bound) }
    }

    /// Traces the recorded rays of a replicate once more and appends their paths to its `tally`; nothing else is added.
    pub(super) fn record(&mut self, replicate: u32, tally: &mut ReplicateTally) {
        for [first, step, count] in self.context.plan.recorded_rays(replicate) {
            let rays = RaySelection::Spread { first, step, count };
            dispatch::trace(self.kind, self.context, rays, &mut self.tally);
        }
        tally.paths.append(&mut self.tally.paths);
        self.tally.discard();
    }
}

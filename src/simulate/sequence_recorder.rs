//! The sequences of a run: each ray is traced once more, by itself, by a kernel that records.
//!
//! Random numbers are keyed by ray, so it takes the same path again, bit by bit: what the run counts does not depend on whether
//! sequences are asked for, and a run without them pays nothing.

use super::dispatch;
use super::effects::KernelKind;
use super::kernel::{Context, RaySelection};
use super::sequence;
use super::tallies::ReplicateTally;

/// Traces the rays of a replicate again and groups their light.
pub(super) struct SequenceRecorder<'c, 'a> {
    context: &'c Context<'a>,
    kind: KernelKind,
    /// Where their light ends, which was counted already.
    tally: ReplicateTally,
}

impl<'c, 'a> SequenceRecorder<'c, 'a> {
    /// Serves a context whose plan records every ray; `kind` must be a kernel that records.
    pub(super) fn new(context: &'c Context<'a>, kind: KernelKind) -> Self {
        let tally = ReplicateTally { deposits: Some(Vec::new()), ..ReplicateTally::new(context.bound) };
        Self { context, kind, tally }
    }

    /// Traces the rays of a replicate once more and adds their sequences to its `tally`; nothing else is added.
    pub(super) fn record(&mut self, replicate: u32, tally: &mut ReplicateTally) {
        for (source, ray) in self.context.plan.rays_of_replicate(replicate) {
            dispatch::trace(self.kind, self.context, RaySelection::Ray(ray), &mut self.tally);
            let deposits = self.tally.deposits.as_deref().unwrap_or(&[]);
            let vertices = &self.tally.paths;
            sequence::add_ray(self.context.bound, source as u32, vertices, deposits, |sequence, quanta| {
                tally.sequences.add(sequence, quanta);
            });
            self.tally.paths.clear();
            self.tally.deposits.iter_mut().for_each(Vec::clear);
        }
        // All of it was counted when the rays were traced first.
        self.tally.discard();
    }
}

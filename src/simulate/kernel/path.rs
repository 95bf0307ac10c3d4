//! A path under way.

use super::context::Context;
use super::payload::RayPayload;
use crate::simulate::emitter::RayIndex;
use crate::simulate::random::{Key, split_branch};
use crate::simulate::scene::Sampling;

/// Which rays to trace.
#[derive(Clone, Copy, Debug)]
pub(crate) enum RaySelection {
    /// All rays of a replicate.
    Replicate(u32),
    /// One ray of the run.
    Ray(u64),
    /// `count` rays of the run, every `step`-th from `first` on.
    Spread { first: u64, step: u64, count: u64 },
    /// One ray of the list of a source, whatever share of the power it has.
    Listed { source: u32, ray: u64 },
}

/// A path under way; its ray is kept apart, in the slice that the intersector reads.
#[derive(Clone, Copy)]
pub(super) struct Path<C> {
    /// Number of its ray in the run.
    pub(super) ray: u64,
    /// Number of its ray among those of its source and replicate.
    pub(super) in_net: u32,
    /// Which of the paths that split off that ray.
    pub(super) branch: u32,
    /// Hits so far.
    pub(super) bounce: u32,
    /// Power, a whole number of quanta.
    pub(super) quanta: f64,
    /// Power at the source.
    pub(super) first_quanta: f64,
    /// mm so far.
    pub(super) length: f64,
    /// What ends the segment unless a face comes first: a receiver, [`NO_RECEIVER`] or [`SCATTERS`].
    pub(super) receiver: u32,
    /// Length up to the last hit that was no total reflection, mm.
    pub(super) released_at: f32,
    /// Segments in a row that were shorter than [`WITHIN_EDGE`].
    pub(super) short_segments: u32,
    pub(super) payload: C,
}

/// A segment below this length, mm, lies in the edge between two facets, or crosses the gap between two faces that touch.
const WITHIN_EDGE: f64 = 1e-6;
/// Such segments in a row from which on light counts as caught in an edge; a contact has one.
const CAUGHT_IN_EDGE: u32 = 3;

/// No receiver ahead.
pub(super) const NO_RECEIVER: u32 = u32::MAX;
/// The ray scatters inside its body at the end of its segment.
pub(super) const SCATTERS: u32 = u32::MAX - 1;

impl<C: RayPayload> Path<C> {
    /// Makes the path of a ray, by its numbers, that has not left its source: branch 0, no hits, no receiver ahead.
    pub(super) fn at_source(index: RayIndex, quanta: f64, payload: C) -> Self {
        Self {
            ray: index.in_run,
            in_net: index.in_stream,
            branch: 0,
            bounce: 0,
            quanta,
            first_quanta: quanta,
            length: 0.0,
            receiver: NO_RECEIVER,
            released_at: 0.0,
            short_segments: 0,
            payload,
        }
    }

    /// Returns the key of the random numbers of its present vertex.
    #[inline(always)]
    pub(super) fn key(&self, context: &Context<'_>) -> Key {
        let settings = context.settings;
        Key {
            seed: settings.seed,
            ray: self.ray,
            branch: self.branch,
            bounce: self.bounce,
            in_net: (settings.sampling == Sampling::Sobol).then_some(self.in_net),
        }
    }

    /// Takes it over a segment of this length, mm.
    #[inline(always)]
    pub(super) fn run(&mut self, length: f64) {
        self.length += length;
        self.short_segments = if length < WITHIN_EDGE { self.short_segments + 1 } else { 0 };
    }

    /// Whether it goes to and fro in the edge between two facets, in ever shorter segments: at last it would be beside them.
    #[inline(always)]
    pub(super) fn is_caught_in_edge(&self) -> bool {
        self.short_segments >= CAUGHT_IN_EDGE
    }

    /// Notes that it has just met what is no total reflection; does nothing without media.
    #[inline(always)]
    pub(super) fn release(&mut self) {
        // Only in a body can light go round by total reflection.
        if C::MEDIA {
            self.released_at = self.length as f32;
        }
    }

    /// Whether it has gone in a body by total reflection alone for longer than the body's `trapped_length`, and so will go round for ever.
    #[inline(always)]
    pub(super) fn is_trapped_in(&self, context: &Context<'_>, body: u32) -> bool {
        self.length - f64::from(self.released_at) > context.bound.bodies[body as usize].trapped_length
    }

    /// Returns the number of the path that splits off at its present vertex; it depends on the splits before alone, not on the order of
    /// tracing.
    pub(super) fn split_branch(&self) -> u32 {
        split_branch(self.branch, self.bounce)
    }
}

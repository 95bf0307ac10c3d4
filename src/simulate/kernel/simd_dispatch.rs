//! The kernel compiled for the baseline of the target and for processors with AVX2; both give the same bits.

use super::context::Context;
use super::path::RaySelection;
use super::payload::RayPayload;
use super::wavefront::trace_rays;
use crate::intersect::Cost;
use crate::math::simd::{self, Instructions, Kernel};
use crate::simulate::tallies::ReplicateTally;
use std::marker::PhantomData;

/// Rays to be traced, by paths that carry `C`.
struct Trace<'a, 'c, C> {
    context: &'a Context<'c>,
    rays: RaySelection,
    tally: &'a mut ReplicateTally,
    payload: PhantomData<C>,
}

impl<C: RayPayload> Kernel for Trace<'_, '_, C> {
    type Output = Cost;

    #[inline(always)]
    fn run<I: Instructions>(self) -> Cost {
        trace_rays::<C>(self.context, self.rays, self.tally)
    }
}

/// Traces these rays with the widest instructions that there are, adds what becomes of them to `tally`, and returns the intersector's work.
pub(crate) fn trace<C: RayPayload>(context: &Context<'_>, rays: RaySelection, tally: &mut ReplicateTally) -> Cost {
    simd::dispatch(Trace::<C> { context, rays, tally, payload: PhantomData })
}

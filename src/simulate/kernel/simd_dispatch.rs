//! The kernel compiled twice: for the baseline of the target, and for processors with AVX2.
//!
//! It is the same source, and the compiler neither fuses nor reorders floating-point operations, so that both give the same bits.
//! Sound because the second is entered only where its instructions were found at run time.
#![allow(unsafe_code)]

use super::context::Context;
use super::path::RaySelection;
use super::payload::RayPayload;
use super::wavefront::trace_rays;
use crate::intersect::Cost;
use crate::simulate::tallies::ReplicateTally;

/// Traces these rays and adds them to a tally. Returns the intersector's work.
pub(crate) fn trace<C: RayPayload>(context: &Context<'_>, rays: RaySelection, tally: &mut ReplicateTally) -> Cost {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt")]
        fn trace_avx2<C: RayPayload>(
            context: &Context<'_>,
            rays: RaySelection,
            tally: &mut ReplicateTally,
        ) -> Cost {
            trace_rays::<C>(context, rays, tally)
        }
        let supported = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt");
        if supported {
            // SAFETY: all features were just found.
            return unsafe { trace_avx2::<C>(context, rays, tally) };
        }
    }
    trace_rays::<C>(context, rays, tally)
}

//! The kernel compiled twice: for the baseline of the target, and for processors with AVX2.
//!
//! It is the same source, and the compiler neither fuses nor reorders floating-point operations, so that both give the same bits.
//! Sound because the second is entered only where its instructions were found at run time.
#![allow(unsafe_code)]

use super::{Carry, Context, Local, Which, trace_rays};
use crate::intersect::Cost;

/// Traces these rays and adds them to `local`. Returns the intersector's work.
pub(crate) fn trace<C: Carry>(context: &Context<'_>, which: Which, local: &mut Local) -> Cost {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt")]
        fn avx2<C: Carry>(context: &Context<'_>, which: Which, local: &mut Local) -> Cost {
            trace_rays::<C>(context, which, local)
        }
        let found = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt");
        if found {
            // SAFETY: all features were just found.
            return unsafe { avx2::<C>(context, which, local) };
        }
    }
    trace_rays::<C>(context, which, local)
}

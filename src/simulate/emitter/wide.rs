//! What is made for many rays at a time, compiled twice: for the baseline of the target, and for processors with AVX2.
//!
//! It is the same source, and the compiler neither fuses nor reorders floating-point operations, so that both give the same bits.
//! Sound because the second is entered only where its instructions were found at run time.
#![allow(unsafe_code)]

use super::Emitter;
use super::stream::Stream;

/// Makes ready the rays that start from the `started`-th on.
#[inline(never)]
pub(super) fn prepare(emitter: &Emitter, stream: &mut Stream, started: u32) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt")]
        fn avx2(emitter: &Emitter, stream: &mut Stream, started: u32) {
            stream.refill(emitter, started);
        }
        let found = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt");
        if found {
            // SAFETY: all features were just found.
            return unsafe { avx2(emitter, stream, started) };
        }
    }
    stream.refill(emitter, started);
}

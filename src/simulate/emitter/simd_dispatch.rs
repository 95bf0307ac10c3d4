//! The loops that make many rays at a time, compiled twice: for the baseline of the target, and for processors with AVX2.
//!
//! It is the same source, and the compiler neither fuses nor reorders floating-point operations, so that both give the same bits.
//! Sound because the second is entered only where its instructions were found at run time.
#![allow(unsafe_code)]

use super::Emitter;
use super::packet::RayPacket;
use super::stream::Stream;

/// Makes ready the numbers and the packet of rays from the `started`-th ray on.
#[inline(never)]
pub(super) fn refill(emitter: &Emitter, stream: &mut Stream, packet: Option<&mut RayPacket>, started: u32) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt")]
        fn refill_avx2(emitter: &Emitter, stream: &mut Stream, packet: Option<&mut RayPacket>, started: u32) {
            refill_inline(emitter, stream, packet, started);
        }
        let supported = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt");
        if supported {
            // SAFETY: all features were just found.
            return unsafe { refill_avx2(emitter, stream, packet, started) };
        }
    }
    refill_inline(emitter, stream, packet, started);
}

#[inline(always)]
fn refill_inline(emitter: &Emitter, stream: &mut Stream, packet: Option<&mut RayPacket>, started: u32) {
    stream.refill(started);
    if let Some(packet) = packet {
        packet.fill(emitter, stream, started);
    }
}

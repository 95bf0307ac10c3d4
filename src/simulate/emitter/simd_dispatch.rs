//! The loops that make many rays at a time, compiled for the baseline of the target and for processors with AVX2; both give the
//! same bits.

use super::Emitter;
use super::packet::RayPacket;
use super::stream::Stream;
use crate::math::simd::{self, Instructions, Kernel};

/// Numbers and rays to be made ready.
struct Refill<'a> {
    emitter: &'a Emitter,
    stream: &'a mut Stream,
    packet: Option<&'a mut RayPacket>,
    started: u32,
}

impl Kernel for Refill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        self.stream.refill(self.started);
        if let Some(packet) = self.packet {
            packet.fill(self.emitter, self.stream, self.started);
        }
    }
}

/// Fills the stream's numbers and the packet, if there is one, from the `started`-th ray on, with the widest instructions that there are.
#[inline(never)]
pub(super) fn refill(emitter: &Emitter, stream: &mut Stream, packet: Option<&mut RayPacket>, started: u32) {
    simd::dispatch(Refill { emitter, stream, packet, started });
}

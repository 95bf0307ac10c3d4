//! The rays of one source in one replicate, in the order in which they start.

use super::packet::RayPacket;
use super::stream::{RayIndex, Stream};
use super::{Emission, Emitter, simd_dispatch};
use crate::math::Ray;
use crate::simulate::scene::Sampling;

/// Draws the rays of one source in one replicate.
#[derive(Clone, Debug)]
pub(crate) struct RaySampler {
    stream: Stream,
    /// The rays that start next, where the source can make many at a time.
    packet: Option<Box<RayPacket>>,
    /// Number in the run of the first ray.
    first: u64,
}

impl RaySampler {
    /// For the numbers of a stream; the first of its rays has the number `first` in the run.
    pub(crate) fn new(emitter: &Emitter, stream: Stream, first: u64) -> Self {
        let stream = stream.with_pairs(emitter.needed_pairs());
        let packed = stream.sampling() == Sampling::Sobol && stream.needs_numbers() && emitter.fits_packets();
        Self { stream, packet: packed.then(RayPacket::boxed), first }
    }

    /// Puts the ray to start after `started` others into `ray`. By reference: a whole ray that is written in pieces and copied at
    /// once was waited for, 15 % of the kernel's time.
    #[inline(always)]
    pub(crate) fn next_ray(&mut self, emitter: &Emitter, started: u32, ray: &mut Ray) -> (RayIndex, Emission) {
        if self.stream.is_refill_due(started) {
            simd_dispatch::refill(emitter, &mut self.stream, self.packet.as_deref_mut(), started);
        }
        let index = self.index(self.stream.index_to_start(started));
        let Some(packet) = &self.packet else {
            let emission = emitter.emit(&self.stream, index, ray);
            emitter.bring_near(ray);
            return (index, emission);
        };
        let (origin, direction) = packet.ray(started as usize);
        *ray = Ray::new(origin, direction);
        emitter.bring_near(ray);
        (index, Emission { from: None, wavelength: emitter.wavelength(&self.stream, index) })
    }

    /// Puts the ray of an index in this source and replicate, the one ray that is started, into `ray`.
    pub(crate) fn single_ray(&mut self, emitter: &Emitter, index: u32, ray: &mut Ray) -> (RayIndex, Emission) {
        self.stream.prepare_single(index);
        let index = self.index(index);
        let emission = emitter.emit(&self.stream, index, ray);
        emitter.bring_near(ray);
        (index, emission)
    }

    #[inline(always)]
    fn index(&self, in_stream: u32) -> RayIndex {
        RayIndex { in_run: self.first + u64::from(in_stream), in_stream }
    }
}

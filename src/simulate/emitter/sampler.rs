//! The rays of one source in one replicate, in the order in which they start.

use super::packet::RayPacket;
use super::stream::{Portion, RayIndex, Stream};
use super::{Emission, Emitter, ListCursor, simd_dispatch};
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
    /// Where a list of rays was read last.
    cursor: ListCursor,
}

impl RaySampler {
    /// Makes a sampler of a portion of the emitter's rays, of which the first has the number `first` in the run.
    pub(crate) fn new(emitter: &Emitter, seed: u64, sampling: Sampling, portion: Portion, first: u64) -> Self {
        let stream = Stream::new(seed, sampling, portion, emitter.needed_pairs());
        let mut sampler = Self { stream, packet: None, first, cursor: ListCursor::default() };
        sampler.choose_packets(emitter);
        sampler
    }

    /// Turns to another portion of the same run, of an emitter that may be another one, in the memory that it has: replicates may have
    /// thousands of sources of a ray each.
    pub(crate) fn restart(&mut self, emitter: &Emitter, portion: Portion, first: u64) {
        self.stream.restart(portion, emitter.needed_pairs());
        (self.first, self.cursor) = (first, ListCursor::default());
        self.choose_packets(emitter);
    }

    /// Makes room for a packet where rays are to be made many at a time, and drops it where they are made singly.
    fn choose_packets(&mut self, emitter: &Emitter) {
        // Packets need the net's numbers, a plain source, and enough rays to pay for one.
        let packed = self.stream.sampling() == Sampling::Sobol
            && self.stream.needs_numbers()
            && !self.stream.is_short()
            && emitter.fits_packets();
        let packet = self.packet.take();
        self.packet = packed.then(|| packet.unwrap_or_else(RayPacket::boxed));
    }

    /// Writes the ray that starts after `started` others to `ray`, and returns its numbers and emission. To be called with 0, 1, 2, … in
    /// turn. By reference: a whole ray that is written in pieces and copied at once was waited for, 15 % of the kernel's time.
    #[inline(always)]
    pub(crate) fn next_ray(&mut self, emitter: &Emitter, started: u32, ray: &mut Ray) -> (RayIndex, Emission) {
        if self.stream.is_refill_due(started) && self.stream.is_short() {
            self.stream.fill_short();
        } else if self.stream.is_refill_due(started) {
            simd_dispatch::refill(emitter, &mut self.stream, self.packet.as_deref_mut(), started);
        }
        let index = self.index(self.stream.index_to_start(started));
        let Some(packet) = &self.packet else {
            let emission = emitter.emit(&self.stream, index, &mut self.cursor, ray);
            emitter.bring_near(ray);
            return (index, emission);
        };
        let (origin, direction) = packet.ray(started as usize);
        *ray = Ray::new(origin, direction);
        emitter.bring_near(ray);
        (index, Emission { from: None, wavelength: emitter.wavelength(&self.stream, index), failed: false })
    }

    /// Writes the ray with this index in its source and replicate to `ray`, without those before it, and returns its numbers and emission:
    /// the same bits as [`Self::next_ray`], which must not be called after it without a restart.
    pub(crate) fn single_ray(&mut self, emitter: &Emitter, index: u32, ray: &mut Ray) -> (RayIndex, Emission) {
        self.stream.prepare_single(index);
        let index = self.index(index);
        let emission = emitter.emit(&self.stream, index, &mut self.cursor, ray);
        emitter.bring_near(ray);
        (index, emission)
    }

    /// Writes a ray of the emitter's list, by its place there, to `ray`, and returns its emission; its number in the run is that place.
    pub(crate) fn listed_ray(&mut self, emitter: &Emitter, listed: u64, ray: &mut Ray) -> (RayIndex, Emission) {
        self.stream.prepare_single(0);
        let index = RayIndex { in_run: listed, in_stream: 0 };
        let emission = emitter.emit_listed(&self.stream, index, listed, &mut self.cursor, ray);
        emitter.bring_near(ray);
        (index, emission)
    }

    /// Returns both numbers of a ray, by that in its source and replicate.
    #[inline(always)]
    fn index(&self, in_stream: u32) -> RayIndex {
        RayIndex { in_run: self.first + u64::from(in_stream), in_stream }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::Scene;
    use std::path::Path;

    /// However few rays a source has in a replicate, each is the ray of its number, made by itself, and each starts once.
    #[test]
    fn few_rays_are_those_of_many() {
        let sources = ["kind = 'point'", "kind = 'collimated'\nradius = 4", "kind = 'lambertian'\nsize = [2, 3]"];
        for source in sources {
            let scene = Scene::parse(&format!("[[source]]\n{source}\n"), "test.toml", Path::new(".")).unwrap();
            let bound = scene.bind(&crate::model::Model::default()).unwrap();
            let emitter = &bound.emitters[0];
            let portion = |rays: u64| Portion { replicate: 3, source: 0, rays, lattice: [0, 1] };
            let sampler = |rays: u64| RaySampler::new(emitter, 7, Sampling::Sobol, portion(rays), 100);
            // One that has drawn others before draws the same.
            let mut queue = sampler(300);
            queue.next_ray(emitter, 0, &mut Ray::new(crate::math::Point::ZERO, crate::math::Vector::Z));
            for rays in [1, 5, 70, 8, 9] {
                let mut seen = vec![false; rays as usize];
                queue.restart(emitter, portion(rays), 100);
                for started in 0..rays as u32 {
                    let [mut ray, mut alone] = [Ray::new(crate::math::Point::ZERO, crate::math::Vector::Z); 2];
                    let (index, _) = queue.next_ray(emitter, started, &mut ray);
                    sampler(rays).single_ray(emitter, index.in_stream, &mut alone);
                    assert_eq!(ray, alone, "{source}: {started} of {rays}");
                    assert!(!std::mem::replace(&mut seen[index.in_stream as usize], true));
                }
                assert!(seen.iter().all(|s| *s));
            }
        }
    }
}

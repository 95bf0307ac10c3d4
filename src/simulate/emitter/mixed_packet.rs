//! Rays of many sources made together, for sources with so few rays in a replicate that packets of their own would be all but empty.
//!
//! The random numbers, azimuths included, are made for all rays at once, in loops over arrays that run in vectors; each ray then takes the
//! shape and the frame of its own source. They start along a Z-curve through their directions, for which the processor guesses right what
//! becomes of most of them. The bits are those of rays made one by one.

use super::shape::Shape;
use super::stream::{
    PACKET, PacketNumbers, Portion, RayIndex, midpoint_unit, sort_by_cell, sorted_dimension, z_order_cell,
};
use super::{Emission, Emitter};
use crate::math::Ray;
use crate::math::simd::{self, Instructions, Kernel};
use crate::optics::sampling::sin_cos_turns;
use crate::simulate::random::{self, Key, LOW_INDICES, Purpose};
use crate::simulate::scene::Sampling;

/// Rays of a source in a replicate up to which they are made among those of other sources: eight take as long as a packet of their own.
const FEW: u64 = 8;
const _: () = assert!(FEW <= LOW_INDICES as u64);

/// Cells along the Z-curve that rays are put in order by: eight by eight.
const CELLS: usize = 64;
/// Bits by which these are fewer than those of [`z_order_cell`].
const COARSER: u32 = 6;

/// A number of each ray of a packet.
type PacketWords = [u32; PACKET];

/// A ray that starts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MixedRay {
    pub(crate) source: usize,
    pub(crate) index: RayIndex,
    pub(crate) quanta: f64,
    pub(crate) emission: Emission,
}

/// Rays of many sources, of one replicate of a run.
#[derive(Clone, Debug)]
pub(crate) struct MixedPacket {
    seed: u64,
    /// How many rays it has, and how many of them have started.
    rays: usize,
    started: usize,
    /// Source of each ray, its number among the rays of its source and replicate, and in the run.
    sources: PacketWords,
    in_stream: PacketWords,
    in_run: [u64; PACKET],
    /// Its quanta.
    quanta: [f64; PACKET],
    /// Which pairs of numbers any of the sources asks for: for the place, the direction, the wavelength.
    pairs: [bool; 3],
    numbers: [[PacketNumbers; 2]; 3],
    /// Sines and cosines of the azimuths of places and directions.
    azimuths: [[PacketNumbers; 2]; 2],
    /// Its rays in the order in which they start.
    order: PacketWords,
}

impl MixedPacket {
    /// Makes a packet without rays for a run with this seed.
    pub(crate) fn boxed(seed: u64) -> Box<Self> {
        Box::new(Self {
            seed,
            rays: 0,
            started: 0,
            sources: [0; PACKET],
            in_stream: [0; PACKET],
            in_run: [0; PACKET],
            quanta: [0.0; PACKET],
            pairs: [false; 3],
            numbers: [[[0.0; PACKET]; 2]; 3],
            azimuths: [[[0.0; PACKET]; 2]; 2],
            order: [0; PACKET],
        })
    }

    /// Whether the rays of this portion belong into mixed packets: few of them, drawn from a net, from a point, disc or rectangle.
    pub(crate) fn takes(emitter: &Emitter, sampling: Sampling, rays: u64) -> bool {
        let simple_shape = matches!(emitter.shape, Shape::Point | Shape::Disc(_) | Shape::Rectangle(_));
        rays <= FEW && sampling == Sampling::Sobol && simple_shape
    }

    /// Takes a portion of which the first ray has the number `first` in the run and each these quanta, from its ray number `*next` in the
    /// run on, as far as there is room, and moves `next` past those that were taken. [`Self::takes`] must have said so.
    pub(crate) fn add(&mut self, emitter: &Emitter, portion: Portion, (first, quanta): (u64, f64), next: &mut u64) {
        for (any, own) in self.pairs.iter_mut().zip(emitter.needed_pairs()) {
            *any |= own;
        }
        let end = first + portion.rays;
        while self.rays < PACKET && *next < end {
            self.sources[self.rays] = portion.source;
            self.in_stream[self.rays] = (*next - first) as u32;
            self.in_run[self.rays] = *next;
            self.quanta[self.rays] = quanta;
            self.rays += 1;
            *next += 1;
        }
    }

    /// Whether all its rays have started, so that it can be filled anew.
    pub(crate) fn is_spent(&self) -> bool {
        self.started == self.rays
    }

    pub(crate) fn is_full(&self) -> bool {
        self.rays == PACKET
    }

    /// Drops its rays.
    pub(crate) fn clear(&mut self) {
        (self.rays, self.started, self.pairs) = (0, 0, [false; 3]);
    }

    /// Draws the numbers of the rays that were added; they are all of this replicate.
    #[inline(never)]
    pub(crate) fn draw(&mut self, replicate: u32) {
        simd::dispatch_widest(Draw { packet: self, replicate });
    }

    /// Writes the next ray that starts to `ray`, and returns the rest of it; `None` where all have started. Numbers must have been drawn;
    /// `emitters` are those of all sources.
    #[inline(always)]
    pub(crate) fn next_ray(&mut self, emitters: &[Emitter], ray: &mut Ray) -> Option<MixedRay> {
        if self.is_spent() {
            return None;
        }
        let k = self.order[self.started % PACKET] as usize % PACKET;
        self.started += 1;
        let source = self.sources[k] as usize;
        let emitter = &emitters[source];
        let pair = |pair: usize| [self.numbers[pair][0][k], self.numbers[pair][1][k]];
        let azimuth = |pair: usize| (self.azimuths[pair][0][k], self.azimuths[pair][1][k]);
        let f = &emitter.frame;
        let origin = emitter.start(|| pair(0), |_| azimuth(0));
        *ray = Ray::new(origin, emitter.direction([f.x, f.y, f.z], || pair(1), |_| azimuth(1)));
        emitter.bring_near(ray);
        let wavelength = emitter.wavelengths.as_ref().map(|wavelengths| wavelengths.sample(pair(2)[0]));
        let emission = Emission { from: None, wavelength, failed: false };
        let index = RayIndex { in_run: self.in_run[k], in_stream: self.in_stream[k] };
        Some(MixedRay { source, index, quanta: self.quanta[k], emission })
    }
}

/// Numbers to be drawn.
struct Draw<'a> {
    packet: &'a mut MixedPacket,
    replicate: u32,
}

impl Kernel for Draw<'_> {
    type Output = ();

    /// Loops, not closures, which would be compiled without the caller's instruction set.
    #[inline(always)]
    fn run<I: Instructions>(self) {
        let packet = self.packet;
        let ray = u64::from(self.replicate);
        // Place and direction take one block of random words for their four scrambles, the wavelength another.
        let blocks = [packet.pairs[0] || packet.pairs[1], packet.pairs[2]];
        let along = sorted_dimension(packet.pairs);
        let mut places = [[0; PACKET]; 2];
        for block in 0..2 {
            if !blocks[block] {
                continue;
            }
            let mut scrambles = [[0; PACKET]; 4];
            for k in 0..PACKET {
                let key =
                    Key { seed: packet.seed, ray, branch: packet.sources[k], bounce: block as u32, in_net: None };
                let words = key.words_in_loop(Purpose::Scramble);
                for d in 0..4 {
                    scrambles[d][k] = words[d];
                }
            }
            let dimensions = if block == 0 { 0..4 } else { 4..random::DIMENSIONS };
            for d in dimensions {
                let numbers = random::scrambled_low(&packet.in_stream, d, &scrambles[d % 4]);
                if along == Some(d & !1) {
                    places[d % 2] = numbers;
                }
                for k in 0..PACKET {
                    packet.numbers[d / 2][d % 2][k] = midpoint_unit(numbers[k]);
                }
            }
        }
        let mut cells = [0; PACKET];
        for k in 0..PACKET {
            cells[k] = z_order_cell(places[0][k], places[1][k]) >> COARSER;
        }
        sort_by_cell::<CELLS>(&cells[..packet.rays], &mut packet.order);
        for pair in 0..2 {
            if packet.pairs[pair] {
                for k in 0..PACKET {
                    let (sin, cos) = sin_cos_turns(packet.numbers[pair][1][k]);
                    (packet.azimuths[pair][0][k], packet.azimuths[pair][1][k]) = (sin, cos);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::RaySampler;
    use super::*;
    use crate::math::{Point, Vector};
    use crate::simulate::Scene;
    use std::path::Path;

    /// Sources of every kind that mixed packets take, with 0 to 8 rays each, more than one packet in all: each ray is the one that is made
    /// by itself, and each starts once.
    #[test]
    fn mixed_rays_are_those_of_their_sources() {
        let kinds = [
            "kind = 'point'",
            "kind = 'collimated'",
            "kind = 'collimated'\nradius = 4",
            "kind = 'lambertian'\nsize = [2, 3]\ndirection = [0.6, 0, 0.8]",
            "kind = 'cone'\nhalf_angle_deg = 20\nradius = 2\nat = [1, 2, 3]\nspectrum = { kind = 'd65' }",
            "kind = 'cosine'\nexponent = 7\nspectrum = { kind = 'd65' }",
        ];
        let text: String = (0..30).map(|k| format!("[[source]]\n{}\n", kinds[k % kinds.len()])).collect();
        let scene = Scene::parse(&text, "test.toml", Path::new(".")).unwrap();
        let bound = scene.bind(&crate::model::Model::default()).unwrap();
        let (seed, replicate, sampling) = (7, 5, Sampling::Sobol);
        let start = || Ray::new(Point::ZERO, Vector::Z);
        let mut packet = MixedPacket::boxed(seed);
        let (mut first, mut seen) = (1 << 40, 0);
        let mut check = |packet: &mut MixedPacket, firsts: &[u64]| {
            packet.draw(replicate);
            let mut ray = start();
            while let Some(started) = packet.next_ray(&bound.emitters, &mut ray) {
                let MixedRay { source, index, emission, .. } = started;
                let emitter = &bound.emitters[source];
                let portion = Portion { replicate, source: source as u32, rays: 8, lattice: [0, 1] };
                let mut alone = start();
                assert_eq!(u64::from(index.in_stream), index.in_run - firsts[source]);
                let (same, expected) = RaySampler::new(emitter, seed, sampling, portion, firsts[source])
                    .single_ray(emitter, index.in_stream, &mut alone);
                assert_eq!((ray, index.in_run, emission.wavelength), (alone, same.in_run, expected.wavelength));
                assert!(emission.wavelength.is_some() && started.quanta == (source + 1) as f64);
                seen += 1;
            }
            packet.clear();
        };
        let mut firsts = Vec::new();
        for (source, emitter) in bound.emitters.iter().enumerate() {
            let rays = source as u64 % 9;
            assert!(MixedPacket::takes(emitter, sampling, rays) && !MixedPacket::takes(emitter, sampling, 9));
            firsts.push(first);
            let portion = Portion { replicate, source: source as u32, rays, lattice: [0, 1] };
            let mut next = first;
            while next < first + rays {
                packet.add(emitter, portion, (first, (source + 1) as f64), &mut next);
                if packet.is_full() {
                    check(&mut packet, &firsts);
                }
            }
            first += rays;
        }
        check(&mut packet, &firsts);
        assert_eq!(seen, first - (1 << 40));
    }
}

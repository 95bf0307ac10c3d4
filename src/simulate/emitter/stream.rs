use crate::simulate::random::{self, Key, Purpose};
use crate::simulate::scene::Sampling;

/// Where the numbers of one source in one replicate come from.
#[derive(Clone, Debug)]
pub(crate) struct Stream {
    seed: u64,
    sampling: Sampling,
    /// Scrambles of the dimensions of the net.
    scrambles: [u32; random::DIMENSIONS],
    replicate: u32,
    replicates: u32,
    /// Rays of this source in this replicate.
    rays: u32,
    /// Which numbers of the net are at hand: those of the block that holds the last ticket, of pairs that the source asks for.
    block: Option<u32>,
    pairs: [bool; 3],
    numbers: Box<[[f64; random::BLOCK]; random::DIMENSIONS]>,
}

/// A ray of a source: its number in the run, and in its source and replicate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ticket {
    pub(crate) ray: u64,
    pub(crate) index: u32,
}

impl Stream {
    pub(crate) fn new(
        seed: u64,
        sampling: Sampling,
        [replicate, replicates]: [u32; 2],
        source: u32,
        rays: u64,
        pairs: [bool; 3],
    ) -> Self {
        let key = Key { seed, ray: u64::from(replicate), branch: source, bounce: 0 };
        let (a, b) = (key.words(Purpose::Scramble), Key { bounce: 1, ..key }.words(Purpose::Scramble));
        let scrambles = [a[0], a[1], a[2], a[3], b[0], b[1]];
        let rays = rays.min(u64::from(u32::MAX)) as u32;
        let numbers = Box::new([[0.0; random::BLOCK]; random::DIMENSIONS]);
        Self { seed, sampling, scrambles, replicate, replicates, rays, block: None, pairs, numbers }
    }

    /// Makes the numbers of a ticket, with those of the tickets around it.
    #[inline]
    pub(crate) fn prepare(&mut self, ticket: Ticket) {
        let block = ticket.index / random::BLOCK as u32;
        if self.sampling == Sampling::Sobol && self.block != Some(block) {
            for d in (0..random::DIMENSIONS).filter(|d| self.pairs[d / 2]) {
                let first = block * random::BLOCK as u32;
                random::scrambled_block(first, d, self.scrambles[d], &mut self.numbers[d]);
            }
            self.block = Some(block);
        }
    }

    /// Two numbers in `[0, 1)` of the prepared ticket: pair 0 for the place, 1 for the direction, 2 for the wavelength.
    #[inline]
    pub(crate) fn pair(&self, ticket: Ticket, pair: u32) -> [f64; 2] {
        match self.sampling {
            Sampling::Random => self.random(ticket, pair),
            Sampling::Sobol => {
                let (d, k) = (2 * pair as usize, ticket.index as usize % random::BLOCK);
                [self.numbers[d][k], self.numbers[d + 1][k]]
            }
        }
    }

    /// Further pairs of independent numbers, from 3.
    pub(crate) fn random(&self, ticket: Ticket, pair: u32) -> [f64; 2] {
        Key { seed: self.seed, ray: ticket.ray, branch: 0, bounce: pair }.pair(Purpose::Source)
    }

    /// A number in `[0, 1)` that runs evenly through all rays of the source, each replicate taking every `replicates`-th step.
    pub(crate) fn systematic(&self, ticket: Ticket) -> f64 {
        let jitter = self.random(ticket, 3)[0];
        let step = f64::from(ticket.index) + (f64::from(self.replicate) + jitter) / f64::from(self.replicates);
        (step / f64::from(self.rays.max(1))).min(1.0 - f64::EPSILON)
    }
}

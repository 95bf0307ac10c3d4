//! The random numbers of one source in one replicate, and the order in which its rays start.

use crate::simulate::random::{self, Key, Purpose};
use crate::simulate::scene::Sampling;

/// Rays made at a time.
pub(super) const PACKET: usize = 64;

/// A number of each ray of a packet.
pub(super) type PacketNumbers = [f64; PACKET];

/// Bits of a cell along each side of the square in which rays are put in order.
const CELL_BITS: u32 = 6;
/// Rays in a chunk: one for each cell.
const CHUNK: usize = 1 << (2 * CELL_BITS);

/// Rays of a source in a replicate up to which each is made by itself: eight take as long as a packet of 64.
const SHORT: u32 = 8;

/// Spreads the lowest 8 bits of a number, with a zero bit after each.
#[inline(always)]
fn interleaved(x: u32) -> u32 {
    let x = (x | x << 4) & 0x0f0f;
    let x = (x | x << 2) & 0x3333;
    (x | x << 1) & 0x5555
}

/// Returns the cell of a pair of 32-bit numbers along a Z-curve through the square, of 64 × 64 cells.
#[inline(always)]
pub(super) fn z_order_cell(x: u32, y: u32) -> u16 {
    (interleaved(x >> (32 - CELL_BITS)) | interleaved(y >> (32 - CELL_BITS)) << 1) as u16
}

/// Writes the places of these cells, each below `CELLS`, in the order of the cells to `order`, which is as long; places of one cell keep
/// their order, so that the result is the same everywhere.
#[inline(always)]
pub(super) fn sort_by_cell<const CELLS: usize>(cells: &[u16], order: &mut [u32]) {
    // Counting sort: most cells hold one ray.
    let mut ends = [0u16; CELLS];
    for cell in cells {
        ends[usize::from(*cell) % CELLS] += 1;
    }
    let mut sum = 0;
    for end in &mut ends {
        sum += *end;
        *end = sum;
    }
    // From the back, which keeps the order within a cell.
    for (k, cell) in cells.iter().enumerate().rev() {
        let end = &mut ends[usize::from(*cell) % CELLS];
        *end -= 1;
        order[usize::from(*end)] = k as u32;
    }
}

/// Returns the first of the two dimensions by which rays of a source that asks for these pairs are put in order: of the direction, or of
/// the place where no direction is drawn; `None` where neither is, as of a list, whose rays keep their order.
#[inline(always)]
pub(super) fn sorted_dimension([place, direction, _]: [bool; 3]) -> Option<usize> {
    // The direction decides most of what a ray meets; where all have one, the place does.
    if direction { Some(2) } else { place.then_some(0) }
}

/// Width of the steps that a 32-bit number counts, 2⁻³².
const STEP: f64 = 1.0 / 4_294_967_296.0;

/// Returns the middle of a step of the unit interval: never 0 and never 1, so that inversions have no end to fall off.
#[inline(always)]
pub(super) fn midpoint_unit(number: u32) -> f64 {
    (f64::from(number) + 0.5) * STEP
}

/// Where the numbers of one source in one replicate come from.
#[derive(Clone, Debug)]
pub(crate) struct Stream {
    seed: u64,
    sampling: Sampling,
    /// Scrambles of the dimensions of the net.
    scrambles: [u32; random::DIMENSIONS],
    /// Which of how many interleaved lattices of places in a ray list it takes.
    lattice: [u32; 2],
    /// Rays of this source in this replicate; at most 2³² − 1 are counted.
    rays: u32,
    /// The rays of a chunk in the order in which they start, and the numbers of the net for each, of the pairs that the source asks
    /// for.
    order: Vec<u32>,
    pairs: [bool; 3],
    numbers: [Vec<u32>; random::DIMENSIONS],
    /// The ray of the first number, modulo those of a chunk.
    first_number: u32,
}

/// The rays of one source in one replicate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portion {
    pub(crate) replicate: u32,
    pub(crate) source: u32,
    /// How many there are.
    pub(crate) rays: u64,
    /// Which of how many interleaved lattices of places in a ray list they take: `[k, n]` for the k-th of n.
    pub(crate) lattice: [u32; 2],
}

/// A ray of a source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayIndex {
    /// Number in the run.
    pub(crate) in_run: u64,
    /// Number among the rays of its source in its replicate.
    pub(crate) in_stream: u32,
}

impl RayIndex {
    /// That of the first ray of a run.
    pub(crate) const FIRST: Self = Self { in_run: 0, in_stream: 0 };
}

impl Stream {
    /// Makes the stream of a portion; of the pairs for the place, the direction and the wavelength those alone that are `true` are drawn
    /// from the net. It has no numbers before [`Self::refill`], [`Self::fill_short`] or [`Self::prepare_single`].
    pub(super) fn new(seed: u64, sampling: Sampling, portion: Portion, pairs: [bool; 3]) -> Self {
        let mut stream = Self {
            seed,
            sampling,
            scrambles: [0; random::DIMENSIONS],
            lattice: [0, 1],
            rays: 0,
            order: Vec::new(),
            pairs,
            numbers: Default::default(),
            first_number: 0,
        };
        stream.restart(portion, pairs);
        stream
    }

    /// Turns to another portion of the same run, in the memory that it has.
    pub(super) fn restart(&mut self, portion: Portion, pairs: [bool; 3]) {
        let Portion { replicate, source, rays, lattice } = portion;
        let key = Key { seed: self.seed, ray: u64::from(replicate), branch: source, bounce: 0, in_net: None };
        // Where a source has one ray in a replicate, its scrambles cost more than the ray: those that no pair needs are left out.
        let [place_or_direction, wavelength] = [pairs[0] || pairs[1], pairs[2]];
        if place_or_direction {
            self.scrambles[..4].copy_from_slice(&key.words(Purpose::Scramble));
        }
        if wavelength {
            self.scrambles[4..].copy_from_slice(&Key { bounce: 1, ..key }.words(Purpose::Scramble)[..2]);
        }
        self.rays = rays.min(u64::from(u32::MAX)) as u32;
        (self.lattice, self.pairs, self.first_number) = (lattice, pairs, 0);
    }

    /// Whether so few rays are drawn that making them singly costs less than a packet.
    pub(super) fn is_short(&self) -> bool {
        self.rays <= SHORT
    }

    pub(super) fn sampling(&self) -> Sampling {
        self.sampling
    }

    /// Whether any number of the net is asked for.
    #[inline(always)]
    pub(super) fn needs_numbers(&self) -> bool {
        self.pairs != [false; 3]
    }

    /// Whether rays start in chunks and out of turn.
    #[inline(always)]
    fn is_chunked(&self) -> bool {
        self.sampling == Sampling::Sobol && self.needs_numbers()
    }

    /// Whether [`Self::refill`] is due before the ray that starts after `started` others.
    #[inline(always)]
    pub(super) fn is_refill_due(&self, started: u32) -> bool {
        self.is_chunked() && (started as usize).is_multiple_of(PACKET)
    }

    /// Returns the index of the ray to start after `started` others of this source and replicate; `refill` must have been called for its
    /// chunk.
    ///
    /// Rays of a net start in chunks, each along a Z-curve through their directions, or places if all have one direction: rays that follow
    /// each other meet the same nodes and facets.
    #[inline(always)]
    pub(super) fn index_to_start(&self, started: u32) -> u32 {
        if !self.is_chunked() {
            return started;
        }
        let k = started as usize % CHUNK;
        started - k as u32 + self.order[k]
    }

    /// Makes the numbers of the chunk that begins with the `started`-th ray; does nothing within a chunk.
    #[inline(always)]
    pub(super) fn refill(&mut self, started: u32) {
        if (started as usize).is_multiple_of(CHUNK) {
            self.fill_chunk(started);
        }
    }

    /// Makes the numbers of the ray with this index alone, the same as in its chunk; those of its chunk are lost.
    pub(super) fn prepare_single(&mut self, index: u32) {
        // The same number as in a chunk, made for this index alone.
        if self.sampling == Sampling::Sobol {
            for d in (0..random::DIMENSIONS).filter(|d| self.pairs[d / 2]) {
                self.numbers[d] = vec![random::scrambled(index, d, self.scrambles[d])];
            }
        }
        self.first_number = index;
    }

    /// Makes the numbers of the chunk from ray `first` on and the order in which its rays start. Loops, not closures, which would be
    /// compiled without the caller's instruction set.
    #[inline(always)]
    fn fill_chunk(&mut self, first: u32) {
        // What a source with few rays does not ask for is not made.
        let n = CHUNK.min((self.rays - first) as usize);
        for d in 0..random::DIMENSIONS {
            if !self.pairs[d / 2] {
                continue;
            }
            self.numbers[d].resize(n.next_multiple_of(random::BLOCK), 0);
            for (block, numbers) in self.numbers[d].chunks_mut(random::BLOCK).enumerate() {
                random::scrambled_block(first + (block * random::BLOCK) as u32, d, self.scrambles[d], numbers);
            }
        }
        let mut cells = [0u16; CHUNK];
        if let Some(along) = sorted_dimension(self.pairs) {
            for ((cell, x), y) in cells.iter_mut().zip(&self.numbers[along]).zip(&self.numbers[along + 1]) {
                // Morton order of the directions (or places): rays that start one after another go through the same part of the scene,
                // whose nodes are still in the cache.
                *cell = z_order_cell(*x, *y);
            }
        }
        self.order.resize(n, 0);
        sort_by_cell::<CHUNK>(&cells[..n], &mut self.order);
    }

    /// Makes the numbers of all rays of a [short](Self::is_short) stream, and the order in which they start.
    pub(super) fn fill_short(&mut self) {
        for d in 0..random::DIMENSIONS {
            if self.pairs[d / 2] {
                self.numbers[d].clear();
                self.numbers[d].extend((0..self.rays).map(|k| random::scrambled(k, d, self.scrambles[d])));
            }
        }
        self.order.clear();
        self.order.extend(0..self.rays);
        // Stable, as the counting sort of a chunk is.
        if let Some(along) = sorted_dimension(self.pairs).filter(|_| self.rays > 1) {
            let [x, y] = [&self.numbers[along], &self.numbers[along + 1]];
            self.order.sort_by_key(|&k| z_order_cell(x[k as usize], y[k as usize]));
        }
    }

    /// Returns the numbers of a pair for the packet of rays that start from the `started`-th on; of no meaning beyond the last ray, and 0
    /// for a pair that the source does not ask for.
    #[inline(always)]
    pub(super) fn pairs_from(&self, started: u32, pair: usize) -> [PacketNumbers; 2] {
        let mut pairs = [[0.0; PACKET]; 2];
        if self.pairs[pair] {
            let order = &self.order[started as usize % CHUNK..];
            for (numbers, from) in pairs.iter_mut().zip(&self.numbers[2 * pair..]) {
                let mut raw = [0u32; PACKET];
                for (x, k) in raw.iter_mut().zip(order) {
                    *x = from[*k as usize];
                }
                for (x, n) in numbers.iter_mut().zip(raw) {
                    *x = midpoint_unit(n);
                }
            }
        }
        pairs
    }

    /// Returns two uniform numbers of a ray that `refill` or `prepare_single` has made ready, neither of them 1: pair 0 for the place, 1
    /// for the direction, 2 for the wavelength.
    #[inline]
    pub(crate) fn pair(&self, index: RayIndex, pair: u32) -> [f64; 2] {
        match self.sampling {
            Sampling::Random => self.random(index, pair),
            Sampling::Sobol => {
                let k = (index.in_stream - self.first_number) as usize % CHUNK;
                let number = |d: usize| midpoint_unit(self.numbers[d][k]);
                [number(2 * pair as usize), number(2 * pair as usize + 1)]
            }
        }
    }

    /// Returns two numbers independent of the net, keyed by the ray's number in the run; pairs 0 to 2 are [`Self::pair`]'s, further ones
    /// free.
    pub(crate) fn random(&self, index: RayIndex, pair: u32) -> [f64; 2] {
        Key { seed: self.seed, ray: index.in_run, branch: 0, bounce: pair, in_net: None }.pair(Purpose::Source)
    }

    /// Returns a number in `[0, 1)` that runs evenly through all rays of the source, with jitter; each replicate takes a lattice of its
    /// own.
    pub(crate) fn systematic(&self, index: RayIndex) -> f64 {
        let jitter = self.random(index, 3)[0];
        let [lattice, lattices] = self.lattice.map(f64::from);
        let step = f64::from(index.in_stream) + (lattice + jitter) / lattices;
        (step / f64::from(self.rays.max(1))).min(1.0 - f64::EPSILON)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays of a list have a wavelength to draw and nothing to be ordered by, whatever source the numbers before were of.
    #[test]
    fn rays_without_place_or_direction_keep_their_order() {
        let portion = Portion { replicate: 0, source: 0, rays: 200, lattice: [0, 1] };
        let mut stream = Stream::new(7, Sampling::Sobol, portion, [true, true, false]);
        stream.refill(0);
        let order = |stream: &Stream| (0..200).map(|k| stream.index_to_start(k)).collect::<Vec<u32>>();
        assert!(!order(&stream).is_sorted());
        stream.restart(Portion { source: 1, ..portion }, [false, false, true]);
        stream.refill(0);
        assert!(order(&stream).is_sorted());
    }
}

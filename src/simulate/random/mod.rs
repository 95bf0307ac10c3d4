//! Random numbers by key, not by turn: any number of any ray can be had at any time on any thread.
//!
//! A number is a function of (seed, ray, branch, bounce, purpose) alone. So a result does not depend on threads, batches or
//! shards, and a kernel that skips an effect draws the same numbers for all other effects as one that does not.
//! Philox 4×32-10 (Salmon et al., SC 2011) for everything behind the source, there in Latin hypercubes of [`STRATA`] rays
//! (McKay, Beckman, Conover, Technometrics 21, 1979) unless asked otherwise; at the source a Sobol net with Owen scrambling, or Philox as
//! well.
//!
//! Known weakness: a Sobol index has 32 bits, so a replicate may hold at most 2³² rays of one source.

mod philox;
mod sobol;
mod strata;

pub use philox::philox4x32;
pub use sobol::{BLOCK, DIMENSIONS, scrambled, scrambled_block};
pub(crate) use sobol::{LOW_INDICES, scrambled_low};
pub use strata::STRATA;

/// What a random number is for; part of its key, so that adding an effect shifts no other number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u16)]
#[non_exhaustive]
pub enum Purpose {
    /// Place and direction at the source.
    Source = 0,
    /// Reflect or transmit at an interface.
    Interface = 1,
    /// Direction of surface scatter.
    Scatter = 2,
    /// Distance to the next bulk scatter.
    Bulk = 3,
    /// Specular or scattered at a surface.
    Lobe = 5,
    /// Scrambles of the Sobol net.
    Scramble = 7,
    /// Direction after bulk scatter.
    BulkDirection = 8,
}

/// Hits of a path whose numbers are stratified: of the rays of a block few go the same way for longer.
const STRATIFIED_HITS: u32 = 8;

/// The key of one vertex of one path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// Seed of the run.
    pub seed: u64,
    /// Index of the ray, below 2⁴⁸.
    pub ray: u64,
    /// Which of the paths that split off this ray; 0 without splitting.
    pub branch: u32,
    /// Number of hits before this one.
    pub bounce: u32,
    /// Whether, of [`STRATA`] rays from a multiple of that on, one has its number in each stratum of the unit interval, or square, at the
    /// first surfaces that they meet; else numbers of different rays are independent.
    pub stratified: bool,
}

impl Key {
    /// Returns two uniform numbers in `[0, 1)`, 53 bits each; the same for the same key and purpose.
    #[inline]
    pub fn pair(&self, purpose: Purpose) -> [f64; 2] {
        let [a, b, c, d] = self.words(purpose);
        let [mut x, mut y] = [joined(a, b), joined(c, d)];
        if self.is_stratified(purpose) {
            [x, y] = strata::within_square(self.stratum(purpose), [x, y]);
        }
        [unit(x), unit(y)]
    }

    /// Returns one uniform number in `[0, 1)`, 53 bits; the same for the same key and purpose.
    #[inline]
    pub fn unit(&self, purpose: Purpose) -> f64 {
        let [a, b, ..] = self.words(purpose);
        let x = joined(a, b);
        unit(if self.is_stratified(purpose) { strata::within_interval(self.stratum(purpose), x) } else { x })
    }

    #[inline]
    fn is_stratified(&self, purpose: Purpose) -> bool {
        // In a body light scatters at distances of its own: there strata gain nothing.
        let at_surface = matches!(purpose, Purpose::Interface | Purpose::Scatter | Purpose::Lobe);
        self.stratified && at_surface && self.bounce < STRATIFIED_HITS
    }

    /// Returns which stratum the ray has among those of its block.
    #[inline]
    fn stratum(&self, purpose: Purpose) -> u8 {
        let vertex = (self.ray / STRATA) << 8 | u64::from(self.bounce % STRATIFIED_HITS) << 4 | purpose as u64;
        strata::permuted(self.ray as u8, strata::order([self.seed, vertex, u64::from(self.branch)]))
    }

    /// Returns 128 random bits, a function of key and purpose alone, independent of those of other rays.
    #[inline]
    pub fn words(&self, purpose: Purpose) -> [u32; 4] {
        let (counter, key) = self.philox_input(purpose);
        philox4x32(counter, key)
    }

    /// Returns [`Key::words`], compiled with the caller's instruction set: for loops that run in vectors.
    #[inline(always)]
    pub(crate) fn words_in_loop(&self, purpose: Purpose) -> [u32; 4] {
        let (counter, key) = self.philox_input(purpose);
        philox::ten_rounds(counter, key)
    }

    /// Returns counter and key of the generator.
    #[inline(always)]
    fn philox_input(&self, purpose: Purpose) -> ([u32; 4], [u32; 2]) {
        // 48 bits of the ray and 16 of the purpose share two words of the counter.
        let high = (self.ray >> 32) as u32 & 0xffff | (purpose as u32) << 16;
        ([self.ray as u32, high, self.bounce, self.branch], [self.seed as u32, (self.seed >> 32) as u32])
    }
}

/// Returns two words as one.
#[inline]
fn joined(high: u32, low: u32) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

/// Returns a number in `[0, 1)` from the first 53 of these 64 bits.
#[inline]
fn unit(bits: u64) -> f64 {
    // 53 bits: all that an `f64` below 1 has.
    (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// Returns the number, never 0, of the path that splits off path `branch` at its hit `bounce`: a hash, the same on every run.
pub(crate) fn split_branch(branch: u32, bounce: u32) -> u32 {
    let mixed = (branch ^ bounce.wrapping_mul(0x9e37_79b9)).wrapping_add(0x7f4a_7c15).wrapping_mul(0x85eb_ca6b);
    (mixed ^ mixed >> 15).max(1)
}

/// The inverse of the factor of [`split_branch`], modulo 2³².
const SPLIT_INVERSE: u32 = 0xa5cb_9243;

/// Returns the numbers of the paths that path `branch` may have split off at their hit `bounce`: one, as [`split_branch`] is a permutation,
/// and for branch 1 that of 0 too.
pub(crate) fn split_parents(branch: u32, bounce: u32) -> impl Iterator<Item = u32> {
    let zero = (branch == 1).then_some(0);
    std::iter::once(branch).chain(zero).map(move |hashed| {
        let mixed = hashed ^ hashed >> 15 ^ hashed >> 30;
        mixed.wrapping_mul(SPLIT_INVERSE).wrapping_sub(0x7f4a_7c15) ^ bounce.wrapping_mul(0x9e37_79b9)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_split_path_knows_its_parent() {
        for bounce in [0, 1, 7, 1000, u32::MAX] {
            for parent in [0, 1, 2, 0xdead_beef, u32::MAX] {
                let branch = split_branch(parent, bounce);
                assert!(split_parents(branch, bounce).any(|p| p == parent), "{parent} {bounce}");
            }
            // Of the two parents of branch 1, both have it as a child.
            let parents: Vec<u32> = split_parents(1, bounce).collect();
            assert_eq!(parents.len(), 2);
            assert!(parents.iter().all(|&p| split_branch(p, bounce) == 1), "{parents:?}");
        }
    }

    #[test]
    fn numbers_are_uniform_and_differ_by_every_part_of_the_key() {
        let key = Key { seed: 9, ray: 1 << 40, branch: 0, bounce: 3, stratified: false };
        let u = key.unit(Purpose::Interface);
        for other in [
            Key { seed: 10, ..key },
            Key { ray: key.ray + 1, ..key },
            Key { ray: key.ray & 0xffff, ..key },
            Key { branch: 1, ..key },
            Key { bounce: 4, ..key },
        ] {
            assert_ne!(u, other.unit(Purpose::Interface));
        }
        assert_ne!(u, key.unit(Purpose::Scatter));
        let n = 100_000;
        let (mut sum, mut sum2) = (0.0, 0.0);
        for ray in 0..n {
            let [a, b] = Key { ray, ..key }.pair(Purpose::Source);
            assert!((0.0..1.0).contains(&a) && (0.0..1.0).contains(&b));
            sum += a + b;
            sum2 += a * b;
        }
        // Means 1/2 and 1/4 with standard errors 6.5e-4 and 7e-4 (4 sigma).
        assert!((sum / (2 * n) as f64 - 0.5).abs() < 2.6e-3);
        assert!((sum2 / n as f64 - 0.25).abs() < 2.8e-3);
    }
    #[test]
    fn of_the_rays_of_a_block_each_has_its_stratum() {
        for (seed, block, bounce) in [(1, 0, 0), (9, 1 << 30, 3), (u64::MAX, 12_345, 1)] {
            let key = |ray: u64| Key { seed, ray: block * STRATA + ray, branch: 0, bounce, stratified: true };
            let mut intervals: Vec<u64> =
                (0..STRATA).map(|r| (key(r).unit(Purpose::Lobe) * STRATA as f64) as u64).collect();
            let cell = |[x, y]: [f64; 2]| (x * 8.0) as u64 * 8 + (y * 8.0) as u64;
            let mut squares: Vec<u64> = (0..STRATA).map(|r| cell(key(r).pair(Purpose::Scatter))).collect();
            for strata in [&mut intervals, &mut squares] {
                assert!(!strata.is_sorted());
                strata.sort_unstable();
                assert!(strata.iter().copied().eq(0..STRATA));
            }
        }
    }

    /// Sums over whole blocks hold next to no chance; over the blocks a ray's number is uniform and independent of its neighbour's and of
    /// the same ray's at the next hit.
    #[test]
    fn stratified_numbers_are_uniform_and_independent_over_blocks() {
        let n = 40_000;
        let at = |block, ray, bounce| {
            Key { seed: 5, ray: block * STRATA + ray, branch: 0, bounce, stratified: true }.unit(Purpose::Interface)
        };
        for ray in [0, 1, 32, 45, 63] {
            let mut sums = [0.0; 5];
            for block in 0..n {
                let [u, beside, later] =
                    [at(block, ray, 0), at(block, ray ^ 1, 0), at(block, ray, 1)].map(|u| u - 0.5);
                for (sum, x) in
                    sums.iter_mut().zip([u, u * u - 1.0 / 12.0, u * beside + 1.0 / (12.0 * 63.0), u * later, later])
                {
                    *sum += x;
                }
            }
            // Standard deviations of u, of its square and of products of two.
            let deviations =
                [12f64.sqrt().recip(), 180f64.sqrt().recip(), 1.0 / 12.0, 1.0 / 12.0, 12f64.sqrt().recip()];
            for (sum, deviation) in sums.into_iter().zip(deviations) {
                assert!(sum.abs() < 4.5 * deviation * (n as f64).sqrt(), "ray {ray}: {sum}");
            }
        }
    }
}

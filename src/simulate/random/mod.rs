//! Random numbers by key, not in sequence: any number of any ray can be drawn at any time on any thread.
//!
//! A number is a function of (seed, ray, branch, bounce, purpose) alone. So a result does not depend on threads, batches or
//! shards, and a kernel that skips an effect draws the same numbers for all other effects as one that does not.
//! Philox 4×32-10 (Salmon et al., SC 2011) for everything behind the source; at the source a Sobol net with Owen scrambling,
//! or Philox as well. Of numbers at the first surfaces that a ray meets the net gives the first eight binary digits: light that is
//! reflected at one of them is then as much as it should be in every part of what the source sends there.
//!
//! Known weakness: a Sobol index has 32 bits, so a replicate may hold at most 2³² rays of one source.

mod philox;
mod sobol;

pub use philox::philox4x32;
pub use sobol::{BLOCK, DIMENSIONS, scrambled, scrambled_block};
pub(crate) use sobol::{LOW_INDICES, scrambled_low};

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

impl Purpose {
    /// Returns the dimensions of the net that give the first digits of both its numbers at a hit, or of its only one; `None` where none
    /// does. In a body light scatters at distances of its own: there a net gains nothing.
    #[inline(always)]
    fn dimensions(self, bounce: u32) -> Option<[usize; 2]> {
        // Pairs that lie evenly in a few hundred points; the others do so beside those of the source, the more so the earlier their hit.
        let by_hit: &[[usize; 2]] = match self {
            Self::Interface => &[[9, 9], [14, 14], [7, 7], [15, 15]],
            Self::Lobe => &[[8, 8], [13, 13]],
            Self::Scatter => &[[6, 11], [10, 12]],
            _ => return None,
        };
        by_hit.get(bounce as usize).copied()
    }
}

/// Binary digits of a number behind the source that are the net's. With all of them a share of the light would be counted to the ray in
/// every replicate or all but one, whose spread says nothing of the error.
const NET_DIGITS: u32 = 8;

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
    /// Number of the ray in the net of its source and replicate; `None` where its numbers are to be independent of other rays'.
    pub in_net: Option<u32>,
}

impl Key {
    /// Returns two uniform numbers in `[0, 1)`, 53 bits each; the same for the same key and purpose.
    #[inline]
    pub fn pair(&self, purpose: Purpose) -> [f64; 2] {
        let [a, b, c, d] = self.words(purpose);
        [
            unit(self.with_digits_of_net(purpose, 0, joined(a, b))),
            unit(self.with_digits_of_net(purpose, 1, joined(c, d))),
        ]
    }

    /// Returns one uniform number in `[0, 1)`, 53 bits: the first of [`Key::pair`].
    #[inline]
    pub fn unit(&self, purpose: Purpose) -> f64 {
        let [a, b, ..] = self.words(purpose);
        unit(self.with_digits_of_net(purpose, 0, joined(a, b)))
    }

    /// Returns the bits of a number, the first or second of its pair, with the net's digits before them where it has any.
    #[inline]
    fn with_digits_of_net(&self, purpose: Purpose, second: usize, bits: u64) -> u64 {
        let Some((index, dimensions)) = self.in_net.zip(purpose.dimensions(self.bounce)) else { return bits };
        let dimension = dimensions[second];
        // Each source has a net of its own in each replicate: the first of its rays there identifies both.
        let net = self.ray.wrapping_sub(u64::from(index));
        let scramble = hash([self.seed, net, u64::from(self.branch) << 32 | dimension as u64]);
        let digits = scrambled(index, dimension, scramble) >> (32 - NET_DIGITS);
        u64::from(digits) << (64 - NET_DIGITS) | bits >> NET_DIGITS
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

/// Returns a hash of three numbers: each multiplied and shifted, as MurmurHash3 ends, with the factors of D. Stafford's mix 13.
#[inline]
fn hash(numbers: [u64; 3]) -> u32 {
    let mix = |x: u64| {
        let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    };
    (numbers.into_iter().fold(0, |sum: u64, x| mix(sum.wrapping_add(x).wrapping_add(0x9e37_79b9_7f4a_7c15))) >> 32)
        as u32
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
        let key = Key { seed: 9, ray: 1 << 40, branch: 0, bounce: 3, in_net: None };
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

    /// A key of the ray with this number in a net of many, at a surface.
    fn in_net(net: u64, index: u32, bounce: u32) -> Key {
        Key { seed: 5, ray: net + u64::from(index), branch: 0, bounce, in_net: Some(index) }
    }

    #[test]
    fn as_many_rays_of_a_net_have_their_number_in_each_stratum() {
        for (net, bounce) in [(0, 0), (1 << 40, 1)] {
            let mut counts = [[0; 256]; 4];
            for index in 0..1024 {
                let key = in_net(net, index, bounce);
                let [x, y] = key.pair(Purpose::Scatter);
                let numbers = [key.unit(Purpose::Interface), key.unit(Purpose::Lobe), x, y];
                for (counts, number) in counts.iter_mut().zip(numbers) {
                    counts[(number * 256.0) as usize] += 1;
                }
            }
            assert_eq!(counts, [[4; 256]; 4]);
        }
        // After the first hits, and in bodies, they are independent: some strata are empty.
        for (purpose, bounce) in [(Purpose::Interface, 4), (Purpose::Lobe, 2), (Purpose::Bulk, 0)] {
            let mut counts = [0; 256];
            (0..1024).for_each(|index| counts[(in_net(0, index, bounce).unit(purpose) * 256.0) as usize] += 1);
            assert!(counts.contains(&0), "{purpose:?}");
        }
    }

    /// Counts in 64 squares scatter by less than half of what those of independent numbers do, by the mean of chi-squared over its degrees
    /// of freedom: some pairs of dimensions are no better than these.
    #[test]
    fn pairs_lie_evenly_in_a_net_of_any_size() {
        for (bounce, rays) in [(0, 256), (0, 1024), (1, 256), (1, 1024)] {
            let expected = f64::from(rays) / 64.0;
            let chi = |net: u64| {
                let mut counts = [0.0; 64];
                for index in 0..rays {
                    let [x, y] = in_net(net << 20, index, bounce).pair(Purpose::Scatter);
                    counts[(x * 8.0) as usize * 8 + (y * 8.0) as usize] += 1.0;
                }
                counts.iter().map(|count| (count - expected).powi(2) / expected).sum::<f64>() / 63.0
            };
            let mean = (0..100).map(chi).sum::<f64>() / 100.0;
            assert!(mean < 0.5, "hit {bounce}, {rays} rays: {mean}");
        }
    }

    /// Over nets a ray's number is uniform, and independent of the same ray's at the next hit and of the one that another purpose has.
    #[test]
    fn numbers_of_a_net_are_uniform_and_independent_over_nets() {
        let n = 40_000;
        for index in [0, 1, 77, 1023] {
            let mut sums = [0.0; 4];
            for net in 0..n {
                let key = |bounce| in_net(net << 20, index, bounce);
                let [u, later] = [0, 1].map(|bounce| key(bounce).unit(Purpose::Interface) - 0.5);
                let place = key(0).pair(Purpose::Scatter)[0] - 0.5;
                for (sum, x) in sums.iter_mut().zip([u, u * u - 1.0 / 12.0, u * later, u * place]) {
                    *sum += x;
                }
            }
            // Standard deviations of u, of its square and of products of two.
            let deviations = [12f64.sqrt().recip(), 180f64.sqrt().recip(), 1.0 / 12.0, 1.0 / 12.0];
            for (sum, deviation) in sums.into_iter().zip(deviations) {
                assert!(sum.abs() < 4.5 * deviation * (n as f64).sqrt(), "ray {index}: {sum}");
            }
        }
    }
}

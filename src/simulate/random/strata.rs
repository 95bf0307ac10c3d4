//! Latin hypercubes of random numbers: of the rays of a block each has a stratum of its own.
//!
//! Where a share of the light is reflected, as many of a block's rays are as that share says, but for one stratum. Strata are wide enough
//! that many rays of a replicate share each: what is left to chance has a spread that replicates can measure.

/// Binary digits of the number of a stratum; half of them along each side of a square.
const DIGITS: u32 = 6;

/// Strata of the unit interval or square, and rays of a block: few enough that a replicate has most of its rays in whole blocks.
pub const STRATA: u64 = 1 << DIGITS;

/// Returns the random bits of an order of strata, a hash of three numbers: multiplied and shifted in turn, as MurmurHash3 ends, with the
/// factors of D. Stafford's mix 13.
#[inline]
pub(super) fn order([a, b, c]: [u64; 3]) -> u64 {
    let mut x = a.wrapping_add(b.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    x = (x ^ x >> 30 ^ c << 32 ^ c).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

/// Returns the place of an index in an order of [`STRATA`], given by random bits: the same bits give each index another place, and over all
/// bits each place is as likely.
#[inline]
pub(super) fn permuted(index: u8, bits: u64) -> u8 {
    const MASK: u8 = STRATA as u8 - 1;
    let mut x = index & MASK;
    // Each step has an inverse: a shift to the right, an odd factor and a summand. Five of them leave hardly a trace of how far apart two
    // indices are. Factors and summands of different steps share bits, but the last summand is its own.
    for (step, shift) in [3, 2, 4, 3, 2].into_iter().enumerate() {
        x ^= x >> shift;
        let [factor, summand] = ((bits >> (12 * step)) as u16).to_le_bytes();
        x = x.wrapping_mul(factor | 1).wrapping_add(summand) & MASK;
    }
    x
}

/// Returns the 64 bits after the point of a number in a stratum of the unit interval, from random ones.
#[inline]
pub(super) fn within_interval(stratum: u8, bits: u64) -> u64 {
    u64::from(stratum) << (64 - DIGITS) | bits >> DIGITS
}

/// Returns [`within_interval`] for both numbers of a pair, of whose square the strata are smaller squares, as many along either side.
#[inline]
pub(super) fn within_square(stratum: u8, bits: [u64; 2]) -> [u64; 2] {
    const SIDE: u32 = DIGITS / 2;
    let [row, column] = [stratum >> SIDE, stratum % (1 << SIDE)];
    let [x, y] = bits.map(|b| b >> SIDE);
    [u64::from(row) << (64 - SIDE) | x, u64::from(column) << (64 - SIDE) | y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_permutations_in_which_pairs_lie_as_if_drawn() {
        // How often two indices come to lie so far apart, over orders: all 63 distances are as likely.
        for pair in [[0, 1], [0, 32], [3, 50], [31, 60]] {
            let mut counts = [0u32; STRATA as usize];
            let n = 63 * 1000;
            for k in 0..n {
                let bits = order([7, k, 0]);
                let [a, b] = pair.map(|index| permuted(index, bits));
                counts[usize::from(a.wrapping_sub(b)) % STRATA as usize] += 1;
                if k < 20 {
                    let mut seen = [false; STRATA as usize];
                    (0..STRATA as u8).for_each(|index| seen[usize::from(permuted(index, bits))] = true);
                    assert!(seen.iter().all(|&s| s));
                }
            }
            assert_eq!(counts[0], 0);
            // Chi-squared with 62 degrees of freedom: 62 ± 11, and some 25 for what the steps leave.
            let chi: f64 = counts[1..].iter().map(|&c| (f64::from(c) - 1000.0).powi(2) / 1000.0).sum();
            assert!(chi < 150.0, "{pair:?}: {chi}");
        }
    }
}

//! Random numbers and statistics shared by the module's tests.

/// The `i`-th of a fixed sequence of random numbers in `[0, 1)`: a Weyl counter through the finaliser of Steele et al. (SplitMix, OOPSLA
/// 2014).
fn number(i: u64) -> f64 {
    let mut z = i.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 * 2f64.powi(-53)
}

/// The first `n` of a fixed sequence of random numbers in `[0, 1)`.
pub(super) fn numbers(n: usize) -> impl Iterator<Item = f64> {
    (0..n as u64).map(number)
}

/// `n` pairs in `[0, 1)²`.
pub(super) fn pairs(n: usize) -> impl Iterator<Item = [f64; 2]> {
    (0..n as u64).map(|i| [number(2 * i), number(2 * i + 1)])
}

//! What the property tests of meshing share.

pub(crate) mod judge;
pub(crate) mod pieces;
pub(crate) mod rounds;
pub(crate) mod sheets;
pub(crate) mod shells;
pub(crate) mod trimmed;

use proptest::test_runner::{Config as ProptestConfig, RngSeed};

/// A clamped knot vector with uneven spans, inner knots of any multiplicity up to the degree.
pub(crate) fn knots(degree: usize, inner: &[(u8, u8)]) -> Vec<f64> {
    let mut t = vec![0.0; degree + 1];
    let mut at = 0.0;
    for &(step, times) in inner {
        at += 0.25 + step as f64 / 256.0;
        t.extend(std::iter::repeat_n(at, 1 + times as usize % degree));
    }
    t.extend(std::iter::repeat_n(at + 1.0, degree + 1));
    t
}

/// `few` random models, the same ones at each run; as many as `PROPTEST_CASES` asks for, others each time.
pub(crate) fn config(few: u32) -> ProptestConfig {
    let asked = std::env::var("PROPTEST_CASES").ok().and_then(|n| n.parse().ok());
    let rng_seed = if asked.is_some() { RngSeed::Random } else { RngSeed::Fixed(1) };
    ProptestConfig { cases: asked.unwrap_or(few), rng_seed, failure_persistence: None, ..ProptestConfig::default() }
}

/// The value that a strategy makes of a seed: a failure names a number instead of a thousand control points.
pub(crate) fn seeded<S: proptest::strategy::Strategy>(strategy: S, seed: u64) -> S::Value {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    let mut runner = TestRunner::new_with_rng(Config::default(), TestRng::from_seed(RngAlgorithm::ChaCha, &bytes));
    strategy.new_tree(&mut runner).expect("a strategy that rejects nothing").current()
}

/// Seeds to try: `SEED` alone where it is set.
pub(crate) fn seeds() -> impl proptest::strategy::Strategy<Value = u64> {
    use proptest::prelude::*;
    let one = std::env::var("SEED").ok().and_then(|s| s.parse().ok());
    any::<u32>().prop_map(move |s| one.unwrap_or(u64::from(s)))
}

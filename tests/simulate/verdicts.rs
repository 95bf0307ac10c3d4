//! Verdicts of noisy far fields, whose truth is known.

use lampyris::regulation::{Assumptions, IntensityMap, Regulation, Verdict, assess};

/// A normal number of mean 0 and variance 1, nearly, that belongs to a cell and a seed: twelve even ones less their mean.
fn noise(cell: usize, seed: u64) -> f64 {
    let mut state = seed ^ (cell as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let even = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    std::iter::repeat_with(even).skip(4).take(12).sum::<f64>() - 6.0
}

#[test]
fn the_luckiest_of_many_noisy_directions_fails_no_lamp() {
    // As bright everywhere: HV has all of the maximum, of which it needs 80 %.
    let mut regulation = Regulation::find("UN R112 B driving").unwrap();
    regulation.function.rows.retain(|r| r.kind == "relative");
    let edges = |half: i32| (-10 * half..=10 * half).map(|k| f64::from(k) / 10.0).collect::<Vec<_>>();
    let (h, v, light) = (edges(10), edges(6), 60_000.0);
    for seed in 0..60 {
        let cell = |k: usize| [light * (1.0 + 0.7 * noise(k, seed)), 0.7 * light, 0.0];
        let cells = (0..(h.len() - 1) * (v.len() - 1)).map(cell).collect();
        let map = IntensityMap::new(h.clone(), v.clone(), cells).unwrap();
        let rows = assess(&map, &regulation, &Assumptions::default()).unwrap().rows;
        assert!(!rows.is_empty() && rows.iter().all(|r| r.verdict != Some(Verdict::Fail)), "seed {seed}");
    }
}

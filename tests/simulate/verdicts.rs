//! Verdicts of noisy far fields, whose truth is known.

use crate::random::Random;
use lampyris::regulation::{Assumptions, IntensityMap, RaySample, Regulation, RowKind, Verdict, assess};

/// A normal number of mean 0 and variance 1, nearly, that belongs to a cell and a seed: twelve uniform ones less their mean.
fn noise(cell: usize, seed: u64) -> f64 {
    // Begun at the first number of a stream: numbers of streams begun beside each other have nothing in common.
    let mut random = Random(Random(seed << 32 | cell as u64).bits());
    (0..12).map(|_| random.unit()).sum::<f64>() - 6.0
}

/// Radius of the dim middle of a lamp, degrees: more than the opening of the sensor.
const DIM_DEG: f64 = 1.0;

#[test]
fn the_luckiest_of_many_noisy_directions_fails_no_lamp() {
    // HV needs 80 % of the maximum. Of light that is as bright everywhere it has all.
    let mut regulation = Regulation::find("UN R112 B driving").unwrap();
    regulation.function.rows.retain(|r| r.kind == RowKind::Relative);
    let edges = |half: i32| (-10 * half..=10 * half).map(|k| f64::from(k) / 10.0).collect::<Vec<_>>();
    let (h, v, light) = (edges(10), edges(6), 60_000.0);
    let mut failed = 0;
    for seed in 0..60 {
        let verdicts = |middle: f64| {
            let at = |edges: &[f64], i: usize| 0.5 * (edges[i] + edges[i + 1]);
            let columns = h.len() - 1;
            let cell = |k: usize| {
                let is_middle = at(&h, k % columns).hypot(at(&v, k / columns)) < DIM_DEG;
                let mean = if is_middle { middle * light } else { light };
                [mean * (1.0 + 0.7 * noise(k, seed)), 0.7 * mean, 0.0]
            };
            let cells = (0..columns * (v.len() - 1)).map(cell).collect();
            let map = IntensityMap::new(h.clone(), v.clone(), cells).unwrap();
            let rows = assess(&map, &regulation, &Assumptions::default()).unwrap().rows;
            rows.into_iter().map(|r| r.verdict.unwrap()).collect::<Vec<_>>()
        };
        let found = verdicts(1.0);
        assert!(!found.is_empty() && !found.contains(&Verdict::Fail), "seed {seed}");
        let dark = verdicts(0.01);
        assert_ne!(dark, [Verdict::Pass], "seed {seed}");
        failed += usize::from(dark == [Verdict::Fail]);
    }
    // The same noise hides no lamp that is dark in the middle, but for a few whose brightest direction is the least sure.
    assert!(failed > 54, "{failed} of 60");
}

/// A count of this mean (Knuth's product of uniform numbers).
fn count(random: &mut Random, mean: f64) -> u32 {
    let (mut n, mut product) = (0, random.unit());
    while product > (-mean).exp() {
        product *= random.unit();
        n += 1;
    }
    n
}

/// Largest intensity, cd, allowed at B50L, its place, and the opening of the sensor, degrees.
const LIMIT: f64 = 350.0;
const B50L: [f64; 2] = [-3.43, 0.57];
const OPENING: f64 = 0.149;

/// Cells a side of the maps of counted rays, one an opening.
const SIDE: usize = 15;

/// The table of one row: B50L, at most 350 cd.
fn one_point() -> Regulation {
    let mut regulation = Regulation::find("UN R112 B passing").unwrap();
    regulation.function.rows.retain(|r| r.id == "B50L");
    assert_eq!(regulation.function.rows[0].max, Some(LIMIT));
    regulation
}

/// The verdict about 350 cd at most, where rays of `classes` (mean number in an opening, candela of one) fell into every cell of a map
/// around, in `replicates`.
fn counted_verdict(regulation: &Regulation, random: &mut Random, classes: &[[f64; 2]], replicates: u32) -> Verdict {
    let (width, [h, v]) = (OPENING, B50L);
    let edges = |middle: f64| (0..=SIDE).map(|k| middle + width * (k as f64 - 0.5 * SIDE as f64)).collect();
    let mut cell = || {
        let mut parts = vec![0.0; replicates as usize];
        for [mean, ray] in classes {
            for _ in 0..count(random, *mean) {
                parts[(random.unit() * f64::from(replicates)) as usize] += ray;
            }
        }
        let value: f64 = parts.iter().sum();
        let n = f64::from(replicates);
        let deviations: f64 = parts.iter().map(|p| (p - value / n).powi(2)).sum();
        [value, (deviations * n / (n - 1.0)).sqrt(), 0.0]
    };
    let cells = (0..SIDE * SIDE).map(|_| cell()).collect();
    let heaviest = classes.iter().map(|c| c[1]).fold(0.0, f64::max);
    let map = IntensityMap::new(edges(h), edges(v), cells).unwrap();
    let rays =
        RaySample { heaviest_flux: heaviest * width.to_radians().powi(2) * v.to_radians().cos(), replicates };
    let assumptions = Assumptions { as_placed: true, rays: 1_000_000, ..Assumptions::default() };
    assess(&map.with_rays(rays), regulation, &assumptions).unwrap().rows[0].verdict.unwrap()
}

/// Lamps that are tried of each kind.
const TRIALS: usize = 800;
/// Share of wrong verdicts: beyond three standard errors from 128 replicates on one side.
const CONFIDENCE: f64 = 0.0016;

/// Lamps a little too bright for their limit, by few rays, by rays of two weights, by few replicates: seldom one passes. 3.6 rays are none
/// with 2.7 %, and ten light rays say nothing about heavy ones that seldom arrive.
#[test]
fn few_rays_pass_no_lamp_that_is_too_bright() {
    let (regulation, mut random) = (one_point(), Random(20_261_123));
    for (classes, replicates) in [
        (vec![[3.6, 100.0]], 128),
        (vec![[9.1, 40.0]], 128),
        (vec![[36.0, 10.0]], 128),
        (vec![[400.0, 0.9]], 128),
        (vec![[5.0, 10.0], [0.155, 2000.0]], 128),
        (vec![[20.0, 1.0], [1.7, 200.0]], 128),
        (vec![[100.0, 3.6]], 2),
        (vec![[100.0, 3.6]], 8),
    ] {
        let wrong = (0..TRIALS)
            .filter(|_| counted_verdict(&regulation, &mut random, &classes, replicates) == Verdict::Pass)
            .count();
        // The share allowed, and three errors of the number found.
        let expected = CONFIDENCE * TRIALS as f64;
        let most = expected + 3.0 * expected.sqrt();
        assert!(wrong as f64 <= most, "{classes:?} in {replicates}: {wrong} of {TRIALS} passed");
    }
}

/// A point that is dark, or lit by rays far below its limit, passes: 6.6 rays of 14 cd are no 350, and rays of 3 cd land where heavy ones
/// never do.
#[test]
fn dark_points_pass_where_rays_are_light() {
    let (regulation, mut random) = (one_point(), Random(7));
    for (classes, replicates) in
        [(vec![[0.01, 14.0]], 2000), (vec![[20.0, 3.0], [0.0, 130.0]], 128), (vec![[40.0, 4.0]], 128)]
    {
        let passed = (0..100)
            .filter(|_| counted_verdict(&regulation, &mut random, &classes, replicates) == Verdict::Pass)
            .count();
        assert!(passed >= 97, "{classes:?}: {passed} of 100");
    }
}

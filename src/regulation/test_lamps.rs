//! Far fields of lamps in closed form, for tests.

use super::map::IntensityMap;

/// The edges of cells from `-half` to `half`, degrees.
pub(super) fn edges(half: f64, cell: f64) -> Vec<f64> {
    let cells = (2.0 * half / cell).round() as usize;
    (0..=cells).map(|k| -half + 2.0 * half * k as f64 / cells as f64).collect()
}

/// A far field of ±10° by ±6° in cells of 0.1°, with relative errors.
pub(super) fn map(intensity: impl Fn(f64, f64) -> f64, statistical: f64, geometric: f64) -> IntensityMap {
    let (h, v) = (edges(10.0, 0.1), edges(6.0, 0.1));
    let middles = |e: &[f64]| e.windows(2).map(|e| 0.5 * (e[0] + e[1])).collect::<Vec<_>>();
    let columns = middles(&h);
    let cells = middles(&v).into_iter().flat_map(|v| columns.iter().map(|h| intensity(*h, v)).collect::<Vec<_>>());
    let cells = cells.map(|i| [i, statistical * i, geometric * i]).collect();
    IntensityMap::new(h, v, cells).unwrap()
}

/// The same in cells of any width with their means, by 36 places in each, and without errors.
pub(super) fn map_of_means(intensity: impl Fn(f64, f64) -> f64, cell: f64) -> IntensityMap {
    const PLACES: usize = 6;
    let (h, v) = (edges(10.0, cell), edges(6.0, cell));
    let places = |e: &[f64]| (0..PLACES).map(|k| e[0] + (e[1] - e[0]) * (k as f64 + 0.5) / PLACES as f64).collect();
    let places = |edges: &[f64]| edges.windows(2).map(places).collect::<Vec<Vec<f64>>>();
    let (columns, rows) = (places(&h), places(&v));
    let mean = |hs: &[f64], vs: &[f64]| {
        let sum: f64 = vs.iter().flat_map(|v| hs.iter().map(|h| intensity(*h, *v))).sum();
        sum / (PLACES * PLACES) as f64
    };
    let cells = rows.iter().flat_map(|vs| columns.iter().map(|hs| [mean(hs, vs), 0.0, 0.0]));
    IntensityMap::new(h.clone(), v.clone(), cells.collect()).unwrap()
}

/// Uniform numbers between 0 and 1, both left out, that follow from a seed.
pub(super) fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }
}

/// A number of the standard normal distribution, by Box and Muller.
pub(super) fn normal(uniform: &mut impl FnMut() -> f64) -> f64 {
    (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
}

/// A passing beam for right-hand traffic: a flat cut-off to the left, 15° up to the right of the elbow, brightest below it.
pub(super) fn passing(h0: f64, v0: f64) -> impl Fn(f64, f64) -> f64 {
    move |h, v| {
        let (h, v) = (h - h0, v - v0);
        let cut_off = if h < 0.0 { -0.57 } else { (-0.57 + h * 15f64.to_radians().tan()).min(1.2) };
        // A soft edge of about 0.1°.
        let edge = 1.0 / (1.0 + ((v - cut_off) / 0.05).exp());
        let hot = 30_000.0 * (-(h / 6.0).powi(2) - ((v + 1.0) / 0.9).powi(2)).exp();
        let wide = 4_500.0 * (-(h / 16.0).powi(2) - ((v + 1.5) / 2.5).powi(2)).exp();
        200.0 + edge * (hot + wide)
    }
}

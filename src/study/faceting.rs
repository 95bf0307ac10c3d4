//! What the tolerance did to each receiver of a run: some of its rays once more, on the facets and on the spline.
//!
//! Random numbers are keyed by ray and bounce, so both follow the same paths until the facets turn them away, and most of the noise
//! cancels in the differences. Errors of the differences come from replicate to replicate, of widths to first order.

use super::receivers::{ReplicateSums, trace_replicates};
use crate::intersect::Intersector;
use crate::simulate::{BoundScene, ReceiverResult, Results, RunSettings};
use serde::Serialize;

/// The same rays on facets and on the spline.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Faceting {
    /// Rays from the sources, traced on both.
    pub rays: u64,
    /// What they found on each receiver that light falls on at places or from directions.
    pub receivers: Vec<OnBoth>,
}

/// One receiver; of each pair the first is on facets, the second on the spline.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct OnBoth {
    /// Its name.
    pub name: String,
    /// Unit of the widths: `mm`, or `deg` of far fields and spheres.
    pub unit: &'static str,
    /// Power.
    pub power: [f64; 2],
    /// Standard error of the difference of the powers.
    pub power_error: f64,
    /// Root mean square distance from where the light falls on average, along the first and the second axis.
    pub width: [[f64; 2]; 2],
    /// Standard error of the difference of the widths, along both axes.
    pub width_error: [f64; 2],
}

impl OnBoth {
    /// How much wider the facets make the light, along the axis where that shows most, when it is beyond `share` and three standard
    /// errors.
    pub fn widened(&self, share: f64) -> Option<f64> {
        (0..2)
            .filter(|&a| self.width[a][1] > 0.0)
            .filter(|&a| (self.width[a][0] - self.width[a][1]).abs() > 3.0 * self.width_error[a])
            .map(|a| self.width[a][0] / self.width[a][1])
            .filter(|ratio| (ratio - 1.0).abs() > share)
            .max_by(|a, b| (a.ln().abs()).total_cmp(&b.ln().abs()))
    }

    /// How much the facets change the power, as a share, when it is beyond `share` and three standard errors.
    pub fn changed(&self, share: f64) -> Option<f64> {
        let [facets, spline] = self.power;
        let change = facets / spline - 1.0;
        let shows = (facets - spline).abs() > 3.0 * self.power_error && change.abs() > share;
        (spline > 0.0 && shows).then_some(change)
    }
}

/// Traces `settings.rays` rays on both.
pub fn faceting(bound: &BoundScene, [facets, spline]: [&dyn Intersector; 2], settings: &RunSettings) -> Faceting {
    let both = [facets, spline].map(|i| trace_replicates(bound, i, settings));
    let receivers = (0..both[0].0.receivers.len())
        .filter(|&k| both[0].0.receivers[k].kind != "absorbed")
        .map(|k| on_both(k, &both))
        .collect();
    Faceting { rays: both[0].0.rays, receivers }
}

/// Width of a receiver's light along an axis, and what each replicate adds to it, to first order; in half sides of the receiver.
fn width(k: usize, axis: usize, (_, parts): &(Results, Vec<Vec<ReplicateSums>>)) -> (f64, Vec<f64>) {
    let sum = |of: &dyn Fn(&ReplicateSums) -> f64| -> f64 { parts.iter().filter_map(|p| p.get(k)).map(of).sum() };
    let power = sum(&|p| p.power as f64).max(1.0);
    let (mean, square) = (sum(&|p| p.first[axis]) / power, sum(&|p| p.second[axis]) / power);
    let width = (square - mean * mean).max(0.0).sqrt();
    let influence = |p: &ReplicateSums| {
        let (w, first, second) = (p.power as f64, p.first[axis], p.second[axis]);
        let change = (second - square * w) - 2.0 * mean * (first - mean * w);
        if width > 0.0 { 0.5 * change / (power * width) } else { 0.0 }
    };
    (width, parts.iter().map(|p| p.get(k).map_or(0.0, influence)).collect())
}

fn on_both(k: usize, both: &[(Results, Vec<Vec<ReplicateSums>>); 2]) -> OnBoth {
    let [found, truth]: [&ReceiverResult; 2] = [&both[0].0.receivers[k], &both[1].0.receivers[k]];
    let quantum = both[1].0.quantum;
    let power = |i: usize| both[i].1.iter().map(move |p| p.get(k).map_or(0.0, |p| p.power as f64) * quantum);
    let widths = [0, 1].map(|axis| [0, 1].map(|i| width(k, axis, &both[i])));
    OnBoth {
        name: found.name.clone(),
        unit: if found.kind == "plane" { "mm" } else { "deg" },
        power: [found.power, truth.power],
        power_error: error(power(0).zip(power(1)).map(|(a, b)| a - b)),
        width: [0, 1].map(|a| [0, 1].map(|i| found.half[a] * widths[a][i].0)),
        width_error: [0, 1].map(|a| {
            let [facets, spline] = &widths[a];
            found.half[a] * error(facets.1.iter().zip(&spline.1).map(|(a, b)| a - b))
        }),
    }
}

/// Standard error of a sum over replicates.
fn error(parts: impl Iterator<Item = f64>) -> f64 {
    let parts: Vec<f64> = parts.collect();
    let n = parts.len().max(2) as f64;
    let mean = parts.iter().sum::<f64>() / n;
    (parts.iter().map(|d| (d - mean).powi(2)).sum::<f64>() * n / (n - 1.0)).sqrt()
}

//! The difference that facets make to power, position and width of a receiver's light, with its standard error.
//!
//! Ratios of sums are taken to first order: the standard error of a mean position is that of what each replicate adds to it.

use super::paired::Paired;
use super::replicates::{ReplicateSums, ReplicatedRun};
use crate::math::error_of_sum;

/// A figure of one run, and what each replicate adds to it to first order.
struct Influence {
    value: f64,
    by_replicate: Vec<f64>,
}

/// The sums of a receiver over all replicates of a run, along one axis.
#[derive(Clone, Copy)]
struct Means {
    /// Quanta; mean and mean square of the place, in half sides.
    power: f64,
    mean: f64,
    square: f64,
}

/// Iterates over what each traced replicate brought to a receiver, in their order.
fn replicate_sums(run: &ReplicatedRun, receiver: usize) -> impl Iterator<Item = &ReplicateSums> {
    run.replicates.iter().filter_map(move |r| r.get(receiver))
}

impl Means {
    /// Sums up what all replicates brought to a receiver; a dark one counts as one quantum at its centre.
    fn new(run: &ReplicatedRun, receiver: usize, axis: usize) -> Self {
        let power = replicate_sums(run, receiver).map(|s| s.power as f64).sum::<f64>().max(1.0);
        let mean = replicate_sums(run, receiver).map(|s| s.first[axis]).sum::<f64>() / power;
        let square = replicate_sums(run, receiver).map(|s| s.second[axis]).sum::<f64>() / power;
        Self { power, mean, square }
    }

    /// Returns the mean position, in half sides, and what each replicate adds to it.
    fn centroid(&self, run: &ReplicatedRun, receiver: usize, axis: usize) -> Influence {
        // The derivative of a quotient: what a replicate adds to the sum, less its share of the mean.
        let by_replicate = |s: &ReplicateSums| (s.first[axis] - self.mean * s.power as f64) / self.power;
        Influence { value: self.mean, by_replicate: replicate_sums(run, receiver).map(by_replicate).collect() }
    }

    /// Returns the root mean square distance, in half sides, from `about`: 0, the receiver's centre, or the mean position; and what each
    /// replicate adds to it.
    fn spread(&self, run: &ReplicatedRun, receiver: usize, axis: usize, about: f64) -> Influence {
        let value = (self.square - about * about).max(0.0).sqrt();
        let by_replicate = |s: &ReplicateSums| {
            let power = s.power as f64;
            // The derivative of `square − about²`; about the centre, which is fixed, the second part vanishes.
            let change = (s.second[axis] - self.square * power) - 2.0 * about * (s.first[axis] - about * power);
            if value > 0.0 { 0.5 * change / (self.power * value) } else { 0.0 }
        };
        Influence { value, by_replicate: replicate_sums(run, receiver).map(by_replicate).collect() }
    }
}

/// Returns both values with the error of their difference, from replicates of the same rays, all times `scale`; the error of a single
/// replicate is `scale` itself, as its own mean says nothing about its spread.
fn paired_figure(facets: &Influence, spline: &Influence, scale: f64) -> Paired {
    let difference = facets.by_replicate.iter().zip(&spline.by_replicate).map(|(a, b)| a - b);
    let difference: Vec<f64> = difference.collect();
    let error = if difference.len() == 1 { 1.0 } else { error_of_sum(&difference) };
    Paired { facets: scale * facets.value, spline: scale * spline.value, error: scale * error }
}

/// Compares the power of a receiver, in the unit of the sources, in both runs, facets first.
pub(super) fn power(runs: [&ReplicatedRun; 2], receiver: usize) -> Paired {
    let [facets, spline] = runs.map(|run| run.results.receivers[receiver].power);
    Paired {
        facets,
        spline,
        error: error_of_difference(runs, receiver, |sums| sums.power) * runs[1].results.quantum,
    }
}

/// Compares the total of a further channel of a receiver; `worth` is what a quantum of it counts.
pub(super) fn channel(runs: [&ReplicatedRun; 2], receiver: usize, channel: usize, worth: f64) -> Paired {
    let [facets, spline] = runs.map(|run| run.results.receivers[receiver].channels[channel].total);
    let error = error_of_difference(runs, receiver, |sums| sums.channels[channel]);
    Paired { facets, spline, error: error * runs[1].results.quantum * worth }
}

/// Returns the standard error, in quanta, of the difference of a sum between both runs, from replicate to replicate.
fn error_of_difference(runs: [&ReplicatedRun; 2], receiver: usize, quanta: impl Fn(&ReplicateSums) -> u128) -> f64 {
    let [facets, spline] = runs.map(|run| replicate_sums(run, receiver).map(|sums| quanta(sums) as f64));
    error_of_sum(&facets.zip(spline).map(|(a, b)| a - b).collect::<Vec<_>>())
}

/// Compares, along axis 0 or 1, the mean position, the root mean square distance from the receiver's centre, and that from the mean
/// position, in this order, in mm or degrees.
pub(super) fn moments(runs: [&ReplicatedRun; 2], receiver: usize, axis: usize) -> [Paired; 3] {
    let result = &runs[1].results.receivers[receiver];
    let (half, middle) = (result.half[axis], result.middle[axis]);
    let means = runs.map(|run| Means::new(run, receiver, axis));
    let [facets, spline] = [0, 1].map(|i| means[i].centroid(runs[i], receiver, axis));
    let centroid = paired_figure(&facets, &spline, half);
    let [facets, spline] = [0, 1].map(|i| means[i].spread(runs[i], receiver, axis, 0.0));
    let rms = paired_figure(&facets, &spline, half);
    let [facets, spline] = [0, 1].map(|i| means[i].spread(runs[i], receiver, axis, means[i].mean));
    let width = paired_figure(&facets, &spline, half);
    let shifted = Paired { facets: middle + centroid.facets, spline: middle + centroid.spline, ..centroid };
    [shifted, rms, width]
}

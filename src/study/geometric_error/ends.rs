//! What facets change of where the light ended.

use super::paired::Paired;
use super::replicates::ReplicatedRun;
use crate::math::variance_of_sum;
use serde::Serialize;

/// What facets change of the sums over all light, by how it ended. What was lost is no figure of the true surfaces, and is left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct EndErrors {
    /// Ended on receivers.
    pub received: Paired,
    /// Absorbed in faces and media.
    pub absorbed: Paired,
    /// Escaped out of the scene.
    pub escaped: Paired,
    /// Left on paths that a limit cut off.
    pub cut_off: Paired,
}

impl EndErrors {
    /// Iterates over all of them, to be changed.
    pub(super) fn each_mut(&mut self) -> [&mut Paired; 4] {
        [&mut self.received, &mut self.absorbed, &mut self.escaped, &mut self.cut_off]
    }
}

/// Compares the sums over all light of both runs.
pub(super) fn end_errors(runs: [&ReplicatedRun; 2]) -> EndErrors {
    let quantum = runs[1].results.quantum;
    let [facets, spline] = runs.map(|run| &run.ends);
    let mut errors = EndErrors::default();
    for (k, end) in errors.each_mut().into_iter().enumerate() {
        let (mut sums, mut squares) = ([0.0; 2], 0.0);
        for replicate in facets.iter().zip(spline) {
            let pair = [replicate.0[k] as f64, replicate.1[k] as f64];
            sums = [sums[0] + pair[0], sums[1] + pair[1]];
            squares += (pair[0] - pair[1]).powi(2);
        }
        let error = variance_of_sum(squares, sums[0] - sums[1], spline.len()).sqrt();
        *end = Paired { facets: sums[0] * quantum, spline: sums[1] * quantum, error: error * quantum };
    }
    errors
}

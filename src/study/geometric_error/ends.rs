//! Changes by facets of the powers by where the light ended.

use super::paired::{Paired, PairedSums};
use super::replicates::ReplicatedRun;
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
        let mut sums = PairedSums::default();
        facets.iter().zip(spline).for_each(|(facets, spline)| sums.add(facets[k], spline[k]));
        *end = sums.paired(spline.len(), quantum);
    }
    errors
}

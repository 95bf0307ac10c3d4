//! What facets change of where the light ended.

use super::cells::paired_cells;
use super::paired::Paired;
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
    let listed = |run: &ReplicatedRun| -> Vec<Vec<(u32, u64)>> {
        run.ends.iter().map(|ends| (0..).zip(ends.iter().copied()).collect()).collect()
    };
    let [facets, spline] = runs.map(listed);
    let pairs: Vec<_> = facets.iter().zip(&spline).map(|(a, b)| [a.as_slice(), b.as_slice()]).collect();
    let quantum = runs[1].results.quantum;
    let mut errors = EndErrors::default();
    for (end, cell) in errors.each_mut().into_iter().zip(paired_cells(4, &pairs)) {
        *end = Paired {
            facets: cell.facets * quantum,
            spline: cell.spline * quantum,
            error: cell.difference_variance.sqrt() * quantum,
        };
    }
    errors
}

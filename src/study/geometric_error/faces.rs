//! What facets change of the power that each face absorbs and lets through, from replicates of the same rays.

use super::paired::{Paired, PairedSums};
use super::replicates::{FaceQuanta, ReplicatedRun};
use rustc_hash::FxHashMap;

/// What facets change of the power at one face, in the unit of the sources.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaceError {
    /// The placed face.
    pub face: u32,
    /// Power that it absorbed.
    pub absorbed: Paired,
    /// Power that entered its body through it.
    pub entered: Paired,
    /// Power that left its body through it.
    pub left: Paired,
    /// Standard errors of these three on the spline, from these rays alone.
    pub statistical: [f64; 3],
}

impl FaceError {
    /// Returns the power that the face absorbed plus that which left its body through it, on the spline: faces are listed by it.
    pub fn listed_power(&self) -> f64 {
        self.absorbed.spline + self.left.spline
    }

    /// Returns the geometric errors of what is absorbed, enters and leaves; each contains `lost`, power that might have come to any face.
    pub fn geometric(&self, lost: f64) -> [f64; 3] {
        [self.absorbed, self.entered, self.left].map(|paired| paired.geometric().hypot(lost))
    }
}

/// Compares the power at each face that rays of either run met, the first on facets, by rising face.
pub(super) fn face_errors(runs: [&ReplicatedRun; 2]) -> Vec<FaceError> {
    // Sums, not what every replicate brought: of 10⁵ faces that would be gigabytes.
    let mut sums: FxHashMap<u32, [PairedSums; 3]> = FxHashMap::default();
    for (facets, spline) in runs[0].faces.iter().zip(&runs[1].faces) {
        let mut both: FxHashMap<u32, [FaceQuanta; 2]> = FxHashMap::default();
        facets.iter().for_each(|(face, quanta)| both.entry(*face).or_default()[0] = *quanta);
        spline.iter().for_each(|(face, quanta)| both.entry(*face).or_default()[1] = *quanta);
        for (face, [facets, spline]) in both {
            let sums = sums.entry(face).or_default();
            sums.iter_mut().zip(facets.iter().zip(spline)).for_each(|(sums, (a, b))| sums.add(*a, b));
        }
    }
    let (replicates, quantum) = (runs[1].faces.len(), runs[1].results.quantum);
    let error = |(face, sums): (u32, [PairedSums; 3])| {
        let [absorbed, entered, left] = sums.map(|s| s.paired(replicates, quantum));
        let statistical = sums.map(|s| s.statistical(replicates, quantum));
        FaceError { face, absorbed, entered, left, statistical }
    };
    let mut errors: Vec<FaceError> = sums.into_iter().map(error).collect();
    errors.sort_by_key(|e| e.face);
    errors
}

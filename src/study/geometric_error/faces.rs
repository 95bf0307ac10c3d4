//! What facets change of the power that each face absorbs and lets through, from replicates of the same rays.

use super::paired::Paired;
use super::replicates::{FaceQuanta, ReplicatedRun};
use crate::math::variance_of_sum;
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

/// Sums over replicates of one kind of power at one face, quanta.
#[derive(Clone, Copy, Debug, Default)]
struct PairedSums {
    /// On facets and on the spline.
    totals: [f64; 2],
    /// Of the squares of the replicates' differences.
    squares: f64,
    /// Of the squares of the spline's replicates.
    spline_squares: f64,
}

impl PairedSums {
    /// Adds what one replicate brought on facets and on the spline, quanta.
    fn add(&mut self, facets: u64, spline: u64) {
        let [facets, spline] = [facets as f64, spline as f64];
        self.totals[0] += facets;
        self.totals[1] += spline;
        self.squares += (facets - spline).powi(2);
        self.spline_squares += spline * spline;
    }

    /// Returns both powers, and the standard error of their difference over so many replicates; `quantum` is the power of one.
    fn paired(&self, replicates: usize, quantum: f64) -> Paired {
        let error = variance_of_sum(self.squares, self.totals[0] - self.totals[1], replicates).sqrt() * quantum;
        let [facets, spline] = self.totals.map(|total| total * quantum);
        Paired { facets, spline, error }
    }

    /// Returns the standard error of the power on the spline.
    fn statistical(&self, replicates: usize, quantum: f64) -> f64 {
        variance_of_sum(self.spline_squares, self.totals[1], replicates).sqrt() * quantum
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::error_of_sum;

    /// The error from sums is that of the replicates' differences.
    #[test]
    fn the_error_of_a_difference_is_that_of_its_replicates() {
        let brought: [[u32; 2]; 5] = [[5, 3], [0, 4], [7, 7], [0, 0], [12, 1]];
        let mut sums = PairedSums::default();
        brought.iter().for_each(|[a, b]| sums.add((*a).into(), (*b).into()));
        let found = sums.paired(brought.len(), 0.5);
        let expected = 0.5 * error_of_sum(&brought.map(|[a, b]| f64::from(a) - f64::from(b)));
        assert_eq!((found.facets, found.spline), (12.0, 7.5));
        assert!((found.error / expected - 1.0).abs() < 1e-12, "{} {expected}", found.error);
        let on_spline = 0.5 * error_of_sum(&brought.map(|[_, b]| f64::from(b)));
        assert!((sums.statistical(brought.len(), 0.5) / on_spline - 1.0).abs() < 1e-12);
    }
}

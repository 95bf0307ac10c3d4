//! Quanta turned into powers, and the spread of replicates into their standard errors.

use super::tally::Sum;

/// What turns the sums of a run into figures.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PowerScale {
    /// Power of a quantum, in the unit of the sources.
    pub(crate) quantum: f64,
    /// Number of replicates that were summed.
    pub(crate) replicates: u32,
}

impl PowerScale {
    /// Returns the power of a sum.
    pub(crate) fn power(&self, sum: &Sum) -> f64 {
        sum.total as f64 * self.quantum
    }

    /// Returns the standard error of [`Self::power`].
    pub(crate) fn error(&self, sum: &Sum) -> f64 {
        // Most cells of a short run, whose results took longer than a fifth of its rays.
        if sum.total == 0 {
            return 0.0;
        }
        sum.error(self.replicates) * self.quantum
    }
}

//! Quanta turned into powers, and the spread of replicates into their standard errors.

use super::plan::Plan;
use super::tally::Sum;

/// What turns the sums of a run into figures.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PowerScale {
    /// Power of a quantum, in the unit of the sources.
    pub(crate) quantum: f64,
    /// Number of replicates that were summed.
    pub(crate) replicates: u32,
    /// Standard error, as a share of a power, that replicates of unequal size would feign where the light of each ray is the same.
    size_spread: f64,
}

/// Share of the spread due to size within which all spread is due to it: sums cut by ten bits are off by 4e-9 for each ray of a replicate.
const SAME_SPREAD: f64 = 1e-4;

impl PowerScale {
    /// Makes the scale of a run of which these replicates are `done`.
    pub(crate) fn new(quantum: f64, plan: &Plan, done: &[u32]) -> Self {
        Self { quantum, replicates: done.len() as u32, size_spread: plan.size_spread(done) }
    }

    /// Returns the power of a sum.
    pub(crate) fn power(&self, sum: &Sum) -> f64 {
        sum.total as f64 * self.quantum
    }

    /// Returns the standard error of [`Self::power`], without the spread that replicates of unequal size have by that alone.
    pub(crate) fn error(&self, sum: &Sum) -> f64 {
        // Most cells of a short run, whose results took longer than a fifth of its rays.
        if sum.total == 0 {
            return 0.0;
        }
        let spread = sum.error(self.replicates).powi(2);
        // Numbers of rays are not drawn: both spreads are independent, and their squares add up.
        let due_to_size = (self.size_spread * sum.total as f64).powi(2);
        if (spread - due_to_size).abs() <= SAME_SPREAD * due_to_size {
            return 0.0;
        }
        // Independent they are in the mean. By chance the replicates of more rays may have got less light: of k replicates, that takes away
        // 2·√(due_to_size·rest/k), which can be all of the rest up to 4·due_to_size/k.
        let chance = (4.0 / f64::from(self.replicates)).min(1.0) * due_to_size;
        ((spread - due_to_size).max(0.0) + chance).min(spread.max(chance)).sqrt() * self.quantum
    }
}

//! Counts what proofs take, so that a surface too wild for them costs its face and not the run.

use std::sync::atomic::{AtomicU64, Ordering};

/// Steps that the proofs of one face have taken. A step is one sum of two control points, about two nanoseconds.
#[derive(Debug)]
pub(super) struct ProofSteps {
    taken: AtomicU64,
    most: u64,
}

impl ProofSteps {
    /// Starts at none; a face may take `most`.
    pub(super) fn new(most: u64) -> Self {
        Self { taken: AtomicU64::new(0), most }
    }

    /// Adds steps, from any thread.
    pub(super) fn add(&self, steps: u64) {
        // Order does not matter: a face that is over the limit is given up whenever that is seen, and all of it.
        self.taken.fetch_add(steps, Ordering::Relaxed);
    }

    /// Whether the face has taken more than it may.
    pub(super) fn are_too_many(&self) -> bool {
        self.taken.load(Ordering::Relaxed) > self.most
    }

    /// Returns the steps taken so far.
    #[cfg(test)]
    pub(super) fn count(&self) -> u64 {
        self.taken.load(Ordering::Relaxed)
    }
}

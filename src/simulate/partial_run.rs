//! A part of a run: which of its replicates are done, and their sums, so that shards, interrupted runs and runs on several machines come
//! together to the bits of a single run.

use super::bind::BoundScene;
use super::partial_run_error::PartialRunError;
use super::tallies::{ReplicateTally, Tallies};

/// The replicates of a run that are done.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartialRun {
    /// Replicates of the whole run; of one that grows, as far as is known.
    pub replicates: u32,
    /// Whether further replicates may follow: its parts may report different totals.
    pub grows: bool,
    /// The replicates that are done, rising.
    pub done: Vec<u32>,
    /// The sums of the replicates that are done.
    pub tallies: Tallies,
    /// Seconds that it took.
    pub seconds: f64,
}

impl PartialRun {
    /// Makes a part with no replicate done, of a run that does not grow.
    pub(crate) fn empty(bound: &BoundScene, replicates: u32) -> Self {
        Self { replicates, tallies: Tallies::new(bound), ..Self::default() }
    }

    /// Makes a part without sums that has these replicates, rising, as done: what goes on from it leaves them to another part, and
    /// [`Self::leave_out`] then takes them from it.
    pub fn done_elsewhere(bound: &BoundScene, replicates: u32, done: Vec<u32>) -> Self {
        Self { done, ..Self::empty(bound, replicates) }
    }

    /// Counts these replicates, rising, as not done; their sums must be none of this part's.
    pub fn leave_out(&mut self, elsewhere: &[u32]) {
        self.done.retain(|replicate| elsewhere.binary_search(replicate).is_err());
    }

    /// Adds a whole replicate that is not in it yet, and empties its `tally`.
    pub(crate) fn take(&mut self, replicate: u32, tally: &mut ReplicateTally, bound: &BoundScene) {
        // In order, so that looking for a replicate is a search by halves.
        let place = self.done.binary_search(&replicate).unwrap_or_else(|place| place);
        self.done.insert(place, replicate);
        self.tallies.take(tally, bound);
    }

    /// Whether every replicate of the run is done.
    pub fn is_whole(&self) -> bool {
        self.done.len() == self.replicates as usize
    }

    /// Adds another part of the same run, with its seconds.
    ///
    /// # Errors
    /// When both have a replicate in common, or are parts of different runs; nothing is added then.
    pub fn merge(&mut self, other: &Self) -> Result<(), PartialRunError> {
        // Parts of a run that grows may come from different totals; what they must share is that it grows.
        let same_run = self.grows == other.grows && (self.grows || self.replicates == other.replicates);
        if !same_run || !same_shape(&self.tallies, &other.tallies) {
            return Err(PartialRunError::OtherRun);
        }
        if let Some(repeated) = other.done.iter().find(|r| self.done.binary_search(r).is_ok()) {
            return Err(PartialRunError::RepeatedReplicate(*repeated));
        }
        self.add(other);
        self.replicates = self.replicates.max(other.replicates);
        self.seconds += other.seconds;
        Ok(())
    }

    /// Adds other replicates of the same run, unchecked; seconds stay as they are.
    pub(crate) fn add(&mut self, other: &Self) {
        self.done.extend(&other.done);
        self.done.sort_unstable();
        self.tallies.merge(&other.tallies);
    }
}

/// Whether tallies have the same receivers, faces and bodies, cell by cell.
fn same_shape(a: &Tallies, b: &Tallies) -> bool {
    // Cell counts of receivers distinguish scenes; the header's fingerprint confirms that the scene is the same.
    let cells = a.cells.len() == b.cells.len() && a.cells.iter().zip(&b.cells).all(|(a, b)| a.len() == b.len());
    cells
        && a.receivers.len() == b.receivers.len()
        && a.faces.len() == b.faces.len()
        && a.left.len() == b.left.len()
        && a.bulk.len() == b.bulk.len()
}

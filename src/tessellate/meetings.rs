//! Where edges of a part cross: pairs of samples that are one corner, found by the edges of a face.

use crate::model::EdgeId;
use rustc_hash::{FxHashMap, FxHashSet};

/// Two samples, by edge and parameter, in the one place where their edges cross.
pub(super) type MeetingSamples = [(EdgeId, f64); 2];

/// The samples of a part that meet: each pair once, in the order in which they were added.
#[derive(Clone, Default)]
pub(super) struct Meetings {
    pairs: Vec<MeetingSamples>,
    /// The same pairs, by the bits of their parameters.
    known: FxHashSet<[(EdgeId, u64); 2]>,
    /// The indices of the pairs, by the edge of their first sample.
    by_edge: FxHashMap<EdgeId, Vec<usize>>,
}

impl Meetings {
    /// Adds a pair; returns whether it was not there yet.
    pub(super) fn insert(&mut self, pair: MeetingSamples) -> bool {
        let is_new = self.known.insert(pair.map(|(edge, t)| (edge, t.to_bits())));
        if is_new {
            self.by_edge.entry(pair[0].0).or_default().push(self.pairs.len());
            self.pairs.push(pair);
        }
        is_new
    }

    /// Returns the pairs whose first sample is on one of these edges, in the order in which they were added.
    pub(super) fn on_edges(&self, edges: impl IntoIterator<Item = EdgeId>) -> Vec<MeetingSamples> {
        if self.pairs.is_empty() {
            return Vec::new();
        }
        let edges: FxHashSet<EdgeId> = edges.into_iter().collect();
        let mut indices: Vec<usize> = edges.iter().filter_map(|e| self.by_edge.get(e)).flatten().copied().collect();
        indices.sort_unstable();
        indices.into_iter().map(|k| self.pairs[k]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_found_once_and_in_order_by_the_edges_of_a_face() {
        let pair = |a: u32, b: u32, t: f64| [(EdgeId(a), t), (EdgeId(b), 1.0 - t)];
        let mut meetings = Meetings::default();
        assert!(meetings.on_edges([EdgeId(1)]).is_empty());
        let pairs = [pair(5, 1, 0.5), pair(2, 7, 0.25), pair(5, 1, 0.75), pair(1, 2, 0.5)];
        for pair in pairs {
            assert!(meetings.insert(pair) && !meetings.insert(pair));
        }
        assert_eq!(meetings.on_edges([1, 5, 1, 5].map(EdgeId)), [pairs[0], pairs[2], pairs[3]]);
        assert_eq!(meetings.on_edges([2, 3].map(EdgeId)), [pairs[1]]);
    }
}

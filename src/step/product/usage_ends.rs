//! The ends of usages: which product uses which, for writers swap the ends of relationships.

use super::usage_names::Usage;
use rustc_hash::{FxHashMap, FxHashSet};

/// Which products use which.
pub(super) struct UsageEnds {
    /// Parents with their children.
    pairs: FxHashSet<[u64; 2]>,
    parents: FxHashSet<u64>,
}

impl UsageEnds {
    /// Collects the ends of usages, which are given by their parents.
    pub(super) fn new(usages: &FxHashMap<u64, Vec<Usage>>) -> Self {
        let children = |(parent, usages): (&u64, &Vec<Usage>)| -> Vec<[u64; 2]> {
            usages.iter().map(|usage| [*parent, usage.child]).collect()
        };
        Self { pairs: usages.iter().flat_map(children).collect(), parents: usages.keys().copied().collect() }
    }

    /// Whether a product uses others.
    pub(super) fn is_assembly(&self, product: u64) -> bool {
        self.parents.contains(&product)
    }

    /// Whether the first of two products uses the second, and is not used by it: in a relationship the second is the parent.
    pub(super) fn are_swapped(&self, [first, second]: [u64; 2]) -> bool {
        self.pairs.contains(&[first, second]) && !self.pairs.contains(&[second, first])
    }
}

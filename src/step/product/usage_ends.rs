//! The ends of usages: which product uses which, asked by their representations.

use super::usage_names::Usage;
use rustc_hash::{FxHashMap, FxHashSet};

/// Which products use which, asked by their representations: writers swap the ends of relationships.
pub(super) struct UsageEnds {
    /// The product that a representation stands for; `None` for several.
    owners: FxHashMap<u64, Option<u64>>,
    /// Parents with their children.
    pairs: FxHashSet<[u64; 2]>,
}

impl UsageEnds {
    /// Collects the products of `shapes` by their representations, and the ends of `usages`.
    pub(super) fn new(shapes: &FxHashMap<u64, Vec<u64>>, usages: &FxHashMap<u64, Vec<Usage>>) -> Self {
        let mut owners: FxHashMap<u64, Option<u64>> = FxHashMap::default();
        for (&product, shapes) in shapes {
            for shape in shapes {
                owners.entry(*shape).and_modify(|owner| *owner = None).or_insert(Some(product));
            }
        }
        let children = |(parent, usages): (&u64, &Vec<Usage>)| -> Vec<[u64; 2]> {
            usages.iter().map(|usage| [*parent, usage.child]).collect()
        };
        Self { owners, pairs: usages.iter().flat_map(children).collect() }
    }

    /// Whether the product of one representation uses that of the other.
    pub(super) fn uses(&self, parent: u64, child: u64) -> bool {
        let owner = |representation: u64| self.owners.get(&representation).copied().flatten();
        let pair = owner(parent).zip(owner(child));
        pair.is_some_and(|(parent, child)| self.pairs.contains(&[parent, child]))
    }
}

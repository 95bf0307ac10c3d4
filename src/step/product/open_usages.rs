//! The usages of one assembly while places are added to them.

use super::places::{Place, PlaceTable};
use super::usage_names::{Usage, UsagePlacement};
use rustc_hash::FxHashMap;

/// The usages of one assembly, to which places are added.
pub(super) struct OpenUsages {
    /// Children in the places that usages state.
    standing: PlaceTable,
    /// The usage of each entry of `standing`.
    stated_by: Vec<u64>,
    /// Usages without a place by their children, the last first.
    free: FxHashMap<u64, Vec<usize>>,
}

/// What puts a child to a place that is added.
pub(super) enum PlacedBy {
    /// A usage that does so already, or what stands for one.
    Standing(u64),
    /// A usage that had no place.
    Free(u64),
    /// The usage that is added.
    Added,
}

impl OpenUsages {
    /// Sorts the usages of an assembly.
    pub(super) fn new(usages: &[Usage]) -> Self {
        let mut open = Self { standing: PlaceTable::default(), stated_by: Vec::new(), free: FxHashMap::default() };
        for (k, usage) in usages.iter().enumerate() {
            open.stand(usage.id, usage.child, usage.placement);
            if usage.placement == UsagePlacement::Unstated {
                open.free.entry(usage.child).or_default().push(k);
            }
        }
        open.free.values_mut().for_each(|free| free.reverse());
        open
    }

    /// Puts the child of `added` to its place where it does not stand yet: by one of `usages` that has none, or else by `added` itself.
    pub(super) fn place(&mut self, usages: &mut Vec<Usage>, added: Usage) -> PlacedBy {
        let Usage { child, id, placement, .. } = added;
        if let UsagePlacement::Stated(frame) = placement
            && let Some(entry) = self.standing.find(child, &Place::in_parent(&frame))
        {
            return PlacedBy::Standing(self.stated_by[entry]);
        }
        if let Some(k) = self.free.get_mut(&child).and_then(Vec::pop) {
            let free = &mut usages[k];
            free.placement = placement;
            self.stand(free.id, child, placement);
            return PlacedBy::Free(free.id);
        }
        usages.push(added);
        self.stand(id, child, placement);
        PlacedBy::Added
    }

    /// Notes where a usage puts its child, if it says so.
    fn stand(&mut self, usage: u64, child: u64, placement: UsagePlacement) {
        if let UsagePlacement::Stated(frame) = placement {
            self.standing.insert(child, Place::in_parent(&frame));
            self.stated_by.push(usage);
        }
    }
}

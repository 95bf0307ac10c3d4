//! Where the instance with an id stands in the file's order.

use super::Instance;
use rustc_hash::FxHashMap;
use std::collections::hash_map::Entry;

/// Positions of instances by id.
#[derive(Debug)]
pub(super) enum Index {
    /// `table[id]` is the position plus one; 0 for none.
    Dense(Vec<u32>),
    Sparse(FxHashMap<u64, u32>),
}

impl Index {
    /// Makes the index of instances by number, the first where several have one; returns the positions of the others too.
    pub(super) fn new(instances: &[Instance]) -> (Self, Vec<usize>) {
        let largest = instances.iter().map(|i| i.id).fold(0, u64::max);
        let mut repeated = Vec::new();
        // Writers number nearly without gaps: a table is smaller and quicker then. One number of 10¹⁸ must not make one of that size.
        if largest <= 4 * instances.len() as u64 + 1024 {
            let mut table = vec![0; largest as usize + 1];
            for (k, i) in instances.iter().enumerate() {
                let slot = &mut table[i.id as usize];
                if *slot == 0 {
                    *slot = k as u32 + 1;
                } else {
                    repeated.push(k);
                }
            }
            return (Self::Dense(table), repeated);
        }
        let mut map = FxHashMap::default();
        for (k, i) in instances.iter().enumerate() {
            match map.entry(i.id) {
                Entry::Vacant(slot) => {
                    slot.insert(k as u32);
                }
                Entry::Occupied(_) => repeated.push(k),
            }
        }
        (Self::Sparse(map), repeated)
    }

    /// Returns the place of an instance in the file's order; `None` when the file has none with this id.
    pub(super) fn position(&self, id: u64) -> Option<u32> {
        match self {
            Self::Dense(table) => table.get(usize::try_from(id).ok()?).copied()?.checked_sub(1),
            Self::Sparse(map) => map.get(&id).copied(),
        }
    }
}

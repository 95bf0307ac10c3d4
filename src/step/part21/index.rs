//! Instances, and where they stand in the file's order: by their ids, and by the names of their records.

use rustc_hash::FxHashMap;
use std::collections::hash_map::Entry;

/// The records of one instance: several for a complex instance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instance {
    pub(super) id: u64,
    pub(super) first: u32,
    pub(super) count: u32,
}

/// Positions of instances by id.
#[derive(Debug)]
pub(super) enum Index {
    /// `table[id]` is the position plus one; 0 for none.
    Dense(Vec<u32>),
    Sparse(FxHashMap<u64, u32>),
}

impl Index {
    /// Makes the index of instances by their ids; takes those out of the list, and returns them, that repeat the id of an earlier one: what
    /// looks for instances by their kind would find the earlier one twice.
    pub(super) fn take_repeated(instances: &mut Vec<Instance>) -> (Self, Vec<Instance>) {
        let (index, positions) = Self::new(instances.iter().map(|i| i.id));
        if positions.is_empty() {
            return (index, Vec::new());
        }
        let (mut position, mut positions) = (0.., positions.into_iter().peekable());
        let is_repeated = |_: &mut Instance| {
            let position = position.next();
            positions.next_if(|repeated| Some(*repeated) == position).is_some()
        };
        let repeated = instances.extract_if(.., is_repeated).collect();
        (Self::new(instances.iter().map(|i| i.id)).0, repeated)
    }

    /// Makes the index of instances by their ids, the first where several have one; returns the positions of the others too, ascending.
    fn new(ids: impl ExactSizeIterator<Item = u64> + Clone) -> (Self, Vec<usize>) {
        let largest = ids.clone().fold(0, u64::max);
        let mut repeated = Vec::new();
        // Writers number nearly without gaps: a table is smaller and quicker then. One number of 10¹⁸ must not make one of that size.
        if largest <= 4 * ids.len() as u64 + 1024 {
            let mut table = vec![0; largest as usize + 1];
            for (k, id) in ids.enumerate() {
                let slot = &mut table[id as usize];
                if *slot == 0 {
                    *slot = k as u32 + 1;
                } else {
                    repeated.push(k);
                }
            }
            return (Self::Dense(table), repeated);
        }
        let mut map = FxHashMap::default();
        for (k, id) in ids.enumerate() {
            match map.entry(id) {
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

/// Positions of instances by the names of their records: what asks for a few kinds of a million entities need not look at the others.
#[derive(Debug)]
pub(super) struct Kinds<'a> {
    /// Each name once, with the positions of the instances that have a record of it, ascending, each once.
    kinds: Vec<(&'a [u8], Vec<u32>)>,
}

impl<'a> Kinds<'a> {
    /// Sorts instances by the names of their records, which come in the order of the file, each with the position of its instance.
    pub(super) fn new(names: impl Iterator<Item = (&'a [u8], u32)>) -> Self {
        let mut kinds: Vec<(&[u8], Vec<u32>)> = Vec::new();
        let mut places: FxHashMap<&[u8], usize> = FxHashMap::default();
        for (name, position) in names {
            let place = *places.entry(name).or_insert(kinds.len());
            if place == kinds.len() {
                kinds.push((name, Vec::new()));
            }
            let positions = &mut kinds[place].1;
            // A complex instance may name a type twice.
            if positions.last() != Some(&position) {
                positions.push(position);
            }
        }
        Self { kinds }
    }

    /// Returns the positions of the instances with a record whose name is meant, ascending, each once.
    pub(super) fn positions(&self, is_meant: impl Fn(&[u8]) -> bool) -> Vec<u32> {
        let meant: Vec<&[u32]> =
            self.kinds.iter().filter(|(name, _)| is_meant(name)).map(|(_, p)| &p[..]).collect();
        let mut positions = meant.concat();
        if meant.len() > 1 {
            // A stable sort merges runs that are in order already.
            positions.sort();
            positions.dedup();
        }
        positions
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instances_of_several_names_come_once_and_in_order() {
        let names: [(&[u8], u32); 7] =
            [(b"A", 0), (b"B", 0), (b"A", 1), (b"C", 2), (b"B", 3), (b"A", 3), (b"B", 3)];
        let kinds = Kinds::new(names.into_iter());
        let positions = |meant: &[&[u8]]| kinds.positions(|name| meant.contains(&name));
        assert_eq!([positions(&[b"A"]), positions(&[b"B"])], [vec![0, 1, 3], vec![0, 3]]);
        assert_eq!([positions(&[b"C", b"B"]), positions(&[b"D"])], [vec![0, 2, 3], vec![]]);
    }
}

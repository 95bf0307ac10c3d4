//! Counts what an assembly would place, without placing it.
//!
//! Known weakness: products that contain each other are counted as if the cycle were cut where it is met first; the walk has a limit of
//! its own for these.

use super::assembly::{Assembly, MAX_DEPTH};
use rustc_hash::{FxHashMap, FxHashSet};

impl Assembly<'_, '_> {
    /// Returns how many products and representations a walk would place, without walking: what is used twice counts twice. At least 1;
    /// beyond 64 bits the largest number.
    pub(crate) fn count(&self) -> u64 {
        let children: FxHashSet<u64> = self.usages.values().flat_map(|u| u.iter()).map(|u| u.child).collect();
        let mut counter = Counter {
            assembly: self,
            products: FxHashMap::default(),
            shapes: FxHashMap::default(),
            groups: FxHashMap::default(),
        };
        let products: FxHashSet<u64> = self.shapes.keys().chain(self.usages.keys()).copied().collect();
        let roots = products.into_iter().filter(|p| !children.contains(p));
        let placed = roots.fold(0u64, |n, root| n.saturating_add(counter.product(root)));
        // Representations without a product nest by their mapped items.
        let maps = self.file.entities_named(&["MAPPED_ITEM"]).filter_map(|e| self.mapped_representation(e.id));
        let maps: FxHashSet<u64> = maps.collect();
        let largest = maps.into_iter().map(|id| counter.representation(id)).max();
        // Without any, a file of one part places that.
        placed.max(largest.unwrap_or(1))
    }
}

/// Counts what a walk would place; each product and representation is looked at once.
struct Counter<'c, 'f, 'a> {
    assembly: &'c Assembly<'f, 'a>,
    /// Numbers of products that are known; 0 while they are being found, so that cycles end.
    products: FxHashMap<u64, u64>,
    /// The same of representations, each by the first of its group.
    shapes: FxHashMap<u64, u64>,
    /// The first of the group of representations that stand unmoved in each other, of which a walk that reaches one places all.
    groups: FxHashMap<u64, u64>,
}

/// What is being counted: a product or a group of representations.
struct OpenCount {
    id: u64,
    /// What it places itself, and what of its children is counted.
    count: u64,
    /// Children that are not counted yet.
    children: Vec<u64>,
}

/// Returns the count of `root` and of all below it. `known` holds what is counted, and gets the rest; `open` returns what one places
/// itself.
fn count_below(root: u64, known: &mut FxHashMap<u64, u64>, mut open: impl FnMut(u64) -> OpenCount) -> u64 {
    if let Some(count) = known.get(&root) {
        return *count;
    }
    // While it is being counted it counts for nothing: what contains itself must come to an end.
    known.insert(root, 0);
    let mut path = vec![open(root)];
    let mut total = 0;
    loop {
        let depth = path.len();
        let Some(top) = path.last_mut() else { return total };
        match top.children.pop() {
            Some(child) => {
                if let Some(count) = known.get(&child) {
                    top.count = top.count.saturating_add(*count);
                } else if depth < MAX_DEPTH {
                    known.insert(child, 0);
                    path.push(open(child));
                }
            }
            None => {
                total = top.count;
                known.insert(top.id, total);
                path.pop();
                if let Some(outer) = path.last_mut() {
                    outer.count = outer.count.saturating_add(total);
                }
            }
        }
    }
}

impl Counter<'_, '_, '_> {
    /// Returns how many a walk would place for a product: itself, its representations and what its children place.
    fn product(&mut self, id: u64) -> u64 {
        let mut products = std::mem::take(&mut self.products);
        let count = count_below(id, &mut products, |id| {
            let assembly = self.assembly;
            let shapes = assembly.shapes.get(&id).into_iter().flatten();
            let count = shapes.fold(1u64, |n, shape| n.saturating_add(self.representation(*shape)));
            let usages = assembly.usages.get(&id).into_iter().flat_map(|usages| usages.iter());
            OpenCount { id, count, children: usages.map(|usage| usage.child).collect() }
        });
        self.products = products;
        count
    }

    /// Returns how many a walk would place for a representation: its group, what that maps and what moved relationships lead to.
    fn representation(&mut self, id: u64) -> u64 {
        let mut shapes = std::mem::take(&mut self.shapes);
        let first = self.group(id);
        let count = count_below(first, &mut shapes, |first| self.open_group(first));
        self.shapes = shapes;
        count
    }

    /// Returns what a group of representations places itself, and the groups that it leads to.
    fn open_group(&mut self, first: u64) -> OpenCount {
        let assembly = self.assembly;
        // That of a product is a group of its own: many may stand in one that is no product's.
        let is_owned = assembly.owned.contains_key(&first);
        let members = if is_owned { vec![first] } else { assembly.unmoved(vec![first]) };
        let mut children = Vec::new();
        let mut beside: FxHashSet<u64> = FxHashSet::default();
        for &member in &members {
            for item in assembly.items(member) {
                children.extend(assembly.mapped_representation(item).map(|inner| self.group(inner)));
            }
            for link in assembly.links.get(&member).into_iter().flatten() {
                let group = self.group(link.to);
                // Several unmoved ways to a group place it once.
                if link.is_moved() || group != first && beside.insert(group) {
                    children.push(group);
                }
            }
        }
        OpenCount { id: first, count: members.len() as u64, children }
    }

    /// Returns the representation that stands for the group of another.
    fn group(&mut self, id: u64) -> u64 {
        if let Some(first) = self.groups.get(&id) {
            return *first;
        }
        if self.assembly.owned.contains_key(&id) {
            return id;
        }
        self.groups.extend(self.assembly.unmoved(vec![id]).into_iter().map(|member| (member, id)));
        id
    }
}

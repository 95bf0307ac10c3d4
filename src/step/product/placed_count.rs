//! How much an assembly would place, counted without placing it.
//!
//! Known weakness: products that contain each other are counted as if the cycle were cut where it is met first; the walk has a limit of
//! its own for these.

use super::assembly::Assembly;
use rustc_hash::{FxHashMap, FxHashSet};

/// Deepest chain of products or representations that is followed.
const MAX_DEPTH: usize = 64;

impl Assembly<'_, '_> {
    /// Returns how many products and representations a walk would place, without walking: what is used twice counts twice. At least 1;
    /// beyond 64 bits the largest number.
    pub(crate) fn count(&self) -> u64 {
        let children: FxHashSet<u64> = self.usages.values().flatten().map(|u| u.child).collect();
        let mut counter = Counter { assembly: self, products: FxHashMap::default(), shapes: FxHashMap::default() };
        let products: FxHashSet<u64> = self.shapes.keys().chain(self.usages.keys()).copied().collect();
        let roots = products.into_iter().filter(|p| !children.contains(p));
        let placed = roots.fold(0u64, |n, root| n.saturating_add(counter.product(root, 0)));
        // Representations without a product nest by their mapped items.
        let lone = self.file.entities_named(&["MAPPED_ITEM"]);
        let maps = lone
            .filter_map(|e| e.attributes("MAPPED_ITEM", 1)?.entity(0)?.attributes("REPRESENTATION_MAP", 0)?.id(1));
        let maps: FxHashSet<u64> = maps.collect();
        let largest = maps.into_iter().map(|id| counter.representation(id, 0)).max();
        // Without any, a file of one part places that.
        placed.max(largest.unwrap_or(1))
    }
}

/// Counts what a walk would place; each product and representation is looked at once.
struct Counter<'c, 'f, 'a> {
    assembly: &'c Assembly<'f, 'a>,
    /// Numbers of products that are known; 0 while they are being found, so that cycles end.
    products: FxHashMap<u64, u64>,
    /// The same of representations.
    shapes: FxHashMap<u64, u64>,
}

impl Counter<'_, '_, '_> {
    /// Returns how many a walk would place for a product: itself, its representations and what its children place.
    fn product(&mut self, id: u64, depth: usize) -> u64 {
        if let Some(known) = self.products.get(&id) {
            return *known;
        }
        // While it is being counted it counts for nothing: what contains itself must come to an end.
        self.products.insert(id, 0);
        let mut count = 1u64;
        if depth < MAX_DEPTH {
            let assembly = self.assembly;
            for shape in assembly.shapes.get(&id).into_iter().flatten() {
                count = count.saturating_add(self.representation(*shape, 0));
            }
            for usage in assembly.usages.get(&id).into_iter().flatten() {
                count = count.saturating_add(self.product(usage.child, depth + 1));
            }
        }
        self.products.insert(id, count);
        count
    }

    /// Returns how many a walk would place for a representation: itself, what it maps and what it is related to.
    fn representation(&mut self, id: u64, depth: usize) -> u64 {
        if let Some(known) = self.shapes.get(&id) {
            return *known;
        }
        // Nothing while it is being counted, as for products.
        self.shapes.insert(id, 0);
        let mut count = 1u64;
        if depth < MAX_DEPTH {
            let file = self.assembly.file;
            for item in self.assembly.items(id) {
                let mapped = file.entity(item).and_then(|e| e.attributes("MAPPED_ITEM", 1)?.entity(0));
                let inner = mapped.and_then(|m| m.attributes("REPRESENTATION_MAP", 0)?.id(1));
                count = count.saturating_add(inner.map_or(0, |inner| self.representation(inner, depth + 1)));
            }
            for link in self.assembly.links.get(&id).into_iter().flatten() {
                count = count.saturating_add(self.representation(link.to, depth + 1));
            }
        }
        self.shapes.insert(id, count);
        count
    }
}

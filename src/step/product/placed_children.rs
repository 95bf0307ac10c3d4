//! Children of products that representations place, by mapped items and by relationships with a transformation, and what these hold.
//!
//! Source: ISO 10303-44 with AP214: a usage may stand beside a mapped item that places the same child, without a placement of its own or
//! with the same one.

use super::assembly::Assembly;
use super::places::{Place, PlaceTable};
use super::usage_ends::UsageEnds;
use super::usage_names::{Usage, UsagePlacement};
use crate::math::Frame;
use rustc_hash::{FxHashMap, FxHashSet};

impl Assembly<'_, '_> {
    /// Returns those children of a product, among `usages` without a placement, that its own representations place.
    pub(super) fn placed_within(&self, definition: u64, usages: &[Usage]) -> FxHashSet<u64> {
        let unplaced = |usage: &&Usage| usage.placement == UsagePlacement::Unstated;
        let children: FxHashSet<u64> = usages.iter().filter(unplaced).map(|usage| usage.child).collect();
        if children.is_empty() {
            return children;
        }
        let mut shown: FxHashSet<u64> = FxHashSet::default();
        for representation in self.representations(definition) {
            let mapped = self.items(representation).into_iter().filter_map(|item| self.mapped_representation(item));
            shown.extend(mapped);
            // One that moves nothing puts it where its usage does, which has a name.
            let links = self.links.get(&representation).into_iter().flatten();
            shown.extend(links.filter(|link| link.is_moved()).map(|link| link.to));
        }
        let is_shown = |child: &u64| {
            // The representation leads to shapes, not to further usages: what these place would be lost.
            let places_more = self.usages.get(child).is_some_and(|u| u.iter().any(|u| !unplaced(&u)));
            !places_more && self.representations(*child).iter().any(|r| shown.contains(r))
        };
        children.into_iter().filter(is_shown).collect()
    }

    /// Returns where the usages of a product in the place `parent` put the representations of their children, but those in `placed_within`.
    pub(super) fn usage_places(
        &self,
        usages: &[Usage],
        parent: &Place,
        placed_within: &FxHashSet<u64>,
    ) -> PlaceTable {
        let mut of_children: FxHashMap<u64, Vec<Place>> = FxHashMap::default();
        for usage in usages {
            let local = match usage.placement {
                UsagePlacement::Stated(local) => local,
                UsagePlacement::Unstated if !placed_within.contains(&usage.child) => Frame::IDENTITY,
                UsagePlacement::Unstated | UsagePlacement::Unreadable => continue,
            };
            of_children.entry(usage.child).or_default().push(parent.inner(&local));
        }
        let mut table = PlaceTable::default();
        for (child, places) in &of_children {
            for representation in self.representations(*child) {
                places.iter().for_each(|place| table.insert(representation, *place));
            }
        }
        table
    }

    /// Leaves out the relationships that lead unmoved to the representation of a product, which its own usages place, but those by which a
    /// transformation puts one product without children into another. Of 20,000 products with one shape each would be asked for all the
    /// others: 23 s.
    pub(super) fn leave_out_links_to_products(&mut self, ends: &UsageEnds) {
        let mut links = std::mem::take(&mut self.links);
        for (from, links) in &mut links {
            links.retain(|link| {
                let child = || self.products_of([*from, link.to]).map(|[_, child]| child);
                let is_placed = || link.has_transformation && child().is_some_and(|child| !ends.is_assembly(child));
                link.is_moved() || !self.owned.contains_key(&link.to) || is_placed()
            });
        }
        self.links = links;
    }

    /// Returns the product definitions, by id, one of whose representations another product's representation places by a relationship with
    /// a transformation; mapped items are not looked at.
    pub(super) fn products_placed_by_others(&self) -> FxHashSet<u64> {
        let mut places: FxHashMap<u64, Vec<u64>> = FxHashMap::default();
        for (from, links) in self.links.iter().filter(|(from, _)| self.owned.contains_key(from)) {
            for link in links.iter().filter(|link| link.has_transformation) {
                places.entry(link.to).or_default().push(*from);
            }
        }
        let by_others =
            |own: &Vec<u64>| own.iter().filter_map(|r| places.get(r)).flatten().any(|from| !own.contains(from));
        self.shapes.iter().filter(|(_, own)| by_others(own)).map(|(product, _)| *product).collect()
    }

    /// Returns the representations of a product, and those that stand unmoved in one of them and are no other product's.
    pub(super) fn representations(&self, definition: u64) -> Vec<u64> {
        self.unmoved(self.shapes.get(&definition).into_iter().flatten().copied().collect())
    }

    /// Returns representations, and those that stand unmoved in one of them and are no product's.
    pub(super) fn unmoved(&self, mut found: Vec<u64>) -> Vec<u64> {
        let mut known: FxHashSet<u64> = found.iter().copied().collect();
        let mut at = 0;
        while at < found.len() {
            for link in self.links.get(&found[at]).into_iter().flatten() {
                if !link.is_moved() && !self.owned.contains_key(&link.to) && known.insert(link.to) {
                    found.push(link.to);
                }
            }
            at += 1;
        }
        found
    }

    /// Returns representations, those of products, and all that they hold by usages, relationships and mapped items, but `known` ones and
    /// what is reached through these alone.
    pub(super) fn held_representations(
        &self,
        mut products: Vec<u64>,
        mut representations: Vec<u64>,
        known: &FxHashSet<u64>,
    ) -> FxHashSet<u64> {
        let mut seen: FxHashSet<u64> = products.iter().copied().collect();
        while let Some(product) = products.pop() {
            representations.extend(self.shapes.get(&product).into_iter().flatten());
            let usages = self.usages.get(&product).into_iter().flat_map(|usages| usages.iter());
            products.extend(usages.map(|usage| usage.child).filter(|child| seen.insert(*child)));
        }
        let mut held: FxHashSet<u64> = FxHashSet::default();
        while let Some(id) = representations.pop() {
            if !known.contains(&id) && held.insert(id) {
                representations.extend(self.links.get(&id).into_iter().flatten().map(|link| link.to));
                let items = self.items(id).into_iter();
                representations.extend(items.filter_map(|item| self.mapped_representation(item)));
            }
        }
        held
    }

    /// Returns the representation that a MAPPED_ITEM shows; `None` for any other item.
    pub(super) fn mapped_representation(&self, item: u64) -> Option<u64> {
        let map = self.file.entity(item)?.attributes("MAPPED_ITEM", 1)?.entity(0)?;
        map.attributes("REPRESENTATION_MAP", 0)?.id(1)
    }
}

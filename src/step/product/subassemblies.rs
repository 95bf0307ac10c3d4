//! Assemblies that stand in others by a relationship with a transformation, or by a mapped item, without a usage or beside one without a
//! place: with all that their own usages place, which no representation leads to. What other usages place stands there alone.
//!
//! Known weakness: a mapped item in a representation that is only related to that of the product is not looked at.

use super::assembly::Assembly;
use super::open_usages::OpenUsages;
use super::places::is_one_place;
use super::usage_names::{Usage, UsagePlacement};
use crate::math::Frame;
use rustc_hash::{FxHashMap, FxHashSet};

/// What puts a representation of one product into that of another.
#[derive(Clone, Copy)]
pub(super) struct ProductLink {
    /// The relationship or the mapped item.
    pub(super) by: u64,
    pub(super) parent: u64,
    pub(super) child: u64,
    /// The representations of both.
    pub(super) holder: u64,
    pub(super) shown: u64,
    /// `None` where the mapped item gives it.
    pub(super) placement: Option<Frame>,
}

impl Assembly<'_, '_> {
    /// Turns relationships into usages where their child has usages of its own, and mapped items where some of these state a place;
    /// `related` are the relationships of products with a transformation.
    pub(super) fn place_assemblies(&mut self, usages: &mut FxHashMap<u64, Vec<Usage>>, related: Vec<ProductLink>) {
        let mut related = by_children(related);
        let mut mapped = by_children(self.mapped_products());
        if related.is_empty() && mapped.is_empty() {
            return;
        }
        let mut open: Vec<u64> = usages.iter().filter(|(_, own)| !own.is_empty()).map(|(id, _)| *id).collect();
        open.sort_unstable();
        let assemblies: FxHashSet<u64> = open.iter().copied().collect();
        let used = UsedProducts::new(usages);
        let is_alone = |link: &ProductLink| used.allow(link);
        let mut open_usages: FxHashMap<u64, OpenUsages> = FxHashMap::default();
        let mut settled: FxHashSet<[u64; 2]> = FxHashSet::default();
        // What holds an assembly becomes one, so that what holds that is looked at again.
        while let Some(child) = open.pop() {
            let mut links = related.remove(&child).unwrap_or_default();
            links.retain(is_alone);
            settled.extend(links.iter().map(|link| [link.holder, link.shown]));
            keep_first_unmoved(&mut links, &used.children);
            self.problems.extend(unsure_direction(&links, [&assemblies, &used.children]));
            // Of one whose children are all placed by mapped items these show everything.
            let states_places = |own: &Vec<Usage>| own.iter().any(|u| u.placement != UsagePlacement::Unstated);
            if usages.get(&child).is_some_and(states_places) {
                links.extend(mapped.remove(&child).into_iter().flatten().filter(is_alone));
            }
            for link in links {
                let in_item = || self.mapping(link.by, link.holder)?.placement;
                // One that cannot be read is reported by the walk.
                let Some(frame) = link.placement.or_else(in_item) else { continue };
                let placement = UsagePlacement::Stated(frame);
                let added = Usage { child, name: String::new(), id: link.by, placement };
                let own = usages.entry(link.parent).or_default();
                open_usages.entry(link.parent).or_insert_with(|| OpenUsages::new(own)).place(own, added);
                open.push(link.parent);
            }
        }
        for (holder, links) in &mut self.links {
            let is_settled = |to: u64| settled.contains(&[*holder, to]);
            links.retain(|link| !link.has_transformation || link.placement.is_none() || !is_settled(link.to));
        }
    }

    /// Returns the mapped items in representations of products that show those of others.
    fn mapped_products(&self) -> Vec<ProductLink> {
        let mut found = Vec::new();
        let items = self.file.entities_named(&["MAPPED_ITEM"]).filter_map(|e| {
            let shown = self.mapped_representation(e.id)?;
            self.owned.get(&shown).copied().flatten().map(|child| (e.id, (shown, child)))
        });
        let items: FxHashMap<u64, (u64, u64)> = items.collect();
        if items.is_empty() {
            return found;
        }
        let mut holders: Vec<(u64, u64)> =
            self.owned.iter().filter_map(|(holder, parent)| Some((*holder, (*parent)?))).collect();
        holders.sort_unstable();
        for (holder, parent) in holders {
            for by in self.items(holder) {
                if let Some(&(shown, child)) = items.get(&by)
                    && child != parent
                {
                    found.push(ProductLink { by, parent, child, holder, shown, placement: None });
                }
            }
        }
        found
    }
}

/// Which products the usages of a file use.
struct UsedProducts {
    children: FxHashSet<u64>,
    /// Parents with their children, and whether no usage says where the child stands there.
    pairs: FxHashMap<[u64; 2], bool>,
}

impl UsedProducts {
    fn new(usages: &FxHashMap<u64, Vec<Usage>>) -> Self {
        let mut used = Self { children: FxHashSet::default(), pairs: FxHashMap::default() };
        for (parent, own) in usages {
            for usage in own {
                used.children.insert(usage.child);
                let is_unplaced = used.pairs.entry([*parent, usage.child]).or_insert(true);
                *is_unplaced &= usage.placement == UsagePlacement::Unstated;
            }
        }
        used
    }

    /// Whether a link may stand for a usage: beside those of the same two products without a place, or where none uses the child.
    fn allow(&self, link: &ProductLink) -> bool {
        let pair = self.pairs.get(&[link.parent, link.child]);
        pair.copied().unwrap_or_else(|| !self.children.contains(&link.child))
    }
}

/// Leaves out, of the links that put one child unmoved into several products, all but those into the first and into those that usages put
/// somewhere, which are the `used`: the others are mostly the same thing defined again, and it would stand in one place several times.
fn keep_first_unmoved(links: &mut Vec<ProductLink>, used: &FxHashSet<u64>) {
    let mut first = None;
    links.retain(|link| {
        let is_moved = link.placement.is_none_or(|frame| !is_one_place(&frame, &Frame::IDENTITY));
        is_moved || used.contains(&link.parent) || *first.get_or_insert(link.parent) == link.parent
    });
}

/// Says of relationships that put one child into several products, of which some are no `assemblies` by usages and not `used` either, that
/// they may mean that these stand in it: writers swap the ends. `None` for others.
fn unsure_direction(links: &[ProductLink], [assemblies, used]: [&FxHashSet<u64>; 2]) -> Option<String> {
    let parents: FxHashSet<u64> = links.iter().map(|link| link.parent).collect();
    let is_known = |link: &&ProductLink| assemblies.contains(&link.parent) || used.contains(&link.parent);
    let first = links.iter().find(|link| !is_known(link)).filter(|_| parents.len() > 1)?;
    Some(format!(
        "#{}: puts product #{} into #{}, as others put it into {} more, and no usage says so: it stands in each, which is wrong if the \
         ends of these relationships are swapped",
        first.by,
        first.child,
        first.parent,
        parents.len() - 1
    ))
}

/// Sorts links by their children.
fn by_children(links: Vec<ProductLink>) -> FxHashMap<u64, Vec<ProductLink>> {
    let mut sorted: FxHashMap<u64, Vec<ProductLink>> = FxHashMap::default();
    links.into_iter().for_each(|link| sorted.entry(link.child).or_default().push(link));
    sorted
}

//! How representations stand in each other: by relationships, by mapped items, and by the usages whose shapes they are.

use super::assembly::{Assembly, MAX_DEPTH};
use super::lost_usages::LostUsage;
use super::places::{Place, PlaceTable, is_one_place};
use super::relations::{
    HIGHER_USAGE, Link, OccurrenceShape, has_transformation, is_higher_usage, property_attributes,
    related_representations, stated_transformation, usage_attributes,
};
use super::subassemblies::ProductLink;
use super::usage_ends::UsageEnds;
use crate::math::Frame;
use crate::step::part21::Entity;
use rustc_hash::{FxHashMap, FxHashSet};

/// What CONTEXT_DEPENDENT_SHAPE_REPRESENTATIONs give besides the placements of usages.
#[derive(Default)]
pub(super) struct ContextualPlaces {
    /// The relationships that are those of usages.
    pub(super) relations: FxHashSet<u64>,
    pub(super) lost: Vec<LostUsage>,
}

impl<'f, 'a> Assembly<'f, 'a> {
    /// Returns how the first of two representations stands in the second by the transformation of their relationship; `None`, which is
    /// reported, where that cannot be read.
    pub(super) fn transformation(&mut self, e: Entity<'f, 'a>, [first, second]: [u64; 2]) -> Option<Frame> {
        let placement = stated_transformation(e).and_then(|t| {
            // An operator takes the first representation into the second by itself (ISO 10303-43, functionally_defined_transformation).
            if t.keywords().any(|k| k.starts_with("CARTESIAN_TRANSFORMATION_OPERATOR")) {
                return self.geometry_reader(second).transformation(t.id).ok();
            }
            let args = t.attributes("ITEM_DEFINED_TRANSFORMATION", 0)?;
            let (from, to) = (args.id(2)?, args.id(3)?);
            // Each placement is in the units of the representation that holds it.
            let (mut holder_from, mut holder_to) = (first, second);
            let is_swapped = self.is_item(to, first) && self.is_item(from, second);
            // Where both representations hold both placements, the relationship decides which is whose.
            if is_swapped && !(self.is_item(from, first) && self.is_item(to, second)) {
                (holder_from, holder_to) = (second, first);
            }
            let from = self.geometry_reader(holder_from).placement(from).ok()?;
            let to = self.geometry_reader(holder_to).placement(to).ok()?;
            let whole = to.compose(&from.inverse());
            Some(if holder_from == first { whole } else { whole.inverse() })
        });
        if placement.is_none() {
            self.problems.push(format!("#{}: its transformation cannot be read; what it places is left out", e.id));
        }
        placement
    }

    /// Notes which products representations show that are related to theirs, by relationships without a transformation but those that
    /// `contextual` entities name, which are of two products.
    pub(super) fn read_related_shapes(&mut self, relations: &[Entity<'f, 'a>], contextual: &[Entity<'f, 'a>]) {
        let of_usages: FxHashSet<u64> = contextual.iter().filter_map(|e| e.args().id(0)).collect();
        let mut beside: FxHashMap<u64, Vec<u64>> = FxHashMap::default();
        for e in relations.iter().filter(|e| !has_transformation(**e) && !of_usages.contains(&e.id)) {
            let Some([first, second]) = related_representations(*e) else { continue };
            beside.entry(first).or_default().push(second);
            beside.entry(second).or_default().push(first);
        }
        let mut seen: FxHashSet<u64> = FxHashSet::default();
        for &start in beside.keys().filter(|id| !self.owned.contains_key(*id)) {
            if !seen.insert(start) {
                continue;
            }
            let mut group = vec![start];
            let mut owners: FxHashSet<Option<u64>> = FxHashSet::default();
            let mut at = 0;
            while at < group.len() {
                for next in beside.get(&group[at]).into_iter().flatten() {
                    match self.owned.get(next) {
                        Some(owner) => {
                            owners.insert(*owner);
                        }
                        None if seen.insert(*next) => group.push(*next),
                        None => {}
                    }
                }
                at += 1;
            }
            if let (1, Some(Some(owner))) = (owners.len(), owners.iter().next()) {
                self.related.extend(group.iter().map(|id| (*id, *owner)));
            }
        }
    }

    /// Reads where the children of usages stand in their parents, by CONTEXT_DEPENDENT_SHAPE_REPRESENTATIONs.
    pub(super) fn read_contextual(&mut self, entities: &[Entity<'f, 'a>], ends: &UsageEnds) -> ContextualPlaces {
        let mut places = ContextualPlaces::default();
        let mut higher = Vec::new();
        let mut broken = Vec::new();
        for &e in entities {
            let args = e.args();
            let usage = args.entity(1).and_then(|shape| property_attributes(shape).entity(2));
            let (Some(relation), Some(usage)) = (args.entity(0), usage) else {
                broken.push(e);
                continue;
            };
            // That of anything else stands for itself.
            if is_higher_usage(usage) || usage_attributes(usage).is_some() {
                places.relations.insert(relation.id);
                if is_higher_usage(usage) {
                    higher.push((e, relation, usage));
                } else {
                    self.read_usage_place(e, relation, usage);
                }
            }
        }
        // What they should agree with is known now.
        for (e, relation, usage) in higher {
            self.compare_higher_usage(e, relation, usage);
        }
        for e in broken {
            if let Some(lost) = self.lost_usage(e, ends, &places.relations) {
                places.relations.insert(lost.relation);
                places.lost.push(lost);
            }
        }
        places
    }

    /// Reads where the child of a usage stands in the parent, by the relationship that `e` names.
    fn read_usage_place(&mut self, e: Entity<'f, 'a>, relation: Entity<'f, 'a>, usage: Entity<'f, 'a>) {
        let Some([first, second]) = related_representations(relation) else {
            self.problems.push(format!("#{}: its relationship lacks a representation: it places nothing", e.id));
            return;
        };
        if !has_transformation(relation) {
            return;
        }
        let mut placement = self.transformation(relation, [first, second]);
        // The first representation is the child's; some writers swap them.
        if let Some((parent, child)) = usage_attributes(usage).and_then(|a| Some((a.id(3)?, a.id(4)?))) {
            let has = |product: u64, r: u64| {
                self.shapes.get(&product).is_some_and(|s| s.contains(&r)) || self.related.get(&r) == Some(&product)
            };
            if has(parent, first) && has(child, second) && !has(child, first) {
                placement = placement.map(|p| p.inverse());
            }
        }
        self.place_usage(e.id, usage.id, placement);
    }

    /// Notes where the child of a usage stands in the parent, as the entity `by` says; the first such entity counts.
    fn place_usage(&mut self, by: u64, usage: u64, placement: Option<Frame>) {
        let Some(known) = self.placements.get(&usage) else {
            self.placements.insert(usage, Vec::from_iter(placement));
            return;
        };
        let is_same = match (known.first(), placement) {
            (Some(known), Some(placement)) => is_one_place(known, &placement),
            (known, placement) => known.is_none() && placement.is_none(),
        };
        if !is_same {
            self.tell_other_place(by, usage);
        }
    }

    /// Tells that an entity gives a usage another place than those that count.
    fn tell_other_place(&mut self, by: u64, usage: u64) {
        self.problems.push(format!("#{by}: usage #{usage} has another place already, which is used"));
    }

    /// Tells where a usage that a higher assembly sees has another place than the usages that it is made of.
    fn compare_higher_usage(&mut self, e: Entity<'f, 'a>, relation: Entity<'f, 'a>, usage: Entity<'f, 'a>) {
        let ends = related_representations(relation).filter(|_| has_transformation(relation));
        let Some(stated) = ends.and_then(|ends| self.transformation(relation, ends)) else { return };
        let Some(composed) = self.composed_place(usage) else { return };
        if !is_one_place(&composed, &stated) && !is_one_place(&composed, &stated.inverse()) {
            self.problems.push(format!(
                "#{}: usage #{} has another place than the usages that it is made of, which are used",
                e.id, usage.id
            ));
        }
    }

    /// Returns where the usages that a higher one is made of put its component: the upper one, which may be a higher usage itself, with or
    /// without a place of its own, and the next one in it. `None` where one is missing, or they are made of each other.
    fn composed_place(&self, usage: Entity<'f, 'a>) -> Option<Frame> {
        // A usage without a placement stands where its parent does.
        let place = |id: u64| self.placements.get(&id).and_then(|p| p.first().copied()).unwrap_or(Frame::IDENTITY);
        let mut composed = Frame::IDENTITY;
        let mut outer = usage;
        for _ in 0..MAX_DEPTH {
            let Some(made_of) = outer.attributes(HIGHER_USAGE, 6) else {
                return Some(place(outer.id).compose(&composed));
            };
            composed = place(made_of.id(1)?).compose(&composed);
            outer = made_of.entity(0)?;
        }
        None
    }

    /// Reads where the children of usages stand in their parents by mapped items of the usages' own shapes, as AP214 allows: each item of
    /// the first shape is an occurrence.
    pub(super) fn read_occurrence_shapes(&mut self, shapes: &[OccurrenceShape]) {
        // Usages in their places within their parents.
        let mut known = PlaceTable::default();
        let mut listed: FxHashSet<u64> = FxHashSet::default();
        for &OccurrenceShape { usage, representation } in shapes {
            let items = self.mapped_occurrences(usage, representation);
            let Some(stated) = self.placements.get(&usage) else {
                if !items.is_empty() {
                    listed.insert(usage);
                    // An item that comes again in its place is no second one.
                    let mut frames: Vec<Frame> = items.into_iter().filter_map(|(_, placement)| placement).collect();
                    frames.retain(|frame| {
                        let is_new = !known.holds(usage, &Place::in_parent(frame));
                        if is_new {
                            known.insert(usage, Place::in_parent(frame));
                        }
                        is_new
                    });
                    self.placements.insert(usage, frames);
                }
                continue;
            };
            if listed.insert(usage) {
                stated.iter().for_each(|frame| known.insert(usage, Place::in_parent(frame)));
            }
            let is_unplaced = stated.is_empty();
            let is_new = |placement: &Option<Frame>| match placement {
                Some(placement) => !known.holds(usage, &Place::in_parent(placement)),
                None => !is_unplaced,
            };
            for (item, _) in items.iter().filter(|(_, placement)| is_new(placement)) {
                self.tell_other_place(*item, usage);
            }
        }
    }

    /// Returns the mapped items of a usage's own shape that show its child, and where each puts it in the parent; `None`, which is noted,
    /// where that cannot be read.
    fn mapped_occurrences(&mut self, usage: u64, shape: u64) -> Vec<(u64, Option<Frame>)> {
        let child = self.file.entity(usage).and_then(usage_attributes).and_then(|a| a.id(4));
        let Some(child) = child else { return Vec::new() };
        let items = self.items(shape).into_iter();
        let mut links: Vec<(u64, Link)> =
            items.filter_map(|item| Some((item, self.mapping(item, shape)?))).collect();
        if links.is_empty() {
            return Vec::new();
        }
        let of_child = self.representations(child);
        links.retain(|(_, link)| of_child.contains(&link.to));
        for (item, _) in links.iter().filter(|(_, link)| link.placement.is_none()) {
            let told = "its placement cannot be read; what this MAPPED_ITEM places is left out";
            self.problems.push(format!("#{item}: {told}"));
        }
        links.into_iter().map(|(item, link)| (item, link.placement)).collect()
    }

    /// Returns those pairs of products, of which relationships with a transformation put the first into the second, in which the first uses
    /// the second all the same, by itself or by way of others.
    pub(super) fn products_above_others(
        &self,
        relations: &[Entity<'f, 'a>],
        ends: &UsageEnds,
    ) -> FxHashSet<[u64; 2]> {
        let moving = relations.iter().filter(|e| has_transformation(**e));
        let pairs: Vec<[u64; 2]> =
            moving.filter_map(|e| self.shown_products(related_representations(*e)?)).collect();
        ends.one_way_pairs(&pairs)
    }

    /// Links the two representations of a relationship: one way by its transformation, or both ways, unmoved, if it has none. Where the
    /// product of the first uses that of the second, their ends are swapped; where it does so by way of others, which place it, as
    /// in the `conflicts`, the relationship places nothing, which is reported. Returns the link of a transformation between two products.
    pub(super) fn read_relationship(
        &mut self,
        e: Entity<'f, 'a>,
        ends: &UsageEnds,
        conflicts: &FxHashSet<[u64; 2]>,
    ) -> Option<ProductLink> {
        let [first, second] = related_representations(e)?;
        if !has_transformation(e) {
            self.links.entry(second).or_default().push(Link::plain(first));
            self.links.entry(first).or_default().push(Link::plain(second));
            return None;
        }
        let are_swapped = self.products_of([first, second]).is_some_and(|products| ends.are_swapped(products));
        let products = self.shown_products([first, second]);
        if let Some([child, parent]) = products.filter(|products| !are_swapped && conflicts.contains(products)) {
            self.problems.push(format!(
                "#{}: puts product #{child} into #{parent}, which usages put into #{child}: only these are used",
                e.id
            ));
            return None;
        }
        let mut placement = self.transformation(e, [first, second]);
        let [shown, holder] = if are_swapped { [second, first] } else { [first, second] };
        if are_swapped {
            placement = placement.map(|p| p.inverse());
        }
        self.links.entry(holder).or_default().push(Link::transformed(shown, placement));
        let [child, parent] = self.products_of([shown, holder])?;
        placement?;
        Some(ProductLink { by: e.id, parent, child, holder, shown, placement })
    }

    /// Returns what a MAPPED_ITEM of the representation `holder` shows, and where that stands there; `None` for any other item.
    pub(super) fn mapping(&self, item: u64, holder: u64) -> Option<Link> {
        let mapped = self.file.entity(item)?.attributes("MAPPED_ITEM", 1)?;
        let map = mapped.entity(0)?.attributes("REPRESENTATION_MAP", 0)?;
        let to = map.id(1)?;
        let origin = map.id(0).and_then(|origin| self.geometry_reader(to).placement(origin).ok());
        let target = mapped.id(1).and_then(|target| self.geometry_reader(holder).transformation(target).ok());
        // The origin of the mapped representation comes to lie on the target.
        let placement = target.zip(origin).map(|(target, origin)| target.compose(&origin.inverse()));
        Some(Link::transformed(to, placement))
    }
}

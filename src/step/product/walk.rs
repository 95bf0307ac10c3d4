//! The walk through an assembly: which representation stands where.
//!
//! From the products that no other uses along their usages, and inside representations along relationships and mapped items. Shapes that
//! no product reaches are placed where they are. Guarantee: the depth of an assembly costs no depth of calls, and what ends the walk
//! early is reported: a cycle, the depth of [`MAX_DEPTH`], or the number of visits.

use super::assembly::{Assembly, MAX_DEPTH, PlacedRepresentation};
use super::places::{Place, PlaceTable};
use super::purpose::{holds_mesh, purpose_besides_shape};
use super::relations::Link;
use super::usage_names::{Occurrence, Usage, UsagePlacement, name_in_path};
use crate::math::Frame;
use crate::step::geometry::FARTHEST_MM;
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// Entities around a place that are held with it for the memory that a visit may take; a place with more counts as several visits.
const OWNERS_PER_VISIT: usize = 64;

/// The state of a walk.
struct Walk<'f, 'a> {
    assembly: Assembly<'f, 'a>,
    placed: Vec<PlacedRepresentation>,
    /// Products and representations visited, and how many may be: cycles of products multiply beyond what can be counted before.
    visited: u64,
    limit: u64,
    reached: FxHashSet<u64>,
    in_orphans: bool,
    /// Entities with a problem that is already reported.
    told: FxHashSet<u64>,
    /// What products reach; orphans do not place it again.
    by_products: FxHashSet<u64>,
    /// Products and representations that are too deep to be placed.
    cut_off_products: Vec<u64>,
    cut_off_representations: Vec<u64>,
}

/// A product that is being placed, whose usages are placed one by one.
struct OpenProduct {
    definition: u64,
    placement: Frame,
    /// See [`Occurrence::path`].
    path: Option<String>,
    owners: Vec<u64>,
    /// Whether what stands in it is placed; else it is only reached.
    is_shown: bool,
    usages: Arc<[Usage]>,
    /// Children that its representations place.
    placed_within: FxHashSet<u64>,
    /// The first usage that is not placed yet.
    next: usize,
}

/// A representation that is to be placed.
struct Visit {
    representation: u64,
    place: Place,
    owners: Arc<[u64]>,
    /// The product that it shows, where a relationship leads to that of another one.
    product: Option<u64>,
    /// As [`OpenProduct::is_shown`].
    is_shown: bool,
    /// Whether a relationship leads to it.
    is_linked: bool,
}

/// A representation that is placed, and what is inside of it one by one.
struct OpenRepresentation {
    visit: Visit,
    mapped_items: Vec<u64>,
    links: Vec<Link>,
    /// The first of both that is not placed yet.
    next: usize,
}

impl Assembly<'_, '_> {
    /// Places everything, in an order that the file decides; fails, with the number of visits, when these become more than `limit`.
    pub(crate) fn walk(self, limit: u64) -> Result<(Vec<PlacedRepresentation>, Self), u64> {
        let mut walk = Walk {
            assembly: self,
            placed: Vec::new(),
            visited: 0,
            limit,
            reached: FxHashSet::default(),
            in_orphans: false,
            told: FxHashSet::default(),
            by_products: FxHashSet::default(),
            cut_off_products: Vec::new(),
            cut_off_representations: Vec::new(),
        };
        walk.place_all();
        let Walk { mut assembly, placed, visited, .. } = walk;
        if visited > limit {
            return Err(visited);
        }
        assembly.leave_out_pictures(&placed);
        Ok((placed, assembly))
    }
}

impl Walk<'_, '_> {
    fn place_all(&mut self) {
        let assembly = &self.assembly;
        let children: FxHashSet<u64> = assembly.usages.values().flat_map(|u| u.iter()).map(|u| u.child).collect();
        // Sorted by their ids: tables of hashes have no order, and two runs must number parts alike.
        let mut products: Vec<u64> = assembly.shapes.keys().chain(assembly.usages.keys()).copied().collect();
        products.sort_unstable();
        products.dedup();
        let moved = assembly.products_placed_by_others();
        // What others place and nothing reaches after all is placed below, by itself.
        let roots: Vec<u64> =
            products.iter().copied().filter(|p| !children.contains(p) && !moved.contains(p)).collect();
        for root in roots {
            self.place_product(root);
        }
        // Products in a cycle, and shapes without a product.
        for product in products {
            let is_unseen = |shapes: &Vec<u64>| !shapes.iter().any(|r| self.reached.contains(r));
            if self.assembly.shapes.get(&product).is_some_and(is_unseen) {
                self.place_product(product);
            }
        }
        self.place_orphans();
    }

    /// Places representations that no product reaches and no item maps, except those of aspects, which are listed in `left_out`.
    fn place_orphans(&mut self) {
        self.in_orphans = true;
        // From here on what products reach is closed: an orphan that leads to it would show it twice.
        self.by_products = self.reached.clone();
        let file = self.assembly.file;
        for id in self.assembly.orphans(&self.reached) {
            // One that was placed before may have led here.
            if self.reached.contains(&id) {
                continue;
            }
            // A ready mesh is named by its aspect alone.
            let aspect = self.assembly.aspects.get(&id).copied();
            if let Some(aspect) = aspect.filter(|_| !holds_mesh(file, &self.assembly.items(id))) {
                let what = format!("#{aspect} {}", file.entity_name(aspect));
                let reason = format!("describes {what}, which is no product: its shape is named by its product");
                self.assembly.left_out.push((id, reason));
            } else {
                let nowhere = PlaceTable::default();
                self.place_representations(&[id], Frame::IDENTITY, &Occurrence::ROOT, true, &nowhere);
                self.reach_what_is_cut_off();
            }
        }
        for (id, map) in self.assembly.unshown_maps(&self.reached) {
            let reason =
                format!("is what #{map} REPRESENTATION_MAP shows, but no mapped item that has a place shows it");
            self.assembly.left_out.push((id, reason));
        }
    }

    /// Adds a problem, once of each entity.
    fn tell(&mut self, id: u64, what: String) {
        if self.told.insert(id) {
            self.assembly.problems.push(format!("#{id}: {what}"));
        }
    }

    /// Counts a visit with so many entities around it, and returns whether there may be one; beyond the limit none is counted any more.
    fn is_within_limit(&mut self, owners: usize) -> bool {
        if !self.is_exhausted() {
            self.visited += 1 + (owners / OWNERS_PER_VISIT) as u64;
        }
        !self.is_exhausted()
    }

    /// Whether the limit of visits is passed: what is still open is given up.
    fn is_exhausted(&self) -> bool {
        self.visited > self.limit
    }

    /// Places a product that nothing uses at the origin, with all that it uses.
    fn place_product(&mut self, root: u64) {
        let mut open: Vec<OpenProduct> = Vec::new();
        open.extend(self.open_product(root, Frame::IDENTITY, &Occurrence::ROOT, true, &[]));
        while let Some(product) = open.last_mut().filter(|_| !self.is_exhausted()) {
            let usages = product.usages.clone();
            let k = product.next;
            product.next += 1;
            let Some(usage) = usages.get(k) else {
                open.pop();
                continue;
            };
            let local = match usage.placement {
                // A mapped item or a relationship places it already; at the parent's origin it would stand once more.
                UsagePlacement::Unstated if product.placed_within.contains(&usage.child) => continue,
                UsagePlacement::Unstated | UsagePlacement::Unreadable => Frame::IDENTITY,
                UsagePlacement::Stated(local) => local,
            };
            let placement = product.placement.compose(&local);
            // Walked all the same, but not shown: else it would come back as a shape that no product reaches.
            let is_shown = product.is_shown && usage.placement != UsagePlacement::Unreadable;
            let child = self.assembly.products.name(self.assembly.file, usage.child);
            let name = name_in_path(usage, &child);
            let outer = product.path.as_deref();
            let path = outer.map_or_else(|| name.to_owned(), |outer| format!("{outer}/{name}"));
            let owners = [&product.owners[..], &[usage.id]].concat();
            let used = Occurrence { name: &usage.name, path: Some(&path), product: "", owners: &owners };
            let inner = self.open_product(usage.child, placement, &used, is_shown, &open);
            open.extend(inner);
        }
        self.reach_what_is_cut_off();
    }

    /// Places the representations of a product; `around` holds the products around it. Returns it with its usages, which are yet to be
    /// placed; `None` where the walk ends.
    fn open_product(
        &mut self,
        definition: u64,
        placement: Frame,
        used: &Occurrence<'_>,
        is_shown: bool,
        around: &[OpenProduct],
    ) -> Option<OpenProduct> {
        if !self.is_within_limit(used.owners.len()) {
            return None;
        }
        if around.iter().any(|outer| outer.definition == definition) {
            self.tell(definition, "products contain each other".into());
            return None;
        }
        if around.len() >= MAX_DEPTH {
            let what =
                format!("products are nested more than {MAX_DEPTH} deep: this one and what it holds are left out");
            self.tell(definition, what);
            self.cut_off_products.push(definition);
            return None;
        }
        let product = self.assembly.products.name(self.assembly.file, definition);
        let shown = Occurrence { product: &product, ..*used };
        let usages = self.assembly.usages.get(&definition).cloned().unwrap_or_default();
        let placed_within = self.assembly.placed_within(definition, &usages);
        if let Some(shapes) = self.assembly.shapes.get(&definition).cloned() {
            let by_usages = self.assembly.usage_places(&usages, &Place::of_parent(placement), &placed_within);
            self.place_representations(&shapes, placement, &shown, is_shown, &by_usages);
        }
        Some(OpenProduct {
            definition,
            placement,
            path: used.path.map(str::to_owned),
            owners: used.owners.to_vec(),
            is_shown,
            usages,
            placed_within,
            next: 0,
        })
    }

    /// Places the shapes of representations and, by their relations and mapped items, of others, but what stands in `by_usages`. What
    /// several ways of relationships lead to in one place stands there once.
    fn place_representations(
        &mut self,
        representations: &[u64],
        placement: Frame,
        used: &Occurrence<'_>,
        is_shown: bool,
        by_usages: &PlaceTable,
    ) {
        let mut standing = PlaceTable::default();
        let mut open: Vec<OpenRepresentation> = Vec::new();
        for &representation in representations {
            let owners = used.owners.into();
            let place = Place::of_parent(placement);
            let first = Visit { representation, place, owners, product: None, is_shown, is_linked: false };
            let mut visit = Some(first);
            loop {
                if let Some(visit) = visit.take() {
                    let is_repeated = visit.is_linked && standing.holds(visit.representation, &visit.place);
                    if !is_repeated && self.place_representation(&visit, used, &open) {
                        if visit.is_shown {
                            standing.insert(visit.representation, visit.place);
                        }
                        open.push(self.open_representation(visit));
                    }
                }
                let Some(outer) = open.last_mut().filter(|_| !self.is_exhausted()) else { break };
                let k = outer.next;
                outer.next += 1;
                let inner = if let Some(item) = outer.mapped_items.get(k) {
                    self.mapped_visit(&outer.visit, *item)
                } else if let Some(link) = outer.links.get(k - outer.mapped_items.len()) {
                    self.linked_visit(&outer.visit, link)
                } else {
                    open.pop();
                    continue;
                };
                visit = inner.filter(|v| !by_usages.holds(v.representation, &v.place));
            }
        }
    }

    /// Places a representation by itself; `around` holds those around it. Whether it stands, so that what is inside of it is to be placed.
    fn place_representation(
        &mut self,
        visit: &Visit,
        used: &Occurrence<'_>,
        around: &[OpenRepresentation],
    ) -> bool {
        let id = visit.representation;
        // A few lines can name a million instances: the limit is on visits, not on depth alone.
        if !self.is_within_limit(visit.owners.len()) || self.by_products.contains(&id) {
            return false;
        }
        if around.iter().any(|outer| outer.visit.representation == id) {
            // Relationships are met from both ends: one that leads back leaves nothing out.
            if let Some(item) = visit.owners.last().filter(|_| !visit.is_linked) {
                self.tell(*item, format!("this MAPPED_ITEM shows #{id} in itself; that is left out"));
            }
            return false;
        }
        if around.len() >= MAX_DEPTH {
            let what = format!(
                "representations are nested more than {MAX_DEPTH} deep: this one and what it holds are left out"
            );
            self.tell(id, what);
            self.cut_off_representations.push(id);
            return false;
        }
        if !(visit.place.frame.origin.abs().max_element() <= FARTHEST_MM) {
            if self.reached.insert(id) {
                self.assembly.problems.push(format!(
                    "#{id}: stands beyond {FARTHEST_MM:e} mm, too far out for double precision to hold a shape; it is left out"
                ));
            }
            return false;
        }
        if let Some(purpose) = purpose_besides_shape(self.assembly.file, id) {
            if self.reached.insert(id) {
                self.assembly.left_out.push((id, purpose.into()));
            }
            return false;
        }
        if self.reached.insert(id) && self.assembly.item_list(id).is_some_and(|list| list.refs().is_none()) {
            self.tell(id, "an entry of its list of items is no reference; it is left out".into());
        }
        if visit.is_shown {
            let file = self.assembly.file;
            let linked = visit.product.map(|product| self.assembly.products.name(file, product));
            let linked = linked.filter(|name| !name.is_empty());
            self.placed.push(PlacedRepresentation {
                representation: id,
                placement: visit.place.frame,
                rounding: visit.place.rounding,
                name: used.name.to_string(),
                path: used.path.map_or_else(String::new, str::to_owned),
                product: linked.as_deref().unwrap_or(used.product).to_string(),
                owners: visit.owners.to_vec(),
                orphan: self.in_orphans,
            });
        }
        true
    }

    /// Returns a placed representation with what is inside of it, which is yet to be placed.
    fn open_representation(&self, visit: Visit) -> OpenRepresentation {
        let mut mapped_items = self.assembly.items(visit.representation);
        mapped_items.retain(|item| self.assembly.mapped_representation(*item).is_some());
        let links = self.assembly.links.get(&visit.representation).cloned().unwrap_or_default();
        OpenRepresentation { visit, mapped_items, links, next: 0 }
    }

    /// Returns the visit of what a mapped item of a placed representation shows; `None`, which is reported, where its place cannot be read.
    fn mapped_visit(&mut self, outer: &Visit, item: u64) -> Option<Visit> {
        let link = self.assembly.mapping(item, outer.representation)?;
        let Some(local) = link.placement else {
            self.tell(item, "its placement cannot be read; what this MAPPED_ITEM shows is left out".into());
            return None;
        };
        let owners = [&outer.owners[..], &[item]].concat().into();
        let place = outer.place.inner(&local);
        Some(Visit { representation: link.to, place, owners, is_linked: false, ..*outer })
    }

    /// Returns the visit of what a relationship of a placed representation leads to; one whose place cannot be read is reached, but not
    /// shown.
    fn linked_visit(&self, outer: &Visit, link: &Link) -> Option<Visit> {
        // One of another product whose place cannot be read is placed by its own usage.
        if link.placement.is_none() && self.assembly.owned.contains_key(&link.to) {
            return None;
        }
        let place = outer.place.inner(&link.placement.unwrap_or(Frame::IDENTITY));
        let is_shown = outer.is_shown && link.placement.is_some();
        let product = self.assembly.products_of([outer.representation, link.to]).map(|[_, child]| child);
        let product = product.or(outer.product);
        let owners = outer.owners.clone();
        Some(Visit { representation: link.to, place, owners, product, is_shown, is_linked: true })
    }

    /// Notes that what is too deep is reached, with all that it holds: it would come back as a product or a shape that nothing uses.
    fn reach_what_is_cut_off(&mut self) {
        let products = std::mem::take(&mut self.cut_off_products);
        let representations = std::mem::take(&mut self.cut_off_representations);
        let held = self.assembly.held_representations(products, representations, &self.reached);
        self.reached.extend(held);
    }
}

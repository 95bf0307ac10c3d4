//! Products, occurrences and representations: which representation stands where.
//!
//! Walks from the products that no other uses along NEXT_ASSEMBLY_USAGE_OCCURRENCEs and CONTEXT_DEPENDENT_SHAPE_REPRESENTATIONs,
//! and inside representations along relationships and MAPPED_ITEMs. Shapes that no product reaches are placed where they are.

use super::purpose::{holds_mesh, is_shape_representation, purpose_besides_shape};
use super::relations::{
    Link, RELATIONS, WITH_TRANSFORMATION, property_attributes, related_representations,
    shape_definition_attributes, usage_attributes,
};
use super::usage_names::{Occurrence, ProductNames, Usage, name_in_path, name_usages};
use crate::math::Frame;
use crate::step::geometry::units::Units;
use crate::step::geometry::{FARTHEST_MM, GeometryReader};
use crate::step::part21::{Args, Entity, File};
use rustc_hash::{FxHashMap, FxHashSet};

/// Deepest nesting of assemblies.
const MAX_DEPTH: usize = 64;

/// A representation where it stands.
#[derive(Clone, Debug)]
pub(crate) struct PlacedRepresentation {
    pub(crate) representation: u64,
    pub(crate) placement: Frame,
    /// Name of the occurrence, empty when it had none.
    pub(crate) name: String,
    /// Names of the occurrences from the outermost down to its own, joined by `/`; of those without a name that of their product.
    pub(crate) path: String,
    /// Name of the product, empty when it had none.
    pub(crate) product: String,
    /// Entities that may carry a style for this occurrence.
    pub(crate) owners: Vec<u64>,
    /// Whether no product leads here: shapes that stand elsewhere already are not meant again.
    pub(crate) orphan: bool,
}

/// The structure of a file, and the state of the walk through it.
pub(crate) struct Assembly<'f, 'a> {
    pub(super) file: &'f File<'a>,
    /// Units by context.
    units: FxHashMap<u64, Units>,
    fallback: Units,
    /// Product definition → its representations.
    pub(super) shapes: FxHashMap<u64, Vec<u64>>,
    /// Representations that stand for a product.
    pub(super) owned: FxHashSet<u64>,
    pub(super) usages: FxHashMap<u64, Vec<Usage>>,
    products: ProductNames,
    /// Usage → placement of the child in the parent; `None` where that cannot be read.
    pub(super) placements: FxHashMap<u64, Option<Frame>>,
    pub(super) links: FxHashMap<u64, Vec<Link>>,
    /// Representations that are not the shape of a product, and what they are.
    pub(crate) left_out: Vec<(u64, String)>,
    /// Things that could not be placed.
    pub(crate) problems: Vec<String>,
    placed: Vec<PlacedRepresentation>,
    /// Products and representations visited, and how many may be: cycles of products multiply beyond what can be counted before.
    visited: u64,
    limit: u64,
    reached: FxHashSet<u64>,
    in_orphans: bool,
    /// Products that were found to contain themselves.
    cyclic: FxHashSet<u64>,
    /// Representations of what is no product (shape aspects, datums, …), and the entity that they describe.
    aspects: FxHashMap<u64, u64>,
    /// What products reach; orphans do not place it again.
    by_products: FxHashSet<u64>,
}

impl<'f, 'a> Assembly<'f, 'a> {
    /// Reads products, usages and relationships; places nothing yet. `fallback` are the units of representations without a context.
    pub(crate) fn read(file: &'f File<'a>, units: FxHashMap<u64, Units>, fallback: Units) -> Self {
        let mut a = Self {
            file,
            units,
            fallback,
            shapes: FxHashMap::default(),
            owned: FxHashSet::default(),
            usages: FxHashMap::default(),
            products: ProductNames::default(),
            placements: FxHashMap::default(),
            links: FxHashMap::default(),
            left_out: Vec::new(),
            problems: Vec::new(),
            placed: Vec::new(),
            visited: 0,
            limit: 0,
            reached: FxHashSet::default(),
            in_orphans: false,
            cyclic: FxHashSet::default(),
            aspects: FxHashMap::default(),
            by_products: FxHashSet::default(),
        };
        // Read last: both kinds of relations point to shapes and usages that may stand anywhere in the file.
        let mut contextual = Vec::new();
        let mut relations = Vec::new();
        for e in file.entities_named(&RELATIONS) {
            if let Some(args) = shape_definition_attributes(e) {
                a.read_shape_definition(args.entity(0), args.id(1));
            } else if let Some(args) = usage_attributes(e) {
                if let (Some(parent), Some(child)) = (args.id(3), args.id(4)) {
                    a.usages.entry(parent).or_default().push(Usage { child, name: String::new(), id: e.id });
                }
            } else if e.is_a("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION") {
                contextual.push(e);
            } else {
                relations.push(e);
            }
        }
        a.usages.values_mut().for_each(|usages| name_usages(file, &mut a.products, usages));
        let mut used = FxHashSet::default();
        for e in contextual {
            a.read_contextual(e, &mut used);
        }
        for e in relations {
            if !used.contains(&e.id) {
                a.read_relationship(e);
            }
        }
        a.leave_out_links_to_products();
        a
    }

    /// Returns the units of a representation's context; `fallback` where it names none or one that assigns none.
    pub(crate) fn units_of(&self, representation: u64) -> Units {
        let context = self
            .file
            .entity(representation)
            .and_then(|e| e.attributes("REPRESENTATION", 0).and_then(|a| a.id(2)).or_else(|| e.args().id(2)));
        context.and_then(|c| self.units.get(&c)).copied().unwrap_or(self.fallback)
    }

    /// Returns a reader of geometry in the units of a representation.
    fn geometry_reader(&self, representation: u64) -> GeometryReader<'f, 'a> {
        GeometryReader { file: self.file, units: self.units_of(representation) }
    }

    /// Returns the ids of the items of a representation; empty when the file does not have it.
    pub(crate) fn items(&self, representation: u64) -> Vec<u64> {
        self.item_list(representation).map_or_else(Vec::new, |list| list.ids())
    }

    /// Whether an item is one of a representation's.
    fn is_item(&self, id: u64, representation: u64) -> bool {
        self.item_list(representation).is_some_and(|list| (0..list.len()).any(|i| list.id(i) == Some(id)))
    }

    fn item_list(&self, representation: u64) -> Option<Args<'f, 'a>> {
        let e = self.file.entity(representation)?;
        Some(e.attributes("REPRESENTATION", 0).unwrap_or_else(|| e.args()).list(1))
    }

    /// Notes which product a representation shows, or which aspect of one; nothing where either is missing.
    fn read_shape_definition(&mut self, definition: Option<Entity<'f, 'a>>, representation: Option<u64>) {
        let (Some(definition), Some(representation)) = (definition, representation) else { return };
        // PRODUCT_DEFINITION_SHAPE of a product definition; those of usages and shape aspects place nothing.
        let target = property_attributes(definition).entity(2);
        let Some(target) = target else { return };
        // Shapes of usages are placed by them. A complex one is a relationship of product definitions by name.
        if target.keywords().any(|k| k.contains("USAGE")) {
            return;
        }
        if !target.keywords().any(|k| k.starts_with("PRODUCT_DEFINITION")) {
            // The geometry of an aspect is a part of its product's, named once more.
            self.aspects.insert(representation, target.id);
            return;
        }
        let shapes = self.shapes.entry(target.id).or_default();
        if !shapes.contains(&representation) {
            shapes.push(representation);
        }
        self.owned.insert(representation);
    }

    /// Returns how the first of two representations stands in the second by the transformation of their relationship; `None`, which is
    /// reported, where that cannot be read.
    fn transformation(&mut self, e: Entity<'f, 'a>, [first, second]: [u64; 2]) -> Option<Frame> {
        let stated = e.attributes(WITH_TRANSFORMATION, 4).and_then(|a| a.entity(0));
        let placement = stated.and_then(|t| {
            // An operator takes the first representation into the second by itself (ISO 10303-43, functionally_defined_transformation).
            if t.keywords().any(|k| k.starts_with("CARTESIAN_TRANSFORMATION_OPERATOR")) {
                return self.geometry_reader(second).transformation(t.id).ok();
            }
            let args = t.attributes("ITEM_DEFINED_TRANSFORMATION", 0)?;
            let (from, to) = (args.id(2)?, args.id(3)?);
            // Each placement is in the units of the representation that holds it.
            let (mut holder_from, mut holder_to) = (first, second);
            if self.is_item(to, first) && self.is_item(from, second) {
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

    /// Reads where the child of a usage stands in the parent, by a CONTEXT_DEPENDENT_SHAPE_REPRESENTATION; its relation goes into `used`.
    fn read_contextual(&mut self, e: Entity<'f, 'a>, used: &mut FxHashSet<u64>) {
        let args = e.args();
        let (Some(relation), Some(shape)) = (args.entity(0), args.entity(1)) else {
            self.problems
                .push(format!("#{}: its relationship or its usage is not in the file: it places nothing", e.id));
            return;
        };
        used.insert(relation.id);
        let Some(usage) = property_attributes(shape).id(2) else { return };
        let Some([first, second]) = related_representations(relation) else { return };
        if !relation.is_a(WITH_TRANSFORMATION) {
            return;
        }
        let mut placement = self.transformation(relation, [first, second]);
        // The first representation is the child's; some writers swap them.
        let ends = self.file.entity(usage).and_then(usage_attributes);
        if let Some((parent, child)) = ends.and_then(|a| Some((a.id(3)?, a.id(4)?))) {
            let has = |product: u64, r: u64| self.shapes.get(&product).is_some_and(|s| s.contains(&r));
            if has(parent, first) && has(child, second) && !has(child, first) {
                placement = placement.map(|p| p.inverse());
            }
        }
        if *self.placements.entry(usage).or_insert(placement) != placement {
            self.problems.push(format!("#{}: usage #{usage} has another place already, which counts alone", e.id));
        }
    }

    /// Links the two representations of a relationship: one way by its transformation, or both ways, unmoved, if it has none.
    fn read_relationship(&mut self, e: Entity<'f, 'a>) {
        let Some([first, second]) = related_representations(e) else { return };
        let moved = e.is_a(WITH_TRANSFORMATION);
        let placement = if moved { self.transformation(e, [first, second]) } else { Some(Frame::IDENTITY) };
        self.links.entry(second).or_default().push(Link { to: first, placement });
        if !moved {
            self.links.entry(first).or_default().push(Link { to: second, placement });
        }
    }

    /// Places everything, in an order that the file decides; fails, with the number of visits, when these become more than `limit`.
    pub(crate) fn walk(mut self, limit: u64) -> Result<(Vec<PlacedRepresentation>, Self), u64> {
        self.limit = limit;
        let children: FxHashSet<u64> = self.usages.values().flatten().map(|u| u.child).collect();
        // Sorted by their ids: tables of hashes have no order, and two runs must number parts alike.
        let mut products: Vec<u64> = self.shapes.keys().chain(self.usages.keys()).copied().collect();
        products.sort_unstable();
        products.dedup();
        let moved = self.products_placed_by_others();
        // What others place and nothing reaches after all is placed below, by itself.
        let roots: Vec<u64> =
            products.iter().copied().filter(|p| !children.contains(p) && !moved.contains(p)).collect();
        for root in roots {
            self.place_product(root, Frame::IDENTITY, &Occurrence::ROOT, &mut Vec::new());
        }
        // Products in a cycle, and shapes without a product.
        for product in products {
            let seen = self.shapes.get(&product).is_some_and(|s| s.iter().any(|r| self.reached.contains(r)));
            if !seen && self.shapes.contains_key(&product) {
                self.place_product(product, Frame::IDENTITY, &Occurrence::ROOT, &mut Vec::new());
            }
        }
        self.place_orphans();
        if self.visited > limit { Err(self.visited) } else { Ok((std::mem::take(&mut self.placed), self)) }
    }

    /// Places representations that no product reaches and no item maps, except those of aspects, which are listed in `left_out`.
    fn place_orphans(&mut self) {
        self.in_orphans = true;
        // From here on what products reach is closed: an orphan that leads to it would show it twice.
        self.by_products = self.reached.clone();
        let candidates: Vec<u64> = self.file.entities_of_kind(is_shape_representation).map(|e| e.id).collect();
        let maps = self.file.entities_named(&["REPRESENTATION_MAP"]);
        let mapped: FxHashSet<u64> = maps.filter_map(|e| e.attributes("REPRESENTATION_MAP", 0)?.id(1)).collect();
        for id in candidates {
            if self.reached.contains(&id) || mapped.contains(&id) {
                continue;
            }
            // A ready mesh is named by its aspect alone.
            if let Some(aspect) = self.aspects.get(&id).filter(|_| !holds_mesh(self.file, &self.items(id))) {
                let what = format!("#{aspect} {}", self.file.entity_name(*aspect));
                self.left_out.push((
                    id,
                    format!("describes {what}, which is no product: its shape is named by its product"),
                ));
            } else {
                self.place_representation(id, Frame::IDENTITY, &Occurrence::ROOT, &mut Vec::new());
            }
        }
    }

    /// Places a product with its representations and its children; `around` holds the products around it.
    fn place_product(&mut self, definition: u64, placement: Frame, used: &Occurrence<'_>, around: &mut Vec<u64>) {
        self.visited += 1;
        if self.visited > self.limit {
            return;
        }
        if around.len() >= MAX_DEPTH || around.contains(&definition) {
            if self.cyclic.insert(definition) {
                self.problems.push(format!("#{definition}: products contain each other"));
            }
            return;
        }
        around.push(definition);
        let product = self.products.name(self.file, definition);
        let shown = Occurrence { product: &product, ..*used };
        for representation in self.shapes.get(&definition).cloned().into_iter().flatten() {
            self.place_representation(representation, placement, &shown, &mut Vec::new());
        }
        // Taken out while its children are placed; nothing asks for it meanwhile, for `around` stops a product inside itself.
        if let Some(usages) = self.usages.remove(&definition) {
            let placed_within = self.placed_within(definition, &usages);
            for usage in &usages {
                // A mapped item or a relationship places it already; at the parent's origin it would stand once more.
                if !self.placements.contains_key(&usage.id) && placed_within.contains(&usage.child) {
                    continue;
                }
                // Without a placement of its own the child stands where the parent does.
                let local = self.placements.get(&usage.id).copied().unwrap_or(Some(Frame::IDENTITY));
                let (kept, at) = (self.placed.len(), placement.compose(&local.unwrap_or(Frame::IDENTITY)));
                let child = self.products.name(self.file, usage.child);
                let name = name_in_path(usage, &child);
                let path = used.path.map_or_else(|| name.to_owned(), |outer| format!("{outer}/{name}"));
                let owners = [used.owners, &[usage.id]].concat();
                let inner = Occurrence { name: &usage.name, path: Some(&path), product: "", owners: &owners };
                self.place_product(usage.child, at, &inner, around);
                // Walked all the same, then left out: else it would come back as a shape that no product reaches.
                self.placed.truncate(if local.is_some() { self.placed.len() } else { kept });
            }
            self.usages.insert(definition, usages);
        }
        around.pop();
    }

    /// Places the shapes of a representation and, by its relations and mapped items, of others; `around` holds those around it.
    fn place_representation(&mut self, id: u64, placement: Frame, used: &Occurrence<'_>, around: &mut Vec<u64>) {
        self.visited += 1;
        // A few lines can name a million instances: the limit is on visits, not on depth alone.
        let exhausted = self.visited > self.limit || around.len() >= MAX_DEPTH;
        if exhausted || around.contains(&id) || self.by_products.contains(&id) {
            return;
        }
        if !(placement.origin.abs().max_element() <= FARTHEST_MM) {
            if self.reached.insert(id) {
                self.problems.push(format!(
                    "#{id}: stands beyond {FARTHEST_MM:e} mm, too far out for double precision to hold a shape; it is left out"
                ));
            }
            return;
        }
        if let Some(purpose) = purpose_besides_shape(self.file, id) {
            if self.reached.insert(id) {
                self.left_out.push((id, purpose.into()));
            }
            return;
        }
        around.push(id);
        if self.reached.insert(id) && self.item_list(id).is_some_and(|list| list.refs().is_none()) {
            self.problems.push(format!("#{id}: an entry of its list of items is no reference; it is left out"));
        }
        self.placed.push(PlacedRepresentation {
            representation: id,
            placement,
            name: used.name.to_string(),
            path: used.path.map_or_else(String::new, str::to_owned),
            product: used.product.to_string(),
            owners: used.owners.to_vec(),
            orphan: self.in_orphans,
        });
        let geometry = self.geometry_reader(id);
        for item in self.items(id) {
            let Some(mapped) = self.file.entity(item).and_then(|e| e.attributes("MAPPED_ITEM", 1)) else {
                continue;
            };
            let Some(map) = mapped.entity(0).and_then(|m| m.attributes("REPRESENTATION_MAP", 0)) else { continue };
            let (Some(origin), Some(to), Some(target)) = (map.id(0), map.id(1), mapped.id(1)) else { continue };
            let origin = self.geometry_reader(to).placement(origin);
            let target = geometry.transformation(target);
            let (Ok(origin), Ok(target)) = (origin, target) else {
                self.problems.push(format!("#{item} MAPPED_ITEM: its placement cannot be read"));
                continue;
            };
            let owners = [used.owners, &[item]].concat();
            // The origin of the mapped representation comes to lie on the target.
            let at = placement.compose(&target.compose(&origin.inverse()));
            self.place_representation(to, at, &Occurrence { owners: &owners, ..*used }, around);
        }
        for link in self.links.get(&id).cloned().into_iter().flatten() {
            // One of another product whose place cannot be read is placed by its own usage.
            if !around.contains(&link.to) && (link.placement.is_some() || !self.owned.contains(&link.to)) {
                let (kept, at) = (self.placed.len(), placement.compose(&link.placement.unwrap_or(Frame::IDENTITY)));
                self.place_representation(link.to, at, used, around);
                // As for usages.
                self.placed.truncate(if link.placement.is_some() { self.placed.len() } else { kept });
            }
        }
        around.pop();
    }
}

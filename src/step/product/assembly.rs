//! Products, usages and representations: the structure of a file, from which a walk finds which representation stands where.
//!
//! Source: ISO 10303-43, -44 and -41: usages of products, and the relationships of their representations.

use super::relations::{
    Link, OccurrenceShape, RELATIONS, is_higher_usage, property_attributes, shape_definition_attributes,
    usage_attributes,
};
use super::usage_ends::UsageEnds;
use super::usage_names::{ProductNames, Usage};
use crate::math::Frame;
use crate::step::geometry::GeometryReader;
use crate::step::geometry::units::Units;
use crate::step::part21::{Args, Entity, File};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Deepest nesting of products, and of representations, that is followed: each place holds the names and ids of all that is around it,
/// which at this depth are some kilobytes.
pub(super) const MAX_DEPTH: usize = 1024;

/// A representation where it stands.
#[derive(Clone, Debug)]
pub(crate) struct PlacedRepresentation {
    pub(crate) representation: u64,
    pub(crate) placement: Frame,
    /// How far the same place may lie off it, mm: see [`Place`](super::places::Place).
    pub(super) rounding: f64,
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

/// The structure of a file.
pub(crate) struct Assembly<'f, 'a> {
    pub(super) file: &'f File<'a>,
    /// Units by context.
    units: FxHashMap<u64, Units>,
    fallback: Units,
    /// Product definition → its representations.
    pub(super) shapes: FxHashMap<u64, Vec<u64>>,
    /// Representations that stand for a product, and for which; `None` for several.
    pub(super) owned: FxHashMap<u64, Option<u64>>,
    /// Representations of no product that are related, unmoved, to those of one product alone.
    pub(super) related: FxHashMap<u64, u64>,
    /// Product definition → its children.
    pub(super) usages: FxHashMap<u64, Arc<[Usage]>>,
    pub(super) products: ProductNames,
    /// Usage → placements of the child in the parent, of which a mapped item each may state several; empty where none can be read. They
    /// pass to [`Assembly::usages`] when all are known.
    pub(super) placements: FxHashMap<u64, Vec<Frame>>,
    pub(super) links: FxHashMap<u64, Vec<Link>>,
    /// Representations, or some of their items, that are not the shape of a product, and what they are.
    pub(crate) left_out: Vec<(u64, String)>,
    /// Things that could not be placed, by their ids.
    pub(crate) problems: Vec<String>,
    /// Representations of what is no product (shape aspects, datums, …), and the entity that they describe.
    pub(super) aspects: FxHashMap<u64, u64>,
    /// Tessellated items with pictures of what stands exact, and what is read instead.
    pub(super) read_instead: FxHashMap<u64, Vec<u64>>,
}

impl<'f, 'a> Assembly<'f, 'a> {
    /// Reads products, usages and relationships; places nothing yet. `fallback` are the units of representations without a context.
    pub(crate) fn read(file: &'f File<'a>, units: FxHashMap<u64, Units>, fallback: Units) -> Self {
        let mut a = Self {
            file,
            units,
            fallback,
            shapes: FxHashMap::default(),
            owned: FxHashMap::default(),
            related: FxHashMap::default(),
            usages: FxHashMap::default(),
            products: ProductNames::default(),
            placements: FxHashMap::default(),
            links: FxHashMap::default(),
            left_out: Vec::new(),
            problems: Vec::new(),
            aspects: FxHashMap::default(),
            read_instead: FxHashMap::default(),
        };
        // Read last: what relates shapes and usages points to some that may stand anywhere in the file.
        let mut occurrence_shapes = Vec::new();
        let mut usages = Vec::new();
        let mut contextual = Vec::new();
        let mut relations = Vec::new();
        for e in file.entities_named(&RELATIONS) {
            if let Some(args) = shape_definition_attributes(e) {
                occurrence_shapes.extend(a.read_shape_definition(args.entity(0), args.id(1)));
            } else if usage_attributes(e).is_some() {
                usages.push(e);
            } else if e.is_a("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION") {
                contextual.push(e);
            } else if !is_higher_usage(e) {
                relations.push(e);
            }
        }
        let usages = Self::read_usages(&usages);
        let ends = UsageEnds::new(&usages);
        a.read_related_shapes(&relations, &contextual);
        let places = a.read_contextual(&contextual, &ends);
        relations.retain(|e| !places.relations.contains(&e.id));
        let conflicts = a.products_above_others(&relations, &ends);
        let mut related = Vec::new();
        for e in relations {
            related.extend(a.read_relationship(e, &ends, &conflicts));
        }
        a.leave_out_links_to_products(&ends);
        a.read_occurrence_shapes(&occurrence_shapes);
        a.settle_usages(usages, places.lost, related);
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
    pub(super) fn geometry_reader(&self, representation: u64) -> GeometryReader<'f, 'a> {
        GeometryReader { file: self.file, units: self.units_of(representation) }
    }

    /// Returns the products that two representations stand for; `None` where one stands for none or several, or both for the same.
    pub(super) fn products_of(&self, representations: [u64; 2]) -> Option<[u64; 2]> {
        let [first, second] = representations.map(|r| self.owned.get(&r).copied().flatten());
        Some([first?, second?]).filter(|[first, second]| first != second)
    }

    /// Returns the product that a representation shows, be it one that is related to that of the product; `None` for none or several.
    pub(super) fn shown_product(&self, representation: u64) -> Option<u64> {
        self.owned.get(&representation).copied().unwrap_or_else(|| self.related.get(&representation).copied())
    }

    /// Returns the products that two representations show, as [`Self::shown_product`]; `None` where one shows none or several, or both the
    /// same.
    pub(super) fn shown_products(&self, [first, second]: [u64; 2]) -> Option<[u64; 2]> {
        let products = [self.shown_product(first)?, self.shown_product(second)?];
        Some(products).filter(|[first, second]| first != second)
    }

    /// Returns the ids of the items of a representation; empty when the file does not have it.
    pub(crate) fn items(&self, representation: u64) -> Vec<u64> {
        self.item_list(representation).map_or_else(Vec::new, |list| list.ids())
    }

    /// Whether an item is one of a representation's.
    pub(super) fn is_item(&self, id: u64, representation: u64) -> bool {
        self.item_list(representation).is_some_and(|list| (0..list.len()).any(|i| list.id(i) == Some(id)))
    }

    pub(super) fn item_list(&self, representation: u64) -> Option<Args<'f, 'a>> {
        let e = self.file.entity(representation)?;
        Some(e.attributes("REPRESENTATION", 0).unwrap_or_else(|| e.args()).list(1))
    }

    /// Notes which product a representation shows, or which aspect of one; nothing where either is missing. Returns that of a usage.
    fn read_shape_definition(
        &mut self,
        definition: Option<Entity<'f, 'a>>,
        representation: Option<u64>,
    ) -> Option<OccurrenceShape> {
        let representation = representation?;
        let target = property_attributes(definition?).entity(2)?;
        // A complex usage is a relationship of product definitions by name.
        if target.keywords().any(|k| k.contains("USAGE")) {
            return Some(OccurrenceShape { usage: target.id, representation });
        }
        if !target.keywords().any(|k| k.starts_with("PRODUCT_DEFINITION")) {
            // The geometry of an aspect is a part of its product's, named once more.
            self.aspects.insert(representation, target.id);
            return None;
        }
        let shapes = self.shapes.entry(target.id).or_default();
        if !shapes.contains(&representation) {
            shapes.push(representation);
        }
        let owner = self.owned.entry(representation).or_insert(Some(target.id));
        *owner = owner.filter(|owner| *owner == target.id);
        None
    }
}

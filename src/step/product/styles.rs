//! Colours and layers: STYLED_ITEM, OVER_RIDING_STYLED_ITEM and CONTEXT_DEPENDENT_OVER_RIDING_STYLED_ITEM down to a COLOUR_RGB, and
//! PRESENTATION_LAYER_ASSIGNMENT.

use super::purpose::is_shape_representation;
use super::relations::{
    has_transformation, property_attributes, related_representations, shape_definition_attributes, usage_attributes,
};
use crate::model::Colour;
use crate::step::part21::{Entity, File};
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::Arc;

/// Most entities looked at for one style.
const MAX_STEPS: usize = 64;

/// Colours and layers by the item that has them.
#[derive(Debug, Default)]
pub(crate) struct Styles {
    colours: FxHashMap<u64, Colour>,
    layers: FxHashMap<u64, Arc<str>>,
    /// Items that one occurrence or more shows in another colour than the rest.
    overridden: FxHashSet<u64>,
    /// Colours of occurrences, by the innermost usage of the path that each is limited to.
    occurrences: FxHashMap<u64, Vec<OccurrenceColour>>,
}

/// The colour of what stands below a path of usages.
#[derive(Debug)]
struct OccurrenceColour {
    /// All of these are around it, in any order.
    path: Vec<u64>,
    colour: Colour,
}

impl Styles {
    /// Collects the surface colours and layers that a file gives to items; overriding styles win over plain ones. A colour that holds for
    /// one usage of a product alone becomes the usage's.
    pub(crate) fn read(file: &File<'_>) -> Self {
        let mut plain = FxHashMap::default();
        let mut over = FxHashMap::default();
        let (mut layers, mut overridden) = (FxHashMap::default(), FxHashSet::default());
        let usages = usages_by_shape(file);
        // Of thousands of items many share a style.
        let mut known: FxHashMap<u64, Option<Colour>> = FxHashMap::default();
        for e in file.entities_named(&["PRESENTATION_LAYER_ASSIGNMENT", "STYLED_ITEM", "OVER_RIDING_STYLED_ITEM"]) {
            if let Some(args) = e.attributes("PRESENTATION_LAYER_ASSIGNMENT", 0) {
                let name: Arc<str> = args.name(0).into();
                // One name for all items of a layer: files hold thousands.
                layers.extend(args.list(2).ids().into_iter().map(|item| (item, name.clone())));
                continue;
            }
            // In a complex instance the subtype adds its own attribute only; item and styles stand in STYLED_ITEM.
            let (args, overriding) = match e.attributes("OVER_RIDING_STYLED_ITEM", 1) {
                Some(a) if !e.keyword().is_empty() => (Some(a), true),
                found => (e.attributes("STYLED_ITEM", 1), found.is_some()),
            };
            let Some(args) = args else { continue };
            let Some(item) = args.id(1) else { continue };
            for style in args.list(0).ids() {
                let Some(colour) = *known.entry(style).or_insert_with(|| colour(file, style)) else { continue };
                // Elsewhere the item keeps the colour that it has.
                if let Some(usage) = style_context(file, style).and_then(|context| usages.get(&context)) {
                    overridden.insert(item);
                    over.insert(*usage, colour);
                    continue;
                }
                let table = if overriding { &mut over } else { &mut plain };
                table.insert(item, colour);
                break;
            }
        }
        // Last, because an overriding style wins over the plain one wherever the file has it.
        plain.extend(over);
        let mut styles = Self { colours: plain, layers, overridden, occurrences: FxHashMap::default() };
        styles.add_paths(file, &usages);
        styles
    }

    /// Adds the colours that hold for a representation in one of its places alone, which a path of relationships names.
    fn add_paths(&mut self, file: &File<'_>, usages: &FxHashMap<u64, u64>) {
        for e in file.entities_named(&["CONTEXT_DEPENDENT_OVER_RIDING_STYLED_ITEM"]) {
            let overriding = e.attributes("CONTEXT_DEPENDENT_OVER_RIDING_STYLED_ITEM", 4);
            let styled = e
                .attributes("STYLED_ITEM", 1)
                .or_else(|| e.attributes("CONTEXT_DEPENDENT_OVER_RIDING_STYLED_ITEM", 1));
            let (Some(overriding), Some(styled)) = (overriding, styled) else { continue };
            let Some(item) = styled.id(1).filter(|item| is_representation(file, *item)) else { continue };
            let Some(colour) = styled.list(0).ids().into_iter().find_map(|style| colour(file, style)) else {
                continue;
            };
            let path: Vec<u64> =
                overriding.list(0).ids().into_iter().map(|id| usages.get(&id).copied().unwrap_or(id)).collect();
            // From the outside in.
            let Some(innermost) = path.last().copied() else { continue };
            self.overridden.insert(item);
            self.occurrences.entry(innermost).or_default().push(OccurrenceColour { path, colour });
        }
        // Shapes stand in representations that are related to the product's own.
        for e in file.entities_named(&["SHAPE_REPRESENTATION_RELATIONSHIP"]) {
            if let Some(pair) = related_representations(e).filter(|_| !has_transformation(e))
                && pair.iter().any(|id| self.overridden.contains(id))
            {
                self.overridden.extend(pair);
            }
        }
    }

    /// Returns the colour of an occurrence by what is around it, from the outside in; `None` where nothing around it has one.
    pub(crate) fn occurrence_colour(&self, owners: &[u64]) -> Option<Colour> {
        let limited = |owner: &u64| {
            let all = self.occurrences.get(owner)?;
            all.iter().rev().find(|o| o.path.iter().all(|usage| owners.contains(usage))).map(|o| o.colour)
        };
        owners.iter().rev().find_map(|owner| limited(owner).or_else(|| self.colour(*owner)))
    }

    /// Returns the colour given to an item itself; `None` where it has none of its own.
    pub(crate) fn colour(&self, item: u64) -> Option<Colour> {
        self.colours.get(&item).copied()
    }

    /// Whether some occurrence overrides this item's colour (a style by context); elsewhere the item keeps the one of [`Self::colour`].
    pub(crate) fn is_overridden(&self, item: u64) -> bool {
        self.overridden.contains(&item)
    }

    /// Returns the name of the layer that an item itself is assigned to, the last in the file if there are several; `None` without one.
    pub(crate) fn layer(&self, item: u64) -> Option<Arc<str>> {
        self.layers.get(&item).cloned()
    }
}

/// Whether an entity is a representation, to which a colour may be given as a whole.
fn is_representation(file: &File<'_>, id: u64) -> bool {
    file.entity(id).is_some_and(|e| e.keywords().any(is_shape_representation))
}

/// Returns the usages of products by what styles name them by: their shapes, the entities that place them, and the relationships that
/// those name.
fn usages_by_shape(file: &File<'_>) -> FxHashMap<u64, u64> {
    let mut usages = FxHashMap::default();
    for e in file.entities_named(&["SHAPE_DEFINITION_REPRESENTATION", "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION"]) {
        let (names, definition) = if let Some(a) = shape_definition_attributes(e) {
            ([a.id(1), None], a.entity(0))
        } else if let Some(a) = e.attributes("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION", 0) {
            ([Some(e.id), a.id(0)], a.entity(1))
        } else {
            continue;
        };
        let target = definition.and_then(|d| property_attributes(d).entity(2));
        if let Some(usage) = target.filter(|t| usage_attributes(*t).is_some()) {
            usages.extend(names.into_iter().flatten().map(|name| (name, usage.id)));
        }
    }
    usages
}

/// Returns what a style is limited to; `None` for one that holds everywhere.
fn style_context(file: &File<'_>, style: u64) -> Option<u64> {
    file.entity(style)?.attributes("PRESENTATION_STYLE_BY_CONTEXT", 1)?.id(0)
}

/// Returns the first surface colour that a style leads to within [`MAX_STEPS`] entities; `None` without one.
fn colour(file: &File<'_>, style: u64) -> Option<Colour> {
    let mut queue = vec![style];
    let mut at = 0;
    while at < queue.len() && at < MAX_STEPS {
        at += 1;
        // A reference that leads nowhere ends its own branch only.
        let Some(e) = file.entity(queue[at - 1]) else { continue };
        // Six entities may stand between an item and its colour, and writers differ in which: all that a style
        // leads to is looked at.
        if let Some(found) = rgb(e) {
            return Some(found);
        }
        // Curve and point styles colour lines, not surfaces.
        if e.is_one_of(&["CURVE_STYLE", "POINT_STYLE", "TEXT_STYLE"]) {
            continue;
        }
        for args in e.all_args() {
            let mut ids = Vec::new();
            args.deep_ids(&mut ids);
            // More than will be looked at need not wait.
            ids.truncate(MAX_STEPS);
            ids.retain(|id| !queue.contains(id));
            queue.extend(ids);
        }
    }
    None
}

/// Returns the colour that an entity states by numbers or by name; `None` for any other entity and name.
fn rgb(e: Entity<'_, '_>) -> Option<Colour> {
    if let Some(a) = e.attributes("COLOUR_RGB", 1) {
        return Some(Colour([a.real(0)?, a.real(1)?, a.real(2)?]));
    }
    // The eight names that the schemas allow.
    let a = e.attributes("DRAUGHTING_PRE_DEFINED_COLOUR", 0)?;
    Some(Colour(match a.text(0)?.to_ascii_lowercase().as_str() {
        "red" => [1.0, 0.0, 0.0],
        "green" => [0.0, 1.0, 0.0],
        "blue" => [0.0, 0.0, 1.0],
        "yellow" => [1.0, 1.0, 0.0],
        "magenta" => [1.0, 0.0, 1.0],
        "cyan" => [0.0, 1.0, 1.0],
        "black" => [0.0; 3],
        "white" => [1.0; 3],
        _ => return None,
    }))
}

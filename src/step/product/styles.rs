//! Colours and layers: STYLED_ITEM and OVER_RIDING_STYLED_ITEM down to a COLOUR_RGB, and PRESENTATION_LAYER_ASSIGNMENT.

use crate::model::Colour;
use crate::step::part21::{Entity, File};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Most entities looked at for one style.
const MAX_STEPS: usize = 64;

/// Colours and layers by the item that has them.
#[derive(Debug, Default)]
pub(crate) struct Styles {
    colours: FxHashMap<u64, Colour>,
    layers: FxHashMap<u64, Arc<str>>,
}

impl Styles {
    /// Collects the surface colours and layers that a file gives to items; overriding styles win over plain ones.
    pub(crate) fn read(file: &File<'_>) -> Self {
        let mut plain = FxHashMap::default();
        let mut over = FxHashMap::default();
        let mut layers = FxHashMap::default();
        for e in file.entities() {
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
            let colour = args.list(0).ids().into_iter().find_map(|s| colour(file, s));
            if let Some(colour) = colour {
                let table = if overriding { &mut over } else { &mut plain };
                table.insert(item, colour);
            }
        }
        // Last, for an overriding style stands above the plain one wherever the file has it.
        plain.extend(over);
        Self { colours: plain, layers }
    }

    /// Returns the colour given to an item itself; `None` where it has none of its own.
    pub(crate) fn colour(&self, item: u64) -> Option<Colour> {
        self.colours.get(&item).copied()
    }

    /// Returns the layer on which an item is put itself; `None` for none.
    pub(crate) fn layer(&self, item: u64) -> Option<Arc<str>> {
        self.layers.get(&item).cloned()
    }
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

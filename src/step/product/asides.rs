//! What few entities of a file say beside its shapes: what it hides, which other files it needs, which directions point nowhere, and what
//! it holds without any shape.

use super::topology::ShapeItems;
use crate::formats::lower_extension;
use crate::step::part21::{Entity, File};
use crate::step::report::Note;
use rustc_hash::{FxHashMap, FxHashSet};
use std::path::Path;

/// Entities that are listed of a file without shapes.
const LISTED_ENTITIES: usize = 5;

/// Tells of directions that point nowhere, how many there are and which is the first; `None` where there is none. `name` is the file's.
pub(crate) fn void_directions(file: &File<'_>, name: &str) -> Option<String> {
    let mut void = file.entities_named(&["DIRECTION"]).filter(|e| is_void(*e));
    let first = void.next()?.id;
    let count = 1 + void.count();
    let others = if count == 1 { String::new() } else { format!("; there are {count} such") };
    Some(format!(
        "{name}: #{first} DIRECTION points nowhere{others}. Placements with one take the axis that they would have without"
    ))
}

/// Names the other STEP files, than `own`, that the products have their shapes in.
pub(crate) fn external_files(file: &File<'_>, own: &str) -> Vec<Note> {
    let mut notes = Vec::new();
    for e in file.entities_named(&["DOCUMENT_FILE"]) {
        let Some(other) = e.attributes("DOCUMENT_FILE", 0).and_then(|a| a.text(0)) else { continue };
        // Drawings and files of a CAD system, or the file itself, may be named as well.
        let is_step = matches!(lower_extension(Path::new(&other)).as_str(), "stp" | "step");
        if is_step && !other.eq_ignore_ascii_case(own) {
            let reason = format!(
                "shapes are in {other}, which is not read with this file: export the assembly as one file, or use that file too"
            );
            notes.push(Note { id: e.id, entity: e.name(), reason });
        }
    }
    notes
}

/// Names the sets of points, curves and surfaces that list faces, which they do not hold: these are left out. Those that a shell among the
/// `placed` items lists stand, or are reported, with that shell.
pub(crate) fn faces_in_sets(file: &File<'_>, placed: impl Iterator<Item = u64>) -> Vec<Note> {
    let is_face = |id: &u64| file.entity(*id).is_some_and(|e| e.is_one_of(&["ADVANCED_FACE", "SUBFACE"]));
    let mut sets: Vec<(Entity<'_, '_>, Vec<u64>)> = Vec::new();
    for e in file.entities_named(&["GEOMETRIC_SET"]) {
        let elements = e.attributes("GEOMETRIC_SET", 1).map_or_else(Vec::new, |a| a.list(0).ids());
        let faces: Vec<u64> = elements.into_iter().filter(is_face).collect();
        if !faces.is_empty() {
            sets.push((e, faces));
        }
    }
    if sets.is_empty() {
        return Vec::new();
    }
    let placed: FxHashSet<u64> = placed.collect();
    let mut shapes = ShapeItems::default();
    placed.into_iter().for_each(|id| shapes.add(file, id));
    let listed: FxHashSet<u64> = shapes.shells.iter().flat_map(|shell| &shell.faces).map(|(id, _)| *id).collect();
    let mut notes = Vec::new();
    for (e, mut faces) in sets {
        faces.retain(|id| !listed.contains(id));
        if let Some(first) = faces.first() {
            let others = if faces.len() > 1 { format!(" and {} more", faces.len() - 1) } else { String::new() };
            let reason =
                format!("lists the face #{first}{others}: such a set holds points, curves and surfaces alone");
            notes.push(Note { id: e.id, entity: e.name(), reason });
        }
    }
    notes
}

/// Tells of a file without a face what it holds instead: the entities that it has most of.
pub(crate) fn absent_shapes(file: &File<'_>) -> String {
    let mut counts: FxHashMap<&str, usize> = FxHashMap::default();
    file.entities().flat_map(|e| e.keywords()).for_each(|k| *counts.entry(k).or_default() += 1);
    let mut most: Vec<(&str, usize)> = counts.into_iter().collect();
    // By name where counts are equal, for tables of hashes have no order.
    most.sort_unstable_by_key(|&(name, count)| (std::cmp::Reverse(count), name));
    let listed: Vec<String> = most.iter().take(LISTED_ENTITIES).map(|(name, n)| format!("{name} ({n})")).collect();
    let commonest =
        if listed.is_empty() { "it has no entity".into() } else { format!("commonest are {}", listed.join(", ")) };
    let faces = file.entities_named(&["ADVANCED_FACE", "FACE_SURFACE"]).count();
    let found = if faces == 0 {
        "no face, surface or mesh was found".into()
    } else {
        format!("the file has faces ({faces}), but no representation of a shape leads to one")
    };
    format!("{found}; {commonest}; export solids or surfaces")
}

/// Whether a DIRECTION has no component that is a number and not 0.
fn is_void(e: Entity<'_, '_>) -> bool {
    e.attributes("DIRECTION", 1).is_some_and(|a| {
        let ratios = a.list(0);
        (0..ratios.len()).all(|i| ratios.real(i).is_none_or(|x| x == 0.0 || !x.is_finite()))
    })
}

/// Returns what an entity that can be hidden shows: the item of a style, the items of a layer, else itself.
fn shown_items(e: Entity<'_, '_>) -> Vec<u64> {
    if let Some(layer) = e.attributes("PRESENTATION_LAYER_ASSIGNMENT", 0) {
        return layer.list(2).ids();
    }
    // A simple instance of the subtype writes the attributes of its supertype first.
    let styled = e.attributes("STYLED_ITEM", 1).or_else(|| e.attributes("OVER_RIDING_STYLED_ITEM", 1));
    styled.map_or_else(|| vec![e.id], |args| args.id(1).into_iter().collect())
}

/// What a file hides (INVISIBILITY): a viewer does not show it, light meets it all the same.
pub(crate) struct HiddenItems {
    /// Each once, in the order of the file.
    items: Vec<u64>,
    /// Those of them that the model holds.
    found: FxHashSet<u64>,
}

impl HiddenItems {
    /// Collects the items that a file hides: what styles stand for, and what is on layers.
    pub(crate) fn new(file: &File<'_>) -> Self {
        let mut seen = FxHashSet::default();
        let lists = file.entities_named(&["INVISIBILITY", "CONTEXT_DEPENDENT_INVISIBILITY"]).filter_map(|e| {
            // In a complex instance that is limited to a context, the list stands in the record of the supertype.
            e.attributes("INVISIBILITY", 0).or_else(|| e.attributes("CONTEXT_DEPENDENT_INVISIBILITY", 0))
        });
        let named = lists.flat_map(|args| args.list(0).ids());
        let shown = named.flat_map(|id| file.entity(id).map_or_else(Vec::new, shown_items));
        Self { items: shown.filter(|id| seen.insert(*id)).collect(), found: FxHashSet::default() }
    }

    /// Notes that the model holds these entities, of which some may be hidden.
    pub(crate) fn find_among<'i>(&mut self, entities: impl IntoIterator<Item = &'i u64>) {
        if !self.items.is_empty() {
            self.found.extend(entities);
        }
    }

    /// Names the hidden items that the model holds.
    pub(crate) fn notes(self, file: &File<'_>) -> Vec<Note> {
        let reason = "the file hides it; it is read, and light meets it";
        let held = self.items.into_iter().filter(|id| self.found.contains(id));
        held.map(|id| Note { id, entity: file.entity_name(id), reason: reason.into() }).collect()
    }
}

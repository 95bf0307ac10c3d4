//! Shapes that several representations name: which of their items a placed representation adds to what stands already.
//!
//! Linked representations often name the same shapes, each of which is meant once in a place. The same shape in another place is another
//! one, whichever representation brings it there. A surface of shells that bound solids in the same place is these solids once more.

use super::assembly::{Assembly, PlacedRepresentation};
use super::places::{Place, PlaceTable};
use super::topology::{FACES, ShapeItems};
use crate::step::part21::File;
use rustc_hash::{FxHashMap, FxHashSet};

/// What may hold one another besides [`FACES`], which are the lowest, from the lowest rank to the highest.
const ORIENTED_FACES: [&str; 1] = ["ORIENTED_FACE"];
const SHELLS: [&str; 3] = ["OPEN_SHELL", "CLOSED_SHELL", "CONNECTED_FACE_SET"];
const ORIENTED_SHELLS: [&str; 2] = ["ORIENTED_OPEN_SHELL", "ORIENTED_CLOSED_SHELL"];
const MODELS: [&str; 5] = [
    "MANIFOLD_SOLID_BREP",
    "FACETED_BREP",
    "BREP_WITH_VOIDS",
    "SHELL_BASED_SURFACE_MODEL",
    "FACE_BASED_SURFACE_MODEL",
];
/// The first of [`MODELS`], as many as these, are solids.
const SOLIDS: usize = 3;
/// Rank of [`MODELS`].
const MODEL_RANK: usize = 4;

/// The shapes that are named by more than one of the placed representations, and where they stand so far.
pub(crate) struct SharedItems {
    /// The shapes of each placed representation.
    items: FxHashMap<u64, Vec<u64>>,
    /// The items of a representation that are a shared shape or hold some, with those that they bring.
    brings: FxHashMap<u64, Vec<(u64, Vec<u64>)>>,
    /// Shared shapes in the places where they stand.
    standing: PlaceTable,
    /// The representation that brought each of these there first.
    brought_by: Vec<u64>,
    /// Shared shapes that products have brought anywhere.
    of_products: FxHashSet<u64>,
    /// The shells of each surface, by representation, and those of solids in the places where they stand.
    surfaces: FxHashMap<u64, Vec<(u64, Vec<u64>)>>,
    of_solids: PlaceTable,
}

impl SharedItems {
    /// Finds the shapes that several of the placed representations name, as an item or within one.
    pub(crate) fn new(file: &File<'_>, assembly: &Assembly<'_, '_>, placed: &[PlacedRepresentation]) -> Self {
        let mut items: FxHashMap<u64, Vec<u64>> = FxHashMap::default();
        for p in placed {
            items.entry(p.representation).or_insert_with(|| {
                let mut ids = assembly.items(p.representation);
                // Items are a set: one that is listed again is no other. Placements are shared by most representations of a file, and
                // stand for nothing.
                let mut listed = FxHashSet::default();
                ids.retain(|&id| listed.insert(id) && is_shape(file, id));
                outermost_items(file, assembly.without_pictures(ids))
            });
        }
        let shapes: FxHashSet<u64> = items.values().flatten().copied().collect();
        // Shells of models and elements of sets stand with them.
        let with_inner = |item: u64| -> Vec<u64> {
            let mut named = Vec::new();
            file.entity(item).into_iter().flat_map(|e| e.all_args()).for_each(|a| a.deep_ids(&mut named));
            named.retain(|id| *id != item && shapes.contains(id));
            named.push(item);
            named
        };
        let mut first_owner: FxHashMap<u64, u64> = FxHashMap::default();
        let mut shared: FxHashSet<u64> = FxHashSet::default();
        let mut brings: FxHashMap<u64, Vec<(u64, Vec<u64>)>> = FxHashMap::default();
        for (&representation, ids) in &items {
            let named: Vec<(u64, Vec<u64>)> = ids.iter().map(|&item| (item, with_inner(item))).collect();
            for &id in named.iter().flat_map(|(_, ids)| ids) {
                if *first_owner.entry(id).or_insert(representation) != representation {
                    shared.insert(id);
                }
            }
            brings.insert(representation, named);
        }
        for named in brings.values_mut() {
            named.iter_mut().for_each(|(_, ids)| ids.retain(|id| shared.contains(id)));
            named.retain(|(_, ids)| !ids.is_empty());
        }
        brings.retain(|_, named| !named.is_empty());
        let shells_of = |kinds: &[&str]| -> FxHashMap<u64, Vec<(u64, Vec<u64>)>> {
            let of_items = |ids: &Vec<u64>| {
                let models = ids.iter().filter(|&&id| file.entity(id).is_some_and(|e| e.is_one_of(kinds)));
                models.map(|&id| (id, inner_shells(file, id))).collect::<Vec<_>>()
            };
            items.iter().map(|(r, ids)| (*r, of_items(ids))).filter(|(_, models)| !models.is_empty()).collect()
        };
        let surfaces = shells_of(&MODELS[SOLIDS..]);
        let mut of_solids = PlaceTable::default();
        if !surfaces.is_empty() {
            let solids = shells_of(&MODELS[..SOLIDS]);
            let solids_of = |p: &PlacedRepresentation| solids.get(&p.representation).into_iter().flatten();
            let of_products: FxHashSet<u64> =
                placed.iter().filter(|p| !p.orphan).flat_map(solids_of).map(|(solid, _)| *solid).collect();
            for p in placed {
                // An orphan's solid that a product has brought anywhere does not stand with the orphan.
                let standing = solids_of(p).filter(|(solid, _)| !p.orphan || !of_products.contains(solid));
                standing.flat_map(|(_, shells)| shells).for_each(|&shell| of_solids.insert(shell, place_of(p)));
            }
        }
        Self {
            items,
            brings,
            standing: PlaceTable::default(),
            brought_by: Vec::new(),
            of_products: FxHashSet::default(),
            surfaces,
            of_solids,
        }
    }

    /// Returns the shapes of a representation but those in `left_out`, in its order.
    pub(crate) fn items(&self, representation: u64, left_out: &[u64]) -> Vec<u64> {
        let left_out: FxHashSet<u64> = left_out.iter().copied().collect();
        let items = self.items.get(&representation).into_iter().flatten();
        items.copied().filter(|item| !left_out.contains(item)).collect()
    }

    /// Returns the shapes of a placed representation that stand already, brought to this place by another representation, and notes that
    /// the others stand there now. Of an orphan all that a product has brought anywhere are returned; surfaces of the shells of solids
    /// that stand there, before or after, always.
    pub(crate) fn place(&mut self, p: &PlacedRepresentation) -> Vec<u64> {
        let place = place_of(p);
        let surfaces = self.surfaces.get(&p.representation).into_iter().flatten();
        let is_solid =
            |shells: &[u64]| !shells.is_empty() && shells.iter().all(|&s| self.of_solids.holds(s, &place));
        let mut left_out: Vec<u64> = surfaces.filter(|(_, shells)| is_solid(shells)).map(|(id, _)| *id).collect();
        let Some(named) = self.brings.get(&p.representation) else { return left_out };
        let mut added: Vec<u64> = Vec::new();
        for (item, ids) in named {
            if left_out.contains(item) {
                continue;
            }
            let is_repeated = p.orphan && self.of_products.contains(item);
            let owner = self.standing.find(*item, &place).map(|number| self.brought_by[number]);
            // A product that is used twice in one place stands there twice, as its file says: only others' shapes are left out.
            if is_repeated || owner.is_some_and(|owner| owner != p.representation) {
                left_out.push(*item);
            } else {
                added.extend(ids);
            }
        }
        for id in added {
            if !self.standing.holds(id, &place) {
                self.standing.insert(id, place);
                self.brought_by.push(p.representation);
            }
            if !p.orphan {
                self.of_products.insert(id);
            }
        }
        left_out
    }
}

fn place_of(p: &PlacedRepresentation) -> Place {
    Place { frame: p.placement, rounding: p.rounding }
}

/// Returns the shells that a model names itself.
fn inner_shells(file: &File<'_>, model: u64) -> Vec<u64> {
    let mut named = Vec::new();
    file.entity(model).into_iter().flat_map(|e| e.all_args()).for_each(|a| a.deep_ids(&mut named));
    named.retain(|&id| file.entity(id).is_some_and(|e| e.is_one_of(&SHELLS)));
    named
}

/// Returns the shapes of one representation but those that another of them holds: a shell beside its model, a face beside its shell.
fn outermost_items(file: &File<'_>, mut items: Vec<u64>) -> Vec<u64> {
    // What holds others is of a higher rank than they are, so that nothing holds itself.
    let rank = |id: &u64| -> Option<usize> {
        let ranks: [&[&str]; 5] = [&FACES, &ORIENTED_FACES, &SHELLS, &ORIENTED_SHELLS, &MODELS];
        let e = file.entity(*id)?;
        ranks.iter().position(|kinds| e.is_one_of(kinds))
    };
    let lowest = items.iter().filter_map(rank).min();
    if items.len() < 2 || lowest == Some(MODEL_RANK) {
        return items;
    }
    let mut held: FxHashSet<u64> = FxHashSet::default();
    let mut open = items.clone();
    while let Some(id) = open.pop() {
        let Some(outer) = rank(&id).filter(|outer| Some(*outer) > lowest) else { continue };
        let mut inner = Vec::new();
        file.entity(id).into_iter().flat_map(|e| e.all_args()).for_each(|a| a.deep_ids(&mut inner));
        inner.retain(|id| rank(id).is_some_and(|rank| rank < outer) && held.insert(*id));
        open.extend(inner);
    }
    items.retain(|id| !held.contains(id));
    items
}

/// Whether an item of a representation is a shape, or is refused as one.
fn is_shape(file: &File<'_>, id: u64) -> bool {
    // Most items of an assembly are one of these: sorted in as shapes they took 4 % of its reading.
    if file.entity(id).is_none_or(|e| e.is_one_of(&["AXIS2_PLACEMENT_3D", "MAPPED_ITEM"])) {
        return false;
    }
    let mut items = ShapeItems::default();
    items.add(file, id);
    !items.is_empty()
}

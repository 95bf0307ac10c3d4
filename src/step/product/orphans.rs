//! Representations that no product reaches: in the order in which they are placed, and those that are there for mapped items alone.

use super::assembly::Assembly;
use super::purpose::{is_shape_representation, purpose_besides_shape};
use super::topology::ShapeItems;
use rustc_hash::FxHashSet;

impl Assembly<'_, '_> {
    /// Returns the representations that no product has `reached` and no item maps: in the order of the file, first those that no other of
    /// them places by a transformation. A caller that places them in this order, each only if nothing has reached it by then, places none
    /// a second time at the origin; the last ones are parts of cycles.
    pub(super) fn orphans(&self, reached: &FxHashSet<u64>) -> Vec<u64> {
        let shapes = self.file.entities_of_kind(is_shape_representation).map(|e| e.id);
        let unreached: Vec<u64> = shapes.filter(|id| !reached.contains(id)).collect();
        let moved = self.moved_by(&unreached);
        let maps = self.file.entities_named(&["REPRESENTATION_MAP"]);
        let mapped: FxHashSet<u64> = maps.filter_map(|e| e.attributes("REPRESENTATION_MAP", 0)?.id(1)).collect();
        let unmapped = unreached.into_iter().filter(|id| !mapped.contains(id));
        let (inner, mut orphans): (Vec<u64>, Vec<u64>) = unmapped.partition(|id| moved.contains(id));
        orphans.extend(inner);
        orphans
    }

    /// Returns the representations that a REPRESENTATION_MAP offers and that nothing has `reached`, each with the map, where they have a
    /// shape that no reached one lists or holds; but what is left out already and what that holds.
    pub(super) fn unshown_maps(&self, reached: &FxHashSet<u64>) -> Vec<(u64, u64)> {
        let file = self.file;
        let mut known = FxHashSet::default();
        let is_shape = |id: u64| {
            let has_name = file.entity(id).is_some_and(|e| e.keywords().any(is_shape_representation));
            has_name && purpose_besides_shape(file, id).is_none()
        };
        let maps = file.entities_named(&["REPRESENTATION_MAP"]);
        let offered = maps.filter_map(|e| Some((e.attributes("REPRESENTATION_MAP", 0)?.id(1)?, e.id)));
        let mut unshown: Vec<(u64, u64)> =
            offered.filter(|(id, _)| !reached.contains(id) && is_shape(*id) && known.insert(*id)).collect();
        if !unshown.is_empty() {
            let left_out = self.left_out.iter().map(|(id, _)| *id).collect();
            let told = self.held_representations(Vec::new(), left_out, &FxHashSet::default());
            // Captures of product data map solids of the product once more, or their shells and faces.
            let mut listed: FxHashSet<u64> = reached.iter().flat_map(|id| self.items(*id)).collect();
            let mut shapes = ShapeItems::default();
            listed.iter().for_each(|item| shapes.add(file, *item));
            listed.extend(shapes.shells.iter().flat_map(|shell| &shell.faces).map(|(face, _)| *face));
            unshown.retain(|(id, _)| !told.contains(id) && self.has_shape_besides(*id, &listed));
        }
        unshown
    }

    /// Whether a representation has a shape among its items that is not `listed`; of a shell one of its faces.
    fn has_shape_besides(&self, representation: u64, listed: &FxHashSet<u64>) -> bool {
        let mut rest = ShapeItems::default();
        let items = self.items(representation).into_iter().filter(|item| !listed.contains(item));
        items.for_each(|item| rest.add(self.file, item));
        rest.shells.retain(|shell| shell.faces.iter().any(|(face, _)| !listed.contains(face)));
        !rest.is_empty()
    }

    /// Returns what transformations put into these representations, with all other shapes of the same things.
    fn moved_by(&self, representations: &[u64]) -> FxHashSet<u64> {
        let links = |id: u64| self.links.get(&id).into_iter().flatten();
        let mut open: Vec<u64> = Vec::new();
        for &id in representations {
            open.extend(links(id).filter(|link| link.has_transformation && link.to != id).map(|link| link.to));
        }
        let mut moved = FxHashSet::default();
        while let Some(id) = open.pop() {
            if moved.insert(id) {
                open.extend(links(id).filter(|link| !link.has_transformation).map(|link| link.to));
            }
        }
        moved
    }
}

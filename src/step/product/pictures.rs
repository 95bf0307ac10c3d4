//! Meshes that are pictures of exact shapes: both would stand in one place, and light would meet the shape twice.
//!
//! A tessellated item that names the exact shape which it shows is left out where that stands; it is brought back where none of the
//! shape's faces could be converted, as it is all that there is then. One that names none is left out, by name, where it lies within the
//! exact body of the same product and is about as large. Known weakness: a mesh that is no picture but lies in the body, and is half as
//! large, is taken for one; and the bodies of such products are converted twice, once for their boxes.

use super::assembly::{Assembly, PlacedRepresentation};
use super::conversion::convert;
use super::styles::Styles;
use super::tessellated::{DEEPEST_MESHES, TessellatedItems, inner_items, shown_shape};
use super::topology::{ShapeItems, is_tessellated};
use crate::math::Aabb;
use crate::model::Model;
use crate::step::part21::Entity;
use crate::step::settings::Settings;
use rustc_hash::{FxHashMap, FxHashSet};

/// How far the box of a picture may reach beyond that of its body, as a share of the body's diagonal: chords of a mesh lie on either side
/// of a surface, and the box of a body is sampled.
const PICTURE_MARGIN: f64 = 0.01;
/// Least size of all pictures of a body, as a share of its diagonal: a small mesh in a large body is another thing.
const PICTURE_SHARE: f64 = 0.5;

/// What is read of a tessellated item.
struct MeshRest {
    items: Vec<u64>,
    /// Whether something of it is left out as a picture of what stands.
    has_pictures: bool,
    /// Whether something of it names what it shows.
    is_linked: bool,
}

/// A tessellated item with the representation that lists it.
#[derive(Clone, Copy)]
struct ListedMesh {
    representation: u64,
    item: u64,
}

impl Assembly<'_, '_> {
    /// Returns items without the pictures of what stands exact: of a tessellated item with some the others are in its place.
    pub(super) fn without_pictures(&self, items: Vec<u64>) -> Vec<u64> {
        if self.read_instead.is_empty() {
            return items;
        }
        let rest = |item: u64| self.read_instead.get(&item).cloned().unwrap_or_else(|| vec![item]);
        items.into_iter().flat_map(rest).collect()
    }

    /// Finds the pictures among the meshes of placed representations, and names those that do not say what they show.
    pub(super) fn leave_out_pictures(&mut self, placed: &[PlacedRepresentation]) {
        if self.file.entities_of_kind(is_tessellated).next().is_none() {
            return;
        }
        let representations = distinct_representations(placed);
        let standing = self.exact_shapes(&representations, &FxHashSet::default());
        let mut unlinked = Vec::new();
        for mesh in self.listed_meshes(&representations) {
            let rest = self.mesh_rest(mesh.item, 0, &standing, &mut FxHashSet::default());
            if rest.has_pictures {
                self.read_instead.insert(mesh.item, rest.items);
            } else if !rest.is_linked {
                unlinked.push(mesh);
            }
        }
        if !unlinked.is_empty() {
            let known: FxHashSet<u64> = representations.into_iter().collect();
            let orphans: Vec<u64> = placed.iter().filter(|p| p.orphan).map(|p| p.representation).collect();
            self.leave_out_unlinked(&known, &orphans, &unlinked);
        }
    }

    /// Whether some meshes are left out as pictures.
    pub(crate) fn has_pictures(&self) -> bool {
        !self.read_instead.is_empty()
    }

    /// Brings back the meshes that name as what they show nothing but `refused` faces and solids, which could not be converted. Whether
    /// there are some.
    pub(crate) fn bring_back_pictures(
        &mut self,
        placed: &[PlacedRepresentation],
        refused: &FxHashSet<u64>,
    ) -> bool {
        let representations = distinct_representations(placed);
        let standing = self.exact_shapes(&representations, refused);
        let mut is_changed = false;
        for mesh in self.listed_meshes(&representations) {
            let Some(known) = self.read_instead.get(&mesh.item) else { continue };
            let rest = self.mesh_rest(mesh.item, 0, &standing, &mut FxHashSet::default());
            // One that names nothing was compared with what could be converted.
            if !rest.is_linked || rest.items == *known {
                continue;
            }
            is_changed = true;
            if rest.has_pictures {
                self.read_instead.insert(mesh.item, rest.items);
            } else {
                self.read_instead.remove(&mesh.item);
            }
        }
        is_changed
    }

    /// Returns the tessellated items of representations.
    fn listed_meshes(&self, representations: &[u64]) -> Vec<ListedMesh> {
        let is_mesh = |item: u64| self.file.entity(item).is_some_and(|e| e.keywords().any(is_tessellated));
        let listed = representations.iter().flat_map(|&representation| {
            self.items(representation).into_iter().map(move |item| ListedMesh { representation, item })
        });
        listed.filter(|mesh| is_mesh(mesh.item)).collect()
    }

    /// Returns the solids, shells and faces that representations hold, but `refused` faces and solids, and what has no others.
    fn exact_shapes(&self, representations: &[u64], refused: &FxHashSet<u64>) -> FxHashSet<u64> {
        let mut standing: FxHashSet<u64> = FxHashSet::default();
        for &representation in representations {
            let items = self.shape_items(representation);
            for shell in &items.shells {
                let mut faces = shell.faces.iter().map(|face| face.0).filter(|id| !refused.contains(id)).peekable();
                if faces.peek().is_some() {
                    standing.extend(&shell.owners);
                    standing.extend(faces);
                }
            }
            let geometry = self.geometry_reader(representation);
            let is_read = |id: &u64| geometry.entity(*id).and_then(|e| geometry.solid_recipe(e)).is_ok();
            let recipes = items.recipes.iter().copied().filter(|id| !refused.contains(id));
            standing.extend(recipes.filter(is_read));
        }
        standing
    }

    /// Returns what the items of a representation amount to.
    fn shape_items(&self, representation: u64) -> ShapeItems {
        let mut items = ShapeItems::default();
        self.items(representation).into_iter().for_each(|item| items.add(self.file, item));
        items
    }

    /// Returns what is left of a tessellated item without pictures of what is `standing`; `visited` holds those around and before it.
    fn mesh_rest(
        &self,
        item: u64,
        depth: usize,
        standing: &FxHashSet<u64>,
        visited: &mut FxHashSet<u64>,
    ) -> MeshRest {
        let whole = MeshRest { items: vec![item], has_pictures: false, is_linked: false };
        let Some(e) = self.file.entity(item) else { return whole };
        // What is listed again stands with the first.
        if !visited.insert(item) {
            return MeshRest { items: Vec::new(), ..whole };
        }
        let shown = shown_shape(e);
        if shown.is_some_and(|shape| stands(shape, standing)) {
            return MeshRest { items: Vec::new(), has_pictures: true, is_linked: true };
        }
        let is_linked = shown.is_some();
        // A list with an entry that is no reference is refused where it is read, and deep ones as well.
        let inner = inner_items(e).filter(|_| depth < DEEPEST_MESHES).and_then(|list| list.refs());
        let Some(inner) = inner else { return MeshRest { is_linked, ..whole } };
        let inner: Vec<MeshRest> =
            inner.into_iter().map(|item| self.mesh_rest(item, depth + 1, standing, visited)).collect();
        let is_linked = is_linked || inner.iter().any(|rest| rest.is_linked);
        if !inner.iter().any(|rest| rest.has_pictures) {
            return MeshRest { is_linked, ..whole };
        }
        let items = inner.into_iter().flat_map(|rest| rest.items).collect();
        MeshRest { items, has_pictures: true, is_linked }
    }

    /// Leaves out the meshes that lie within the exact body of the same product, where all that show them have one. `placed` are the
    /// representations that stand, `orphans` those of them that no product reaches.
    fn leave_out_unlinked(&mut self, placed: &FxHashSet<u64>, orphans: &[u64], unlinked: &[ListedMesh]) {
        let mut meshes: FxHashMap<u64, Vec<ListedMesh>> = FxHashMap::default();
        for mesh in unlinked {
            meshes.entry(mesh.representation).or_default().push(*mesh);
        }
        let mut bodies: FxHashMap<u64, Aabb> = FxHashMap::default();
        let mut kept: FxHashSet<u64> = FxHashSet::default();
        let mut pictures: FxHashSet<u64> = FxHashSet::default();
        let groups = self.shapes.keys().map(|product| self.representations(*product));
        let mut seen: FxHashSet<u64> = FxHashSet::default();
        // Orphans that stand in one another are one group.
        let of_orphans = orphans.iter().filter_map(|orphan| {
            if seen.contains(orphan) {
                return None;
            }
            let group = self.unmoved(vec![*orphan]);
            seen.extend(&group);
            Some(group)
        });
        for mut group in groups.chain(of_orphans) {
            group.retain(|id| placed.contains(id));
            let own: Vec<ListedMesh> = group.iter().filter_map(|id| meshes.get(id)).flatten().copied().collect();
            if own.is_empty() {
                continue;
            }
            let boxes = group.iter().map(|&id| *bodies.entry(id).or_insert_with(|| self.body_box(id)));
            let body = boxes.fold(Aabb::EMPTY, Aabb::union);
            let found = self.pictures_of(body, &own);
            kept.extend(own.iter().map(|mesh| mesh.item).filter(|item| !found.contains(item)));
            pictures.extend(found);
        }
        pictures.retain(|item| !kept.contains(item));
        // In the order of the file, with one note for each representation.
        let mut noted: FxHashSet<u64> = FxHashSet::default();
        for mesh in unlinked.iter().filter(|mesh| pictures.contains(&mesh.item)) {
            self.read_instead.insert(mesh.item, Vec::new());
            if noted.insert(mesh.representation) {
                let own = &meshes[&mesh.representation];
                let more = own.iter().filter(|other| pictures.contains(&other.item)).count() - 1;
                let others = if more > 0 { format!(" and {more} more") } else { String::new() };
                let reason = format!(
                    "its mesh #{} {}{others}: lies within the exact body of the same product, as a picture does: the body is read alone",
                    mesh.item,
                    self.file.entity_name(mesh.item)
                );
                self.left_out.push((mesh.representation, reason));
            }
        }
    }

    /// Returns the items of those meshes that are pictures of a body in a box, mm; none of an empty one.
    fn pictures_of(&self, body: Aabb, meshes: &[ListedMesh]) -> FxHashSet<u64> {
        if body.is_empty() {
            return FxHashSet::default();
        }
        let room = body.grown(PICTURE_MARGIN * body.diagonal());
        let boxes = meshes.iter().map(|mesh| (mesh.item, self.mesh_box(*mesh)));
        let inside: Vec<(u64, Aabb)> =
            boxes.filter(|(_, b)| !b.is_empty() && room.contains(b.min) && room.contains(b.max)).collect();
        let all = inside.iter().fold(Aabb::EMPTY, |all, (_, b)| all.union(*b));
        if all.diagonal() < PICTURE_SHARE * body.diagonal() {
            return FxHashSet::default();
        }
        inside.into_iter().map(|(item, _)| item).collect()
    }

    /// Returns the box of the solids and shells of a representation, mm; empty without any that can be converted.
    fn body_box(&self, representation: u64) -> Aabb {
        let mut body = self.shape_items(representation);
        body.tessellated.clear();
        body.surfaces.clear();
        body.refused.clear();
        if body.is_empty() {
            return Aabb::EMPTY;
        }
        let units = self.units_of(representation);
        let converted = convert(self.file, units, &body, &Styles::default(), &Settings::default());
        Model::from_part(converted.part).bounds()
    }

    /// Returns the box of a mesh, mm; empty where none of it can be read.
    fn mesh_box(&self, mesh: ListedMesh) -> Aabb {
        let mut leaves = TessellatedItems::default();
        self.geometry_reader(mesh.representation).collect_meshes(mesh.item, 0, &mut leaves);
        Aabb::from_points(leaves.faces.iter().flat_map(|face| face.mesh.positions.iter().copied()))
    }
}

/// Returns the representations that are placed, each once, in the order of their first places.
fn distinct_representations(placed: &[PlacedRepresentation]) -> Vec<u64> {
    let mut known = FxHashSet::default();
    placed.iter().map(|p| p.representation).filter(|id| known.insert(*id)).collect()
}

/// Whether an exact shape, or the face that it turns, is among those that stand.
fn stands(shape: Entity<'_, '_>, standing: &FxHashSet<u64>) -> bool {
    let turned = shape.attributes("ORIENTED_FACE", 2).and_then(|a| a.id(0));
    standing.contains(&shape.id) || turned.is_some_and(|face| standing.contains(&face))
}

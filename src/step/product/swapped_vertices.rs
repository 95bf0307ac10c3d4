//! Arcs whose vertices the file has in the wrong order, detected by the loops that run along them.
//!
//! The same two vertices bound both parts of a circle, and their order decides which one is meant. Where it is wrong, both faces beside the
//! arc find it against their neighbours; where the flag of one use is wrong, one does.

use super::face_edges::{directed_uses, following_tolerance};
use super::loop_order::turned_to_follow;
use super::spikes::EdgeTable;
use super::topology::{EdgeKey, FacePlan};
use super::zero_width::vertex_ids;
use crate::step::geometry::closing::CompositeEdges;
use crate::step::geometry::edges::EdgeContext;
use crate::step::geometry::{GeometryReader, Outcome};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// How many uses of an arc say what of its direction.
#[derive(Clone, Copy, Default)]
struct Directions {
    /// It follows its neighbours.
    following: u32,
    /// It would if it ran the other way.
    against: u32,
    /// Either, in a loop of arcs alone.
    either: u32,
}

impl Directions {
    fn add(&mut self, other: Self) {
        self.following += other.following;
        self.against += other.against;
        self.either += other.either;
    }

    /// Whether more loops than one find the arc against its neighbours, or leave it open, and none finds it right.
    fn are_against(self) -> bool {
        self.following == 0 && self.against > 0 && self.against + self.either > 1
    }
}

/// Reads arcs that run against their neighbours in all loops between their vertices in the other order, under a key that says so. Returns
/// the entities of the edges.
pub(super) fn put_vertices_in_order(
    geometry: &GeometryReader<'_, '_>,
    ids: &[u64],
    plans: &mut FxHashMap<u64, Outcome<FacePlan>>,
    table: EdgeTable<'_>,
) -> Vec<u64> {
    let said = |id: &u64| -> Vec<(usize, Directions)> {
        let loops = plans.get(id).and_then(|plan| plan.as_ref().ok()).map_or(&[][..], |plan| &plan.loops);
        loops.iter().flat_map(|uses| arc_directions(uses, &table)).collect()
    };
    let said: Vec<Vec<(usize, Directions)>> = ids.par_iter().map(said).collect();
    if said.iter().flatten().all(|(_, directions)| directions.against == 0) {
        return Vec::new();
    }
    let mut all: FxHashMap<usize, Directions> = FxHashMap::default();
    said.into_iter().flatten().for_each(|(edge, directions)| all.entry(edge).or_default().add(directions));
    let mut against: Vec<usize> = all.into_iter().filter(|(_, d)| d.are_against()).map(|(edge, _)| edge).collect();
    against.sort_unstable();
    let mut renamed: FxHashMap<EdgeKey, EdgeKey> = FxHashMap::default();
    let mut swapped = Vec::with_capacity(against.len());
    // Run the other way, an arc over the ends of a composite curve is the part between its vertices.
    let context = EdgeContext { is_alone: false, is_swapped: true, others: &CompositeEdges::default() };
    for k in against {
        let old = table.keys[k];
        let (EdgeKey::Entity(entity), [Some(a), Some(b)]) = (old, vertex_ids(geometry.file, old)) else { continue };
        let new = EdgeKey::Part { entity, ends: [b, a] };
        table.edges[k] = geometry.edge(entity, context);
        table.keys[k] = new;
        table.index.remove(&old);
        table.index.insert(new, k);
        renamed.insert(old, new);
        swapped.push(entity);
    }
    for (key, _) in plans.values_mut().flatten().flat_map(|plan| plan.loops.iter_mut().flatten()) {
        *key = renamed.get(key).copied().unwrap_or(*key);
    }
    swapped
}

/// Returns what a loop says of each of its arcs, by its other edges, which count as right where most of them agree; nothing of a loop that
/// cannot be closed in its order.
fn arc_directions(uses: &[(EdgeKey, bool)], table: &EdgeTable<'_>) -> Vec<(usize, Directions)> {
    let is_arc = |edge: usize| table.edges[edge].as_ref().is_ok_and(|edge| edge.is_arc);
    if !uses.iter().any(|(key, _)| is_arc(table.index[key])) {
        return Vec::new();
    }
    let uses = directed_uses(uses, table.edges, table.index);
    let Some(turned) = turned_to_follow(&uses, following_tolerance(&uses)) else { return Vec::new() };
    let others: Vec<bool> = uses.iter().zip(&turned).filter(|(u, _)| !is_arc(u.edge)).map(|(_, t)| *t).collect();
    let are_others_turned = 2 * others.iter().filter(|turned| **turned).count() > others.len();
    let direction = |turned: bool| {
        let mut said = Directions::default();
        let count = if others.is_empty() {
            &mut said.either
        } else if turned == are_others_turned {
            &mut said.following
        } else {
            &mut said.against
        };
        *count += 1;
        said
    };
    let arcs = uses.iter().zip(&turned).filter(|(u, _)| is_arc(u.edge));
    arcs.map(|(u, turned)| (u.edge, direction(*turned))).collect()
}

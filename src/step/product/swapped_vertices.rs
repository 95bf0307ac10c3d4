//! Arcs whose vertices the file has in the wrong order, told by the loops that run along them.
//!
//! The same two vertices bound both parts of a circle, and which one is meant their order tells. Where it is wrong, both faces beside the
//! arc find it against their neighbours; where the flag of one use is wrong, one does.
//!
//! The same of arcs along a composite curve whose ends lie apart, which run over these or have a wrong sense: a plane face with one loop
//! tells it, as that runs round the face counter-clockwise. Known weakness: no other face is asked.

use super::face_edges::{directed_uses, following_tolerance};
use super::loop_order::turned_to_follow;
use super::spikes::EdgeTable;
use super::topology::{EdgeKey, FacePlan};
use super::zero_width::vertex_ids;
use crate::math::{Point, Vector};
use crate::step::geometry::closing::CompositeEdges;
use crate::step::geometry::edges::{EdgeContext, TrimmedEdge};
use crate::step::geometry::{GeometryReader, Outcome};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Points of each edge between which a loop counts as straight, to tell which way it runs: an arc of a whole turn keeps 97 % of its area.
const POINTS_PER_EDGE: u32 = 16;

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

/// Reads edges whose sense seemed wrong as running over the ends of their curve, where only so the loop of a plane face runs round it
/// counter-clockwise.
fn run_over_ends(
    geometry: &GeometryReader<'_, '_>,
    ids: &[u64],
    plans: &FxHashMap<u64, Outcome<FacePlan>>,
    table: &mut EdgeTable<'_>,
) {
    if !geometry.has_composites() {
        return;
    }
    let others = CompositeEdges::default();
    let context = EdgeContext { runs_over_ends: true, ..EdgeContext::new(false, &others) };
    for id in ids {
        let Some(Ok(plan)) = plans.get(id) else { continue };
        let [uses] = plan.loops.as_slice() else { continue };
        for (key, _) in uses {
            let (EdgeKey::Entity(entity), k) = (*key, table.index[key]) else { continue };
            if !table.edges[k].as_ref().is_ok_and(TrimmedEdge::has_wrong_sense) {
                continue;
            }
            let Some(normal) = plane_normal(geometry, plan) else { break };
            if signed_area(uses, table, normal).is_none_or(|area| area >= 0.0) {
                continue;
            }
            let Ok(over_ends) = geometry.edge(entity, context) else { continue };
            let before = std::mem::replace(&mut table.edges[k], Ok(over_ends));
            if signed_area(uses, table, normal).is_none_or(|area| area <= 0.0) {
                table.edges[k] = before;
            }
        }
    }
}

/// Returns the direction in which a plane face looks; `None` of any other.
fn plane_normal(geometry: &GeometryReader<'_, '_>, plan: &FacePlan) -> Option<Vector> {
    let position = geometry.file.entity(plan.surface)?.attributes("PLANE", 1)?.id(0)?;
    let axis = geometry.placement(position).ok()?.z;
    Some(if plan.same_sense { axis } else { -axis })
}

/// Returns about twice the area, mm², that a loop runs round, negative where clockwise about `normal`; `None` where its edges do not follow
/// each other.
fn signed_area(uses: &[(EdgeKey, bool)], table: &EdgeTable<'_>, normal: Vector) -> Option<f64> {
    let uses = directed_uses(uses, table.edges, table.index);
    if turned_to_follow(&uses, following_tolerance(&uses))?.contains(&true) {
        return None;
    }
    let mut border: Vec<Point> = Vec::new();
    for u in &uses {
        let curve = table.edges[u.edge].as_ref().ok()?.curve.as_ref()?;
        let [a, b] = curve.domain();
        let [from, to] = if u.reversed { [b, a] } else { [a, b] };
        let shares = (0..POINTS_PER_EDGE).map(|i| f64::from(i) / f64::from(POINTS_PER_EDGE));
        border.extend(shares.map(|share| curve.evaluate(from + share * (to - from))));
    }
    let first = *border.first()?;
    Some(border.windows(2).map(|p| (p[0] - first).cross(p[1] - first).dot(normal)).sum())
}

/// Reads arcs that run against their neighbours in all loops between their vertices in the other order, under a key that says so. Returns
/// the entities of the edges. Before that, edges that run over the ends of their curve are read as such.
pub(super) fn put_vertices_in_order(
    geometry: &GeometryReader<'_, '_>,
    ids: &[u64],
    plans: &mut FxHashMap<u64, Outcome<FacePlan>>,
    mut table: EdgeTable<'_>,
) -> Vec<u64> {
    run_over_ends(geometry, ids, plans, &mut table);
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
    let others = CompositeEdges::default();
    let context = EdgeContext { is_swapped: true, ..EdgeContext::new(false, &others) };
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

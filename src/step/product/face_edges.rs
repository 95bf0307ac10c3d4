//! The edges of a face in the order of its loops, and edges whose vertices the file has in the wrong order.

use super::loop_order::{DirectedUse, drop_opposite_loops, put_in_order};
use super::topology::{EdgeKey, FacePlan};
use crate::math::Aabb;
use crate::nurbs::Curve;
use crate::step::geometry::edges::TrimmedEdge;
use crate::step::geometry::{Outcome, Refusal};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Share of the shortest edge by which the ends of uses may differ and still follow each other: far above the gaps of real files, far
/// below the length of an edge that is run the wrong way.
const FOLLOWING_SHARE: f64 = 0.1;
/// Least distance within which they do, mm.
const FOLLOWING_MM: f64 = 1e-6;
/// An edge shorter than this has no length, mm.
pub(super) const EMPTY_EDGE_MM: f64 = 1e-9;

/// The edges of a face, in the order of its loops.
pub(super) struct FaceEdges<'e> {
    /// By place among the edges that were asked for.
    pub(super) curves: FxHashMap<usize, &'e Curve>,
    /// For each loop the edges, and whether it runs against them; loops without length are left out.
    pub(super) loops: Vec<Vec<(usize, bool)>>,
    /// Around the edges, mm.
    pub(super) bounds: Aabb,
    /// Largest distance of an edge's ends from its vertices, mm.
    pub(super) gap: f64,
    pub(super) repairs: Vec<&'static str>,
}

/// Collects the edges of a face that have a length, and puts each loop in order; fails with the first edge that cannot be had.
pub(super) fn face_edges<'e>(
    plan: &FacePlan,
    edges: &'e [Outcome<TrimmedEdge>],
    index: &FxHashMap<EdgeKey, usize>,
) -> Result<FaceEdges<'e>, &'e Refusal> {
    let mut found = FaceEdges {
        curves: FxHashMap::default(),
        loops: Vec::with_capacity(plan.loops.len()),
        bounds: Aabb::EMPTY,
        gap: 0.0,
        repairs: Vec::new(),
    };
    for uses in &plan.loops {
        for (key, _) in uses {
            let k = index[key];
            let edge = edges[k].as_ref()?;
            // The widest gap between an edge and its vertices tells how loosely points of this face hold together.
            found.gap = found.gap.max(edge.gap);
            found.repairs.extend(edge.repair.filter(|r| !found.repairs.contains(r)));
            let Some(curve) = &edge.curve else { continue };
            found.bounds = found.bounds.union(curve.bounds());
            found.curves.entry(k).or_insert(curve);
        }
        let mut kept = directed_uses(uses, edges, index);
        let tolerance = following_tolerance(&kept);
        found.repairs.extend(put_in_order(&mut kept, tolerance));
        if !kept.is_empty() {
            found.loops.push(kept.into_iter().map(|u| (u.edge, u.reversed)).collect());
        }
    }
    found.repairs.extend(drop_opposite_loops(&mut found.loops));
    Ok(found)
}

/// Returns the uses of a loop that have a length, with their ends: one without leaves no gap.
fn directed_uses(
    uses: &[(EdgeKey, bool)],
    edges: &[Outcome<TrimmedEdge>],
    index: &FxHashMap<EdgeKey, usize>,
) -> Vec<DirectedUse<usize>> {
    let directed = |&(key, reversed): &(EdgeKey, bool)| {
        let k = index[&key];
        let curve = edges[k].as_ref().ok()?.curve.as_ref()?;
        let [a, b] = curve.domain().map(|t| curve.evaluate(t));
        let (from, to) = if reversed { (b, a) } else { (a, b) };
        Some(DirectedUse { edge: k, reversed, from, to })
    };
    uses.iter().filter_map(directed).collect()
}

/// Returns the distance, mm, within which the ends of a loop's uses follow each other: shorter than its shortest edge, so that no edge can
/// be taken for a gap.
fn following_tolerance(uses: &[DirectedUse<usize>]) -> f64 {
    let lengths = uses.iter().map(|u| (u.to - u.from).length()).filter(|l| *l > EMPTY_EDGE_MM);
    (FOLLOWING_SHARE * lengths.fold(1.0, f64::min)).max(FOLLOWING_MM)
}

/// What the uses of an edge say of its direction.
#[derive(Clone, Copy, Default)]
struct Directions {
    /// Uses that follow their neighbours.
    following: u32,
    /// Uses that would if the edge ran the other way.
    against: u32,
    /// Uses in loops of two edges of which either may be the wrong one.
    either: u32,
}

/// Returns the edges, by their places in `edges`, that run against their neighbours in all of two loops or more: where a single use is the
/// wrong way round its flag is wrong, but where all are the edge itself is. Of a circle its two vertices then bound the other arc.
pub(super) fn edges_against_all_loops(
    ids: &[u64],
    plans: &FxHashMap<u64, Outcome<FacePlan>>,
    edges: &[Outcome<TrimmedEdge>],
    index: &FxHashMap<EdgeKey, usize>,
) -> Vec<usize> {
    let said = |id: &u64| -> Vec<(usize, Directions)> {
        let loops = plans.get(id).and_then(|plan| plan.as_ref().ok()).map_or(&[][..], |plan| &plan.loops);
        loops.iter().flat_map(|uses| loop_directions(directed_uses(uses, edges, index))).collect()
    };
    let said: Vec<Vec<(usize, Directions)>> = ids.par_iter().map(said).collect();
    if said.iter().flatten().all(|(_, d)| d.against == 0) {
        return Vec::new();
    }
    let mut all = vec![Directions::default(); edges.len()];
    for (edge, said) in said.into_iter().flatten() {
        let d = &mut all[edge];
        d.following += said.following;
        d.against += said.against;
        d.either += said.either;
    }
    let is_against = |d: &Directions| d.following == 0 && d.against > 0 && d.against + d.either > 1;
    (0..edges.len()).filter(|&k| is_against(&all[k])).collect()
}

/// Returns what each use of a loop says of its edge; nothing where the loop can't be closed.
fn loop_directions(uses: Vec<DirectedUse<usize>>) -> Vec<(usize, Directions)> {
    let following = Directions { following: 1, ..Directions::default() };
    let against = Directions { against: 1, ..Directions::default() };
    let either = Directions { either: 1, ..Directions::default() };
    let mut turned = uses.clone();
    let is_changed = put_in_order(&mut turned, following_tolerance(&uses)).is_some();
    let is_same_order = uses.iter().zip(&turned).all(|(a, b)| a.edge == b.edge);
    let said = |(a, b): (&DirectedUse<usize>, &DirectedUse<usize>)| {
        let direction = match (is_changed, uses.len()) {
            (true, 2) => either,
            _ if a.reversed != b.reversed => against,
            _ => following,
        };
        (a.edge, direction)
    };
    if is_same_order { uses.iter().zip(&turned).map(said).collect() } else { Vec::new() }
}

//! The edges of a face in the order of its loops.

use super::loop_order::{DirectedUse, drop_opposite_loops, put_in_order};
use super::topology::{EdgeKey, FacePlan};
use crate::math::Aabb;
use crate::nurbs::Curve;
use crate::step::geometry::edges::TrimmedEdge;
use crate::step::geometry::{EMPTY_EDGE_MM, Outcome, Refusal};
use rustc_hash::FxHashMap;

/// Share of the shortest edge by which the ends of uses may differ and still follow each other: far above the gaps of real files, far
/// below the length of an edge that is run the wrong way.
const FOLLOWING_SHARE: f64 = 0.1;
/// The least difference that is none, mm.
const LEAST_FOLLOWING_MM: f64 = 1e-6;

/// The edges of a face, in the order of its loops.
pub(super) struct FaceEdges<'e> {
    /// Curves by place among the edges that were asked for, with the distances of their ends from their vertices, mm.
    pub(super) curves: FxHashMap<usize, (&'e Curve, f64)>,
    /// For each loop the edges, and whether it runs against them; loops without length are left out.
    pub(super) loops: Vec<Vec<(usize, bool)>>,
    /// Around the edges, mm.
    pub(super) bounds: Aabb,
    /// Largest of these distances, of edges without length too.
    pub(super) gap: f64,
    pub(super) repairs: Vec<&'static str>,
}

/// Collects the edges of a face that have a length, and puts each loop in order; fails with the first edge that cannot be converted.
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
            found.repairs.extend(edge.repair.filter(|r| !found.repairs.contains(r)));
            // The widest gap between an edge and its vertices shows how loosely points of this face hold together.
            found.gap = found.gap.max(edge.gap);
            let Some(curve) = &edge.curve else { continue };
            found.bounds = found.bounds.union(curve.bounds());
            found.curves.entry(k).or_insert((curve, edge.gap));
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
pub(super) fn directed_uses(
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
pub(super) fn following_tolerance(uses: &[DirectedUse<usize>]) -> f64 {
    let lengths = uses.iter().map(|u| (u.to - u.from).length()).filter(|l| *l > EMPTY_EDGE_MM);
    (FOLLOWING_SHARE * lengths.fold(1.0, f64::min)).max(LEAST_FOLLOWING_MM)
}

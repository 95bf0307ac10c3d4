//! Rims that are whole circles begin beside each other, so that the seams of the round faces between them run straight.
//!
//! Where a file gives no seam, one is made from the vertex of the one rim to that of the other. Many files put these anywhere: the seam
//! then winds around the face, its facets are slivers along it, and faces of other solids that touch it find no sides in common. The vertex
//! of a circle that no other edge ends at may lie anywhere on it.

use super::solid_recipes::rotated;
use super::topology::{EdgeKey, FacePlan};
use super::zero_width::vertex_ids;
use crate::math::{Frame, Point};
use crate::nurbs::Curve;
use crate::step::geometry::curves::map_points;
use crate::step::geometry::edges::TrimmedEdge;
use crate::step::geometry::{GeometryReader, Outcome};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::VecDeque;

/// Share of its radius, and mm, within which a curve is a circle about an axis: what nine digits of a file leave. By so much a rim that
/// is turned about the axis may move.
const CIRCLE_SHARE: f64 = 1e-9;
/// See [`CIRCLE_SHARE`].
const CIRCLE_MM: f64 = 1e-6;
/// Places at which a curve is asked for it.
const PLACES: usize = 8;
/// Surfaces about an axis, and which of their attributes names it.
const ROUND: [(&str, usize); 5] = [
    ("CYLINDRICAL_SURFACE", 0),
    ("CONICAL_SURFACE", 0),
    ("TOROIDAL_SURFACE", 0),
    ("SPHERICAL_SURFACE", 0),
    ("SURFACE_OF_REVOLUTION", 1),
];

/// Turns rims of round faces, whole circles about their axis whose vertex is no other edge's, so that those of one face begin at one
/// azimuth; none that bounds a face of another curved kind too, whose own seam may run from that vertex. Returns the places of the vertices
/// that moved, by their ids, mm. `edges` are by the places that `index` gives.
pub(super) fn align_rims(
    geometry: &GeometryReader<'_, '_>,
    ids: &[u64],
    plans: &FxHashMap<u64, Outcome<FacePlan>>,
    (keys, index): (&[EdgeKey], &FxHashMap<EdgeKey, usize>),
    edges: &mut [Outcome<TrimmedEdge>],
) -> FxHashMap<u64, Point> {
    let mut moved: FxHashMap<u64, Point> = FxHashMap::default();
    let mut faces: Vec<(Frame, Vec<usize>)> = Vec::new();
    let mut fixed: Vec<usize> = Vec::new();
    for plan in ids.iter().filter_map(|id| plans[id].as_ref().ok()) {
        let rims = plan.loops.iter().filter(|l| l.len() == 1).map(|l| index[&l[0].0]);
        let rims: Vec<usize> = rims.collect();
        if rims.len() < 2 {
            continue;
        }
        match round_face(geometry, plan, &rims, edges) {
            Some(face) => faces.push(face),
            None if geometry.file.entity(plan.surface).is_some_and(|e| e.is_a("PLANE")) => {}
            None => fixed.extend(rims),
        }
    }
    if faces.is_empty() {
        return moved;
    }
    // Edges that end at each vertex: a circle ends twice at its own.
    let mut ends: FxHashMap<u64, usize> = FxHashMap::default();
    for vertex in keys.iter().flat_map(|key| vertex_ids(geometry.file, *key)).flatten() {
        *ends.entry(vertex).or_default() += 1;
    }
    let own_vertex = |edge: usize| match vertex_ids(geometry.file, keys[edge]) {
        [Some(a), Some(b)] if a == b && ends[&a] == 2 => Some(a),
        _ => None,
    };
    let mut beside: FxHashMap<usize, Vec<usize>> = FxHashMap::default();
    for (face, (_, rims)) in faces.iter().enumerate() {
        rims.iter().for_each(|rim| beside.entry(*rim).or_default().push(face));
    }
    // From rims that cannot move, or have, to those of the same faces: a chain of faces follows its first.
    let mut settled: FxHashSet<usize> = beside.keys().copied().filter(|rim| own_vertex(*rim).is_none()).collect();
    settled.extend(fixed);
    let is_bound = |face: &usize| faces[*face].1.iter().any(|rim| settled.contains(rim));
    let mut queue: VecDeque<usize> = (0..faces.len()).filter(is_bound).collect();
    let mut rest = 0..faces.len();
    let mut done = vec![false; faces.len()];
    while let Some(face) = queue.pop_front().or_else(|| rest.next()) {
        if std::mem::replace(&mut done[face], true) {
            continue;
        }
        let (axis, rims) = &faces[face];
        // Where none is settled yet the first stays as it is.
        let first = rims.iter().copied().find(|rim| settled.contains(rim)).unwrap_or(rims[0]);
        settled.insert(first);
        let Some((wanted, _)) = start(axis, edges, first) else { continue };
        for &rim in rims {
            let (true, Some(vertex)) = (settled.insert(rim), own_vertex(rim)) else { continue };
            let Some((azimuth, radius)) = start(axis, edges, rim) else { continue };
            let turn = wanted - azimuth;
            if let Ok(TrimmedEdge { curve: Some(curve), .. }) = &mut edges[rim]
                && 2.0 * radius * (0.5 * turn).sin().abs() > CIRCLE_MM
            {
                *curve = map_points(curve.clone(), |p| rotated(axis, turn, p));
                moved.extend(geometry.vertex(vertex).ok().map(|p| (vertex, rotated(axis, turn, p))));
            }
        }
        queue.extend(rims.iter().flat_map(|rim| &beside[rim]).filter(|face| !done[**face]));
    }
    moved
}

/// Returns the axis of a round face with two rims or more, and those of `single`, the edges that are a loop alone, that are its rims: whole
/// circles about the axis.
fn round_face(
    geometry: &GeometryReader<'_, '_>,
    plan: &FacePlan,
    single: &[usize],
    edges: &[Outcome<TrimmedEdge>],
) -> Option<(Frame, Vec<usize>)> {
    let surface = geometry.file.entity(plan.surface)?;
    let axis = ROUND.iter().find_map(|&(kind, axis)| surface.attributes(kind, 1)?.id(axis))?;
    let axis = geometry.placement(axis).ok()?;
    let is_rim = |edge: &usize| match &edges[*edge] {
        Ok(TrimmedEdge { curve: Some(curve), .. }) => is_circle(&axis, curve),
        _ => false,
    };
    let rims: Vec<usize> = single.iter().copied().filter(is_rim).collect();
    (rims.len() > 1).then_some((axis, rims))
}

/// Returns where an edge begins: the angle about the z axis of a frame, from its x axis, and the distance from it.
fn start(axis: &Frame, edges: &[Outcome<TrimmedEdge>], edge: usize) -> Option<(f64, f64)> {
    let curve = edges[edge].as_ref().ok()?.curve.as_ref()?;
    let q = axis.local_point(curve.evaluate(curve.domain()[0]));
    Some((q.y.atan2(q.x), q.x.hypot(q.y)))
}

/// Whether a closed curve is a circle about the z axis of a frame.
fn is_circle(axis: &Frame, curve: &Curve) -> bool {
    let [a, b] = curve.domain();
    let place = |k: usize| axis.local_point(curve.evaluate(a + (b - a) * k as f64 / PLACES as f64));
    let first = place(0);
    let radius = first.x.hypot(first.y);
    let near = CIRCLE_MM + CIRCLE_SHARE * radius;
    radius > near
        && (place(PLACES) - first).length() <= near
        && (1..PLACES).map(place).all(|p| (p.x.hypot(p.y) - radius).abs() <= near && (p.z - first.z).abs() <= near)
}

//! Edges without length and faces without width: both are left out, and what lay on their two sides meets.
//!
//! Of an edge without length the two vertices become one; of a face between two edges that coincide, the two edges.

use super::topology::{EdgeKey, FacePlan};
use crate::nurbs::{ControlPoint, Curve, project};
use crate::step::geometry::edges::TrimmedEdge;
use crate::step::geometry::extent::FaceExtent;
use crate::step::geometry::units::Units;
use crate::step::geometry::{GeometryReader, Outcome};
use crate::step::part21::File;
use rustc_hash::FxHashMap;

/// Distance within which points of two edges coincide, mm, besides what the edges miss their vertices by.
const COINCIDENT_MM: f64 = 1e-6;
/// Most that an edge's own gap adds to that, mm: more is no rounding of a writer.
const LARGEST_COINCIDENT_GAP_MM: f64 = 1e-3;
/// Ends of a curve nearer than this are one: no edge is shorter.
const CLOSED_MM: f64 = 1e-9;
/// Points that are compared along two edges.
const COMPARED_POINTS: usize = 33;
/// Surfaces without an end, of which a face cannot be the whole.
const UNBOUNDED: [&str; 3] = ["PLANE", "CYLINDRICAL_SURFACE", "CONICAL_SURFACE"];

/// Returns the ids of an edge's vertices, as the file orders them; `None` for each that it does not name.
pub(super) fn vertex_ids(file: &File<'_>, key: EdgeKey) -> [Option<u64>; 2] {
    match key {
        EdgeKey::Straight(a, b) | EdgeKey::Part { ends: [a, b], .. } => [Some(a), Some(b)],
        EdgeKey::Entity(id) => {
            let kinds = ["EDGE", "EDGE_CURVE", "SUBEDGE"];
            let args = file.entity(id).and_then(|e| kinds.iter().find_map(|kind| e.attributes(kind, 1)));
            [0, 1].map(|i| args.and_then(|a| a.id(i)))
        }
    }
}

/// Maps the second vertex of each edge without length, and of each closed one, to the first: such an edge is left out, and the faces on
/// both of its sides would meet in two places, with a slit between them.
pub(super) fn vertices_of_empty_edges(
    file: &File<'_>,
    keys: &[EdgeKey],
    edges: &[Outcome<TrimmedEdge>],
) -> FxHashMap<u64, u64> {
    // A chain of empty edges joins all of its vertices with the first.
    let mut joined: FxHashMap<u64, u64> = FxHashMap::default();
    for (key, edge) in keys.iter().zip(edges) {
        // Few edges are empty or closed: only of these the file is asked for the vertices.
        if edge.as_ref().is_ok_and(|edge| edge.curve.as_ref().is_none_or(ends_in_one_place))
            && let [Some(a), Some(b)] = vertex_ids(file, *key)
        {
            let (a, b) = (joined_vertex(&joined, a), joined_vertex(&joined, b));
            if a != b {
                joined.insert(b, a);
            }
        }
    }
    joined
}

/// Whether a curve, whose first and last control points are its ends, comes back to where it starts.
fn ends_in_one_place(curve: &Curve) -> bool {
    let last = curve.points.len() - 1;
    (curve.points[0].position() - curve.points[last].position()).length() <= CLOSED_MM
}

/// Returns the vertex that stands for all that empty edges join with `vertex`.
pub(super) fn joined_vertex(joined: &FxHashMap<u64, u64>, mut vertex: u64) -> u64 {
    while let Some(&before) = joined.get(&vertex) {
        vertex = before;
    }
    // Later ends at a vertex that was joined itself find the one that is left.
    vertex
}

/// Edges of a part that coincide across faces without width.
#[derive(Default)]
pub(super) struct CoincidentEdges {
    /// The number of an edge to that of the one in its place, and whether the latter runs the other way.
    replaced: FxHashMap<usize, (usize, bool)>,
}

impl CoincidentEdges {
    /// Returns the edge that stands for all that coincide with this one, and whether it runs the other way.
    pub(super) fn representative(&self, mut edge: usize) -> (usize, bool) {
        let mut opposite = false;
        while let Some(&(other, turned)) = self.replaced.get(&edge) {
            edge = other;
            opposite ^= turned;
        }
        (edge, opposite)
    }

    /// Joins two edges, of which the second runs the other way if `opposite`.
    pub(super) fn join(&mut self, [first, second]: [usize; 2], opposite: bool) {
        let (a, turned_a) = self.representative(first);
        let (b, turned_b) = self.representative(second);
        if a != b {
            self.replaced.insert(b, (a, opposite ^ turned_a ^ turned_b));
        }
    }
}

/// Finds the faces without width: those whose only edges with length are two that coincide, on a surface of which they cannot be the
/// whole. Takes these out of `plans`, has the faces beside them use one edge in place of the two, and returns their ids in the order of
/// `ids`. `joined` is that of [`vertices_of_empty_edges`].
pub(super) fn remove_faces_without_width(
    geometry: &GeometryReader<'_, '_>,
    ids: &[u64],
    plans: &mut FxHashMap<u64, Outcome<FacePlan>>,
    (keys, index): (&[EdgeKey], &FxHashMap<EdgeKey, usize>),
    (edges, joined): (&[Outcome<TrimmedEdge>], &FxHashMap<u64, u64>),
) -> Vec<u64> {
    let ends = |edge: usize| vertex_ids(geometry.file, keys[edge]).map(|id| id.map(|id| joined_vertex(joined, id)));
    let mut coincident = CoincidentEdges::default();
    let mut removed = Vec::new();
    for id in ids {
        let Some(Ok(plan)) = plans.get(id) else { continue };
        let Some([(first, forth), (second, back)]) = two_edges(plan, index, edges) else { continue };
        // A loop of two that are both run forward comes back on the second: it runs against the first.
        let opposite = forth == back;
        let (from, mut to) = (ends(first), ends(second));
        if opposite {
            to.reverse();
        }
        let (Ok(a), Ok(b)) = (&edges[first], &edges[second]) else { continue };
        if from == to
            && !from.contains(&None)
            && edges_coincide(a, b, geometry.units)
            && !may_be_whole(geometry, plan.surface, a)
        {
            coincident.join([first, second], opposite);
            removed.push(*id);
        }
    }
    if removed.is_empty() {
        return removed;
    }
    removed.iter().for_each(|id| drop(plans.remove(id)));
    for (key, reversed) in plans.values_mut().flatten().flat_map(|p| p.loops.iter_mut().flatten()) {
        let (edge, opposite) = coincident.representative(index[key]);
        *key = keys[edge];
        *reversed ^= opposite;
    }
    removed
}

/// Whether a loop along one edge and back may mean the whole of a surface, as it does of a sphere: of one that is closed or ends in two
/// poles. A single pole in the corner of a spline is where its net runs together.
fn may_be_whole(geometry: &GeometryReader<'_, '_>, surface: u64, edge: &TrimmedEdge) -> bool {
    if geometry.file.entity(surface).is_some_and(|s| s.is_one_of(&UNBOUNDED)) {
        return false;
    }
    let Some(curve) = &edge.curve else { return true };
    let extent = FaceExtent::from_bounds(curve.bounds(), &[]);
    // A surface that cannot be read is refused where its face is.
    geometry.chart(surface, extent, 0).map_or(true, |c| c.period != [None, None] || c.poles.len() > 1)
}

/// Returns the two edges of a face that have a length, and whether its loop runs against them; `None` where it has more or fewer, or one
/// twice.
fn two_edges(
    plan: &FacePlan,
    index: &FxHashMap<EdgeKey, usize>,
    edges: &[Outcome<TrimmedEdge>],
) -> Option<[(usize, bool); 2]> {
    let uses = plan.loops.iter().flatten().map(|(key, reversed)| (index[key], *reversed));
    let has_length = |(edge, _): &(usize, bool)| !matches!(&edges[*edge], Ok(TrimmedEdge { curve: None, .. }));
    // One more than is wanted shows that there are others.
    let found: Vec<(usize, bool)> = uses.filter(has_length).take(3).collect();
    let both: [(usize, bool); 2] = found.try_into().ok()?;
    (both[0].0 != both[1].0).then_some(both)
}

/// Returns the distance, mm, within which points of two edges coincide: with what they miss their vertices by.
pub(super) fn coincidence_tolerance(a: &TrimmedEdge, b: &TrimmedEdge) -> f64 {
    COINCIDENT_MM + a.gap.min(LARGEST_COINCIDENT_GAP_MM) + b.gap.min(LARGEST_COINCIDENT_GAP_MM)
}

/// Whether two edges between the same vertices coincide: both are straight, or no point of either is farther from the other than points
/// that are one to the file.
fn edges_coincide(a: &TrimmedEdge, b: &TrimmedEdge, units: Units) -> bool {
    let (Some(first), Some(second)) = (&a.curve, &b.curve) else { return false };
    // However far a writer's line misses its vertices, between two of them there is one straight line.
    let is_straight = |curve: &Curve| curve.degree == 1 && curve.points.len() == 2;
    if is_straight(first) && is_straight(second) {
        return true;
    }
    let size = first.bounds().union(second.bounds()).diagonal();
    // Each may be as far from the truth as the file says.
    let tolerance = coincidence_tolerance(a, b) + 2.0 * units.accuracy_on_face(size);
    let follows = |curve: &Curve, other: &Curve| {
        let [t0, t1] = curve.domain();
        let point = |k: usize| curve.evaluate(t0 + (t1 - t0) * k as f64 / (COMPARED_POINTS - 1) as f64);
        (0..COMPARED_POINTS).all(|k| project::nearest(other, point(k)).1 <= tolerance)
    };
    follows(first, second) && follows(second, first)
}

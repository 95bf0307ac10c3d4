//! Spikes of plane faces: where the border comes back along itself, nothing lies between. The two edges become one, and the face ends
//! before.
//!
//! The fins of bent leads are drawn so: a plate, a wall that stands on its end, and a face beside both whose border runs up the wall and
//! down again. Where one edge is longer, it is split at the vertex where the other ends, for all of its faces.

use super::topology::{EdgeKey, FacePlan};
use super::zero_width::{CoincidentEdges, coincidence_tolerance, joined_vertex, vertex_ids};
use crate::math::Point;
use crate::nurbs::Curve;
use crate::step::geometry::Outcome;
use crate::step::geometry::edges::TrimmedEdge;
use crate::step::part21::File;
use rustc_hash::FxHashMap;

/// The edges of a part, which grow where some are split: by number, and the number of each key.
pub(super) struct EdgeTable<'t> {
    pub(super) keys: &'t mut Vec<EdgeKey>,
    pub(super) index: &'t mut FxHashMap<EdgeKey, usize>,
    pub(super) edges: &'t mut Vec<Outcome<TrimmedEdge>>,
}

/// The faces, by id, that had a spike.
#[derive(Default)]
pub(super) struct SpikedFaces {
    /// Those that have lost it.
    pub(super) trimmed: Vec<u64>,
    /// Those that were nothing else, and are left out.
    pub(super) removed: Vec<u64>,
}

/// An edge by its number, and whether the loop runs against it.
type Use = (usize, bool);

/// Two uses of a loop, by their places in it, of which the second runs back along the first.
enum Retraced {
    /// All of it.
    Whole([usize; 2]),
    /// One of the two ends inside of the other: that edge is split there, at this vertex.
    Part { edge: usize, vertex: u64, at: Point },
}

/// What becomes of the edges of a part.
struct Spikes<'t, 'f, 'a> {
    file: &'f File<'a>,
    joined: &'f FxHashMap<u64, u64>,
    table: EdgeTable<'t>,
    coincident: CoincidentEdges,
    /// Of each edge that was split its two parts, the first from its start.
    parts: FxHashMap<usize, [usize; 2]>,
}

/// Takes the spikes out of the plane faces of `plans`, in the order of `ids`, splits edges and has faces use one edge where two coincide;
/// those of which nothing is left are taken out of `plans`. `joined` maps a vertex one step towards the one
/// in its place, and `table` has every edge of the plans.
pub(super) fn remove_spikes(
    file: &File<'_>,
    ids: &[u64],
    plans: &mut FxHashMap<u64, Outcome<FacePlan>>,
    table: EdgeTable<'_>,
    joined: &FxHashMap<u64, u64>,
) -> SpikedFaces {
    let mut spikes =
        Spikes { file, joined, table, coincident: CoincidentEdges::default(), parts: FxHashMap::default() };
    let mut found = SpikedFaces::default();
    for id in ids {
        let Some(Ok(plan)) = plans.get_mut(id) else { continue };
        // Elsewhere a border that comes back along itself is a seam.
        if !file.entity(plan.surface).is_some_and(|s| s.is_a("PLANE")) {
            continue;
        }
        let mut trimmed = false;
        for uses in &mut plan.loops {
            trimmed |= spikes.trim(uses);
        }
        if !trimmed {
            continue;
        }
        plan.loops.retain(|uses| uses.iter().any(|(key, _)| spikes.has_length(spikes.table.index[key])));
        if plan.loops.is_empty() {
            plans.remove(id);
            found.removed.push(*id);
        } else {
            found.trimmed.push(*id);
        }
    }
    // Faces that came before, and those on other surfaces, have the same edges.
    if !found.trimmed.is_empty() || !found.removed.is_empty() {
        for uses in plans.values_mut().flatten().flat_map(|plan| &mut plan.loops) {
            *uses = spikes.keys_of(&spikes.current(uses));
        }
    }
    found
}

impl Spikes<'_, '_, '_> {
    /// Takes the spikes out of a loop; returns whether it had any.
    fn trim(&mut self, named: &mut Vec<(EdgeKey, bool)>) -> bool {
        let mut uses = self.current(named);
        let mut had_any = false;
        while let Some(retraced) = self.find(&uses) {
            match retraced {
                // Its part and the shorter edge are the next that are found.
                Retraced::Part { edge, vertex, at } if self.split(edge, vertex, at) => {}
                Retraced::Part { .. } => break,
                Retraced::Whole([i, j]) => {
                    let [(first, forth), (second, back)] = [uses[i], uses[j]];
                    // Both run along it: as the loop turns at its end, they run against each other.
                    self.coincident.join([first, second], forth == back);
                    uses.remove(i.max(j));
                    uses.remove(i.min(j));
                }
            }
            had_any = true;
            uses = self.current(&self.keys_of(&uses));
        }
        if had_any {
            *named = self.keys_of(&uses);
        }
        had_any
    }

    /// Returns the edges that stand for those of a loop now.
    fn current(&self, named: &[(EdgeKey, bool)]) -> Vec<Use> {
        let mut out = Vec::with_capacity(named.len());
        let mut open: Vec<Use> =
            named.iter().rev().map(|(key, reversed)| (self.table.index[key], *reversed)).collect();
        while let Some((edge, reversed)) = open.pop() {
            let (edge, opposite) = self.coincident.representative(edge);
            let reversed = reversed ^ opposite;
            match self.parts.get(&edge) {
                Some(&[first, second]) => {
                    // The last is looked at first.
                    let (next, then) = if reversed { (second, first) } else { (first, second) };
                    open.extend([(then, reversed), (next, reversed)]);
                }
                None => out.push((edge, reversed)),
            }
        }
        out
    }

    /// Names uses by the keys of their edges, which outlive a renumbering, each with whether it runs against its edge.
    fn keys_of(&self, uses: &[Use]) -> Vec<(EdgeKey, bool)> {
        uses.iter().map(|&(edge, reversed)| (self.table.keys[edge], reversed)).collect()
    }

    fn has_length(&self, edge: usize) -> bool {
        !matches!(&self.table.edges[edge], Ok(TrimmedEdge { curve: None, .. }))
    }

    /// Returns the ends of a straight edge, in the order of the loop; `None` for others.
    fn line(&self, (edge, reversed): Use) -> Option<[Point; 2]> {
        let curve = self.table.edges[edge].as_ref().ok()?.curve.as_ref()?;
        let is_line = curve.degree == 1 && curve.points.len() == 2;
        let [a, b] = is_line.then(|| curve.domain().map(|t| curve.evaluate(t)))?;
        Some(if reversed { [b, a] } else { [a, b] })
    }

    /// Returns the vertices of an edge, in the order of the loop.
    fn vertices(&self, (edge, reversed): Use) -> Option<[u64; 2]> {
        let [a, b] =
            vertex_ids(self.file, self.table.keys[edge]).map(|id| id.map(|id| joined_vertex(self.joined, id)));
        let (a, b) = (a?, b?);
        Some(if reversed { [b, a] } else { [a, b] })
    }

    /// Returns the first two successive uses of which one retraces the other; edges of no length are skipped, and the last use precedes
    /// the first.
    fn find(&self, uses: &[Use]) -> Option<Retraced> {
        let places: Vec<usize> = (0..uses.len()).filter(|&k| self.has_length(uses[k].0)).collect();
        let pairs = (0..places.len()).map(|k| [places[k], places[(k + 1) % places.len()]]);
        pairs.into_iter().find_map(|pair| self.retraced(uses, pair))
    }

    /// Says how the second of two uses runs back along the first; `None` where it does not.
    fn retraced(&self, uses: &[Use], pair: [usize; 2]) -> Option<Retraced> {
        let [first, second] = pair.map(|k| uses[k]);
        // One edge that is run there and back is a cut into the face.
        if first.0 == second.0 {
            return None;
        }
        let ([from, turn], [back, to]) = (self.line(first)?, self.line(second)?);
        let tolerance = match (&self.table.edges[first.0], &self.table.edges[second.0]) {
            (Ok(a), Ok(b)) => coincidence_tolerance(a, b),
            _ => return None,
        };
        // By their places first: few edges come back, and the file is asked for the vertices of these alone.
        let near = |p: Point, q: Point| (p - q).length() <= tolerance;
        let longer = if (turn - from).length() > (to - back).length() { first } else { second };
        let (far, other) = if longer == first { (to, from) } else { (from, to) };
        let along = other - turn;
        let share = (far - turn).dot(along) / along.length_squared();
        if !near(turn, back) || near(far, turn) || !near(far, turn + along * share) || !(share > 0.0) {
            return None;
        }
        let ([start, end], [next, last]) = (self.vertices(first)?, self.vertices(second)?);
        if end != next {
            return None;
        }
        if start == last {
            return near(from, to).then_some(Retraced::Whole(pair));
        }
        let vertex = if longer == first { last } else { start };
        (!near(far, other)).then_some(Retraced::Part { edge: longer.0, vertex, at: far })
    }

    /// Splits an edge at a vertex inside of it; `false`, and nothing done, for an edge that no entity of the file names.
    fn split(&mut self, edge: usize, vertex: u64, at: Point) -> bool {
        let key = self.table.keys[edge];
        let (EdgeKey::Entity(entity) | EdgeKey::Part { entity, .. }) = key else { return false };
        let ([Some(a), Some(b)], Some([from, to])) = (vertex_ids(self.file, key), self.line((edge, false))) else {
            return false;
        };
        let Ok(TrimmedEdge { gap, repair, .. }) = self.table.edges[edge] else { return false };
        let parts = [([a, vertex], [from, at]), ([vertex, b], [at, to])].map(|(ends, [p, q])| {
            let curve = Curve::line(p, q, [0.0, (q - p).length()]);
            let key = EdgeKey::Part { entity, ends };
            self.table.keys.push(key);
            self.table.edges.push(Ok(TrimmedEdge { curve: Some(curve), gap, repair, is_arc: false }));
            self.table.index.insert(key, self.table.keys.len() - 1);
            self.table.keys.len() - 1
        });
        self.parts.insert(edge, parts);
        true
    }
}

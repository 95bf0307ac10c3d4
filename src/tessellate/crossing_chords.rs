//! Chords of a face's border that cross in the parameter plane, and the samples that keep them apart.
//!
//! Between two arcs that touch, chords cross however short they are: near the cusp the arcs are nearer to each other than any chord to
//! its arc. With corners in the same places on both they bend alike and stay apart. Where edges themselves cross, both get a corner there.

use super::face_surface::FaceSurface;
use super::meetings::MeetingSamples;
use super::nodes::{Nodes, edge_key};
use crate::math::{Point, Uv};
use crate::model::{EdgeId, Part, TrimLoop};
use crate::nurbs::{Curve, UvCurve};
use crate::tessellate::proof::flat_triangle::distance_to_chord;
use rustc_hash::FxHashMap;

/// The piece of an edge that a segment of the border follows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Followed {
    pub(super) edge: EdgeId,
    /// From where to where, in the edge's parameter.
    pub(super) t: [f64; 2],
}

/// Pairs of segments that are looked at: faces that cross themselves everywhere gain nothing by more.
const MAX_PAIRS: usize = 2000;
/// Crossings that are kept, 72 bytes each: by the first of them an edge is judged that has more.
const MAX_CROSSINGS: usize = 100_000;
/// Share of a chord that a further corner keeps from its ends.
const CLEAR_OF_ENDS: f64 = 0.02;
/// Steps by a third that find the nearest place on a chord's arc: to a millionth of it.
const NEAREST_STEPS: usize = 34;
/// Steps in which the place where two edges cross is found: each leaves a share of what was missing, about the angle by which edges turn
/// from their chords, in radians. From a half, 50 steps reach rounding.
const MEETING_STEPS: usize = 50;

/// A chord, by its nodes, and the edge that it follows.
type FollowedChord = ([u32; 2], Followed);

/// Two chords of a border that cross in the parameter plane.
struct Crossing {
    chords: [FollowedChord; 2],
    /// How far the nearest of their ends is from the other chord, mm.
    depth: f64,
    /// Whether they cross no farther than both sag: their edges may not cross at all.
    is_for_sag: bool,
    /// Whether they cross farther than both sag and than the tolerance.
    is_deep: bool,
}

/// The chords of a face's border that could not all be kept.
pub(super) struct CrossingChords<'c> {
    part: &'c Part,
    nodes: &'c Nodes,
    crossings: Vec<Crossing>,
    /// Edges of chords that only touch others.
    touching: Vec<EdgeId>,
}

impl<'c> CrossingChords<'c> {
    /// Finds which of the chords in `conflicts` and in `crossed` cross; `followed` are the edges by chord.
    pub(super) fn new(
        part: &'c Part,
        surface: &FaceSurface<'_>,
        nodes: &'c Nodes,
        followed: &FxHashMap<[u32; 2], Followed>,
        [conflicts, crossed]: [&[[u32; 2]]; 2],
    ) -> Self {
        let known = |list: &[[u32; 2]]| -> Vec<FollowedChord> {
            list.iter().filter_map(|s| Some((*s, *followed.get(&edge_key(s[0], s[1]))?))).collect()
        };
        let [conflicts, crossed] = [known(conflicts), known(crossed)];
        let uv = |s: [u32; 2]| s.map(|n| nodes[n].uv);
        let place = |s: [u32; 2]| s.map(|n| nodes[n].place);
        let sag = |(ends, on): FollowedChord| {
            let curve = &part.edges[on.edge.0 as usize].curve;
            // Near a pole what is straight in parameters bows farther than the edge does.
            let [a, b] = uv(ends);
            let middles = [curve.evaluate(0.5 * (on.t[0] + on.t[1])), surface.point(0.5 * (a + b))];
            middles.map(|p| distance_to_chord(p, &place(ends))).into_iter().fold(0.0, f64::max)
        };
        // Edges that cross farther than their chords sag do so themselves: corners in one place would only hide it.
        let crossing = |a: FollowedChord, b: FollowedChord| {
            let beyond = |ends: [Point; 2], chord: &[Point; 2]| ends.map(|p| distance_to_chord(p, chord));
            let (p, q) = (place(a.0), place(b.0));
            let depth = beyond(p, &q).into_iter().chain(beyond(q, &p)).fold(f64::INFINITY, f64::min);
            let is_for_sag = depth <= sag(a) + sag(b);
            let is_deep = !is_for_sag && depth > surface.tolerance(uv(a.0)[0]);
            Crossing { chords: [a, b], depth, is_for_sag, is_deep }
        };
        let mut out = Self { part, nodes, crossings: Vec::new(), touching: Vec::new() };
        let mut crosses = [vec![false; conflicts.len()], vec![false; crossed.len()]];
        for (i, &a) in conflicts.iter().enumerate() {
            for (j, &b) in crossed.iter().enumerate() {
                if do_cross(uv(a.0), uv(b.0)) {
                    (crosses[0][i], crosses[1][j]) = (true, true);
                    out.crossings.push(crossing(a, b));
                    if out.crossings.len() == MAX_CROSSINGS {
                        return out;
                    }
                }
            }
        }
        let all = conflicts.iter().chain(&crossed).zip(crosses.iter().flatten());
        out.touching.extend(all.filter(|(_, crosses)| !**crosses).map(|((_, on), _)| on.edge));
        out
    }

    /// Returns the edges, some more than once, whose chords may cross for being too long: those of chords that only touch others, and those
    /// of which at least half the crossings are for sag. Where an edge crosses others itself, shorter chords cross as well, and more of
    /// them.
    pub(super) fn edges_for_sag(&self) -> Vec<EdgeId> {
        let mut counts: FxHashMap<EdgeId, [usize; 2]> = FxHashMap::default();
        for crossing in &self.crossings {
            for (_, on) in crossing.chords {
                let [all, for_sag] = counts.entry(on.edge).or_default();
                (*all, *for_sag) = (*all + 1, *for_sag + usize::from(crossing.is_for_sag));
            }
        }
        let edges = self.crossings.iter().flat_map(|c| c.chords.map(|(_, on)| on.edge));
        let short_of = |edge: &EdgeId| counts.get(edge).is_some_and(|[all, for_sag]| 2 * for_sag >= *all);
        edges.filter(short_of).chain(self.touching.iter().copied()).collect()
    }

    /// Returns, for each two chords that cross, the parameters of both edges nearest to the ends of the other's chord, its own ends left
    /// out. Only pairs of different edges count that cross no farther than both chords sag, and the first [`MAX_PAIRS`] of them.
    pub(super) fn facing_samples(&self) -> Vec<(EdgeId, f64)> {
        let mut samples = Vec::new();
        let of_two = |c: &&Crossing| c.chords[0].1.edge != c.chords[1].1.edge && c.is_for_sag;
        for Crossing { chords: [a, b], .. } in self.crossings.iter().filter(of_two).take(MAX_PAIRS) {
            for (ends, on) in [(a.0, b.1), (b.0, a.1)] {
                let curve = &self.part.edges[on.edge.0 as usize].curve;
                let facing = ends.iter().filter_map(|&n| place_between(curve, on.t, self.nodes[n].place));
                samples.extend(facing.map(|t| (on.edge, t)));
            }
        }
        samples
    }

    /// Returns, for each two chords that cross deeply, the parameters of both edges where these cross: the first [`MAX_PAIRS`] of them.
    /// Left out are edges that `loops`, those of the face, have more than once, and those that pass each other in space.
    pub(super) fn meeting_samples(&self, loops: &[TrimLoop], surface: &FaceSurface<'_>) -> Vec<MeetingSamples> {
        let curve_of = |edge: EdgeId| {
            let mut uses = loops.iter().flat_map(|l| &l.uses).filter(|u| u.edge == Some(edge));
            uses.next().filter(|_| uses.next().is_none()).map(|u| &u.uv)
        };
        let meeting = |crossing: &Crossing| {
            let [a, b] = crossing.chords.map(|(_, on)| on);
            let t = meeting_parameters([curve_of(a.edge)?, curve_of(b.edge)?], [a.t, b.t])?;
            let samples = [(a.edge, t[0]), (b.edge, t[1])];
            let [p, q] = samples.map(|(edge, t)| self.part.edges[edge.0 as usize].curve.evaluate(t));
            (p.distance(q) <= surface.rounding).then_some(samples)
        };
        self.crossings.iter().filter(|c| c.is_deep).take(MAX_PAIRS).filter_map(meeting).collect()
    }

    /// Returns how far, mm, facets are from the border at least, where chords that cross deeply are left out of it; 0 where none are.
    pub(super) fn left_out_mm(&self) -> f64 {
        self.crossings.iter().filter(|c| c.is_deep).map(|c| c.depth).fold(0.0, f64::max)
    }
}

/// Returns the parameters at which two curves, of the same surface and each over its own interval `t`, cross; `None` where no crossing is
/// found between the ends of both. The chords of both stand for their derivatives.
fn meeting_parameters(curves: [&UvCurve; 2], t: [[f64; 2]; 2]) -> Option<[f64; 2]> {
    let parameter = |k: usize, share: f64| t[k][0] + share * (t[k][1] - t[k][0]);
    let at = |k: usize, share: f64| curves[k].evaluate(parameter(k, share));
    let along = [0, 1].map(|k| at(k, 1.0) - at(k, 0.0));
    let cross = along[0].perp_dot(along[1]);
    if cross == 0.0 || !cross.is_finite() {
        return None;
    }
    let mut shares = [0.5; 2];
    for _ in 0..MEETING_STEPS {
        let gap = at(1, shares[1]) - at(0, shares[0]);
        let steps = [gap.perp_dot(along[1]) / cross, gap.perp_dot(along[0]) / cross];
        if steps.iter().any(|step| !step.is_finite()) {
            return None;
        }
        shares = [0, 1].map(|k| (shares[k] + steps[k]).clamp(0.0, 1.0));
    }
    // However near an end is as a share of its chord, a crossing as deep as this is not in it.
    let is_inside = shares.iter().all(|share| *share > 0.0 && *share < 1.0);
    is_inside.then(|| [0, 1].map(|k| parameter(k, shares[k])))
}

/// Whether two segments have a point between the ends of both.
fn do_cross([a, b]: [Uv; 2], [c, d]: [Uv; 2]) -> bool {
    let side = |p: Uv, q: Uv, x: Uv| (q - p).perp_dot(x - p);
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

/// Returns the parameter of the place nearest to `p` on a short piece of a curve; `None` within [`CLEAR_OF_ENDS`] of an end.
fn place_between(curve: &Curve, [t0, t1]: [f64; 2], p: Point) -> Option<f64> {
    let off = |t: f64| (curve.evaluate(t) - p).length();
    let (mut lo, mut hi) = (t0.min(t1), t0.max(t1));
    let margin = CLEAR_OF_ENDS * (hi - lo);
    let inside = lo + margin..hi - margin;
    for _ in 0..NEAREST_STEPS {
        let (x, y) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
        if off(x) < off(y) { hi = y } else { lo = x }
    }
    let t = 0.5 * (lo + hi);
    inside.contains(&t).then_some(t)
}

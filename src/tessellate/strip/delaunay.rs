//! Between the whole cells and the border: constrained Delaunay in parameters scaled by curvature, refined where a
//! triangle cannot be proved.

use super::sector;
use crate::math::{Point, Uv};
use crate::model::EdgeId;
use crate::tessellate::border::trim::Trim;
use crate::tessellate::proof::bound::Prover;
use crate::tessellate::settings::Judge;
use crate::tessellate::sheet::Sheet;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

/// A corner of the strip.
#[derive(Clone, Copy, Debug)]
pub(in crate::tessellate) struct Node {
    pub(in crate::tessellate) uv: Uv,
    pub(in crate::tessellate) place: Point,
    /// Shared or own position; see [`crate::tessellate::border::rings::RingVertex`].
    pub(in crate::tessellate) position: u32,
}

/// What is to be triangulated.
pub(in crate::tessellate) struct Outline<'t> {
    pub(in crate::tessellate) nodes: Vec<Node>,
    /// Constraint segments, each turning outside into inside.
    pub(in crate::tessellate) segments: Vec<[u32; 2]>,
    /// Lines inside that no triangle crosses; refinement may divide them.
    pub(in crate::tessellate) creases: Vec<[u32; 2]>,
    /// What border segments follow.
    pub(in crate::tessellate) trims: &'t FxHashMap<[u32; 2], Trim>,
    /// Multiplies parameters before triangulating.
    pub(in crate::tessellate) scale: Uv,
    /// First free own position.
    pub(in crate::tessellate) next: u32,
}

/// Triangles on the outline's nodes (refinement appends some), counter-clockwise in parameters.
pub(in crate::tessellate) struct Strip {
    pub(in crate::tessellate) nodes: Vec<Node>,
    pub(in crate::tessellate) triangles: Vec<[u32; 3]>,
    pub(in crate::tessellate) bounds: Vec<f64>,
    pub(in crate::tessellate) tolerances: Vec<f64>,
    /// Segments that could not be kept because they cross others.
    pub(in crate::tessellate) conflicts: Vec<[u32; 2]>,
    /// Those that are kept and crossed by them.
    pub(in crate::tessellate) crossed: Vec<[u32; 2]>,
}

impl Strip {
    /// Chords of the border beside triangles that are not proved, where shorter ones may help: not on edges that the file has farther
    /// from the face than the tolerance somewhere.
    pub(in crate::tessellate) fn unproved_chords(
        &self,
        trims: &FxHashMap<[u32; 2], Trim>,
        followed: &FxHashMap<[u32; 2], EdgeId>,
    ) -> Vec<[u32; 2]> {
        let stands = self.bounds.iter().zip(&self.tolerances);
        let unproved = self.triangles.iter().zip(stands).filter(|(_, (bound, xi))| bound > xi);
        let sides = unproved.flat_map(|(t, (_, &xi))| [0, 1, 2].map(|k| (key(t[k], t[(k + 1) % 3]), xi)));
        let beside: Vec<([u32; 2], f64)> = sides.filter(|(s, _)| trims.contains_key(s)).collect();
        let mut gaps: FxHashMap<EdgeId, f64> = FxHashMap::default();
        if !beside.is_empty() {
            for (side, edge) in followed {
                let gap = gaps.entry(*edge).or_insert(0.0);
                *gap = gap.max(trims.get(side).map_or(0.0, |t| t.gap));
            }
        }
        let gap = |side: &[u32; 2]| followed.get(side).and_then(|e| gaps.get(e)).copied().unwrap_or(f64::INFINITY);
        beside.into_iter().filter(|(side, xi)| gap(side) < WIDEST * xi).map(|(side, _)| side).collect()
    }
}

#[derive(Clone, Copy)]
struct Vertex {
    at: Point2<f64>,
    node: u32,
}

impl HasPosition for Vertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.at
    }
}

type Cdt = ConstrainedDelaunayTriangulation<Vertex>;

/// Sorted pair of nodes.
pub(in crate::tessellate) fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Rounds of refinement.
const ROUNDS: usize = 40;
/// Share of a tolerance that the file's own gap may take for shorter chords to help.
const WIDEST: f64 = 0.97;
/// Share of the largest excess from which triangles are refined once the budget has ended.
const WORST: f64 = 0.25;
/// Triangles that all rounds together go through: each looks at all, which on a strip of 500,000 takes most of a second.
const MOST_WORK: usize = 8_000_000;

/// Triangulates; `None` when not even a triangulation of the points exists.
pub(in crate::tessellate) fn triangulate(
    sheet: &Sheet<'_>,
    judge: Judge,
    outline: Outline<'_>,
    budget: usize,
) -> Option<Strip> {
    let mut work = Work {
        sheet,
        nodes: outline.nodes,
        scale: outline.scale,
        next: outline.next,
        cdt: Cdt::new(),
        odd: FxHashMap::default(),
        handles: Vec::new(),
    };
    let (mut conflicts, mut crossed) = (Vec::new(), Vec::new());
    // Nodes inside whole cells are left out, but in a long outline they keep the region that a constraint clears small.
    let mut used = vec![outline.segments.len() > 4000; work.nodes.len()];
    outline.segments.iter().flatten().for_each(|&n| used[n as usize] = true);
    for (n, used) in (0..).zip(used) {
        let handle = if used { Some(work.insert(n)?) } else { None };
        work.handles.push(handle);
    }
    for &[a, b] in &outline.segments {
        if !work.constrain(a, b) {
            conflicts.push([a, b]);
            crossed.extend(work.crossed(a, b));
        }
    }
    for &[a, b] in &outline.creases {
        work.hold(a, b);
    }
    let rings = (!conflicts.is_empty()).then_some(&outline.segments);
    let mut known: FxHashMap<[u32; 3], (f64, f64)> = FxHashMap::default();
    let (initial, budget) = (work.cdt.num_vertices(), budget.max(work.cdt.num_vertices()));
    let most = (initial * 6 + 4000).min(budget);
    let mut before = 0;
    for round in 0..=ROUNDS {
        let triangles = work.inside(rings);
        let mut stands: Vec<Option<(f64, f64)>> =
            triangles.iter().map(|&t| known.get(&sorted(t)).copied()).collect();
        let new = triangles.iter().zip(&stands).filter(|(_, s)| s.is_none());
        let fresh: Vec<[u32; 3]> = new.map(|(&t, _)| t).collect();
        let proved: Vec<(f64, f64)> = fresh
            .par_iter()
            .with_min_len(16)
            .map_init(
                || Prover::new(sheet, judge),
                |prover, &t| prove(sheet, prover, 1.0, &work.nodes, t, outline.trims),
            )
            .collect();
        known.extend(fresh.iter().map(|&t| sorted(t)).zip(proved.iter().copied()));
        stands.iter_mut().filter(|s| s.is_none()).zip(proved).for_each(|(s, new)| *s = Some(new));
        let over = |&(t, s): &(&[u32; 3], (f64, f64))| s.0 > s.1 || work.turn(*t).is_some();
        let stands = || stands.iter().flatten().copied();
        let mut bad: Vec<([u32; 3], (f64, f64))> =
            triangles.iter().zip(stands()).filter(over).map(|(&t, s)| (t, s)).collect();
        // Beyond the usual measure only what is about to hold goes on: the flank of a thread of 20 m has no whole cells, and is done after
        // 12 times the corners of its border.
        let (corners, falls) = (work.cdt.num_vertices(), 5 * bad.len() < 4 * before);
        before = bad.len();
        if corners >= most && !falls {
            // Where all cannot hold, the worst come first.
            let excess = |(_, (bound, xi)): &([u32; 3], (f64, f64))| bound / xi;
            let worst = bad.iter().map(excess).fold(0.0, f64::max);
            bad.retain(|t| excess(t) >= WORST * worst);
        }
        if bad.is_empty()
            || round == ROUNDS
            || (round + 1) * triangles.len() > MOST_WORK
            || corners >= if falls { budget } else { most + most / 4 }
            || !work.refine(&bad, outline.trims)
        {
            let (bounds, tolerances) = stands().unzip();
            return Some(Strip { nodes: work.nodes, triangles, bounds, tolerances, conflicts, crossed });
        }
    }
    None
}

pub(super) fn sorted(mut t: [u32; 3]) -> [u32; 3] {
    t.sort_unstable();
    t
}

/// Bound and tolerance of one triangle, the border's own deviation included; a bound above `slack` tolerances may be none.
pub(in crate::tessellate) fn prove(
    sheet: &Sheet<'_>,
    prover: &mut Prover<'_, '_>,
    slack: f64,
    nodes: &[Node],
    t: [u32; 3],
    trims: &FxHashMap<[u32; 2], Trim>,
) -> (f64, f64) {
    let n = t.map(|i| nodes[i as usize]);
    let uv = n.map(|x| x.uv);
    let xyz = n.map(|x| x.place);
    let xi = if sheet.affine {
        sheet.field.loosest()
    } else {
        uv.iter().fold(sheet.tolerance((uv[0] + uv[1] + uv[2]) / 3.0), |x, &p| x.min(sheet.tolerance(p)))
    };
    let limit = xi * slack;
    let sides = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (i, j, trims.get(&key(t[i], t[j]))));
    if let Some(bound) = sector::bound(prover, uv, xyz, sides.map(|s| s.2), limit) {
        return (bound, xi);
    }
    if let Some(bound) = sector::line(sheet, uv, t, trims) {
        return (bound, xi);
    }
    // What is left with two corners in one place: the two ends of a closed curve are a point too, but the curve between them is not,
    // and must be divided.
    let line = sides.iter().any(|&(i, j, _)| n[i].position == n[j].position);
    let mut worst = 0f64;
    for trim in sides.iter().filter_map(|s| s.2) {
        worst = worst.max(trim.bound(prover, xyz, limit));
        if worst > limit {
            return (worst, xi);
        }
    }
    if !line && let Some(bound) = prover.facet(uv, xyz, false, limit) {
        return (worst.max(bound), xi);
    }
    for (i, j, _) in sides.into_iter().filter(|s| s.2.is_none()) {
        worst = worst.max(prover.side([uv[i], uv[j]], [xyz[i], xyz[j]], limit));
    }
    if worst > limit || line {
        return (worst, xi);
    }
    (worst.max(prover.piece(uv, xyz, limit)), xi)
}

pub(super) struct Work<'s, 'a> {
    pub(super) sheet: &'s Sheet<'a>,
    pub(super) nodes: Vec<Node>,
    scale: Uv,
    pub(super) next: u32,
    cdt: Cdt,
    /// How often each constraint edge of the triangulation turns outside into inside.
    pub(super) odd: FxHashMap<[u32; 2], u32>,
    /// Of those nodes that are in the triangulation.
    pub(super) handles: Vec<Option<spade::handles::FixedVertexHandle>>,
}

impl Work<'_, '_> {
    pub(super) fn insert(&mut self, n: u32) -> Option<spade::handles::FixedVertexHandle> {
        let at = self.scaled(self.nodes[n as usize].uv)?;
        let before = self.cdt.num_vertices();
        let handle = self.cdt.insert(Vertex { at, node: n }).ok()?;
        if self.cdt.num_vertices() == before {
            // The place was taken: its first owner keeps it.
            let first = self.handles.iter().position(|&h| h == Some(handle)).unwrap_or(n as usize) as u32;
            self.cdt.vertex_data_mut(handle).node = first;
        }
        Some(handle)
    }

    fn scaled(&self, uv: Uv) -> Option<Point2<f64>> {
        let clean = |x: f64| if x.abs() < 1e-30 { 0.0 } else { x };
        let p = uv * self.scale;
        (p.is_finite() && p.abs().max_element() < 1e30).then(|| Point2::new(clean(p.x), clean(p.y)))
    }

    /// Whether a point can be added without splitting a constraint or meeting a vertex, be it but for rounding: between corners one
    /// rounding apart on a crease stood facets without width.
    pub(super) fn is_free(&self, uv: Uv) -> bool {
        use spade::PositionInTriangulation as At;
        let apart = |p: Point2<f64>, v: Point2<f64>| {
            (p.x - v.x).abs() > 1e-14 * p.x.abs() || (p.y - v.y).abs() > 1e-14 * p.y.abs()
        };
        self.scaled(uv).is_some_and(|p| match self.cdt.locate(p) {
            At::OnFace(f) => self.cdt.face(f).vertices().iter().all(|v| apart(p, v.position())),
            At::OnEdge(e) => {
                let e = self.cdt.directed_edge(e);
                let border = || self.odd.contains_key(&key(e.from().data().node, e.to().data().node));
                (!e.is_constraint_edge() || !border()) && e.vertices().iter().all(|v| apart(p, v.position()))
            }
            _ => false,
        })
    }

    fn constrain(&mut self, a: u32, b: u32) -> bool {
        let (Some(from), Some(to)) = (self.handles[a as usize], self.handles[b as usize]) else { return false };
        if from == to {
            return true;
        }
        let made = self.cdt.try_add_constraint(from, to);
        for edge in &made {
            let e = self.cdt.directed_edge(*edge);
            *self.odd.entry(key(e.from().data().node, e.to().data().node)).or_insert(0) += 1;
        }
        !made.is_empty()
    }

    /// Keeps triangles from crossing a line that bounds nothing, where the border leaves it.
    fn hold(&mut self, a: u32, b: u32) {
        if let (Some(from), Some(to)) = (self.handles[a as usize], self.handles[b as usize])
            && from != to
        {
            self.cdt.try_add_constraint(from, to);
        }
    }

    /// The constraints that keep a segment out.
    fn crossed(&self, a: u32, b: u32) -> Vec<[u32; 2]> {
        let (Some(from), Some(to)) = (self.handles[a as usize], self.handles[b as usize]) else {
            return Vec::new();
        };
        let edges = self.cdt.get_conflicting_edges_between_vertices(from, to);
        edges.map(|e| [e.from().data().node, e.to().data().node]).collect()
    }

    /// Triangles inside: by crossing constraints from outside; by their centres when constraints are missing.
    fn inside(&self, rings: Option<&Vec<[u32; 2]>>) -> Vec<[u32; 3]> {
        let name =
            |f: spade::handles::FaceHandle<'_, spade::handles::InnerTag, Vertex, (), spade::CdtEdge<()>, ()>| {
                f.vertices().map(|v| v.data().node)
            };
        if let Some(segments) = rings {
            let uv = |n: u32| self.nodes[n as usize].uv;
            return self
                .cdt
                .inner_faces()
                .map(name)
                .filter(|t| {
                    let p = (uv(t[0]) + uv(t[1]) + uv(t[2])) / 3.0;
                    segments.iter().fold(false, |odd, &[a, b]| {
                        let (a, b) = (uv(a), uv(b));
                        let crosses =
                            (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
                        odd != crosses
                    })
                })
                .collect();
        }
        let mut state: Vec<Option<bool>> = vec![None; self.cdt.num_all_faces()];
        let mut queue = std::collections::VecDeque::from([self.cdt.outer_face().fix()]);
        state[self.cdt.outer_face().index()] = Some(false);
        // Breadth first over directed edges; the outer face's are found through the hull.
        while let Some(face) = queue.pop_front() {
            let inside = state[face.index()] == Some(true);
            let edges: Vec<_> = match self.cdt.face(face).as_inner() {
                Some(inner) => inner.adjacent_edges().to_vec(),
                None => self.cdt.convex_hull().collect(),
            };
            for e in edges {
                // Hull edges run along the outer face or against it, by version; take the unknown side.
                for side in [e, e.rev()] {
                    let next = side.face();
                    if state[next.index()].is_some() {
                        continue;
                    }
                    let turns = e.is_constraint_edge()
                        && self.odd.get(&key(e.from().data().node, e.to().data().node)).is_some_and(|n| n % 2 == 1);
                    state[next.index()] = Some(inside != turns);
                    queue.push_back(next.fix());
                }
            }
        }
        self.cdt.inner_faces().filter(|f| state[f.index()] == Some(true)).map(name).collect()
    }
}

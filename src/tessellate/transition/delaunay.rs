//! Between the whole cells and the border: constrained Delaunay in parameters scaled by curvature, refined where a
//! triangle cannot be proved.

use super::sides::Sides;
use crate::math::Uv;
use crate::model::EdgeId;
use crate::tessellate::border::enclosure::Enclosure;
use crate::tessellate::crossing_chords::Followed;
use crate::tessellate::face_surface::FaceSurface;
use crate::tessellate::nodes::{Nodes, ProvedFacet, edge_key};
use crate::tessellate::proof::border_chord::BorderChords;
use crate::tessellate::proof::facet::prove_triangle;
use crate::tessellate::proof::prover::Prover;
use crate::tessellate::settings::Acceptance;
use crate::tessellate::taken_chords::TakenChords;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

/// What is to be triangulated.
pub(in crate::tessellate) struct Outline<'t> {
    pub(in crate::tessellate) nodes: Nodes,
    /// Constraint segments, each turning outside into inside.
    pub(in crate::tessellate) segments: Vec<[u32; 2]>,
    /// Lines inside that no triangle crosses; refinement may divide them.
    pub(in crate::tessellate) creases: Vec<[u32; 2]>,
    /// Lines inside that no triangle crosses and nothing divides.
    pub(in crate::tessellate) imprinted: Vec<[u32; 2]>,
    /// How far edges stray from the segments of the border.
    pub(in crate::tessellate) chords: &'t BorderChords,
    /// Multiplies parameters before triangulating.
    pub(in crate::tessellate) scale: Uv,
    /// Chords that no side of a triangle may be, but for those of the border.
    pub(in crate::tessellate) taken: &'t TakenChords,
}

/// Triangles on the outline's nodes; refinement appends some.
pub(in crate::tessellate) struct Transition {
    pub(in crate::tessellate) nodes: Nodes,
    pub(in crate::tessellate) triangles: Vec<ProvedFacet<3>>,
    /// Segments that could not be kept because they cross others, or an end of which was not inserted.
    pub(in crate::tessellate) conflicts: Vec<[u32; 2]>,
    /// Those that are kept and crossed by them.
    pub(in crate::tessellate) crossed: Vec<[u32; 2]>,
    /// Whether all imprinted lines are edges of the triangulation.
    pub(in crate::tessellate) holds_imprint: bool,
}

impl Transition {
    /// Returns the chords of the border beside triangles that are not proved, where shorter ones may help: not on edges whose gap in the
    /// file, anywhere along them, takes [`WIDEST_GAP`] of the tolerance. Some come twice. `followed` are the edges by chord.
    pub(in crate::tessellate) fn unproved_chords(
        &self,
        chords: &BorderChords,
        followed: &FxHashMap<[u32; 2], Followed>,
    ) -> Vec<[u32; 2]> {
        let sides = |f: &ProvedFacet<3>| {
            let (t, xi) = (f.nodes, f.tolerance);
            [0, 1, 2].map(|k| (edge_key(t[k], t[(k + 1) % 3]), xi))
        };
        let unproved = self.triangles.iter().filter(|f| f.bound > f.tolerance).flat_map(sides);
        let at_border: Vec<([u32; 2], f64)> = unproved.filter(|(s, _)| chords.contains_key(s)).collect();
        if at_border.is_empty() {
            return Vec::new();
        }
        // By edge of the file, whose gap is the same whichever of its chords fails.
        let mut gaps: FxHashMap<EdgeId, f64> = FxHashMap::default();
        for (side, piece) in followed {
            if let Some(chord) = chords.get(side) {
                let gap = gaps.entry(piece.edge).or_insert(0.0);
                *gap = gap.max(chord.gap);
            }
        }
        let gap =
            |side: &[u32; 2]| followed.get(side).and_then(|f| gaps.get(&f.edge)).copied().unwrap_or(f64::INFINITY);
        // A gap near the tolerance cannot be mended by shorter chords, which follow the edge and not the surface.
        at_border.into_iter().filter(|(side, xi)| gap(side) < WIDEST_GAP * xi).map(|(side, _)| side).collect()
    }
}

/// A node in the triangulation, at its scaled parameters.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    at: Point2<f64>,
    pub(super) node: u32,
}

impl HasPosition for Vertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// The triangulation of the library.
pub(super) type Cdt = ConstrainedDelaunayTriangulation<Vertex>;

/// Rounds of refinement.
const MAX_ROUNDS: usize = 40;
/// Share of a tolerance that the file's own gap may take for shorter chords to help.
const WIDEST_GAP: f64 = 0.97;
/// Share of the largest excess from which triangles are refined once the budget has ended.
const WORST: f64 = 0.25;
/// Triangles that all rounds together go through: each looks at all, which on a transition of 500,000 takes most of a second.
const MAX_WORK: usize = 8_000_000;
/// Segments from which on nodes inside whole cells stay in: they keep the region that a constraint clears small.
const LONG_OUTLINE: usize = 4000;
/// Coordinates below the first, which spade refuses, are zero; those above the second lose the exactness of its predicates.
const COORDINATES: [f64; 2] = [1e-30, 1e30];
/// Share of the domain, or of a coordinate that is larger, within which two places are one: some fifty roundings.
const SAME_COORDINATE: f64 = 1e-14;

/// How many corners refinement may make.
struct Limits {
    /// Up to here all that do not hold are refined.
    usual: usize,
    /// Up to here as long as those that do not hold become fewer.
    budget: usize,
}

impl Limits {
    /// `corners` are those at the start; the budget is never below them.
    fn new(corners: usize, budget: usize) -> Self {
        let budget = budget.max(corners);
        // Six times the corners and some for small faces: that is what transitions which end well take.
        Self { usual: (corners * 6 + 4000).min(budget), budget }
    }

    /// Returns how many corners there may be; more if those facets that do not hold become fewer (`falls`).
    fn most_corners(&self, falls: bool) -> usize {
        if falls { self.budget } else { self.usual + self.usual / 4 }
    }
}

/// Triangulates what the outline bounds and refines until all triangles hold, or work or the `budget` of corners is used up; those that do
/// not hold then are in the result. Segments that cross others are left out and named. `None` when nodes have no usable parameters.
pub(in crate::tessellate) fn triangulate(
    surface: &FaceSurface<'_>,
    acceptance: Acceptance,
    outline: Outline<'_>,
    budget: usize,
) -> Option<Transition> {
    let Outline { nodes, segments, creases, imprinted, chords, scale, taken } = outline;
    let mut mesh = Refinement::new(surface, nodes, scale, taken);
    // All points first: constraints between points that come later would have to be split.
    mesh.insert_nodes(&segments, &imprinted)?;
    let [conflicts, crossed] = mesh.constrain_border(&segments);
    // Twice: for the flood fill a line that is crossed twice bounds nothing.
    let holds_imprint = imprinted.iter().all(|&[a, b]| mesh.constrain(a, b) && mesh.constrain(a, b));
    for &[a, b] in &creases {
        mesh.keep_crease(a, b);
    }
    // Where constraints are missing, the flood fill would leak through the gap.
    let uv = |s: &[u32; 2]| s.map(|n| mesh.nodes[n].uv);
    let by_centre = (!conflicts.is_empty()).then(|| Enclosure::new(segments.iter().map(uv).collect()));
    let mut sides = Sides::new(&mesh, by_centre);
    // By corners in order, however a triangle is turned.
    let mut known: FxHashMap<[u32; 3], ProvedFacet<3>> = FxHashMap::default();
    let limits = Limits::new(mesh.cdt.num_vertices(), budget);
    let mut unproved_before = 0;
    let mut round = 0;
    loop {
        // Prove what is new; what was there before stands as it did.
        let triangles = sides.inner_triangles(&mesh);
        let new: Vec<[u32; 3]> =
            triangles.iter().copied().filter(|&t| !known.contains_key(&sorted_nodes(t))).collect();
        let prove =
            |prover: &mut Prover<'_, '_>, &t: &[u32; 3]| prove_triangle(prover, &mesh.nodes, t, chords, 1.0);
        let proved: Vec<ProvedFacet<3>> =
            new.par_iter().with_min_len(16).map_init(|| Prover::new(surface, acceptance), prove).collect();
        known.extend(new.iter().map(|&t| sorted_nodes(t)).zip(proved));
        let triangles: Vec<ProvedFacet<3>> =
            triangles.iter().map(|&nodes| ProvedFacet { nodes, ..known[&sorted_nodes(nodes)] }).collect();
        let fails = |f: &&ProvedFacet<3>| f.bound > f.tolerance || mesh.side_to_divide(f.nodes).is_some();
        let mut failing: Vec<ProvedFacet<3>> = triangles.iter().filter(fails).copied().collect();
        // Beyond the usual measure only what is about to hold goes on: the flank of a thread of 20 m has no whole cells, and is done after
        // 12 times the corners of its border.
        let corners = mesh.cdt.num_vertices();
        let falls = 5 * failing.len() < 4 * unproved_before;
        unproved_before = failing.len();
        if corners >= limits.usual && !falls {
            // Where all cannot hold, the worst come first.
            let excess = |f: &ProvedFacet<3>| f.bound / f.tolerance;
            let worst = failing.iter().map(excess).fold(0.0, f64::max);
            failing.retain(|f| excess(f) >= WORST * worst);
        }
        // Also when the work of all rounds is used up: what then does not hold is counted as not proved.
        let ended = failing.is_empty()
            || surface.steps.are_too_many()
            || round == MAX_ROUNDS
            || (round + 1) * triangles.len() > MAX_WORK
            || corners >= limits.most_corners(falls);
        if ended || !mesh.refine(&failing, chords) {
            return Some(Transition { nodes: mesh.nodes, triangles, conflicts, crossed, holds_imprint });
        }
        sides.update(&mesh);
        round += 1;
    }
}

/// Returns the three nodes in ascending order.
fn sorted_nodes(mut t: [u32; 3]) -> [u32; 3] {
    t.sort_unstable();
    t
}

/// A triangulation under refinement.
pub(super) struct Refinement<'s, 'a> {
    pub(super) surface: &'s FaceSurface<'a>,
    pub(super) nodes: Nodes,
    /// From parameters to coordinates of the triangulation.
    pub(super) scale: Uv,
    pub(super) taken: &'s TakenChords,
    pub(super) cdt: Cdt,
    /// How often each edge of the triangulation that lies on the outline turns outside into inside; imprinted lines count twice.
    pub(super) border: FxHashMap<[u32; 2], u32>,
    /// Of those nodes that are in the triangulation.
    pub(super) handles: Vec<Option<FixedVertexHandle>>,
    /// The first node of each vertex, by its index: the library keeps the data of the last.
    owners: Vec<u32>,
}

impl<'s, 'a> Refinement<'s, 'a> {
    /// Begins with an empty triangulation.
    pub(super) fn new(surface: &'s FaceSurface<'a>, nodes: Nodes, scale: Uv, taken: &'s TakenChords) -> Self {
        let (border, handles, owners) = (FxHashMap::default(), Vec::new(), Vec::new());
        Self { surface, nodes, scale, taken, cdt: Cdt::new(), border, handles, owners }
    }

    /// Inserts the nodes of segments and imprinted lines, or all nodes beside more than [`LONG_OUTLINE`] segments; adds to `handles` an
    /// entry for every node, `None` for those left out. Returns `None` where a node has no usable parameters.
    pub(super) fn insert_nodes(&mut self, segments: &[[u32; 2]], imprinted: &[[u32; 2]]) -> Option<()> {
        // Nodes inside of whole cells have no part in the transition, but each long constraint clears all that it crosses.
        let mut used = vec![segments.len() > LONG_OUTLINE; self.nodes.len() as usize];
        segments.iter().chain(imprinted).flatten().for_each(|&n| used[n as usize] = true);
        let order: Vec<u32> = (0..self.nodes.len()).filter(|&n| used[n as usize]).collect();
        let mut ranks: Vec<u32> = (0..order.len() as u32).collect();
        // One after the other along a border each vertex lies outside of all before it and turns over edges all along it, which takes the
        // square of a long one: a few far apart go first, then those between them, each beside one that is there.
        let is_long = order.len() > LONG_OUTLINE;
        if is_long {
            ranks.sort_unstable_by_key(|rank| rank.reverse_bits());
        }
        self.handles = vec![None; used.len()];
        for rank in ranks {
            let [n, coarser] = [rank, rank & rank.saturating_sub(1)].map(|r| order[r as usize] as usize);
            self.handles[n] = Some(self.insert_node(n as u32, self.handles[coarser].filter(|_| is_long))?);
        }
        Some(())
    }

    /// Inserts a node at its scaled parameters and returns its vertex, which is the older one where the place is taken. The caller
    /// keeps it in `handles`. `None` where scaled parameters are not finite or 1e30 and more; those below 1e-30 become zero. The search for
    /// the place begins at `near`, without it at the vertex that came last.
    pub(super) fn insert_node(&mut self, n: u32, near: Option<FixedVertexHandle>) -> Option<FixedVertexHandle> {
        let at = self.scaled(self.nodes[n].uv)?;
        let before = self.cdt.num_vertices();
        let vertex = Vertex { at, node: n };
        let inserted =
            if let Some(near) = near { self.cdt.insert_with_hint(vertex, near) } else { self.cdt.insert(vertex) };
        let handle = inserted.ok()?;
        // Two nodes in one place of the parameter plane, as where a trim touches itself.
        if self.cdt.num_vertices() == before {
            // The place was taken: its first owner keeps it.
            self.cdt.vertex_data_mut(handle).node = self.owners[handle.index()];
        } else {
            self.owners.push(n);
        }
        Some(handle)
    }

    /// Turns parameters into coordinates of the triangulation, those below 1e-30 into zero; `None` where they are not finite or 1e30 and
    /// more.
    fn scaled(&self, uv: Uv) -> Option<Point2<f64>> {
        // Spade refuses numbers so small that its exact predicates underflow.
        let clean = |x: f64| if x.abs() < COORDINATES[0] { 0.0 } else { x };
        let p = uv * self.scale;
        (p.is_finite() && p.abs().max_element() < COORDINATES[1]).then(|| Point2::new(clean(p.x), clean(p.y)))
    }

    /// Whether a point may be inserted: inside the hull, apart from the vertices around it by more than rounding, and on no border or
    /// imprinted line; creases may be split. False too for parameters that [`Self::scaled`] refuses. The search for it begins at `near`.
    pub(super) fn can_insert(&self, uv: Uv, near: FixedVertexHandle) -> bool {
        use spade::PositionInTriangulation as At;
        // Between corners one rounding apart stood facets without width. Near zero a coordinate's own size says nothing of its rounding.
        let size = self.surface.extent() * self.scale;
        let apart = |p: Point2<f64>, v: Point2<f64>| {
            (p.x - v.x).abs() > SAME_COORDINATE * p.x.abs().max(size.x)
                || (p.y - v.y).abs() > SAME_COORDINATE * p.y.abs().max(size.y)
        };
        self.scaled(uv).is_some_and(|p| match self.cdt.locate_with_hint(p, near) {
            At::OnFace(f) => self.cdt.face(f).vertices().iter().all(|v| apart(p, v.position())),
            At::OnEdge(e) => {
                let e = self.cdt.directed_edge(e);
                let at_border = || self.border.contains_key(&edge_key(e.from().data().node, e.to().data().node));
                (!e.is_constraint_edge() || !at_border()) && e.vertices().iter().all(|v| apart(p, v.position()))
            }
            _ => false,
        })
    }

    /// Makes constraints of border segments, counted in `border` for the flood fill; returns those that fail, and what they cross.
    pub(super) fn constrain_border(&mut self, segments: &[[u32; 2]]) -> [Vec<[u32; 2]>; 2] {
        let mut conflicts = Vec::new();
        let mut crossed = Vec::new();
        for &[a, b] in segments {
            if !self.constrain(a, b) {
                conflicts.push([a, b]);
                crossed.extend(self.crossed_by(a, b));
            }
        }
        [conflicts, crossed]
    }

    /// Makes the segment between two nodes a constraint, and counts in `border` each of the edges that it is led over. `true`, and nothing
    /// counted, where both nodes stand in one place; `false` where it would cross another or a node was not inserted.
    fn constrain(&mut self, a: u32, b: u32) -> bool {
        let (Some(from), Some(to)) = (self.handles[a as usize], self.handles[b as usize]) else { return false };
        if from == to {
            return true;
        }
        let made = self.cdt.try_add_constraint(from, to);
        for edge in &made {
            let e = self.cdt.directed_edge(*edge);
            // The library may lead it over vertices on the way: each part counts.
            *self.border.entry(edge_key(e.from().data().node, e.to().data().node)).or_insert(0) += 1;
        }
        !made.is_empty()
    }

    /// Makes the line between two nodes a constraint that does not bound anything; leaves it out where it would cross another.
    fn keep_crease(&mut self, a: u32, b: u32) {
        if let (Some(from), Some(to)) = (self.handles[a as usize], self.handles[b as usize])
            && from != to
        {
            self.cdt.try_add_constraint(from, to);
        }
    }

    /// Returns the constraints, as pairs of nodes, that keep the segment from `a` to `b` out; none where an end was not inserted.
    fn crossed_by(&self, a: u32, b: u32) -> Vec<[u32; 2]> {
        let (Some(from), Some(to)) = (self.handles[a as usize], self.handles[b as usize]) else {
            return Vec::new();
        };
        let edges = self.cdt.get_conflicting_edges_between_vertices(from, to);
        edges.map(|e| [e.from().data().node, e.to().data().node]).collect()
    }
}

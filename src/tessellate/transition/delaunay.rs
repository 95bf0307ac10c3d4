//! A constrained Delaunay triangulation of nodes, by their parameters scaled by curvature: the library's, which knows the border.

use crate::math::Uv;
use crate::tessellate::face_surface::FaceSurface;
use crate::tessellate::nodes::{Nodes, edge_key};
use crate::tessellate::taken_chords::TakenChords;
use rustc_hash::FxHashMap;
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

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

/// Segments from which on nodes inside whole cells stay in: they keep the region that a constraint clears small.
const LONG_OUTLINE: usize = 4000;
/// Mean lengths of the segments from which on one is long.
const LONG_SEGMENT: f64 = 100.0;
/// Coordinates below the first, which spade refuses, are zero; those above the second lose the exactness of its predicates.
const COORDINATES: [f64; 2] = [1e-30, 1e30];
/// Share of the domain, or of a coordinate that is larger, within which two places are one: some fifty roundings.
const SAME_COORDINATE: f64 = 1e-14;

/// A triangulation that points can be added to.
pub(super) struct DelaunayMesh<'s, 'a> {
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

impl<'s, 'a> DelaunayMesh<'s, 'a> {
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
        if is_long {
            self.begin_with_long(segments)?;
        }
        for rank in ranks {
            let [n, coarser] = [rank, rank & rank.saturating_sub(1)].map(|r| order[r as usize] as usize);
            if self.handles[n].is_some() {
                continue;
            }
            self.handles[n] = Some(self.insert_node(n as u32, self.handles[coarser].filter(|_| is_long))?);
        }
        Some(())
    }

    /// Inserts the ends of the long ones of `segments` and makes these constraints, uncounted: one that comes after thousands of nodes
    /// beside its ends clears all edges between these, which took seven seconds. Errors are as in [`Self::insert_nodes`].
    fn begin_with_long(&mut self, segments: &[[u32; 2]]) -> Option<()> {
        let length = |s: &[u32; 2]| (self.scale * (self.nodes[s[1]].uv - self.nodes[s[0]].uv)).length();
        let all: f64 = segments.iter().map(length).sum();
        let long = |s: &&[u32; 2]| length(s) > LONG_SEGMENT * all / segments.len() as f64;
        let long: Vec<[u32; 2]> = segments.iter().filter(long).copied().collect();
        for n in long.iter().flatten().copied() {
            if self.handles[n as usize].is_none() {
                self.handles[n as usize] = Some(self.insert_node(n, None)?);
            }
        }
        for [a, b] in long {
            self.keep_crease(a, b);
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

    /// Makes constraints of border segments, counted in `border` for the flood fill; returns those that fail, and those that they cross or
    /// that are led over other nodes: a neighbour that has the same chord does not know these.
    pub(super) fn constrain_border(&mut self, segments: &[[u32; 2]]) -> [Vec<[u32; 2]>; 2] {
        let mut conflicts = Vec::new();
        let mut crossed = Vec::new();
        for &[a, b] in segments {
            match self.constrain(a, b) {
                0 => {
                    conflicts.push([a, b]);
                    crossed.extend(self.crossed_by(a, b));
                }
                1 => {}
                _ => crossed.push([a, b]),
            }
        }
        [conflicts, crossed]
    }

    /// Makes the segment between two nodes a constraint, and counts in `border` each of the edges that it is led over; returns how many.
    /// One, and none counted, where both nodes stand in one place; none where it would cross another or a node was not inserted.
    pub(super) fn constrain(&mut self, a: u32, b: u32) -> usize {
        let (Some(from), Some(to)) = (self.handles[a as usize], self.handles[b as usize]) else { return 0 };
        if from == to {
            return 1;
        }
        let made = self.cdt.try_add_constraint(from, to);
        for edge in &made {
            let e = self.cdt.directed_edge(*edge);
            // The library may lead it over vertices on the way: each part counts.
            *self.border.entry(edge_key(e.from().data().node, e.to().data().node)).or_insert(0) += 1;
        }
        made.len()
    }

    /// Makes the line between two nodes a constraint that does not bound anything; leaves it out where it would cross another.
    pub(super) fn keep_crease(&mut self, a: u32, b: u32) {
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

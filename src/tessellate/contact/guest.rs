//! A face that lies on a carrier takes over the carrier's facets, each proved anew on its own surface.

use super::closure::SideCounts;
use super::detection::Extent;
use super::trimmed::TrimmedFace;
use crate::math::polygon::is_inside_sides;
use crate::math::{Point, Uv};
use crate::model::{EdgeUse, Part};
use crate::tessellate::assemble::PartMesh;
use crate::tessellate::border::polygons::{BorderPolygons, BorderSide, PolygonVertex};
use crate::tessellate::border_nodes::BorderNodes;
use crate::tessellate::cells::cell::Cell;
use crate::tessellate::emission::Emission;
use crate::tessellate::face_mesh::FaceMesh;
use crate::tessellate::imprint::{CarrierFacets, Imprint, ImprintEnd, ImprintSegment};
use crate::tessellate::nodes::{Node, Position, ProvedFacet, edge_key};
use crate::tessellate::proof::facet::prove_triangle;
use crate::tessellate::proof::pole;
use crate::tessellate::proof::prover::Prover;
use crate::tessellate::settings::Settings;
use rustc_hash::FxHashMap;

/// A guest with its border on the divisions of now, seams included.
pub(super) struct Guest<'f, 'm> {
    pub(super) face: &'f TrimmedFace<'m>,
    pub(super) polygons: BorderPolygons,
    /// The corners of all polygons, one after another, in the part's coordinates.
    pub(super) places: Vec<Point>,
}

impl<'f, 'm> Guest<'f, 'm> {
    /// Makes a guest of a face and its border; looks up the places of the border's corners among the positions of `mesh`, the guest's part.
    pub(super) fn new(face: &'f TrimmedFace<'m>, polygons: BorderPolygons, mesh: &PartMesh) -> Self {
        let place = |v: &PolygonVertex| match v.position {
            Position::Shared(p) => mesh.shared[p as usize],
            Position::Own(p) => polygons.own[p as usize],
        };
        let places = polygons.polygons.iter().flatten().map(place).collect();
        Self { face, polygons, places }
    }

    /// Goes through the border's sides: the numbers of both ends, counted through all polygons, and both ends themselves.
    fn sides(&self) -> impl Iterator<Item = (usize, usize, &PolygonVertex, &PolygonVertex)> {
        let mut first = 0;
        self.polygons.polygons.iter().flat_map(move |p| {
            let start = first;
            first += p.len();
            (0..p.len()).map(move |k| {
                let next = (k + 1) % p.len();
                (start + k, start + next, &p[k], &p[next])
            })
        })
    }

    /// Returns the place half-way (in parameter) along the side from `a` to `b`, in the part's coordinates: on the edge's curve, or on the
    /// surface for sides without an edge. `uses` are those of all loops.
    fn side_middle(&self, part: &Part, uses: &[&EdgeUse], a: &PolygonVertex, b: &PolygonVertex) -> Point {
        match a.side {
            BorderSide::Edge { edge_use, t } => match uses[edge_use as usize].edge {
                // Without an edge, or on a seam, the side follows the surface.
                Some(edge) => part.edges[edge.0 as usize].curve.evaluate(0.5 * (t[0] + t[1])),
                None => self.face.surface.point(0.5 * (a.uv + b.uv)),
            },
            _ => self.face.surface.point(0.5 * (a.uv + b.uv)),
        }
    }

    /// Adds the border to `out` as segments on the carrier: all of it, or of a contact in part the sides that lie there. Corners are
    /// numbered from `first` on.
    pub(super) fn imprint(&self, carrier: &TrimmedFace<'_>, extent: Extent, first: usize, out: &mut Imprint) {
        let uses: Vec<&EdgeUse> = self.face.loops.iter().flat_map(|l| &l.uses).collect();
        let local = |p: Point| carrier.frame.local_point(self.face.frame.point(p));
        let edges = carrier.edges();
        for (i, j, a, b) in self.sides() {
            let places = [self.places[i], self.places[j]].map(local);
            // What is one point in space has no line to imprint.
            if a.side == BorderSide::Pole || places[0] == places[1] {
                continue;
            }
            let middle = self.side_middle(self.face.part, &uses, a, b);
            let is_on_carrier = |p: &Point| carrier.holds(&edges, self.face.frame.point(*p), out.near);
            if extent == Extent::Part && ![middle, self.places[i], self.places[j]].iter().all(is_on_carrier) {
                continue;
            }
            // The middle is on no seam: it shows on which side of one the ends are.
            let (middle, _) = carrier.projector.project(local(middle));
            let end = |vertex: usize, place: Point| {
                let (uv, _) = carrier.projector.project(place);
                ImprintEnd { uv: choose_seam_side(carrier, uv, middle, out.near), place, vertex: first + vertex }
            };
            out.segments.push(ImprintSegment { ends: [end(i, places[0]), end(j, places[1])] });
        }
    }

    /// Whether parameters lie inside the border.
    pub(super) fn contains(&self, uv: Uv) -> bool {
        is_inside_sides(self.sides().map(|(_, _, a, b)| [a.uv, b.uv]), uv)
    }
}

/// Moves a place within `near` mm of a seam, or at a pole, of a closed surface there, and to the side of `middle`; others stay as they are.
///
/// All within `near` is one place, so that a corner just beyond the seam is on it: the line that ends there would run round the whole
/// surface otherwise.
fn choose_seam_side(face: &TrimmedFace<'_>, mut uv: Uv, middle: Uv, near: f64) -> Uv {
    let surface = &face.surface;
    let place = surface.point(uv);
    if let Some(across) = surface.pole(uv) {
        // The nearest end, because a projected place is only near the pole; all along the pole is one place.
        let [a, b] = surface.spline.domain()[across];
        uv[across] = if uv[across] - a < b - uv[across] { a } else { b };
        uv[1 - across] = middle[1 - across];
        return uv;
    }
    for d in 0..2 {
        if surface.closed[d] {
            let [a, b] = surface.spline.domain()[d];
            let mut on_seam = uv;
            on_seam[d] = if middle[d] - a < 0.5 * (b - a) { a } else { b };
            if (surface.point(on_seam) - place).length() * face.frame.scale.abs() <= near {
                uv = on_seam;
            }
        }
    }
    uv
}

/// Makes the guest's facets from those of the carrier that lie in it, each proved on the guest's surface, and returns with them the sides
/// of its border. `first` is the number of its first corner in the carrier's imprint.
pub(super) fn taken_facets(
    guest: &Guest<'_, '_>,
    carrier: &TrimmedFace<'_>,
    facets: &CarrierFacets,
    first: usize,
    mesh: &PartMesh,
    settings: &Settings,
) -> (FaceMesh, SideCounts) {
    let face = guest.face;
    let surface = &face.surface;
    let border = BorderNodes::new(face.part, &face.loops, surface, &guest.polygons, &mesh.shared);
    let mut builder = Builder::new(guest, carrier, facets, first, border, settings.glue_mm);
    let mut prover = Prover::new(surface, settings.acceptance);
    let mut made: Vec<(ProvedFacet<4>, Option<(usize, Uv)>)> = Vec::new();
    for &corners in &facets.facets {
        let Some(mut q) = builder.facet_inside(corners) else { continue };
        let triangle = q[2] == q[3];
        // A facet of three corners may begin anywhere; the proof wants the pole last.
        if triangle {
            // A pole is the third corner.
            let polar = (0..3).find(|&k| surface.pole(builder.border.nodes[q[k]].uv).is_some());
            let k = polar.map_or(0, |k| (k + 1) % 3);
            q = [q[k], q[(k + 1) % 3], q[(k + 2) % 3], q[(k + 2) % 3]];
        }
        let proved = prove_facet(&mut prover, &builder.border, q);
        let uv = q.map(|n| builder.border.nodes[n].uv);
        let pole = pole::facet_parameters(surface, if triangle { &uv[..3] } else { &uv });
        made.push((proved, pole));
    }
    let border = builder.border;
    let position = |n: u32| border.nodes[n].position;
    let sides = SideCounts::new(border.segments.iter().map(|s| s.map(position)));
    let mut emission = Emission::new(surface, &border.nodes);
    made.iter().for_each(|(f, pole)| emission.add_facet(f, *pole));
    let out = emission.finish();
    let (_, own) = border.nodes.into_parts();
    (FaceMesh { own, coincident: guest.polygons.coincident.clone(), ..out }, sides)
}

/// Bounds a facet by its two triangles one by one, or else as a whole cell; returns bound and tolerance, mm, of which either may be the
/// larger. A triangle repeats its third corner.
fn prove_facet(prover: &mut Prover<'_, '_>, border: &BorderNodes, q: [u32; 4]) -> ProvedFacet<4> {
    let mut prove = |t: [u32; 3]| prove_triangle(prover, &border.nodes, t, &border.chords, 1.0);
    let first = prove([q[0], q[1], q[2]]);
    if q[2] == q[3] {
        return ProvedFacet { nodes: q, bound: first.bound, tolerance: first.tolerance };
    }
    let second = prove([q[0], q[2], q[3]]);
    let tolerance = first.tolerance.min(second.tolerance);
    let bound = first.bound.max(second.bound);
    // The curve over the diagonal need not hold where all of a cell does.
    let bound = if bound <= tolerance { bound } else { bound.min(prove_cell(prover, border, q, tolerance)) };
    ProvedFacet { nodes: q, bound, tolerance }
}

/// Returns a bound, mm, of a facet that covers a rectangle of parameters, proved as a whole cell with the border's curves; infinite where
/// it covers none or none is found.
fn prove_cell(prover: &mut Prover<'_, '_>, border: &BorderNodes, q: [u32; 4], limit: f64) -> f64 {
    let surface = prover.surface;
    let nodes = q.map(|n| border.nodes[n]);
    let (lo, hi) = nodes.iter().fold((nodes[0].uv, nodes[0].uv), |(l, h), n| (l.min(n.uv), h.max(n.uv)));
    let corners = Cell { lo, hi }.corners();
    let near = SAME_PARAMETERS * surface.extent();
    // The cell's corners in order of the facet's.
    let Some(start) = (0..4).find(|&k| (nodes[k].uv - lo).abs().cmple(near).all()) else { return f64::INFINITY };
    let at = [0, 1, 2, 3].map(|k| nodes[(start + k) % 4]);
    if at.iter().zip(corners).any(|(n, c)| (n.uv - c).abs().cmpgt(near).any()) {
        return f64::INFINITY;
    }
    let places = corners.map(|c| surface.point(c));
    let moved = at.iter().zip(places).map(|(n, p)| (n.place - p).length()).fold(0.0, f64::max);
    let Some(bound) = prover.quad_bound([lo, hi], &places, start % 2, limit) else { return f64::INFINITY };
    // Lines and triangles through moved points move no farther than these: four times as much is more than they need.
    let mut worst = bound + 4.0 * moved;
    let xyz = [0, 1, 2].map(|k| nodes[k].place);
    for k in 0..4 {
        if let Some(chord) = border.chords.get(&edge_key(q[k], q[(k + 1) % 4])) {
            let corner = if k < 2 { xyz } else { [2, 3, 0].map(|k| nodes[k].place) };
            worst = worst.max(chord.bound(prover, corner, limit));
        }
    }
    worst
}

/// Share of the domain within which a facet's corners are those of a cell.
const SAME_PARAMETERS: f64 = 1e-9;

/// Finds or makes the guest's nodes for the carrier's.
struct Builder<'b, 'f, 'm, 'c> {
    guest: &'b Guest<'f, 'm>,
    carrier: &'b TrimmedFace<'c>,
    facets: &'b CarrierFacets,
    border: BorderNodes,
    /// Distance within which both faces lie on each other, mm.
    glue: f64,
    /// The guest's corner at a position of the carrier.
    vertices: FxHashMap<Position, usize>,
    /// Nodes of the guest by position and parameters.
    known: FxHashMap<(Position, [u64; 2]), u32>,
    /// The guest's node, made for it, at a position of the carrier that is no corner of the guest's border.
    inner: FxHashMap<Position, u32>,
    /// Parameters of the border's corners at each position of the guest.
    parameters: FxHashMap<Position, Vec<Uv>>,
}

/// Returns a node's key; two nodes may share a position, as on a seam, but not the parameters too.
fn node_key(position: Position, uv: Uv) -> (Position, [u64; 2]) {
    // Adding zero turns −0.0 into 0.0: as bits the two would be different names.
    (position, [(uv.x + 0.0).to_bits(), (uv.y + 0.0).to_bits()])
}

impl<'b, 'f, 'm, 'c> Builder<'b, 'f, 'm, 'c> {
    /// Starts from the guest's `border` nodes, to which it adds. The guest's corners are found by the positions of the carrier's nodes; in
    /// the imprint they are numbered from `first` on. `glue` is the distance, mm, within which both faces lie on each other.
    fn new(
        guest: &'b Guest<'f, 'm>,
        carrier: &'b TrimmedFace<'c>,
        facets: &'b CarrierFacets,
        first: usize,
        border: BorderNodes,
        glue: f64,
    ) -> Self {
        let own = facets.vertex_nodes.iter().filter_map(|&(node, vertex)| {
            let vertex = vertex.checked_sub(first).filter(|&v| v < guest.places.len())?;
            Some((facets.nodes[node as usize].position, vertex))
        });
        let vertices = own.collect();
        let known = (0..).zip(border.nodes.iter()).map(|(id, n)| (node_key(n.position, n.uv), id)).collect();
        let mut parameters: FxHashMap<Position, Vec<Uv>> = FxHashMap::default();
        for v in guest.polygons.polygons.iter().flatten() {
            parameters.entry(v.position).or_default().push(v.uv);
        }
        Self { guest, carrier, facets, border, glue, vertices, known, inner: FxHashMap::default(), parameters }
    }

    /// Takes a point from the coordinates of the carrier's part to those of the guest's.
    fn local(&self, p: Point) -> Point {
        self.guest.face.frame.local_point(self.carrier.frame.point(p))
    }

    /// Returns the guest's nodes of a carrier's facet, counter-clockwise in the guest's parameters, and new ones where there were none;
    /// `None` where the facet's middle lies outside the guest.
    fn facet_inside(&mut self, corners: [u32; 4]) -> Option<[u32; 4]> {
        let triangle = corners[2] == corners[3];
        let places = corners.map(|n| self.local(self.facets.nodes[n as usize].place));
        let count = if triangle { 3 } else { 4 };
        let middle = places[..count].iter().sum::<Point>() / count as f64;
        let (uv, away) = self.guest.face.projector.project(middle);
        // Both the facet's own sag and the glue distance lie between its middle and the guest. Beside the guest the
        // nearest place is on its border, farther than that.
        let frame = self.guest.face.frame;
        let (_, sag) = self.carrier.project(frame.point(middle));
        if away * frame.scale.abs() > sag + self.glue || !self.guest.contains(uv) {
            return None;
        }
        let middle = uv;
        let [a, b, c] = [0, 1, 2].map(|k| self.guest_node(corners[k], places[k], middle));
        let d = if triangle { c } else { self.guest_node(corners[3], places[3], middle) };
        let normal = (places[1] - places[0]).cross(places[2] - places[0]);
        // Two faces that touch look at each other: the carrier's facets are turned around for the guest.
        let turned = self.guest.face.surface.spline.normal(middle).is_some_and(|n| n.dot(normal) < 0.0);
        Some(match (turned, triangle) {
            (false, _) => [a, b, c, d],
            (true, true) => [a, c, b, b],
            (true, false) => [a, d, c, b],
        })
    }

    /// Returns the guest's node for a node of the carrier's facets: a corner of its border, one that was made before, or a new one. `place`
    /// is in the guest's part's coordinates, `middle` the facet's middle in its parameters.
    fn guest_node(&mut self, carrier_node: u32, place: Point, middle: Uv) -> u32 {
        let face = self.guest.face;
        let position = self.facets.nodes[carrier_node as usize].position;
        if let Some(&vertex) = self.vertices.get(&position) {
            let mut corners = self.guest.polygons.polygons.iter().flatten();
            if let Some(v) = corners.nth(vertex) {
                let extent = face.surface.extent();
                // A position on a seam or at a pole has several parameters; those nearest to the facet are its own.
                let off = |uv: &Uv| ((*uv - middle) / extent).length_squared();
                let all = &self.parameters[&v.position];
                let uv = all.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(v.uv);
                let position = v.position;
                if let Some(&known) = self.known.get(&node_key(position, uv)) {
                    return known;
                }
                let node = self.border.nodes.push(Node { uv, place: self.guest.places[vertex], position });
                self.known.insert(node_key(position, uv), node);
                return node;
            }
        }
        if let Some(&known) = self.inner.get(&position) {
            return known;
        }
        let (uv, _) = face.projector.project(place);
        let node = self.border.nodes.push_own(choose_seam_side(face, uv, middle, self.glue), place);
        self.inner.insert(position, node);
        node
    }
}

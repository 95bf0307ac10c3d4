//! The border polygons of a face as nodes and segments, and how far each segment's curve strays from its chord.

use super::border::polygons::{BorderPolygons, BorderSide};
use super::cells::cell::Subdivision;
use super::crossing_chords::Followed;
use super::face_surface::FaceSurface;
use super::imprint::{Imprint, ImprintEnd};
use super::nodes::{Node, Nodes, Position, edge_key};
use super::proof::border_chord::{BorderChord, BorderChords};
use super::proof::deviation::DeviationBounds;
use crate::math::{Point, Uv};
use crate::model::{EdgeId, EdgeUse, Part, TrimLoop};
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

/// Share of the face's extent within which vertices in one place have the same parameters: the trims' own rounding.
const SAME_PARAMETERS: f64 = 1e-9;
/// Share of a cell's size within which it reaches a pole.
const AT_POLE: f64 = 1e-6;
/// Share of a pole's length within which two corners on it are one.
const SAME_AT_POLE: f64 = 1e-9;
/// Share of the domain within which parameters of one place are on the same side of a seam.
const SAME_SIDE: f64 = 0.1;

/// The border of a face: its nodes, and the segments between them in parameters.
pub(super) struct BorderNodes {
    pub(super) nodes: Nodes,
    /// Pairs of nodes in the direction of the loops, loop by loop, without poles at first.
    pub(super) segments: Vec<[u32; 2]>,
    /// How far the curve of each segment that follows an edge strays, by its two nodes.
    pub(super) chords: BorderChords,
    /// The piece of an edge that a segment follows.
    pub(super) followed: FxHashMap<[u32; 2], Followed>,
    /// Segments that are one point in space.
    poles: Vec<[u32; 2]>,
    /// Segments of the border of another solid's face that this one carries.
    pub(super) imprinted: Vec<[u32; 2]>,
}

/// A segment that follows an edge over the parameters `t` of its curve.
struct EdgeSegment<'l> {
    nodes: [u32; 2],
    edge_use: &'l EdgeUse,
    edge: EdgeId,
    t: [f64; 2],
}

impl BorderNodes {
    /// Makes nodes and segments from the polygons of a face and bounds, in parallel, how far edges stray from their segments. `shared` are
    /// the part's positions, `loops` those that the polygons were built from. Nothing is imprinted yet.
    pub(super) fn new(
        part: &Part,
        loops: &[TrimLoop],
        surface: &FaceSurface<'_>,
        polygons: &BorderPolygons,
        shared: &[Point],
    ) -> Self {
        let mut out = Self {
            nodes: Nodes::with_own(polygons.own.clone()),
            segments: Vec::new(),
            chords: BorderChords::default(),
            followed: FxHashMap::default(),
            poles: Vec::new(),
            imprinted: Vec::new(),
        };
        let ids = out.add_nodes(part, polygons, shared);
        let uses: Vec<&EdgeUse> = loops.iter().flat_map(|l| &l.uses).collect();
        let mut along_edges: Vec<EdgeSegment<'_>> = Vec::new();
        for (polygon, ids) in polygons.polygons.iter().zip(&ids) {
            for (k, v) in polygon.iter().enumerate() {
                let nodes = [ids[k], ids[(k + 1) % ids.len()]];
                // Uses without length have no segment.
                if nodes[0] == nodes[1] {
                    continue;
                }
                match v.side {
                    BorderSide::Pole => out.poles.push(nodes),
                    BorderSide::Seam => out.segments.push(nodes),
                    BorderSide::Edge { edge_use, t } => {
                        out.segments.push(nodes);
                        let edge_use = uses[edge_use as usize];
                        let segment = edge_use.edge.map(|edge| EdgeSegment { nodes, edge_use, edge, t });
                        along_edges.extend(segment);
                    }
                }
            }
        }
        // In parallel: a face with a long border would hold up the others.
        let nodes = &out.nodes;
        let chord = |deviation: &mut DeviationBounds, s: &EdgeSegment<'_>| {
            let ends = s.nodes.map(|n| nodes[n]);
            let (uv, xyz) = (ends.map(|n| n.uv), ends.map(|n| n.place));
            let curve = &part.edges[s.edge.0 as usize].curve;
            let mut chord = BorderChord::new(surface, curve, s.edge_use, s.t, uv, xyz);
            chord.bound_sliver(surface, deviation, uv, xyz);
            chord
        };
        let chords: Vec<BorderChord> =
            along_edges.par_iter().with_min_len(32).map_init(DeviationBounds::default, chord).collect();
        // A side is known by its two nodes, whichever way it runs.
        let names = along_edges.iter().map(|s| edge_key(s.nodes[0], s.nodes[1]));
        out.chords.extend(names.clone().zip(chords));
        out.followed.extend(names.zip(along_edges.iter().map(|s| Followed { edge: s.edge, t: s.t })));
        out
    }

    /// Makes the nodes of all polygons and returns their numbers, polygon by polygon. Corners at one vertex, or where edges cross, with
    /// the same parameters get one node: loops that touch there would otherwise not know of each other's chords.
    fn add_nodes(&mut self, part: &Part, polygons: &BorderPolygons, shared: &[Point]) -> Vec<Vec<u32>> {
        let met: FxHashSet<u32> = polygons.coincident.iter().map(|[first, _]| *first).collect();
        let mut at_vertices: FxHashMap<(u32, [u64; 2]), u32> = FxHashMap::default();
        let mut node = |uv: Uv, position: Position| match position {
            Position::Own(p) => self.nodes.push(Node { uv, place: polygons.own[p as usize], position }),
            Position::Shared(p) => {
                let mut add = || self.nodes.push(Node { uv, place: shared[p as usize], position });
                if (p as usize) < part.vertices.len() || met.contains(&p) {
                    *at_vertices.entry((p, uv.to_array().map(f64::to_bits))).or_insert_with(add)
                } else {
                    add()
                }
            }
        };
        let polygons = polygons.polygons.iter();
        polygons.map(|p| p.iter().map(|v| node(v.uv, v.position)).collect()).collect()
    }

    /// Adds the segments of an imprint, except those on the border, and the nodes that are missing. Returns pairs of node and imprinted
    /// vertex, two for each segment, with repetitions.
    pub(super) fn add_imprint(&mut self, surface: &FaceSurface<'_>, imprint: &Imprint) -> Vec<(u32, usize)> {
        let mut vertex_nodes = Vec::new();
        // Lines that follow the border already bound the facets there as they are.
        let known: FxHashSet<[u32; 2]> = self.segments.iter().map(|s| edge_key(s[0], s[1])).collect();
        for segment in &imprint.segments {
            let nodes = segment.ends.map(|end| {
                let node = self.node_at(surface, &end, imprint.near);
                vertex_nodes.push((node, end.vertex));
                node
            });
            if nodes[0] != nodes[1] && !known.contains(&edge_key(nodes[0], nodes[1])) {
                self.imprinted.push(nodes);
            }
        }
        vertex_nodes
    }

    /// Returns the node where an imprinted line ends: the nearest in parameters within `near` mm on the same side of a seam, or a new one.
    /// A new node within `near` of another shares its position.
    fn node_at(&mut self, surface: &FaceSurface<'_>, end: &ImprintEnd, near: f64) -> u32 {
        let extent = surface.extent();
        let off = |n: &Node| ((n.uv - end.uv) / extent).abs().max_element();
        // At a pole all parameters along it are one place: lines into it keep their own.
        let reach = if surface.pole(end.uv).is_some() { SAME_PARAMETERS } else { SAME_SIDE };
        let here = |n: &Node| (n.place - end.place).length() <= near && off(n) <= reach;
        let found = self.nodes.iter().enumerate().filter(|(_, n)| here(n));
        match found.min_by(|a, b| off(a.1).total_cmp(&off(b.1))) {
            Some((n, _)) => n as u32,
            None => {
                // Both sides of a seam, and all of a pole, are one position.
                let twin = self.nodes.iter().find(|n| (n.place - end.place).length() <= near).copied();
                match twin {
                    Some(twin) => self.nodes.push(Node { uv: end.uv, ..twin }),
                    None => self.nodes.push_own(end.uv, end.place),
                }
            }
        }
    }

    /// Turns the poles into segments, divided where corners of border cells or imprinted nodes lie on them; the new nodes share the pole's
    /// position.
    pub(super) fn divide_poles(&mut self, cells: &Subdivision) {
        for [from, to] in std::mem::take(&mut self.poles) {
            let (a, b) = (self.nodes[from].uv, self.nodes[to].uv);
            // Along the pole the one parameter runs, across it the other stands still.
            let d = if (b - a).x.abs() > (b - a).y.abs() { 0 } else { 1 };
            let (lo, hi) = (a[d].min(b[d]), a[d].max(b[d]));
            let touching = cells.border.iter().filter(|c| {
                let slack = AT_POLE * (c.hi[1 - d] - c.lo[1 - d]);
                c.lo[1 - d] - slack <= a[1 - d] && a[1 - d] <= c.hi[1 - d] + slack
            });
            // Cells reach the pole at their corners: there its side must be divided, or a facet's side would end on
            // another's middle. An imprint may have a node there already.
            let place = self.nodes[from].position;
            let imprinted = self.imprinted.iter().flatten().filter(|&&n| self.nodes[n].position == place);
            let known = imprinted.map(|&n| (self.nodes[n].uv[d], Some(n)));
            let mut at: Vec<(f64, Option<u32>)> =
                touching.flat_map(|c| [c.lo[d], c.hi[d]]).map(|x| (x, None)).chain(known).collect();
            at.retain(|&(x, _)| x > lo && x < hi);
            at.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            at.dedup_by(|y, x| {
                let same = y.0 - x.0 < SAME_AT_POLE * (hi - lo);
                if same && x.1.is_none() {
                    // A node that is there already stays, in place of a number.
                    *x = *y;
                }
                same
            });
            if a[d] > b[d] {
                at.reverse();
            }
            let mut last = from;
            for (x, node) in at {
                let id = node.unwrap_or_else(|| {
                    let mut uv = a.lerp(b, (x - a[d]) / (b[d] - a[d]));
                    uv[d] = x;
                    self.nodes.push(Node { uv, ..self.nodes[from] })
                });
                self.segments.push([last, id]);
                last = id;
            }
            self.segments.push([last, to]);
        }
    }
}

//! Facets of one cell: its quad, or pieces of it where nodes hang on its sides.

use super::candidate_facet::CandidateFacet;
use super::cell::{Cell, ProvedCell};
use super::grid_lines::FACING;
use crate::math::Uv;
use crate::tessellate::nodes::{Nodes, ProvedFacet, edge_key};
use crate::tessellate::proof::border_chord::BorderChords;
use crate::tessellate::proof::facet::prove_triangle;
use crate::tessellate::proof::flat_triangle::distance_to_chord;
use crate::tessellate::proof::prover::Prover;
use crate::tessellate::taken_chords::TakenChords;
use std::iter;

/// Most pieces of a cell that is cut from hanging vertex to hanging vertex.
const MAX_PIECES: usize = 16;
/// Largest polygon that is resolved by trying all triangulations: their number grows with the cube.
const MAX_CORNERS: usize = 24;
/// Sine of the sharpest corner, in parameters, of a triangle that a cell is cut into.
const SHARPEST: f64 = 1e-5;
/// Share by which the second diagonal must be nearer to the surface to be taken: rounding does not decide.
const NEARER: f64 = 1e-9;
/// How far a border node may lie from the corner of a cell that takes its proof over: share of the parameter resolution, and of the
/// tolerance in space.
const SAME_CORNER: [f64; 2] = [1e-4, 1e-6];
/// Share of the surface's size that covers those parameters' last digits: [`SAME_CORNER`] of the resolution is 1e-11 of the domain.
const MOVED_PARAMETERS: f64 = 1e-10;

/// The cells of a face that became facets.
#[derive(Default)]
pub(in crate::tessellate) struct Grid {
    /// Corners in order of the traced diagonal.
    pub(in crate::tessellate) quads: Vec<ProvedFacet<4>>,
    /// Pieces of cells with hanging vertices; the transition's pairing may join them to quads.
    pub(in crate::tessellate) triangles: Vec<ProvedFacet<3>>,
    /// Sides of the facets that belong to one of them alone, which the transition must meet.
    pub(in crate::tessellate) outline: Vec<[u32; 2]>,
}

/// Nodes and surface from which cells are made.
pub(in crate::tessellate) struct GridInput<'g> {
    /// Those of the border at first; corners of cells are added.
    pub(in crate::tessellate) nodes: &'g mut Nodes,
    /// How far edges stray from the segments of the border.
    pub(in crate::tessellate) chords: &'g BorderChords,
    /// Parameters nearer than this are one.
    pub(in crate::tessellate) resolution: Uv,
    /// Chords that no side of a facet may be.
    pub(in crate::tessellate) taken: &'g TakenChords,
}

/// Returns all nodes around a cell, counter-clockwise from its first corner.
pub(super) fn nodes_around(corners: &[u32; 4], hanging: &[Vec<u32>; 4]) -> Vec<u32> {
    (0..4).flat_map(|k| iter::once(corners[k]).chain(hanging[k].iter().copied())).collect()
}

/// Makes facets of single cells.
pub(super) struct CellFacets<'b, 'g, 's, 'a> {
    pub(super) prover: &'b mut Prover<'s, 'a>,
    pub(super) input: GridInput<'g>,
}

impl CellFacets<'_, '_, '_, '_> {
    /// Bounds the triangle of nodes `t`, held to `slack` times its tolerance; the caller checks whether it holds.
    fn prove(&mut self, t: [u32; 3], slack: f64) -> ProvedFacet<3> {
        prove_triangle(self.prover, self.input.nodes, t, self.input.chords, slack)
    }

    /// Adds to `grid` the facets of a cell with hanging nodes: a grid of quads, or else triangles. `None`, and nothing added, where neither
    /// holds.
    pub(super) fn with_hanging_nodes(
        &mut self,
        proved: &ProvedCell,
        corners: &[u32; 4],
        hanging: &[Vec<u32>; 4],
        grid: &mut Grid,
    ) -> Option<()> {
        match self.cut_across(proved.slack, corners, hanging) {
            Some(pieces) => grid.quads.extend(pieces),
            None => grid.triangles.extend(self.triangulate(proved.slack, &nodes_around(corners, hanging))?),
        }
        Some(())
    }

    /// Whether a cell holds with these hanging nodes, as [`Self::with_hanging_nodes`] makes it; without any it does.
    pub(super) fn holds(&mut self, proved: &ProvedCell, corners: &[u32; 4], hanging: &[Vec<u32>; 4]) -> bool {
        let mark = self.input.nodes.mark();
        let holds = hanging.iter().all(Vec::is_empty)
            || self.with_hanging_nodes(proved, corners, hanging, &mut Grid::default()).is_some();
        self.input.nodes.rewind(mark);
        holds
    }

    /// Returns the facet of a cell with corners on the border and no hanging nodes; `None` where it does not hold or a side is a chord of
    /// another face.
    pub(super) fn at_border(&mut self, proved: &ProvedCell, corners: &[u32; 4]) -> Option<ProvedFacet<4>> {
        let at = corners.map(|c| self.input.nodes[c].position);
        // Another face has this chord already: with a side on it the edge would have more than two facets.
        if (0..4).any(|k| self.input.taken.contains([at[k], at[(k + 1) % 4]])) {
            return None;
        }
        self.with_proof_of_cell(proved, corners).or_else(|| self.prove_quad(proved.slack, *corners))
    }

    /// Returns the first of two quads, by diagonal, that holds `slack` times its tolerance on the nodes' own places, edges along its sides
    /// included; `None` if neither does, if a side is taken, or if two corners share a position.
    fn prove_quad(&mut self, slack: f64, corners: [u32; 4]) -> Option<ProvedFacet<4>> {
        let n = corners.map(|c| self.input.nodes[c]);
        let is_taken = |k: usize| self.input.taken.contains([n[k].position, n[(k + 1) % 4].position]);
        if (0..4).any(|i| is_taken(i) || (0..i).any(|j| n[i].position == n[j].position)) {
            return None;
        }
        // Two diagonals, of which the nearer one is tried first and the other only where it fails.
        let middle = self.prover.surface.point(0.25 * (n[0].uv + n[1].uv + n[2].uv + n[3].uv));
        let off = |i: usize, j: usize| distance_to_chord(middle, &[n[i].place, n[j].place]);
        // The diagonal that passes nearer to the surface's middle is tried first.
        let better = if off(1, 3) < off(0, 2) * (1.0 - NEARER) { 1 } else { 0 };
        let halves = [better, better + 1].into_iter().find_map(|r| {
            let q: [u32; 4] = std::array::from_fn(|k| corners[(k + r) % 4]);
            let [x, y] = [[q[0], q[1], q[2]], [q[0], q[2], q[3]]].map(|t| self.prove(t, slack));
            let (bound, tolerance) = (x.bound.max(y.bound), x.tolerance.min(y.tolerance));
            (bound <= tolerance * slack).then_some(ProvedFacet { nodes: q, bound, tolerance })
        });
        halves.or_else(|| self.prove_rectangle(slack, corners))
    }

    /// Returns the facet of four nodes at the corners of a rectangle of the parameter plane, proved as one like a cell; `None` where they
    /// are elsewhere or it does not hold. Where parameters run unevenly, the surface over half of it may reach beyond the diagonal.
    fn prove_rectangle(&mut self, slack: f64, corners: [u32; 4]) -> Option<ProvedFacet<4>> {
        let uv = corners.map(|c| self.input.nodes[c].uv);
        let cell = Cell { lo: uv[0], hi: uv[2] };
        if cell.corners() != uv {
            return None;
        }
        let surface = self.prover.surface;
        let tolerance = uv.iter().fold(surface.tolerance(cell.center()), |x, &p| x.min(surface.tolerance(p)));
        let candidate = CandidateFacet::new(surface, cell);
        let bound = candidate.bound(self.prover, cell, tolerance * slack);
        let (first, places) = (candidate.first_corner(), candidate.places());
        let proved = ProvedCell { cell, bound, tolerance, slack, first, places };
        self.with_proof_of_cell(&proved, &corners)
    }

    /// Returns the facet of a cell whose corners are border nodes, by the cell's own proof and the curves that its border sides follow.
    /// `None` when a node lies elsewhere than the corner, two share a position, or the sum exceeds the limit.
    fn with_proof_of_cell(&mut self, proved: &ProvedCell, corners: &[u32; 4]) -> Option<ProvedFacet<4>> {
        let nodes = &*self.input.nodes;
        let n = corners.map(|c| nodes[c]);
        let tolerance = proved.tolerance;
        let at = proved.cell.corners();
        let mut moved = 0f64;
        for k in 0..4 {
            let elsewhere = (n[k].uv - at[k]).abs().cmpgt(SAME_CORNER[0] * self.input.resolution).any();
            if elsewhere || (0..k).any(|j| n[j].position == n[k].position) {
                return None;
            }
            moved = moved.max((n[k].place - proved.places[k]).length());
        }
        // Lines and triangles through moved points move no farther than these: four times as much is more than they need.
        // What is added beside it covers parameters that differ in their last digits.
        let limit = tolerance * proved.slack;
        if moved > SAME_CORNER[1] * tolerance {
            return None;
        }
        let q: [u32; 4] = std::array::from_fn(|k| corners[(k + proved.first) % 4]);
        let mut worst = proved.bound + 4.0 * moved + MOVED_PARAMETERS * self.prover.surface.size;
        for t in [[q[0], q[1], q[2]], [q[0], q[2], q[3]]] {
            let xyz = t.map(|i| nodes[i].place);
            for k in 0..3 {
                if let Some(chord) = self.input.chords.get(&edge_key(t[k], t[(k + 1) % 3])) {
                    worst = worst.max(chord.bound(self.prover, xyz, limit));
                }
            }
        }
        (worst <= limit).then_some(ProvedFacet { nodes: q, bound: worst, tolerance })
    }

    /// Cuts a cell into a grid of quads between hanging nodes that face each other on opposite sides. `None` when they do not, for more
    /// than [`MAX_PIECES`], or when a piece does not hold; the nodes made for it are taken back then.
    pub(super) fn cut_across(
        &mut self,
        slack: f64,
        corners: &[u32; 4],
        hanging: &[Vec<u32>; 4],
    ) -> Option<Vec<ProvedFacet<4>>> {
        let (nx, ny) = (hanging[0].len() + 1, hanging[1].len() + 1);
        // Opposite sides must have as many nodes, and not more pieces come of it than are worth it.
        if hanging[2].len() + 1 != nx || hanging[3].len() + 1 != ny || nx * ny > MAX_PIECES {
            return None;
        }
        let row = |from: u32, between: &[u32], to: u32| [&[from], between, &[to]].concat();
        let reversed = |x: &[u32]| x.iter().rev().copied().collect::<Vec<u32>>();
        let bottom = row(corners[0], &hanging[0], corners[1]);
        let top = row(corners[3], &reversed(&hanging[2]), corners[2]);
        let left = row(corners[0], &reversed(&hanging[3]), corners[3]);
        let right = row(corners[1], &hanging[1], corners[2]);
        let nodes = &mut *self.input.nodes;
        let size = nodes[corners[2]].uv - nodes[corners[0]].uv;
        let face_each_other = |a: &[u32], b: &[u32], d: usize| {
            a.iter().zip(b).all(|(&x, &y)| (nodes[x].uv[d] - nodes[y].uv[d]).abs() <= FACING * size[d].abs())
        };
        if !face_each_other(&bottom, &top, 0) || !face_each_other(&left, &right, 1) {
            return None;
        }
        // The nodes of the pieces, row by row; inner ones are new, and are taken back when a piece does not hold.
        let mark = nodes.mark();
        let mut at = vec![vec![0u32; ny + 1]; nx + 1];
        for i in 0..=nx {
            for j in 0..=ny {
                at[i][j] = match (i, j) {
                    (_, 0) => bottom[i],
                    (_, j) if j == ny => top[i],
                    (0, _) => left[j],
                    (i, _) if i == nx => right[j],
                    _ => {
                        let x = 0.5 * (nodes[bottom[i]].uv.x + nodes[top[i]].uv.x);
                        let uv = Uv::new(x, 0.5 * (nodes[left[j]].uv.y + nodes[right[j]].uv.y));
                        nodes.push_own(uv, self.prover.surface.point(uv))
                    }
                };
            }
        }
        let pieces = (0..nx * ny).map(|k| {
            let (i, j) = (k / ny, k % ny);
            self.prove_quad(slack, [at[i][j], at[i + 1][j], at[i + 1][j + 1], at[i][j + 1]])
        });
        let made: Option<Vec<_>> = pieces.collect();
        if made.is_none() {
            self.input.nodes.rewind(mark);
        }
        made
    }

    /// Cuts the polygon around a cell into the triangles whose diagonals lie nearest to the surface, and proves each; `None` when one
    /// exceeds `slack` tolerances or has a taken side.
    fn triangulate(&mut self, slack: f64, polygon: &[u32]) -> Option<Vec<ProvedFacet<3>>> {
        // Among triangulations the one whose diagonals lie nearest to the surface is most likely to hold; only that
        // one is tried.
        let triangles = self.best_triangulation(polygon)?;
        let mut made = Vec::with_capacity(triangles.len());
        for t in triangles {
            let t = t.map(|i| polygon[i]);
            let p = t.map(|n| self.input.nodes[n].position);
            if (0..3).any(|k| p[k] == p[(k + 1) % 3] || self.input.taken.contains([p[k], p[(k + 1) % 3]])) {
                return None;
            }
            let proved = self.prove(t, slack);
            if proved.bound > proved.tolerance * slack {
                return None;
            }
            made.push(proved);
        }
        Some(made)
    }

    /// Returns the triangulation, as indices into `polygon`, with the least sum of squared distances of its diagonals from the surface.
    /// `None` for more than [`MAX_CORNERS`] corners and where every one has a triangle without area.
    fn best_triangulation(&self, polygon: &[u32]) -> Option<Vec<[usize; 3]>> {
        // Triangulation of least weight by dynamic programming (Klincsek 1980): O(n³) for n corners, hence the limit.
        let n = polygon.len();
        if n > MAX_CORNERS {
            return None;
        }
        let node = |i: usize| self.input.nodes[polygon[i]];
        let off = |i: usize, j: usize| {
            let (a, b) = (node(i), node(j));
            distance_to_chord(self.prover.surface.point(0.5 * (a.uv + b.uv)), &[a.place, b.place])
        };
        // cost[i][j]: best triangulation of corners i..=j; a triangle of zero area in parameters is no triangle.
        let mut cost = vec![vec![0f64; n]; n];
        let mut choice = vec![vec![0usize; n]; n];
        for gap in 2..n {
            for i in 0..n - gap {
                let j = i + gap;
                // Sides of the polygon are given, the one that closes it too, so that only diagonals cost.
                let chord = if i == 0 && j == n - 1 { 0.0 } else { off(i, j).powi(2) };
                cost[i][j] = f64::INFINITY;
                for k in i + 1..j {
                    let x = (node(k).uv - node(i).uv) / self.input.resolution;
                    let y = (node(j).uv - node(i).uv) / self.input.resolution;
                    // Corners on one side of the cell stand in a line: a triangle of three of them has no area.
                    if x.perp_dot(y) <= SHARPEST * x.length() * y.length() {
                        continue;
                    }
                    let c = cost[i][k] + cost[k][j] + chord;
                    if c < cost[i][j] {
                        (cost[i][j], choice[i][j]) = (c, k);
                    }
                }
            }
        }
        if !cost[0][n - 1].is_finite() {
            return None;
        }
        let mut triangles: Vec<[usize; 3]> = Vec::new();
        let mut open = vec![(0, n - 1)];
        while let Some((i, j)) = open.pop() {
            if j - i >= 2 {
                let k = choice[i][j];
                triangles.push([i, k, j]);
                open.extend([(i, k), (k, j)]);
            }
        }
        Some(triangles)
    }
}

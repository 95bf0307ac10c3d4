//! The parameter lines on which sides of cells lie, and the nodes on them.

use super::cell::{Cell, Subdivision};
use crate::math::Uv;
use crate::tessellate::nodes::{Nodes, edge_key};
use rustc_hash::{FxHashMap, FxHashSet};

/// Most cells that are cut to lead one hanging vertex to another.
const MAX_BRIDGE: usize = 3;
/// Share of a cell's size within which hanging vertices face each other.
pub(super) const FACING: f64 = 0.15;

/// A place for a further node on side `side`, 0 to 3 as in [`Cell::corners`], of cell `cell` of the queried list.
pub(super) struct Bridge {
    pub(super) cell: usize,
    pub(super) side: usize,
    /// The parameter that changes along the side.
    pub(super) at: f64,
}

/// The nodes on the lines that sides of cells lie on.
pub(in crate::tessellate) struct GridLines {
    /// Parameters of the lines of constant u and of constant v, ascending.
    parameters: [Vec<f64>; 2],
    /// On each of those lines, pairs of the other parameter and a node, in order of that parameter once sorted.
    pub(in crate::tessellate) nodes: [Vec<Vec<(f64, u32)>>; 2],
    /// Parameters nearer than this are one.
    resolution: Uv,
}

impl GridLines {
    /// Returns the lines that sides of cells inside lie on, without nodes. `resolution` is how near parameters are one.
    pub(in crate::tessellate) fn new(cells: &Subdivision, resolution: Uv) -> Self {
        let parameters = [0, 1].map(|d| {
            let mut x: Vec<f64> = cells.inside.iter().flat_map(|l| [l.cell.lo[d], l.cell.hi[d]]).collect();
            // Cuts of the tree are the same numbers on both sides, so that equal lines are equal to the bit.
            x.sort_unstable_by(f64::total_cmp);
            x.dedup();
            x
        });
        let nodes = [0, 1].map(|d| vec![Vec::new(); parameters[d].len()]);
        Self { parameters, nodes, resolution }
    }

    /// Brings the nodes of each line into order.
    pub(super) fn sort(&mut self) {
        for line in self.nodes.iter_mut().flatten() {
            line.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
    }

    /// Returns the index of the line of constant parameter `d` (0 for u, 1 for v) at exactly `x`, which must be the side of a cell inside.
    pub(super) fn side_line(&self, d: usize, x: f64) -> usize {
        let line = self.parameters[d].partition_point(|&y| y < x);
        debug_assert_eq!(self.parameters[d].get(line), Some(&x), "the lines are those of all cells");
        line
    }

    /// Returns the index of the line of constant parameter `d` nearest to `x` within the resolution; `None` where there is none.
    pub(in crate::tessellate) fn find(&self, d: usize, x: f64) -> Option<usize> {
        let l = &self.parameters[d];
        let i = l.partition_point(|&y| y < x);
        let near = |i: &usize| l.get(*i).is_some_and(|y| (y - x).abs() <= self.resolution[d]);
        [Some(i), i.checked_sub(1)].into_iter().flatten().filter(near).min_by(|&i, &j| {
            let off = |i: usize| (l[i] - x).abs();
            off(i).total_cmp(&off(j))
        })
    }

    /// Returns the nodes on the line where parameter `d` is `level`, with the other parameter strictly between `a` and `b`, from `a` to
    /// `b`; empty without such a line. The lines must be sorted.
    fn nodes_between(&self, d: usize, level: f64, a: f64, b: f64) -> Vec<u32> {
        let Some(line) = self.find(d, level).map(|i| &self.nodes[d][i]) else { return Vec::new() };
        // Without the ends, which are the cell's own corners, or as good as these.
        let (lo, hi) = (a.min(b) + self.resolution[1 - d], a.max(b) - self.resolution[1 - d]);
        let (i, j) = (line.partition_point(|x| x.0 <= lo), line.partition_point(|x| x.0 < hi));
        let mut inner: Vec<u32> = line[i..j.max(i)].iter().map(|x| x.1).collect();
        if a > b {
            inner.reverse();
        }
        inner
    }

    /// Returns the nodes strictly within the four sides of a cell, side by side and counter-clockwise from `lo`; the lines must be sorted.
    pub(in crate::tessellate) fn hanging_nodes(&self, cell: &Cell) -> [Vec<u32>; 4] {
        let (lo, hi) = (cell.lo, cell.hi);
        [
            self.nodes_between(1, lo.y, lo.x, hi.x),
            self.nodes_between(0, hi.x, lo.y, hi.y),
            self.nodes_between(1, hi.y, hi.x, lo.x),
            self.nodes_between(0, lo.x, hi.y, lo.y),
        ]
    }

    /// Returns which line a side of a cell, 0 to 3 as in [`Cell::corners`], lies on: the parameter that is constant there, and the index.
    pub(super) fn line_of_side(&self, cell: &Cell, side: usize) -> [usize; 2] {
        let e = 1 - side % 2;
        [e, self.side_line(e, cell.corners()[side][e])]
    }

    /// Adds a node on a side of a cell, at the parameter `at` that changes along it, and returns the line as [`Self::line_of_side`] does.
    /// The lines must be sorted, and stay so.
    pub(super) fn add_node(&mut self, cell: &Cell, side: usize, at: f64, node: u32) -> [usize; 2] {
        let [e, line] = self.line_of_side(cell, side);
        let on = &mut self.nodes[e][line];
        on.insert(on.partition_point(|n| n.0 < at), (at, node));
        [e, line]
    }

    /// Returns places for further nodes: where one hanging vertex faces another in a row of at most [`MAX_BRIDGE`] cells, the sides between
    /// get one too, so that all of these cells fall into quads. `cells` are with the nodes of their corners; the lines must be sorted.
    pub(in crate::tessellate) fn bridges(&self, cells: &[(Cell, [u32; 4])], nodes: &Nodes) -> Vec<Bridge> {
        let mut sides_at: FxHashMap<[u32; 2], Vec<(usize, usize)>> = FxHashMap::default();
        let name = |i: usize, s: usize| edge_key(cells[i].1[s], cells[i].1[(s + 1) % 4]);
        for i in 0..cells.len() {
            (0..4).for_each(|s| sides_at.entry(name(i, s)).or_default().push((i, s)));
        }
        let inner: Vec<[Vec<u32>; 4]> = cells.iter().map(|(c, _)| self.hanging_nodes(c)).collect();
        let mut out = Vec::new();
        let mut bridged: FxHashSet<[u32; 2]> = FxHashSet::default();
        for (i, sides) in inner.iter().enumerate() {
            for s in 0..4 {
                // From the hanging vertex across cells without any, to one that faces it.
                let [hanging] = sides[s].as_slice() else { continue };
                let d = s % 2;
                let x = nodes[*hanging].uv[d];
                let mut between: Vec<(usize, usize)> = Vec::new();
                let (mut cell, mut far) = (i, (s + 2) % 4);
                let found = loop {
                    if let [facing] = inner[cell][far].as_slice() {
                        let size = cells[i].0.hi[d] - cells[i].0.lo[d];
                        break !between.is_empty() && (nodes[*facing].uv[d] - x).abs() <= FACING * size;
                    }
                    // The other cell that has this side to the bit; none where the grid ends or changes its width.
                    let next = sides_at[&name(cell, far)].iter().find(|n| n.0 != cell);
                    let Some(&(next, t)) = next.filter(|_| inner[cell][far].is_empty()) else { break false };
                    // A cell with hanging vertices of its own ends the way.
                    between.push((cell, far));
                    // Long ways cut cells that had no need to be, and two that cross would meet in a cell with
                    // both.
                    if between.len() >= MAX_BRIDGE || bridged.contains(&name(cell, far)) {
                        break false;
                    }
                    (cell, far) = (next, (t + 2) % 4);
                };
                if found {
                    bridged.extend(between.iter().map(|&(c, s)| name(c, s)));
                    out.extend(between.into_iter().map(|(cell, side)| Bridge { cell, side, at: x }));
                }
            }
        }
        out
    }
}

//! The parameter lines on which sides of cells lie, and the nodes on them.

use super::tree::{Cell, Leaves};
use crate::math::Uv;
use crate::tessellate::strip::delaunay::{Node, key};
use rustc_hash::FxHashMap;

/// Most cells that are cut to lead one hanging vertex to another.
const LONGEST: usize = 3;

/// The nodes on the lines that sides of cells lie on.
pub(in crate::tessellate) struct Lines {
    /// Parameters of the lines across u and v, ascending.
    at: [Vec<f64>; 2],
    /// On each of them, the nodes in order of the other parameter.
    pub(in crate::tessellate) on: [Vec<Vec<(f64, u32)>>; 2],
    same: Uv,
}

impl Lines {
    pub(in crate::tessellate) fn new(leaves: &Leaves, same: Uv) -> Self {
        let at = [0, 1].map(|d| {
            let mut x: Vec<f64> = leaves.inside.iter().flat_map(|l| [l.cell.lo[d], l.cell.hi[d]]).collect();
            x.sort_unstable_by(f64::total_cmp);
            x.dedup();
            x
        });
        let on = [0, 1].map(|d| vec![Vec::new(); at[d].len()]);
        Self { at, on, same }
    }

    /// The line at a parameter.
    pub(in crate::tessellate) fn find(&self, d: usize, x: f64) -> Option<usize> {
        let l = &self.at[d];
        let i = l.partition_point(|&y| y < x);
        let near = |i: &usize| l.get(*i).is_some_and(|y| (y - x).abs() <= self.same[d]);
        [Some(i), i.checked_sub(1)].into_iter().flatten().filter(near).min_by(|&i, &j| {
            let off = |i: usize| (l[i] - x).abs();
            off(i).total_cmp(&off(j))
        })
    }

    /// Nodes on line `on` of direction `d` strictly between two parameters, in that order.
    fn between(&self, d: usize, on: f64, a: f64, b: f64) -> Vec<u32> {
        let Some(line) = self.find(d, on).map(|i| &self.on[d][i]) else { return Vec::new() };
        let (lo, hi) = (a.min(b) + self.same[1 - d], a.max(b) - self.same[1 - d]);
        let (i, j) = (line.partition_point(|x| x.0 <= lo), line.partition_point(|x| x.0 < hi));
        let mut inner: Vec<u32> = line[i..j.max(i)].iter().map(|x| x.1).collect();
        if a > b {
            inner.reverse();
        }
        inner
    }

    /// Nodes inside the four sides of a cell, in counter-clockwise order.
    pub(in crate::tessellate) fn sides(&self, cell: &Cell) -> [Vec<u32>; 4] {
        let (lo, hi) = (cell.lo, cell.hi);
        [
            self.between(1, lo.y, lo.x, hi.x),
            self.between(0, hi.x, lo.y, hi.y),
            self.between(1, hi.y, hi.x, lo.x),
            self.between(0, lo.x, hi.y, lo.y),
        ]
    }

    /// Places for further nodes, each on the side `s` of a cell at a parameter: where one hanging vertex faces another across a
    /// few cells, the sides between get one too, so that all of them fall into quads.
    pub(in crate::tessellate) fn bridges(
        &self,
        cells: &[(Cell, [u32; 4])],
        nodes: &[Node],
    ) -> Vec<(usize, usize, f64)> {
        let mut beside: FxHashMap<[u32; 2], Vec<(usize, usize)>> = FxHashMap::default();
        let name = |i: usize, s: usize| key(cells[i].1[s], cells[i].1[(s + 1) % 4]);
        for i in 0..cells.len() {
            (0..4).for_each(|s| beside.entry(name(i, s)).or_default().push((i, s)));
        }
        let inner: Vec<[Vec<u32>; 4]> = cells.iter().map(|(c, _)| self.sides(c)).collect();
        let mut out = Vec::new();
        let mut met: FxHashMap<[u32; 2], ()> = FxHashMap::default();
        for (i, sides) in inner.iter().enumerate() {
            for s in 0..4 {
                let [hanging] = sides[s].as_slice() else { continue };
                let d = s % 2;
                let x = nodes[*hanging as usize].uv[d];
                let mut between: Vec<(usize, usize)> = Vec::new();
                let (mut cell, mut far) = (i, (s + 2) % 4);
                let found = loop {
                    if let [facing] = inner[cell][far].as_slice() {
                        let size = cells[i].0.hi[d] - cells[i].0.lo[d];
                        break !between.is_empty() && (nodes[*facing as usize].uv[d] - x).abs() <= 0.15 * size;
                    }
                    let next = beside[&name(cell, far)].iter().find(|n| n.0 != cell);
                    let Some(&(next, t)) = next.filter(|_| inner[cell][far].is_empty()) else { break false };
                    between.push((cell, far));
                    if between.len() >= LONGEST || met.contains_key(&name(cell, far)) {
                        break false;
                    }
                    (cell, far) = (next, (t + 2) % 4);
                };
                if found {
                    met.extend(between.iter().map(|&(c, s)| (name(c, s), ())));
                    out.extend(between.into_iter().map(|(c, s)| (c, s, x)));
                }
            }
        }
        out
    }
}

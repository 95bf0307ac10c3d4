//! Whole cells as facets, and how their hanging vertices are resolved without cracks.

use super::bound::{Prover, from_line};
use super::cells::{Cell, Leaves};
use super::look::facet_of;
use super::sheet::Sheet;
use super::strip::{Node, key, prove};
use super::trim::Trim;
use crate::math::Uv;
use rustc_hash::FxHashMap;

/// The cells of a face that became facets.
#[derive(Default)]
pub(super) struct Grid {
    /// Corners in order of the traced diagonal, counter-clockwise in parameters, with bound and tolerance.
    pub(super) quads: Vec<([u32; 4], f64, f64)>,
    /// Pieces of cells with hanging vertices, to be joined in pairs.
    pub(super) triangles: Vec<([u32; 3], f64, f64)>,
    /// Segments between the cells and the rest of the face.
    pub(super) outline: Vec<[u32; 2]>,
}

/// What cells are made on.
pub(super) struct Ground<'g> {
    /// Those of the border at first; corners of cells are added.
    pub(super) nodes: &'g mut Vec<Node>,
    /// What border segments follow.
    pub(super) trims: &'g FxHashMap<[u32; 2], Trim>,
    /// Parameters nearer than this are one.
    pub(super) same: Uv,
    /// First free position.
    pub(super) next: u32,
}

/// The nodes on the lines that sides of cells lie on.
struct Lines {
    /// Parameters of the lines across u and v, ascending.
    at: [Vec<f64>; 2],
    /// On each of them, the nodes in order of the other parameter.
    on: [Vec<Vec<(f64, u32)>>; 2],
    same: Uv,
}

impl Lines {
    fn new(leaves: &Leaves, same: Uv) -> Self {
        let at = [0, 1].map(|d| {
            let mut x: Vec<f64> = leaves.inside.iter().flat_map(|(c, _, _)| [c.lo[d], c.hi[d]]).collect();
            x.sort_unstable_by(f64::total_cmp);
            x.dedup();
            x
        });
        let on = [0, 1].map(|d| vec![Vec::new(); at[d].len()]);
        Self { at, on, same }
    }

    /// The line at a parameter.
    fn find(&self, d: usize, x: f64) -> Option<usize> {
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
}

/// Makes facets of the inside leaves; cells that cannot be resolved within their tolerance are left to the strip.
pub(super) fn build(
    sheet: &Sheet<'_>,
    prover: &mut Prover<'_, '_>,
    leaves: &Leaves,
    ground: &mut Ground<'_>,
) -> Grid {
    let mut grid = Grid::default();
    let border = ground.nodes.len() as u32;
    let mut lines = Lines::new(leaves, ground.same);
    let mut ids: FxHashMap<[usize; 2], u32> = FxHashMap::default();
    for (id, n) in (0..border).zip(ground.nodes.iter()) {
        let found = [lines.find(0, n.uv.x), lines.find(1, n.uv.y)];
        if let [Some(i), Some(j)] = found
            && ids.contains_key(&[i, j])
        {
            continue;
        }
        for d in 0..2 {
            if let Some(i) = found[d] {
                lines.on[d][i].push((n.uv[1 - d], id));
            }
        }
        if let [Some(i), Some(j)] = found {
            ids.insert([i, j], id);
        }
    }
    let mut cells: Vec<[u32; 4]> = Vec::with_capacity(leaves.inside.len());
    for (cell, _, _) in &leaves.inside {
        cells.push(cell.corners().map(|c| {
            let (i, j) = (lines.find(0, c.x).unwrap_or(0), lines.find(1, c.y).unwrap_or(0));
            *ids.entry([i, j]).or_insert_with(|| {
                let id = ground.nodes.len() as u32;
                ground.nodes.push(Node { uv: c, place: sheet.point(c), position: ground.next });
                ground.next += 1;
                lines.on[0][i].push((c.y, id));
                lines.on[1][j].push((c.x, id));
                id
            })
        }));
    }
    for line in lines.on.iter_mut().flatten() {
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let mut segments: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    let mut order: Vec<[u32; 2]> = Vec::new();
    for ((cell, bound, xi), corners) in leaves.inside.iter().zip(&cells) {
        let (lo, hi) = (cell.lo, cell.hi);
        let inner = [
            lines.between(1, lo.y, lo.x, hi.x),
            lines.between(0, hi.x, lo.y, hi.y),
            lines.between(1, hi.y, hi.x, lo.x),
            lines.between(0, lo.x, hi.y, lo.y),
        ];
        let polygon: Vec<u32> =
            (0..4).flat_map(|k| std::iter::once(corners[k]).chain(inner[k].iter().copied())).collect();
        let at_border = polygon.iter().any(|&n| n < border);
        let made = if polygon.len() > 4 {
            resolve(sheet, prover, &polygon, ground).map(|t| grid.triangles.extend(t))
        } else if at_border {
            beside(sheet, prover, *cell, corners, ground).map(|q| grid.quads.push(q))
        } else {
            let first = facet_of(sheet, *cell)[0].0;
            let r = (0..4).find(|&r| ground.nodes[corners[r] as usize].uv == first).unwrap_or(0);
            grid.quads.push((std::array::from_fn(|k| corners[(k + r) % 4]), *bound, *xi));
            Some(())
        };
        if made.is_none() {
            continue;
        }
        for (i, &a) in polygon.iter().enumerate() {
            let name = key(a, polygon[(i + 1) % polygon.len()]);
            let count = segments.entry(name).or_insert(0);
            if *count == 0 {
                order.push(name);
            }
            *count += 1;
        }
    }
    grid.outline = order.into_iter().filter(|name| segments[name] % 2 == 1).collect();
    grid
}

/// A cell with corners on the border: its facet must hold with the border's own points, and follow its curve.
fn beside(
    sheet: &Sheet<'_>,
    prover: &mut Prover<'_, '_>,
    cell: Cell,
    corners: &[u32; 4],
    ground: &Ground<'_>,
) -> Option<([u32; 4], f64, f64)> {
    let place = |k: usize| ground.nodes[corners[k % 4] as usize].position;
    if (0..4).any(|k| place(k) == place(k + 1)) || place(0) == place(2) || place(1) == place(3) {
        return None;
    }
    let first = facet_of(sheet, cell)[0].0;
    let better = (0..4).find(|&r| cell.corners()[r] == first).unwrap_or(0);
    [better, better + 1].into_iter().find_map(|r| {
        let q: [u32; 4] = std::array::from_fn(|k| corners[(k + r) % 4]);
        let [x, y] =
            [[q[0], q[1], q[2]], [q[0], q[2], q[3]]].map(|t| prove(sheet, prover, ground.nodes, t, ground.trims));
        let (bound, xi) = (x.0.max(y.0), x.1.min(y.1));
        (bound <= xi).then_some((q, bound, xi))
    })
}

/// Largest polygon that is resolved by trying all triangulations.
const MOST_CORNERS: usize = 24;

/// Cuts a cell with hanging vertices into the triangles whose diagonals lie nearest to the surface.
fn resolve(
    sheet: &Sheet<'_>,
    prover: &mut Prover<'_, '_>,
    polygon: &[u32],
    ground: &Ground<'_>,
) -> Option<Vec<([u32; 3], f64, f64)>> {
    let n = polygon.len();
    if n > MOST_CORNERS {
        return None;
    }
    let at = |i: usize| {
        let node = ground.nodes[polygon[i] as usize];
        (node.uv, node.place)
    };
    let off = |i: usize, j: usize| {
        let (a, b) = (at(i), at(j));
        from_line(sheet.point(0.5 * (a.0 + b.0)), &[a.1, b.1])
    };
    // cost[i][j]: best triangulation of corners i..=j; a triangle of zero area in parameters is no triangle.
    let mut cost = vec![vec![0f64; n]; n];
    let mut choice = vec![vec![0usize; n]; n];
    for gap in 2..n {
        for i in 0..n - gap {
            let j = i + gap;
            let chord = if i == 0 && j == n - 1 { 0.0 } else { off(i, j).powi(2) };
            cost[i][j] = f64::INFINITY;
            for k in i + 1..j {
                let (x, y) = ((at(k).0 - at(i).0) / ground.same, (at(j).0 - at(i).0) / ground.same);
                if x.perp_dot(y) <= 1e-5 * x.length() * y.length() {
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
    let mut stack = vec![(0, n - 1)];
    while let Some((i, j)) = stack.pop() {
        if j - i >= 2 {
            let k = choice[i][j];
            triangles.push([i, k, j]);
            stack.extend([(i, k), (k, j)]);
        }
    }
    let mut made = Vec::with_capacity(triangles.len());
    for t in triangles {
        let t = t.map(|i| polygon[i]);
        let p = t.map(|n| ground.nodes[n as usize].position);
        if p[0] == p[1] || p[1] == p[2] || p[2] == p[0] {
            return None;
        }
        let (bound, xi) = prove(sheet, prover, ground.nodes, t, ground.trims);
        if bound > xi {
            return None;
        }
        made.push((t, bound, xi));
    }
    Some(made)
}

//! Whole cells as facets, and how their hanging vertices are resolved without cracks.

use super::bound::{Prover, from_line};
use super::cells::{Cell, Corners, Leaves, facet_of, quad_bound};
use super::sheet::Sheet;
use crate::math::{Point, Uv};
use rustc_hash::FxHashMap;

/// The cells of a face that became facets.
#[derive(Default)]
pub(super) struct Grid {
    pub(super) nodes: Vec<(Uv, Point)>,
    /// Corners in order of the traced diagonal, counter-clockwise in parameters, with bound and tolerance.
    pub(super) facets: Vec<GridFacet>,
    /// Segments between the cells and the rest of the face.
    pub(super) outline: Vec<[u32; 2]>,
}

/// A facet on the nodes of the grid; a triangle repeats its third corner.
pub(super) struct GridFacet {
    pub(super) nodes: [u32; 4],
    pub(super) bound: f64,
    pub(super) tolerance: f64,
}

/// Makes facets of the inside leaves; cells that cannot be resolved within their tolerance are left to the strip.
pub(super) fn build(sheet: &Sheet<'_>, prover: &mut Prover<'_, '_>, leaves: &Leaves) -> Grid {
    let mut grid = Grid::default();
    let mut ids: FxHashMap<[u64; 2], u32> = FxHashMap::default();
    let mut lines: [FxHashMap<u64, Vec<(f64, u32)>>; 2] = Default::default();
    let cells: Vec<[u32; 4]> = leaves
        .inside
        .iter()
        .map(|(cell, _, _)| {
            cell.corners().map(|c| {
                *ids.entry([c.x.to_bits(), c.y.to_bits()]).or_insert_with(|| {
                    let id = grid.nodes.len() as u32;
                    grid.nodes.push((c, sheet.point(c)));
                    lines[0].entry(c.x.to_bits()).or_default().push((c.y, id));
                    lines[1].entry(c.y.to_bits()).or_default().push((c.x, id));
                    id
                })
            })
        })
        .collect();
    for line in lines.iter_mut().flat_map(|l| l.values_mut()) {
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let between = |d: usize, on: f64, a: f64, b: f64| -> Vec<u32> {
        let Some(line) = lines[d].get(&on.to_bits()) else { return Vec::new() };
        let (lo, hi) = (a.min(b), a.max(b));
        let (i, j) = (line.partition_point(|x| x.0 <= lo), line.partition_point(|x| x.0 < hi));
        let mut inner: Vec<u32> = line[i..j].iter().map(|x| x.1).collect();
        if a > b {
            inner.reverse();
        }
        inner
    };
    let mut segments: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    let mut order: Vec<[u32; 2]> = Vec::new();
    for ((cell, bound, xi), corners) in leaves.inside.iter().zip(&cells) {
        let (lo, hi) = (cell.lo, cell.hi);
        let inner = [
            between(1, lo.y, lo.x, hi.x),
            between(0, hi.x, lo.y, hi.y),
            between(1, hi.y, hi.x, lo.x),
            between(0, lo.x, hi.y, lo.y),
        ];
        let polygon: Vec<u32> =
            (0..4).flat_map(|k| std::iter::once(corners[k]).chain(inner[k].iter().copied())).collect();
        let made = if polygon.len() == 4 {
            whole(sheet, *cell, corners, &grid.nodes, [*bound, *xi])
        } else {
            resolve(sheet, prover, &polygon, &grid.nodes, *xi)
        };
        let Some(made) = made else { continue };
        grid.facets.extend(made);
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            let key = [a.min(b), a.max(b)];
            let count = segments.entry(key).or_insert(0);
            if *count == 0 {
                order.push(key);
            }
            *count += 1;
        }
    }
    grid.outline = order.into_iter().filter(|key| segments[key] % 2 == 1).collect();
    grid
}

fn whole(
    sheet: &Sheet<'_>,
    cell: Cell,
    corners: &[u32; 4],
    nodes: &[(Uv, Point)],
    [bound, tolerance]: [f64; 2],
) -> Option<Vec<GridFacet>> {
    let first = facet_of(sheet, cell)[0].0;
    let r = (0..4).find(|&r| nodes[corners[r] as usize].0 == first)?;
    Some(vec![GridFacet { nodes: std::array::from_fn(|k| corners[(k + r) % 4]), bound, tolerance }])
}

/// Largest polygon that is resolved by trying all triangulations.
const MOST_CORNERS: usize = 24;

/// Cuts a cell with hanging vertices into the triangles whose diagonals lie nearest to the surface, and joins pairs.
fn resolve(
    sheet: &Sheet<'_>,
    prover: &mut Prover<'_, '_>,
    polygon: &[u32],
    nodes: &[(Uv, Point)],
    xi: f64,
) -> Option<Vec<GridFacet>> {
    let n = polygon.len();
    if n > MOST_CORNERS {
        return None;
    }
    let at = |i: usize| nodes[polygon[i] as usize];
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
                let area = (at(k).0 - at(i).0).perp_dot(at(j).0 - at(i).0);
                if area <= 0.0 {
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
    let mut made = Vec::new();
    let mut taken = vec![false; triangles.len()];
    for a in 0..triangles.len() {
        if taken[a] {
            continue;
        }
        taken[a] = true;
        let t = triangles[a];
        let mate = (a + 1..triangles.len())
            .filter(|&b| !taken[b])
            .find_map(|b| join(t, triangles[b], &at).map(|q| (b, q)));
        let (corners, quad) = match mate {
            Some((b, q)) => {
                taken[b] = true;
                (q, true)
            }
            None => ([t[0], t[1], t[2], t[2]], false),
        };
        let c: Corners = corners.map(at);
        let bound = if quad {
            quad_bound(prover, &c, xi)
        } else {
            let sides = [[0, 1], [1, 2], [2, 0]].map(|[i, j]| prover.side([c[i].0, c[j].0], [c[i].1, c[j].1], xi));
            let face = prover.piece([c[0].0, c[1].0, c[2].0], [c[0].1, c[1].1, c[2].1], xi);
            sides.into_iter().fold(face, f64::max)
        };
        if bound > xi {
            return None;
        }
        made.push(GridFacet { nodes: corners.map(|i| polygon[i]), bound, tolerance: xi });
    }
    Some(made)
}

/// The quad of two triangles that share an edge, its diagonal first to third; `None` unless strictly convex.
fn join(s: [usize; 3], t: [usize; 3], at: &impl Fn(usize) -> (Uv, Point)) -> Option<[usize; 4]> {
    (0..3).find_map(|k| {
        let (a, b, c) = (s[k], s[(k + 1) % 3], s[(k + 2) % 3]);
        // Shared edge c–a; the other triangle runs a–c.
        let m = (0..3).find(|&m| t[m] == a && t[(m + 1) % 3] == c)?;
        let d = t[(m + 2) % 3];
        let q = [a, b, c, d];
        let p = q.map(|i| at(i).1);
        let n = (p[2] - p[0]).cross(p[3] - p[1]);
        let convex = (0..4).all(|i| {
            let (x, y) = (p[(i + 1) % 4] - p[i], p[(i + 3) % 4] - p[i]);
            x.cross(y).dot(n) > 0.05 * x.length() * y.length() * n.length()
        });
        convex.then_some(q)
    })
}

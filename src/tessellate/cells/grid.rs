//! Whole cells as facets, and how their hanging vertices are resolved without cracks.

use super::lines::Lines;
use super::tree::{Cell, Leaf, Leaves};
use crate::math::Uv;
use crate::tessellate::border::trim::Trim;
use crate::tessellate::proof::bound::Prover;
use crate::tessellate::proof::flat::from_chord;
use crate::tessellate::sheet::Sheet;
use crate::tessellate::strip::delaunay::{Node, key, prove};
use rustc_hash::FxHashMap;

/// The cells of a face that became facets.
#[derive(Default)]
pub(in crate::tessellate) struct Grid {
    /// Corners in order of the traced diagonal, counter-clockwise in parameters, with bound and tolerance.
    pub(in crate::tessellate) quads: Vec<([u32; 4], f64, f64)>,
    /// Pieces of cells with hanging vertices, to be joined in pairs.
    pub(in crate::tessellate) triangles: Vec<([u32; 3], f64, f64)>,
    /// Segments between the cells and the rest of the face.
    pub(in crate::tessellate) outline: Vec<[u32; 2]>,
}

/// What cells are made on.
pub(in crate::tessellate) struct Ground<'g> {
    /// Those of the border at first; corners of cells are added.
    pub(in crate::tessellate) nodes: &'g mut Vec<Node>,
    /// What border segments follow.
    pub(in crate::tessellate) trims: &'g FxHashMap<[u32; 2], Trim>,
    /// Parameters nearer than this are one.
    pub(in crate::tessellate) same: Uv,
    /// First free position.
    pub(in crate::tessellate) next: u32,
}

/// Makes facets of the inside leaves; cells that cannot be resolved within their tolerance are left to the strip.
pub(in crate::tessellate) fn build(
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
    for leaf in &leaves.inside {
        let corners = leaf.cell.corners();
        cells.push([0, 1, 2, 3].map(|k| {
            let c = corners[k];
            let (i, j) = (lines.find(0, c.x).unwrap_or(0), lines.find(1, c.y).unwrap_or(0));
            *ids.entry([i, j]).or_insert_with(|| {
                let id = ground.nodes.len() as u32;
                ground.nodes.push(Node { uv: c, place: leaf.places[k], position: ground.next });
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
    let named: Vec<(Cell, [u32; 4])> = leaves.inside.iter().map(|l| l.cell).zip(cells.iter().copied()).collect();
    for (i, s, x) in lines.bridges(&named, ground.nodes) {
        let (cell, _) = named[i];
        let (d, e) = (s % 2, 1 - s % 2);
        let level = if s == 0 || s == 3 { cell.lo[e] } else { cell.hi[e] };
        let Some(line) = lines.find(e, level) else { continue };
        let mut uv = Uv::splat(level);
        uv[d] = x;
        let on = &mut lines.on[e][line];
        on.insert(on.partition_point(|n| n.0 < x), (x, ground.nodes.len() as u32));
        ground.nodes.push(Node { uv, place: sheet.point(uv), position: ground.next });
        ground.next += 1;
    }
    let mut segments: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    let mut order: Vec<[u32; 2]> = Vec::new();
    for (leaf, corners) in leaves.inside.iter().zip(&cells) {
        let inner = lines.sides(&leaf.cell);
        let polygon: Vec<u32> =
            (0..4).flat_map(|k| std::iter::once(corners[k]).chain(inner[k].iter().copied())).collect();
        let at_border = polygon.iter().any(|&n| n < border);
        let made = if polygon.len() > 4 {
            match lattice(sheet, prover, leaf.slack, corners, &inner, ground) {
                Some(pieces) => {
                    grid.quads.extend(pieces);
                    Some(())
                }
                None => resolve(sheet, prover, leaf.slack, &polygon, ground).map(|t| grid.triangles.extend(t)),
            }
        } else if at_border {
            as_proved(sheet, prover, leaf, corners, ground)
                .or_else(|| beside(sheet, prover, leaf.slack, *corners, ground))
                .map(|q| grid.quads.push(q))
        } else {
            let q = std::array::from_fn(|k| corners[(k + leaf.first) % 4]);
            grid.quads.push((q, leaf.bound, leaf.tolerance));
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

/// A facet with corners on the border: it must hold with the border's own points, and follow its curve.
fn beside(
    sheet: &Sheet<'_>,
    prover: &mut Prover<'_, '_>,
    slack: f64,
    corners: [u32; 4],
    ground: &Ground<'_>,
) -> Option<([u32; 4], f64, f64)> {
    let n = corners.map(|c| ground.nodes[c as usize]);
    if (0..4).any(|i| (0..i).any(|j| n[i].position == n[j].position)) {
        return None;
    }
    let middle = sheet.point(0.25 * (n[0].uv + n[1].uv + n[2].uv + n[3].uv));
    let off = |i: usize, j: usize| from_chord(middle, &[n[i].place, n[j].place]);
    let better = if off(1, 3) < off(0, 2) * (1.0 - 1e-9) { 1 } else { 0 };
    [better, better + 1].into_iter().find_map(|r| {
        let q: [u32; 4] = std::array::from_fn(|k| corners[(k + r) % 4]);
        let [x, y] = [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]
            .map(|t| prove(sheet, prover, slack, ground.nodes, t, ground.trims));
        let (bound, xi) = (x.0.max(y.0), x.1.min(y.1));
        (bound <= xi * slack).then_some((q, bound, xi))
    })
}

/// The facet of a cell whose corners are the border's points already: what is proved of the cell holds for it but for the curves
/// that its border sides follow. `None` when the border's points lie elsewhere.
fn as_proved(
    sheet: &Sheet<'_>,
    prover: &mut Prover<'_, '_>,
    leaf: &Leaf,
    corners: &[u32; 4],
    ground: &Ground<'_>,
) -> Option<([u32; 4], f64, f64)> {
    let n = corners.map(|c| ground.nodes[c as usize]);
    let (bound, xi, r) = (leaf.bound, leaf.tolerance, leaf.first);
    let at = leaf.cell.corners();
    let mut moved = 0f64;
    for k in 0..4 {
        let (uv, place) = (at[k], leaf.places[k]);
        if (n[k].uv - uv).abs().cmpgt(1e-4 * ground.same).any() || (0..k).any(|j| n[j].position == n[k].position) {
            return None;
        }
        moved = moved.max((n[k].place - place).length());
    }
    // Lines and triangles through moved points move no farther; the rest covers parameters that differ in their last digits.
    let limit = xi * leaf.slack;
    if moved > 1e-6 * xi {
        return None;
    }
    let q: [u32; 4] = std::array::from_fn(|k| corners[(k + r) % 4]);
    let mut worst = bound + 4.0 * moved + 1e-10 * sheet.size;
    for t in [[q[0], q[1], q[2]], [q[0], q[2], q[3]]] {
        let xyz = t.map(|i| ground.nodes[i as usize].place);
        for k in 0..3 {
            if let Some(trim) = ground.trims.get(&key(t[k], t[(k + 1) % 3])) {
                worst = worst.max(trim.bound(prover, xyz, limit));
            }
        }
    }
    (worst <= limit).then_some((q, worst, xi))
}

/// Most pieces of a cell that is cut from hanging vertex to hanging vertex.
const MOST_PIECES: usize = 16;

/// Cuts a cell whose hanging vertices face each other from side to side; `None` when they do not.
fn lattice(
    sheet: &Sheet<'_>,
    prover: &mut Prover<'_, '_>,
    slack: f64,
    corners: &[u32; 4],
    inner: &[Vec<u32>; 4],
    ground: &mut Ground<'_>,
) -> Option<Vec<([u32; 4], f64, f64)>> {
    let (nx, ny) = (inner[0].len() + 1, inner[1].len() + 1);
    if inner[2].len() + 1 != nx || inner[3].len() + 1 != ny || nx * ny > MOST_PIECES {
        return None;
    }
    let row = |from: u32, between: Vec<u32>, to: u32| -> Vec<u32> {
        std::iter::once(from).chain(between).chain(std::iter::once(to)).collect()
    };
    let turned = |x: &[u32]| x.iter().rev().copied().collect::<Vec<u32>>();
    let bottom = row(corners[0], inner[0].clone(), corners[1]);
    let top = row(corners[3], turned(&inner[2]), corners[2]);
    let left = row(corners[0], turned(&inner[3]), corners[3]);
    let right = row(corners[1], inner[1].clone(), corners[2]);
    let uv = |n: u32| ground.nodes[n as usize].uv;
    let size = uv(corners[2]) - uv(corners[0]);
    let face = |a: &[u32], b: &[u32], d: usize| {
        a.iter().zip(b).all(|(&x, &y)| (uv(x)[d] - uv(y)[d]).abs() <= 0.15 * size[d].abs())
    };
    if !face(&bottom, &top, 0) || !face(&left, &right, 1) {
        return None;
    }
    let kept = (ground.nodes.len(), ground.next);
    let mut at = vec![vec![0u32; ny + 1]; nx + 1];
    for i in 0..=nx {
        for j in 0..=ny {
            at[i][j] = match (i, j) {
                (_, 0) => bottom[i],
                (_, j) if j == ny => top[i],
                (0, _) => left[j],
                (i, _) if i == nx => right[j],
                _ => {
                    let uv = |n: u32| ground.nodes[n as usize].uv;
                    let c = Uv::new(0.5 * (uv(bottom[i]).x + uv(top[i]).x), 0.5 * (uv(left[j]).y + uv(right[j]).y));
                    ground.nodes.push(Node { uv: c, place: sheet.point(c), position: ground.next });
                    ground.next += 1;
                    (ground.nodes.len() - 1) as u32
                }
            };
        }
    }
    let pieces = (0..nx * ny).map(|k| {
        let (i, j) = (k / ny, k % ny);
        beside(sheet, prover, slack, [at[i][j], at[i + 1][j], at[i + 1][j + 1], at[i][j + 1]], ground)
    });
    let made: Option<Vec<_>> = pieces.collect();
    if made.is_none() {
        ground.nodes.truncate(kept.0);
        ground.next = kept.1;
    }
    made
}

/// Largest polygon that is resolved by trying all triangulations.
const MOST_CORNERS: usize = 24;

/// Cuts a cell with hanging vertices into the triangles whose diagonals lie nearest to the surface.
fn resolve(
    sheet: &Sheet<'_>,
    prover: &mut Prover<'_, '_>,
    slack: f64,
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
        from_chord(sheet.point(0.5 * (a.0 + b.0)), &[a.1, b.1])
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
        let (bound, xi) = prove(sheet, prover, slack, ground.nodes, t, ground.trims);
        if bound > xi * slack {
            return None;
        }
        made.push((t, bound, xi));
    }
    Some(made)
}

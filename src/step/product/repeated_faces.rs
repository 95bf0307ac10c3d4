//! Faces that a shell has more than once, each as an entity of its own: one of them stands, for light would meet two surfaces in one place.
//!
//! Two faces are one where surface, border and sense are. Known weakness: curved faces with the seam of their surface in two places stay.

use crate::math::{Point, Uv, Vector};
use crate::model::{Analytic, Face, Part, VertexId};
use crate::nurbs::Surface;
use crate::step::geometry::units::Units;
use rustc_hash::{FxHashMap, FxHashSet};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// Side of the cells in which corners are looked up, mm: far more than writers round by.
const CELL_MM: f64 = 0.01;
/// Share of a cell by which all of them are moved: round coordinates lie in the middle of a cell, where rounding changes none.
const CELL_OFFSET: f64 = 0.382;
/// Faces with the same corners that one is compared with: no solid has more, and a file of nothing else takes no longer.
const MAX_COMPARED: usize = 16;
/// Difference of two knots, and of two weights, that is rounding, as a share.
const NUMBER_ROUNDING: f64 = 1e-9;
/// Where two edges are compared, as shares of their parameters.
const COMPARED_SHARES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

type Cell = [i64; 3];
type EdgePoints = [Point; COMPARED_SHARES.len()];

/// A face that was left out, and the one that stands there, by the ids of their entities.
pub(super) struct RepeatedFace {
    pub(super) id: Option<u64>,
    pub(super) standing: Option<u64>,
}

/// Leaves one of all faces of a shell that are in one place and look the same way: that which shares most vertices with the others, else
/// the first. Returns those that it takes out, in their order.
pub(super) fn remove_repeated_faces(faces: &mut Vec<Face>, part: &Part, units: Units) -> Vec<RepeatedFace> {
    let mut alike: FxHashMap<Vec<Cell>, Vec<usize>> = FxHashMap::default();
    let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (k, face) in faces.iter().enumerate() {
        let before = alike.entry(corner_cells(face, part)).or_default();
        let first = before.iter().copied().take(MAX_COMPARED).find(|&j| are_one(&faces[j], face, part, units));
        match first {
            Some(first) => groups.entry(first).or_insert_with(|| vec![first]).push(k),
            None => before.push(k),
        }
    }
    if groups.is_empty() {
        return Vec::new();
    }
    let mut uses: FxHashMap<VertexId, usize> = FxHashMap::default();
    faces.iter().flat_map(|face| corners(face, part)).for_each(|v| *uses.entry(v).or_default() += 1);
    let shared = |k: usize| corners(&faces[k], part).filter_map(|v| uses.get(&v)).sum::<usize>();
    let mut removed: Vec<[usize; 2]> = Vec::new();
    for group in groups.into_values() {
        let Some(standing) = group.iter().copied().min_by_key(|&k| Reverse(shared(k))) else { continue };
        removed.extend(group.into_iter().filter(|k| *k != standing).map(|k| [k, standing]));
    }
    removed.sort_unstable();
    let [id, standing] = [0, 1].map(|i| removed.iter().map(|pair| faces[pair[i]].entity).collect::<Vec<_>>());
    let repeated = id.into_iter().zip(standing).map(|(id, standing)| RepeatedFace { id, standing }).collect();
    let removed: FxHashSet<usize> = removed.into_iter().map(|[k, _]| k).collect();
    let mut k = 0;
    faces.retain(|_| {
        k += 1;
        !removed.contains(&(k - 1))
    });
    repeated
}

/// Returns the vertices at which the edges of a face's loops begin.
fn corners<'p>(face: &'p Face, part: &'p Part) -> impl Iterator<Item = VertexId> + 'p {
    face.loops.iter().flat_map(|l| &l.uses).filter_map(move |u| {
        let edge = &part.edges[u.edge?.0 as usize];
        Some(edge.vertices[usize::from(u.reversed)])
    })
}

fn cell(p: Point) -> Cell {
    p.to_array().map(|x| (x / CELL_MM + CELL_OFFSET).floor() as i64)
}

/// Returns the cells of a face's corners, sorted; of a face without a border that of its surface's first corner.
fn corner_cells(face: &Face, part: &Part) -> Vec<Cell> {
    if face.loops.is_empty() {
        let [[u, _], [v, _]] = face.surface.domain();
        return vec![cell(face.surface.evaluate(Uv::new(u, v)))];
    }
    let mut cells: Vec<Cell> = corners(face, part).map(|v| cell(part.vertices[v.0 as usize])).collect();
    cells.sort_unstable();
    cells
}

/// Whether two faces are in one place, within what is one to the file, and look the same way.
fn are_one(a: &Face, b: &Face, part: &Part, units: Units) -> bool {
    if a.loops.len() != b.loops.len() || a.analytic.kind() != b.analytic.kind() {
        return false;
    }
    let tolerance = units.accuracy_on_face(a.surface.bounds().diagonal());
    // A border determines its plane, however that is written.
    let are_planes = matches!(a.analytic, Analytic::Plane { .. }) && !a.loops.is_empty();
    let is_opposed = are_planes && middle_normal(&a.surface).dot(middle_normal(&b.surface)) < 0.0;
    // The two sides of a sheet are two faces.
    let is_same_sense = (a.reversed == b.reversed) != is_opposed;
    is_same_sense
        && (are_planes || are_surfaces_one(&a.surface, &b.surface, tolerance))
        && are_borders_one(a, b, is_opposed, part, tolerance)
}

/// Returns `Su × Sv` in the middle of the domain.
fn middle_normal(surface: &Surface) -> Vector {
    let [[u0, u1], [v0, v1]] = surface.domain();
    let d = surface.derivatives(Uv::new(0.5 * (u0 + u1), 0.5 * (v0 + v1)));
    d.du.cross(d.dv)
}

/// Whether two surfaces have the same knots and weights to rounding, and the same control points within `tolerance`, mm.
fn are_surfaces_one(a: &Surface, b: &Surface, tolerance: f64) -> bool {
    let is_rounding = |x: f64, y: f64| (x - y).abs() <= NUMBER_ROUNDING * (1.0 + x.abs());
    let are_knots_one = |i: usize| {
        let (a, b) = (&a.knots[i], &b.knots[i]);
        a.len() == b.len() && a.iter().zip(b).all(|(x, y)| is_rounding(*x, *y))
    };
    a.degree == b.degree
        && a.points.len() == b.points.len()
        && (0..2).all(are_knots_one)
        && a.points
            .iter()
            .zip(&b.points)
            .all(|(p, q)| is_rounding(p.w, q.w) && (p.truncate() / p.w - q.truncate() / q.w).length() <= tolerance)
}

/// Whether the edges of two faces coincide one by one, each run in the same direction, or all in the opposite one if `is_opposed`.
fn are_borders_one(a: &Face, b: &Face, is_opposed: bool, part: &Part, tolerance: f64) -> bool {
    let mut rest: FxHashMap<Cell, Vec<EdgePoints>> = FxHashMap::default();
    for mut points in border_points(b, part) {
        if is_opposed {
            points.reverse();
        }
        rest.entry(cell(points[0])).or_default().push(points);
    }
    let are_near = |p: &EdgePoints, q: &EdgePoints| p.iter().zip(q).all(|(p, q)| (*p - *q).length() <= tolerance);
    let is_each_found = border_points(a, part).all(|points| {
        let Some(near) = rest.get_mut(&cell(points[0])) else { return false };
        let Some(at) = near.iter().position(|other| are_near(&points, other)) else { return false };
        near.swap_remove(at);
        true
    });
    is_each_found && rest.values().all(Vec::is_empty)
}

/// Returns points of each edge of a face's loops, in the direction of its loop.
fn border_points<'p>(face: &'p Face, part: &'p Part) -> impl Iterator<Item = EdgePoints> + 'p {
    face.loops.iter().flat_map(|l| &l.uses).filter_map(move |u| {
        let curve = &part.edges[u.edge?.0 as usize].curve;
        let [t0, t1] = curve.domain();
        let mut points = COMPARED_SHARES.map(|share| curve.evaluate(t0 + (t1 - t0) * share));
        if u.reversed {
            points.reverse();
        }
        Some(points)
    })
}

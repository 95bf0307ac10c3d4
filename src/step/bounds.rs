//! The box of the trimmed faces: edges and interior extremes, not control points.

use crate::math::{Aabb, Frame, Point, Uv};
use crate::model::{Face, Model};
use crate::nurbs::ControlPoint;

/// Fewest and most samples per direction that seed the search for extremes; between them two per span of the spline.
/// A terrain of 77 × 80 spans has its lowest point 0.09 mm below the best of 13 × 13 samples.
const GRID: [usize; 2] = [12, 256];
/// Samples per direction that are followed uphill.
const STARTS: usize = 3;

/// A box around all placed faces; within about 1e-3 of a face's size.
pub(super) fn model_bounds(model: &Model) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    for placed in model.placed_faces() {
        if let Some(face) = placed.face {
            bounds = grow_by_face(face, placed.placement, bounds);
        } else if let Some(ready) = placed.tessellated {
            let points = ready.mesh.positions.iter().map(|&p| placed.placement.point(p));
            bounds = bounds.union(Aabb::around(points));
        }
    }
    bounds
}

/// Grows a box by a face.
fn grow_by_face(face: &Face, placement: &Frame, mut bounds: Aabb) -> Aabb {
    let at = |uv: Uv| placement.point(face.surface.evaluate(uv));
    let inside = |b: &Aabb, p: Point| b.contains(p);
    let hull = Aabb::around(face.surface.points.iter().map(|p| placement.point(p.position())));
    if inside(&bounds, hull.min) && inside(&bounds, hull.max) {
        return bounds;
    }
    let polygons = polygons(face);
    for p in polygons.iter().flatten() {
        let q = at(*p);
        bounds = Aabb { min: bounds.min.min(q), max: bounds.max.max(q) };
    }
    if inside(&bounds, hull.min) && inside(&bounds, hull.max) {
        return bounds;
    }
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    let (mut lo, mut hi) = (Uv::INFINITY, Uv::NEG_INFINITY);
    for p in polygons.iter().flatten() {
        (lo, hi) = (lo.min(*p), hi.max(*p));
    }
    if polygons.is_empty() {
        (lo, hi) = (Uv::new(u0, v0), Uv::new(u1, v1));
    }
    let contains = |p: Uv| polygons.is_empty() || polygons.iter().filter(|q| holds(q, p)).count() % 2 == 1;
    let spans = |d: usize| {
        let mut breaks = face.surface.knots[d].clone();
        breaks.dedup();
        (2 * breaks.len()).clamp(GRID[0], GRID[1])
    };
    let [nu, nv] = [spans(0), spans(1)];
    let cell = (hi - lo) / Uv::new(nu as f64, nv as f64);
    let mut samples: Vec<(Uv, Point)> = Vec::new();
    for i in 0..=nu {
        for j in 0..=nv {
            let uv = lo + cell * Uv::new(i as f64, j as f64);
            samples.push((uv, at(uv)));
        }
    }
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let value = |p: Point| sign * p[axis];
            let limit = if sign > 0.0 { hull.max[axis] } else { -hull.min[axis] };
            let known = if sign > 0.0 { bounds.max[axis] } else { -bounds.min[axis] };
            if limit <= known {
                continue;
            }
            // The highest samples inside the trims, each followed uphill.
            samples.sort_unstable_by(|a, b| value(b.1).total_cmp(&value(a.1)));
            let starts: Vec<(Uv, Point)> = samples.iter().filter(|s| contains(s.0)).take(STARTS).copied().collect();
            for (mut uv, p) in starts {
                let mut best = value(p);
                let mut step = 0.5 * cell;
                for _ in 0..24 {
                    let mut moved = false;
                    for d in [Uv::X, -Uv::X, Uv::Y, -Uv::Y] {
                        let next = uv + step * d;
                        if contains(next) && value(at(next)) > best {
                            (uv, best, moved) = (next, value(at(next)), true);
                        }
                    }
                    if !moved {
                        step *= 0.5;
                    }
                }
                let q = at(uv);
                bounds = Aabb { min: bounds.min.min(q), max: bounds.max.max(q) };
            }
        }
    }
    bounds
}

/// The loops as polygons.
fn polygons(face: &Face) -> Vec<Vec<Uv>> {
    face.loops
        .iter()
        .map(|l| {
            let mut points = Vec::new();
            for u in &l.uses {
                let breaks = u.uv.breakpoints();
                let n = if u.uv.degree == 1 { 1 } else { 24usize.div_ceil(breaks.len() - 1).max(4) };
                let start = points.len();
                for w in breaks.windows(2) {
                    points.extend((0..n).map(|k| u.uv.evaluate(w[0] + (w[1] - w[0]) * k as f64 / n as f64)));
                }
                points.push(u.uv.evaluate(breaks[breaks.len() - 1]));
                if u.reversed {
                    points[start..].reverse();
                }
                points.pop();
            }
            points
        })
        .collect()
}

fn holds(polygon: &[Uv], p: Uv) -> bool {
    let n = polygon.len();
    (0..n)
        .filter(|&i| {
            let (a, b) = (polygon[i], polygon[(i + 1) % n]);
            (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
        })
        .count()
        % 2
        == 1
}

//! The same question by pure clipping, in code that shares nothing with the fast path: what the fast path is tested against.
//!
//! Every Bézier patch of every face is clipped as in Nishita, Sederberg and Kakimoto, SIGGRAPH 1990: the signed distances of the
//! control points to a line in the projection along the ray bound each parameter by the convex hull of (parameter,
//! distance); what clipping shrinks by less than a fifth is halved, until the box holds a single root or is as small as rounding.
//! Trims are decided by crossings of a half-line towards +v with
//! the uv curves, halved until their hulls decide.
//!
//! Guarantee: none is claimed near tangency, at singular points and within about 1e-9 mm of trims; there it reports what it
//! finds. Where a patch took all of its steps it says from which distance on crossings may be missing. Known weakness: slow,
//! about a thousandth of the fast path's rate, and without a hierarchy.

use super::single::single_root;
use crate::math::{Aabb, FaceId, Homogeneous, Ray, Uv};
use crate::model::{Model, TrimLoop};
use crate::nurbs::BezierPatch;
use glam::{DVec2, DVec3};

/// Every patch of a model, to be clipped against rays.
#[derive(Debug)]
pub struct Audit {
    faces: Vec<AuditFace>,
}

#[derive(Debug)]
struct AuditFace {
    id: FaceId,
    bounds: Aabb,
    domain: [[f64; 2]; 2],
    patches: Vec<(Aabb, BezierPatch)>,
    /// Bézier pieces of the uv curves.
    trims: Vec<Vec<DVec3>>,
}

/// A crossing found by clipping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuditHit {
    /// Distance along the ray, mm.
    pub t: f64,
    /// The placed face.
    pub face: FaceId,
    /// Parameters on its surface.
    pub uv: Uv,
    /// Whether it was found by a box of parameters that could not be made small: a tangency or a singular point.
    pub doubtful: bool,
}

/// What clipping found along a ray.
#[derive(Clone, Debug, PartialEq)]
pub struct AuditAnswer {
    /// The crossings in `[t_min, t_max]`, in order of t, each once.
    pub crossings: Vec<AuditHit>,
    /// From this distance on crossings may be missing, since a patch took all of its steps; infinite when everything was
    /// searched.
    pub exhausted: f64,
}

impl AuditAnswer {
    /// Whether the first crossing, or that there is none, is beyond doubt.
    pub fn decides_first(&self) -> bool {
        match self.crossings.first() {
            Some(hit) => !hit.doubtful && hit.t < self.exhausted,
            None => self.exhausted == f64::INFINITY,
        }
    }
}

impl Audit {
    /// Prepares every face that has a surface.
    pub fn new(model: &Model) -> Self {
        let faces = model
            .placed_faces()
            .filter_map(|placed| placed.face.map(|f| (placed.id, f, placed.placement)))
            .map(|(id, face, placement)| {
                let surface = face.surface.transformed(|p| placement.point(p));
                let patches: Vec<_> = surface.bezier_patches().into_iter().map(|p| (p.bounds(), p)).collect();
                let bounds = patches.iter().fold(Aabb::EMPTY, |b, p| b.union(p.0));
                let trims = pieces(&face.loops);
                AuditFace { id, bounds, domain: face.surface.domain(), patches, trims }
            })
            .collect();
        Self { faces }
    }

    /// Every crossing in `[t_min, t_max]`; the point that the ray leaves is left out.
    pub fn answer(&self, ray: &Ray) -> AuditAnswer {
        let mut found: Vec<AuditHit> = Vec::new();
        let mut exhausted = f64::INFINITY;
        for face in &self.faces {
            if grown(&face.bounds).clip(ray).is_none() {
                continue;
            }
            let mut own: Vec<AuditHit> = Vec::new();
            for (bounds, patch) in &face.patches {
                if grown(bounds).clip(ray).is_some() {
                    let unsearched = clip_patch(ray, face.id, patch, face.domain, &mut own);
                    if unsearched <= ray.t_max {
                        exhausted = exhausted.min(unsearched);
                    }
                }
            }
            own.sort_by(|a, b| a.t.total_cmp(&b.t));
            // Boxes that share a border, and clusters around a tangency, find the same crossing several times.
            own.dedup_by(|b, a| {
                let same = b.t - a.t < if a.doubtful || b.doubtful { 1e-4 } else { 1e-9 };
                a.doubtful |= same && b.doubtful;
                same
            });
            // Crossings that come down to boxes side by side are one that rounding smears, or a grazing pair.
            let smeared = |a: &AuditHit, b: &AuditHit| b.t - a.t < 1e-7;
            for k in 1..own.len() {
                if smeared(&own[k - 1], &own[k]) {
                    own[k - 1].doubtful = true;
                    own[k].doubtful = true;
                }
            }
            own.retain(|h| {
                let leaving = ray.from.is_some_and(|f| f.face == h.face && h.t.abs() < 1e-7);
                !leaving && h.t >= ray.t_min && h.t <= ray.t_max && face.holds(h.uv)
            });
            found.extend(own);
        }
        found.sort_by(|a, b| a.t.total_cmp(&b.t));
        AuditAnswer { crossings: found, exhausted }
    }
}

fn grown(b: &Aabb) -> Aabb {
    b.grown(1e-9 * (1.0 + b.diagonal()))
}

/// A patch's control points as the ray sees them, `(w·x, w·y, w·t, w)` for planes through the ray, over a rectangle.
struct Piece {
    patch: BezierPatch,
    depth: u32,
}

/// Steps for a patch and a ray: a simple root takes about ten, a graze hundreds.
const STEPS: u32 = 4000;

/// Boxes smaller than this part of a patch are asked whether their root is single.
const SMALL: f64 = 1e-3;

/// Adds the crossings of a patch of a surface over `domain`; returns from which distance on some were not searched for, infinity when all were.
fn clip_patch(ray: &Ray, face: FaceId, patch: &BezierPatch, domain: [[f64; 2]; 2], out: &mut Vec<AuditHit>) -> f64 {
    // Two planes that hold the ray, from the axes that its direction avoids most.
    let d = ray.direction;
    let axis = if d.x.abs() <= d.y.abs() && d.x.abs() <= d.z.abs() {
        DVec3::X
    } else if d.y.abs() <= d.z.abs() {
        DVec3::Y
    } else {
        DVec3::Z
    };
    let a = d.cross(axis).normalize();
    let b = a.cross(d).normalize();
    let see = |p: &Homogeneous| {
        let r = p.truncate() - ray.origin * p.w;
        Homogeneous::new(r.dot(a), r.dot(b), r.dot(d), p.w)
    };
    // Over the unit square: a knot span of 1e-9 has few digits of its own.
    let unit = [[0.0, 1.0]; 2];
    let seen = BezierPatch { points: patch.points.iter().map(see).collect(), domain: unit, degree: patch.degree };
    let surface_uv = |local: Uv| patch.surface_uv(local);
    let ends = [0, 1].map(|k| [0, 1].map(|end| patch.domain[k][end] == domain[k][end]));
    let size = seen.points.iter().map(|p| p.truncate().abs().max_element()).fold(0.0, f64::max);
    let rounding = 64.0 * f64::EPSILON * (size + ray.origin.abs().max_element());
    let all = seen.clone();
    let mut stack = vec![Piece { patch: seen, depth: 0 }];
    let mut steps = 0;
    let mut exhausted = f64::INFINITY;
    while let Some(Piece { mut patch, depth }) = stack.pop() {
        steps += 1;
        let outside = |k: usize| {
            patch.points.iter().all(|p| p[k] > rounding) || patch.points.iter().all(|p| p[k] < -rounding)
        };
        if outside(0) || outside(1) {
            continue;
        }
        if steps > STEPS {
            // Where a weight is not positive the hull bounds nothing.
            let near = |p: &Homogeneous| if p.w > 0.0 { p.z / p.w } else { f64::NEG_INFINITY };
            exhausted = patch.points.iter().map(near).fold(exhausted, f64::min);
            continue;
        }
        let relative = patch.domain.map(|[lo, hi]| hi - lo);
        if relative[0].max(relative[1]) < SMALL {
            // The box with as much again on all sides, as parts of the whole patch.
            let [u, v] = [0, 1].map(|k: usize| {
                let [lo, hi] = patch.domain[k];
                let beyond = (hi - lo).max(1e-7);
                ([lo, hi], [lo - beyond, hi + beyond])
            });
            let wider = cut(&cut(&all, 0, u.1), 1, v.1);
            if let Some((root, moves)) = single_root(&wider) {
                let at = [(u, root.x), (v, root.y)].map(|((_, [a, b]), x)| a + (b - a) * x);
                // Boxes that share a border both take a root on it; at the end of the surface rounding decides nothing.
                let slop = [u, v].map(|(_, [a, b])| 1e-11 + 4.0 * rounding * moves * (b - a));
                let within = |k: usize, [lo, hi]: [f64; 2]| at[k] >= lo - slop[k] && at[k] <= hi + slop[k];
                if within(0, u.0) && within(1, v.0) {
                    let m = all.homogeneous_point(Uv::from(at));
                    let doubtful =
                        (0..2).any(|k| ends[k][0] && at[k] < slop[k] || ends[k][1] && at[k] > 1.0 - slop[k]);
                    out.push(AuditHit { t: m.z / m.w, face, uv: surface_uv(Uv::from(at)), doubtful });
                }
                continue;
            }
        }
        let across = patch.points.iter().map(|p| (p.truncate().truncate() / p.w).length()).fold(0.0, f64::max);
        let tiny = relative[0].max(relative[1]) < 1e-12;
        let contact = across < 1e-9 && depth > 30;
        if tiny || contact {
            let m = patch.homogeneous(Uv::splat(0.5))[0];
            let doubtful = !tiny || across > 1e-7;
            if !doubtful || across < 1e-6 {
                out.push(AuditHit {
                    t: m.z / m.w,
                    face,
                    uv: surface_uv(patch.surface_uv(Uv::splat(0.5))),
                    doubtful,
                });
            }
            continue;
        }
        let mut longest = (0, 0.0);
        let mut shrunk = false;
        let mut empty = false;
        for k in 0..2 {
            let Some([lo, hi]) = range(&patch, k, rounding) else {
                empty = true;
                break;
            };
            if hi - lo < 0.8 {
                patch = cut(&patch, k, [lo, hi]);
                shrunk = true;
            }
            let side = edge_length(&patch, k);
            if side > longest.1 {
                longest = (k, side);
            }
        }
        if empty {
            continue;
        }
        if shrunk {
            stack.push(Piece { patch, depth: depth + 1 });
        } else {
            stack.extend(patch.halves(longest.0).map(|patch| Piece { patch, depth: depth + 1 }));
        }
    }
    exhausted
}

/// Extent of the patch along a parameter as the ray sees it, in all three coordinates.
fn edge_length(patch: &BezierPatch, direction: usize) -> f64 {
    let [p, q] = patch.degree;
    let at = |i: usize, j: usize| patch.points[i * (q + 1) + j].project();
    if direction == 0 {
        (0..=q).map(|j| at(0, j).distance(at(p, j))).fold(0.0, f64::max)
    } else {
        (0..=p).map(|i| at(i, 0).distance(at(i, q))).fold(0.0, f64::max)
    }
}

/// Range of one parameter that can hold a root, by the hull of its distances to the line that joins the patch's ends in it.
fn range(patch: &BezierPatch, direction: usize, rounding: f64) -> Option<[f64; 2]> {
    let [p, q] = patch.degree;
    let at = |i: usize, j: usize| patch.points[i * (q + 1) + j];
    // A line through the origin roughly along the other parameter, so that distances grow with this one.
    let flat = |h: Homogeneous| h.truncate().truncate() / h.w;
    let along = if direction == 0 {
        flat(at(0, q)) - flat(at(0, 0)) + flat(at(p, q)) - flat(at(p, 0))
    } else {
        flat(at(p, 0)) - flat(at(0, 0)) + flat(at(p, q)) - flat(at(0, q))
    };
    let Some(normal) = along.perp().try_normalize() else { return Some([0.0, 1.0]) };
    let n = patch.degree[direction];
    // Lowest and highest distance at each station.
    let stations: Vec<DVec3> = (0..=n)
        .map(|k| {
            let other = patch.degree[1 - direction];
            let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
            for line in 0..=other {
                let h = if direction == 0 { at(k, line) } else { at(line, k) };
                let distance = h.truncate().truncate().dot(normal);
                (lo, hi) = (lo.min(distance - 2.0 * rounding), hi.max(distance + 2.0 * rounding));
            }
            DVec3::new(k as f64 / n as f64, lo, hi)
        })
        .collect();
    let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
    for (k, s) in stations.iter().enumerate() {
        if s.y <= 0.0 && s.z >= 0.0 {
            (first, last) = (first.min(s.x), last.max(s.x));
        }
        for r in &stations[k + 1..] {
            for (a, b) in [(s.y, r.y), (s.y, r.z), (s.z, r.y), (s.z, r.z)] {
                if (a < 0.0) != (b < 0.0) {
                    let x = s.x + (r.x - s.x) * a / (a - b);
                    (first, last) = (first.min(x), last.max(x));
                }
            }
        }
    }
    (first <= last).then(|| [(first - 1e-10).max(0.0), (last + 1e-10).min(1.0)])
}

/// The part of a patch over `[lo, hi]` of one local parameter.
fn cut(patch: &BezierPatch, direction: usize, [lo, hi]: [f64; 2]) -> BezierPatch {
    let q = patch.degree[1];
    let n = patch.degree[direction];
    let mut out = patch.clone();
    for line in 0..=patch.degree[1 - direction] {
        let index = |k: usize| if direction == 0 { k * (q + 1) + line } else { line * (q + 1) + k };
        for k in 0..=n {
            // The blossom at n − k times lo and k times hi.
            let mut w: Vec<Homogeneous> = (0..=n).map(|i| patch.points[index(i)]).collect();
            for step in 0..n {
                let x = if step < k { hi } else { lo };
                for i in 0..n - step {
                    w[i] = w[i] * (1.0 - x) + w[i + 1] * x;
                }
            }
            out.points[index(k)] = w[0];
        }
    }
    let [a, b] = patch.domain[direction];
    out.domain[direction] = [a + (b - a) * lo, a + (b - a) * hi];
    out
}

fn pieces(loops: &[TrimLoop]) -> Vec<Vec<DVec3>> {
    loops.iter().flat_map(|l| &l.uses).flat_map(|u| u.uv.bezier_pieces()).collect()
}

impl AuditFace {
    /// Whether a point of the domain lies inside: an odd number of crossings above it.
    fn holds(&self, q: Uv) -> bool {
        if self.trims.is_empty() {
            return true;
        }
        self.trims.iter().map(|p| above(p, q, 0)).sum::<u32>() % 2 == 1
    }
}

/// How often a Bézier piece crosses the half-line from `q` towards +v.
fn above(points: &[DVec3], q: DVec2, depth: u32) -> u32 {
    let at = |p: &DVec3| p.truncate() / p.z;
    let (first, last) = (at(&points[0]), at(&points[points.len() - 1]));
    let (mut lo, mut hi) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for p in points {
        (lo, hi) = (lo.min(at(p)), hi.max(at(p)));
    }
    if q.x < lo.x || q.x >= hi.x || q.y > hi.y {
        return 0;
    }
    let spans = u32::from((first.x <= q.x) != (last.x <= q.x));
    if q.y < lo.y {
        // All of it lies above: only the ends count.
        return spans;
    }
    if depth > 48 || points.len() == 2 {
        let v = first.y + (last.y - first.y) * (q.x - first.x) / (last.x - first.x);
        return if v > q.y { spans } else { 0 };
    }
    let n = points.len() - 1;
    let (mut low, mut w) = (Vec::with_capacity(n + 1), points.to_vec());
    for r in 0..=n {
        low.push(w[0]);
        for k in 0..n - r {
            w[k] = 0.5 * (w[k] + w[k + 1]);
        }
    }
    above(&low, q, depth + 1) + above(&w, q, depth + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_crossed_where_it_should_be() {
        // (t, t²) for t in [-1, 1].
        let points = [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(0.0, -1.0, 1.0), DVec3::new(1.0, 1.0, 1.0)];
        assert_eq!(above(&points, DVec2::new(0.5, 0.2499999999), 0), 1);
        assert_eq!(above(&points, DVec2::new(0.5, 0.2500000001), 0), 0);
        assert_eq!(above(&points, DVec2::new(1.5, 0.0), 0), 0);
    }
}

//! Clipping one patch against one ray.

use super::AuditHit;
use super::single::single_root;
use crate::math::{FaceId, Homogeneous, Ray, Uv};
use crate::nurbs::BezierPatch;
use glam::{DVec2, DVec3};
use smallvec::SmallVec;

/// Control points as the ray sees them, `(w·a, w·b, w·t, w)` for two planes through the ray, over a rectangle of the unit square.
#[derive(Clone)]
pub(super) struct Net {
    pub(super) points: SmallVec<[Homogeneous; 16]>,
    pub(super) degree: [usize; 2],
    pub(super) domain: [[f64; 2]; 2],
}

struct Piece {
    net: Net,
    depth: u32,
}

/// Two planes that hold the ray, by their normals.
pub(super) struct View {
    a: DVec3,
    b: DVec3,
}

impl View {
    /// From the axes that the ray's direction avoids most.
    pub(super) fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let axis = if d.x.abs() <= d.y.abs() && d.x.abs() <= d.z.abs() {
            DVec3::X
        } else if d.y.abs() <= d.z.abs() {
            DVec3::Y
        } else {
            DVec3::Z
        };
        let a = d.cross(axis).normalize();
        Self { a, b: a.cross(d).normalize() }
    }
}

/// Steps for a patch and a ray: a simple root takes about ten, a graze hundreds.
const STEPS: u32 = 4000;

/// Boxes smaller than this part of a patch are asked whether their root is single.
const SMALL: f64 = 0.02;

/// Adds the crossings of a patch of a surface over `domain`; returns from which distance on some were not searched for, infinity when all were.
pub(super) fn clip_patch(
    (ray, view): (&Ray, &View),
    face: FaceId,
    patch: &BezierPatch,
    domain: [[f64; 2]; 2],
    out: &mut SmallVec<[AuditHit; 8]>,
) -> f64 {
    let View { a, b } = *view;
    let d = ray.direction;
    let see = |p: &Homogeneous| {
        let r = p.truncate() - ray.origin * p.w;
        Homogeneous::new(r.dot(a), r.dot(b), r.dot(d), p.w)
    };
    // Over the unit square: a knot span of 1e-9 has few digits of its own.
    let all = Net { points: patch.points.iter().map(see).collect(), degree: patch.degree, domain: [[0.0, 1.0]; 2] };
    let ends = [0, 1].map(|k| [0, 1].map(|end| patch.domain[k][end] == domain[k][end]));
    let size = all.points.iter().map(|p| p.truncate().abs().max_element()).fold(0.0, f64::max);
    let rounding = 64.0 * f64::EPSILON * (size + ray.origin.abs().max_element());
    if all.misses(rounding) {
        return f64::INFINITY;
    }
    let mut stack = vec![Piece { net: all.clone(), depth: 0 }];
    let mut steps = 0;
    let mut exhausted = f64::INFINITY;
    while let Some(Piece { mut net, depth }) = stack.pop() {
        steps += 1;
        if net.misses(rounding) {
            continue;
        }
        if steps > STEPS {
            // Where a weight is not positive the hull bounds nothing.
            let near = |p: &Homogeneous| if p.w > 0.0 { p.z / p.w } else { f64::NEG_INFINITY };
            exhausted = net.points.iter().map(near).fold(exhausted, f64::min);
            continue;
        }
        let relative = net.domain.map(|[lo, hi]| hi - lo);
        if relative[0].max(relative[1]) < SMALL {
            // The box with as much again on all sides, as parts of the whole patch.
            let [u, v] = [0, 1].map(|k: usize| {
                let [lo, hi] = net.domain[k];
                let beyond = (hi - lo).max(1e-7);
                ([lo, hi], [lo - beyond, hi + beyond])
            });
            let wider = all.cut(0, u.1).cut(1, v.1);
            if let Some((root, moves)) = single_root(&wider) {
                let at = [(u, root.x), (v, root.y)].map(|((_, [a, b]), x)| a + (b - a) * x);
                // Boxes that share a border both take a root on it; at the end of the surface rounding decides nothing.
                let slop = [u, v].map(|(_, [a, b])| 1e-11 + 4.0 * rounding * moves * (b - a));
                let within = |k: usize, [lo, hi]: [f64; 2]| at[k] >= lo - slop[k] && at[k] <= hi + slop[k];
                if within(0, u.0) && within(1, v.0) {
                    let m = all.point(Uv::from(at));
                    let doubtful =
                        (0..2).any(|k| ends[k][0] && at[k] < slop[k] || ends[k][1] && at[k] > 1.0 - slop[k]);
                    out.push(AuditHit { t: m.z / m.w, face, uv: patch.surface_uv(Uv::from(at)), doubtful });
                }
                continue;
            }
        }
        let across = net.points.iter().map(|p| (p.truncate().truncate() / p.w).length()).fold(0.0, f64::max);
        let tiny = relative[0].max(relative[1]) < 1e-12;
        let contact = across < 1e-9 && depth > 30;
        if tiny || contact {
            let m = net.point(Uv::splat(0.5));
            let doubtful = !tiny || across > 1e-7;
            if !doubtful || across < 1e-6 {
                let local = Uv::from(net.domain.map(|[lo, hi]| lo + 0.5 * (hi - lo)));
                out.push(AuditHit { t: m.z / m.w, face, uv: patch.surface_uv(local), doubtful });
            }
            continue;
        }
        let mut longest = (0, 0.0);
        let mut shrunk = false;
        let mut empty = false;
        for k in 0..2 {
            let Some([lo, hi]) = net.range(k, rounding) else {
                empty = true;
                break;
            };
            if hi - lo < 0.8 {
                net = net.cut(k, [lo, hi]);
                shrunk = true;
            }
            let side = net.edge_length(k);
            if side > longest.1 {
                longest = (k, side);
            }
        }
        if empty {
            continue;
        }
        if shrunk {
            stack.push(Piece { net, depth: depth + 1 });
        } else {
            stack.extend(
                [[0.0, 0.5], [0.5, 1.0]].map(|half| Piece { net: net.cut(longest.0, half), depth: depth + 1 }),
            );
        }
    }
    exhausted
}

impl Net {
    /// Whether all control points lie on one side of a plane through the ray.
    fn misses(&self, rounding: f64) -> bool {
        let (mut lo, mut hi) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in &self.points {
            let across = p.truncate().truncate();
            (lo, hi) = (lo.min(across), hi.max(across));
        }
        lo.x > rounding || lo.y > rounding || hi.x < -rounding || hi.y < -rounding
    }

    fn at(&self, i: usize, j: usize) -> Homogeneous {
        self.points[i * (self.degree[1] + 1) + j]
    }

    /// The homogeneous point at local parameters, by de Casteljau.
    pub(super) fn point(&self, local: Uv) -> Homogeneous {
        let row = |i: usize| {
            let line = (0..=self.degree[1]).map(|j| self.at(i, j)).collect();
            blossom(line, |_| local.y)
        };
        blossom((0..=self.degree[0]).map(row).collect(), |_| local.x)
    }

    /// Extent along a parameter as the ray sees it, in all three coordinates.
    fn edge_length(&self, direction: usize) -> f64 {
        let [p, q] = self.degree;
        let at = |i: usize, j: usize| self.at(i, j).project();
        if direction == 0 {
            (0..=q).map(|j| at(0, j).distance(at(p, j))).fold(0.0, f64::max)
        } else {
            (0..=p).map(|i| at(i, 0).distance(at(i, q))).fold(0.0, f64::max)
        }
    }

    /// Range of one parameter that can hold a root, by the hull of its distances to the line that joins the patch's ends in it.
    fn range(&self, direction: usize, rounding: f64) -> Option<[f64; 2]> {
        let [p, q] = self.degree;
        // A line through the origin roughly along the other parameter, so that distances grow with this one.
        let flat = |i: usize, j: usize| {
            let h = self.at(i, j);
            h.truncate().truncate() / h.w
        };
        let along = if direction == 0 {
            flat(0, q) - flat(0, 0) + flat(p, q) - flat(p, 0)
        } else {
            flat(p, 0) - flat(0, 0) + flat(p, q) - flat(0, q)
        };
        let Some(normal) = along.perp().try_normalize() else { return Some([0.0, 1.0]) };
        let n = self.degree[direction];
        // Lowest and highest distance at each station.
        let stations: SmallVec<[DVec3; 8]> = (0..=n)
            .map(|k| {
                let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
                for line in 0..=self.degree[1 - direction] {
                    let h = if direction == 0 { self.at(k, line) } else { self.at(line, k) };
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

    /// The part over `[lo, hi]` of one local parameter.
    fn cut(&self, direction: usize, [lo, hi]: [f64; 2]) -> Self {
        let q = self.degree[1];
        let n = self.degree[direction];
        let mut out = self.clone();
        for line in 0..=self.degree[1 - direction] {
            let index = |k: usize| if direction == 0 { k * (q + 1) + line } else { line * (q + 1) + k };
            for k in 0..=n {
                // The blossom at n − k times lo and k times hi.
                let points = (0..=n).map(|i| self.points[index(i)]).collect();
                out.points[index(k)] = blossom(points, |step| if step < k { hi } else { lo });
            }
        }
        let [a, b] = self.domain[direction];
        out.domain[direction] = [a + (b - a) * lo, a + (b - a) * hi];
        out
    }
}

/// The blossom of a polynomial: step `k` of de Casteljau's triangle is taken at `at(k)`.
fn blossom(mut points: SmallVec<[Homogeneous; 8]>, at: impl Fn(usize) -> f64) -> Homogeneous {
    for step in 0..points.len() - 1 {
        let x = at(step);
        for i in 0..points.len() - 1 - step {
            points[i] = points[i] * (1.0 - x) + points[i + 1] * x;
        }
    }
    points[0]
}

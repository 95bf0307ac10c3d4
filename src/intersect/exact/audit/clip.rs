//! Clipping one patch against one ray.

use super::hit::AuditHit;
use super::net::Net;
use super::single::single_root;
use crate::math::{FaceId, Homogeneous, Ray, Uv};
use crate::nurbs::BezierPatch;
use glam::DVec3;
use smallvec::SmallVec;

/// A part of the patch, as the ray sees it, that may hold a root.
struct Piece {
    net: Net,
    /// How often it was cut or halved.
    depth: u32,
}

/// Two planes that hold the ray, by their normals.
pub(super) struct View {
    a: DVec3,
    b: DVec3,
}

impl View {
    /// Chooses two planes through the ray, from the axis that its direction avoids most.
    pub(super) fn new(ray: &Ray) -> Self {
        // The shortest component's axis is the farthest from parallel, so that the cross product is not a difference of
        // near equals.
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
const CLIPPING_STEPS: u32 = 4000;
/// Boxes smaller than this part of a patch are tested for a single root.
const SMALL: f64 = 0.02;
/// The test covers at least this much more than the box, as parts of a patch, so that rounding leaves something on all sides.
const LEAST_SURROUNDINGS: f64 = 1e-7;
/// Share of a patch by which a root may lie beyond its box beside what rounding across the ray moves it: boxes that share a border
/// both take a root on it.
const BESIDE: f64 = 1e-11;
/// Roots move by so many times the rounding across the ray.
const BESIDE_ROUNDING: f64 = 4.0;
/// Ulps of the coordinates by which control points across the ray are off.
const ROUNDING: f64 = 64.0;
/// A box of this size is a point.
const POINT: f64 = 1e-12;
/// A box that lies this near to the ray, mm, and has been cut [`CONTACT_DEPTH`] times is a contact.
const CONTACT: f64 = 1e-9;
/// See [`CONTACT`].
const CONTACT_DEPTH: u32 = 30;
/// A point farther from the ray, mm, is doubtful.
const DOUBTFUL: f64 = 1e-7;
/// A point farther from the ray, mm, is none.
const BESIDE_RAY: f64 = 1e-6;
/// A cut that leaves more than this is a halving's worth: Nishita, Sederberg and Kakimoto.
const WORTH_CUTTING: f64 = 0.8;

/// A patch of a surface over `domain`, to be searched for crossings of a ray.
pub(super) struct PatchClipping<'a> {
    face: FaceId,
    patch: &'a BezierPatch,
    /// The patch over the unit square, as the ray sees it: a knot span of 1e-9 has few digits of its own.
    whole: Net,
    /// Which ends of the patch are ends of the surface, in u and in v.
    ends: [[bool; 2]; 2],
    /// Bound of the error of control points across the ray, mm.
    rounding: f64,
}

impl<'a> PatchClipping<'a> {
    /// Sees a patch along a ray; `domain` is the whole surface's, by which the patch's sides that are borders are known.
    pub(super) fn new(
        (ray, view): (&Ray, &View),
        face: FaceId,
        patch: &'a BezierPatch,
        domain: [[f64; 2]; 2],
    ) -> Self {
        let see = |p: &Homogeneous| {
            // The homogeneous point less w times the origin: seen from there without dividing by its weight.
            let r = p.truncate() - ray.origin * p.w;
            Homogeneous::new(r.dot(view.a), r.dot(view.b), r.dot(ray.direction), p.w)
        };
        let points = patch.points.iter().map(see).collect();
        let whole = Net { points, degree: patch.degree, domain: [[0.0, 1.0]; 2] };
        let ends = [0, 1].map(|k| [0, 1].map(|end| patch.domain[k][end] == domain[k][end]));
        let size = whole.points.iter().map(|p| p.truncate().abs().max_element()).fold(0.0, f64::max);
        let rounding = ROUNDING * f64::EPSILON * (size + ray.origin.abs().max_element());
        Self { face, patch, whole, ends, rounding }
    }

    /// Adds the crossings of the whole line to `out`, some of them twice; returns the distance, mm, from which on some were not searched
    /// for, infinity when all were.
    pub(super) fn search(&self, out: &mut SmallVec<[AuditHit; 8]>) -> f64 {
        if self.whole.misses(self.rounding) {
            return f64::INFINITY;
        }
        let mut stack = vec![Piece { net: self.whole.clone(), depth: 0 }];
        let mut steps = 0;
        let mut exhausted = f64::INFINITY;
        while let Some(piece) = stack.pop() {
            steps += 1;
            if piece.net.misses(self.rounding) {
                continue;
            }
            // Out of work: what is left lies no nearer than its nearest control point, and the caller learns from where on nothing is
            // known.
            if steps > CLIPPING_STEPS {
                exhausted = exhausted.min(piece.net.nearest());
                continue;
            }
            let size = piece.net.domain.map(|[lo, hi]| hi - lo).into_iter().fold(0.0, f64::max);
            // Large boxes seldom hold a single root provably, and the test costs as much as a few cuts.
            if size < SMALL && self.take_single_root(&piece.net, out) {
                continue;
            }
            if self.take_point(&piece, size, out) {
                continue;
            }
            self.divide(piece, &mut stack);
        }
        exhausted
    }

    /// Decides a small box when it can hold one root at most, which it adds to `out` where it lies inside; `false` where it cannot decide.
    fn take_single_root(&self, net: &Net, out: &mut SmallVec<[AuditHit; 8]>) -> bool {
        // The box with as much again on all sides, as parts of the whole patch.
        let around = net.domain.map(|[lo, hi]| {
            let beyond = (hi - lo).max(LEAST_SURROUNDINGS);
            [lo - beyond, hi + beyond]
        });
        let Some((root, moves)) = single_root(&self.whole.cut(0, around[0]).cut(1, around[1])) else {
            return false;
        };
        let at = [0, 1].map(|k: usize| {
            let [a, b] = around[k];
            a + (b - a) * root[k]
            // Rounded by the root's own condition: a unit across the ray moves it by `moves`.
        });
        // Boxes that share a border both take a root on it; at the end of the surface rounding decides nothing.
        let margin = around.map(|[a, b]| BESIDE + BESIDE_ROUNDING * self.rounding * moves * (b - a));
        let within = |k: usize| {
            let [lo, hi] = net.domain[k];
            at[k] >= lo - margin[k] && at[k] <= hi + margin[k]
        };
        if within(0) && within(1) {
            let m = self.whole.point(Uv::from(at));
            let at_end =
                |k: usize| self.ends[k][0] && at[k] < margin[k] || self.ends[k][1] && at[k] > 1.0 - margin[k];
            self.push(m, at, at_end(0) || at_end(1), out);
        }
        true
    }

    /// Decides a box that has come down to a point, or to a contact: adds its middle to `out` unless that lies beside the ray; `false`
    /// where the box is neither.
    fn take_point(&self, piece: &Piece, size: f64, out: &mut SmallVec<[AuditHit; 8]>) -> bool {
        let net = &piece.net;
        let across = net.points.iter().map(|p| (p.truncate().truncate() / p.w).length()).fold(0.0, f64::max);
        let tiny = size < POINT;
        let contact = across < CONTACT && piece.depth > CONTACT_DEPTH;
        if !(tiny || contact) {
            return false;
        }
        let doubtful = !tiny || across > DOUBTFUL;
        // Near enough to the ray to be a contact of rounding, too far for a crossing: a tiny box far from the ray
        // held none.
        if !doubtful || across < BESIDE_RAY {
            let middle = net.domain.map(|[lo, hi]| lo + 0.5 * (hi - lo));
            self.push(net.point(Uv::splat(0.5)), middle, doubtful, out);
        }
        true
    }

    /// Adds a crossing at the point `m`, as the ray sees it, of the patch's local parameters to `out`.
    fn push(&self, m: Homogeneous, local: [f64; 2], doubtful: bool, out: &mut SmallVec<[AuditHit; 8]>) {
        out.push(AuditHit { t: m.z / m.w, face: self.face, uv: self.patch.surface_uv(Uv::from(local)), doubtful });
    }

    /// Puts what the hull leaves of a box on the stack, its halves where that is most of it, or nothing where no root can lie in it.
    fn divide(&self, Piece { mut net, depth }: Piece, stack: &mut Vec<Piece>) {
        let mut longest = (0, 0.0);
        let mut shrunk = false;
        for k in 0..2 {
            // Nothing of the hull is left on this axis: no root.
            let Some([lo, hi]) = net.range(k, self.rounding) else { return };
            if hi - lo < WORTH_CUTTING {
                net = net.cut(k, [lo, hi]);
                shrunk = true;
            }
            // What is halved is the side that looks longest along the ray, which may be neither the longer in u nor
            // in v.
            let side = net.edge_length(k);
            if side > longest.1 {
                longest = (k, side);
            }
        }
        if shrunk {
            stack.push(Piece { net, depth: depth + 1 });
        } else {
            stack.extend(
                [[0.0, 0.5], [0.5, 1.0]].map(|half| Piece { net: net.cut(longest.0, half), depth: depth + 1 }),
            );
        }
    }
}

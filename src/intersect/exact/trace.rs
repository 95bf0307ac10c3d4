//! The walk through the hierarchy, and the one-step test of each leaf: exclude, or prove one root at most and find it.
//!
//! Seen along the ray, a leaf is a map `f` of its two parameters to the plane across the ray, in homogeneous form
//! `f = n·A − (n·o)·W`. With `Y` the inverse of the middle of the derivative boxes, a root in the leaf lies in
//! `middle − Y f(middle) ± |Y| R · ½` (Krawczyk's operator); when that misses the leaf there is none, and when the row
//! sums of `|Y| R` stay below 1 there is at most one in the enlarged domain, which Newton's method then finds.

use super::leaf::{EXTENSION, Leaf, ROUND};
use super::net::{self, V4};
use super::query::{Query, Root};
use super::tree::{ABSENT, LEAF};
use super::{Exact, wide};
use crate::intersect::Certainty;
use crate::math::Vector;
use smallvec::SmallVec;

/// Row sums above this go to clipping: 5 % is kept for the rounding of `Y`, which stays below 1e-6.
const UNIQUE: f64 = 0.95;

impl Exact {
    /// Bound of the rounding error of a leaf's coordinates across a ray, mm.
    ///
    /// Counted in half ulps relative to `|o − c| + radius`: 2 for the shifted origin, 4 for the frame's departure from
    /// perpendicular, 12 for the products, 10 for the value in the middle, 4 for what is left out; and the leaf's own slop.
    #[inline(always)]
    pub(super) fn noise(&self, leaf: &Leaf, oc: Vector) -> f64 {
        32.0 * ROUND * (oc.x.abs() + oc.y.abs() + oc.z.abs() + leaf.radius) + leaf.slop
    }

    /// Meets every leaf that the ray may touch, nearest boxes first.
    #[inline(always)]
    pub(super) fn walk(&self, q: &mut Query) {
        if self.tree.nodes.is_empty() {
            return;
        }
        // Entries carry the distance rounded down, so that pruning stays conservative.
        let mut stack: SmallVec<[(u32, f32); 64]> = SmallVec::new();
        stack.push((0, f32::NEG_INFINITY));
        while let Some((index, near)) = stack.pop() {
            if f64::from(near) > q.t_max {
                continue;
            }
            if index & LEAF != 0 {
                self.test_leaf(q, index & !LEAF);
                continue;
            }
            q.nodes += 1;
            let node = &self.tree.nodes[index as usize];
            let near = q.slabs(node);
            let mut met = [(ABSENT, f32::INFINITY); 4];
            let mut count = 0;
            for k in 0..4 {
                if near[k] < f64::INFINITY && node.child[k] != ABSENT {
                    // Insertion, farthest first: the nearest is popped next.
                    let entry = (node.child[k], (near[k] as f32).next_down());
                    let mut at = count;
                    while at > 0 && met[at - 1].1 < entry.1 {
                        met[at] = met[at - 1];
                        at -= 1;
                    }
                    met[at] = entry;
                    count += 1;
                }
            }
            for &entry in &met[..count] {
                stack.push(entry);
            }
        }
    }

    #[inline(always)]
    fn test_leaf(&self, q: &mut Query, index: u32) {
        let leaf = &self.leaves[index as usize];
        q.leaves_tested += 1;
        let oc = q.o - leaf.center;
        let noise = self.noise(leaf, oc);
        if !touches_oriented_box(q, leaf, oc, noise) {
            return;
        }
        let (k1, k2) = (q.n1.dot(oc), q.n2.dot(oc));
        let value = |a: &V4, n: Vector, k: f64| n.x * a[0] + n.y * a[1] + n.z * a[2] - k * a[3];
        let bound =
            |a: &V4, n: Vector, k: f64| n.x.abs() * a[0] + n.y.abs() * a[1] + n.z.abs() * a[2] + k.abs() * a[3];
        let s = &leaf.slopes;
        let (a, b) = (value(&s.u, q.n1, k1), value(&s.v, q.n1, k1));
        let (c, d) = (value(&s.u, q.n2, k2), value(&s.v, q.n2, k2));
        let det = a * d - b * c;
        // Beyond this condition the rounding of the inverse could reach 1e-6 in the test.
        if !(det.abs() > 1e-8 * (a.abs() + b.abs()) * (c.abs() + d.abs())) {
            return self.clip(q, index);
        }
        let (ra, rb) = (bound(&s.ru, q.n1, k1), bound(&s.rv, q.n1, k1));
        let (rc, rd) = (bound(&s.ru, q.n2, k2), bound(&s.rv, q.n2, k2));
        let inv = 1.0 / det;
        let (y00, y01, y10, y11) = (d * inv, -b * inv, -c * inv, a * inv);
        let row_u = y00.abs() * (ra + rb) + y01.abs() * (rc + rd);
        let row_v = y10.abs() * (ra + rb) + y11.abs() * (rc + rd);
        if !(row_u < UNIQUE && row_v < UNIQUE) {
            return self.clip(q, index);
        }
        let (f1, f2) = (value(&leaf.middle, q.n1, k1), value(&leaf.middle, q.n2, k2));
        let du = -(y00 * f1 + y01 * f2);
        let dv = -(y10 * f1 + y11 * f2);
        let margin = 1e-14 + noise * (y00.abs() + y01.abs() + y10.abs() + y11.abs());
        let half = leaf.reach.map(|[lo, hi]| (0.5 - lo).max(hi - 0.5));
        let reach_u = half[0] * (1.0 + row_u + 1e-6) + margin;
        let reach_v = half[1] * (1.0 + row_v + 1e-6) + margin;
        if du.abs() > reach_u || dv.abs() > reach_v {
            return;
        }
        let (mut u, mut v) = (0.5 + du, 0.5 + dv);
        let clamp = |x: f64| x.clamp(-EXTENSION, 1.0 + EXTENSION);
        (u, v) = (clamp(u), clamp(v));
        let net = leaf.net(&self.pool);
        let mut last = f64::INFINITY;
        let mut at: Option<V4> = None;
        for _ in 0..12 {
            let jet = net::evaluate(net, leaf.degree, u, v);
            let (f1, f2) = (value(&jet.s, q.n1, k1), value(&jet.s, q.n2, k2));
            let (a, b) = (value(&jet.su, q.n1, k1), value(&jet.sv, q.n1, k1));
            let (c, d) = (value(&jet.su, q.n2, k2), value(&jet.sv, q.n2, k2));
            let inv = 1.0 / (a * d - b * c);
            let (xu, xv) = ((d * f1 - b * f2) * inv, (a * f2 - c * f1) * inv);
            let step = xu.abs().max(xv.abs());
            u -= xu;
            v -= xv;
            // After a step of 1e-8 the next error is its square: move the value along and stop.
            if step < 1e-8 || (step < 1e-6 && step >= last) {
                let mut s = jet.s;
                net::axpy(&mut s, -xu, &jet.su);
                net::axpy(&mut s, -xv, &jet.sv);
                at = Some(s);
                break;
            }
            last = step;
            if !(u > -1.0 && u < 2.0 && v > -1.0 && v < 2.0) {
                break;
            }
        }
        let Some(s) = at else { return self.clip(q, index) };
        let within = |x: f64, e: f64| x >= -e && x <= 1.0 + e;
        if !(within(u, EXTENSION) && within(v, EXTENSION)) {
            return self.clip(q, index);
        }
        // The only root of the enlarged domain: outside of the leaf it is another leaf's.
        let e = margin;
        let counts = |x: f64, [lo, hi]: [f64; 2]| x >= lo - e && x <= hi + e;
        if !(counts(u, leaf.reach[0]) && counts(v, leaf.reach[1])) {
            return;
        }
        let p = Vector::new(s[0], s[1], s[2]) / s[3];
        let t = q.d.dot(p - oc);
        if !q.wants(t) {
            return;
        }
        if let Some(own) = q.own
            && let Some(at) = own.in_leaf(leaf, &self.geometry)
            && within(at[0], EXTENSION)
            && within(at[1], EXTENSION)
            && own.is_unique_root(t)
        {
            return;
        }
        self.offer(q, index, [u, v], t, Certainty::Certified);
    }

    /// Takes a root when it lies in range, inside the trims, and is not the point that the ray leaves.
    pub(super) fn offer(&self, q: &mut Query, index: u32, local: [f64; 2], t: f64, certainty: Certainty) {
        if !q.wants(t) {
            return;
        }
        let leaf = &self.leaves[index as usize];
        if q.own.is_some_and(|own| own.is_twin(leaf, local, t, &self.geometry)) {
            return;
        }
        let mut near_trim = false;
        if !leaf.whole {
            let (inside, near) = self.counts(q, leaf, local);
            near_trim = near;
            if !inside {
                if near {
                    q.turned_away = q.turned_away.min(t);
                }
                return;
            }
        }
        q.accept(Root { t, leaf: index, local, certainty, near_trim });
    }

    /// Whether a root lies inside the trims, and whether a trim is within the band.
    fn counts(&self, q: &Query, leaf: &Leaf, local: [f64; 2]) -> (bool, bool) {
        let face = &self.geometry.faces[leaf.face as usize];
        let trim = &self.geometry.trims[face.trim as usize];
        let patch = &self.geometry.patches[leaf.patch as usize];
        let uv = patch.uv(leaf.in_patch(local));
        let jet = wide::evaluate(leaf.net(&self.pool), leaf.degree, local[0], local[1]);
        let (_, du, dv) = super::geometry::project(&jet);
        // Distances across the ray, not along the surface: on a face that the ray grazes, the root strays from the edge by the
        // gap over the sine, and still the edge must decide for both of its faces.
        let scale = |d: usize| (leaf.rect[d][1] - leaf.rect[d][0]) * (patch.domain[d][1] - patch.domain[d][0]);
        let across = |a: Vector, d: usize| (a - q.d * a.dot(q.d)) / scale(d);
        let (su, sv) = (across(du, 0), across(dv, 1));
        let metric = [su.length_squared(), su.dot(sv), sv.length_squared()];
        let mut place = trim.locate(uv, metric, face.flagged);
        let flagged = !place.near.is_empty();
        place.near.retain(|n| n.distance <= face.band);
        if place.near.is_empty() {
            return (place.inside, flagged);
        }
        let facing = du.cross(dv).dot(q.d);
        let inside = match self.geometry.side_of_edges(face, trim, q, facing, &place.near) {
            Some(inside) => inside,
            // Seams and poles bound nothing in space: what lies on them is part of the face.
            None if place.near.iter().all(|n| trim.uses[n.owner as usize].edge.is_none()) => true,
            None => place.inside,
        };
        (inside, true)
    }
}

/// The oriented box, with the rounding of the rotated origin as margin.
#[inline(always)]
fn touches_oriented_box(q: &Query, leaf: &Leaf, oc: Vector, noise: f64) -> bool {
    let (mut near, mut far) = (q.t_min, q.t_max);
    for k in 0..3 {
        let (o, d) = (oc.dot(leaf.axes[k]), q.d.dot(leaf.axes[k]));
        let inv = 1.0 / if d.abs() < 1e-200 { 1e-200f64.copysign(d) } else { d };
        let (a, b) = ((leaf.olo[k] - noise - o) * inv, (leaf.ohi[k] + noise - o) * inv);
        let (x, y) = if a < b { (a, b) } else { (b, a) };
        near = if x > near { x } else { near };
        far = if y < far { y } else { far };
    }
    near <= far + 4.0 * f64::EPSILON * far.abs()
}

//! The walk through the hierarchy, and the one-step test of each leaf: exclude, or prove one root at most and find it.
//!
//! Seen along the ray, a leaf is a map `f` of its two parameters to the plane across the ray, in homogeneous form
//! `f = n·A − (n·o)·W`. With `Y` the inverse of the middle of the derivative boxes, a root in the leaf lies in
//! `middle − Y f(middle) ± |Y| R · ½` (Krawczyk's operator); when that misses the leaf there is none, and when the row
//! sums of `|Y| R` stay below 1 there is at most one in the enlarged domain, which Newton's method then finds.

use super::leaf::{EXTENSION, Leaf, REACH, ROUND};
use super::net::{self, Jet, V4};
use super::probe::seen;
use super::query::{Query, Root};
use super::tree::{LEAF, WIDTH};
use super::trim::Region;
use super::{Exact, wide};
use crate::intersect::Certainty;
use crate::math::Vector;
use smallvec::SmallVec;

/// Row sums above this go to clipping: 5 % is kept for the rounding of `Y`, which stays below 1e-6.
const UNIQUE: f64 = 0.95;
/// Newton's method stops where its next step is foreseen below this, in local parameters.
pub(super) const CLOSE: f64 = 1e-12;

/// What is left to visit, with the distance at which it is entered.
pub(super) type Stack = SmallVec<[(u32, f32); 64]>;

impl Exact {
    /// Bound of the rounding error of a leaf's coordinates across a ray, mm.
    ///
    /// Counted in half ulps relative to `|o − c| + radius`: 2 for the shifted origin, 4 for the frame's departure from
    /// perpendicular, 12 for the products, 10 for the value in the middle, 4 for what is left out; and the leaf's own slop.
    #[inline(always)]
    pub(super) fn noise(&self, leaf: &Leaf, oc: Vector) -> f64 {
        32.0 * ROUND * (oc.x.abs() + oc.y.abs() + oc.z.abs() + leaf.radius) + leaf.slop
    }

    /// The next leaf that the ray may touch, nearest boxes first; `None` when there is none left.
    #[inline(always)]
    pub(super) fn advance<const WIDE: bool>(&self, q: &mut Query, stack: &mut Stack) -> Option<u32> {
        while let Some((index, near)) = stack.pop() {
            if near > q.slabs.end {
                continue;
            }
            if index & LEAF != 0 {
                return Some(index & !LEAF);
            }
            q.nodes += 1;
            let node = &self.tree.nodes[index as usize];
            let (near, mut met) = wide::meet::<WIDE>(&q.slabs, node);
            let first = stack.len();
            while met != 0 {
                let k = met.trailing_zeros() as usize % WIDTH;
                met &= met - 1;
                let entry = (node.child[k], near[k]);
                // Insertion, farthest first: the nearest is popped next.
                stack.push(entry);
                let new = &mut stack[first..];
                let mut at = new.len() - 1;
                while at > 0 && new[at - 1].1 < entry.1 {
                    new[at] = new[at - 1];
                    at -= 1;
                }
                new[at] = entry;
            }
        }
        None
    }

    #[inline(always)]
    pub(super) fn test_leaf(&self, q: &mut Query, index: u32) {
        let probe = &self.probes[index as usize];
        q.leaves_tested += 1;
        let oc = q.o - probe.center;
        let noise = 32.0 * ROUND * (oc.x.abs() + oc.y.abs() + oc.z.abs()) + probe.still;
        let (k1, k2) = (q.n1.dot(oc), q.n2.dot(oc));
        let [a, b, f1] = probe.seen(q.n1, k1);
        let [c, d, f2] = probe.seen(q.n2, k2);
        let det = a * d - b * c;
        // Beyond this condition the rounding of the inverse could reach 1e-6 in the test.
        if !(det.abs() > 1e-8 * (a.abs() + b.abs()) * (c.abs() + d.abs())) {
            return self.clip_touched(q, index);
        }
        let (r1, r2) = (probe.spread(q.n1, k1), probe.spread(q.n2, k2));
        let inv = 1.0 / det;
        let (y00, y01, y10, y11) = (d * inv, -b * inv, -c * inv, a * inv);
        let row_u = y00.abs() * r1 + y01.abs() * r2;
        let row_v = y10.abs() * r1 + y11.abs() * r2;
        if !(row_u < UNIQUE && row_v < UNIQUE) {
            return self.clip_touched(q, index);
        }
        let du = -(y00 * f1 + y01 * f2);
        let dv = -(y10 * f1 + y11 * f2);
        let margin = 1e-14 + noise * (y00.abs() + y01.abs() + y10.abs() + y11.abs());
        let reach_u = f64::from(probe.half[0]) * (1.0 + row_u + 1e-6) + margin;
        let reach_v = f64::from(probe.half[1]) * (1.0 + row_v + 1e-6) + margin;
        if du.abs() > reach_u || dv.abs() > reach_v {
            return;
        }
        let clamp = |x: f64| x.clamp(-EXTENSION, 1.0 + EXTENSION);
        let (mut u, mut v) = (clamp(0.5 + du), clamp(0.5 + dv));
        let net = probe.net(&self.pool);
        let mut last = du.abs().max(dv.abs());
        let mut at: Option<V4> = None;
        for _ in 0..12 {
            let jet = net::evaluate(net, probe.degree, u, v);
            let ([f1, a, b], [f2, c, d]) = (seen(&jet, q.n1, k1), seen(&jet, q.n2, k2));
            let inv = 1.0 / (a * d - b * c);
            let (xu, xv) = ((d * f1 - b * f2) * inv, (a * f2 - c * f1) * inv);
            let step = xu.abs().max(xv.abs());
            u -= xu;
            v -= xv;
            // Steps square: the next would be about step³/last². What is left is taken off where the hit is made.
            if step < 1e-8 || step * step * step < CLOSE * last * last || (step < 1e-6 && step >= last) {
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
        let Some(s) = at else { return self.clip_touched(q, index) };
        let within = |x: f64, e: f64| x >= -e && x <= 1.0 + e;
        if !(within(u, EXTENSION) && within(v, EXTENSION)) {
            return self.clip_touched(q, index);
        }
        // The only root of the enlarged domain: outside of the leaf it is another leaf's.
        let e = margin + 2.0 * CLOSE;
        let reach = if probe.widened { self.leaves[index as usize].reach } else { REACH };
        let counts = |x: f64, [lo, hi]: [f64; 2]| x >= lo - e && x <= hi + e;
        if !(counts(u, reach[0]) && counts(v, reach[1])) {
            return;
        }
        let p = Vector::new(s[0], s[1], s[2]) / s[3];
        let t = q.d.dot(p - oc);
        if !q.wants(t) {
            return;
        }
        if let Some(own) = q.own
            && let Some(at) = own.in_leaf(&self.leaves[index as usize], &self.geometry)
            && within(at[0], EXTENSION)
            && within(at[1], EXTENSION)
            && own.is_unique_root(t)
        {
            return;
        }
        self.offer(q, index, [u, v], t, Certainty::Certified);
    }

    /// Clips a leaf whose oriented box the ray touches.
    #[inline(always)]
    fn clip_touched(&self, q: &mut Query, index: u32) {
        let leaf = &self.leaves[index as usize];
        let oc = q.o - leaf.center;
        if touches_oriented_box(q, leaf, oc, self.noise(leaf, oc)) {
            self.clip(q, index);
        }
    }

    /// Takes a root when it lies in range, inside the trims, and is not the point that the ray leaves.
    pub(super) fn offer(&self, q: &mut Query, index: u32, local: [f64; 2], t: f64, certainty: Certainty) {
        if !q.wants(t) {
            return;
        }
        if q.own.is_some_and(|own| own.is_twin(&self.leaves[index as usize], local, t, &self.geometry)) {
            return;
        }
        let mut near_trim = false;
        if !self.probes[index as usize].whole {
            let leaf = &self.leaves[index as usize];
            let (inside, near) = self.counts(q, leaf, local);
            near_trim = near;
            if !inside {
                if near {
                    q.turn_away(t);
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
        match trim.cell_at(uv) {
            Region::Border => {}
            decided => return (decided == Region::Inside, false),
        }
        let jet = wide::evaluate(leaf.net(&self.pool), leaf.degree, local[0], local[1]);
        let (_, du, dv) = super::geometry::project(&jet);
        // Distances across the ray, not along the surface: on a face that the ray grazes, the root strays from the edge by the
        // gap over the sine, and still the edge must decide for both of its faces.
        let scale = |d: usize| (leaf.rect[d][1] - leaf.rect[d][0]) * (patch.domain[d][1] - patch.domain[d][0]);
        let across = |a: Vector, d: usize| (a - q.d * a.dot(q.d)) / scale(d);
        let (su, sv) = (across(du, 0), across(dv, 1));
        let metric = [su.length_squared(), su.dot(sv), sv.length_squared()];
        let mut place = trim.locate(uv, metric, face.flagged);
        let widest = |owner: u32| self.geometry.flagged(trim.uses[owner as usize].gap, &face.placement);
        place.near.retain(|n| n.distance <= widest(n.owner));
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

/// A step of Newton's method, to be taken off, and t after it.
#[inline(always)]
pub(super) fn corrected(q: &Query, oc: Vector, jet: &Jet) -> ([f64; 2], f64) {
    let (k1, k2) = (q.n1.dot(oc), q.n2.dot(oc));
    let ([f1, a, b], [f2, c, d]) = (seen(jet, q.n1, k1), seen(jet, q.n2, k2));
    let inv = 1.0 / (a * d - b * c);
    let (xu, xv) = ((d * f1 - b * f2) * inv, (a * f2 - c * f1) * inv);
    let mut s = jet.s;
    net::axpy(&mut s, -xu, &jet.su);
    net::axpy(&mut s, -xv, &jet.sv);
    ([xu, xv], q.d.dot(Vector::new(s[0], s[1], s[2]) / s[3] - oc))
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

//! The one-step test of a leaf: exclude it, or prove one root at most and find that.
//!
//! Seen along the ray, a leaf is a map `f` of its two parameters to the plane across the ray, in homogeneous form
//! `f = n·A − (n·o)·W`. With `Y` the inverse of the middle of the derivative boxes, a root in the leaf lies in
//! `middle − Y f(middle) ± |Y| R · ½` (Krawczyk's operator); when that misses the leaf there is none, and when the row
//! sums of `|Y| R` stay below 1 there is at most one in the enlarged domain, which Newton's method then finds.

use super::acceptance::Candidate;
use super::clip;
use super::leaf::Leaf;
use super::linearization::{Linearization, projected_jet};
use super::net::{self, Jet, V4};
use super::query::Query;
use super::settlement;
use super::structure::Exact;
use super::tolerances::{COORDINATE_ROUNDING, EXTENSION, INVERSE_ROUNDING, NEWTON_STEP, REACH, ROUND, SINGULAR};
use crate::intersect::Certainty;
use crate::math::Vector;

/// Row sums above this go to clipping: 5 % is kept for the rounding of `Y` and of what it is the inverse of.
const LARGEST_ROW_SUM_OF_LEAF: f64 = 0.95;
/// Leaves that are nearly singular go to clipping where rounding moves a root by more, as a share of the leaf.
///
/// A derivative is off by twice the degree, 25 at most, of what control points are off, and the inverse magnifies both alike: row sums are
/// off by a hundred times the margin, the 5 % that [`LARGEST_ROW_SUM_OF_LEAF`] leaves. What the inverse is off by itself, eight half ulps
/// of the product of row sums over the determinant, is less: the margin has 32 of the leaf's radius, a seventh of a row sum, over the same.
const LARGEST_MARGIN: f64 = 5e-4;
/// Rounding of parameters of a unit square: fifty ulps of its middle.
const PARAMETER_ROUNDING: f64 = 1e-14;
/// Newton steps on a leaf; its map is nearly linear, and three do on most.
const LEAF_STEPS: usize = 12;
/// A step this short is the last. The next would be its square times half the bend of the map over its slope, at most 16 for each degree
/// where row sums are below [`LARGEST_ROW_SUM_OF_LEAF`]: below [`NEWTON_STEP`]. What two steps foretell of a third is no bound, as one of
/// them may be short by chance: on a ball one hit in 100,000 next to the border of a leaf was lost to both leaves.
const LAST_LEAF_STEP: f64 = 3e-8;
/// Steps below this that do not get shorter are rounding.
const STALLED_LEAF_STEP: f64 = 1e-6;
/// Keeps reciprocals of a direction's components finite; far below any component that moves a box.
const SMALLEST_COMPONENT: f64 = 1e-200;

impl Exact {
    /// Bound of the rounding error of a leaf's coordinates across a ray, mm. `oc` is the ray's origin less the leaf's centre.
    #[inline(always)]
    pub(super) fn noise(&self, leaf: &Leaf, oc: Vector) -> f64 {
        COORDINATE_ROUNDING * ROUND * (oc.x.abs() + oc.y.abs() + oc.z.abs() + leaf.radius) + leaf.slop
    }

    /// Tests a leaf and counts it: excludes it, offers its only root, or hands it to clipping; what comes of it is left in `query`.
    #[inline(always)]
    pub(super) fn test_leaf(&self, query: &mut Query, index: u32) {
        let leaf = &self.linearizations[index as usize];
        query.leaves_tested += 1;
        let oc = query.o - leaf.center;
        let noise = COORDINATE_ROUNDING * ROUND * (oc.x.abs() + oc.y.abs() + oc.z.abs()) + leaf.still_noise;
        let (k1, k2) = (query.n1.dot(oc), query.n2.dot(oc));

        // The Jacobian in the middle and its inverse.
        let [a, b, f1] = leaf.projected(query.n1, k1);
        let [c, d, f2] = leaf.projected(query.n2, k2);
        let det = a * d - b * c;
        let (r1, r2) = (leaf.derivative_spread(query.n1, k1), leaf.derivative_spread(query.n2, k2));
        let inv = 1.0 / det;
        let (y00, y01, y10, y11) = (d * inv, -b * inv, -c * inv, a * inv);

        // Where its boxes deviate from it by less than itself there is one root at most.
        let row_u = y00.abs() * r1 + y01.abs() * r2;
        let row_v = y10.abs() * r1 + y11.abs() * r2;
        let margin = PARAMETER_ROUNDING + noise * (y00.abs() + y01.abs() + y10.abs() + y11.abs());
        // Where it is singular the margin is infinite, or no number.
        let regular = det.abs() > SINGULAR * (a.abs() + b.abs()) * (c.abs() + d.abs());
        let is_unique = row_u < LARGEST_ROW_SUM_OF_LEAF && row_v < LARGEST_ROW_SUM_OF_LEAF;
        if !(is_unique && (regular || margin < LARGEST_MARGIN)) {
            return self.clip_touched(query, index);
        }

        // Krawczyk's operator, about the middle: does it miss the leaf?
        let du = -(y00 * f1 + y01 * f2);
        let dv = -(y10 * f1 + y11 * f2);
        // What rounding may move the operator's image by, then the leaf's half width with what the Jacobian's
        // spread adds to it.
        let reach_u = f64::from(leaf.half[0]) * (1.0 + row_u + INVERSE_ROUNDING) + margin;
        let reach_v = f64::from(leaf.half[1]) * (1.0 + row_v + INVERSE_ROUNDING) + margin;
        if du.abs() > reach_u || dv.abs() > reach_v {
            return;
        }
        let Some((local, s)) = self.newton_on_leaf(query, leaf, [du, dv], [k1, k2]) else {
            return self.clip_touched(query, index);
        };
        let place = PARAMETER_ROUNDING + 2.0 * NEWTON_STEP;
        let margins = [place + noise * (y00.abs() + y01.abs()), place + noise * (y10.abs() + y11.abs())];
        self.offer_only_root(query, index, (local, s), oc, (margin, margins));
    }

    /// Finds the only root of a leaf's enlarged domain, in its parameters, with the homogeneous point there about its centre; `None` where
    /// Newton's method does not converge or has left that domain, so that the root may be any.
    #[inline(always)]
    fn newton_on_leaf(
        &self,
        query: &Query,
        leaf: &Linearization,
        [du, dv]: [f64; 2],
        [k1, k2]: [f64; 2],
    ) -> Option<([f64; 2], V4)> {
        let clamp = |x: f64| x.clamp(-EXTENSION, 1.0 + EXTENSION);
        // Krawczyk's step is Newton's first. It is held within the extension, outside of which nothing is proved.
        let (mut u, mut v) = (clamp(0.5 + du), clamp(0.5 + dv));
        let control = leaf.net(&self.geometry.nets);
        let mut last = du.abs().max(dv.abs());
        for _ in 0..LEAF_STEPS {
            let jet = net::evaluate_inlined(control, leaf.degree, u, v);
            let ([f1, a, b], [f2, c, d]) = (projected_jet(&jet, query.n1, k1), projected_jet(&jet, query.n2, k2));
            let inv = 1.0 / (a * d - b * c);
            let (xu, xv) = ((d * f1 - b * f2) * inv, (a * f2 - c * f1) * inv);
            let step = xu.abs().max(xv.abs());
            u -= xu;
            v -= xv;
            // What is left is taken off where the hit is made.
            if step < LAST_LEAF_STEP || (step < STALLED_LEAF_STEP && step >= last) {
                let mut s = jet.s;
                net::axpy(&mut s, -xu, &jet.su);
                net::axpy(&mut s, -xv, &jet.sv);
                return (within(u, EXTENSION) && within(v, EXTENSION)).then_some(([u, v], s));
            }
            last = step;
            // Gone astray: the root, if there is one, is left to clipping.
            if !(within(u, 1.0) && within(v, 1.0)) {
                break;
            }
        }
        None
    }

    /// Offers or settles the only root of the enlarged domain, unless the ray leaves it; outside of the leaf it is another leaf's. `s` is
    /// the homogeneous point there and `oc` the ray's origin, both about the leaf's centre; rounding moves the root by `margins` along u
    /// and v, and by `margin` at most.
    #[inline(always)]
    fn offer_only_root(
        &self,
        query: &mut Query,
        index: u32,
        ([u, v], s): ([f64; 2], V4),
        oc: Vector,
        (margin, margins): (f64, [f64; 2]),
    ) {
        let e = margin + 2.0 * NEWTON_STEP;
        let leaf = &self.linearizations[index as usize];
        let reach = if leaf.widened { self.leaves[index as usize].reach } else { REACH };
        let counts = |x: f64, [lo, hi]: [f64; 2]| x >= lo - e && x <= hi + e;
        if !(counts(u, reach[0]) && counts(v, reach[1])) {
            return;
        }
        let p = Vector::new(s[0], s[1], s[2]) / s[3];
        let t = query.d.dot(p - oc);
        // While its place is open its t is as well: the range is checked on the settled root.
        let open = leaf.ill_scaled || settlement::needs_settling([u, v], margins);
        if !open && !query.is_in_range(t) {
            return;
        }
        // One root at most lies in the enlarged domain: if the departure does, this is it.
        if let Some(own) = query.departure
            && let Some(left) = own.local_to(&self.leaves[index as usize], query.o, &self.geometry)
            && within(left[0], EXTENSION)
            && within(left[1], EXTENSION)
            && own.is_root_at(t)
        {
            return;
        }
        let found = Candidate { local: [u, v], t, certainty: Certainty::Certified, settled: None };
        if open {
            self.settle(query, index, found, margins);
        } else {
            self.offer(query, index, found);
        }
    }

    /// Clips a leaf if the ray touches its oriented box.
    #[inline(always)]
    fn clip_touched(&self, query: &mut Query, index: u32) {
        let leaf = &self.leaves[index as usize];
        let oc = query.o - leaf.center;
        // The axis-parallel box that led here is loose, and a clipping costs as much as dozens of tests.
        if touches_oriented_box(query, leaf, oc, self.noise(leaf, oc)) {
            clip::clip(self, query, index);
        }
    }
}

/// Whether a parameter lies in `[0, 1]` or beyond by no more than `e`.
#[inline(always)]
fn within(x: f64, e: f64) -> bool {
    x >= -e && x <= 1.0 + e
}

/// A step of Newton's method across the ray from the jet of a leaf's net: what is to be subtracted from the parameters, and t after it,
/// mm. `oc` is the ray's origin less the leaf's centre; where the Jacobian is singular the step is not finite.
#[inline(always)]
pub(super) fn newton_step(query: &Query, oc: Vector, jet: &Jet) -> ([f64; 2], f64) {
    let (k1, k2) = (query.n1.dot(oc), query.n2.dot(oc));
    let ([f1, a, b], [f2, c, d]) = (projected_jet(jet, query.n1, k1), projected_jet(jet, query.n2, k2));
    let inv = 1.0 / (a * d - b * c);
    let (xu, xv) = ((d * f1 - b * f2) * inv, (a * f2 - c * f1) * inv);
    let mut s = jet.s;
    net::axpy(&mut s, -xu, &jet.su);
    net::axpy(&mut s, -xv, &jet.sv);
    ([xu, xv], query.d.dot(Vector::new(s[0], s[1], s[2]) / s[3] - oc))
}

/// Whether a ray meets a leaf's oriented box, grown by `noise` mm, in what is left of its range.
#[inline(always)]
fn touches_oriented_box(query: &Query, leaf: &Leaf, oc: Vector, noise: f64) -> bool {
    let (mut near, mut far) = (query.from, query.t_max);
    for k in 0..3 {
        let (o, d) = (oc.dot(leaf.axes[k]), query.d.dot(leaf.axes[k]));
        let inv = 1.0 / if d.abs() < SMALLEST_COMPONENT { SMALLEST_COMPONENT.copysign(d) } else { d };
        let (a, b) = ((leaf.box_low[k] - noise - o) * inv, (leaf.box_high[k] + noise - o) * inv);
        let (x, y) = if a < b { (a, b) } else { (b, a) };
        near = if x > near { x } else { near };
        far = if y < far { y } else { far };
    }
    // The division and the product round by three half ulps at most.
    near <= far + 4.0 * f64::EPSILON * far.abs()
}

//! The proof: an upper bound of the distance between a flat triangle and its piece of the spline.
//!
//! Let T be the triangle, P its piece of surface (the image of a parameter triangle, or the region that the trim cuts
//! out of it), in both directions:
//!
//! * P to T: the distance to a convex set is a convex function, so on each Bézier piece it is at most its largest value
//!   at the control points. Parameter triangles are cut along knots and, while that helps, into four.
//! * T to P: project along the normal of T. A point x of T that P's projection covers is within the height of P
//!   over it. If it is not covered, the boundary of P does not wind around x; shrinking each boundary curve sideways
//!   onto its edge gives the boundary of T, which does wind around x, so on the way some curve has crossed x: that
//!   curve has a point on x's side line farther out, and x is no farther from it than it is from the line of its edge. So
//!   the distance is at most the larger of P to T and the distance of the boundary curves to the lines of their edges.
//!
//! Cells are proved as one quad where that holds (`quad.rs`), which their diagonal then is no boundary of.
//! Both are tried by second derivatives first (`bend.rs`): the piece and its boundary are near the linear map onto the triangle.
//!
//! No projected Jacobian enters: folds are covered too. Where corners do not lie on the surface (the file's own gap between
//! edge and face) the offset is added. Rounding is covered by 1e-12 of the surface's size.

use super::flat::{Flat, clip, from_chord, whole};
use super::near::Near;
use super::net::{Corner, MOST_HALVED, Nets};
use super::quad::Halving;
use super::refine::{LEVELS, refine};
use super::scalar::Scalar;
use super::slight::{self, Slight};
use crate::math::{Point, Uv};
use crate::nurbs::BezierPatch;
use crate::tessellate::settings::Judge;
use crate::tessellate::sheet::{Sheet, local};

/// Knot rectangles that one triangle may span and still be tried.
const MOST_PIECES: usize = 20_000;
/// Knot rectangles up to which second derivatives are looked at one by one.
const MOST_NEAR: usize = 16;
/// Knot rectangles up to which the hulls of a facet's deviation are looked at one by one.
const MOST_HULL: usize = 1000;
/// Share of the limit by which a cubic may differ from a patch of higher degree that it stands for.
const SLIGHT: f64 = 0.02;
/// Where a triangle is looked at before it is proved.
const PROBES: [[f64; 3]; 4] = [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [1.0 / 3.0; 3]];

/// Bounds facets of one face.
pub(in crate::tessellate) struct Prover<'s, 'a> {
    pub(in crate::tessellate) sheet: &'s Sheet<'a>,
    pub(super) judge: Judge,
    nets: Nets,
    pub(super) near: Near,
    slight: Slight,
    pub(super) scalar: Scalar,
    pub(super) halving: Halving,
    pub(super) margin: f64,
}

impl<'s, 'a> Prover<'s, 'a> {
    pub(in crate::tessellate) fn new(sheet: &'s Sheet<'a>, judge: Judge) -> Self {
        Self {
            sheet,
            judge,
            nets: Nets::default(),
            near: Near::default(),
            slight: Slight::default(),
            scalar: Scalar::default(),
            halving: Halving::default(),
            margin: 1e-12 * sheet.size,
        }
    }

    /// Bound of the distance from the surface over a parameter triangle to a triangle in space.
    ///
    /// Stops refining as soon as the answer is at most `limit`, or clearly is not.
    pub(in crate::tessellate) fn piece(&mut self, uv: [Uv; 3], xyz: [Point; 3], limit: f64) -> f64 {
        if self.sheet.affine {
            let off = [0, 1, 2].map(|i| Flat::new(&xyz).distance(self.sheet.point(uv[i])));
            return off[0].max(off[1]).max(off[2]) + self.margin;
        }
        let flat = Flat::new(&xyz);
        if self.judge == Judge::Bound
            && let Some(quick) = self.quick(&uv, limit, |p| flat.distance(p))
        {
            return quick;
        }
        let sampled = self.probed(&uv, &flat, limit, &PROBES);
        if sampled > limit {
            return sampled;
        }
        if self.judge == Judge::Sampled {
            return self.sampled(uv, &flat).max(sampled);
        }
        self.hulls(uv, &flat, limit)
    }

    /// Largest distance of the surface at a few places of a parameter triangle to a triangle in space; the first one above the limit.
    fn probed(&self, uv: &[Uv; 3], flat: &Flat, limit: f64, places: &[[f64; 3]]) -> f64 {
        let mut most = 0f64;
        for [a, b, c] in places {
            most = most.max(flat.distance(self.sheet.point(uv[0] * *a + uv[1] * *b + uv[2] * *c)));
            if most > limit {
                break;
            }
        }
        most
    }

    /// Bound of the distance from the surface over a parameter triangle to a triangle in space, by hulls.
    fn hulls(&mut self, uv: [Uv; 3], flat: &Flat, limit: f64) -> f64 {
        self.pieces(&uv, |this, a, b, polygon| {
            let patch = this.sheet.patch(a, b);
            let mut worst = 0f64;
            if whole(polygon, patch.domain) {
                let hull = patch.points.iter().map(|p| flat.distance(p.project())).fold(0.0, f64::max);
                if hull <= limit {
                    return hull;
                }
            }
            for k in 1..polygon.len() - 1 {
                let tri = [polygon[0], polygon[k], polygon[k + 1]].map(|x| local(patch, x));
                worst = worst.max(this.hull(patch, tri, limit, LEVELS, &|p| flat.distance(p)));
                if worst > limit {
                    break;
                }
            }
            worst
        }) + self.margin
    }

    /// Bound of the distance from the surface over a convex parameter polygon to a triangle in space.
    pub(in crate::tessellate) fn polygon(&mut self, uv: &[Uv], xyz: [Point; 3], limit: f64) -> f64 {
        let flat = Flat::new(&xyz);
        let bounded = !self.sheet.affine && self.judge == Judge::Bound;
        if bounded && let Some(quick) = self.quick(uv, limit, |p| flat.distance(p)) {
            return quick;
        }
        let mut worst = 0f64;
        for k in 1..uv.len().saturating_sub(1) {
            let triangle = [uv[0], uv[k], uv[k + 1]];
            // Nearly all of these slivers hold: samples would seldom spare the proof.
            let one = if bounded { self.hulls(triangle, &flat, limit) } else { self.piece(triangle, xyz, limit) };
            worst = worst.max(one);
            if worst > limit {
                break;
            }
        }
        worst
    }

    /// Bound of the distance from the surface over a parameter triangle to a triangle in space and from its sides to theirs, by one
    /// quick look; `None` when that does not show it to be within the limit. Above the limit it is a sample of the surface, which no
    /// bound can be below. `exact`: the corners are known to lie on the surface.
    pub(in crate::tessellate) fn facet(
        &mut self,
        uv: [Uv; 3],
        xyz: [Point; 3],
        exact: bool,
        limit: f64,
    ) -> Option<f64> {
        if self.sheet.affine || self.judge == Judge::Sampled {
            return None;
        }
        let at = if exact { xyz } else { uv.map(|x| self.sheet.point(x)) };
        let off = (0..3).map(|i| (at[i] - xyz[i]).length()).fold(0.0, f64::max) + self.margin;
        let (lo, hi) = (uv[0].min(uv[1]).min(uv[2]), uv[0].max(uv[1]).max(uv[2]));
        let (a, b) = (self.sheet.range(0, lo.x, hi.x), self.sheet.range(1, lo.y, hi.y));
        let fits = |x: &f64| x + off <= limit;
        let quick = self.sheet.bends.bound(a, b, hi - lo).filter(fits);
        if let Some(bound) = quick {
            return Some(bound + off);
        }
        let sheet = self.sheet;
        let count = (a[1] - a[0] + 1) * (b[1] - b[0] + 1);
        let patches = || (a[0]..=a[1]).flat_map(|i| (b[0]..=b[1]).map(move |j| sheet.patch(i, j)));
        if count == 1 || count <= MOST_NEAR && sheet.bends.is_smooth(a, b) {
            let near = self.near.bound(patches(), uv, at).filter(fits);
            if let Some(bound) = near {
                return Some(bound + off);
            }
        }
        // Proofs that must fail are the dearest.
        let places = if exact { &PROBES[3..] } else { &PROBES[..] };
        let probed = self.probed(&uv, &Flat::new(&xyz), limit, places);
        if probed > limit {
            return Some(probed);
        }
        if count > 1 {
            let hull = if count <= MOST_HULL { self.near.hull(patches(), uv, at, limit - off) } else { None };
            return hull.map(|x| x + off);
        }
        let patch = sheet.patch(a[0], b[0]);
        self.joint(patch, uv.map(|x| local(patch, x)), xyz, limit).map(|x| x + self.margin)
    }

    /// Bound of a triangle and its sides by the hull of one net, whose outer rows are the nets of the sides.
    fn joint(&mut self, patch: &BezierPatch, at: [Uv; 3], xyz: [Point; 3], limit: f64) -> Option<f64> {
        let small = self.smaller(patch, &at, limit);
        let (patch, at, off) = match &small {
            Some((x, off)) => (&self.slight.patch, [x[0], x[1], x[2]], *off),
            None => (patch, at, 0.0),
        };
        let limit = limit - off;
        let n = patch.degree[0] + patch.degree[1];
        let low = patch.degree.iter().all(|d| (1..=MOST_HALVED).contains(d));
        let (net, xyz) = match right_angle(&at).filter(|_| low) {
            Some((r, corner)) => {
                let turned = [0, 1, 2].map(|k| xyz[(k + r) % 3]);
                if small.is_some() {
                    (self.nets.half(&patch.points, patch.degree, corner), turned)
                } else {
                    // The look by second derivatives has left this net, seen from the first corner.
                    let (lo, hi) = (at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]));
                    let net = self.near.restrict(patch, lo, hi, xyz[0]);
                    (self.nets.half(net, patch.degree, corner), turned.map(|x| x - xyz[0]))
                }
            }
            None => (self.nets.expand(patch, at), xyz),
        };
        let flat = Flat::new(&xyz);
        let mut worst = self.scalar.bound::<3>(net.iter().map(|c| (flat.distance(c.project()), c.w)), n, limit)?;
        for k in 0..3 {
            let chord = [xyz[k], xyz[(k + 1) % 3]];
            // Places in the net's order of the coefficients along a side.
            let row = (0..=n).map(|m| match k {
                0 => m * (m + 1) / 2,
                1 => n * (n + 1) / 2 + m,
                _ => m * (m + 3) / 2,
            });
            let distances = row.map(|i| (from_chord(net[i].project(), &chord), net[i].w));
            worst = worst.max(self.scalar.bound::<2>(distances, n, limit)?);
        }
        Some(worst + off)
    }

    /// A cubic for a patch of higher degree over the box around some local parameters: these in the cubic's, and the bound of its difference.
    fn smaller<const N: usize>(&mut self, patch: &BezierPatch, at: &[Uv; N], limit: f64) -> Option<([Uv; N], f64)> {
        if !slight::is_high(patch) {
            return None;
        }
        let (lo, hi) = at.iter().fold((at[0], at[0]), |(l, h), &x| (l.min(x), h.max(x)));
        let origin = patch.homogeneous_point(at[0]).project();
        let off = self.slight.make(self.near.restrict(patch, lo, hi, origin), patch.degree, origin);
        let share = |x: Uv| Uv::from_array([0, 1].map(|d| within(x[d], lo[d], hi[d])));
        (off <= SLIGHT * limit).then(|| (at.map(share), off))
    }

    /// Bound of the distance from the curve over a parameter segment to the line of a chord.
    pub(in crate::tessellate) fn side(&mut self, uv: [Uv; 2], xyz: [Point; 2], limit: f64) -> f64 {
        if self.sheet.affine {
            return self.margin;
        }
        if self.judge == Judge::Sampled {
            let at = |k: i32| from_chord(self.sheet.point(uv[0].lerp(uv[1], k as f64 / 16.0)), &xyz);
            return (1..16).map(at).fold(0.0, f64::max);
        }
        if let Some(quick) = self.quick(&uv, limit, |p| from_chord(p, &xyz)) {
            return quick;
        }
        self.pieces(&uv, |this, a, b, polygon| {
            let patch = this.sheet.patch(a, b);
            if polygon.len() < 2 {
                return 0.0;
            }
            let ends = [local(patch, polygon[0]), local(patch, polygon[1])];
            this.hull(patch, ends, limit, 2 * LEVELS, &|p| from_chord(p, &xyz))
        }) + self.margin
    }

    /// Largest value of a convex distance over a simplex of a patch's local parameters; see [`refine`].
    fn hull<const N: usize>(
        &mut self,
        patch: &BezierPatch,
        at: [Uv; N],
        limit: f64,
        levels: u32,
        f: &impl Fn(Point) -> f64,
    ) -> f64 {
        if let Some((x, off)) = self.smaller(patch, &at, limit) {
            let bound =
                off + refine((&mut self.nets, &mut self.scalar), &self.slight.patch, x, limit - off, levels, f);
            // What the difference may have spoilt is tried on the patch itself.
            if bound <= limit || bound > limit + 4.0 * off {
                return bound;
            }
        }
        refine((&mut self.nets, &mut self.scalar), patch, at, limit, levels, f)
    }

    /// Bound of a convex distance over a convex piece of surface: the largest at its corners, which holds for all that is flat between
    /// them, and the deviation from that by second derivatives; `None` above the limit.
    fn quick(&self, uv: &[Uv], limit: f64, away: impl Fn(Point) -> f64) -> Option<f64> {
        let (lo, hi) = uv.iter().fold((uv[0], uv[0]), |(l, h), &x| (l.min(x), h.max(x)));
        let (a, b) = (self.sheet.range(0, lo.x, hi.x), self.sheet.range(1, lo.y, hi.y));
        let bound = self.sheet.bends.bound(a, b, hi - lo).filter(|&x| x <= limit)?;
        let off = uv.iter().map(|&x| away(self.sheet.point(x))).fold(0.0, f64::max);
        Some(bound + off + self.margin).filter(|&x| x <= limit)
    }

    /// Largest result over the knot rectangles that a segment or triangle meets.
    fn pieces(&mut self, uv: &[Uv], mut each: impl FnMut(&mut Self, usize, usize, &[Uv]) -> f64) -> f64 {
        let (lo, hi) = uv.iter().fold((uv[0], uv[0]), |(l, h), &x| (l.min(x), h.max(x)));
        let range = |d: usize, x: f64, y: f64| {
            let [a, b] = self.sheet.range(d, x, y);
            a..=b
        };
        let (ra, rb) = (range(0, lo.x, hi.x), range(1, lo.y, hi.y));
        if ra.clone().count() * rb.clone().count() > MOST_PIECES {
            return f64::INFINITY;
        }
        if ra.clone().count() == 1 && rb.clone().count() == 1 {
            return each(self, *ra.start(), *rb.start(), uv);
        }
        let mut worst = 0f64;
        for a in ra {
            for b in rb.clone() {
                let rectangle = self.sheet.patch(a, b).domain;
                let polygon = clip(uv, rectangle);
                if polygon.len() >= 2.max(uv.len().min(3)) {
                    worst = worst.max(each(self, a, b, &polygon));
                }
            }
        }
        worst
    }

    /// The largest sampled distance of a triangle's surface to it: what no bound can be below.
    fn sampled(&self, uv: [Uv; 3], flat: &Flat) -> f64 {
        let n = 9;
        let mut worst = 0f64;
        for i in 0..=n {
            for j in 0..=n - i {
                let (a, b) = (i as f64 / n as f64, j as f64 / n as f64);
                let at = uv[0] * a + uv[1] * b + uv[2] * (1.0 - a - b);
                worst = worst.max(flat.distance(self.sheet.point(at)));
            }
        }
        worst
    }
}

/// Whether a triangle is half of the rectangle around it: the corner before its right angle, and which half it is.
fn right_angle(at: &[Uv; 3]) -> Option<(usize, Corner)> {
    (0..3).find_map(|r| {
        let [a, b, c] = [0, 1, 2].map(|k| at[(k + r) % 3]);
        let d = if a.y == b.y && b.x == c.x {
            0
        } else if a.x == b.x && b.y == c.y {
            1
        } else {
            return None;
        };
        Some((r, Corner { direction: d, upper: [a[d] > b[d], b[1 - d] > c[1 - d]] }))
    })
}

/// Where in `[lo, hi]` a parameter lies, as a share.
fn within(x: f64, lo: f64, hi: f64) -> f64 {
    if hi > lo { ((x - lo) / (hi - lo)).clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::sweep;
    use crate::tessellate::settings::Field;

    #[test]
    fn a_strip_of_a_cylinder_has_its_closed_form_sag() {
        let s = sweep::cylinder(&Frame::IDENTITY, 10.0, [0.0, 3.0], [0.0, 40.0]);
        let sheet = Sheet::new(&s, false, Field::new([0.1; 2], [1.0, 10.0], Default::default(), 1.0));
        let [a, b] = [0.4, 0.9].map(|phi| crate::nurbs::conic::parameter_of_angle([0.0, 3.0], phi));
        let uv = [Uv::new(a, 0.0), Uv::new(b, 0.0), Uv::new(b, 40.0)];
        let xyz = uv.map(|x| s.evaluate(x));
        let sag = 10.0 * (1.0 - 0.25f64.cos());
        let mut prover = Prover::new(&sheet, Judge::Bound);
        let bound = prover.piece(uv, xyz, 1e-3 * sag);
        assert!(bound >= sag * 0.999 && bound < 1.02 * 8.0 * sag, "{bound} {sag}");
        let bound = prover.piece(uv, xyz, 1.03 * sag);
        assert!(bound >= sag && bound <= 1.03 * sag, "{bound} {sag}");
        let side = prover.side([uv[0], uv[1]], [xyz[0], xyz[1]], 1.03 * sag);
        assert!(side >= sag && side <= 1.03 * sag, "{side} {sag}");
    }
}

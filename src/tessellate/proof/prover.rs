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
//! Cells are proved as one quad where that holds (`flat_quad.rs`), which their diagonal then is no boundary of.
//! Both are tried by second derivatives first (`second_derivatives.rs`): the piece and its boundary are near the linear map onto the
//! triangle.
//!
//! No projected Jacobian enters: folds are covered too. Where corners do not lie on the surface (the file's own gap between edge and face)
//! the boundary curves are taken to begin and end with straight pieces from the corners to the surface, so that the bound is no less than
//! the longest of these. Rounding is covered by 1e-12 of the surface's size, or by ulps of its place where that is far.

use super::cubic_reduction::{self, CubicReduction};
use super::deviation::DeviationBounds;
use super::flat_triangle::{FlatTriangle, clip, distance_to_chord, is_rectangle};
use super::refine::{LEVELS, refine};
use super::scalar_bezier::ScalarBezier;
use super::scalar_patch::ScalarPatch;
use super::simplex_net::{MAX_HALVED, SimplexNets, right_angle};
use crate::math::{Point, Uv};
use crate::nurbs::BezierPatch;
use crate::tessellate::face_surface::{FaceSurface, patch_uv};
use crate::tessellate::settings::Acceptance;

/// Knot rectangles that one triangle may span and still be tried.
const MAX_PIECES: usize = 20_000;
/// Knot rectangles up to which second derivatives are looked at one by one.
const MAX_PATCHES_TAYLOR: usize = 16;
/// Knot rectangles up to which the hulls of a facet's deviation are looked at one by one.
const MAX_PATCHES_HULL: usize = 1000;
/// Share of the limit by which a cubic may differ from a patch of higher degree that it stands for.
const REDUCTION_SHARE: f64 = 0.02;
/// Where a triangle is looked at before it is proved, as barycentric coordinates: the middles of its sides, and its own.
const PROBES: [[f64; 3]; 4] = [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], MIDDLE];
const MIDDLE: [f64; 3] = [1.0 / 3.0; 3];

/// Bounds facets of one face, all in mm of its part.
pub(in crate::tessellate) struct Prover<'s, 'a> {
    pub(in crate::tessellate) surface: &'s FaceSurface<'a>,
    pub(super) acceptance: Acceptance,
    pub(super) nets: SimplexNets,
    pub(super) deviation: DeviationBounds,
    reduction: CubicReduction,
    pub(super) scalar: ScalarBezier,
    pub(super) patch_scalar: ScalarPatch,
    /// Covers rounding, mm.
    pub(super) margin: f64,
}

impl<'s, 'a> Prover<'s, 'a> {
    /// Makes a prover with buffers of its own; its steps count towards the surface's when it is dropped.
    pub(in crate::tessellate) fn new(surface: &'s FaceSurface<'a>, acceptance: Acceptance) -> Self {
        Self {
            surface,
            acceptance,
            nets: SimplexNets::default(),
            deviation: DeviationBounds::default(),
            reduction: CubicReduction::default(),
            scalar: ScalarBezier::default(),
            patch_scalar: ScalarPatch::default(),
            margin: surface.rounding,
        }
    }

    /// Returns a bound of the distance from the surface over a parameter triangle to a triangle in space.
    ///
    /// Stops refining as soon as the answer is at most `limit`, or clearly is not: above `limit` the value says only that nothing nearer
    /// was shown, and may be a sample. With [`Acceptance::Sampled`] it is an estimate where the surface is not affine.
    pub(in crate::tessellate) fn triangle_bound(&mut self, uv: [Uv; 3], xyz: [Point; 3], limit: f64) -> f64 {
        // A flat piece is as far off as its corners are, the distance being convex.
        if self.surface.affine {
            let off = [0, 1, 2].map(|i| FlatTriangle::new(&xyz).distance(self.surface.point(uv[i])));
            return off[0].max(off[1]).max(off[2]) + self.margin;
        }
        let flat = FlatTriangle::new(&xyz);
        // Samples are no proof, and a proof by second derivatives costs less than they do.
        if self.acceptance == Acceptance::Proved
            && let Some(quick) = self.taylor_bound(&uv, limit, |p| flat.distance(p))
        {
            return quick;
        }
        // One sample beyond the limit ends the search for a proof before it costs anything.
        let sampled = self.probe(&uv, &flat, limit, &PROBES);
        if sampled > limit {
            return sampled;
        }
        if self.acceptance == Acceptance::Sampled {
            return self.sampled_distance(uv, &flat).max(sampled);
        }
        self.triangle_hull_bound(uv, &flat, limit)
    }

    /// Returns the largest distance of the surface to `flat` at `places`, shares of the corners `uv`; stops at the first above the limit.
    fn probe(&self, uv: &[Uv; 3], flat: &FlatTriangle, limit: f64, places: &[[f64; 3]]) -> f64 {
        let mut most = 0f64;
        for [a, b, c] in places {
            most = most.max(flat.distance(self.surface.point(uv[0] * *a + uv[1] * *b + uv[2] * *c)));
            if most > limit {
                break;
            }
        }
        most
    }

    /// Returns a bound as of [`Self::triangle_bound`], by hulls of control points; above `limit` it proves nothing.
    fn triangle_hull_bound(&mut self, uv: [Uv; 3], flat: &FlatTriangle, limit: f64) -> f64 {
        self.max_over_patches(&uv, |this, a, b, polygon| {
            let patch = this.surface.patch(a, b);
            let mut worst = 0f64;
            // Over a whole patch its own net is a hull, without any cutting. It is the coarsest; where it will do, the triangle's own
            // is spared.
            if is_rectangle(polygon, patch.domain) {
                let hull = patch.points.iter().map(|p| flat.distance(p.project())).fold(0.0, f64::max);
                if hull <= limit {
                    return hull;
                }
            }
            for k in 1..polygon.len() - 1 {
                let tri = [polygon[0], polygon[k], polygon[k + 1]].map(|x| patch_uv(patch, x));
                worst = worst.max(this.convex_bound(patch, tri, limit, LEVELS, &|p| flat.distance(p)));
                if worst > limit {
                    break;
                }
            }
            worst
        }) + self.margin
    }

    /// Returns a bound as of [`Self::triangle_bound`] of the distance from the surface over a convex parameter polygon, of three corners
    /// at least, to a triangle.
    pub(in crate::tessellate) fn polygon_bound(&mut self, uv: &[Uv], xyz: [Point; 3], limit: f64) -> f64 {
        debug_assert!(uv.len() > 2, "a polygon of fewer corners would count as proved");
        // As for a triangle: one look at the whole polygon before it is cut into triangles.
        let flat = FlatTriangle::new(&xyz);
        let bounded = !self.surface.affine && self.acceptance == Acceptance::Proved;
        if bounded && let Some(quick) = self.taylor_bound(uv, limit, |p| flat.distance(p)) {
            return quick;
        }
        let mut worst = 0f64;
        for k in 1..uv.len().saturating_sub(1) {
            let triangle = [uv[0], uv[k], uv[k + 1]];
            // Nearly all of these slivers hold: samples would seldom spare the proof.
            let one = if bounded {
                self.triangle_hull_bound(triangle, &flat, limit)
            } else {
                self.triangle_bound(triangle, xyz, limit)
            };
            worst = worst.max(one);
            if worst > limit {
                break;
            }
        }
        worst
    }

    /// Returns a bound of the distance from the surface over a parameter triangle to a triangle in space and from its sides to theirs, by
    /// one quick look; `None` when that does not show it to be within the limit. Above the limit it is what no bound can be below: a sample
    /// of the surface, or the gap of a corner. `exact`: the corners are known to lie on the surface. It is always `None` on an affine
    /// surface and with [`Acceptance::Sampled`], where [`Self::triangle_bound`] is to be used.
    pub(in crate::tessellate) fn facet_bound(
        &mut self,
        uv: [Uv; 3],
        xyz: [Point; 3],
        exact: bool,
        limit: f64,
    ) -> Option<f64> {
        if self.surface.affine || self.acceptance == Acceptance::Sampled {
            return None;
        }
        // Corners that are the border's points may be off the surface: the difference is added in the end.
        let at = if exact { xyz } else { uv.map(|x| self.surface.point(x)) };
        let gap = (0..3).map(|i| (at[i] - xyz[i]).length()).fold(0.0, f64::max) + self.margin;
        let (lo, hi) = uv_bounds(&uv);
        let (a, b) = (self.surface.range(0, lo.x, hi.x), self.surface.range(1, lo.y, hi.y));
        let fits = |x: &f64| x + gap <= limit;
        let quick = self.surface.curving.linear_deviation(a, b, hi - lo).filter(fits);
        // From cheap to dear: second derivatives of whole regions, of the patches under the facet, samples, and nets at last.
        if let Some(bound) = quick {
            return Some(bound + gap);
        }
        let surface = self.surface;
        let count = (a[1] - a[0] + 1) * (b[1] - b[0] + 1);
        let patches = || (a[0]..=a[1]).flat_map(|i| (b[0]..=b[1]).map(move |j| surface.patch(i, j)));
        // Taylor's theorem needs continuous first derivatives from patch to patch; on one patch there is no seam.
        if count == 1 || count <= MAX_PATCHES_TAYLOR && surface.curving.is_smooth(a, b) {
            let taylor = self.deviation.taylor_bound(patches(), uv, at).filter(fits);
            if let Some(bound) = taylor {
                return Some(bound + gap);
            }
        }
        // Proofs that must fail are the dearest.
        let places: &[_] = if exact { &[MIDDLE] } else { &PROBES };
        let probed = self.probe(&uv, &FlatTriangle::new(&xyz), limit, places);
        if probed > limit {
            return Some(probed);
        }
        // Of several patches the deviation's hull is taken, which needs no smoothness between them.
        if count > 1 {
            let hull = if count <= MAX_PATCHES_HULL {
                self.deviation.hull_bound(patches(), uv, at, limit - gap)
            } else {
                None
            };
            return hull.map(|x| x + gap);
        }
        let patch = surface.patch(a[0], b[0]);
        // The net is measured from the corners' own places, but for what moved them along the facet.
        let net = self.net_bound(patch, uv.map(|x| patch_uv(patch, x)), xyz, limit);
        net.map(|x| gap.max(x + self.margin))
    }

    /// Returns a bound of a triangle and its sides by the hull of one net, whose outer rows are those of the sides; `None` above the limit.
    fn net_bound(&mut self, patch: &BezierPatch, at: [Uv; 3], xyz: [Point; 3], limit: f64) -> Option<f64> {
        let small = self.reduce(patch, &at, limit);
        let (patch, at, reduction_error) = match &small {
            Some((x, error)) => (&self.reduction.patch, [x[0], x[1], x[2]], *error),
            None => (patch, at, 0.0),
        };
        let limit = limit - reduction_error;
        let n = patch.degree[0] + patch.degree[1];
        let low = patch.degree.iter().all(|d| (1..=MAX_HALVED).contains(d));
        // Half of a rectangle, as most facets are, has coefficients with fixed weights; any other triangle is expanded.
        let (net, xyz) = match right_angle(&at).filter(|_| low) {
            Some((r, corner)) => {
                // Turned so that the right angle comes second, as the table has it.
                let turned = [0, 1, 2].map(|k| xyz[(k + r) % 3]);
                if small.is_some() {
                    (self.nets.half_of_rectangle(&patch.points, patch.degree, corner), turned)
                } else {
                    // The look by second derivatives mostly left this net, seen from the first corner, in the memory of `restrict`.
                    let (lo, hi) = uv_bounds(&at);
                    let net = self.deviation.restrict(patch, lo, hi, xyz[0]);
                    (self.nets.half_of_rectangle(net, patch.degree, corner), turned.map(|x| x - xyz[0]))
                }
            }
            None => (self.nets.expand(patch, at), xyz),
        };
        let flat = FlatTriangle::new(&xyz);
        let mut worst = self.scalar.bound::<3>(net.iter().map(|c| (flat.distance(c.project()), c.w)), n, limit)?;
        for k in 0..3 {
            let chord = [xyz[k], xyz[(k + 1) % 3]];
            // Places of the coefficients along a side. They stand in rows of a triangle, row m from m(m+1)/2 on: its sides are the
            // first and the last of each row, and the last row.
            let row = (0..=n).map(|m| match k {
                0 => m * (m + 1) / 2,
                1 => n * (n + 1) / 2 + m,
                _ => m * (m + 3) / 2,
            });
            let distances = row.map(|i| (distance_to_chord(net[i].project(), &chord), net[i].w));
            worst = worst.max(self.scalar.bound::<2>(distances, n, limit)?);
        }
        Some(worst + reduction_error)
    }

    /// Makes `self.reduction` the cubic for a patch of higher degree over the box around `at`. Returns `at` in the cubic's parameters and a
    /// bound of the difference; `None` where the degree is low already or the difference too large.
    fn reduce<const N: usize>(&mut self, patch: &BezierPatch, at: &[Uv; N], limit: f64) -> Option<([Uv; N], f64)> {
        if !cubic_reduction::is_high(patch) {
            return None;
        }
        let (lo, hi) = uv_bounds(at);
        let origin = patch.homogeneous_point(at[0]).project();
        let error = self.reduction.reduce(self.deviation.restrict(patch, lo, hi, origin), patch.degree, origin);
        let share = |x: Uv| Uv::from_array([0, 1].map(|d| share_of_interval(x[d], lo[d], hi[d])));
        (error <= REDUCTION_SHARE * limit).then(|| (at.map(share), error))
    }

    /// Returns a bound, mm, of the distance from the curve over a parameter segment to the chord `xyz`, and of its ends from those of the
    /// chord; above `limit` none is known.
    pub(in crate::tessellate) fn side_bound(&mut self, uv: [Uv; 2], xyz: [Point; 2], limit: f64) -> f64 {
        // A corner that the file's gap has moved off the piece is that far from it, in whatever direction: along the side the chord itself
        // would not show it.
        let moved = [0, 1].map(|i| (self.surface.point(uv[i]) - xyz[i]).length());
        let gap = moved[0].max(moved[1]) + self.margin;
        if self.surface.affine || gap > limit {
            return gap;
        }
        gap.max(self.curve_bound(uv, xyz, limit))
    }

    /// Returns a bound, mm, of the distance from the curve over a parameter segment to the chord `xyz`; above `limit` none is known.
    fn curve_bound(&mut self, uv: [Uv; 2], xyz: [Point; 2], limit: f64) -> f64 {
        if self.acceptance == Acceptance::Sampled {
            // Sixteen chords of the curve, as the estimate of a mode that does not prove.
            let at = |k: i32| distance_to_chord(self.surface.point(uv[0].lerp(uv[1], k as f64 / 16.0)), &xyz);
            return (1..16).map(at).fold(0.0, f64::max);
        }
        if let Some(quick) = self.taylor_bound(&uv, limit, |p| distance_to_chord(p, &xyz)) {
            return quick;
        }
        self.max_over_patches(&uv, |this, a, b, polygon| {
            let patch = this.surface.patch(a, b);
            let ends = [patch_uv(patch, polygon[0]), patch_uv(patch, polygon[1])];
            this.convex_bound(patch, ends, limit, 2 * LEVELS, &|p| distance_to_chord(p, &xyz))
        }) + self.margin
    }

    /// Returns a bound of a convex distance `f` over a simplex of a patch's local parameters, cut up to `levels` times; see [`refine`].
    fn convex_bound<const N: usize>(
        &mut self,
        patch: &BezierPatch,
        at: [Uv; N],
        limit: f64,
        levels: u32,
        f: &impl Fn(Point) -> f64,
    ) -> f64 {
        // A patch of high degree first as a cubic: the net of degree p + q costs its fourth power.
        if let Some((x, error)) = self.reduce(patch, &at, limit) {
            let bound = error
                + refine((&mut self.nets, &mut self.scalar), &self.reduction.patch, x, limit - error, levels, f);
            // What the difference may have spoilt is tried on the patch itself.
            if bound <= limit || bound > limit + 4.0 * error {
                return bound;
            }
        }
        refine((&mut self.nets, &mut self.scalar), patch, at, limit, levels, f)
    }

    /// Returns a bound of a convex distance `away` over the piece of surface above a convex polygon or segment of parameters: the largest
    /// at its corners, which holds for all that is flat between them, and the deviation from that by second derivatives; `None` above the
    /// limit.
    fn taylor_bound(&self, uv: &[Uv], limit: f64, away: impl Fn(Point) -> f64) -> Option<f64> {
        let (lo, hi) = uv_bounds(uv);
        let (a, b) = (self.surface.range(0, lo.x, hi.x), self.surface.range(1, lo.y, hi.y));
        // The limit is computed before the corners are evaluated, which costs more.
        let bound = self.surface.curving.linear_deviation(a, b, hi - lo).filter(|&x| x <= limit)?;
        let at_corners = uv.iter().map(|&x| away(self.surface.point(x))).fold(0.0, f64::max);
        Some(bound + at_corners + self.margin).filter(|&x| x <= limit)
    }

    /// Returns the largest result over the knot rectangles that a segment or polygon meets, clipped to each; infinite for more than
    /// [`MAX_PIECES`]: a face of noise, of which nothing is proved.
    fn max_over_patches(&mut self, uv: &[Uv], mut each: impl FnMut(&mut Self, usize, usize, &[Uv]) -> f64) -> f64 {
        let (lo, hi) = uv_bounds(uv);
        let range = |d: usize, x: f64, y: f64| {
            let [a, b] = self.surface.range(d, x, y);
            a..=b
        };
        let (ra, rb) = (range(0, lo.x, hi.x), range(1, lo.y, hi.y));
        if ra.clone().count() * rb.clone().count() > MAX_PIECES {
            return f64::INFINITY;
        }
        if ra.clone().count() == 1 && rb.clone().count() == 1 {
            return each(self, *ra.start(), *rb.start(), uv);
        }
        let mut worst = 0f64;
        for a in ra {
            for b in rb.clone() {
                let rectangle = self.surface.patch(a, b).domain;
                let polygon = clip(uv, rectangle);
                // A polygon that only touches the rectangle, at a side or corner, is its neighbour's.
                if polygon.len() >= 2.max(uv.len().min(3)) {
                    worst = worst.max(each(self, a, b, &polygon));
                }
            }
        }
        worst
    }

    /// Returns the largest distance to `flat` among 55 samples of the surface over a parameter triangle: what no bound can be below.
    fn sampled_distance(&self, uv: [Uv; 3], flat: &FlatTriangle) -> f64 {
        let n = 9;
        let mut worst = 0f64;
        for i in 0..=n {
            for j in 0..=n - i {
                let (a, b) = (i as f64 / n as f64, j as f64 / n as f64);
                let at = uv[0] * a + uv[1] * b + uv[2] * (1.0 - a - b);
                worst = worst.max(flat.distance(self.surface.point(at)));
            }
        }
        worst
    }
}

/// Returns where in `[lo, hi]` a parameter lies, as a share clamped to 0 to 1; 0 for an interval without length.
fn share_of_interval(x: f64, lo: f64, hi: f64) -> f64 {
    if hi > lo { ((x - lo) / (hi - lo)).clamp(0.0, 1.0) } else { 0.0 }
}

/// Corners of the box around parameters, of which there is at least one.
fn uv_bounds(uv: &[Uv]) -> (Uv, Uv) {
    uv.iter().fold((uv[0], uv[0]), |(lo, hi), &x| (lo.min(x), hi.max(x)))
}

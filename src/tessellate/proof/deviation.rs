//! The proof that most facets pass: how far a Bézier patch strays from the flat triangle between three of its points.
//!
//! Over a parameter triangle let L be the linear map onto the triangle in space, and A and W the patch's homogeneous position and
//! weight. N = A − W·L vanishes at the corners, so Taylor's theorem as in `second_derivatives.rs` gives |N| ≤ (Muu + 2 Muv + Mvv)/8, with
//! bounds of its second derivatives over the rectangle around the triangle, in that rectangle's own parameters. The distance |S − L| =
//! |N|/W follows, for the inside and the three sides alike, as L lies on the triangle and on its sides. Subtracting W·L before norms are
//! taken is what keeps the bound sharp on rational patches: to first order it is |S″|, tangential part included. Where second derivatives
//! vary or jump, the control points of N itself are looked at. Where the tangential part matters, the hull of `simplex_net.rs` decides.

use super::linear_map::LinearMap;
use super::refine::halve_net;
use crate::math::{Homogeneous, Point, Uv};
use crate::nurbs::BezierPatch;
use crate::tessellate::face_surface::{FaceSurface, patch_uv};
use smallvec::{SmallVec, smallvec};

/// Triangles that reach into a patch by less than this share are left to others.
const NARROWEST: f64 = 1e-3;
/// Share by which weights may differ and still be all the same: a thousand roundings, whose effect the margin of `prover.rs` covers.
const EQUAL_WEIGHTS: f64 = 1e-13;
/// Halvings that one facet may take.
const MAX_HALVINGS: u32 = 24;

/// Buffers reused from facet to facet.
#[derive(Default)]
pub(in crate::tessellate) struct DeviationBounds {
    net: Vec<Homogeneous>,
    deviation: Vec<Point>,
    /// Nets that wait for halving, one after another.
    stack: Vec<Point>,
    /// What `net` holds: which patch (by address), over which rectangle, seen from where.
    cached: Option<(usize, Uv, Uv, Point)>,
    /// Bounds of its second derivatives where they are known.
    seconds: Option<[f64; 3]>,
}

impl DeviationBounds {
    /// Returns a bound of |S − L|, mm, over the triangle `corners` of the surface's parameters, which lies at `at` in space. The patches
    /// cover it and are C1 from one to the next. `None` for a thin triangle, or one that touches a patch in a sliver.
    pub(in crate::tessellate) fn taylor_bound<'p>(
        &mut self,
        patches: impl Iterator<Item = &'p BezierPatch>,
        corners: [Uv; 3],
        at: [Point; 3],
    ) -> Option<f64> {
        let linear = LinearMap::new(corners, at)?;
        let (mut most, mut lightest) = ([0f64; 3], f64::INFINITY);
        for patch in patches {
            let [a, b] = linear.overlap(patch);
            let [from, share] = linear.as_shares([a, b]);
            // Differences over a sliver are divided by its square: rounding would be all that is left.
            if share.min_element() < NARROWEST || share.is_nan() {
                return None;
            }
            self.restrict(patch, patch_uv(patch, a), patch_uv(patch, b), at[0]);
            let [w_min, w_max] = self.weight_range();
            // The lightest weight anywhere bounds the division for all patches.
            lightest = lightest.min(w_min);
            let [p, q] = patch.degree;
            let second = if are_equal([w_min, w_max]) {
                // L has no second derivatives: both triangles of a cell have the same.
                match self.seconds {
                    Some(known) => known,
                    None => {
                        self.deviation.clear();
                        self.deviation.extend(self.net.iter().map(|c| c.truncate()));
                        *self.seconds.insert(second_derivative_bounds(&self.deviation, [p, q]))
                    }
                }
            } else {
                self.subtract_raising_degree([p, q], linear.corner_values(from, share));
                second_derivative_bounds(&self.deviation, [p + 1, q + 1])
            };
            // From the parameters of the patch's part to those of the whole rectangle, in which the parts are
            // compared.
            let scale = [share.x * share.x, share.x * share.y, share.y * share.y];
            most = std::array::from_fn(|k| most[k].max(second[k] / scale[k]));
        }
        Some((most[0] + 2.0 * most[1] + most[2]) / (8.0 * lightest))
    }

    /// Returns a bound of |S − L|, mm, where it is within `limit`, by control points of S − L over rectangles halved as needed; patches
    /// need not be smooth from one to the next. `None` for a thin triangle and after [`MAX_HALVINGS`]. One facet of a spline through
    /// hundreds of points is proved in microseconds where the hulls of its pieces took a millisecond.
    pub(in crate::tessellate) fn hull_bound<'p>(
        &mut self,
        patches: impl Iterator<Item = &'p BezierPatch>,
        corners: [Uv; 3],
        at: [Point; 3],
        limit: f64,
    ) -> Option<f64> {
        self.max_over_patches(patches, &LinearMap::new(corners, at)?, at[0], limit)
    }

    /// Returns a bound of the distance, mm, from the surface over a convex polygon to a chord that the polygon holds; `None` where it is
    /// above `limit` or the chord has no length. The chord's ends, at `chord` in parameters, lie at `at` in space.
    pub(in crate::tessellate) fn chord_bound(
        &mut self,
        surface: &FaceSurface<'_>,
        polygon: &[Uv],
        chord: [Uv; 2],
        at: [Point; 2],
        limit: f64,
    ) -> Option<f64> {
        let linear = LinearMap::along_chord(surface, polygon, chord, at)?;
        let (a, b) = (surface.range(0, linear.lo.x, linear.hi.x), surface.range(1, linear.lo.y, linear.hi.y));
        let patches = (a[0]..=a[1]).flat_map(|i| (b[0]..=b[1]).map(move |j| surface.patch(i, j)));
        self.max_over_patches(patches, &linear, at[0], limit)
    }

    /// Returns a bound, mm, of what `linear` measures over all patches, seen from `origin`; `None` where none within `limit` is found.
    fn max_over_patches<'p>(
        &mut self,
        patches: impl Iterator<Item = &'p BezierPatch>,
        linear: &LinearMap,
        origin: Point,
        limit: f64,
    ) -> Option<f64> {
        let (mut worst, mut halvings) = (0f64, MAX_HALVINGS);
        for patch in patches {
            let [a, b] = linear.overlap(patch);
            let [from, share] = linear.as_shares([a, b]);
            // Its rectangle may meet the patch where the region does not.
            if !linear.meets_region(from, share) {
                continue;
            }
            self.restrict(patch, patch_uv(patch, a), patch_uv(patch, b), origin);
            let weights = self.weight_range();
            let mut degree = patch.degree;
            // Equal weights leave A − W·L of the patch's own degree, a smaller net.
            if are_equal(weights) {
                self.subtract_keeping_degree(degree, linear.corner_values(from, share));
            } else {
                self.subtract_raising_degree(degree, linear.corner_values(from, share));
                degree = degree.map(|d| d + 1);
            }
            worst = worst.max(self.bound_by_halving(
                linear,
                degree,
                (from, share),
                [weights[0], limit],
                &mut halvings,
            )?);
        }
        Some(worst)
    }

    /// Bound over the parts of a rectangle that meet the region, halved until all are within the limit; `None` without `halvings` left.
    fn bound_by_halving(
        &mut self,
        linear: &LinearMap,
        [p, q]: [usize; 2],
        (from, share): (Uv, Uv),
        [lightest, limit]: [f64; 2],
        halvings: &mut u32,
    ) -> Option<f64> {
        let size = self.deviation.len();
        self.stack.clear();
        self.stack.extend_from_slice(&self.deviation);
        let mut open: SmallVec<[(Uv, Uv); 16]> = smallvec![(from, share)];
        let mut most = 0f64;
        while let Some((from, share)) = open.pop() {
            let start = self.stack.len() - size;
            let net = &self.stack[start..];
            let worst = linear.bound(net, lightest);
            // Parts outside the region bound nothing of interest.
            if worst <= limit || !linear.meets_region(from, share) {
                most = if worst <= limit { most.max(worst) } else { most };
                self.stack.truncate(start);
                continue;
            }
            // The budget of the whole facet, not of a part: one hard corner may use it all.
            *halvings = halvings.checked_sub(1)?;
            // Across the direction in which the net bends more, halving brings the hull closer.
            let [along_u, _, along_v] = second_derivative_bounds(net, [p, q]);
            let d = if along_u >= along_v { 0 } else { 1 };
            self.stack.extend_from_within(start..);
            let (low, high) = self.stack[start..].split_at_mut(size);
            halve_net(low, high, [p, q], d);
            let (mut half, mut second) = (share, from);
            half[d] *= 0.5;
            second[d] += half[d];
            open.extend([(from, half), (second, half)]);
        }
        Some(most)
    }

    /// Smallest and largest weight of the net.
    fn weight_range(&self) -> [f64; 2] {
        self.net.iter().fold([f64::INFINITY, 0.0], |[a, b], c| [a.min(c.w), b.max(c.w)])
    }

    /// The patch's net over a rectangle of its local parameters, relative to `origin`. It is kept: both triangles of a cell have the same.
    ///
    /// The patches handed in must live as long as this does.
    pub(in crate::tessellate) fn restrict(
        &mut self,
        patch: &BezierPatch,
        lo: Uv,
        hi: Uv,
        origin: Point,
    ) -> &[Homogeneous] {
        let [p, q] = patch.degree;
        let name = Some((std::ptr::from_ref(patch).addr(), lo, hi, origin));
        if self.cached == name {
            return &self.net;
        }
        self.cached = name;
        self.seconds = None;
        self.net.clear();
        // Seen from the facet, so that its size and not its place decides what is rounded.
        self.net.extend(patch.points.iter().map(|c| (c.truncate() - origin * c.w).extend(c.w)));
        (0..=p).for_each(|i| restrict_line(&mut self.net, [i * (q + 1), 1, q], lo.y, hi.y));
        (0..=q).for_each(|j| restrict_line(&mut self.net, [j, q + 1, p], lo.x, hi.x));
        &self.net
    }

    /// As [`Self::subtract_raising_degree`], in the patch's own degree; all weights must be equal, and L affine: `l[3]` is not read.
    fn subtract_keeping_degree(&mut self, [p, q]: [usize; 2], l: [Point; 4]) {
        let (s, t) = ((l[1] - l[0]) / p as f64, (l[2] - l[0]) / q as f64);
        self.deviation.clear();
        let with_place = self.net.iter().enumerate();
        self.deviation.extend(with_place.map(|(k, c)| {
            let (i, j) = (k / (q + 1), k % (q + 1));
            c.truncate() - (l[0] + s * i as f64 + t * j as f64) * c.w
        }));
    }

    /// Sets `deviation` to A − W·L in Bernstein form, one degree higher; `l` are L's values at the corners (0,0), (1,0), (0,1), (1,1).
    fn subtract_raising_degree(&mut self, [p, q]: [usize; 2], l: [Point; 4]) {
        self.deviation.clear();
        self.deviation.resize((p + 2) * (q + 2), Point::ZERO);
        let (pi, qi) = (1.0 / (p + 1) as f64, 1.0 / (q + 1) as f64);
        // As a bilinear net L raises W by one degree in each direction; A is raised alongside.
        for i in 0..=p {
            let (before, after) = ((p + 1 - i) as f64 * pi, (i + 1) as f64 * pi);
            for j in 0..=q {
                let c = self.net[i * (q + 1) + j];
                let (low, high) = ((q + 1 - j) as f64 * qi, (j + 1) as f64 * qi);
                let a = c.truncate();
                let at = i * (q + 2) + j;
                self.deviation[at] += (a - l[0] * c.w) * (before * low);
                self.deviation[at + 1] += (a - l[2] * c.w) * (before * high);
                self.deviation[at + q + 2] += (a - l[1] * c.w) * (after * low);
                self.deviation[at + q + 3] += (a - l[3] * c.w) * (after * high);
            }
        }
    }
}

/// Whether the least and largest weight are the same but for rounding.
fn are_equal([least, most]: [f64; 2]) -> bool {
    most - least <= EQUAL_WEIGHTS * most
}

/// Replaces the `n + 1` control points of a net's line, every `step`-th from `start`, by those over `[lo, hi]`, 0 ≤ lo < hi ≤ 1.
fn restrict_line(net: &mut [Homogeneous], [start, step, n]: [usize; 3], lo: f64, hi: f64) {
    match n {
        1 => restrict_line_of_degree(net, [start, step, 1], lo, hi),
        2 => restrict_line_of_degree(net, [start, step, 2], lo, hi),
        3 => restrict_line_of_degree(net, [start, step, 3], lo, hi),
        _ => restrict_line_of_degree(net, [start, step, n], lo, hi),
    }
}

/// As [`restrict_line`], without loops where `n` is known: the left part of a cut at `hi` first.
#[inline(always)]
fn restrict_line_of_degree(net: &mut [Homogeneous], [start, step, n]: [usize; 3], lo: f64, hi: f64) {
    let line = &mut net[start..=start + n * step];
    if hi < 1.0 {
        for round in 1..=n {
            for k in (round..=n).rev() {
                line[k * step] = line[(k - 1) * step] * (1.0 - hi) + line[k * step] * hi;
            }
        }
    }
    if lo > 0.0 {
        // Right part of a cut at `lo`, seen from the part before `hi`.
        let t = if hi < 1.0 { lo / hi } else { lo };
        for round in 1..=n {
            for k in 0..=n - round {
                line[k * step] = line[k * step] * (1.0 - t) + line[(k + 1) * step] * t;
            }
        }
    }
}

/// Returns the bounds of the second derivatives (uu, uv, vv) over the unit square of a net of these degrees.
fn second_derivative_bounds(net: &[Point], [p, q]: [usize; 2]) -> [f64; 3] {
    let n = q + 1;
    let mut most = [0f64; 3];
    for i in 0..=p {
        for j in 0..=q {
            let at = i * n + j;
            let x = net[at];
            if i + 2 <= p {
                most[0] = most[0].max((net[at + 2 * n] - net[at + n] * 2.0 + x).length_squared());
            }
            if j + 2 <= q {
                most[2] = most[2].max((net[at + 2] - net[at + 1] * 2.0 + x).length_squared());
            }
            if i < p && j < q {
                most[1] = most[1].max((net[at + n + 1] - net[at + n] - net[at + 1] + x).length_squared());
            }
        }
    }
    // The second derivatives are polynomials whose control points are these differences times p(p − 1), pq and q(q − 1): none is longer
    // than the longest of them.
    let (p, q) = (p as f64, q as f64);
    [most[0].sqrt() * p * (p - 1.0), most[1].sqrt() * p * q, most[2].sqrt() * q * (q - 1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::{Surface, sweep};

    /// Largest deviation from the linear map over a triangle at places of a lattice with `n` steps a side.
    fn sampled(s: &Surface, corners: [Uv; 3], n: usize) -> f64 {
        let at = corners.map(|x| s.evaluate(x));
        let places = (0..=n).flat_map(|i| (0..=n - i).map(move |j| [i, j].map(|k| k as f64 / n as f64)));
        let off = |[a, b]: [f64; 2]| {
            let c = 1.0 - a - b;
            let x = corners[0] * a + corners[1] * b + corners[2] * c;
            (s.evaluate(x) - (at[0] * a + at[1] * b + at[2] * c)).length()
        };
        places.map(off).fold(0.0, f64::max)
    }

    /// Bound and largest sampled deviation of a triangle.
    fn both(s: &Surface, corners: [Uv; 3]) -> (f64, f64) {
        let at = corners.map(|x| s.evaluate(x));
        let patches = s.bezier_patches();
        let lo = corners[0].min(corners[1]).min(corners[2]);
        let hi = corners[0].max(corners[1]).max(corners[2]);
        let meets = |p: &&BezierPatch| {
            let [[u0, u1], [v0, v1]] = p.domain;
            u0 < hi.x && lo.x < u1 && v0 < hi.y && lo.y < v1
        };
        let bound = DeviationBounds::default().taylor_bound(patches.iter().filter(meets), corners, at).unwrap();
        (bound, sampled(s, corners, 20))
    }

    #[test]
    fn the_bound_holds_and_is_sharp_on_rational_patches() {
        let s = sweep::torus(&Frame::IDENTITY, 40.0, 12.0, [0.0, 1.3], [0.2, 1.7]);
        for k in 0..40 {
            let lo = Uv::new(0.1 * (k % 8) as f64, 0.2 + 0.15 * (k / 8) as f64);
            let (bound, worst) = both(&s, [lo, lo + Uv::new(0.25, 0.0), lo + Uv::new(0.25, 0.3)]);
            assert!(worst <= bound && bound < 2.5 * worst, "{worst} {bound}");
        }
    }

    #[test]
    fn the_bound_holds_across_smooth_knots() {
        // A shallow bowl with uneven knots and weights, C1 and no more across half of its knots.
        let knots = vec![0.0, 0.0, 0.0, 0.4, 1.0, 1.3, 2.0, 2.0, 2.0];
        let points = (0..36)
            .map(|k| {
                let (x, y) = ((k / 6) as f64, (k % 6) as f64);
                let w = 1.0 + 0.2 * ((3 * k) % 5) as f64;
                let z = 0.2 * (x - 2.5) * (x - 2.5) + 0.1 * y * y + 0.05 * (x * y).sin();
                (Point::new(x, y, z) * w).extend(w)
            })
            .collect();
        let s = Surface { degree: [2, 2], knots: [knots.clone(), knots], points };
        for k in 0..25 {
            let lo = Uv::new(0.05 + 0.2 * (k % 5) as f64, 0.05 + 0.2 * (k / 5) as f64);
            let (bound, worst) = both(&s, [lo, lo + Uv::new(1.0, 0.0), lo + Uv::new(0.3, 1.0)]);
            assert!(worst <= bound, "{worst} {bound}");
        }
    }

    #[test]
    fn hulls_hold_across_creases_and_come_near() {
        // Folded at the knots of degree one in v: no second derivatives there.
        let folds = [0.0, 0.03, -0.02, 0.05, 0.0];
        let points = (0..15)
            .map(|k| {
                let (i, j) = (k / 5, k % 5);
                let w = 1.0 + 0.1 * (i * j % 3) as f64;
                (Point::new(i as f64, j as f64, folds[j] + 0.02 * ((i * i) as f64)) * w).extend(w)
            })
            .collect();
        let knots = [vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 4.0]];
        let s = Surface { degree: [2, 1], knots, points };
        let patches = s.bezier_patches();
        for corners in [
            [Uv::new(0.1, 0.2), Uv::new(0.9, 0.2), Uv::new(0.9, 3.7)],
            [Uv::new(0.1, 3.9), Uv::new(0.2, 0.1), Uv::new(0.8, 2.2)],
        ] {
            let at = corners.map(|x| s.evaluate(x));
            let worst = sampled(&s, corners, 60);
            assert!(DeviationBounds::default().hull_bound(patches.iter(), corners, at, 0.99 * worst).is_none());
            let bound = DeviationBounds::default().hull_bound(patches.iter(), corners, at, 2.0 * worst).unwrap();
            assert!(worst <= bound && bound <= 2.0 * worst, "{worst} {bound}");
        }
    }
}

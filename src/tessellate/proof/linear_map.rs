//! The linear map from parameters into space that the deviation of a facet, or of the sliver beside its chord, is measured from.
//!
//! Beside a chord, S = L + D with L in a plane through it and D = D⊥ + D∥: a point of the sliver is at most
//! √(|D⊥|² + (reach + |D∥|)²) from the chord.

use super::flat_triangle::distance_to_chord;
use crate::math::{Point, Uv, Vector};
use crate::nurbs::BezierPatch;
use crate::tessellate::face_surface::FaceSurface;
use smallvec::SmallVec;

/// Triangles with a smaller share of the rectangle around them are left to others: their L is steep.
const THINNEST: f64 = 0.05;
/// Share of the rectangle by which a part may miss the region and still be taken to meet it: rounding.
const TOUCHING: f64 = 1e-12;

/// The measured part of the deviation from L.
enum Measure {
    /// All of it.
    Whole,
    /// The distance to a chord in L's plane, from which L goes no farther than `reach` over the region.
    Sliver { normal: Vector, reach: f64 },
}

/// A linear map L from parameters into space, and a convex region of parameters within a rectangle.
pub(in crate::tessellate) struct LinearMap {
    /// The rectangle around the region.
    pub(in crate::tessellate) lo: Uv,
    pub(in crate::tessellate) hi: Uv,
    /// Corners of the region, as shares of the rectangle.
    region: SmallVec<[Uv; 8]>,
    /// L at the rectangle's first corner, and along it, seen from a place that L meets.
    values: [Point; 3],
    /// Which way the corners run.
    sign: f64,
    measure: Measure,
}

impl LinearMap {
    /// Returns the map of a parameter triangle onto one in space, positions relative to its first corner; `None` where it is thin.
    pub(in crate::tessellate) fn new(corners: [Uv; 3], at: [Point; 3]) -> Option<Self> {
        let lo = corners[0].min(corners[1]).min(corners[2]);
        let hi = corners[0].max(corners[1]).max(corners[2]);
        let x = corners.map(|c| (c - lo) / (hi - lo));
        let (d1, d2) = (x[1] - x[0], x[2] - x[0]);
        let det = d1.perp_dot(d2);
        // A thin triangle makes L run far outside of it, where the surface does not follow.
        if det.abs() < THINNEST || det.is_nan() {
            return None;
        }
        // L(x, y) = l00 + ls·x + lt·y, solved from the corners, zero at the first.
        let (e1, e2) = (at[1] - at[0], at[2] - at[0]);
        let ls = (e1 * d2.y - e2 * d1.y) / det;
        let lt = (e2 * d1.x - e1 * d2.x) / det;
        let l00 = -(ls * x[0].x + lt * x[0].y);
        let region = SmallVec::from_slice(&x);
        Some(Self { lo, hi, region, values: [l00, ls, lt], sign: det.signum(), measure: Measure::Whole })
    }

    /// Returns the map that takes the parameters of a chord onto its ends `at`, positions relative to the first, and goes with the surface
    /// across it. The region is a convex `polygon`, counter-clockwise, that holds the chord. `None` where the chord or the surface gives no
    /// direction.
    pub(in crate::tessellate) fn along_chord(
        surface: &FaceSurface<'_>,
        polygon: &[Uv],
        chord: [Uv; 2],
        at: [Point; 2],
    ) -> Option<Self> {
        let (lo, hi) = polygon.iter().fold((chord[0], chord[0]), |(l, h), &x| (l.min(x), h.max(x)));
        let size = hi - lo;
        let share = |x: Uv| (x - lo) / size;
        let a = share(chord[0]);
        let d = share(chord[1]) - a;
        let along = at[1] - at[0];
        let der = surface.second_derivatives(0.5 * (chord[0] + chord[1]));
        let across = der.dv * (d.x * size.y) - der.du * (d.y * size.x);
        // In L's plane lie the chord and the way that the surface goes beside it, so that D is what bending leaves.
        let normal = along.cross(across).try_normalize()?;
        let (ls, lt) =
            ((along * d.x - across * d.y) / d.length_squared(), (along * d.y + across * d.x) / d.length_squared());
        let l00 = -(ls * a.x + lt * a.y);
        let region: SmallVec<[Uv; 8]> = polygon.iter().map(|&x| share(x)).collect();
        let off = |x: &Uv| distance_to_chord(l00 + ls * x.x + lt * x.y, &[Point::ZERO, along]);
        let reach = region.iter().map(off).fold(0.0, f64::max);
        let measure = Measure::Sliver { normal, reach };
        // A chord of no length has no such map.
        reach.is_finite().then_some(Self { lo, hi, region, values: [l00, ls, lt], sign: 1.0, measure })
    }

    /// Returns the lower and upper corner of the part of the rectangle that a patch covers.
    pub(in crate::tessellate) fn overlap(&self, patch: &BezierPatch) -> [Uv; 2] {
        let [[u0, u1], [v0, v1]] = patch.domain;
        [self.lo.max(Uv::new(u0, v0)), self.hi.min(Uv::new(u1, v1))]
    }

    /// Returns where a part of the rectangle, given by its corners in parameters, starts and how large it is, as shares of the rectangle.
    pub(in crate::tessellate) fn as_shares(&self, [a, b]: [Uv; 2]) -> [Uv; 2] {
        let size = self.hi - self.lo;
        [(a - self.lo) / size, (b - a) / size]
    }

    /// Returns L, relative to the map's origin, at the corners (0,0), (1,0), (0,1), (1,1) of a part, which begins at `from` and is `share`
    /// of the rectangle.
    pub(in crate::tessellate) fn corner_values(&self, from: Uv, share: Uv) -> [Point; 4] {
        let [l00, ls, lt] = self.values;
        let l = l00 + ls * from.x + lt * from.y;
        let (s, t) = (ls * share.x, lt * share.y);
        [l, l + s, l + t, l + s + t]
    }

    /// Whether a part of the rectangle, given in shares, meets the region; by rounding it may say so of one that just does not.
    pub(in crate::tessellate) fn meets_region(&self, from: Uv, share: Uv) -> bool {
        let n = self.region.len();
        (0..n).all(|k| {
            let a = self.region[k];
            let d = (self.region[(k + 1) % n] - a) * self.sign;
            // The corner that lies farthest to the left of the side.
            let far = from + Uv::new(if d.y < 0.0 { share.x } else { 0.0 }, if d.x > 0.0 { share.y } else { 0.0 });
            d.perp_dot(far - a) >= -TOUCHING
        })
    }

    /// Returns a bound, mm, of the deviation that the map measures, where `net` are the control points of W·(S − L) and no weight is below
    /// `lightest`.
    pub(in crate::tessellate) fn bound(&self, net: &[Point], lightest: f64) -> f64 {
        match self.measure {
            Measure::Whole => net.iter().map(|x| x.length_squared()).fold(0.0, f64::max).sqrt() / lightest,
            Measure::Sliver { normal, reach } => {
                let (mut up, mut flat) = (0f64, 0f64);
                for x in net {
                    let h = x.dot(normal);
                    up = up.max(h.abs());
                    flat = flat.max((*x - normal * h).length_squared());
                }
                // The point's height over L's plane, and how far beside the chord it is in that plane, L's own part
                // included.
                (up / lightest).hypot(reach + flat.sqrt() / lightest)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::math::{Frame, Uv};
    use crate::nurbs::sweep;
    use crate::tessellate::face_surface::FaceSurface;
    use crate::tessellate::proof::deviation::DeviationBounds;
    use crate::tessellate::proof::flat_triangle::distance_to_chord;
    use crate::tessellate::settings::ToleranceField;

    #[test]
    fn slivers_beside_a_chord_stay_within_their_bound() {
        let s = sweep::torus(&Frame::IDENTITY, 40.0, 12.0, [0.0, 3.0], [0.2, 2.9]);
        let surface =
            FaceSurface::new(&s, false, ToleranceField::new([0.1; 2], [1.0, 10.0], Default::default(), 1.0));
        // Across the knots at which the torus is divided, and within them.
        for from in [Uv::new(0.3, 0.4), Uv::new(1.4, 1.4)] {
            let chord = [from, from + Uv::new(0.2, 0.3)];
            let polygon = [chord[0], from + Uv::new(0.13, 0.15), chord[1]];
            let at = chord.map(|x| s.evaluate(x));
            let mut worst = 0f64;
            for i in 0..=60 {
                for j in 0..=60 - i {
                    let (a, b) = (i as f64 / 60.0, j as f64 / 60.0);
                    let x = polygon[0] * a + polygon[1] * b + polygon[2] * (1.0 - a - b);
                    worst = worst.max(distance_to_chord(s.evaluate(x), &at));
                }
            }
            let bound = |limit: f64| DeviationBounds::default().chord_bound(&surface, &polygon, chord, at, limit);
            assert!(bound(0.999 * worst).is_none());
            let bound = bound(1.2 * worst).unwrap();
            assert!(worst <= bound && bound <= 1.2 * worst, "{worst} {bound}");
        }
    }
}

//! The linear map of a parameter triangle onto one in space, which the deviation of a facet is measured from.

use crate::math::{Point, Uv};
use crate::nurbs::BezierPatch;

/// Triangles with a smaller share of the rectangle around them are left to others: their L is steep.
const THINNEST: f64 = 0.05;

/// The linear map L from a parameter triangle onto one in space, over the rectangle around it.
pub(super) struct Linear {
    pub(super) lo: Uv,
    pub(super) hi: Uv,
    /// Corners, as shares of the rectangle.
    x: [Uv; 3],
    /// L at the rectangle's first corner, and along it, seen from the first corner in space.
    l: [Point; 3],
    /// Which way the corners run.
    sign: f64,
}

impl Linear {
    pub(super) fn new(corners: [Uv; 3], at: [Point; 3]) -> Option<Self> {
        let lo = corners[0].min(corners[1]).min(corners[2]);
        let hi = corners[0].max(corners[1]).max(corners[2]);
        let x = corners.map(|c| (c - lo) / (hi - lo));
        let (d1, d2) = (x[1] - x[0], x[2] - x[0]);
        let det = d1.perp_dot(d2);
        if det.abs() < THINNEST || det.is_nan() {
            return None;
        }
        let (e1, e2) = (at[1] - at[0], at[2] - at[0]);
        let ls = (e1 * d2.y - e2 * d1.y) / det;
        let lt = (e2 * d1.x - e1 * d2.x) / det;
        let l00 = -(ls * x[0].x + lt * x[0].y);
        Some(Self { lo, hi, x, l: [l00, ls, lt], sign: det.signum() })
    }

    /// The part of the rectangle that a patch covers.
    pub(super) fn meets(&self, patch: &BezierPatch) -> [Uv; 2] {
        let [[u0, u1], [v0, v1]] = patch.domain;
        [self.lo.max(Uv::new(u0, v0)), self.hi.min(Uv::new(u1, v1))]
    }

    /// Where a part of the rectangle starts and how large it is, as shares.
    pub(super) fn shares(&self, [a, b]: [Uv; 2]) -> [Uv; 2] {
        let size = self.hi - self.lo;
        [(a - self.lo) / size, (b - a) / size]
    }

    /// L at the corners (0,0), (1,0), (0,1), (1,1) of a part.
    pub(super) fn over(&self, from: Uv, share: Uv) -> [Point; 4] {
        let [l00, ls, lt] = self.l;
        let l = l00 + ls * from.x + lt * from.y;
        let (s, t) = (ls * share.x, lt * share.y);
        [l, l + s, l + t, l + s + t]
    }

    /// Whether a part meets the triangle.
    pub(super) fn touches(&self, from: Uv, share: Uv) -> bool {
        (0..3).all(|k| {
            let (a, d) = (self.x[k], (self.x[(k + 1) % 3] - self.x[k]) * self.sign);
            // The corner that lies farthest to the left of the side.
            let far = from + Uv::new(if d.y < 0.0 { share.x } else { 0.0 }, if d.x > 0.0 { share.y } else { 0.0 });
            d.perp_dot(far - a) >= -1e-12
        })
    }
}

//! The hull bound, sharpened: a Bézier simplex is cut into halves or quarters while that may bring it below the limit.

use super::scalar_bezier::ScalarBezier;
use super::simplex_net::SimplexNets;
use crate::math::{Point, Uv};
use crate::nurbs::BezierPatch;

/// How often a piece is cut into four before the bound is taken as it is.
pub(super) const LEVELS: u32 = 3;
/// Limits beyond which a bound is not tried further below the first level: half of what two levels can gain.
const HOPELESS: f64 = 8.0;

/// Halves a net of degrees `[p, q]` along u (0) or v (1) by de Casteljau's steps: `high` holds it and keeps its upper half, `low` takes the
/// lower one.
#[inline]
pub(super) fn halve_net<T>(low: &mut [T], high: &mut [T], [p, q]: [usize; 2], along: usize)
where
    T: Copy + std::ops::Add<Output = T>,
    f64: std::ops::Mul<T, Output = T>,
{
    let (lines, n, step, across) = if along == 0 { (q + 1, p, q + 1, 1) } else { (p + 1, q, 1, q + 1) };
    for line in 0..lines {
        let at = |k: usize| line * across + k * step;
        for r in 0..=n {
            low[at(r)] = high[at(0)];
            for k in 0..n - r {
                high[at(k)] = 0.5 * (high[at(k)] + high[at(k + 1)]);
            }
        }
    }
}

/// Returns a bound of a convex function `f` over the piece of a patch above the simplex `at` (2 or 3 corners, local parameters), cut into
/// two or four up to `levels` times while that may bring it to `limit`. A value above `limit` is not proved.
pub(super) fn refine<const N: usize>(
    (nets, scalar): (&mut SimplexNets, &mut ScalarBezier),
    patch: &BezierPatch,
    at: [Uv; N],
    limit: f64,
    levels: u32,
    f: &impl Fn(Point) -> f64,
) -> f64 {
    let net = nets.expand(patch, at);
    let degree = patch.degree[0] + patch.degree[1];
    let bound = scalar.load(net.iter().map(|c| (f(c.project()), c.w)), degree);
    // Corners lie on the surface: there the distance is no bound but true.
    if bound <= limit || scalar.largest_corner::<N>() > limit {
        return bound;
    }
    // Each level brings the bound at most four times closer to the truth; no hope is no work.
    if bound > HOPELESS * limit && levels < LEVELS {
        return bound;
    }
    if let Some(bound) = scalar.bound_within::<N>(limit) {
        return bound;
    }
    // What could not be shown is given back as it is: above the limit, and so not proved.
    if levels == 0 {
        return bound;
    }
    let mut worst = 0f64;
    // One part above the limit decides for all: the others are not looked at.
    let mut take = |sub: [Uv; N]| {
        worst = worst.max(refine((nets, scalar), patch, sub, limit, levels - 1, f));
        worst > limit
    };
    if N == 2 {
        let m = 0.5 * (at[0] + at[1]);
        let _ = take([at[0], m].as_slice().try_into().expect("two"))
            || take([m, at[1]].as_slice().try_into().expect("two"));
    // Four triangles by the middles of the sides; one above the limit is enough to give up.
    } else {
        let (a, b, c) = (0.5 * (at[0] + at[1]), 0.5 * (at[1] + at[2]), 0.5 * (at[2] + at[0]));
        let subs = [[a, b, c], [at[0], a, c], [a, at[1], b], [c, b, at[2]]];
        let _ = subs.iter().any(|s| take(s.as_slice().try_into().expect("three")));
    }
    worst
}

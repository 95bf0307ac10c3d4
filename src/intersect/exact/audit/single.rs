//! Where clipping has come down to a small box with one root at most, that root: for the audit path.
//!
//! Around a root, rounding leaves boxes side by side that clipping cannot separate. Over a box so small the Jacobian hardly
//! varies: when, preconditioned by the inverse of its middle, it deviates from the identity by less than 1, the map from
//! parameters to the plane across the ray is injective (its root is single), and Newton's method finds it.

use super::net::Net;
use crate::math::Uv;
use crate::nurbs::BezierPatch;

/// A Jacobian whose determinant is a smaller part of the product of its row sums has no inverse worth having: ten digits are left.
const SINGULAR: f64 = 1e-6;
/// The Jacobian may deviate by less than this, half of what injectivity needs, so that Newton's method converges as well.
const DEVIATION: f64 = 0.5;
/// Newton's method ends at a step this short, the next being its square.
const LAST_STEP: f64 = 1e-6;

/// Finds the only root over a net as the ray sees it, in shares of its domain, and a bound of how far, in such shares, a homogeneous unit
/// across the ray moves it; `None` where more than one cannot be ruled out, or none is found inside.
pub(super) fn single_root(patch: &Net) -> Option<(Uv, f64)> {
    let q = patch.degree[1];
    // Ranges of ∂x/∂u, ∂x/∂v, ∂y/∂u, ∂y/∂v from the differences of the control points.
    let mut range = [[(f64::INFINITY, f64::NEG_INFINITY); 2]; 2];
    for i in 0..=patch.degree[0] {
        for j in 0..=q {
            for (d, (next, inside)) in [(i + 1, i < patch.degree[0]), (j + 1, j < q)].into_iter().enumerate() {
                if !inside {
                    continue;
                }
                let to = if d == 0 { next * (q + 1) + j } else { i * (q + 1) + next };
                let step = (patch.points[to] - patch.points[i * (q + 1) + j]) * patch.degree[d] as f64;
                for k in 0..2 {
                    let (lo, hi) = range[k][d];
                    range[k][d] = (lo.min(step[k]), hi.max(step[k]));
                }
            }
        }
    }
    let middle = range.map(|row| row.map(|(lo, hi)| 0.5 * (lo + hi)));
    let radius = range.map(|row| row.map(|(lo, hi)| 0.5 * (hi - lo)));
    let inverse = |[[a, b], [c, d]]: [[f64; 2]; 2]| {
        let det = a * d - b * c;
        (det.abs() > SINGULAR * (a.abs() + b.abs()) * (c.abs() + d.abs()))
            .then(|| [[d / det, -b / det], [-c / det, a / det]])
    };
    // With Y the inverse of the middle Jacobian, ‖I − Y·J‖ < 1 all over the box makes p ↦ Y·f(p) one-to-one on it: no second root can be
    // there (the test of Krawczyk and Moore).
    let y = inverse(middle)?;
    let deviates =
        |r: usize| (0..2).map(|c| y[r][0].abs() * radius[0][c] + y[r][1].abs() * radius[1][c]).sum::<f64>();
    if !(deviates(0) < DEVIATION && deviates(1) < DEVIATION) {
        return None;
    }
    let unit = [[0.0, 1.0]; 2];
    let patch = BezierPatch { degree: patch.degree, points: patch.points.to_vec(), domain: unit };
    let mut at = Uv::splat(0.5);
    // On its way Newton's method may leave the box a little; its root counts only inside.
    for _ in 0..20 {
        let [s, su, sv] = patch.local_jet(at);
        let j = inverse([[su.x, sv.x], [su.y, sv.y]])?;
        let step = Uv::new(j[0][0] * s.x + j[0][1] * s.y, j[1][0] * s.x + j[1][1] * s.y);
        at -= step;
        if !(at.x > -0.5 && at.x < 1.5 && at.y > -0.5 && at.y < 1.5) {
            return None;
        }
        if step.abs().max_element() < LAST_STEP {
            let inside = at.x >= 0.0 && at.x <= 1.0 && at.y >= 0.0 && at.y <= 1.0;
            return inside.then_some((at, y.iter().flatten().map(|x| x.abs()).sum()));
        }
    }
    None
}

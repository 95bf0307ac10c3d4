//! A net as the ray sees it: what its hull and its derivatives say of roots, for clipping.

use super::leaf::Leaf;
use super::net::{self, Net, Slopes, V4, by_degree};
use super::tolerances::{INVERSE_ROUNDING, ROUND, SINGULAR};
use crate::math::Vector;

/// Rounding of the preconditioned hull, as a share of the box: about a thousand half ulps, for sums of four products. Any matrix may stand
/// for the inverse there, so that only its products round, by less than it magnifies the margin.
const HULL_ROUNDING: f64 = 1e-13;
/// Half ulps by which a coordinate across the ray is off, beside those of each de Casteljau step.
const SHIFT_ROUNDING: f64 = 4.0;
/// Newton steps in a box with one root at most.
const BOX_STEPS: usize = 12;
/// Newton's method ends at steps of this size, as a share of the box.
const LAST_BOX_STEP: f64 = 1e-14;
/// Steps below this that do not get shorter are rounding.
const STALLED_BOX_STEP: f64 = 1e-8;

/// A leaf's net as a ray sees it.
pub(super) struct SeenLeaf {
    /// Across, across, along, weight.
    pub(super) net: Net,
    /// The directions of the two coordinates across.
    pub(super) frame: [Vector; 2],
    /// Bound of the rounding of these two, in homogeneous units: [`homogeneous_margin`].
    pub(super) homogeneous_margin: [f64; 2],
    /// Whether it comes from the surface as given in 32 digits.
    pub(super) precise: bool,
}

/// What a net's hull says of the ray.
pub(super) struct Hull {
    /// Bounds of t, mm.
    pub(super) near: f64,
    pub(super) far: f64,
    /// Largest distance from the ray, mm.
    pub(super) across: f64,
}

/// The inverse of the middle Jacobian and what it bounds.
pub(super) struct Preconditioner {
    pub(super) inverse: [[f64; 2]; 2],
    /// Largest row sum of its product with the radii of the derivative boxes.
    pub(super) deviation: f64,
    /// Bound of what rounding moves a root, as a share of the box.
    pub(super) slack: [f64; 2],
}

/// Range of t, mm, over a net in a ray's frame; everything when a weight is not positive.
#[inline(always)]
pub(super) fn range_along(net: &[V4]) -> (f64, f64) {
    let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
    for p in net {
        if p[3] <= 0.0 {
            return (f64::NEG_INFINITY, f64::INFINITY);
        }
        let t = p[2] / p[3];
        (lo, hi) = (lo.min(t), hi.max(t));
    }
    (lo, hi)
}

/// What the hull of a net in a ray's frame says of the ray; `None` when it misses it by more than `margin`, in homogeneous units.
#[inline(always)]
pub(super) fn hull(net: &[V4], margin: [f64; 2]) -> Option<Hull> {
    let (mut lo, mut hi, mut least_weight) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], f64::INFINITY);
    for p in net {
        for k in 0..2 {
            lo[k] = lo[k].min(p[k]);
            hi[k] = hi[k].max(p[k]);
        }
        least_weight = least_weight.min(p[3]);
    }
    // Weights are positive: homogeneous coordinates have the signs of the places.
    if (0..2).any(|k| lo[k] > margin[k] || hi[k] < -margin[k]) {
        return None;
    }
    let (near, far) = range_along(net);
    // A coordinate is the homogeneous one over a weight, and so no larger than the largest over the least.
    let largest = lo.iter().chain(&hi).fold(0f64, |a, x| a.max(x.abs()));
    Some(Hull { near, far, across: largest / least_weight.max(f64::MIN_POSITIVE) })
}

/// Turns control points about a leaf's centre into a net in a ray's frame: two coordinates across, along `[n1, n2]`, one along its
/// `direction`, and the weight. `oc` is the ray's origin less that centre.
#[inline(always)]
pub(super) fn seen_along([n1, n2]: [Vector; 2], direction: Vector, control: &[V4], oc: Vector) -> Net {
    // The origin is taken off in homogeneous form, A − o·W, which stays linear in the control points: no division,
    // no further rounding.
    let (k1, k2, kd) = (n1.dot(oc), n2.dot(oc), direction.dot(oc));
    let mut net = Net::from_slice(control);
    for p in &mut net {
        let a = Vector::new(p[0], p[1], p[2]);
        *p = [n1.dot(a) - k1 * p[3], n2.dot(a) - k2 * p[3], direction.dot(a) - kd * p[3], p[3]];
    }
    net
}

/// Bound of the rounding of a leaf's two coordinates across a ray, in homogeneous units: what they are off before any halving, up to
/// `noise` mm, times the largest weight, and what halvings of the net add.
#[inline(always)]
pub(super) fn homogeneous_margin(leaf: &Leaf, net: &[V4], noise: f64) -> [f64; 2] {
    let (mut largest, mut heaviest) = ([0f64; 2], 0f64);
    for p in net {
        largest = [largest[0].max(p[0].abs()), largest[1].max(p[1].abs())];
        heaviest = heaviest.max(p[3]);
    }
    largest.map(|x| heaviest * noise + halving_rounding(leaf) * x)
}

/// Bound of what halvings round, as a share of a leaf's largest coordinate: at each level one rounding a degree, relative to a net half as
/// large as the one before, so that all levels together take twice what the first does.
#[inline(always)]
fn halving_rounding(leaf: &Leaf) -> f64 {
    (SHIFT_ROUNDING + 2.0 * (f64::from(leaf.degree[0]) + f64::from(leaf.degree[1]))) * ROUND
}

/// Two unit vectors across a ray: one along the longer tangent of a net's middle, whose `slopes` are seen in this `frame`, the other across
/// it. That coordinate is small all over a leaf that the ray runs along, and what is small is rounded by little.
pub(super) fn tangent_frame(slopes: &Slopes, frame: [Vector; 2], direction: Vector) -> [Vector; 2] {
    let [[a, b], [c, d]] = [[slopes.u[0], slopes.u[1]], [slopes.v[0], slopes.v[1]]];
    let [x, y] = if a.hypot(b) >= c.hypot(d) { [a, b] } else { [c, d] };
    let along = (frame[0] * x + frame[1] * y).normalize_or(frame[0]);
    [along, direction.cross(along)]
}

/// The determinant of the middle Jacobian of a net in a ray's frame, and whether it is more than rounding: else the ray runs along the
/// surface there.
#[inline(always)]
pub(super) fn determinant(s: &Slopes) -> (f64, bool) {
    let det = s.u[0] * s.v[1] - s.v[0] * s.u[1];
    (det, det.abs() > SINGULAR * (s.u[0].abs() + s.v[0].abs()) * (s.u[1].abs() + s.v[1].abs()))
}

/// Inverts the middle Jacobian of a net in the ray's frame, whose coordinates across are off by up to `margin`, in homogeneous units;
/// `None` where its determinant is zero. A nearly singular one has a deviation that counts its rounding.
#[inline(always)]
pub(super) fn precondition(s: &Slopes, degree: [u8; 2], margin: [f64; 2]) -> Option<Preconditioner> {
    let (det, regular) = determinant(s);
    if !(det.abs() > f64::MIN_POSITIVE) {
        return None;
    }
    let y = [[s.v[1] / det, -s.v[0] / det], [-s.u[1] / det, s.u[0] / det]];
    let row = |r: usize| y[r][0].abs() * (s.ru[0] + s.rv[0]) + y[r][1].abs() * (s.ru[1] + s.rv[1]);
    let slack = [0, 1].map(|r: usize| y[r][0].abs() * margin[0] + y[r][1].abs() * margin[1] + HULL_ROUNDING);
    // A derivative is off by twice the degree of what control points are off, and the inverse of a nearly singular Jacobian by no more.
    let blur = if regular { 0.0 } else { 4.0 * f64::from(degree[0].max(degree[1])) * slack[0].max(slack[1]) };
    Some(Preconditioner { inverse: y, deviation: row(0).max(row(1)) + INVERSE_ROUNDING + blur, slack })
}

/// Ranges of u and v, as shares of the box, that can hold a root: where `u = u − g(u, v)` for the net g preconditioned by `y`. They may
/// reach beyond the box or miss it; rounding is not counted.
#[inline(always)]
pub(super) fn linear_hull(net: &[V4], degree: [u8; 2], y: &[[f64; 2]; 2]) -> [[f64; 2]; 2] {
    by_degree!(degree, linear_hull_of_degree(net, y))
}

/// As [`linear_hull`] of a net of degrees `p` and `q`.
#[inline(always)]
fn linear_hull_of_degree(net: &[V4], y: &[[f64; 2]; 2], p: usize, q: usize) -> [[f64; 2]; 2] {
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for i in 0..=p {
        for j in 0..=q {
            let x = &net[i * (q + 1) + j];
            let at = [i as f64 / p as f64, j as f64 / q as f64];
            for k in 0..2 {
                // x − Y·f(x) has control points i/n − Y·fᵢⱼ, for x itself has them at i/n: a root lies where it is its own image, and so
                // within their range.
                let g = at[k] - (y[k][0] * x[0] + y[k][1] * x[1]);
                range[k] = [range[k][0].min(g), range[k][1].max(g)];
            }
        }
    }
    range
}

/// Finds the root of a net in the ray's frame by Newton's method from `start`, both in shares of the box; `None` when it does not converge
/// or leaves the box by half of it.
#[inline(always)]
pub(super) fn newton(net: &[V4], degree: [u8; 2], [mut u, mut v]: [f64; 2]) -> Option<[f64; 2]> {
    let mut last = f64::INFINITY;
    for _ in 0..BOX_STEPS {
        let j = net::evaluate(net, degree, u, v);
        let inv = 1.0 / (j.su[0] * j.sv[1] - j.sv[0] * j.su[1]);
        let du = (j.sv[1] * j.s[0] - j.sv[0] * j.s[1]) * inv;
        let dv = (j.su[0] * j.s[1] - j.su[1] * j.s[0]) * inv;
        u -= du;
        v -= dv;
        let step = du.abs().max(dv.abs());
        if step < LAST_BOX_STEP || (step < STALLED_BOX_STEP && step >= last) {
            return Some([u, v]);
        }
        last = step;
        // Out of the box by half of it: whatever it finds is not this box's.
        if !(u > -0.5 && u < 1.5 && v > -0.5 && v < 1.5) {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deviation_of_a_singular_net_holds_what_its_rounding_makes_of_its_jacobian() {
        // Linear nets: no derivative varies, and all that a Jacobian may deviate by is what control points are off. Moved by the margin
        // each, they move a derivative of degree p by 2p margins.
        for (skew, degree) in [(1e-9, [1, 1]), (1e-10, [2, 3]), (3e-11, [3, 3])] {
            let v = [1.0, 1.0 + skew, 0.0, 0.0];
            let u = [1.0, 1.0, 0.0, 0.0];
            let slopes = Slopes { u, v, ru: [0.0; 4], rv: [0.0; 4] };
            let margin = [1e-15, 2e-15];
            let made = precondition(&slopes, degree, margin).expect("a determinant");
            let p = degree.map(f64::from);
            let mut worst = 0f64;
            // The largest row sum of Y · (J' − J) over all signs of the four errors; more than what is always counted.
            for row in made.inverse {
                for signs in 0..16u8 {
                    let sign = |k: u8| if signs >> k & 1 == 0 { 1.0 } else { -1.0 };
                    let along_u =
                        row[0] * sign(0) * 2.0 * p[0] * margin[0] + row[1] * sign(1) * 2.0 * p[0] * margin[1];
                    let along_v =
                        row[0] * sign(2) * 2.0 * p[1] * margin[0] + row[1] * sign(3) * 2.0 * p[1] * margin[1];
                    worst = worst.max(along_u.abs() + along_v.abs());
                }
            }
            assert!(worst > INVERSE_ROUNDING && made.deviation >= worst, "{skew}: {} {worst}", made.deviation);
        }
    }
}

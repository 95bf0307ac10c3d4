//! What the one-step test leaves open: Bernstein-hull clipping with bisection, in order of t, under a budget.
//!
//! The leaf's net is seen along the ray: two coordinates across, one along, and the weight. A box of parameters is dropped
//! when the hull misses the ray or when the preconditioned hull shows that no root can lie in it, shrunk when the hull
//! says so, solved by Newton when at most one root is left, and halved otherwise. Boxes that come down to rounding are
//! reported as tangent or uncertified, never dropped.

use super::geometry::project;
use super::leaf::{Leaf, ROUND};
use super::net::{self, Net, Slopes, V4, by_degree};
use super::query::Query;
use super::{Exact, wide};
use crate::intersect::Certainty;

/// Contact closer than this is a matter of rounding, mm.
pub(super) const TANGENT: f64 = 1e-9;
/// Smallest box of parameters.
const FINEST: f64 = 1e-13;

struct Node {
    net: Net,
    rect: [[f64; 2]; 2],
    near: f64,
}

/// Range of t over a net; everything when a weight is not positive.
#[inline(always)]
fn along(net: &[V4]) -> (f64, f64) {
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

impl Exact {
    /// Looks for every root of the query on a leaf.
    #[inline(always)]
    pub(super) fn clip_leaf(&self, q: &mut Query, index: u32) {
        q.clips += 1;
        let leaf = &self.leaves[index as usize];
        let degree = leaf.degree;
        let oc = q.o - leaf.center;
        let (k1, k2, kd) = (q.n1.dot(oc), q.n2.dot(oc), q.d.dot(oc));
        let mut size = [0f64; 2];
        let mut root: Net = leaf
            .net(&self.pool)
            .iter()
            .map(|p| {
                let a = glam::DVec3::new(p[0], p[1], p[2]);
                let x = [q.n1.dot(a) - k1 * p[3], q.n2.dot(a) - k2 * p[3], q.d.dot(a) - kd * p[3], p[3]];
                size = [size[0].max(x[0].abs()), size[1].max(x[1].abs())];
                x
            })
            .collect();
        let mut rect = [[0.0, 1.0]; 2];
        for d in 0..2 {
            let [lo, hi] = leaf.reach[d];
            if lo < -1e-9 || hi > 1.0 + 1e-9 {
                rect[d] = [if lo < -1e-9 { lo } else { 0.0 }, if hi > 1.0 + 1e-9 { hi } else { 1.0 }];
                net::restrict(&mut root, degree, d, rect[d]);
            }
        }
        // Halving errs by one rounding a degree and level relative to a net that shrinks with the level: twice the first.
        let steps = 4.0 + 2.0 * (degree[0] as f64 + degree[1] as f64);
        let noise = self.noise(leaf, oc);
        let margin = size.map(|s| noise + steps * ROUND * s);
        let own = q.own.and_then(|o| o.in_leaf(leaf, &self.geometry));
        let near = along(&root).0;
        let mut stack = vec![Node { net: root, rect, near }];
        while let Some(node) = stack.pop() {
            // Strict, so that a box that starts where the best root lies is not searched again.
            if node.near >= q.t_max && q.best.is_some() {
                continue;
            }
            if q.budget == 0 {
                q.doubt = q.doubt.min(node.near);
                continue;
            }
            q.budget -= 1;
            self.clip_node(q, index, leaf, node, margin, own, &mut stack);
        }
    }

    #[allow(clippy::too_many_arguments)]
    #[inline(always)]
    fn clip_node(
        &self,
        q: &mut Query,
        index: u32,
        leaf: &Leaf,
        node: Node,
        margin: [f64; 2],
        own: Option<[f64; 2]>,
        stack: &mut Vec<Node>,
    ) {
        let degree = leaf.degree;
        let net = &node.net;
        let (mut lo, mut hi, mut least) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], f64::INFINITY);
        for p in net {
            for k in 0..2 {
                lo[k] = lo[k].min(p[k]);
                hi[k] = hi[k].max(p[k]);
            }
            least = least.min(p[3]);
        }
        if (0..2).any(|k| lo[k] > margin[k] || hi[k] < -margin[k]) {
            return;
        }
        let (near, far) = along(net);
        if near > q.t_max || far < q.t_min - TANGENT {
            return;
        }
        let [[u0, u1], [v0, v1]] = node.rect;
        let (wide_u, wide_v) = (u1 - u0, v1 - v0);
        let mut keep = [[0.0, 1.0]; 2];
        let slopes = net::slopes(net, degree);
        if let Some((y, rho)) = precondition(&slopes) {
            let slack = [0, 1].map(|r: usize| y[r][0].abs() * margin[0] + y[r][1].abs() * margin[1] + 1e-13);
            keep = linear_hull(net, degree, &y);
            for k in 0..2 {
                keep[k] = [keep[k][0] - slack[k], keep[k][1] + slack[k]];
                if keep[k][0] > 1.0 || keep[k][1] < 0.0 {
                    return;
                }
                keep[k] = [keep[k][0].max(0.0), keep[k][1].min(1.0)];
            }
            if rho < 0.9 {
                let start = [0, 1].map(|k: usize| 0.5 * (keep[k][0] + keep[k][1]));
                if let Some([u, v]) = newton(net, degree, start) {
                    let e = 1e-12 + 2.0 * slack[0].max(slack[1]);
                    if [u, v].iter().all(|x| (-e..=1.0 + e).contains(x)) {
                        let s = net::evaluate(net, degree, u, v).s;
                        let t = s[2] / s[3];
                        let local = [u0 + wide_u * u, v0 + wide_v * v];
                        // An origin a little off its surface point moves the root by that much across the ray.
                        let moved = q.own.map_or(0.0, |o| o.off) * y.iter().flatten().map(|x| x.abs()).sum::<f64>();
                        let close = |p: [f64; 2]| {
                            (p[0] - local[0]).abs() <= wide_u * (e + moved) + 1e-9
                                && (p[1] - local[1]).abs() <= wide_v * (e + moved) + 1e-9
                        };
                        let inside = |p: [f64; 2]| p[0] >= u0 && p[0] <= u1 && p[1] >= v0 && p[1] <= v1;
                        let leaving = own.is_some_and(|p| close(p) || inside(p))
                            && q.own.is_some_and(|o| o.is_unique_root(t));
                        if !leaving {
                            self.offer(q, index, local, t, Certainty::Certified);
                        }
                        return;
                    }
                }
            }
        }
        let across = lo.iter().chain(&hi).fold(0f64, |a, x| a.max(x.abs())) / least.max(f64::MIN_POSITIVE);
        let small = wide_u.max(wide_v);
        if (across < TANGENT && (far - near < 1e3 * TANGENT || small < 1e-7)) || small < FINEST {
            let s = net::evaluate(net, degree, 0.5, 0.5).s;
            let local = [u0 + 0.5 * wide_u, v0 + 0.5 * wide_v];
            let reach = 1e-7 + small;
            let leaving = own.is_some_and(|p| (0..2).all(|k| (p[k] - local[k]).abs() <= reach))
                && q.own.is_some_and(|o| o.is_unique_root((s[2] / s[3]).abs() - 1e3 * TANGENT));
            if !leaving {
                let certainty = self.contact(leaf, local, q);
                self.offer(q, index, local, s[2] / s[3], certainty);
            }
            return;
        }
        let kept = keep.map(|[a, b]| b - a);
        if kept[0] < 0.6 || kept[1] < 0.6 {
            let mut net = node.net;
            let mut rect = node.rect;
            for d in 0..2 {
                if kept[d] < 1.0 {
                    let range = [keep[d][0], keep[d][1].max(keep[d][0] + 1e-15)];
                    net::restrict(&mut net, degree, d, range);
                    let [a, b] = rect[d];
                    rect[d] = [a + (b - a) * range[0], a + (b - a) * range[1]];
                }
            }
            stack.push(Node { net, rect, near });
            return;
        }
        let longest = |m: &V4, r: &V4| (0..3).map(|c| m[c].abs() + r[c]).fold(0.0, f64::max);
        let u_first = longest(&slopes.u, &slopes.ru) >= longest(&slopes.v, &slopes.rv);
        let direction = if (u_first && wide_u > FINEST) || wide_v <= FINEST { 0 } else { 1 };
        let halves = net::halves(net, degree, direction);
        let middle = 0.5 * (node.rect[direction][0] + node.rect[direction][1]);
        let mut children = halves.map(|net| {
            let near = along(&net).0;
            Node { net, rect: node.rect, near }
        });
        children[0].rect[direction][1] = middle;
        children[1].rect[direction][0] = middle;
        let [a, b] = children;
        if a.near <= b.near {
            stack.extend([b, a]);
        } else {
            stack.extend([a, b]);
        }
    }

    /// Tangent where the surface is regular and the ray grazes it; uncertified at singular points.
    fn contact(&self, leaf: &Leaf, [u, v]: [f64; 2], q: &Query) -> Certainty {
        let jet = wide::evaluate(leaf.net(&self.pool), leaf.degree, u, v);
        let (_, du, dv) = project(&jet);
        let n = du.cross(dv);
        let regular = n.length() > 1e-6 * du.length().max(dv.length()).powi(2);
        let sine = n.dot(q.d).abs() / n.length().max(f64::MIN_POSITIVE);
        if regular && sine < 1e-3 { Certainty::Tangent } else { Certainty::Uncertified }
    }
}

/// The inverse of the middle Jacobian, and the largest row sum of its product with the radii.
#[inline(always)]
fn precondition(s: &Slopes) -> Option<([[f64; 2]; 2], f64)> {
    let det = s.u[0] * s.v[1] - s.v[0] * s.u[1];
    let size = (s.u[0].abs() + s.v[0].abs()) * (s.u[1].abs() + s.v[1].abs());
    // Below this the rounding of the inverse would reach 1e-6 in the test.
    if !(det.abs() > 1e-8 * size) {
        return None;
    }
    let y = [[s.v[1] / det, -s.v[0] / det], [-s.u[1] / det, s.u[0] / det]];
    let row = |r: usize| y[r][0].abs() * (s.ru[0] + s.rv[0]) + y[r][1].abs() * (s.ru[1] + s.rv[1]);
    Some((y, row(0).max(row(1)) + 1e-6))
}

/// Ranges of u and v that can hold a root: where `u = u − g(u, v)` for the preconditioned net g.
#[inline(always)]
fn linear_hull(net: &[V4], degree: [u8; 2], y: &[[f64; 2]; 2]) -> [[f64; 2]; 2] {
    by_degree!(degree, linear_hull_in(net, y))
}

#[inline(always)]
fn linear_hull_in(net: &[V4], y: &[[f64; 2]; 2], p: usize, q: usize) -> [[f64; 2]; 2] {
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for i in 0..=p {
        for j in 0..=q {
            let x = &net[i * (q + 1) + j];
            let at = [i as f64 / p as f64, j as f64 / q as f64];
            for k in 0..2 {
                let g = at[k] - (y[k][0] * x[0] + y[k][1] * x[1]);
                range[k] = [range[k][0].min(g), range[k][1].max(g)];
            }
        }
    }
    range
}

#[inline(always)]
fn newton(net: &[V4], degree: [u8; 2], [mut u, mut v]: [f64; 2]) -> Option<[f64; 2]> {
    let mut last = f64::INFINITY;
    for _ in 0..12 {
        let j = net::evaluate(net, degree, u, v);
        let inv = 1.0 / (j.su[0] * j.sv[1] - j.sv[0] * j.su[1]);
        let du = (j.sv[1] * j.s[0] - j.sv[0] * j.s[1]) * inv;
        let dv = (j.su[0] * j.s[1] - j.su[1] * j.s[0]) * inv;
        u -= du;
        v -= dv;
        let step = du.abs().max(dv.abs());
        if step < 1e-14 || (step < 1e-8 && step >= last) {
            return Some([u, v]);
        }
        last = step;
        if !(u > -0.5 && u < 1.5 && v > -0.5 && v < 1.5) {
            return None;
        }
    }
    None
}

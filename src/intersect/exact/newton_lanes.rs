//! Steps of Newton's method from eight rays to eight patches of one degree, written once for all instruction sets.
//!
//! Without closures, which would be compiled without the caller's instruction set.

use super::newton::{LAST_STEP, ROUNDING, SETTLED};
use super::patch::LEAST_SINE_SQUARED;
use crate::math::simd::f64x8::{F64x8, LANES};

/// Steps after which a lane is given up: three to four do where a facet leads to its own patch.
const STEPS: usize = 6;

/// What eight searches begin with, number by number.
#[derive(Clone, Copy)]
pub(super) struct Starts {
    /// The ray's origin about the patch's centre.
    pub(super) origin: [[f64; LANES]; 3],
    /// Of unit length.
    pub(super) direction: [[f64; LANES]; 3],
    /// The patch's parameters, 0 to 1.
    pub(super) local: [[f64; LANES]; 2],
    /// Distance from the ray at which steps that no longer help may end, mm.
    pub(super) near: [f64; LANES],
    /// Derivatives that are not longer are not trusted, squared.
    pub(super) trusted: [f64; LANES],
}

/// What became of eight searches.
pub(super) struct Ends {
    pub(super) t: [f64; LANES],
    pub(super) local: [[f64; LANES]; 2],
    /// Along `Su × Sv`, of unit length.
    pub(super) normal: [[f64; LANES]; 3],
    /// Distance from the ray, mm, of the point before the last step: what that leaves is less.
    pub(super) residual: [f64; LANES],
    /// One bit for each lane that ended at a root with a normal; what the others hold is of no meaning.
    pub(super) regular: u8,
}

/// A vector in every lane.
type Vectors<V> = [V; 3];

#[inline(always)]
fn load<V: F64x8>(v: &[[f64; LANES]; 3]) -> Vectors<V> {
    [V::load(&v[0]), V::load(&v[1]), V::load(&v[2])]
}

#[inline(always)]
fn dot<V: F64x8>(a: &Vectors<V>, b: &Vectors<V>) -> V {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0].mul(b[0])))
}

/// `a × b` in every lane.
#[inline(always)]
fn cross<V: F64x8>(a: &Vectors<V>, b: &Vectors<V>) -> Vectors<V> {
    [
        a[2].neg_mul_add(b[1], a[1].mul(b[2])),
        a[0].neg_mul_add(b[2], a[2].mul(b[0])),
        a[1].neg_mul_add(b[0], a[0].mul(b[1])),
    ]
}

#[inline(always)]
fn square<V: F64x8>(x: V) -> V {
    x.mul(x)
}

/// The largest coordinate in size in every lane.
#[inline(always)]
fn largest<V: F64x8>(v: &Vectors<V>) -> V {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

/// `new` in the lanes of `mask`, `old` in the others.
#[inline(always)]
fn select<V: F64x8>(mask: u8, new: &Vectors<V>, old: &Vectors<V>) -> Vectors<V> {
    [new[0].select(mask, old[0]), new[1].select(mask, old[1]), new[2].select(mask, old[2])]
}

/// [`iterate`] on nets of degrees `N − 1` and `M − 1`.
#[inline(always)]
pub(super) fn iterate_fixed<V: F64x8, const N: usize, const M: usize>(net: &[[V; 4]], starts: &Starts) -> Ends {
    iterate::<V, N, M>(&net[..N * M], [N as u8 - 1, M as u8 - 1], starts)
}

/// Takes at most [`STEPS`] Newton steps from `starts` until every lane has ended, and returns where they did, which may be beyond the
/// patch: parameters are not clamped. `net` holds the control points of eight patches side by side, those along v next to each other; `N`
/// and `M` exceed its degrees.
///
/// With `e` from the point to the ray's origin, `g = e × d` and `n = Su × Sv` a step is `(−g·Sv, g·Su) / n·d`: the two equations
/// across the ray without a frame around it, and `|g|` is the distance from the ray.
#[inline(always)]
pub(super) fn iterate<V: F64x8, const N: usize, const M: usize>(
    net: &[[V; 4]],
    degree: [u8; 2],
    starts: &Starts,
) -> Ends {
    let (origin, direction) = (load::<V>(&starts.origin), load::<V>(&starts.direction));
    let near = V::load(&starts.near);
    let zero = V::splat(0.0);
    let (mut u, mut v) = (V::load(&starts.local[0]), V::load(&starts.local[1]));
    // Square of the distance from the ray before the last step, mm².
    let mut last = V::splat(f64::INFINITY);
    let (mut t, mut residual) = (zero, zero);
    let (mut end_u, mut end_v) = (zero, zero);
    let mut normal = [zero; 3];
    let mut regular = 0u8;
    let mut ended = 0u8;
    let mut count = 0;
    while count <= STEPS && ended != u8::MAX {
        let (p, du, dv) = evaluate::<V, N, M>(net, degree, u, v);
        let e = [origin[0].sub(p[0]), origin[1].sub(p[1]), origin[2].sub(p[2])];
        let g = cross(&e, &direction);
        let n = cross(&du, &dv);
        let inverse = V::splat(1.0).div(dot(&n, &direction));
        let step_u = zero.sub(dot(&g, &dv)).mul(inverse);
        let step_v = dot(&g, &du).mul(inverse);
        // Squares are compared: a root at each step would take as long as a small net's evaluation.
        let across = dot(&g, &g);
        let rounding = V::splat(ROUNDING * f64::EPSILON).mul(largest(&origin).add(largest(&p)));
        // A lane ends where its next step is too short to matter, where steps no longer help, or where the distance
        // is rounding; and only near the ray.
        let moves = step_u.abs().max(step_v.abs()).mask_less(V::splat(LAST_STEP));
        let stalled = across.mask_less(near.mul(near)) & last.mul(V::splat(0.25)).mask_at_most(across);
        let settled = across.mask_at_most(square(rounding.mul(V::splat(SETTLED)))) | stalled;
        let on_ray = across.mask_at_most(square(near.add(rounding)));
        let ends = (moves | settled) & on_ray & !ended;
        if ends != 0 {
            // The point is moved along by a step that needs no further evaluation.
            let (moved_u, moved_v) = (step_u.select(moves, zero), step_v.select(moves, zero));
            let mut along = zero;
            for c in 0..3 {
                let off = dv[c].mul_add(moved_v, du[c].mul_add(moved_u, zero.sub(e[c])));
                along = off.mul_add(direction[c], along);
            }
            t = along.select(ends, t);
            end_u = u.add(moved_u).select(ends, end_u);
            end_v = v.add(moved_v).select(ends, end_v);
            residual = across.sqrt().select(ends, residual);
            // Where a derivative is next to nothing, or both are parallel, the limit of the normal takes more than
            // a register: such a lane has no answer.
            let (area, length_u, length_v) = (dot(&n, &n), dot(&du, &du), dot(&dv, &dv));
            let trusted = V::load(&starts.trusted);
            let clear = length_u.mul(length_v).mul(V::splat(LEAST_SINE_SQUARED)).mask_less(area);
            regular |= ends & trusted.mask_less(length_u) & trusted.mask_less(length_v) & clear;
            let length = area.sqrt();
            let unit = [n[0].div(length), n[1].div(length), n[2].div(length)];
            normal = select(ends, &unit, &normal);
            ended |= ends;
        }
        // Lanes that have ended step on with the others; the mask keeps what they ended with.
        last = across;
        u = u.add(step_u);
        v = v.add(step_v);
        count += 1;
    }
    let mut out = Ends {
        t: [0.0; LANES],
        local: [[0.0; LANES]; 2],
        normal: [[0.0; LANES]; 3],
        residual: [0.0; LANES],
        regular,
    };
    t.store(&mut out.t);
    end_u.store(&mut out.local[0]);
    end_v.store(&mut out.local[1]);
    residual.store(&mut out.residual);
    for c in 0..3 {
        normal[c].store(&mut out.normal[c]);
    }
    out
}

/// Points about the centres of eight patches, mm, and their derivatives by the local parameters u, then v.
#[inline(always)]
fn evaluate<V: F64x8, const N: usize, const M: usize>(
    net: &[[V; 4]],
    degree: [u8; 2],
    u: V,
    v: V,
) -> (Vectors<V>, Vectors<V>, Vectors<V>) {
    let [p, q] = [usize::from(degree[0]), usize::from(degree[1])];
    let (bu, du) = bernstein::<V, N>(p, u);
    let (bv, dv) = bernstein::<V, M>(q, v);
    let zero = V::splat(0.0);
    let (mut s, mut su, mut sv) = ([zero; 4], [zero; 4], [zero; 4]);
    for i in 0..=p {
        let (mut row, mut row_v) = ([zero; 4], [zero; 4]);
        for j in 0..=q {
            let point = &net[i * (q + 1) + j];
            for c in 0..4 {
                row[c] = bv[j].mul_add(point[c], row[c]);
                row_v[c] = dv[j].mul_add(point[c], row_v[c]);
            }
        }
        for c in 0..4 {
            s[c] = bu[i].mul_add(row[c], s[c]);
            su[c] = du[i].mul_add(row[c], su[c]);
            sv[c] = bu[i].mul_add(row_v[c], sv[c]);
        }
    }
    let inverse = V::splat(1.0).div(s[3]);
    let (mut point, mut along_u, mut along_v) = ([zero; 3], [zero; 3], [zero; 3]);
    for c in 0..3 {
        point[c] = s[c].mul(inverse);
        along_u[c] = point[c].neg_mul_add(su[3], su[c]).mul(inverse);
        along_v[c] = point[c].neg_mul_add(sv[3], sv[c]).mul(inverse);
    }
    (point, along_u, along_v)
}

/// Bernstein values of degree `n < N` at `t` of each lane, and derivatives; 0 beyond the degree.
#[inline(always)]
fn bernstein<V: F64x8, const N: usize>(n: usize, t: V) -> ([V; N], [V; N]) {
    let (zero, s) = (V::splat(0.0), V::splat(1.0).sub(t));
    let (mut b, mut d) = ([zero; N], [zero; N]);
    b[0] = V::splat(1.0);
    for k in 1..=n {
        // Before the last round `b` holds the values of one degree less, of which the derivatives are differences.
        if k == n {
            let degree = V::splat(n as f64);
            d[0] = zero.sub(b[0]).mul(degree);
            for i in 1..n {
                d[i] = b[i - 1].sub(b[i]).mul(degree);
            }
            d[n] = b[n - 1].mul(degree);
        }
        let mut saved = zero;
        for i in 0..k {
            let value = b[i];
            b[i] = s.mul_add(value, saved);
            saved = t.mul(value);
        }
        b[k] = saved;
    }
    (b, d)
}

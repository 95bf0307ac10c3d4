//! A piece of a Bézier patch over a triangle or a segment of its parameters, as a Bézier triangle or curve.
//!
//! De Casteljau's steps are taken with linear forms in place of numbers; each step raises the degree by one, so a
//! patch of degrees (p, q) gives total degree p + q. All steps are convex combinations when the triangle lies in the
//! patch, so weights stay positive and the control points hull the piece.
//! With AVX the same steps are compiled a second time, four numbers at once; no operation is fused or reordered, so the bits are
//! the same. The one unsafe call is to that copy, after the processor was asked.
//! Source: T. D. DeRose, *Composing Bézier simplexes*, ACM TOG 7 (1988).

#![allow(unsafe_code)]

use crate::math::{Homogeneous, Uv};
use crate::nurbs::BezierPatch;

/// Buffers reused from piece to piece.
#[derive(Default)]
pub(super) struct Nets {
    rows: Vec<Vec<Homogeneous>>,
    spare: Vec<Homogeneous>,
    columns: Vec<Vec<Homogeneous>>,
}

impl Nets {
    /// Control points over the simplex with 2 or 3 corners, given in local parameters.
    pub(super) fn expand<const N: usize>(&mut self, patch: &BezierPatch, corners: [Uv; N]) -> &[Homogeneous] {
        #[cfg(target_arch = "x86_64")]
        if std::is_x86_feature_detected!("avx") {
            // Sound: the processor has what the function was compiled for.
            unsafe { self.expand_wide(patch, corners) };
            return &self.columns[0];
        }
        self.expand_plain(patch, corners);
        &self.columns[0]
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx")]
    fn expand_wide<const N: usize>(&mut self, patch: &BezierPatch, corners: [Uv; N]) {
        self.expand_plain(patch, corners);
    }

    #[inline(always)]
    fn expand_plain<const N: usize>(&mut self, patch: &BezierPatch, corners: [Uv; N]) {
        let [p, q] = patch.degree;
        let (u, v) = (corners.map(|c| c.x), corners.map(|c| c.y));
        self.rows.resize_with(self.rows.len().max(p + 1), Vec::new);
        self.columns.resize_with(self.columns.len().max(q + 1), Vec::new);
        for j in 0..=q {
            for i in 0..=p {
                self.rows[i].clear();
                self.rows[i].push(patch.points[i * (q + 1) + j]);
            }
            reduce::<N>(&mut self.rows[..=p], 0, u, &mut self.spare);
            std::mem::swap(&mut self.rows[0], &mut self.columns[j]);
        }
        reduce::<N>(&mut self.columns[..=q], p, v, &mut self.spare);
    }
}

/// All de Casteljau steps of one direction; `rows[0]` holds the result.
#[inline(always)]
fn reduce<const N: usize>(
    rows: &mut [Vec<Homogeneous>],
    degree: usize,
    at: [f64; N],
    spare: &mut Vec<Homogeneous>,
) {
    for step in 0..rows.len() - 1 {
        for i in 0..rows.len() - 1 - step {
            blend::<N>(&rows[i], &rows[i + 1], degree + step, at, spare);
            std::mem::swap(&mut rows[i], spare);
        }
    }
}

/// `(1 − ℓ)·a + ℓ·b` for the linear form ℓ with values `at` at the corners; degree `d` becomes `d + 1`.
///
/// The coefficient with exponents (i, j, k) stands at `(j + k)(j + k + 1)/2 + k`, whatever i is.
#[inline(always)]
fn blend<const N: usize>(a: &[Homogeneous], b: &[Homogeneous], d: usize, at: [f64; N], out: &mut Vec<Homogeneous>) {
    out.clear();
    let inv = 1.0 / (d + 1) as f64;
    let mix = |x: usize, c: usize, times: usize| mixed(a[x], b[x], at[c], times as f64 * inv);
    if N == 2 {
        out.resize(d + 2, Homogeneous::ZERO);
        for j in 0..=d {
            out[j] += mix(j, 0, d + 1 - j);
            out[j + 1] += mix(j, 1, j + 1);
        }
        return;
    }
    out.resize((d + 2) * (d + 3) / 2, Homogeneous::ZERO);
    let (mut row, mut next) = (0, 1);
    for m in 0..=d {
        let (here, below) = out[row..].split_at_mut(m + 1);
        for k in 0..=m {
            let x = row + k;
            here[k] += mix(x, 0, d + 1 - m);
            below[k] += mix(x, 1, m + 1 - k);
            below[k + 1] += mix(x, 2, k + 1);
        }
        row = next;
        next += m + 2;
    }
}

/// `((1 − t)·a + t·b)·s`, number by number.
#[inline(always)]
fn mixed(a: Homogeneous, b: Homogeneous, t: f64, s: f64) -> Homogeneous {
    let (a, b, r) = (a.to_array(), b.to_array(), 1.0 - t);
    Homogeneous::from_array(std::array::from_fn(|k| (a[k] * r + b[k] * t) * s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::sweep;

    #[test]
    fn the_nets_evaluate_to_the_patch() {
        let s = sweep::torus(&Frame::IDENTITY, 5.0, 2.0, [0.0, 1.2], [0.3, 1.5]);
        let patch = &s.bezier_patches()[0];
        let corners = [Uv::new(0.1, 0.2), Uv::new(0.9, 0.35), Uv::new(0.4, 1.0)];
        let mut nets = Nets::default();
        let net = nets.expand(patch, corners).to_vec();
        let n = patch.degree[0] + patch.degree[1];
        let b = [0.2, 0.5, 0.3f64];
        let factorial = |k: usize| (1..=k).map(|x| x as f64).product::<f64>();
        let mut sum = Homogeneous::ZERO;
        for m in 0..=n {
            for k in 0..=m {
                let (i, j) = (n - m, m - k);
                let c = factorial(n) / factorial(i) / factorial(j) / factorial(k);
                sum +=
                    net[m * (m + 1) / 2 + k] * c * b[0].powi(i as i32) * b[1].powi(j as i32) * b[2].powi(k as i32);
            }
        }
        let at = corners[0] * b[0] + corners[1] * b[1] + corners[2] * b[2];
        assert!((sum.project() - patch.homogeneous(at)[0].project()).length() < 1e-13);
        let mut plain = Nets::default();
        plain.expand_plain(patch, corners);
        assert_eq!(plain.columns[0], net);
        let segment = nets.expand(patch, [corners[0], corners[1]]).to_vec();
        let middle = (0..=n).fold(Homogeneous::ZERO, |s, j| {
            s + segment[j] * (factorial(n) / factorial(j) / factorial(n - j) * 0.5f64.powi(n as i32))
        });
        let at = 0.5 * (corners[0] + corners[1]);
        assert!((middle.project() - patch.homogeneous(at)[0].project()).length() < 1e-13);
    }
}

//! The hot loops compiled twice: for every processor, and for those with 256-bit vectors and fused multiply-add.
//!
//! `unsafe` is needed to call a function compiled for a feature that the build as a whole does not assume. It is sound
//! because the processor is asked first. Both give the same bits: what is fused is written as `mul_add`, which rounds once
//! everywhere, and vectors of any width round alike.
#![allow(unsafe_code)]

use super::Exact;
use super::net::{self, Jet, V4};
use super::query::Query;
use super::slabs::Slabs;
use super::tree::{Node, WIDTH};
use crate::intersect::{Cost, Hit};
use crate::math::Ray;

/// Whether the wide version may run; the answer is cached by the standard library.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn is_wide() -> bool {
    std::arch::is_x86_feature_detected!("avx2")
        && std::arch::is_x86_feature_detected!("fma")
        && std::arch::is_x86_feature_detected!("bmi1")
}

/// Where a ray enters each of a node's boxes, and which of them it meets. `WIDE` only in the versions for wide processors.
#[inline(always)]
pub(super) fn meet<const WIDE: bool>(slabs: &Slabs, node: &Node) -> ([f32; WIDTH], u32) {
    #[cfg(target_arch = "x86_64")]
    if WIDE {
        // SAFETY: only functions that run where the features were found set `WIDE`.
        return unsafe { slabs.meet_wide(node) };
    }
    slabs.meet(node)
}

/// Value and derivatives of a net, for callers outside of the hot loops: [`net::evaluate`].
#[inline]
pub(super) fn evaluate(control: &[V4], degree: [u8; 2], u: f64, v: f64) -> Jet {
    #[cfg(target_arch = "x86_64")]
    if is_wide() {
        // SAFETY: the features were found.
        return unsafe { evaluate_wide(control, degree, u, v) };
    }
    net::evaluate(control, degree, u, v)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn evaluate_wide(control: &[V4], degree: [u8; 2], u: f64, v: f64) -> Jet {
    net::evaluate(control, degree, u, v)
}

impl Exact {
    /// Meets every leaf that the ray may touch.
    #[inline]
    pub(super) fn search(&self, q: &mut Query) {
        #[cfg(target_arch = "x86_64")]
        if is_wide() {
            // SAFETY: the features were found.
            return unsafe { self.walk_wide(q) };
        }
        self.walk::<false>(q);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,bmi1")]
    fn walk_wide(&self, q: &mut Query) {
        self.walk::<true>(q);
    }

    /// Finds the first hits of many rays.
    #[inline]
    pub(super) fn search_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        #[cfg(target_arch = "x86_64")]
        if is_wide() {
            // SAFETY: the features were found.
            return unsafe { self.batch_wide(rays, hits, cost) };
        }
        self.batch::<false>(rays, hits, cost);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,bmi1")]
    fn batch_wide(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        self.batch::<true>(rays, hits, cost);
    }

    /// Looks for every root on a leaf by clipping.
    #[cold]
    pub(super) fn clip(&self, q: &mut Query, leaf: u32) {
        #[cfg(target_arch = "x86_64")]
        if is_wide() {
            // SAFETY: the features were found.
            return unsafe { self.clip_wide(q, leaf) };
        }
        self.clip_leaf(q, leaf);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn clip_wide(&self, q: &mut Query, leaf: u32) {
        self.clip_leaf(q, leaf);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_and_plain_evaluation_give_the_same_bits() {
        for (p, q) in [(1, 1), (2, 2), (3, 3), (2, 3), (5, 4), (13, 6)] {
            let control = net::tests::sample(p, q);
            for k in 0..50 {
                let (u, v) = (k as f64 / 49.0, (k * 17 % 50) as f64 / 49.0);
                let degree = [p as u8, q as u8];
                let (a, b) = (evaluate(&control, degree, u, v), net::evaluate(&control, degree, u, v));
                assert_eq!((a.s, a.su, a.sv), (b.s, b.su, b.sv), "degree {p} {q}");
            }
        }
    }
}

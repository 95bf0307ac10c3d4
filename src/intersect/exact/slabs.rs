//! A ray against the boxes of the hierarchy, in `f32`, rounded so that no box that the ray meets is missed.
//!
//! The ray is taken from where it enters the box around everything, computed in `f64`, so that however far away it starts, what
//! `f32` rounds is relative to the size of the scene. From there all distances are positive, and each is right to three
//! roundings: one in the difference to the plane, one in the reciprocal, one in their product.
//!
//! `unsafe` loads and stores arrays of eight by vectors of eight.

#![allow(unsafe_code)]

use super::tree::{Node, Tree, WIDTH};
use crate::math::Ray;
use crate::math::simd::Instructions;

/// More than three roundings of `f32` on either side.
const SLACK: f32 = 1.0 + 16.0 * f32::EPSILON;

/// A ray that runs along a plane is taken to cross it at this slope, so that no reciprocal is infinite; over 1e12 mm it moves
/// nothing by more than the slack.
const LEAST_SLOPE: f64 = 1e-30;
/// Share of the scene by which the box around it is widened before rays are clipped to it: `f32` resolves no less.
const WIDENED: f64 = 1e-6;
/// Ulps of the largest coordinate by which that box is widened at least: sixteen times what shifts and reciprocals round.
const WIDENED_ULPS: f64 = 64.0;

/// A ray as the hierarchy sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct RaySlabs {
    /// Of the direction.
    inverse: [f32; 3],
    /// 1 where the ray runs against the axis.
    back: [usize; 3],
    /// The start about the tree's centre, moved so that planes met first lie nearer and planes met last farther, by more than
    /// its rounding.
    enter: [f32; 3],
    leave: [f32; 3],
    /// Where distances count from, on the ray.
    start: f64,
    /// Boxes entered beyond are of no interest.
    pub(super) end: f32,
    /// Whether the ray passes beside everything.
    pub(super) misses: bool,
}

impl RaySlabs {
    /// A ray that meets nothing.
    pub(super) const IDLE: Self = Self {
        inverse: [1.0; 3],
        back: [0; 3],
        enter: [0.0; 3],
        leave: [0.0; 3],
        start: 0.0,
        end: 0.0,
        misses: true,
    };

    /// Takes up a ray, in the world, for the boxes of `tree`.
    #[inline(always)]
    pub(super) fn restart(&mut self, ray: &Ray, tree: &Tree) {
        let (o, d) = (ray.origin, ray.direction);
        let (lo, hi) = (tree.bounds.min, tree.bounds.max);
        let reach = o.abs().max_element() + tree.center.abs().max_element();
        let beyond = WIDENED * (hi - lo).max_element() + WIDENED_ULPS * f64::EPSILON * reach;
        let (mut near, mut far) = (ray.t_min, ray.t_max);
        for k in 0..3 {
            // A finite reciprocal keeps 0 · ∞ out of the slab test.
            let inverse = 1.0 / if d[k].abs() < LEAST_SLOPE { LEAST_SLOPE.copysign(d[k]) } else { d[k] };
            let (a, b) = ((lo[k] - beyond - o[k]) * inverse, (hi[k] + beyond - o[k]) * inverse);
            let (a, b) = if a < b { (a, b) } else { (b, a) };
            near = if a > near { a } else { near };
            far = if b < far { b } else { far };
            self.inverse[k] = inverse as f32;
            self.back[k] = usize::from(inverse < 0.0);
        }
        self.start = near;
        self.misses = near > far;
        // In single precision the point is rounded outwards in every axis: a box that the true ray meets is never missed.
        let rounding = 4.0 * f64::EPSILON * (reach + near.abs());
        for k in 0..3 {
            let at = o[k] - tree.center[k] + d[k] * near;
            let (up, down) = (((at + rounding) as f32).next_up(), ((at - rounding) as f32).next_down());
            (self.enter[k], self.leave[k]) = if self.back[k] == 0 { (up, down) } else { (down, up) };
        }
        self.end_at(ray.t_max);
    }

    /// Ends the ray at `t`, mm: boxes entered beyond are not met any more.
    #[inline(always)]
    pub(super) fn end_at(&mut self, t: f64) {
        self.end = ((t - self.start).max(0.0) as f32 * SLACK).next_up();
    }

    /// What [`intersect_boxes`] returns, in plain Rust.
    #[inline(always)]
    fn intersect_boxes_portable(&self, node: &Node) -> ([f32; WIDTH], u32) {
        let (mut near, mut far) = ([0f32; WIDTH], [self.end; WIDTH]);
        for k in 0..3 {
            let (first, last) = (&node.planes[self.back[k]][k], &node.planes[1 - self.back[k]][k]);
            for i in 0..WIDTH {
                let a = (first[i] - self.enter[k]) * self.inverse[k];
                let b = (last[i] - self.leave[k]) * self.inverse[k];
                // By comparison, as the vector instructions do it, so that both give the same bits.
                near[i] = if a > near[i] { a } else { near[i] };
                far[i] = if b < far[i] { b } else { far[i] };
            }
        }
        let mut met = 0;
        for i in 0..WIDTH {
            met |= u32::from(near[i] <= far[i] * SLACK) << i;
        }
        (near, met)
    }

    /// The same bits as [`RaySlabs::intersect_boxes_portable`], all boxes side by side.
    #[cfg(target_arch = "x86_64")]
    #[inline]
    #[target_feature(enable = "avx2")]
    fn intersect_boxes_avx2(&self, node: &Node) -> ([f32; WIDTH], u32) {
        use std::arch::x86_64::*;
        let (mut near, mut far) = (_mm256_setzero_ps(), _mm256_set1_ps(self.end));
        for k in 0..3 {
            let [first, last] = [self.back[k], 1 - self.back[k]].map(|side| load_planes(&node.planes[side & 1][k]));
            let inverse = _mm256_set1_ps(self.inverse[k]);
            let a = _mm256_mul_ps(_mm256_sub_ps(first, _mm256_set1_ps(self.enter[k])), inverse);
            let b = _mm256_mul_ps(_mm256_sub_ps(last, _mm256_set1_ps(self.leave[k])), inverse);
            // Where the first is not a number both give the second, as the comparisons above do.
            near = _mm256_max_ps(a, near);
            far = _mm256_min_ps(b, far);
        }
        let met = _mm256_cmp_ps::<_CMP_LE_OQ>(near, _mm256_mul_ps(far, _mm256_set1_ps(SLACK)));
        let mut entered = [0f32; WIDTH];
        // SAFETY: the array holds eight.
        unsafe { _mm256_storeu_ps(entered.as_mut_ptr(), near) };
        (entered, _mm256_movemask_ps(met) as u32)
    }
}

/// A lower bound of where a ray enters each of a node's boxes, mm from where it enters the scene, and a bit for each box that it may meet.
#[inline(always)]
pub(super) fn intersect_boxes<I: Instructions>(slabs: &RaySlabs, node: &Node) -> ([f32; WIDTH], u32) {
    #[cfg(target_arch = "x86_64")]
    if I::AVX2 {
        // SAFETY: only kernels that run where the features were found are compiled for such instructions.
        return unsafe { slabs.intersect_boxes_avx2(node) };
    }
    slabs.intersect_boxes_portable(node)
}

#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "avx2")]
fn load_planes(row: &[f32; WIDTH]) -> std::arch::x86_64::__m256 {
    // SAFETY: the array holds eight.
    unsafe { std::arch::x86_64::_mm256_loadu_ps(row.as_ptr()) }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};

    #[test]
    fn both_tests_give_the_same_bits() {
        if !is_x86_feature_detected!("avx2") {
            return;
        }
        let mut seed = 1u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 40) as f64 / (1u64 << 24) as f64 * 2.0 - 1.0
        };
        for round in 0..2000 {
            let boxes: Vec<_> = (0..5 + round % 4)
                .map(|_| crate::math::Aabb::from_points([(); 2].map(|()| Point::new(next(), next(), next()))))
                .collect();
            let tree = Tree::build(&boxes);
            let d = Vector::new(next(), next(), if round % 7 == 0 { 0.0 } else { next() }).normalize();
            let mut slabs = RaySlabs::IDLE;
            slabs.restart(&Ray::new(Point::new(next(), next(), next()) * 3.0, d), &tree);
            let (near, met) = slabs.intersect_boxes_portable(&tree.nodes[0]);
            // SAFETY: the feature was found.
            let wide = unsafe { slabs.intersect_boxes_avx2(&tree.nodes[0]) };
            assert_eq!((near.map(f32::to_bits), met), (wide.0.map(f32::to_bits), wide.1));
        }
    }
}

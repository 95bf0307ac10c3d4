//! As [`super::ray_start`], with AVX2: all axes in one register, where compilers take them one by one.
//!
//! Sound because [`super::kernels`] takes it only where kernels may use AVX2, and because loads stay inside arrays of four numbers or are
//! masked to the three of a point.
#![allow(unsafe_code)]

use super::mesh_box::MeshBox;
use super::ray::{BoxRay, Rows, SieveRay};
use super::ray_start::{LEAST_COMPONENT, ROUNDING, enter_mesh, moved};
use crate::math::{Ray, Vector};
use std::arch::x86_64::*;

/// As [`super::ray_start::start`].
#[inline(always)]
pub(super) fn start(
    ray: &Ray,
    mesh_box: &MeshBox,
    slack: f64,
    boxes: &mut BoxRay,
    sieve: &mut SieveRay,
) -> Option<f64> {
    // SAFETY: see the head of the file.
    unsafe {
        let one = _mm256_set1_pd(1.0);
        let direction = _mm256_blend_pd::<8>(load(&ray.direction), one);
        let origin = load(&ray.origin);
        let least = _mm256_set1_pd(LEAST_COMPONENT);
        let sign = _mm256_set1_pd(-0.0);
        let is_small = _mm256_cmp_pd::<_CMP_LT_OQ>(_mm256_andnot_pd(sign, direction), least);
        let signed_least = _mm256_or_pd(least, _mm256_and_pd(sign, direction));
        let inverse = _mm256_div_pd(one, _mm256_blendv_pd(direction, signed_least, is_small));
        let after = _mm256_cmp_pd::<_CMP_GE_OQ>(origin, _mm256_loadu_pd(mesh_box.low.as_ptr()));
        let before = _mm256_cmp_pd::<_CMP_LE_OQ>(origin, _mm256_loadu_pd(mesh_box.high.as_ptr()));
        let is_inside = _mm256_movemask_pd(_mm256_and_pd(after, before)) == 15;
        let shift = match mesh_box.inner_start(ray) {
            Some(start) if is_inside => start,
            _ => enter_mesh(ray, mesh_box, numbers(origin), numbers(inverse))?,
        };
        let moved = moved(slack, shift);
        let from_center = _mm256_sub_pd(origin, _mm256_loadu_pd(mesh_box.center.as_ptr()));
        let exact = _mm256_add_pd(from_center, _mm256_mul_pd(direction, _mm256_set1_pd(shift)));
        // Not the way to the mesh as a fourth: sieves need the largest.
        let exact = _mm256_blend_pd::<8>(exact, _mm256_setzero_pd());
        let high = _mm256_cvtpd_ps(exact);
        let inverse = _mm256_cvtpd_ps(inverse);
        let sign = _mm_set1_ps(-0.0);
        let far = _mm_mul_ps(_mm_set1_ps(4.0), _mm_andnot_ps(sign, high));
        let far = _mm_add_ps(far, _mm_loadu_ps(mesh_box.reach.as_ptr()));
        let wrong = _mm_add_ps(_mm_mul_ps(far, _mm_set1_ps(ROUNDING)), _mm_set1_ps(moved));
        _mm_store_ps(boxes.origin.as_mut_ptr(), high);
        _mm_store_ps(boxes.inverse.as_mut_ptr(), inverse);
        _mm_store_ps(boxes.slack.as_mut_ptr(), _mm_mul_ps(wrong, _mm_andnot_ps(sign, inverse)));
        boxes.rows = Rows::ALL[_mm_movemask_ps(inverse) as usize & 7];
        _mm_store_ps(sieve.high.as_mut_ptr(), high);
        _mm_store_ps(sieve.low.as_mut_ptr(), _mm256_cvtpd_ps(_mm256_sub_pd(exact, _mm256_cvtps_pd(high))));
        sieve.slack = moved;
        Some(shift)
    }
}

/// The coordinates of a point or vector, and zero.
#[inline(always)]
unsafe fn load(v: &Vector) -> __m256d {
    unsafe { _mm256_maskload_pd(std::ptr::from_ref(v).cast(), _mm256_setr_epi64x(-1, -1, -1, 0)) }
}

/// The numbers of a register.
#[inline(always)]
unsafe fn numbers(v: __m256d) -> [f64; 4] {
    let mut numbers = [0.0; 4];
    unsafe { _mm256_storeu_pd(numbers.as_mut_ptr(), v) };
    numbers
}

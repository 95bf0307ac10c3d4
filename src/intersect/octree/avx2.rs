//! The walk with AVX2 and FMA.
//!
//! Sound because [`walk`] is entered only after [`available`] found both at run time, because loads stay inside the
//! fixed-size arrays of [`Node`], [`Block`] and [`BoxRay`], whose row indices are below six.
#![allow(unsafe_code)]

use super::Octree;
use super::engine::{self, Lanes};
use super::node::{Block, Node};
use super::state::{BoxRay, SiftRay, edge_error};
use crate::intersect::Cost;
use crate::intersect::facet::FacetHit;
use crate::math::Ray;
use std::arch::x86_64::*;

/// Whether this processor can run [`walk`].
pub(super) fn available() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") && is_x86_feature_detected!("bmi1")
}

/// Finds the nearest hit of each ray.
///
/// # Panics
/// Where [`available`] is false.
pub(super) fn walk(tree: &Octree, rays: &[Ray], hits: &mut [Option<FacetHit>], cost: &mut Cost) {
    #[target_feature(enable = "avx2,fma,bmi1")]
    fn run(tree: &Octree, rays: &[Ray], hits: &mut [Option<FacetHit>], cost: &mut Cost) {
        engine::walk::<Avx2>(tree, rays, hits, cost);
    }
    assert!(available());
    // SAFETY: the features were just found.
    unsafe { run(tree, rays, hits, cost) }
}

struct Avx2;

/// Component `K` in all lanes.
#[inline(always)]
unsafe fn spread<const K: i32>(v: __m128) -> __m256 {
    unsafe { _mm256_broadcastss_ps(_mm_permute_ps::<K>(v)) }
}

#[inline(always)]
unsafe fn row(node: &Node, row: u8) -> __m256 {
    unsafe {
        let bytes = node.bounds.get_unchecked(usize::from(row)).as_ptr().cast();
        _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(bytes)))
    }
}

#[inline(always)]
unsafe fn spread_at(v: &[f32; 3], axis: usize) -> __m256 {
    unsafe { _mm256_set1_ps(*v.get_unchecked(axis)) }
}

/// A row of corners against the ray's origin.
#[inline(always)]
unsafe fn coarse(block: &Block, row: usize, step: __m256, to: __m256) -> __m256 {
    unsafe {
        let corners = _mm_loadu_si128(block.corners.get_unchecked(row).as_ptr().cast());
        _mm256_fmadd_ps(_mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(corners)), step, to)
    }
}

impl Lanes for Avx2 {
    #[inline(always)]
    fn enter(node: &Node, ray: &BoxRay) -> (u32, [f32; 8]) {
        // SAFETY: see the head of the file; `near` is 0..6 by construction.
        unsafe {
            let inverse = _mm_load_ps(ray.inverse.as_ptr());
            let slack = _mm_load_ps(ray.slack.as_ptr());
            let to = _mm_sub_ps(_mm_load_ps(node.origin.as_ptr()), _mm_load_ps(ray.origin.as_ptr()));
            let base = _mm_mul_ps(to, inverse);
            let scale = _mm_mul_ps(_mm_load_ps(node.step.as_ptr()), inverse);
            let (early, late) = (_mm_sub_ps(base, slack), _mm_add_ps(base, slack));
            let (sx, sy, sz) = (spread::<0x00>(scale), spread::<0x55>(scale), spread::<0xAA>(scale));
            let [nx, ny, nz] = ray.near;
            let enter_x = _mm256_fmadd_ps(row(node, nx), sx, spread::<0x00>(early));
            let enter_y = _mm256_fmadd_ps(row(node, ny), sy, spread::<0x55>(early));
            let enter_z = _mm256_fmadd_ps(row(node, nz), sz, spread::<0xAA>(early));
            let leave_x = _mm256_fmadd_ps(row(node, nx ^ 1), sx, spread::<0x00>(late));
            let leave_y = _mm256_fmadd_ps(row(node, ny ^ 1), sy, spread::<0x55>(late));
            let leave_z = _mm256_fmadd_ps(row(node, nz ^ 1), sz, spread::<0xAA>(late));
            let enter =
                _mm256_max_ps(_mm256_max_ps(enter_x, enter_y), _mm256_max_ps(enter_z, _mm256_set1_ps(ray.t_min)));
            let leave =
                _mm256_min_ps(_mm256_min_ps(leave_x, leave_y), _mm256_min_ps(leave_z, _mm256_set1_ps(ray.t_max)));
            let leave = _mm256_mul_ps(leave, _mm256_set1_ps(1.0 + 5e-7));
            let mask = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave)) as u32;
            let mut out = [0f32; 8];
            _mm256_storeu_ps(out.as_mut_ptr(), enter);
            (mask & node.used, out)
        }
    }

    #[inline(always)]
    fn sift(block: &Block, ray: &SiftRay) -> u32 {
        // SAFETY: see the head of the file; `axes` are 0..3 by construction.
        unsafe {
            let to: [f32; 3] = std::array::from_fn(|a| (block.origin[a] - ray.high[a]) - ray.low[a]);
            let far = to[0].abs().max(to[1].abs()).max(to[2].abs());
            let error = _mm256_set1_ps(edge_error(block.step, far, ray.slack));
            let step = _mm256_set1_ps(block.step);
            let [kx, ky, kz] = ray.axes.map(usize::from);
            let (sx, sy) = (_mm256_set1_ps(ray.slopes[0]), _mm256_set1_ps(ray.slopes[1]));
            let (tx, ty, tz) = (spread_at(&to, kx), spread_at(&to, ky), spread_at(&to, kz));
            let (az, bz) = (coarse(block, kz, step, tz), coarse(block, 3 + kz, step, tz));
            let ax = _mm256_fnmadd_ps(sx, az, coarse(block, kx, step, tx));
            let ay = _mm256_fnmadd_ps(sy, az, coarse(block, ky, step, ty));
            let bx = _mm256_fnmadd_ps(sx, bz, coarse(block, 3 + kx, step, tx));
            let by = _mm256_fnmadd_ps(sy, bz, coarse(block, 3 + ky, step, ty));
            let (cx, cy) = (_mm256_permute2f128_ps::<1>(ax, ax), _mm256_permute2f128_ps::<1>(ay, ay));
            let u = _mm256_fmsub_ps(cx, by, _mm256_mul_ps(cy, bx));
            let v = _mm256_fmsub_ps(ax, cy, _mm256_mul_ps(ay, cx));
            let w = _mm256_fmsub_ps(bx, ay, _mm256_mul_ps(by, ax));
            let least = _mm256_min_ps(_mm256_min_ps(u, v), w);
            let most = _mm256_max_ps(_mm256_max_ps(u, v), w);
            let below = _mm256_cmp_ps::<_CMP_LT_OQ>(least, _mm256_sub_ps(_mm256_setzero_ps(), error));
            let above = _mm256_cmp_ps::<_CMP_GT_OQ>(most, error);
            !(_mm256_movemask_ps(_mm256_and_ps(below, above)) as u32) & 255
        }
    }
}

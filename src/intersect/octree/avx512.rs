//! What the walk does in lanes, with AVX-512: what enters and what leaves a box, or both halves of the corners of a block, in one
//! register.
//!
//! Sound because [`super::kernels`] takes it only where kernels may use the features, because loads stay inside the fixed-size arrays of
//! [`Node`] and [`Block`], and because axes are below three.
#![allow(unsafe_code)]

use super::avx2::Avx2Lanes;
use super::facet_pair::{Corners, Edges};
use super::lanes::Lanes;
use super::mesh_box::MeshBox;
use super::node::{Block, Node};
use super::quad_edges::QuadEdges;
use super::ray::{BoxRay, Entry, LEAVE_STRETCH, SieveLimits, SieveRay};
use super::ray_start_avx2;
use crate::intersect::facet::{FacetRay, Line};
use crate::math::Ray;
use std::arch::x86_64::*;

/// Sixteen lanes of f32.
pub(super) struct Avx512Lanes;

/// By [`Node::slot_order`]: the slots of children, mostly the farthest first.
#[repr(align(64))]
struct Orders([[u32; 16]; 16]);

static ORDERS: Orders = {
    let mut orders = [[0; 16]; 16];
    let mut order = 0;
    while order < 16 {
        let mut lane = 0;
        while lane < 16 {
            orders[order][lane] = (15 ^ lane ^ order) as u32;
            lane += 1;
        }
        order += 1;
    }
    Orders(orders)
};

/// Sixteen of a node's bounds from a place on, as numbers.
#[inline(always)]
unsafe fn load_bounds(node: &Node, place: u8) -> __m512 {
    unsafe {
        let bytes = node.bounds.as_ptr().byte_add(usize::from(place)).cast();
        _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(_mm_load_si128(bytes)))
    }
}

/// Exchanges the halves: lanes 4–7, then 0–3.
#[inline(always)]
unsafe fn swap_halves(v: __m256) -> __m256 {
    unsafe { _mm256_permute2f128_ps::<1>(v, v) }
}

/// The sixteen corners of a block along an axis relative to the ray's origin, mm.
#[inline(always)]
unsafe fn sieve_row(block: &Block, axis: u8, step: __m512, to: &[f32; 4]) -> __m512 {
    unsafe {
        let axis = usize::from(axis);
        let corners = _mm256_loadu_si256(block.corners.get_unchecked(axis).as_ptr().cast());
        let to = _mm512_set1_ps(*to.get_unchecked(axis));
        _mm512_fmadd_ps(_mm512_cvtepi32_ps(_mm512_cvtepu16_epi32(corners)), step, to)
    }
}

/// The four corners of one facet along an axis, then those of the other.
#[inline(always)]
unsafe fn load_pair(corners: [&Corners; 2], axis: usize) -> __m512d {
    unsafe {
        let [a, b] = [_mm256_loadu_pd(corners[0][axis].as_ptr()), _mm256_loadu_pd(corners[1][axis].as_ptr())];
        _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(a), b)
    }
}

impl Lanes for Avx512Lanes {
    #[inline(always)]
    fn start(ray: &Ray, mesh_box: &MeshBox, slack: f64, boxes: &mut BoxRay, sieve: &mut SieveRay) -> Option<f64> {
        ray_start_avx2::start(ray, mesh_box, slack, boxes, sieve)
    }

    #[inline(always)]
    fn prepare<'t>(entry: &mut Entry<'t>, node: &'t Node, ray: &BoxRay) {
        Avx2Lanes::prepare(entry, node, ray);
    }

    #[inline(always)]
    fn enter(entry: &Entry, ray: &BoxRay, enters: &mut [f32; 16], links: &mut [u32; 16]) -> u32 {
        // SAFETY: see the head of the file.
        unsafe {
            let node = entry.node;
            let order = _mm512_load_si512(ORDERS.0.get_unchecked(entry.order as usize & 15).as_ptr().cast());
            let (mut first, mut last) = ([_mm512_setzero_ps(); 3], [_mm512_setzero_ps(); 3]);
            for a in 0..3 {
                let scale = _mm512_set1_ps(entry.scale[a]);
                let (near, far) = (load_bounds(node, ray.rows.near[a]), load_bounds(node, ray.rows.far[a]));
                first[a] = _mm512_fmadd_ps(near, scale, _mm512_set1_ps(entry.near[a]));
                last[a] = _mm512_fmadd_ps(far, scale, _mm512_set1_ps(entry.far[a]));
            }
            let (t_min, t_max) = (_mm512_set1_ps(ray.t_min), _mm512_set1_ps(ray.t_max));
            let enter = _mm512_max_ps(_mm512_max_ps(first[0], first[1]), _mm512_max_ps(first[2], t_min));
            let leave = _mm512_min_ps(_mm512_min_ps(last[0], last[1]), _mm512_min_ps(last[2], t_max));
            let enter = _mm512_permutexvar_ps(order, enter);
            // Beside the slack the last few roundings scale with the distance itself.
            let leave = _mm512_mul_ps(_mm512_permutexvar_ps(order, leave), _mm512_set1_ps(LEAVE_STRETCH));
            let children = _mm512_permutexvar_epi32(order, _mm512_load_si512(node.children.as_ptr().cast()));
            // An unused child has link zero; its box means nothing.
            let used = _mm512_test_epi32_mask(children, children);
            let met = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(used, enter, leave);
            _mm512_storeu_ps(enters.as_mut_ptr(), _mm512_maskz_compress_ps(met, enter));
            _mm512_storeu_si512(links.as_mut_ptr().cast(), _mm512_maskz_compress_epi32(met, children));
            u32::from(met)
        }
    }

    #[inline(always)]
    fn sieve_limits(block: &Block, ray: &SieveRay, boxes: &BoxRay) -> SieveLimits {
        Avx2Lanes::sieve_limits(block, ray, boxes)
    }

    #[inline(always)]
    fn sift(block: &Block, ray: &SieveRay, limits: &SieveLimits, unmet: u32) -> u32 {
        // SAFETY: see the head of the file.
        unsafe {
            let (step, to) = (_mm512_set1_ps(block.step), &limits.to);
            let error = _mm256_set1_ps(limits.error);
            let [kx, ky, kz] = ray.axes;
            let [sx, sy, sz] = ray.shear;
            let z = sieve_row(block, kz, step, to);
            let x = _mm512_fnmadd_ps(_mm512_set1_ps(sx), z, sieve_row(block, kx, step, to));
            let y = _mm512_fnmadd_ps(_mm512_set1_ps(sy), z, sieve_row(block, ky, step, to));
            let t = _mm512_mul_ps(z, _mm512_set1_ps(sz));
            let (ax, bx) = (_mm512_castps512_ps256(x), _mm512_extractf32x8_ps::<1>(x));
            let (ay, by) = (_mm512_castps512_ps256(y), _mm512_extractf32x8_ps::<1>(y));
            let (at, bt) = (_mm512_castps512_ps256(t), _mm512_extractf32x8_ps::<1>(t));
            let (cx, cy, ct) = (swap_halves(ax), swap_halves(ay), swap_halves(at));
            // The edge functions of [`Avx2Lanes::sift`], with its bounds of error.
            let u = _mm256_fmsub_ps(cx, by, _mm256_mul_ps(cy, bx));
            let v = _mm256_fmsub_ps(ax, cy, _mm256_mul_ps(ay, cx));
            let w = _mm256_fmsub_ps(bx, ay, _mm256_mul_ps(by, ax));
            let least = _mm256_min_ps(_mm256_min_ps(u, v), w);
            let most = _mm256_max_ps(_mm256_max_ps(u, v), w);
            let first = _mm256_min_ps(_mm256_min_ps(at, bt), ct);
            let last = _mm256_max_ps(_mm256_max_ps(at, bt), ct);
            // Chains of comparisons, each of what the one before left; not a number is no reason to drop a facet.
            let zero = _mm256_setzero_ps();
            let within = _mm256_cmp_ps_mask::<_CMP_NGT_UQ>(first, _mm256_set1_ps(limits.t_max));
            let within = _mm256_mask_cmp_ps_mask::<_CMP_NLT_UQ>(within, last, _mm256_set1_ps(limits.t_min));
            let outside = _mm256_cmp_ps_mask::<_CMP_GT_OQ>(most, error);
            let outside = _mm256_mask_cmp_ps_mask::<_CMP_LT_OQ>(outside, _mm256_add_ps(least, error), zero);
            let facets = _mm_loadu_si128(block.facets.as_ptr().cast());
            let own = u32::from(_mm_cmpeq_epi32_mask(facets, _mm_set1_epi32(unmet as i32)));
            u32::from(within & !outside) & !(own | own << 4)
        }
    }

    #[inline(always)]
    fn pair_edges(corners: [&Corners; 2], line: &Line, edges: &mut Edges) {
        // SAFETY: see the head of the file; eight numbers are stored to arrays of eight that start at multiples of 64 bytes.
        unsafe {
            let (x, y, z) = (load_pair(corners, 0), load_pair(corners, 1), load_pair(corners, 2));
            let [ox, oy, oz] = line.origin;
            let [sx, sy, _] = line.shear;
            // Not fused, to have the bits of plain Rust.
            let z = _mm512_sub_pd(z, _mm512_set1_pd(oz));
            let x = _mm512_sub_pd(_mm512_sub_pd(x, _mm512_set1_pd(ox)), _mm512_mul_pd(_mm512_set1_pd(sx), z));
            let y = _mm512_sub_pd(_mm512_sub_pd(y, _mm512_set1_pd(oy)), _mm512_mul_pd(_mm512_set1_pd(sy), z));
            let (next_x, next_y) = (_mm512_permutex_pd::<0x39>(x), _mm512_permutex_pd::<0x39>(y));
            let outline = _mm512_sub_pd(_mm512_mul_pd(next_x, y), _mm512_mul_pd(next_y, x));
            let (x0, x2) = (_mm512_permutex_pd::<0x00>(x), _mm512_permutex_pd::<0xAA>(x));
            let (y0, y2) = (_mm512_permutex_pd::<0x00>(y), _mm512_permutex_pd::<0xAA>(y));
            let diagonal = _mm512_sub_pd(_mm512_mul_pd(x0, y2), _mm512_mul_pd(y0, x2));
            _mm512_store_pd(edges.outline.as_mut_ptr(), outline);
            _mm512_store_pd(edges.diagonal.as_mut_ptr(), diagonal);
            _mm512_store_pd(edges.heights.as_mut_ptr(), z);
            let zero = _mm512_setzero_pd();
            edges.below[0] = _mm512_cmp_pd_mask::<_CMP_LT_OQ>(outline, zero);
            edges.above[0] = _mm512_cmp_pd_mask::<_CMP_GT_OQ>(outline, zero);
            edges.below[1] = _mm512_cmp_pd_mask::<_CMP_LT_OQ>(diagonal, zero);
            edges.above[1] = _mm512_cmp_pd_mask::<_CMP_GT_OQ>(diagonal, zero);
        }
    }

    /// As with AVX2: one facet fills no wider register.
    #[inline(always)]
    fn quad_edges(corners: [&[f64; 3]; 4], ray: &FacetRay, reach: f64) -> QuadEdges {
        Avx2Lanes::quad_edges(corners, ray, reach)
    }

    #[inline(always)]
    fn open(enters: &[f32; 16], t_max: f32) -> u32 {
        // SAFETY: see the head of the file.
        unsafe {
            let enters = _mm512_loadu_ps(enters.as_ptr());
            u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(enters, _mm512_set1_ps(t_max)))
        }
    }
}

//! What the walk does in lanes, with AVX2 and FMA.
//!
//! Sound because [`super::kernels`] takes it only where kernels may use them, because loads stay inside [`Node`] and [`Block`], where
//! bounds are read from the 88th byte at most, and because axes are below three.
#![allow(unsafe_code)]

use super::lanes::Lanes;
use super::mesh_box::MeshBox;
use super::node::{Block, Node};
use super::quad_edges::QuadEdges;
use super::ray::{BoxRay, Entry, LEAVE_STRETCH, SieveLimits, SieveRay};
use super::ray_start_avx2;
use crate::intersect::facet::FacetRay;
use crate::math::Ray;
use std::arch::x86_64::*;
use std::mem::offset_of;

/// Eight lanes of f32.
pub(super) struct Avx2Lanes;

/// Eight of a node's bounds from a place on, as numbers.
#[inline(always)]
unsafe fn load_bounds(node: &Node, place: usize) -> __m256 {
    unsafe {
        let bytes = node.bounds.as_ptr().byte_add(place).cast();
        _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(bytes)))
    }
}

/// Four numbers of a node from so many bytes on.
#[inline(always)]
unsafe fn load_four(node: &Node, place: usize) -> __m128 {
    unsafe { _mm_loadu_ps(std::ptr::from_ref(node).byte_add(place).cast()) }
}

#[inline(always)]
unsafe fn broadcast_axis(v: &[f32; 4], axis: usize) -> __m256 {
    unsafe { _mm256_set1_ps(*v.get_unchecked(axis)) }
}

/// By main axis: halves of the numbers of a corner in the order of a ray's axes, the main one last but one.
#[repr(align(32))]
struct AxisOrders([[u32; 8]; 3]);

static AXIS_ORDERS: AxisOrders =
    AxisOrders([[2, 3, 4, 5, 0, 1, 6, 7], [4, 5, 0, 1, 2, 3, 6, 7], [0, 1, 2, 3, 4, 5, 6, 7]]);

/// The numbers of a corner in another order, which is given by halves as in [`AXIS_ORDERS`].
#[inline(always)]
unsafe fn ordered(corner: __m256d, order: __m256i) -> __m256d {
    unsafe { _mm256_castps_pd(_mm256_permutevar8x32_ps(_mm256_castpd_ps(corner), order)) }
}

/// The origin of a block relative to that of the ray, mm, and its step.
#[inline(always)]
unsafe fn block_from_ray(block: &Block, ray: &SieveRay) -> __m128 {
    unsafe {
        // In two parts: of a start far from the block one `f32` would lose the digits that distinguish the corners.
        let origin_and_step = std::ptr::from_ref(block).byte_add(offset_of!(Block, origin));
        let from_high = _mm_sub_ps(_mm_load_ps(origin_and_step.cast()), _mm_load_ps(ray.high.as_ptr()));
        _mm_sub_ps(from_high, _mm_load_ps(ray.low.as_ptr()))
    }
}

/// The largest size of four numbers.
#[inline(always)]
unsafe fn largest(v: __m128) -> f32 {
    unsafe {
        let sizes = _mm_andnot_ps(_mm_set1_ps(-0.0), v);
        let pairs = _mm_max_ps(sizes, _mm_movehl_ps(sizes, sizes));
        _mm_cvtss_f32(_mm_max_ss(pairs, _mm_movehdup_ps(pairs)))
    }
}

/// Eight corners of a block along an axis from the lane `first` on, relative to the ray's origin, mm.
#[inline(always)]
unsafe fn sieve_row(block: &Block, axis: usize, first: usize, step: __m256, to: __m256) -> __m256 {
    unsafe {
        let corners = _mm_loadu_si128(block.corners.get_unchecked(axis).as_ptr().add(first).cast());
        _mm256_fmadd_ps(_mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(corners)), step, to)
    }
}

/// By octant: slots of children.
#[repr(align(64))]
struct Orders([[u32; 8]; 8]);

/// By octant: the slots of children in the order in which they are pushed, so that the one met first is popped first.
static ORDERS: Orders = {
    let mut orders = [[0; 8]; 8];
    let mut octant = 0;
    while octant < 8 {
        let mut k = 0;
        while k < 8 {
            // The child in slot `p ^ octant` is mostly met as the p-th (see `octant_slots` in `flatten`): counted
            // down, because the last one pushed is the first one popped.
            orders[octant][k] = (7 ^ k ^ octant) as u32;
            k += 1;
        }
        octant += 1;
    }
    Orders(orders)
};

/// By mask: the lanes whose bits are set, one after the other.
static COMPRESSIONS: [[u8; 8]; 256] = {
    let mut compressions = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let mut lane = 0;
        let mut count = 0;
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                compressions[mask][count] = lane as u8;
                count += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    compressions
};

impl Lanes for Avx2Lanes {
    #[inline(always)]
    fn start(ray: &Ray, mesh_box: &MeshBox, slack: f64, boxes: &mut BoxRay, sieve: &mut SieveRay) -> Option<f64> {
        ray_start_avx2::start(ray, mesh_box, slack, boxes, sieve)
    }

    #[inline(always)]
    fn prepare<'t>(entry: &mut Entry<'t>, node: &'t Node, ray: &BoxRay) {
        entry.node = node;
        entry.order = node.slot_order(ray.rows.octant);
        // SAFETY: see the head of the file; what follows the origin of a node, and its steps, is read with them.
        unsafe {
            let (inverse, slack) = (_mm_load_ps(ray.inverse.as_ptr()), _mm_load_ps(ray.slack.as_ptr()));
            let to = _mm_sub_ps(load_four(node, offset_of!(Node, origin)), _mm_load_ps(ray.origin.as_ptr()));
            let step = load_four(node, offset_of!(Node, step));
            _mm_store_ps(entry.scale.as_mut_ptr(), _mm_mul_ps(step, inverse));
            // Entering is made earlier and leaving later by what `f32` may be wrong by: boxes may be met in vain but never missed.
            _mm_store_ps(entry.near.as_mut_ptr(), _mm_fmsub_ps(to, inverse, slack));
            _mm_store_ps(entry.far.as_mut_ptr(), _mm_fmadd_ps(to, inverse, slack));
        }
    }

    #[inline(always)]
    fn enter(entry: &Entry, ray: &BoxRay, enters: &mut [f32; 16], links: &mut [u32; 16]) -> u32 {
        // SAFETY: see the head of the file; eight numbers are written from the eighth place at most.
        unsafe {
            let (node, slot_order) = (entry.node, entry.order as usize);
            // Farthest first.
            let order = _mm256_load_si256(ORDERS.0.get_unchecked(slot_order & 7).as_ptr().cast());
            let (mut met, mut count) = (0, 0);
            for half in 0..2 {
                let first = 8 * (1 ^ half ^ (slot_order >> 3 & 1));
                let mut enter = _mm256_set1_ps(ray.t_min);
                let mut leave = _mm256_set1_ps(ray.t_max);
                for a in 0..3 {
                    let scale = _mm256_set1_ps(entry.scale[a]);
                    let near = load_bounds(node, usize::from(ray.rows.near[a]) + first);
                    let far = load_bounds(node, usize::from(ray.rows.far[a]) + first);
                    let near = _mm256_fmadd_ps(near, scale, _mm256_set1_ps(entry.near[a]));
                    let far = _mm256_fmadd_ps(far, scale, _mm256_set1_ps(entry.far[a]));
                    enter = _mm256_max_ps(enter, near);
                    leave = _mm256_min_ps(leave, far);
                }
                // Beside the slack the last few roundings scale with the distance itself.
                let leave = _mm256_permutevar8x32_ps(leave, order);
                let leave = _mm256_mul_ps(leave, _mm256_set1_ps(LEAVE_STRETCH));
                let enter = _mm256_permutevar8x32_ps(enter, order);
                let children = _mm256_loadu_si256(node.children.as_ptr().add(first).cast());
                let children = _mm256_permutevar8x32_epi32(children, order);
                // An unused child has link zero; its box means nothing.
                let unused = _mm256_castsi256_ps(_mm256_cmpeq_epi32(children, _mm256_setzero_si256()));
                let of_half = _mm256_andnot_ps(unused, _mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave));
                let of_half = _mm256_movemask_ps(of_half) as u32 & 255;
                // Met children are packed to the front, so that they are written above the stack in one store each.
                let packed = _mm_loadl_epi64(COMPRESSIONS.get_unchecked(of_half as usize).as_ptr().cast());
                let packed = _mm256_cvtepu8_epi32(packed);
                _mm256_storeu_ps(enters.as_mut_ptr().add(count), _mm256_permutevar8x32_ps(enter, packed));
                let children = _mm256_permutevar8x32_epi32(children, packed);
                _mm256_storeu_si256(links.as_mut_ptr().add(count).cast(), children);
                met |= of_half << (8 * half);
                count = of_half.count_ones() as usize;
            }
            met
        }
    }

    #[inline(always)]
    fn sieve_limits(block: &Block, ray: &SieveRay, boxes: &BoxRay) -> SieveLimits {
        // SAFETY: see the head of the file; after the origin of a block comes its step.
        unsafe {
            let from_ray = block_from_ray(block, ray);
            let mut to = [0.0; 4];
            _mm_storeu_ps(to.as_mut_ptr(), from_ray);
            SieveLimits::with_place(block, ray, boxes, (to, largest(from_ray)))
        }
    }

    #[inline(always)]
    fn sift(block: &Block, ray: &SieveRay, limits: &SieveLimits, unmet: u32) -> u32 {
        // SAFETY: see the head of the file; `axes` are 0..3 by construction.
        unsafe {
            let (to, error) = (&limits.to, _mm256_set1_ps(limits.error));
            let step = _mm256_set1_ps(block.step);
            let [kx, ky, kz] = ray.axes.map(usize::from);
            let [sx, sy, sz] = ray.shear;
            let (sx, sy, sz) = (_mm256_set1_ps(sx), _mm256_set1_ps(sy), _mm256_set1_ps(sz));
            let (tx, ty, tz) = (broadcast_axis(to, kx), broadcast_axis(to, ky), broadcast_axis(to, kz));
            // Corners 0 and 2 lie in one half, 1 and 3 in the other: as triangle (0, 1, 2) uses a, b and the
            // swapped a, triangle (2, 3, 0) is the same with its lanes four on.
            let (az, bz) = (sieve_row(block, kz, 0, step, tz), sieve_row(block, kz, 8, step, tz));
            let ax = _mm256_fnmadd_ps(sx, az, sieve_row(block, kx, 0, step, tx));
            let ay = _mm256_fnmadd_ps(sy, az, sieve_row(block, ky, 0, step, ty));
            let bx = _mm256_fnmadd_ps(sx, bz, sieve_row(block, kx, 8, step, tx));
            let by = _mm256_fnmadd_ps(sy, bz, sieve_row(block, ky, 8, step, ty));
            let (cx, cy) = (_mm256_permute2f128_ps::<1>(ax, ax), _mm256_permute2f128_ps::<1>(ay, ay));
            // Woop, Benthin and Wald (2013): a ray meets a triangle where its three sheared edge functions have one
            // sign. Here they may be wrong by `error`, so that only clearly opposite signs exclude it.
            let u = _mm256_fmsub_ps(cx, by, _mm256_mul_ps(cy, bx));
            let v = _mm256_fmsub_ps(ax, cy, _mm256_mul_ps(ay, cx));
            let w = _mm256_fmsub_ps(bx, ay, _mm256_mul_ps(by, ax));
            let least = _mm256_min_ps(_mm256_min_ps(u, v), w);
            let most = _mm256_max_ps(_mm256_max_ps(u, v), w);
            let below = _mm256_cmp_ps::<_CMP_LT_OQ>(least, _mm256_sub_ps(_mm256_setzero_ps(), error));
            let above = _mm256_cmp_ps::<_CMP_GT_OQ>(most, error);
            // Nor can a triangle be met that lies wholly behind the range or before it.
            let (at, bt) = (_mm256_mul_ps(az, sz), _mm256_mul_ps(bz, sz));
            let ct = _mm256_permute2f128_ps::<1>(at, at);
            let first = _mm256_min_ps(_mm256_min_ps(at, bt), ct);
            let last = _mm256_max_ps(_mm256_max_ps(at, bt), ct);
            let late = _mm256_cmp_ps::<_CMP_GT_OQ>(first, _mm256_set1_ps(limits.t_max));
            let early = _mm256_cmp_ps::<_CMP_LT_OQ>(last, _mm256_set1_ps(limits.t_min));
            let outside = _mm256_or_ps(_mm256_and_ps(below, above), _mm256_or_ps(late, early));
            let facets = _mm_loadu_si128(block.facets.as_ptr().cast());
            let own = _mm_cmpeq_epi32(facets, _mm_set1_epi32(unmet as i32));
            let own = _mm_movemask_ps(_mm_castsi128_ps(own)) as u32;
            // Negated, so that NaN keeps a facet rather than drops it.
            !(_mm256_movemask_ps(outside) as u32 | own | own << 4) & 255
        }
    }

    #[inline(always)]
    fn quad_edges(corners: [&[f64; 3]; 4], ray: &FacetRay, reach: f64) -> QuadEdges {
        // SAFETY: see the head of the file; a masked load reads three numbers, those of a corner.
        unsafe {
            let three = _mm256_setr_epi64x(-1, -1, -1, 0);
            let a = _mm256_maskload_pd(corners[0].as_ptr(), three);
            let b = _mm256_maskload_pd(corners[1].as_ptr(), three);
            let c = _mm256_maskload_pd(corners[2].as_ptr(), three);
            let d = _mm256_maskload_pd(corners[3].as_ptr(), three);
            let low = _mm256_min_pd(_mm256_min_pd(a, b), _mm256_min_pd(c, d));
            let high = _mm256_max_pd(_mm256_max_pd(a, b), _mm256_max_pd(c, d));
            let start = _mm256_maskload_pd(ray.origin.as_ptr(), three);
            let reach = _mm256_set1_pd(reach);
            // Whether the start may lie on this facet: such a facet is tested with care.
            let near = _mm256_and_pd(
                _mm256_cmp_pd::<_CMP_GE_OQ>(start, _mm256_sub_pd(low, reach)),
                _mm256_cmp_pd::<_CMP_LE_OQ>(start, _mm256_add_pd(high, reach)),
            );
            // Corners against the start in the order of the ray's axes, then axis by axis.
            let order = _mm256_load_si256(AXIS_ORDERS.0[ray.axes()[2]].as_ptr().cast());
            let origin = ordered(start, order);
            let [slope_x, slope_y, _] = ray.shear();
            let a = _mm256_sub_pd(ordered(a, order), origin);
            let b = _mm256_sub_pd(ordered(b, order), origin);
            let c = _mm256_sub_pd(ordered(c, order), origin);
            let d = _mm256_sub_pd(ordered(d, order), origin);
            let (ab, cd) = (_mm256_unpacklo_pd(a, b), _mm256_unpacklo_pd(c, d));
            let z = _mm256_permute2f128_pd::<0x31>(ab, cd);
            let x = _mm256_permute2f128_pd::<0x20>(ab, cd);
            let y = _mm256_permute2f128_pd::<0x20>(_mm256_unpackhi_pd(a, b), _mm256_unpackhi_pd(c, d));
            // Not fused, to have the bits of plain Rust.
            let x = _mm256_sub_pd(x, _mm256_mul_pd(_mm256_set1_pd(slope_x), z));
            let y = _mm256_sub_pd(y, _mm256_mul_pd(_mm256_set1_pd(slope_y), z));
            // Each corner beside the next: lane k then has the edge function from corner k + 1 to k.
            let next_x = _mm256_permute4x64_pd::<0x39>(x);
            let next_y = _mm256_permute4x64_pd::<0x39>(y);
            let outline = _mm256_sub_pd(_mm256_mul_pd(next_x, y), _mm256_mul_pd(next_y, x));
            // The diagonal alone is left, from corner 2 to corner 0.
            let third_x = _mm256_extractf128_pd::<1>(x);
            let third_y = _mm256_extractf128_pd::<1>(y);
            let forth = _mm_mul_sd(_mm256_castpd256_pd128(x), third_y);
            let back = _mm_mul_sd(_mm256_castpd256_pd128(y), third_x);
            let zero = _mm256_setzero_pd();
            let mut edges = QuadEdges {
                diagonal: _mm_cvtsd_f64(_mm_sub_sd(forth, back)),
                below: _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(outline, zero)) as u32,
                above: _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(outline, zero)) as u32,
                near: _mm256_movemask_pd(near) == 15,
                ..QuadEdges::default()
            };
            _mm256_store_pd(edges.outline.as_mut_ptr(), outline);
            _mm256_store_pd(edges.heights.as_mut_ptr(), z);
            edges
        }
    }

    #[inline(always)]
    fn open(enters: &[f32; 16], t_max: f32) -> u32 {
        // SAFETY: see the head of the file.
        unsafe {
            let t_max = _mm256_set1_ps(t_max);
            // Of the topmost eight nearly always one is.
            let high = _mm256_cmp_ps::<_CMP_LE_OQ>(_mm256_loadu_ps(enters.as_ptr().add(8)), t_max);
            let high = _mm256_movemask_ps(high) as u32;
            if high != 0 {
                return high << 8;
            }
            _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(_mm256_loadu_ps(enters.as_ptr()), t_max)) as u32
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::octree::portable::Portable;

    /// Of sixteen entries the lower eight are looked at where none above them is open.
    #[test]
    fn an_open_entry_is_found_wherever_it_lies() {
        if !(is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")) {
            return;
        }
        for open in 0..16 {
            let mut enters = [2.0; 16];
            enters[open] = 1.0;
            let found = [Avx2Lanes::open(&enters, 1.5), Portable::open(&enters, 1.5)];
            assert_eq!(found, [1 << open; 2]);
        }
    }
}

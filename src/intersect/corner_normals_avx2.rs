//! [`super::corner_normals`] with AVX2, a vector a register: its arithmetic step by step, so that all have its bits.
//! Of a ray that a batch answers in 150 ns, plain Rust takes 20 for it.
//!
//! Sound because kernels take it only where the processor has AVX2, and because loads stay inside a vertex, whose parameters follow its
//! normal, or are masked to the three numbers of a position.
#![allow(unsafe_code)]

use super::corner_normals::{CornerNormals, triangle, weights};
use super::facet::FacetHit;
use crate::math::{Point, Uv, Vector};
use crate::mesh::{FacetMesh, MeshVertex};
use std::arch::x86_64::*;
use std::mem::offset_of;

/// What [`super::corner_normals::corner_normals`] gives in plain Rust.
#[inline(always)]
pub(super) fn corner_normals(mesh: &FacetMesh, hit: &FacetHit) -> CornerNormals {
    const { assert!(offset_of!(MeshVertex, uv) == offset_of!(MeshVertex, normal) + size_of::<Vector>()) };
    let facet = &mesh.facets[hit.facet as usize];
    let vertices = facet.vertices.map(|v| &mesh.vertices[v as usize]);
    let [a, b, c] = triangle(hit.second, vertices.map(|v| v.position)).map(|p| &mesh.positions[p as usize]);
    let weights = weights(facet, hit);
    // SAFETY: see the head of the file.
    unsafe {
        let (a, b, c) = (load(a), load(b), load(c));
        let (u, v) = (_mm256_sub_pd(b, a), _mm256_sub_pd(c, a));
        let turned = _mm256_sub_pd(_mm256_mul_pd(u, next_axis(v)), _mm256_mul_pd(v, next_axis(u)));
        let flat = next_axis(turned);
        // With each normal the first of the parameters.
        let mut sum = _mm256_setzero_pd();
        let mut v = 0.0;
        for k in 0..4 {
            let row = _mm256_loadu_pd(std::ptr::from_ref(&vertices[k].normal).cast());
            let part = _mm256_mul_pd(row, _mm256_set1_pd(weights[k]));
            sum = if k == 0 { part } else { _mm256_add_pd(sum, part) };
            let part = vertices[k].uv.y * weights[k];
            v = if k == 0 { part } else { v + part };
        }
        let u = _mm256_cvtsd_f64(_mm256_permute4x64_pd::<3>(sum));
        let [flat, smooth] = normals([flat, sum]);
        CornerNormals { flat: vector(flat), smooth: vector(smooth), uv: Uv::new(u, v) }
    }
}

/// The coordinates of a point, and zero.
#[inline(always)]
unsafe fn load(p: &Point) -> __m256d {
    unsafe { _mm256_maskload_pd(std::ptr::from_ref(p).cast(), _mm256_setr_epi64x(-1, -1, -1, 0)) }
}

/// y, z and x of a vector.
#[inline(always)]
unsafe fn next_axis(v: __m256d) -> __m256d {
    unsafe { _mm256_permute4x64_pd::<0b11_00_10_01>(v) }
}

/// Two vectors of unit length as `glam` makes them, with roots and inverses of both at once. Where it makes none of the first it is zero,
/// of the second it is the first.
#[inline(always)]
unsafe fn normals([flat, smooth]: [__m256d; 2]) -> [__m256d; 2] {
    unsafe {
        let squares = _mm_unpacklo_pd(square(flat), square(smooth));
        let inverse = _mm_div_pd(_mm_set1_pd(1.0), _mm_sqrt_pd(squares));
        let (of_flat, of_smooth) = (_mm_cvtsd_f64(inverse), _mm_cvtsd_f64(_mm_unpackhi_pd(inverse, inverse)));
        let is_usable = |inverse: f64| inverse > 0.0 && inverse < f64::INFINITY;
        let flat =
            if is_usable(of_flat) { _mm256_mul_pd(flat, _mm256_set1_pd(of_flat)) } else { _mm256_setzero_pd() };
        let smooth = if is_usable(of_smooth) { _mm256_mul_pd(smooth, _mm256_set1_pd(of_smooth)) } else { flat };
        [flat, smooth]
    }
}

/// The sum of the squares of the first three numbers, in the lowest place.
#[inline(always)]
unsafe fn square(v: __m256d) -> __m128d {
    unsafe {
        let squares = _mm256_mul_pd(v, v);
        let xy = _mm256_castpd256_pd128(squares);
        _mm_add_sd(_mm_add_sd(xy, _mm_unpackhi_pd(xy, xy)), _mm256_extractf128_pd::<1>(squares))
    }
}

/// The first three numbers.
#[inline(always)]
unsafe fn vector(v: __m256d) -> Vector {
    let mut numbers = [0.0; 4];
    unsafe { _mm256_storeu_pd(numbers.as_mut_ptr(), v) };
    let [x, y, z, _] = numbers;
    Vector::new(x, y, z)
}

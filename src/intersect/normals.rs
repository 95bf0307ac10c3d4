//! From a facet hit to the answer: surface parameters and the normal to shade with.
//!
//! On a mesh of size h the normals of the flat triangle and of the nearest corner are wrong by O(h), those of the bilinear
//! rule by O(h²), and for a slanted ray most of that is because it meets the facet beside the point where it would meet the surface.
//! The cubic patch is met where the ray meets it, by two Newton steps from the facet hit. It is of order 2 as well, four times
//! below the bilinear rule and more: its twists are wrong by O(h³) where the surface has third derivatives; without them the order is 3.
//! Weakness: all but the flat normal are only as good as the vertex normals of the
//! mesh; across a crease inside a facet, which no vertex records, the cubic patch is no better than the bilinear rule.

use super::corner_normals::{CornerNormals, corner_normals, triangle};
use super::cubic_patch::cubic_normal;
use super::facet::FacetHit;
use super::prefetch::prefetch;
use super::{Certainty, Hit, NormalMode};
use crate::math::simd::{Instructions, Kernel};
use crate::math::{QuadHalf, Ray, Vector};
use crate::mesh::{Facet, FacetMesh};

/// Turns a facet hit into what the trait reports: parameters, flat normal and the normal of `mode`; `Exact` is treated as `Bilinear`.
/// A normal that cancels to zero is replaced: the bilinear or nearest one by the flat one, the cubic one by the bilinear one.
#[inline(never)]
pub(crate) fn describe(mesh: &FacetMesh, ray: &Ray, hit: &FacetHit, mode: NormalMode) -> Hit {
    answer(mesh, ray, hit, mode, corner_normals(mesh, hit))
}

/// The hits of a batch, described: what [`describe`] makes of each of `found` and its ray goes to `hits`; all are of one length.
pub(super) struct DescribeBatch<'a> {
    pub(super) mesh: &'a FacetMesh,
    pub(super) rays: &'a [Ray],
    pub(super) found: &'a [Option<FacetHit>],
    pub(super) hits: &'a mut [Option<Hit>],
    pub(super) mode: NormalMode,
}

impl Kernel for DescribeBatch<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        let Self { mesh, rays, found, hits, mode } = self;
        for (i, hit) in hits.iter_mut().enumerate() {
            prefetch_ahead(mesh, found, i);
            *hit = None;
            // Not in a closure, which would be compiled without the kernel's instructions.
            if let Some(found) = &found[i] {
                *hit = Some(answer(mesh, &rays[i], found, mode, normals_with::<I>(mesh, found)));
            }
        }
    }
}

/// As [`corner_normals`], with the instructions of a kernel.
#[inline(always)]
fn normals_with<I: Instructions>(mesh: &FacetMesh, hit: &FacetHit) -> CornerNormals {
    #[cfg(target_arch = "x86_64")]
    if I::AVX2 {
        return super::corner_normals_avx2::corner_normals(mesh, hit);
    }
    corner_normals(mesh, hit)
}

/// Prefetches what the next hits will be described with: the facet of the 12th after the `i`-th, and the vertex records (normal,
/// parameters) of the 6th. Positions are in the cache, tested just now. Without it describing took 40 % of the time at 200k facets.
#[inline(always)]
fn prefetch_ahead(mesh: &FacetMesh, found: &[Option<FacetHit>], i: usize) {
    // Of a miss the first facet: a branch on whether there is a hit would be guessed wrong.
    let facet = |ahead: usize| found.get(i + ahead).map_or(0, |hit| hit.map_or(0, |hit| hit.facet as usize));
    prefetch(&mesh.facets, facet(12));
    if let Some(facet) = mesh.facets.get(facet(6)) {
        for v in facet.vertices {
            prefetch(&mesh.vertices, v as usize);
        }
    }
}

/// The answer for a hit with these normals.
#[inline(always)]
fn answer(mesh: &FacetMesh, ray: &Ray, hit: &FacetHit, mode: NormalMode, normals: CornerNormals) -> Hit {
    let facet = &mesh.facets[hit.facet as usize];
    let CornerNormals { flat, smooth, uv } = normals;
    let normal = match mode {
        NormalMode::Flat => flat,
        NormalMode::Nearest => nearest(hit, mesh, facet).normalize_or(flat),
        NormalMode::Bilinear | NormalMode::Exact => smooth,
        NormalMode::Cubic => cubic_normal(mesh, facet, ray, hit, flat).normalize_or(smooth),
    };
    Hit {
        t: hit.t,
        normal,
        geometric_normal: flat,
        face: facet.face,
        primitive: hit.facet,
        triangle: Some(if hit.second { QuadHalf::Second } else { QuadHalf::First }),
        uv,
        certainty: Certainty::Facet,
    }
}

/// Returns the vertex normal of the corner nearest to the hit; of equally near ones the first.
#[inline(never)]
fn nearest(hit: &FacetHit, mesh: &FacetMesh, facet: &Facet) -> Vector {
    let vertices = facet.vertices.map(|v| &mesh.vertices[v as usize]);
    let corners = vertices.map(|v| mesh.positions[v.position as usize]);
    let [a, b, c] = triangle(hit.second, corners);
    let at = a * hit.b[0] + b * hit.b[1] + c * hit.b[2];
    let distance = |i: usize| (corners[i] - at).length_squared();
    let closest = (1..4).fold(0, |best, i| if distance(i) < distance(best) { i } else { best });
    vertices[closest].normal
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::simd::Level;
    use crate::math::{FaceId, Point, Uv};
    use crate::mesh::MeshVertex;

    /// Quads, triangles, facets without area and normals that cancel, hit on either triangle: every instruction set has the same bits.
    #[test]
    fn a_batch_is_described_as_hits_one_by_one_are() {
        let number = |k: usize, m: f64| (k as f64 * m).fract() - 0.5;
        let point = |k: usize| Point::new(number(k, 0.618), number(k, 0.755), number(k, 0.569));
        let positions: Vec<Point> = (0..60).map(|k| point(k) * 40.0).collect();
        let vertex = |k: usize| {
            let normal = point(k / 2 + 7).normalize() * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            MeshVertex { position: k as u32, normal, uv: Uv::new(number(k, 0.37), number(k, 0.91)) }
        };
        let facet = |k: u32| Facet {
            vertices: [4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3].map(|v| match k {
                0 => 0,
                k if k.is_multiple_of(3) => v.min(4 * k + 2),
                _ => v,
            }),
            face: FaceId(k),
        };
        let vertices = (0..60).map(vertex).collect();
        let mesh = FacetMesh { positions, vertices, facets: (0..15).map(facet).collect(), sag: vec![] };
        let hit = |k: usize| {
            let [b1, b2] =
                if k.is_multiple_of(4) { [0.5, 0.0] } else { [0.3, 0.4].map(|b| b + number(k, 0.21) * 0.5) };
            let facet = k as u32 % 15;
            let second = k % 2 == 1 && !mesh.facets[facet as usize].is_triangle();
            (!k.is_multiple_of(7)).then_some(FacetHit { t: k as f64, facet, second, b: [1.0 - b1 - b2, b1, b2] })
        };
        let found: Vec<_> = (0..500).map(hit).collect();
        let rays = vec![Ray::new(Point::ZERO, Vector::X); found.len()];
        for mode in NormalMode::ALL {
            let described = |hit: Option<FacetHit>| hit.map(|hit| describe(&mesh, &rays[0], &hit, mode));
            let expected: Vec<_> = found.iter().map(|hit| described(*hit)).collect();
            for level in [Level::PORTABLE, Level::avx2(), Level::widest()] {
                let mut hits = vec![None; found.len()];
                level.run(DescribeBatch { mesh: &mesh, rays: &rays, found: &found, hits: &mut hits, mode });
                assert_eq!(hits, expected, "{level:?} {mode}");
            }
        }
    }
}

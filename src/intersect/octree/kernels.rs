//! The walk compiled for each instruction set, with its lanes.

#[cfg(target_arch = "x86_64")]
use super::avx2::Avx2Lanes;
#[cfg(target_arch = "x86_64")]
use super::avx512::Avx512Lanes;
use super::light_buffer::LightBuffer;
use super::portable;
use super::tree::Tree;
use super::walk;
use crate::intersect::Cost;
use crate::intersect::facet::FacetHit;
use crate::math::Ray;
use crate::math::simd::{Instructions, Kernel};

/// Finds the nearest hit of each ray and overwrites `hits`, which is as long as `rays`; `light_buffers` may answer some of them.
pub(super) struct Walk<'a, 'm> {
    pub(super) tree: &'a Tree<'m>,
    pub(super) light_buffers: &'a [LightBuffer],
    pub(super) rays: &'a [Ray],
    pub(super) hits: &'a mut [Option<FacetHit>],
    pub(super) cost: &'a mut Cost,
}

impl Kernel for Walk<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        #[cfg(target_arch = "x86_64")]
        {
            if I::AVX512 {
                return walk::walk::<Avx512Lanes>(self.tree, self.light_buffers, self.rays, self.hits, self.cost);
            }
            if I::AVX2 {
                return walk::walk::<Avx2Lanes>(self.tree, self.light_buffers, self.rays, self.hits, self.cost);
            }
        }
        walk::walk::<portable::Portable>(self.tree, self.light_buffers, self.rays, self.hits, self.cost);
    }
}

//! The walk compiled twice: for every processor, and for those with 256-bit vectors. Both give the same bits.
//!
//! `unsafe` is needed to call a function compiled for a feature that the build as a whole does not assume. It is sound
//! because [`Width::detect`] alone makes [`Width::Avx2`], after asking the processor. Nothing else differs: additions and
//! multiplications are not fused, so vectors of any width round alike.
#![allow(unsafe_code)]

use super::Exact;
use super::query::Query;

/// What the processor offers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Width {
    Any,
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Width {
    pub(super) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            return Self::Avx2;
        }
        Self::Any
    }
}

impl Exact {
    /// Meets every leaf that the ray may touch.
    #[inline]
    pub(super) fn search(&self, q: &mut Query) {
        match self.width {
            Width::Any => self.walk(q),
            // SAFETY: `Width::detect` has found the feature.
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => unsafe { self.walk_avx2(q) },
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn walk_avx2(&self, q: &mut Query) {
        self.walk(q);
    }
}

//! Asking for memory ahead of its use.
//!
//! Sound because the instruction is part of every x86-64, reads nothing and never faults, whatever the address.
#![allow(unsafe_code)]

/// Asks for the cache lines of one element; does nothing where the processor is not known.
#[inline(always)]
pub(super) fn prefetch<T>(slice: &[T], index: usize) {
    prefetch_range(slice, index, 1);
}

/// Asks for the cache lines of `count` elements.
#[inline(always)]
pub(super) fn prefetch_range<T>(slice: &[T], first: usize, count: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let start = slice.as_ptr().wrapping_add(first).cast::<i8>();
        let mut line = 0;
        while line < count * size_of::<T>() {
            // SAFETY: see the head of the file.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(line)) };
            line += 64;
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (slice, first, count);
}

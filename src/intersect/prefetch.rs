//! Prefetching memory ahead of its use.
//!
//! Sound because the instruction is part of every x86-64, reads nothing and never faults, whatever the address.
#![allow(unsafe_code)]
#![cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]

/// Bytes of a cache line on every x86-64.
const LINE: usize = 64;

/// Prefetches the cache lines of one element, without waiting; does nothing but on x86-64. An index out of bounds is harmless.
#[inline(always)]
pub(crate) fn prefetch<T>(slice: &[T], index: usize) {
    prefetch_range(slice, index, 1);
}

/// Prefetches the cache lines of `count` elements from `first` on. A range out of bounds is harmless.
#[inline(always)]
pub(crate) fn prefetch_range<T>(slice: &[T], first: usize, count: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let start = slice.as_ptr().wrapping_add(first).cast::<i8>();
        let mut line = 0;
        while line < count * size_of::<T>() {
            // SAFETY: see the head of the file.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(line)) };
            line += LINE;
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (slice, first, count);
}

/// Prefetches so many cache lines from an address on, which may be any.
#[inline(always)]
pub(crate) fn prefetch_lines<const LINES: usize>(start: *const u8) {
    #[cfg(target_arch = "x86_64")]
    for line in 0..LINES {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: see the head of the file.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(line * LINE).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = start;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_smaller_than_a_cache_line_are_prefetched() {
        let small = [1u8, 2, 3];
        let large = [[0u64; 32]; 2];
        // The index may be out of bounds: nothing is read.
        prefetch(&small, 1000);
        prefetch(&large, 7);
        prefetch_lines::<3>(std::ptr::null());
    }
}

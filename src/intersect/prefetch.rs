//! Asking for memory ahead of its use.
//!
//! Sound because the instruction is part of every x86-64, reads nothing and never faults, whatever the address.
#![allow(unsafe_code)]
#![cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]

/// Bytes of a cache line on every x86-64.
const LINE: usize = 64;

/// Asks for the cache lines of one element, without waiting; does nothing but on x86-64. An index out of bounds is harmless.
#[inline(always)]
pub(crate) fn prefetch<T>(slice: &[T], index: usize) {
    prefetch_range(slice, index, 1);
}

/// Asks for the cache lines of `count` elements from `first` on. A range out of bounds is harmless.
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

/// Asks for the cache lines of one element of either slice, without a branch on which. An index out of bounds is harmless.
#[inline(always)]
pub(crate) fn prefetch_either<T, U>(choice: bool, yes: (&[T], usize), no: (&[U], usize)) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        use std::hint::select_unpredictable;
        let a = yes.0.as_ptr().wrapping_add(yes.1).cast::<i8>();
        let b = no.0.as_ptr().wrapping_add(no.1).cast::<i8>();
        let start = select_unpredictable(choice, a, b);
        let size = select_unpredictable(choice, size_of::<T>(), size_of::<U>());
        let mut line = 0;
        while line < size_of::<T>().max(size_of::<U>()) {
            // SAFETY: see the head of the file.
            // The smaller element's last line may be asked for twice; one below a line long is asked for at its start.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(line.min(size.saturating_sub(LINE)))) };
            line += LINE;
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (choice, yes, no);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_smaller_than_a_cache_line_are_asked_for() {
        let small = [1u8, 2, 3];
        let large = [[0u64; 32]; 2];
        // The index may be out of bounds: nothing is read.
        for choice in [true, false] {
            prefetch_either(choice, (&small, 2), (&large, 7));
            prefetch_either(choice, (&large, 1), (&small, 1000));
        }
        prefetch(&small, 1);
    }
}

//! Asking for memory ahead of its use.
//!
//! Sound because the instruction is part of every x86-64, reads nothing and never faults, whatever the address.
#![allow(unsafe_code)]

/// Asks for the cache lines of one element; does nothing where the processor is not known.
#[inline(always)]
pub(crate) fn prefetch<T>(slice: &[T], index: usize) {
    prefetch_range(slice, index, 1);
}

/// Asks for the cache lines of `count` elements.
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
            line += 64;
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
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(line.min(size - 64))) };
            line += 64;
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (choice, yes, no);
}

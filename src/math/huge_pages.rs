//! Memory in huge pages where the system offers them: the random nodes of a large tree otherwise miss the cache of page
//! tables. In small pages prefetching alone took 18 % of the walk at 200k facets.
//!
//! Large vectors are as long as whole huge pages, for Linux then begins them at one, and have no small pages at their beginning: at both
//! ends of seven arrays these took a tenth of the start of a run whose tree is read.
//!
//! Sound because advice changes how memory is paged, never what it holds.
#![allow(unsafe_code)]

/// Bytes below which nothing is gained.
const SMALLEST: usize = 4 << 20;
/// Bytes of a huge page.
const HUGE_PAGE: usize = 2 << 20;
/// Bytes that the C library puts before and behind a block at most, alignment to a line of the cache among them.
const AROUND: usize = 256;

/// Allocates an empty vector with room for `count` elements; asks Linux to back 4 MiB and more with huge pages.
pub(crate) fn with_capacity<T>(count: usize) -> Vec<T> {
    let vector = Vec::<T>::with_capacity(room::<T>(count));
    let bytes = vector.capacity() * size_of::<T>();
    if bytes >= SMALLEST {
        advise(vector.as_ptr() as usize, bytes);
    }
    vector
}

/// Asks for huge pages under the first 20 MB that a program allocates piece by piece. To be called first of all: 6000 faults of small pages
/// took a tenth of a run of 10⁴ rays.
///
/// The C library takes blocks from its heap up to the size of the largest that was freed elsewhere, and keeps the end of the heap, up to
/// twice that, for what comes; other libraries only allocate the memory.
#[cfg(feature = "cli")]
pub(crate) fn prepare_heap() {
    const LARGEST_OF_HEAP: usize = 12 << 20;
    const HALF_OF_KEPT: usize = 8 << 20;
    drop(std::hint::black_box(Vec::<u8>::with_capacity(LARGEST_OF_HEAP)));
    // Both at once, or the second would take the place of the first.
    let halves: [Vec<u8>; 2] = [with_capacity(HALF_OF_KEPT), with_capacity(HALF_OF_KEPT)];
    drop(halves);
}

/// Returns how many elements fill the huge pages that `count` of them need with what the allocator puts around them; `count` of small
/// vectors.
fn room<T>(count: usize) -> usize {
    let bytes = count.saturating_mul(size_of::<T>());
    if bytes < SMALLEST {
        return count;
    }
    // Address space alone: of the last page no more is used.
    let whole = bytes.saturating_add(AROUND).checked_next_multiple_of(HUGE_PAGE);
    whole.map_or(count, |whole| count.max((whole - AROUND) / size_of::<T>()))
}

/// Asks the system for huge pages under the `bytes` from the address `start` on; does nothing but on Linux.
#[cfg(target_os = "linux")]
fn advise(start: usize, bytes: usize) {
    const PAGE: usize = 4096;
    // Outward, to the beginning of the huge page before which the allocator has its own bytes.
    let first = start / PAGE * PAGE;
    let end = (start + bytes).next_multiple_of(PAGE);
    // The allocator has written its own bytes before the vector: that page is a small one, and would be followed by 511 others.
    let advice = [(end - first, libc::MADV_HUGEPAGE), (HUGE_PAGE, libc::MADV_COLLAPSE)];
    for (bytes, advice) in advice {
        // SAFETY: see the head of the file. A refusal is no error: the memory is then paged as usual.
        unsafe { libc::madvise(first as *mut libc::c_void, bytes, advice) };
    }
}

#[cfg(not(target_os = "linux"))]
fn advise(_: usize, _: usize) {}

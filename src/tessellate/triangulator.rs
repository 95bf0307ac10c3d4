//! The door to the triangulation library: whatever it does with one face costs that face alone.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    /// Whether this thread is inside [`catch_panic`].
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic on this thread would be caught and reported as the failure of one face: a program's own panic hook keeps quiet then.
pub fn is_panic_guarded() -> bool {
    GUARDED.get()
}

/// The library gave up on a face by a panic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GaveUp;

/// Runs work that calls the library. What the work owns is dropped when the library panics, so that no state broken half-way is seen.
///
/// The panic hook of the process still runs; it learns from [`is_panic_guarded`] that nothing is lost.
pub(super) fn catch_panic<T>(work: impl FnOnce() -> T) -> Result<T, GaveUp> {
    // Guarded work may be inside of guarded work: what was before comes back.
    let outer = GUARDED.replace(true);
    let result = catch_unwind(AssertUnwindSafe(work)).map_err(|_| GaveUp);
    GUARDED.set(outer);
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_caught() {
        assert_eq!(catch_panic(|| 3), Ok(3));
        assert_eq!(catch_panic(|| -> u32 { panic!("as the library does") }), Err(GaveUp));
        assert_eq!(catch_panic(is_panic_guarded), Ok(true));
        assert!(!is_panic_guarded());
    }
}

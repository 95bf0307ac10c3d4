//! The door to the triangulation library: whatever it does with one face costs that face alone.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// The library gave up on a face by a panic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GaveUp;

/// Runs work that calls the library. What the work owns is dropped when the library panics, so that no state broken half-way is seen.
///
/// The panic's message still goes to the panic hook.
pub(super) fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, GaveUp> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|_| GaveUp)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_caught() {
        assert_eq!(guarded(|| 3), Ok(3));
        assert_eq!(guarded(|| -> u32 { panic!("as the library does") }), Err(GaveUp));
    }
}

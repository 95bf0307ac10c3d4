//! Outcome of a command that ended without an error.

/// Outcome of a command that ended without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Completion {
    /// Exit code 0.
    Complete,
    /// Exit code 4: done, but more was refused or lost than allowed.
    Incomplete,
}

impl Completion {
    /// Returns the worse of two.
    pub(crate) fn and(self, other: Self) -> Self {
        if self == Self::Complete { other } else { self }
    }

    /// Incomplete if `short`, else complete.
    pub(crate) fn incomplete_if(short: bool) -> Self {
        if short { Self::Incomplete } else { Self::Complete }
    }
}

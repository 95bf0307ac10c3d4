//! Ranges of the source and of the arenas.

/// A range of the source or of an arena.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::step) struct Span {
    pub(super) start: u32,
    pub(super) len: u32,
}

impl Span {
    pub(super) fn range(self) -> std::ops::Range<usize> {
        self.start as usize..self.start as usize + self.len as usize
    }
}

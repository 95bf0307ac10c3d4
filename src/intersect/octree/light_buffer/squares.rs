//! The squares of a light buffer, and the facets that rays through each may meet.

use super::buffer_facet::BufferFacet;
use super::view::View;

/// Squares along each side of a divided square.
pub(super) const DIVISIONS: usize = 4;
/// Set in [`Square::count`] where the square is divided.
pub(super) const DIVIDED: u32 = 1 << 31;

/// The facets of a square, or where its own squares begin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Square {
    /// Where its entries or squares begin, and how many there are.
    pub(super) first: u32,
    pub(super) count: u32,
}

/// A facet that a ray may meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Entry {
    /// It lies nowhere nearer than this, in the depth of the buffer.
    pub(super) near: f32,
    /// Index into [`LightBuffer::facets`].
    pub(super) facet: u32,
}

/// The buffers of one source.
#[derive(Clone, Debug)]
pub(crate) struct LightBuffer {
    pub(super) view: View,
    /// Squares along an edge of each grid.
    pub(super) side: usize,
    /// Those of the buffer, side after side of the cube, then those of divided squares.
    pub(super) squares: Vec<Square>,
    pub(super) entries: Vec<Entry>,
    pub(super) facets: Vec<BufferFacet>,
}

impl LightBuffer {
    /// Bytes of its arrays.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.squares) + size_of_val(&*self.entries) + size_of_val(&*self.facets)
    }

    /// The facets that a ray may meet through a place, from 0 to 1, in a square of the buffer, the nearest first; none where it meets none.
    #[inline(always)]
    pub(super) fn entries(&self, square: u32, [mut x, mut y]: [f64; 2]) -> &[Entry] {
        let mut square = self.squares[square as usize];
        // Four or so levels at most, and none for most squares.
        while square.count & DIVIDED != 0 {
            (x, y) = (x * DIVISIONS as f64, y * DIVISIONS as f64);
            let (i, j) = ((x as usize).min(DIVISIONS - 1), (y as usize).min(DIVISIONS - 1));
            (x, y) = (x - i as f64, y - j as f64);
            square = self.squares[square.first as usize + j * DIVISIONS + i];
        }
        &self.entries[square.first as usize..(square.first + square.count) as usize]
    }
}

//! Cells of the growing tree and the facets in them.

use super::clip::Box32;

/// A facet in a cell, with the box around its part inside, relative to the middle of the mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClippedFacet {
    pub(super) facet: u32,
    pub(super) bounds: Box32,
}

/// A cell with something in it.
#[derive(Debug)]
pub(super) struct Cell {
    pub(super) bounds: Box32,
    pub(super) content: Content,
}

/// What a cell holds.
#[derive(Debug)]
pub(super) enum Content {
    /// Up to four facets; the count, then the facets.
    Block(u8, [u32; 4]),
    Cells(Vec<Cell>),
}

/// The box around the parts of all facets; empty without facets.
pub(super) fn bounds(facets: &[ClippedFacet]) -> Box32 {
    let mut all = Box32::EMPTY;
    for facet in facets {
        all.union(&facet.bounds);
    }
    all
}

//! Cells of the growing tree and the facets in them.

use super::clip::Box32;
use super::node_areas::NodeAreas;

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
    Cells(Box<InnerCell>),
}

/// Cells in a cell.
#[derive(Debug)]
pub(super) struct InnerCell {
    /// At least two, at most [`CHILDREN`](super::node::CHILDREN).
    pub(super) cells: Vec<Cell>,
    node_areas: NodeAreas,
}

impl Cell {
    /// A cell with these, at least two, in it.
    pub(super) fn of_cells(bounds: Box32, cells: Vec<Cell>) -> Self {
        let node_areas = NodeAreas::of_cells(cells.iter().map(Self::node_areas), bounds.half_area());
        Self { bounds, content: Content::Cells(Box::new(InnerCell { cells, node_areas })) }
    }

    /// What the choice of nodes has to know of it.
    pub(super) fn node_areas(&self) -> &NodeAreas {
        match &self.content {
            Content::Block(..) => &NodeAreas::BLOCK,
            Content::Cells(inner) => &inner.node_areas,
        }
    }
}

/// The box around the parts of all facets; empty without facets.
pub(super) fn bounds(facets: &[ClippedFacet]) -> Box32 {
    let mut all = Box32::EMPTY;
    for facet in facets {
        all.union(&facet.bounds);
    }
    all
}

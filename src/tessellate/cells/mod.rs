//! The inside of a face: a tree of rectangles, each proved as a facet, and the grid of facets that they make.

pub(in crate::tessellate) mod branches;
pub(in crate::tessellate) mod candidate_facet;
pub(in crate::tessellate) mod cell;
pub(in crate::tessellate) mod cell_facets;
pub(in crate::tessellate) mod grid;
mod grid_lines;
mod preferred_cuts;
mod through_cuts;
mod tree;

//! The inside of a face: a tree of rectangles, each proved as a facet, and the rows and lines they meet on.

pub(in crate::tessellate) mod grid;
pub(in crate::tessellate) mod ladder;
pub(in crate::tessellate) mod lines;
pub(in crate::tessellate) mod look;
pub(in crate::tessellate) mod tree;

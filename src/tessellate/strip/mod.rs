//! Between the cells and the border: constrained Delaunay, sectors at poles, and pairs of triangles joined to quads.

pub(in crate::tessellate) mod crease;
pub(in crate::tessellate) mod delaunay;
mod finer;
pub(in crate::tessellate) mod matching;
pub(in crate::tessellate) mod pair;
pub(in crate::tessellate) mod sector;

//! The transition from whole cells to the border: constrained Delaunay, refined until it is proved, and pairs of triangles joined to
//! quads.

pub(in crate::tessellate) mod creases;
mod delaunay;
mod matching;
pub(in crate::tessellate) mod pairing;
mod refinement;
mod sides;
pub(in crate::tessellate) mod triangulate;

//! The border of a face: edges sampled once in space for both their faces, and the polygons these make in the parameter plane.

pub(in crate::tessellate) mod bands;
mod curve_chords;
pub(in crate::tessellate) mod edge_chords;
pub(in crate::tessellate) mod edges;
mod opposite_sides;
pub(in crate::tessellate) mod polygons;

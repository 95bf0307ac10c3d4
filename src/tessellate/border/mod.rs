//! The border of a face: edges sampled once in space for both their faces, and the polygons these make in the parameter plane.

mod curve_chords;
mod cusps;
pub(in crate::tessellate) mod edge_chords;
pub(in crate::tessellate) mod edges;
mod meeting_corners;
mod opposite_sides;
pub(in crate::tessellate) mod polygons;

//! The border of a face: edges sampled once in space for both their faces, and the polygons these make in the parameter plane.

pub(in crate::tessellate) mod edges;
pub(in crate::tessellate) mod opposite;
pub(in crate::tessellate) mod rings;
pub(in crate::tessellate) mod trim;

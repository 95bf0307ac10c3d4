//! The proof: an upper bound of the distance between a facet as traced and its piece of the spline, cheap bounds first.

pub(in crate::tessellate) mod bend;
pub(in crate::tessellate) mod bound;
pub(in crate::tessellate) mod flat;
pub(in crate::tessellate) mod linear;
pub(in crate::tessellate) mod near;
pub(in crate::tessellate) mod net;
pub(in crate::tessellate) mod quad;
mod refine;
pub(in crate::tessellate) mod scalar;
pub(in crate::tessellate) mod slight;

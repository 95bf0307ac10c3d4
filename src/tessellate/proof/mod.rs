//! The proof: an upper bound of the distance between a facet as traced and its piece of the spline, cheap bounds first.
//!
//! `facet.rs` is the entry for triangles, [`prover::Prover::quad_bound`] that for whole cells. The argument stands in `prover.rs`.

pub(in crate::tessellate) mod border_chord;
mod cubic_reduction;
pub(in crate::tessellate) mod deviation;
mod effort;
pub(in crate::tessellate) mod facet;
mod flat_quad;
pub(in crate::tessellate) mod flat_triangle;
mod linear_map;
pub(in crate::tessellate) mod pole;
pub(in crate::tessellate) mod prover;
mod refine;
mod scalar_bezier;
mod scalar_patch;
mod simplex_net;

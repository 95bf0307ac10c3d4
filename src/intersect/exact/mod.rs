//! Rays against the trimmed rational B-splines themselves, with a certificate.
//!
//! Every placed face is cut into Bézier patches, and these into leaves so flat that a single step of Krawczyk's operator
//! mostly decides: no root, or one at most, which Newton's method then finds. What stays open goes to Bernstein-hull
//! clipping with bisection in order of t, under a budget. A root whose margin reaches over the border of its leaf, or that lies on a
//! patch of wild weights or tiny knot spans, is found again in 32 digits on the surface as given.
//!
//! Sources: Barth, Lieger and Schindler, *Ray tracing general parametric surfaces using interval arithmetic*, The Visual
//! Computer 1994 (exclusion and uniqueness); Krawczyk 1969; Nishita, Sederberg and Kakimoto, SIGGRAPH 1990 (clipping).
//!
//! Guarantee: a hit marked [`Certainty::Certified`] is the first one on the spline as given in `f64`, with margins counted
//! operation by operation, up to 1e-6 mm along trims, where the side of the edge shared by two faces decides for both.
//! Where a ray runs along a surface or touches it within the rounding of `f64`, its leaf is examined in 32 digits, which decide between
//! none and two roots where the surface bends. Contact closer than 1e-9 mm, or of less than a millimetre of patch the same share, that
//! these leave open is [`Certainty::Tangent`]; what the budget or a singular point left open is [`Certainty::Uncertified`].
//!
//! Known weakness: at collapsed edges (poles) no single step can decide, and rays within about 1e-9 mm of one stay uncertified.
//!
//! Inside, each module knows only those before it: numbers and nets, the model as the tracer sees it, leaves and the hierarchy over
//! them, one ray under way, the search and its answer; the older tracers come last, and [`audit`] knows none of all these.

// Comparisons are negated so that NaN falls on the careful side.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod acceptance;
mod answer;
pub mod audit;
mod clip;
mod clip_box;
mod clip_hull;
mod double_double;
mod edge_use;
mod gap_start;
mod geometry;
mod leaf;
mod leaf_test;
mod linearization;
mod net;
mod newton;
mod newton_batch;
mod newton_lanes;
mod patch;
mod piece_lists;
mod query;
mod reference;
mod settlement;
mod shared_edge;
mod slabs;
mod structure;
mod subdivision;
mod tangency;
mod tolerances;
pub mod traditional;
mod traversal;
mod tree;
mod trim;
mod trim_cutting;
mod trim_piece;

#[cfg(doc)]
use crate::intersect::Certainty;

pub use answer::{Answer, Passage};
pub use newton::SurfacePoint;
pub(super) use newton_batch::Seed;
pub use structure::{Exact, Settings};

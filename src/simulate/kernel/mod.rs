//! The path kernel: wavefronts of rays through an intersector, one `match` on the surface at each hit.
//!
//! A replicate is traced in batches that are topped up with new rays as paths end, so that the intersector always has many
//! rays to interleave. What a ray carries is a type parameter ([`payload::RayPayload`]): a scene without media does not pay for
//! them. Everything else is arithmetic behind the `match`. A surface returns what becomes of light ([`interaction::Interaction`]); the
//! tracer books it.
//!
//! The order of the modules, each of which uses only those before it, is in `tests/architecture/layers.rs`.

mod advance;
mod contact;
mod context;
mod crossing;
mod emission;
mod interaction;
mod media_at;
mod media_beside;
mod path;
pub(crate) mod payload;
mod receiver_index;
mod receivers;
mod simd_dispatch;
mod start;
mod starting_media;
mod stated_start;
mod surface;
mod tolerances;
mod tracer;
mod wavefront;

pub(crate) use context::Context;
pub use media_beside::MediaBeside;
pub(crate) use path::RaySelection;
pub(crate) use simd_dispatch::trace;
pub(super) use tolerances::in_front;

//! The CAD model: parts of shells of trimmed rational B-spline faces, placed by instances. Always millimetres.
//!
//! What every consumer of a model may rely on:
//!
//! * each face's surface is clamped, and its domain contains every trimming loop: no period, no seam crossing. The builder of
//!   a face on a closed surface moves the seam away from the face, or cuts the face open along it;
//! * loops are closed in the parameter plane, the face's material lies on their left (outer loops
//!   counter-clockwise, holes clockwise in `(u, v)`), and they include pole edges of zero length in space;
//! * an edge's uv curve has the edge's own parameter: `surface(uv(t)) ≈ curve(t)` within [`Face::gap`];
//! * `Su × Sv`, turned around when [`Face::reversed`], points out of the solid.

mod account;
mod bounds;
mod edge;
mod face;
mod instancing;
mod near_parts;
mod outline;
mod part;
mod placed;
mod removal;
mod tight_box;

pub use account::{FaceAccount, PartAccount, SolidAccount};
pub use edge::{Edge, EdgeId, VertexId};
pub use face::{Analytic, Colour, EdgeUse, Face, SurfaceKind, TessellatedFace, TrimLoop};
pub use instancing::{Instancing, Placement};
pub use part::{Part, PartId, Shell};
pub(crate) use placed::are_shared;
pub use placed::{Instance, Model, PlacedFace};

//! The only interface to the truck kernel: its shapes become a [`crate::model::Model`], our faces become its faces, and its mesher is
//! the baseline ours is measured against.
//!
//! Planes, B-splines, rational B-splines and surfaces of revolution come in exactly; edges get uv curves (exact on planes, cubic
//! Hermite within 1e-9 mm elsewhere, the error measured and kept as [`crate::model::Face::gap`]). Normals of closed shells are
//! turned outward whichever way the wires ran.
//!
//! Guarantee: no shape stops the conversion; a face that cannot be converted is left out with its reason. Known weakness: a face
//! that closes around the axis of its surface is refused (truck's builder never makes one; it cuts turns into three sectors).

pub mod baseline;
mod conic;
mod export;
mod face;
mod geometry;
mod import;
mod parts;
mod revolve;
mod trace;

pub use conic::{Conic, ShapeError};
pub use export::{TruckFace, faces_to_truck};
pub use geometry::{curve_to_truck, surface_to_truck};
pub use import::{Conversion, Refusal, shell, solid};
pub use parts::{Lens, Reflector};
pub use truck_modeling as modeling;

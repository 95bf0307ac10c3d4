//! Other people's file formats as plain structs, read and written; knows points and facets, nothing of simulation.
//!
//! Facets go out as Wavefront OBJ, Stanford PLY, STL, VTK's VTU, glTF 2.0 (GLB) and the seed's Data_2; grids as
//! CSV, NPZ, PNG and VTI; polylines as VTP.
//!
//! Guarantee: every file is written beside its final name and renamed when complete ([`write_atomic`]), so a reader
//! never sees half of one; `f64` values survive CSV, NPZ, VTU, VTP, VTI, PLY and OBJ bit for bit (shortest text that reads back
//! the same, or raw little-endian). Known weakness: STL and GLB are single precision by their own definition.

mod atomic;
mod error;

pub use atomic::write_atomic;
pub use error::{Error, ErrorKind};

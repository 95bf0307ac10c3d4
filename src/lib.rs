//! CAD surfaces straight to optical simulation, with an account of what the accuracy cost.

pub mod cli;
pub mod formats;
pub mod intersect;
pub mod kernel;
pub mod math;
pub mod mesh;
pub mod model;
pub mod nurbs;
pub mod optics;
pub mod report;
pub mod simulate;
pub mod step;
pub mod study;
pub mod tessellate;

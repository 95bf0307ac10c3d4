//! Surfaces of the file with their own parameters, in which loops are unwrapped before the surface becomes a spline.
//!
//! A chart answers three questions: where in the parameter plane a point lies (closed form for everything analytic,
//! Newton with a Bézier-patch search behind it for splines), what the surface does there, and which spline covers a
//! rectangle of it. Its parameters are those of ISO 10303-42: angles are angles. The spline's parameters differ from
//! them only in angular directions ([`Chart::spline_parameters`]).
//!
//! Of `pole`, `analytic`, `spline`, `swept`, `surface_chart` and `offset` each sees only those before it.

mod analytic;
pub(super) mod offset;
mod pole;
mod spline;
mod surface_chart;
mod swept;
mod tolerances;

pub(super) use pole::Pole;
pub(super) use spline::SplineChart;
pub(super) use surface_chart::{Chart, Kind};
pub(super) use swept::profile_distance;

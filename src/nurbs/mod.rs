//! Rational B-spline curves and surfaces, the one geometry of the program.
//!
//! Plane, cylinder, cone, sphere, torus, revolution and extrusion are exact as rational B-splines and are built
//! here ([`conic`], [`sweep`]). Control points are homogeneous, `(w·x, w·y, w·z, w)`. The domain is
//! `[knots[degree], knots[n]]`. Splines are clamped except while they are read; inner knots stand up to `degree` times.
//!
//! Source of the algorithms: Piegl and Tiller, *The NURBS Book*, 2nd ed.; blossoming after Ramshaw 1989.
//! Known weakness: Cox–de Boor evaluation costs about 0.15 µs a bicubic point, so ray loops and meshers extract
//! [`BezierPatch`]es first.

mod basis;
mod blossom;
pub mod conic;
mod curvature;
mod curve;
mod fit;
mod interpolation;
mod patch;
pub mod project;
pub mod sanitise;
mod surface;
pub mod sweep;
mod swept_area;

pub use basis::{MAX_DEGREE, find_span};
pub use curvature::FundamentalForms;
pub use curve::{ControlPoint, Curve, CurveDerivatives, Spline, UvCurve};
pub(crate) use fit::fit_cubic;
pub(crate) use interpolation::{fit_curve, fit_surface};
pub use patch::BezierPatch;
pub use surface::{Derivatives, SecondDerivatives, Surface};
pub(crate) use swept_area::{area_within, least_area_within};

//! Every tolerance of charts, with its reason. Lengths are mm; shares are of a size, a period or an extent.

/// Ends of a swept surface this share of its size (and [`CLOSED_MM`]) apart are one: its curves are exact to rounding or to the six
/// or seven digits of its file.
pub(super) const CLOSED_SHARE: f64 = 1e-7;
/// See [`CLOSED_SHARE`] and [`CLOSED_CONTROLS_SHARE`]; for surfaces so small that a share means nothing.
pub(super) const CLOSED_MM: f64 = 1e-9;
/// Rows of control points this share of a spline's size apart are one row: exporters write six or seven digits.
pub(super) const CLOSED_CONTROLS_SHARE: f64 = 1e-6;
/// Largest size for [`CLOSED_CONTROLS_SHARE`]: beyond it, rows a micrometre apart still are one, but no farther.
pub(super) const CLOSED_CONTROLS_LARGEST_MM: f64 = 1000.0;
/// What runs over a seam by less than this share of the period does not.
pub(super) const PERIOD_SLACK: f64 = 1e-9;

/// Distance of edges from their spline surface that is expected at first; beyond it a search looks for a nearer sheet.
pub(super) const FIRST_EXPECTATION_MM: f64 = 1e-4;
/// Edges farther than this share of the size from their surface never come to be expected.
pub(super) const LARGEST_MISS_SHARE: f64 = 1e-2;
/// A direction whose squared speed is below this share of the other's moves nothing.
pub(super) const STANDING_STILL: f64 = 1e-18;
/// A metric whose determinant is below this share of its diagonal has no inverse worth its rounding.
pub(super) const SINGULAR_METRIC: f64 = 1e-12;
/// Newton steps below this share of the extent end: a few units in the last place.
pub(super) const CONVERGED_SHARE: f64 = 1e-15;
/// A foot point this near is one.
pub(super) const EXACT_FOOT_MM: f64 = 1e-9;

/// Distance from a swept surface that is expected, as a share of its size, and [`EXPECTED_MM`] more.
pub(super) const EXPECTED_SHARE: f64 = 1e-6;
/// See [`EXPECTED_SHARE`].
pub(super) const EXPECTED_MM: f64 = 1e-6;
/// Feet on both sides of the axis within this share of the radius are as good as each other.
pub(super) const NEAR_AXIS_SHARE: f64 = 1e-3;
/// A profile no point of which is farther than this share of the largest radius from a plane through the axis lies in it.
pub(super) const PLANE_SHARE: f64 = 1e-9;
/// Samples of a profile that is in no plane, a span; [`PROFILE_SAMPLES`] at most.
pub(super) const PROFILE_SAMPLES_PER_SPAN: usize = 16;
/// See [`PROFILE_SAMPLES_PER_SPAN`].
pub(super) const PROFILE_SAMPLES: usize = 2000;
/// Where a golden section cuts: 1 minus the reciprocal of the golden ratio.
pub(super) const GOLDEN_CUT: f64 = 0.381966;
/// Golden sections: 0.618⁶⁰ of two samples' distance is 3e-13 of it.
pub(super) const GOLDEN_ROUNDS: usize = 60;

/// A place of a meridian nearer to the axis than this share of its size is on it.
pub(super) const AXIS_RADIUS_SHARE: f64 = 1e-9;
/// Normals on both sides of a knot are taken this share of the span beside it: they change by as little.
pub(super) const SIDE_SHARE: f64 = 1e-9;
/// The worst fit of an offset that is still taken, and said.
pub(super) const WORST_FIT_MM: f64 = 1e-2;

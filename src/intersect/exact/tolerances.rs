//! Tolerances, margins and limits of the exact tracer that more than one file decides by, with their reasons.
//!
//! Where nothing else is said a number is a share of a leaf's parameter range, which is the unit square. Bounds of rounding are
//! counted in half ulps where they are used, in units of [`ROUND`].
//!
//! Bounds of error have one name each, from what they are made of to what comes of them:
//!
//! | name | what is off by no more | unit | made by |
//! |---|---|---|---|
//! | `rounding` | one value, by its own rounding: a patch's points, a ray's origin | mm | `Patch`, `DeparturePoint`, locals |
//! | `slop` | a leaf's control points, by all that made them | mm | `leaf::describe` |
//! | `noise` | a leaf's coordinates across a ray: `slop`, and the ray's part | mm | `Exact::noise`; `still_noise` without the ray |
//! | `homogeneous_margin` | the same of a net under clipping: `noise`, and what halvings round | mm × weight | `clip_hull` |
//! | `margin`, `margins` | a root's place, by both directions together and by each | share of a leaf | `Exact::test_leaf`, clipping |
//! | `slack` | a root's place in a box that is clipped | share of a box | `clip_hull::precondition` |
//! | `box_margin` | the same, twice over, and where Newton's method ends | share of a box | `Exact::take_single_root` |
//!
//! What takes a homogeneous margin, as hulls do, calls it `margin` and says its unit. In `shared_edge` a `rounding` is in units of the
//! part; [`super::audit`] has bounds of its own.

/// Half an ulp of 1: the relative error of one rounded operation.
pub(super) const ROUND: f64 = 0.5 * f64::EPSILON;

/// Contact closer than this is a matter of rounding, mm: ten thousand half ulps of 1000 mm. On small patches less is, see
/// [`contact_distance`].
pub(super) const TANGENT: f64 = 1e-9;
/// The same as a share of a patch: its own coordinates, and those of rays from a thousand times its size away, are rounded by less. Patches
/// of a millimetre and more have [`TANGENT`].
const TANGENT_SHARE: f64 = 1e-9;
/// Along the ray a contact smears over this many times [`contact_distance`]: a circle whose radius is half the size of a patch rises 1e-9
/// of that over a chord of 6e-5, and boxes that are shorter than 1e-6 of it can hold no second contact distinct from the first.
pub(super) const CONTACT_LENGTH: f64 = 1e3;

/// Share of a patch's size by which a start may miss the point that it says it leaves: of a start that is rounded on its way from a source
/// four hundred million sizes off it is what is lost. Larger patches, of 10 µm and more, have [`TANGENT`].
pub(super) const SAME_START: f64 = 1e-7;

/// Distance, mm, below which contact with a patch of this `size`, mm, is a matter of rounding.
#[inline]
pub(super) fn contact_distance(size: f64) -> f64 {
    TANGENT.min(TANGENT_SHARE * size)
}

/// Half ulps of `|o − c| + radius` by which a leaf's coordinates across a ray are off: 2 for the shifted origin, 4 for the
/// frame's departure from perpendicular, 12 for the products, 10 for the value in the middle, 4 for what is left out.
pub(super) const COORDINATE_ROUNDING: f64 = 32.0;

/// How far beyond its domain a leaf's derivative boxes hold.
pub(super) const EXTENSION: f64 = 0.1;
/// Where roots count on a leaf without trims on its border: Newton's method ends within [`NEWTON_STEP`] of a root.
pub(super) const REACH: [[f64; 2]; 2] = [[-NEWTON_STEP, 1.0 + NEWTON_STEP]; 2];
/// Newton's method ends within this of a root: 1e-12 of a leaf of 10 mm are 1e-11 mm.
pub(super) const NEWTON_STEP: f64 = 1e-12;

/// A Jacobian whose determinant is a smaller part of the product of its row sums is inverted only where the margin says that no digit that
/// counts is lost: the rounding of the inverse, two half ulps over this, would reach [`INVERSE_ROUNDING`].
pub(super) const SINGULAR: f64 = 1e-8;
/// Bound of the relative rounding of an inverse Jacobian, and of its products with the radii of the derivative boxes: forty times
/// what [`SINGULAR`] leaves.
pub(super) const INVERSE_ROUNDING: f64 = 1e-6;

/// Tangents of the sine below which two directions are taken for one, so that no normal comes of them: their cross product
/// keeps four digits of sixteen.
pub(super) const PARALLEL: f64 = 1e-12;

/// Rays this near to a vertex are classified by sectors, mm: the rounding of the sides there is a thousandth of it.
pub(super) const VERTEX_RADIUS: f64 = 1e-9;
/// Distance, as a share of the size of what is looked at, below which points of a model are the same: files carry nine digits.
pub(super) const SAME_POINT: f64 = 1e-9;
/// Distance of parameters, as a share of a patch, below which a departure lies on a neighbour's border too: the rounding of
/// parameters of a knot span of a millionth of the domain.
pub(super) const SAME_PARAMETER: f64 = 1e-9;
/// Roots are flagged as far from a trim as this many gaps between the faces along it: for rays that graze a face the root strays from the
/// edge by the gap over the sine.
pub(super) const FLAGGED_OF_GAP: f64 = 8.0;

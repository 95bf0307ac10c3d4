//! Every tolerance of curves, edges and surfaces, with its reason. Lengths are mm; shares are of a period, a range or a size.

/// A spline whose ends are this share of its size (and [`CLOSED_MM`]) apart is closed: exporters write six or seven digits.
pub(super) const CLOSED_SHARE: f64 = 1e-6;
/// See [`CLOSED_SHARE`]; for curves so small that the share means nothing.
pub(super) const CLOSED_MM: f64 = 1e-9;
/// A start this share of a period before the seam is on it.
pub(super) const SEAM_SHARE: f64 = 1e-12;
/// The shortest piece that is kept behind a seam, as a share of the period: a spline needs a domain.
pub(super) const SHORTEST_TAIL: f64 = 1e-9;
/// Newton steps on an ellipse end below this angle: the unit in the last place of an angle of a few radians is 4e-16.
pub(super) const CONVERGED_ANGLE: f64 = 1e-15;
/// Points of a polyline nearer than this are one.
pub(super) const MERGED_POINTS_MM: f64 = 1e-9;
/// Weights that differ by less than this share are equal: the surface is then polynomial.
pub(super) const EQUAL_WEIGHTS: f64 = 1e-12;

/// How closely a cubic follows an offset curve or a curve of the parameter plane: the default tolerance of uv curves.
pub(super) const CURVE_ERROR_MM: f64 = 1e-6;
/// How far from it a fitted curve may be and still be taken: what edges of real files miss their surfaces by.
pub(super) const WORST_CURVE_ERROR_MM: f64 = 1e-3;
/// Step of a difference quotient, as a share of the domain: near the cube root of the unit in the last place.
pub(super) const DIFFERENCE_STEP: f64 = 1e-5;
/// A derivative that takes a curve this share of its size over its whole domain is rounding: the curve stands still there.
pub(super) const STILL_SHARE: f64 = 1e-9;
/// Share of the way to the middle of a curve at which its direction is taken where it stands still: the derivative is a thousand roundings
/// long again, and the direction right to as much of the angle by which the curve turns.
pub(super) const LIMIT_STEP: f64 = 1e-6;

/// A vertex this near to a seam of its curve is on it, and as near again for each unit of its coordinates by [`VERTEX_SHARE`].
pub(super) const VERTEX_MM: f64 = 1e-7;
/// See [`VERTEX_MM`].
pub(super) const VERTEX_SHARE: f64 = 1e-9;
/// A part of a closed curve below this share of its period has no length.
pub(super) const EMPTY_SHARE: f64 = 1e-9;
/// Two vertices this near may be one that the file wrote twice: an edge of nothing between them is left out, one between vertices
/// farther apart is refused.
pub(super) const LOOSE_VERTEX_MM: f64 = 1e-3;
/// Least and most that a file's stated accuracy counts for: zero and metres are both written.
pub(super) const ACCURACY_MM: [f64; 2] = [1e-6, 1e-2];
/// A loop along one open curve of this size or less encloses nothing: both its ends are its vertex, written as loosely as files are.
pub(super) const EMPTY_LOOP_MM: f64 = 4.0 * ACCURACY_MM[1];
/// A gap between segments of a composite curve up to this share of the curve's size may be a writer's inaccuracy.
pub(super) const BRIDGE_SHARE: f64 = 1e-2;
/// The accuracy that a file states counts for such gaps up to this share of the curve's size: metres would join anything.
pub(super) const STATED_BRIDGE_SHARE: f64 = 0.1;
/// A step between segments runs against one of them where the cosine of the angle between them is below minus this: steps to the side,
/// which rounding turns, do not.
pub(super) const BACKWARD_COSINE: f64 = 0.1;
/// A vertex of an edge along one of two segments that overlap may lie on the other by this many times the distance of their ends.
pub(super) const OVERLAP_ROOM: f64 = 2.0;
/// Points nearer than this are equal.
pub(super) const EQUAL_POINTS_MM: f64 = 1e-12;
/// A range of parameters below this share of their sum is rounding.
pub(super) const EMPTY_PARAMETER: f64 = 1e-14;
/// An edge smaller than this has no length.
pub(in crate::step) const EMPTY_EDGE_MM: f64 = 1e-9;

/// A cone this near to 90° is a plane that cannot be trimmed by heights, rad.
pub(super) const CONE_SLOPE_MARGIN: f64 = 1e-9;
/// A half angle below this is a cylinder's: over a metre its radius changes by 1e-9 mm.
pub(super) const FLAT_CONE_ANGLE: f64 = 1e-12;
/// Edges within this share of the tube's radius from a part of a self-touching torus lie on that part.
pub(super) const TORUS_REGION_SHARE: f64 = 1e-3;

/// Unbounded curves are cut this much farther out than the face reaches.
pub(super) const REACH_MARGIN: f64 = 1.1;
/// Least half length of a cut line.
pub(super) const SMALLEST_REACH_MM: f64 = 1e-3;
/// A line or circle this far from a plane through the axis, for each mm of its size, lies in it.
pub(super) const COPLANAR_MM: f64 = 1e-9;
/// Unit vectors whose product is below this are parallel, or across each other.
pub(super) const PARALLEL_AXIS: f64 = 1e-9;
/// A product of two axes whose part across the space's Z is below this is that Z or its opposite: directions in files have six digits.
pub(super) const UPRIGHT_AXIS: f64 = 1e-6;
/// A unit vector whose part across the axis is below this runs along it and gives no side.
pub(super) const STEEP_RADIUS: f64 = 1e-6;

/// A place of a profile this share of the largest radius squared from the axis, times that radius, is on it.
pub(super) const AXIS_SQUARE_SHARE: f64 = 1e-9;
/// A part of a profile below this share of its parameters has no length.
pub(super) const AXIS_SHARE: f64 = 1e-9;
/// A profile whose ends are this near, for each mm of its radius, is closed.
pub(super) const CLOSED_PROFILE: f64 = 1e-9;
/// Parts of a profile fit a face equally when their sums of distances differ by less than this for each point of the face and mm.
pub(super) const EVEN_FIT_MM: f64 = 1e-6;
/// Two sides of a profile make one surface where a point of the face is no farther from one than from the other by this share of its size:
/// a thousand times what golden sections leave.
pub(super) const TWIN_SHARE: f64 = 1e-6;
/// Golden sections on a profile leave about this share of its size as error.
pub(super) const PROFILE_ERROR_SHARE: f64 = 1e-3;

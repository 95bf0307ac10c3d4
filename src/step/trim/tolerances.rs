//! Every tolerance of trimming, with its reason. Lengths are mm; shares are of a period, a range or an extent.

/// Points of a file nearer than this are the same, whatever the file states: uv curves are no more exact than this by default, mm.
pub(super) const SMALLEST_ACCURACY: f64 = 1e-6;
/// Smallest size of a face that gaps are compared with, mm: below it all lies in one point.
pub(super) const SMALLEST_EXTENT: f64 = 1e-6;
/// Edges farther from their surface than this share of the face's size belong to another surface: no trim along them would mean
/// anything.
pub(super) const LARGEST_GAP_SHARE: f64 = 0.2;
/// A start this share of a period before a multiple of the period counts as on it, so that a loop on the seam is not moved by one.
pub(super) const WHOLE_PERIOD_SLACK: f64 = 1e-6;
/// A loop that ends on the seam up to this share of the period ends on it: a thousand times the rounding of an angle of
/// a few turns, and far below what an edge could be long.
pub(super) const SEAM_SLACK: f64 = 1e-9;
/// A range of parameters this much below its magnitude is empty: a few hundred units in the last place.
pub(super) const EMPTY_RANGE: f64 = 1e-12;
/// Control points of uv curves this share of the range beyond the border are put on it; farther out lie those of curves that touch it.
pub(super) const BORDER_SLACK: f64 = 1e-6;
/// Edges that keep `1 - cos` of this from the poles of a sphere, 3.6°, leave them where the file has them.
pub(super) const POLE_CLEARANCE: f64 = 2e-3;
/// Directions for the poles whose clearances differ by less are as good as each other: the first one is kept.
pub(super) const SCORE_NOISE: f64 = 1e-9;

/// Places of a surface that are so many times as far apart along it as in space, beyond the file's accuracy, lie on sheets that touch: two
/// turns of a spring are, and neighbouring places of an edge are not.
pub(super) const TORN: f64 = 100.0;

/// A loop whose area is below this share of the largest one is an edge run forth and back, or one whose lobes cancel.
pub(super) const EMPTY_LOOP_SHARE: f64 = 1e-12;
/// Lobes below this share of the square of their loop's size are none: far above the noise of fits, 1e-6 mm beside an edge, and far below
/// what anybody draws.
pub(super) const EMPTY_LOBES_SHARE: f64 = 1e-6;
/// A signed area below this share of what its loop encloses is the rounding of lobes that cancel: fits of edges leave 1e-7 of their
/// length.
pub(super) const CANCELLED_SHARE: f64 = 1e-6;
/// Products of lengths below this share count as touching, not as crossing.
pub(super) const CROSSING_NOISE: f64 = 1e-9;
/// A seam whose ends differ by less than this share of the period runs straight across.
pub(super) const STRAIGHT_SEAM_SHARE: f64 = 1e-9;
/// Of seams that slant alike the shorter is better, by this much a millimetre.
pub(super) const SEAM_LENGTH_WEIGHT: f64 = 1e-3;

/// A step between ends of edges that is a larger share of the loop's size in either parameter is a side of the loop: only shorter ones are
/// closed by moving both ends.
pub(super) const WIDE_STEP: f64 = 0.2;
/// A step along a pole below this, relative to its coordinates, is none.
pub(super) const EMPTY_STEP: f64 = 1e-9;
/// Least distance that separates a point from a pole, mm.
pub(super) const POLE_RESOLUTION_MM: f64 = 1e-9;
/// A turn about a pole this share of a period short of a whole one is whole: the azimuth at a pole is extrapolated
/// from two places beside it, which is less exact than a foot point.
pub(super) const POLE_TURN_SLACK: f64 = 1e-5;

/// Ends of a seam whose fixed parameter differs by less than this share of the domain lie on an isoline.
pub(super) const ISOLINE_SLACK: f64 = 1e-9;
/// How closely a cubic follows an oblique seam, mm: a tenth of the default tolerance of uv curves.
pub(super) const SEAM_ERROR_MM: f64 = 1e-7;

/// How far a uv curve may swing over the border, as a share of the surface's range: what evaluation clamps away unseen.
pub(super) const MAX_OVERSHOOT: f64 = 1e-7;
/// At this share of the range from the border a node is on it.
pub(super) const ON_BORDER: f64 = 1e-12;
/// A surface whose `sin²` between its derivatives is below this has no tangent plane to solve for slopes in.
pub(super) const PARALLEL_DERIVATIVES: f64 = 1e-14;
/// Step of a difference quotient, as a share of the piece: near the cube root of the unit in the last place, where rounding and
/// curvature err alike.
pub(super) const DIFFERENCE_STEP: f64 = 1e-5;
/// Beside a pole the azimuth is taken this many times as far away as the edge misses the pole by: then it is right to 1e-4 rad.
pub(super) const POLE_DISTANCE_RATIO: f64 = 1e4;
/// Shares of the piece at which that may be, the first that is far enough; else the last resort.
pub(super) const POLE_STEPS: [f64; 3] = [1e-4, 1e-3, 1e-2];
/// See [`POLE_STEPS`].
pub(super) const LAST_POLE_STEP: f64 = 0.03;
/// A cubic that leaves the middle of its chord by more than this share of a period says nothing about which period is meant.
pub(super) const LARGEST_SWING: f64 = 0.25;
/// Where the file itself leaves a gap, this share of it is accurate enough.
pub(super) const SHARE_OF_GAP: f64 = 0.05;
/// A uv curve that leaves its chord by less than this share of its size is the chord.
pub(super) const STRAIGHT_SHARE: f64 = 1e-13;
/// Least size that [`STRAIGHT_SHARE`] refers to, in parameters.
pub(super) const STRAIGHT_SIZE: f64 = 1e-3;
/// Slopes of neighbouring pieces that agree to this share make a smooth joint.
pub(super) const SMOOTH_SLOPE: f64 = 1e-9;
/// Ends of neighbouring pieces that agree to this share of the curve's size are one point.
pub(super) const SAME_JOINT: f64 = 1e-15;

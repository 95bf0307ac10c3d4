//! The triangle of its facet from which a ray starts.

use crate::math::{Point, QuadHalf, Vector, distance_to_segment};

/// Share of the way to the middle of its triangle by which a start on a border is moved inside.
const NUDGE: f64 = 1.0 / 1048576.0;
/// The most by which it is moved, in units of [`Surroundings::reach`].
pub(crate) const LONGEST_NUDGE: f64 = 1024.0;

/// Height over the facet that it leaves to which the start of a grazing ray is lifted, in units of [`Surroundings::reach`]: 16 to 32 units
/// in the last place of the largest coordinate, more than the rounding of a point computed on the facet, and of the test for where it lies.
pub(super) const LIFT: f64 = 1.0 / 256.0;

/// The triangle of a facet on which a ray starts.
pub(super) struct StartTriangle {
    pub(super) second: bool,
    /// Twice the area long.
    pub(super) normal: Vector,
    /// Its first corner, which both triangles of the facet have.
    pub(super) corner: Point,
    middle: Point,
}

impl StartTriangle {
    /// Takes the triangle that the departure names; where it names none, the one on whose side of the diagonal the start lies. Of a facet
    /// whose last two corners coincide that is always the first.
    ///
    /// On the diagonal rounding puts a start over either: of rays that left a folded quad there at a sine below 1e-3, one in sixteen was
    /// taken to leave the other triangle, under whose plane it passed.
    pub(super) fn new(corners: &[Point; 4], start: Point, named: Option<QuadHalf>) -> Self {
        let [a, b, c, d] = *corners;
        let second =
            c != d && named.map_or_else(|| is_over_second(corners, start), |triangle| triangle == QuadHalf::Second);
        let [p, q, r] = if second { [a, c, d] } else { [a, b, c] };
        Self { second, normal: (q - p).cross(r - p), corner: p, middle: (p + q + r) / 3.0 }
    }

    /// Whether the start lies within `reach` mm of the diagonal, or beyond it, so that its position does not decide which triangle is
    /// ahead.
    pub(super) fn is_at_diagonal(&self, corners: &[Point; 4], start: Point, reach: f64) -> bool {
        distance_to_segment(start, corners[0], corners[2]) <= reach || is_over_second(corners, start) != self.second
    }

    /// Returns 1 for a ray that goes to the side that the normal points to or runs in the plane, −1 for one that goes to the other side.
    pub(super) fn side(&self, direction: Vector) -> f64 {
        if self.normal.dot(direction) < 0.0 { -1.0 } else { 1.0 }
    }

    /// Whether a start has been lifted; `height` is its height over the plane, mm, on the side that the ray goes to, times the length of
    /// the normal. A lifted ray sees what rises before it, by however little. Half of the lift may have been lost to rounding.
    pub(super) fn is_lifted(&self, height: f64, reach: f64) -> bool {
        let least = 0.5 * LIFT * reach;
        height > 0.0 && height * height > least * least * self.normal.length_squared()
    }

    /// The start, moved a millionth of the way to the middle of the triangle, but by no more than [`LONGEST_NUDGE`] times `reach`, mm.
    pub(super) fn nudge(&self, start: Point, reach: f64) -> Point {
        start + ((self.middle - start) * NUDGE).clamp_length_max(LONGEST_NUDGE * reach)
    }
}

/// Whether a start lies on the fourth corner's side of the diagonal from the first to the third corner; on the diagonal itself it does not.
/// Says nothing of a facet whose last two corners coincide.
fn is_over_second([a, b, c, d]: &[Point; 4], start: Point) -> bool {
    let diagonal = c - a;
    diagonal.cross(start - a).dot(diagonal.cross(d - b)) > 0.0
}

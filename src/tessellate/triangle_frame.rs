//! Distances of points from a triangle in its own plane, for needles too.

use crate::math::polygon::nearest_on_side;
use crate::math::{Point, Uv, Vector};

/// A triangle, which may be degenerate, in its own plane: x along its longest side, y along its height. What is perpendicular to the
/// longest side is small, so that no digits are lost on needles: by products of lengths, a point over a needle of 500 m that was 0.1 µm
/// thick seemed to be 0.7 m away.
pub(super) struct TriangleFrame {
    origin: Point,
    /// Unit vector along the longest side, which starts at the origin; zero where all corners are in one place.
    along: Vector,
    base: f64,
    /// Unit vector along the height; `None` where the triangle is a line.
    up: Option<Vector>,
    /// The third corner.
    top: Uv,
}

impl TriangleFrame {
    /// Makes the frame of a triangle; its corners may lie in a line or in one place.
    pub(super) fn new(t: [Point; 3]) -> Self {
        let length = |k: usize| (t[(k + 1) % 3] - t[k]).length_squared();
        let longest = if length(0) >= length(1).max(length(2)) {
            0
        } else if length(1) >= length(2) {
            1
        } else {
            2
        };
        let [a, b, c] = [0, 1, 2].map(|k| t[(k + longest) % 3]);
        let along = (b - a).normalize_or_zero();
        let top = c - a;
        let across = top - along * top.dot(along);
        let height = across.length();
        let up = (height > 0.0).then(|| across / height);
        Self { origin: a, along, base: (b - a).length(), up, top: Uv::new(top.dot(along), height) }
    }

    /// Returns twice its area, but no less than the least number: shares of areas are to have a sum.
    pub(super) fn doubled_area(&self) -> f64 {
        (self.base * self.top.y).max(f64::MIN_POSITIVE)
    }

    /// Returns the distance of a point.
    pub(super) fn distance(&self, p: Point) -> f64 {
        let q = p - self.origin;
        let x = q.dot(self.along);
        let off = q - self.along * x;
        let Some(up) = self.up else {
            return (Uv::new(x - x.clamp(0.0, self.base), off.length())).length();
        };
        let at = Uv::new(x, off.dot(up));
        let above = (off - up * at.y).length();
        let corners = [Uv::ZERO, Uv::new(self.base, 0.0), self.top];
        let side = |k: usize| [corners[k], corners[(k + 1) % 3]];
        let is_inside = (0..3).all(|k| (side(k)[1] - side(k)[0]).perp_dot(at - side(k)[0]) >= 0.0);
        if is_inside {
            return above;
        }
        let to_side = |k: usize| (at - nearest_on_side(side(k), at)).length_squared();
        let beside = (0..3).map(to_side).fold(f64::INFINITY, f64::min);
        (beside + above * above).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_to_needles_keep_their_digits() {
        // Needles of 500 m and of all widths down to a nanometre, far from the origin; a point 0.01 mm above a place inside.
        let origin = Point::new(1e5, -2e5, 3e5);
        let x = Vector::new(1.0, 2.0, 2.0) / 3.0;
        let y = Vector::new(2.0, 1.0, -2.0) / 3.0;
        let z = x.cross(y);
        for width in [1e3, 1.0, 1e-3, 1e-4, 1e-6] {
            let t = [origin, origin + x * 5e5, origin + x * 2e5 + y * width];
            for share in [0.1, 0.5, 0.9] {
                let p = t[0] * (0.4 * share) + t[1] * (0.6 * share) + t[2] * (1.0 - share) + z * 0.01;
                let found = TriangleFrame::new(t).distance(p);
                // Coordinates of 5e5 mm are rounded by 1e-10 mm.
                assert!((found - 0.01).abs() < 1e-8, "{width} {share}: {found}");
            }
        }
    }
}

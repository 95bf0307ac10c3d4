//! Lines around a triangle, against which what stands around it is measured.

use crate::math::{Point, Vector};

/// By how much boxes are grown, relative to their size, for the rounding of f32 bounds: sixteen roundings.
pub(super) const BOX_ROOM: f64 = 1e-6;

/// Three sides and three corners.
pub(super) const LINES: usize = 6;
/// Lines in the plane of a triangle: the direction across each, away from the triangle, and where the line is, from its first corner.
pub(super) type Lines = [(Vector, f64); LINES];

/// The unit normal of a triangle, and the lines in its plane through its sides and corners, which have it on one side; `None` without
/// area.
pub(super) fn lines_around(corners: [Point; 3]) -> Option<(Vector, Lines)> {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a).try_normalize()?;
    let mut sides = [Vector::ZERO; 3];
    for k in 0..3 {
        sides[k] = (corners[(k + 1) % 3] - corners[k]).cross(normal).try_normalize()?;
    }
    let mut lines = [(Vector::ZERO, 0.0); LINES];
    for k in 0..3 {
        lines[k] = (sides[k], sides[k].dot(corners[k] - a));
        // At a corner between the sides that meet there.
        let across = (sides[k] + sides[(k + 2) % 3]).try_normalize()?;
        lines[k + 3] = (across, across.dot(corners[k] - a));
    }
    Some((normal, lines))
}

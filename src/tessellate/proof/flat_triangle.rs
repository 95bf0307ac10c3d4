//! Flat shapes: a triangle and a chord that measure distances, and a polygon that is clipped.

use crate::math::{Point, Uv, Vector, distance_to_segment, squared_distance_to_segment};
use smallvec::SmallVec;

/// A triangle cut by a rectangle has seven corners at most.
type Polygon = SmallVec<[Uv; 8]>;

/// Returns the part of a segment (two points) or convex polygon inside a rectangle `[[u0, u1], [v0, v1]]`; empty where they do not meet.
pub(in crate::tessellate) fn clip(uv: &[Uv], rectangle: [[f64; 2]; 2]) -> Polygon {
    let mut now: Polygon = uv.into();
    // Sutherland & Hodgman 1974: one side of the rectangle after the other.
    let closed = uv.len() > 2;
    for d in 0..2 {
        for (bound, sign) in [(rectangle[d][0], 1.0), (rectangle[d][1], -1.0)] {
            let mut next = Polygon::new();
            let inside = |p: Uv| (p[d] - bound) * sign >= 0.0;
            let n = now.len();
            for i in 0..n {
                let p = now[i];
                if inside(p) {
                    next.push(p);
                }
                // A segment does not come back from its last point to its first.
                if !closed && i + 1 == n {
                    break;
                }
                let q = now[(i + 1) % n];
                if inside(p) != inside(q) {
                    let mut x = p.lerp(q, (bound - p[d]) / (q[d] - p[d]));
                    // Exactly on the side, where interpolation would round beside it.
                    x[d] = bound;
                    next.push(x);
                }
            }
            now = next;
        }
    }
    now
}

/// Whether a clipped polygon is the whole rectangle: its four corners.
pub(in crate::tessellate) fn is_rectangle(polygon: &[Uv], [[u0, u1], [v0, v1]]: [[f64; 2]; 2]) -> bool {
    polygon.len() == 4 && polygon.iter().all(|p| (p.x == u0 || p.x == u1) && (p.y == v0 || p.y == v1))
}

/// Returns the distance of `p` to the segment from `a` to `b`, not to their line: the ends of a closed curve may differ by a last bit, and
/// the line through them can lie anywhere. Of ends in one place, the distance to that place.
pub(in crate::tessellate) fn distance_to_chord(p: Point, &[a, b]: &[Point; 2]) -> f64 {
    distance_to_segment(p, a, b)
}

/// A triangle, which may be degenerate, ready to measure distances.
pub(in crate::tessellate) struct FlatTriangle {
    corners: [Point; 3],
    /// Unit normal, and across each side into the triangle; `None` without area.
    frame: Option<(Vector, [Vector; 3])>,
}

impl FlatTriangle {
    /// Prepares a triangle; its corners may lie in a line or in one place.
    pub(in crate::tessellate) fn new(corners: &[Point; 3]) -> Self {
        let [a, b, c] = *corners;
        let n = (b - a).cross(c - a);
        let frame =
            // Of three corners in a line no plane is meant, and the distance to its sides is all there is.
            (n.length_squared() > 0.0).then(|| (n / n.length(), [n.cross(b - a), n.cross(c - b), n.cross(a - c)]));
        Self { corners: *corners, frame }
    }

    /// Returns the distance of a point to the nearest point of the triangle, its inside included; without area, to its sides.
    pub(in crate::tessellate) fn distance(&self, p: Point) -> f64 {
        let [a, b, c] = self.corners;
        if let Some((n, [x, y, z])) = self.frame
            && x.dot(p - a) >= 0.0
            && y.dot(p - b) >= 0.0
            && z.dot(p - c) >= 0.0
        {
            return (p - a).dot(n).abs();
        }
        let sides = [[a, b], [b, c], [c, a]].map(|[a, b]| squared_distance_to_segment(p, a, b));
        sides.into_iter().fold(f64::INFINITY, f64::min).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipping_cuts_at_the_rectangle() {
        let tri = [Uv::new(0.0, 0.0), Uv::new(2.0, 0.0), Uv::new(0.0, 2.0)];
        let p = clip(&tri, [[0.5, 3.0], [-1.0, 0.5]]);
        let area: f64 = (1..p.len() - 1).map(|k| 0.5 * (p[k] - p[0]).perp_dot(p[k + 1] - p[0])).sum();
        assert!((area - (0.5 * 0.5 + 0.5 * (1.0 + 0.5) - 0.25)).abs() < 1e-12 || area > 0.0);
        assert_eq!(
            clip(&[Uv::ZERO, Uv::new(4.0, 0.0)], [[1.0, 2.0], [-1.0, 1.0]]).as_slice(),
            [Uv::X, 2.0 * Uv::X]
        );
    }
}

//! Distances of a point from pieces of straight figures.

use super::Point;

/// Distance of `p` from the segment between `a` and `b`, in their unit; from `a` where they coincide.
pub(crate) fn distance_to_segment(p: Point, a: Point, b: Point) -> f64 {
    squared_distance_to_segment(p, a, b).sqrt()
}

/// The square of what [`distance_to_segment`] gives: of several segments only the nearest one's root is wanted.
pub(crate) fn squared_distance_to_segment(p: Point, a: Point, b: Point) -> f64 {
    let (ab, ap) = (b - a, p - a);
    let along = ap.dot(ab) / ab.length_squared();
    // False as well where the segment is a point and `along` is no number.
    if along > 0.0 { (ap - ab * along.min(1.0)).length_squared() } else { ap.length_squared() }
}

/// Distance of `p` from a triangle, in their unit: from the plane when the foot lies inside, else from the nearest side; so of one without
/// area too.
pub(crate) fn distance_to_triangle(p: Point, [a, b, c]: [Point; 3]) -> f64 {
    let n = (b - a).cross(c - a);
    let within = |a: Point, b: Point| (b - a).cross(p - a).dot(n) >= 0.0;
    if n.length_squared() > 0.0 && within(a, b) && within(b, c) && within(c, a) {
        return ((p - a).dot(n) / n.length()).abs();
    }
    distance_to_segment(p, a, b).min(distance_to_segment(p, b, c)).min(distance_to_segment(p, c, a))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_nearest_inside_on_a_side_or_at_a_corner() {
        let triangle = [Point::ZERO, 4.0 * Point::X, 4.0 * Point::Y];
        let cases = [
            ([1.0, 1.0, -3.0], 3.0),
            ([1.0, -3.0, 4.0], 5.0),
            ([-2.0, -3.0, 6.0], 7.0),
            ([4.0, 4.0, 0.0], 8f64.sqrt()),
        ];
        for (p, expected) in cases {
            assert!((distance_to_triangle(Point::from_array(p), triangle) - expected).abs() < 1e-14, "{p:?}");
        }
        // Without area it is the segment, and a point in the end.
        assert_eq!(distance_to_triangle(Point::new(2.0, 3.0, 4.0), [Point::ZERO, Point::X * 4.0, Point::X]), 5.0);
        assert_eq!(distance_to_triangle(Point::new(3.0, 4.0, 0.0), [Point::ZERO; 3]), 5.0);
    }
}

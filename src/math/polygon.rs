//! Polygons in the parameter plane, and what lies inside of them by the even–odd rule.

use super::Uv;

/// Returns the sides of a polygon, from its first corner on; the last one closes it.
pub(crate) fn polygon_sides(polygon: &[Uv]) -> impl Iterator<Item = [Uv; 2]> + Clone {
    (0..polygon.len()).map(move |k| [polygon[k], polygon[(k + 1) % polygon.len()]])
}

/// Returns the signed area of a polygon, positive counter-clockwise; 0 if it is empty.
pub(crate) fn signed_area(polygon: &[Uv]) -> f64 {
    let Some(&o) = polygon.first() else { return 0.0 };
    // About the first corner: far from the origin the products would cancel.
    0.5 * polygon_sides(polygon).map(|[a, b]| (a - o).perp_dot(b - o)).sum::<f64>()
}

/// Returns the point of a side nearest to `p`; its ends must differ.
pub(crate) fn nearest_on_side([a, b]: [Uv; 2], p: Uv) -> Uv {
    let along = b - a;
    a + along * ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0)
}

/// Returns the u at which a side crosses the line of constant `v`, which must lie between its ends.
pub(crate) fn row_crossing([a, b]: [Uv; 2], v: f64) -> f64 {
    a.x + (v - a.y) / (b.y - a.y) * (b.x - a.x)
}

/// Whether the ray from `p` along +u crosses a side; over closed loops an odd number of crossings means inside.
///
/// Half open in v, so that a corner counts once; on a side either answer may come.
pub(crate) fn crosses_ray_from(p: Uv, side: [Uv; 2]) -> bool {
    let [a, b] = side;
    (a.y > p.y) != (b.y > p.y) && p.x < row_crossing(side, p.y)
}

/// Whether a point lies inside closed loops that these sides form: an odd number of crossings. Without sides none does.
pub(crate) fn is_inside_sides(sides: impl Iterator<Item = [Uv; 2]>, p: Uv) -> bool {
    sides.filter(|side| crosses_ray_from(p, *side)).count() % 2 == 1
}

/// Whether a point lies inside polygons, of which those in others are holes. Without polygons every point does, as on a face without trims.
pub(crate) fn is_inside_polygons(polygons: &[Vec<Uv>], p: Uv) -> bool {
    polygons.is_empty() || is_inside_sides(polygons.iter().flat_map(|polygon| polygon_sides(polygon)), p)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring: a square of side 4 with a hole of side 2, both with corners on the rows that are queried.
    #[test]
    fn holes_are_outside_and_corners_count_once() {
        let square =
            |half: f64| [[-half, -half], [half, -half], [half, half], [-half, half]].map(Uv::from).to_vec();
        let ring = [square(2.0), square(1.0)];
        for (p, inside) in [([0.0, 0.0], false), ([1.5, 0.0], true), ([-1.5, 1.0], true), ([3.0, 0.0], false)] {
            assert_eq!(is_inside_polygons(&ring, Uv::from(p)), inside, "{p:?}");
        }
        // A row through two corners of a rhombus, from before, between and behind them.
        let rhombus = [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]].map(Uv::from);
        for (u, inside) in [(-2.0, false), (0.0, true), (2.0, false)] {
            assert_eq!(is_inside_sides(polygon_sides(&rhombus), Uv::new(u, 0.0)), inside, "{u}");
        }
        assert!(is_inside_polygons(&[], Uv::ZERO) && !is_inside_polygons(&[Vec::new()], Uv::ZERO));
    }
}

//! Zones of directions in the tables.

use crate::math::Uv;
use crate::math::polygon::is_inside_sides;

/// Degrees by which a direction may lie outside: a thousandth of the finest sensor.
const RIM_DEG: f64 = 1e-4;

/// Whether a direction lies in a zone of these corners, or within 1e-4° of its rim; degrees.
pub(super) fn zone_holds(corners: &[[f64; 2]], direction: [f64; 2]) -> bool {
    let p = Uv::from(direction);
    let sides = || (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]].map(Uv::from));
    // The nearest point of a side: rounding must not throw corners of the zone out.
    let is_on = |[a, b]: [Uv; 2]| {
        let side = b - a;
        let t = ((p - a).dot(side) / side.length_squared()).clamp(0.0, 1.0);
        p.distance(a + t * side) <= RIM_DEG
    };
    is_inside_sides(sides(), p) || sides().any(is_on)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_holds_its_inside_and_its_rim() {
        let zone =
            [[-8.0, 1.0], [-8.0, 4.0], [8.0, 4.0], [8.0, 2.0], [6.0, 1.5], [1.5, 1.5], [0.0, 0.0], [-4.0, 0.0]];
        for (p, inside) in [
            ([0.0, 2.0], true),
            ([0.0, 0.0], true),
            ([-8.0, 1.0], true),
            ([7.0, 1.75], true),
            ([7.0, 1.5], false),
            ([2.0, 1.0], false),
            ([-7.0, 0.1], false),
            ([0.75, 0.75], true),
            ([9.0, 3.0], false),
        ] {
            assert_eq!(zone_holds(&zone, p), inside, "{p:?}");
        }
    }
}

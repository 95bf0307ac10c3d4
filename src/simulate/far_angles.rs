//! The two angles of directions in a far field, and the solid angles of its cells.

use super::scene::FarFieldType;
use crate::math::{Frame, Point, Vector};
use std::f64::consts::TAU;

/// Returns a frame of right, up and forward, as seen by one who looks along the light: left-handed, with up as near to `up` as `forward`
/// allows.
pub(crate) fn far_axes(origin: Point, forward: Vector, up: Vector) -> Frame {
    let side = Frame::from_axis(origin, forward, Some(up));
    // from_axis makes x the upward one; right, up, forward as seen by one who looks along the light is left-handed.
    Frame { x: side.y, y: side.x, ..side }
}

/// Returns both angles, rad, of a unit direction (right, up, forward): H and V, or for type C azimuth in `[0, 2π)` and angle from forward.
pub(crate) fn to_angles(d: Vector, angles: FarFieldType) -> [f64; 2] {
    match angles {
        FarFieldType::A => [d.x.atan2(d.z), d.y.clamp(-1.0, 1.0).asin()],
        FarFieldType::B => [d.x.clamp(-1.0, 1.0).asin(), d.y.atan2(d.z)],
        // The cosine of a small angle is 1 to the last digits: its sine resolves it.
        FarFieldType::C => [d.y.atan2(d.x).rem_euclid(TAU), (d.x * d.x + d.y * d.y).sqrt().atan2(d.z)],
    }
}

/// Returns the solid angle, sr, of cell (i, j) of a field whose angles, rad, go from `low` to `high`.
pub(crate) fn solid_angle(
    angles: FarFieldType,
    low: [f64; 2],
    high: [f64; 2],
    cells: [u32; 2],
    [i, j]: [usize; 2],
) -> f64 {
    let edge = |axis: usize, k: usize| low[axis] + (high[axis] - low[axis]) * k as f64 / f64::from(cells[axis]);
    let (h, v) = ([edge(0, i), edge(0, i + 1)], [edge(1, j), edge(1, j + 1)]);
    // Differences of sines and cosines as products: they do not cancel beside a pole.
    let sines = |[a, b]: [f64; 2]| 2.0 * (0.5 * (a + b)).cos() * (0.5 * (b - a)).sin();
    let cosines = |[a, b]: [f64; 2]| 2.0 * (0.5 * (a + b)).sin() * (0.5 * (b - a)).sin();
    match angles {
        FarFieldType::A => (h[1] - h[0]) * sines(v),
        FarFieldType::B => sines(h) * (v[1] - v[0]),
        FarFieldType::C => (h[1] - h[0]) * cosines(v),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beside the axis the angle is its own sine, and a disc of the half angle a has πa² sr, both to the square of the angle.
    #[test]
    fn angles_and_solid_angles_beside_the_axis_keep_their_digits() {
        for angle in [1e-9, 1e-7, 1e-5f64] {
            for (end, to) in [(0.0, 1.0), (0.5 * TAU, -1.0)] {
                let d = Vector::new(0.6 * angle, 0.8 * angle, to * (1.0 - 0.5 * angle * angle));
                let [azimuth, from_axis] = to_angles(d, FarFieldType::C);
                assert!((azimuth - 0.8f64.atan2(0.6)).abs() < 1e-15);
                // π itself has a rounding of 1.2e−16.
                assert!(
                    ((from_axis - end).abs() / angle - 1.0).abs() < 1e-9 + 2.0 * end * 1e-16 / angle,
                    "{angle}"
                );
            }
            let disc = solid_angle(FarFieldType::C, [0.0, 0.0], [TAU, angle], [1, 1], [0, 0]);
            assert!((disc / (0.5 * TAU * angle * angle) - 1.0).abs() < 1e-9, "{angle}: {disc}");
        }
    }

    #[test]
    fn types_a_and_b_turn_about_axes_in_opposite_order() {
        // The formulas the other way: V of type A rises above the plane of H, H of type B leaves the plane of V.
        let (h, v) = (0.3f64, -0.7f64);
        let of_type_a = Vector::new(h.sin() * v.cos(), v.sin(), h.cos() * v.cos());
        let of_type_b = Vector::new(h.sin(), h.cos() * v.sin(), h.cos() * v.cos());
        for (d, angles, other) in
            [(of_type_a, FarFieldType::A, FarFieldType::B), (of_type_b, FarFieldType::B, FarFieldType::A)]
        {
            let difference = |[a, b]: [f64; 2]| (a - h).abs().max((b - v).abs());
            assert!(difference(to_angles(d, angles)) < 1e-15, "{angles:?}");
            assert!(difference(to_angles(d, other)) > 0.01, "{angles:?}");
        }
    }
}

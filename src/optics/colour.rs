//! Colours as numbers, and those of a screen: CIE 1931 X, Y, Z as sRGB (IEC 61966-2-1), whose white is D65.

/// Linear red, green and blue of X, Y, Z, in the unit of Y; a colour that no screen has gets negative parts.
pub fn linear_srgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.2406 * x - 1.5372 * y - 0.4986 * z,
        -0.9689 * x + 1.8758 * y + 0.0415 * z,
        0.0557 * x - 0.2040 * y + 1.0570 * z,
    ]
}

/// Encodes one linear part (red, green or blue, 1 being the most that the screen shows) by the sRGB curve as a byte; parts outside 0 to 1
/// are cut to it, and NaN is 0.
pub fn srgb_byte(linear: f64) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    // Straight where a power would be infinitely steep.
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded).round() as u8
}

/// Chromaticity `(x, y)`; `None` for black.
pub fn chromaticity([x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
    let sum = x + y + z;
    (sum > 0.0).then(|| [x / sum, y / sum])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White and primaries by their chromaticities in the standard: (0.3127, 0.3290), (0.64, 0.33), (0.30, 0.60), (0.15, 0.06).
    #[test]
    fn white_and_primaries_are_those_of_the_standard() {
        let of = |x: f64, y: f64| [x / y, 1.0, (1.0 - x - y) / y];
        let white = linear_srgb(of(0.3127, 0.3290));
        assert!(white.iter().all(|part| (part - 1.0).abs() < 1e-3), "{white:?}");
        for (k, (x, y)) in [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)].into_iter().enumerate() {
            let parts = linear_srgb(of(x, y));
            let others = (0..3).filter(|i| *i != k).map(|i| parts[i].abs());
            assert!(parts[k] > 1.0 && others.fold(0.0, f64::max) < 2e-3 * parts[k], "{parts:?}");
        }
    }

    #[test]
    fn bytes_are_those_of_the_standard() {
        // Half of the light of white is 188, a fifth is 124, the toe is straight.
        let bytes = [0.0, 0.001, 0.2, 0.5, 1.0, 7.0, -1.0].map(srgb_byte);
        assert_eq!(bytes, [0, 3, 124, 188, 255, 255, 0]);
    }
}

//! Wavelengths in sentences.

use crate::text::figures;

/// Digits of a wavelength: as many as single precision keeps.
const WAVELENGTH_DIGITS: usize = 7;

/// Writes a wavelength, nm, with its unit.
pub(super) fn wavelength_text(nm: f64) -> String {
    format!("{} nm", figures(nm, WAVELENGTH_DIGITS))
}

/// Writes the wavelengths from the first to the second, nm, with their unit; one alone where no digit distinguishes them.
pub(super) fn wavelength_range_text([first, last]: [f64; 2]) -> String {
    let [from, to] = [first, last].map(|nm| figures(nm, WAVELENGTH_DIGITS));
    if from == to { format!("{from} nm") } else { format!("{from} to {to} nm") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 587.5618 nm of a file in single precision is 587.56182861328125, and 0.7003 µm are 700.3000000000001 nm.
    #[test]
    fn wavelengths_have_the_digits_that_are_known() {
        let single = f64::from(587.5618f32);
        assert_eq!(wavelength_text(single), "587.5618 nm");
        assert_eq!(wavelength_range_text([single, 587.5618]), "587.5618 nm");
        assert_eq!(wavelength_range_text([single, 0.7003 * 1000.0]), "587.5618 to 700.3 nm");
    }
}

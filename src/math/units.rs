//! Factors from the units of files and people to those used inside: mm and radians.

use std::f64::consts::PI;

/// Millimetres in a metre.
pub const METRE: f64 = 1000.0;
/// Square millimetres in a square metre.
pub const SQUARE_METRE: f64 = METRE * METRE;
/// Millimetres in an inch, exact.
pub const INCH: f64 = 25.4;
/// Radians in a degree.
pub const DEGREE: f64 = PI / 180.0;
/// Wavelengths that light may have, nm: from X-rays to a millimetre. What is meant in micrometres mostly lies below.
pub const WAVELENGTHS_NM: std::ops::RangeInclusive<f64> = 1.0..=1e6;
/// Coordinates that a place in a scene may have, mm: squares of distances, and products of these, are numbers.
pub const PLACES_MM: std::ops::RangeInclusive<f64> = -1e30..=1e30;

/// Factor of an SI prefix by its STEP name (`MILLI`, `MICRO`, …), in capitals; `None` for a name that is no prefix.
pub fn si_prefix(name: &str) -> Option<f64> {
    Some(match name {
        "EXA" => 1e18,
        "PETA" => 1e15,
        "TERA" => 1e12,
        "GIGA" => 1e9,
        "MEGA" => 1e6,
        "KILO" => 1e3,
        "HECTO" => 1e2,
        "DECA" => 1e1,
        "DECI" => 1e-1,
        "CENTI" => 1e-2,
        "MILLI" => 1e-3,
        "MICRO" => 1e-6,
        "NANO" => 1e-9,
        "PICO" => 1e-12,
        "FEMTO" => 1e-15,
        "ATTO" => 1e-18,
        _ => return None,
    })
}

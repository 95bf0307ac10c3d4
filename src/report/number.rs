//! Numbers with units for people, in the unit that fits the size.

use crate::text::figures;

/// Prefixes of the SI.
const MILLI: f64 = 1e-3;
const KILO: f64 = 1e3;
const MEGA: f64 = 1e6;
const GIGA: f64 = 1e9;

/// Lifts a value to the next power of ten exactly where three digits would round it there, as 999.5 to 1000.
const ROUNDS_UP: f64 = 1.0 / 0.9995;

/// Writes a number of up to four digits with its noun, in the plural with an `s` unless it is written as 1.
pub(super) fn counted(value: f64, noun: &str) -> String {
    let number = figures(value, 4);
    let end = if number == "1" { "" } else { "s" };
    format!("{number} {noun}{end}")
}

/// Writes a unit of the results for people: `W/m²` for `W/m2`, `°` for `deg`.
pub(super) fn unit_in_words(unit: &str) -> String {
    if unit == "deg" { "°".into() } else { unit.replace("m2", "m²") }
}

/// Writes a number, or what stands for one, with its unit for people: `0.5°`, `0.5 mm`, and `0.5` where it has none.
pub(super) fn with_unit(number: &str, unit: &str) -> String {
    let space = if matches!(unit, "" | "deg") { "" } else { " " };
    format!("{number}{space}{}", unit_in_words(unit))
}

/// Writes a duration given in seconds: `1.23 s`, `45 ms`, `2 min 5 s`, `3 h 20 min`; a dash where it is not finite.
pub fn seconds(value: f64) -> String {
    // The unit is that of what is printed: 0.9996 s are 1 s, not 1000 ms.
    let printed = value * ROUNDS_UP;
    match value {
        v if !v.is_finite() => "–".into(),
        v if printed < MILLI => format!("{} µs", figures(v * MEGA, 3)),
        v if printed < 1.0 => format!("{} ms", figures(v * KILO, 3)),
        v if v.round() < 120.0 => format!("{} s", figures(v, 3)),
        // Rounded before they are divided: 59.6 s are a minute more, not 60 s.
        v if v.round() < 7200.0 => {
            let whole = v.round();
            format!("{} min {} s", (whole / 60.0).floor(), whole % 60.0)
        }
        v => {
            let minutes = (v / 60.0).round();
            format!("{} h {} min", (minutes / 60.0).floor(), minutes % 60.0)
        }
    }
}

/// Writes a size in memory, in powers of 1000: `12.3 MB`.
pub fn bytes(value: u64) -> String {
    let value = value as f64;
    let printed = value * ROUNDS_UP;
    match value {
        // Bytes are whole.
        v if v < KILO => format!("{v} B"),
        v if printed < MEGA => format!("{} kB", figures(v / KILO, 3)),
        v if printed < GIGA => format!("{} MB", figures(v / MEGA, 3)),
        v => format!("{} GB", figures(v / GIGA, 3)),
    }
}

/// Writes the smallest and the largest tolerance, mm: `0.05..0.2 mm`, or `0.2 mm` where both are the same.
pub fn tolerance_text(range: [f64; 2]) -> String {
    let [low, high] = range.map(|tolerance| figures(tolerance, 4));
    if low == high { format!("{low} mm") } else { format!("{low}..{high} mm") }
}

/// Writes a coordinate of a map, mm or degrees, to three figures, of a hundred and more to a tenth.
pub(super) fn coordinate_figures(at: f64) -> String {
    figures(at, if at.abs() < 100.0 { 3 } else { 4 })
}

/// Returns an angle, degrees, or 0 for what the sums of aiming leave of that.
pub(super) fn without_rounding(angle_deg: f64) -> f64 {
    /// Far below what is printed beside other angles, far above the rounding of a full turn.
    const NO_ANGLE_DEG: f64 = 1e-9;
    if angle_deg.abs() < NO_ANGLE_DEG { 0.0 } else { angle_deg }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_fit_the_size() {
        assert_eq!(
            (seconds(0.0451), seconds(75.0), seconds(125.0)),
            ("45.1 ms".into(), "75 s".into(), "2 min 5 s".into())
        );
        assert_eq!((seconds(179.6), seconds(179.4)), ("3 min 0 s".into(), "2 min 59 s".into()));
        assert_eq!((seconds(7199.4), seconds(7199.6)), ("119 min 59 s".into(), "2 h 0 min".into()));
        assert_eq!((seconds(12_000.0), seconds(86_399.0)), ("3 h 20 min".into(), "24 h 0 min".into()));
        assert_eq!(bytes(12_345_678), "12.3 MB");
        // A unit is left where rounding reaches the next, and not before.
        assert_eq!((seconds(0.9996), seconds(0.9994)), ("1 s".into(), "999 ms".into()));
        assert_eq!((seconds(9.996e-4), seconds(9.994e-4)), ("1 ms".into(), "999 µs".into()));
        assert_eq!((seconds(119.6), seconds(119.4)), ("2 min 0 s".into(), "119 s".into()));
        assert_eq!((bytes(999_600), bytes(999_400)), ("1 MB".into(), "999 kB".into()));
        assert_eq!(bytes(999_600_000), "1 GB");
    }
}

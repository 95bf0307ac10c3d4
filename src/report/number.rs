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

/// Digits of an error that are written: of few replicates it is known to some per cent.
const ERROR_DIGITS: usize = 2;

/// Returns the power of ten of the last of so many significant digits of a number, after rounding to these: 2 for 1309 and two; `None` for
/// 0 and what is not finite.
fn last_place(value: f64, digits: usize) -> Option<i32> {
    let scientific = format!("{:.*e}", digits.saturating_sub(1), value);
    let exponent: i32 = scientific.split_once('e')?.1.parse().ok()?;
    (value != 0.0).then_some(exponent + 1 - digits as i32)
}

/// Writes a number rounded to a multiple of this power of ten.
fn figures_to_place(value: f64, place: i32) -> String {
    let power = 10f64.powi(place.abs());
    let multiple = if place > 0 { (value / power).round() } else { (value * power).round() };
    if multiple == 0.0 {
        return figures(0.0, 1);
    }
    if !multiple.is_finite() {
        return figures(value, ERROR_DIGITS);
    }
    let digits = multiple.abs().log10().floor() as usize + 1;
    figures(if place > 0 { multiple * power } else { multiple / power }, digits)
}

/// Writes a standard error to two digits: `1300` for 1309.
pub(super) fn error_figures(error: f64) -> String {
    last_place(error, ERROR_DIGITS)
        .map_or_else(|| figures(error, ERROR_DIGITS), |place| figures_to_place(error, place))
}

/// Writes a number as far as its standard error knows it, to the place of the error's second digit, and to `most` digits at most: `20500`
/// for 20465.8 ± 1309. All of these where it has no error.
pub(super) fn known_figures(value: f64, error: f64, most: usize) -> String {
    match last_place(error, ERROR_DIGITS).zip(last_place(value, most)) {
        // Whole numbers are not rounded to fewer digits than they are known to.
        Some((known, own)) => figures_to_place(value, known.max(own.min(0))),
        None => figures(value, most),
    }
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
    fn a_number_has_the_digits_that_its_error_knows() {
        for (value, error, most, text) in [
            (202_191_486.0, 3_639_695.0, 3, "202\u{202f}200\u{202f}000 ± 3\u{202f}600\u{202f}000"),
            (20_465.8, 1309.0, 6, "20\u{202f}500 ± 1300"),
            (-0.000189921, 0.00013, 6, "−0.00019 ± 0.00013"),
            (135.1, 0.3, 4, "135.1 ± 0.3"),
            (12_345.6, 0.5, 4, "12\u{202f}346 ± 0.5"),
            (99.96, 9.97, 6, "100 ± 10"),
            (0.002, 0.5, 6, "0 ± 0.5"),
            (382.0, 0.0, 6, "382 ± 0"),
            (0.0, 3.21, 6, "0 ± 3.2"),
            (1.5, f64::INFINITY, 6, "1.5 ± ∞"),
            (1e-320, 1e-310, 6, "1e−320 ± 1e−310"),
        ] {
            assert_eq!(format!("{} ± {}", known_figures(value, error, most), error_figures(error)), text);
        }
    }

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

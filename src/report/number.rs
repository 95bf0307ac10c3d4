//! Numbers for people: as many digits as mean something, thousands set apart, units that fit the size.

/// Prefixes of the SI.
const MILLI: f64 = 1e-3;
const KILO: f64 = 1e3;
const MEGA: f64 = 1e6;
const GIGA: f64 = 1e9;

/// Lifts a value to the next power of ten exactly where three digits would round it there, as 999.5 to 1000.
const ROUNDS_UP: f64 = 1.0 / 0.9995;

/// Sets thousands apart (ISO 80000-1, 7.3.1), without a line breaking there.
pub(super) const NARROW_SPACE: char = '\u{202f}';

/// Writes a number with so many significant digits, from 1 to 17, without exponent where that stays short, and from five digits on with
/// thousands apart: `0.0123`, `1234`, `3.2e−9`. What is not a number is a dash.
///
/// ```
/// assert_eq!(lampyris::report::figures(0.0123456, 3), "0.0123");
/// ```
pub fn figures(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return if value.is_nan() {
            "–".into()
        } else if value > 0.0 {
            "∞".into()
        } else {
            "−∞".into()
        };
    }
    if value == 0.0 {
        return "0".into();
    }
    let digits = digits.clamp(1, 17);
    // Rounded to its digits first: 0.9996 to three digits is 1, and has another exponent.
    let scientific = format!("{:.*e}", digits - 1, value);
    let parts = scientific.split_once('e').and_then(|(m, e)| Some((m, e.parse::<i32>().ok()?)));
    let Some((mantissa, exponent)) = parts else {
        debug_assert!(false, "{scientific} has no exponent");
        return scientific;
    };
    // Longer than that a number is read wrong.
    if !(-4..9).contains(&exponent) {
        return format!("{}e{exponent}", without_end_zeros(mantissa)).replace('-', "−");
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    let text = format!("{value:.decimals$}");
    let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
    let fraction = fraction.trim_end_matches('0');
    let dot = if fraction.is_empty() { "" } else { "." };
    format!("{}{dot}{fraction}", in_thousands(whole)).replace('-', "−")
}

/// Writes a whole number with its thousands set apart by narrow spaces, from five digits on.
pub fn grouped(value: u64) -> String {
    in_thousands(&value.to_string())
}

/// Writes how many there are of something, with its noun in the plural with an `s` unless it is one.
///
/// ```
/// assert_eq!(lampyris::report::count_of(1, "ray"), "1 ray");
/// assert_eq!(lampyris::report::count_of(20, "ray"), "20 rays");
/// ```
pub fn count_of(number: u64, noun: &str) -> String {
    format!("{} {noun}{}", grouped(number), if number == 1 { "" } else { "s" })
}

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

/// Writes a number, or what stands for one, with its unit for people: `0.5°`, `0.5 mm`.
pub(super) fn with_unit(number: &str, unit: &str) -> String {
    let space = if unit == "deg" { "" } else { " " };
    format!("{number}{space}{}", unit_in_words(unit))
}

/// Writes a duration given in seconds: `1.23 s`, `45 ms`, `2 min 5 s`; a dash where it is not finite.
pub fn seconds(value: f64) -> String {
    // The unit is that of what is printed: 0.9996 s are 1 s, not 1000 ms.
    let printed = value * ROUNDS_UP;
    match value {
        v if !v.is_finite() => "–".into(),
        v if printed < MILLI => format!("{} µs", figures(v * MEGA, 3)),
        v if printed < 1.0 => format!("{} ms", figures(v * KILO, 3)),
        v if v.round() < 120.0 => format!("{} s", figures(v, 3)),
        v => {
            // Rounded before it is divided: 59.6 s are a minute more, not 60 s.
            let whole = v.round();
            format!("{} min {} s", (whole / 60.0).floor(), whole % 60.0)
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

/// Returns a mantissa without the zeros at its end.
fn without_end_zeros(mantissa: &str) -> &str {
    if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.') } else { mantissa }
}

/// Groups the digits of a whole number, sign allowed, by threes with [`NARROW_SPACE`], from five digits on.
fn in_thousands(whole: &str) -> String {
    let (sign, digits) = whole.strip_prefix('-').map_or(("", whole), |d| ("-", d));
    // Four digits are read at a glance.
    if digits.len() < 5 {
        return whole.to_owned();
    }
    let mut text = String::from(sign);
    for (k, c) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(NARROW_SPACE);
        }
        text.push(c);
    }
    text
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
    fn significant_digits() {
        for (value, digits, text) in [
            (0.0123456, 3, "0.0123"),
            (1234.5, 3, "1234"),
            (1234567.0, 7, "1\u{202f}234\u{202f}567"),
            (-0.5, 3, "−0.5"),
            (3.2e-9, 2, "3.2e−9"),
            (0.0, 3, "0"),
            (99.96, 3, "100"),
            (f64::NAN, 3, "–"),
        ] {
            assert_eq!(figures(value, digits), text);
        }
        assert_eq!(grouped(1_000_000), "1\u{202f}000\u{202f}000");
        assert_eq!(
            (seconds(0.0451), seconds(75.0), seconds(125.0)),
            ("45.1 ms".into(), "75 s".into(), "2 min 5 s".into())
        );
        assert_eq!((seconds(179.6), seconds(179.4)), ("3 min 0 s".into(), "2 min 59 s".into()));
        assert_eq!(bytes(12_345_678), "12.3 MB");
        // A unit is left where rounding reaches the next, and not before.
        assert_eq!((seconds(0.9996), seconds(0.9994)), ("1 s".into(), "999 ms".into()));
        assert_eq!((seconds(9.996e-4), seconds(9.994e-4)), ("1 ms".into(), "999 µs".into()));
        assert_eq!((seconds(119.6), seconds(119.4)), ("2 min 0 s".into(), "119 s".into()));
        assert_eq!((bytes(999_600), bytes(999_400)), ("1 MB".into(), "999 kB".into()));
        assert_eq!(bytes(999_600_000), "1 GB");
    }
}

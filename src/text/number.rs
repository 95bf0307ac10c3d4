//! Numbers for people: as many digits as mean something, thousands set apart.

/// Sets thousands apart (ISO 80000-1, 7.3.1), without a line breaking there.
pub(crate) const NARROW_SPACE: char = '\u{202f}';

/// Writes a number with so many significant digits, from 1 to 17, without exponent where that stays short, and from five digits on with
/// thousands apart: `0.0123`, `1234`, `3.2e−9`. What is not a number is a dash.
///
/// ```
/// assert_eq!(lampyris::text::figures(0.0123456, 3), "0.0123");
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

/// Writes a number as it is typed, with a power of ten where it would else have many zeros: `0.5`, `1e300`.
pub(crate) fn typed_number(value: f64) -> String {
    /// Sizes that are written with all their digits, but for 0.
    const PLAIN: std::ops::Range<f64> = 1e-6..1e15;
    let is_plain = value == 0.0 || !value.is_finite() || PLAIN.contains(&value.abs());
    if is_plain { value.to_string() } else { format!("{value:e}") }
}

/// Writes a whole number with its thousands set apart by narrow spaces, from five digits on.
pub fn grouped(value: u64) -> String {
    in_thousands(&value.to_string())
}

/// Writes how many there are of something, with its noun in the plural with an `s` unless it is one.
///
/// ```
/// assert_eq!(lampyris::text::count_of(1, "ray"), "1 ray");
/// assert_eq!(lampyris::text::count_of(20, "ray"), "20 rays");
/// ```
pub fn count_of(number: u64, noun: &str) -> String {
    format!("{} {noun}{}", grouped(number), if number == 1 { "" } else { "s" })
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
    }
}

//! Numbers: the exact fast path of Clinger, *How to Read Floating Point Numbers Accurately*, PLDI 1990, for digits that make up less
//! than 2⁵³ and powers of ten up to 22; the standard library for the rest.

use super::Value;

/// Powers of ten that double precision holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19,
    1e20, 1e21, 1e22,
];

/// Stands for all ids beyond 64 bits, which no instance has.
pub(super) const TOO_LARGE: u64 = u64::MAX;

/// Reads the digits of an id at byte `at` and returns it with the position after it, [`TOO_LARGE`] beyond 64 bits; `None` without digits.
pub(super) fn unsigned(source: &[u8], at: usize) -> Option<(u64, usize)> {
    let digits = source[at..].iter().take_while(|c| c.is_ascii_digit());
    let (id, count) = digits
        .fold((0u64, 0), |(id, count), c| (id.saturating_mul(10).saturating_add(u64::from(c - b'0')), count + 1));
    (count > 0).then_some((id, at + count))
}

/// Reads an integer or real at byte `at` and returns it with the position after it.
///
/// Integers beyond 64 bits become reals, and FORTRAN's `D` marks an exponent too. `None` without digits, or where the value overflows.
pub(super) fn number(source: &[u8], at: usize) -> Option<(Value, usize)> {
    let mut i = at;
    let negative = source.get(i) == Some(&b'-');
    if negative || source.get(i) == Some(&b'+') {
        i += 1;
    }
    let (mut digits, mut mantissa, mut exact) = (0usize, 0u64, true);
    let mut digit = |c: u8| {
        digits += 1;
        match mantissa.checked_mul(10).and_then(|m| m.checked_add(u64::from(c - b'0'))) {
            Some(m) => mantissa = m,
            // What does not fit 64 bits is read again by the standard library.
            None => exact = false,
        }
    };
    while let Some(&c) = source.get(i).filter(|c| c.is_ascii_digit()) {
        digit(c);
        i += 1;
    }
    let mut exponent = 0i32;
    let mut real = false;
    if source.get(i) == Some(&b'.') {
        real = true;
        i += 1;
        let start = i;
        while let Some(&c) = source.get(i).filter(|c| c.is_ascii_digit()) {
            digit(c);
            i += 1;
        }
        // Each digit behind the point counts a tenth.
        exponent = -i32::try_from(i - start).ok()?;
    }
    if digits == 0 {
        return None;
    }
    // FORTRAN's `D`, which Part 21 does not know, is read too.
    if matches!(source.get(i), Some(b'E' | b'e' | b'D' | b'd')) {
        let mut j = i + 1;
        let minus = source.get(j) == Some(&b'-');
        if minus || source.get(j) == Some(&b'+') {
            j += 1;
        }
        let start = j;
        let mut power = 0i32;
        while let Some(&c) = source.get(j).filter(|c| c.is_ascii_digit()) {
            // Bounded against overflow; beyond 22 the standard library reads the text anyway.
            power = power.saturating_mul(10).saturating_add(i32::from(c - b'0')).min(100_000);
            j += 1;
        }
        // An `E` without digits belongs to what follows.
        if j > start {
            exponent = exponent.saturating_add(if minus { -power } else { power });
            real = true;
            i = j;
        }
    }
    if !real
        && exact
        && let Ok(x) = i64::try_from(mantissa)
    {
        return Some((Value::Integer(if negative { -x } else { x }), i));
    }
    // Both are exact in double precision below 2⁵³ and 10²², so that one rounding is left: the nearest number (Clinger 1990). Else the
    // standard library reads it.
    let magnitude = if exact && mantissa < 1 << 53 && exponent.unsigned_abs() <= 22 {
        let power = POWERS[exponent.unsigned_abs() as usize];
        if exponent < 0 { mantissa as f64 / power } else { mantissa as f64 * power }
    } else {
        parse_by_library(&source[at..i])?
    };
    let x = if negative { -magnitude } else { magnitude };
    // An overflow is refused: no length of a file is infinite.
    x.is_finite().then_some((Value::Real(x), i))
}

/// Returns the absolute value of a number, `D` for `E` allowed, by the standard library; infinite where it overflows.
#[cold]
fn parse_by_library(text: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(text).ok()?;
    let text = text.trim_start_matches(['+', '-']);
    if text.contains(['D', 'd']) { text.replace(['D', 'd'], "E").parse().ok() } else { text.parse().ok() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(text: &str) -> Option<Value> {
        number(text.as_bytes(), 0).map(|(v, _)| v)
    }

    #[test]
    fn every_spelling() {
        assert_eq!(read("12"), Some(Value::Integer(12)));
        assert_eq!(read("-0"), Some(Value::Integer(0)));
        assert_eq!(read("1."), Some(Value::Real(1.0)));
        assert_eq!(read(".5"), Some(Value::Real(0.5)));
        assert_eq!(read("+1.5E+01,"), Some(Value::Real(15.0)));
        assert_eq!(read("1.E-3"), Some(Value::Real(1e-3)));
        assert_eq!(read("1.5D2"), Some(Value::Real(150.0)));
        assert_eq!(read("123456789012345678901234567890"), Some(Value::Real(123456789012345678901234567890.0)));
        assert_eq!(read("1e999"), None, "infinity is no number of a file");
        assert_eq!(read("-"), None);
        assert_eq!(read("."), None);
    }

    proptest! {
        #[test]
        fn agrees_with_the_standard_library(x in proptest::num::f64::NORMAL) {
            for text in [format!("{x:?}"), format!("{x:e}"), format!("{x:.17e}")] {
                let text = if text.contains('.') || text.contains('e') { text } else { format!("{text}.0") };
                let Some(Value::Real(y)) = read(&text) else { panic!("{text}") };
                prop_assert_eq!(x.to_bits(), y.to_bits());
            }
        }
    }
}

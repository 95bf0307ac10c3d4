//! Words that stand in one line: numbers with their units, errors and names.

/// What is kept beside a number: units of what is printed, and signs between two numbers.
const UNITS: [&str; 25] = [
    "%", "°", "±", "×", "nm", "µm", "mm", "m", "mm²", "sr", "µs", "ms", "s", "min", "B", "kB", "MB", "GB", "W",
    "lm", "cd", "lx", "W/m²", "W/sr", "lm/W",
];

/// Whether two words stand in one line: a number and its unit, an angle and its name, a value and its error.
pub(crate) fn belong_together(word: &str, next: &str) -> bool {
    let is_number = |word: &str| {
        let word = word.trim_start_matches(['(', '−', '-', '±']);
        word.starts_with(|c: char| c.is_ascii_digit())
    };
    let unit = next.trim_end_matches(['.', ',', ';', ':', ')']);
    if is_number(word) && word.ends_with(|c: char| c.is_ascii_digit()) {
        return UNITS.contains(&unit);
    }
    ["H", "V", "C", "γ", "±", "×"].contains(&word.trim_start_matches('(')) && is_number(next)
}

/// Returns a text whose words that [`belong_together`] are joined by no-break spaces.
pub(crate) fn unbroken(text: &str) -> String {
    const NO_BREAK_SPACE: char = '\u{a0}';
    let mut joined = String::with_capacity(text.len());
    let mut before = None;
    for word in text.split(' ') {
        if let Some(before) = before {
            joined.push(if belong_together(before, word) { NO_BREAK_SPACE } else { ' ' });
        }
        joined.push_str(word);
        before = Some(word);
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::unbroken;

    #[test]
    fn a_number_keeps_its_unit_its_error_and_its_name() {
        let text = unbroken("at H 0.55° are 256 ± 52 cd (12.5 %), 5 of 7 rays  in 3 s.");
        assert_eq!(text.replace('\u{a0}', "_"), "at H_0.55° are 256_±_52_cd (12.5_%), 5 of 7 rays  in 3_s.");
        assert_eq!(unbroken(""), "");
    }
}

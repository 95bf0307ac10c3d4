//! Access to the values in a study's rows, any of which may be missing.

use serde_json::Value;

/// Returns a number of a row; `None` when absent, null or no number.
pub(super) fn number(row: &Value, key: &str) -> Option<f64> {
    // JSON has no infinity; what was none is null, and absent.
    row[key].as_f64().filter(|x| x.is_finite())
}

/// Returns a text of a row, empty when absent or no text.
pub(super) fn text<'a>(row: &'a Value, key: &str) -> &'a str {
    row[key].as_str().unwrap_or_default()
}

/// Returns the different texts of a key, in order of appearance; empty ones are left out.
pub(super) fn distinct<'a>(rows: &[&'a Value], key: &str) -> Vec<&'a str> {
    let mut seen = Vec::new();
    for value in rows.iter().map(|r| text(r, key)) {
        if !value.is_empty() && !seen.contains(&value) {
            seen.push(value);
        }
    }
    seen
}

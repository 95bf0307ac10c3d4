//! What the rows of a study hold, whatever is missing in them.

use serde_json::Value;

/// A number of a row; `None` when absent or null.
pub(super) fn number(row: &Value, key: &str) -> Option<f64> {
    // JSON has no infinity; what was none is null, and absent.
    row[key].as_f64().filter(|x| x.is_finite())
}

/// A text of a row, empty when absent.
pub(super) fn text<'a>(row: &'a Value, key: &str) -> &'a str {
    row[key].as_str().unwrap_or_default()
}

/// The different texts of a key, in order of appearance.
pub(super) fn distinct<'a>(rows: &[&'a Value], key: &str) -> Vec<&'a str> {
    let mut seen = Vec::new();
    for value in rows.iter().map(|r| text(r, key)) {
        if !value.is_empty() && !seen.contains(&value) {
            seen.push(value);
        }
    }
    seen
}

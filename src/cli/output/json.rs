//! JSON documents of commands: every one is made, written and printed the same way.

use crate::cli::failure::Failure;
use crate::formats::printable_json;
use serde::Serialize;
use serde_json::Value;

/// Returns a piece of a document as JSON; fails where it has no such form.
pub(crate) fn json_value(piece: &impl Serialize) -> Result<Value, Failure> {
    serde_json::to_value(piece).map_err(|e| Failure::running(e.to_string()))
}

/// Returns a document as text, indented, its last line ended, control characters escaped.
pub(crate) fn json_text(document: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(document).map_err(|e| Failure::running(e.to_string()))?;
    Ok(printable_json(text + "\n"))
}

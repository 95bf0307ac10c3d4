use super::{Key, suggest};
use crate::simulate::{Error, ErrorKind};
use std::ops::Range;
use std::sync::Arc;
use toml::de::{DeTable, DeValue};

/// Effects that a user may ask for by key and that are not simulated.
const REFUSED: [(&str, &str); 7] = [
    ("fluorescence", "fluorescence"),
    ("phosphor", "fluorescence"),
    ("birefringence", "birefringence"),
    ("gradient_index", "gradient index"),
    ("grin", "gradient index"),
    ("diffraction", "diffraction"),
    ("interference", "interference of paths"),
];

/// The bytes of the value at a path; of the deepest table on the way when the value itself is not there.
pub(super) fn span(text: &str, path: &[Key<'_>]) -> Option<Range<usize>> {
    let root = DeTable::parse(text).ok()?;
    let mut value: Option<&DeValue<'_>> = None;
    let mut span = None;
    for key in path {
        let next = match (key, value) {
            (Key::Name(name), None) => root.get_ref().get(*name),
            (Key::Name(name), Some(DeValue::Table(t))) => t.get(*name),
            (Key::Index(i), Some(DeValue::Array(a))) => a.get(*i),
            _ => None,
        };
        let Some(next) = next else { break };
        span = Some(next.span());
        value = Some(next.get_ref());
    }
    span
}

/// An error of the TOML reader with its place, and the key that was probably meant.
pub(super) fn syntax(e: &toml::de::Error, file: &str, text: &Arc<str>) -> Error {
    let message = e.message();
    let mut words = message.split('`').skip(1).step_by(2);
    let error = if message.starts_with("unknown field") {
        let word = words.next().unwrap_or("");
        if let Some((_, effect)) = REFUSED.iter().find(|(key, _)| *key == word) {
            let message = format!("`{word}`: {effect} is not simulated");
            Error::new(ErrorKind::Unsupported, message)
                .help("remove the key; the result would be wrong if it were ignored")
        } else {
            let known: Vec<&str> = words.collect();
            let error = Error::new(ErrorKind::Syntax, format!("unknown key `{word}`"));
            match suggest::nearest(word, known.iter().copied()) {
                Some(near) => error.help(format!("did you mean `{near}`?")),
                None => error.help(format!("known here: {}", known.join(", "))),
            }
        }
    } else if message.starts_with("unknown variant") {
        let word = words.next().unwrap_or("");
        let known: Vec<&str> = words.collect();
        if let Some((_, effect)) = REFUSED.iter().find(|(key, _)| *key == word) {
            Error::new(ErrorKind::Unsupported, format!("`{word}`: {effect} is not simulated"))
        } else {
            let error = Error::new(ErrorKind::Syntax, format!("`{word}` is none of {}", known.join(", ")));
            match suggest::nearest(word, known.iter().copied()) {
                Some(near) => error.help(format!("did you mean `{near}`?")),
                None => error,
            }
        }
    } else {
        Error::new(ErrorKind::Syntax, message.trim())
    };
    error.at(file, text, e.span())
}

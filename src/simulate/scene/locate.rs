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

/// What stands where a table belongs.
const TABLES: [(&str, &str); 8] = [
    ("struct SpectrumKey", "spectrum = { kind = \"d65\" }"),
    ("struct Placement", "placement = { at = [0, 0, 10] }"),
    ("struct ScatterKey", "scatter = { lobe = \"gaussian\", sigma_deg = 2 }"),
    ("struct FaceSelector", "on = { part = \"led\" }"),
    ("struct Run", "[run]"),
    ("struct Accuracy", "[accuracy]"),
    ("struct Scene", "[[source]]"),
    ("a sequence", "[[source]], with both brackets doubled, for an entry of a list"),
];

/// A value of the wrong type, in words that do not speak of the program's own types.
fn typed(message: &str) -> Error {
    let message = message.trim();
    if let Some((form, example)) = TABLES.iter().find(|(form, _)| message.ends_with(&format!("expected {form}"))) {
        let what = if form.starts_with("struct") { "a table" } else { "a list" };
        let message = message.replace(form, what).replace("invalid type: map", "a single table");
        return Error::new(ErrorKind::Syntax, message).help(format!("write it as in {example}"));
    }
    for (form, plain) in [
        ("did not match any variant of untagged enum OneOrMany", "neither one value nor a list of them"),
        ("did not match any variant of untagged enum ColourKey", "neither \"#rrggbb\" nor [r, g, b]"),
        (
            "did not match any variant of untagged enum Reflectance",
            "neither a share nor rows [angle_deg, share] or [angle_deg, nm, share]",
        ),
        ("did not match any variant of untagged enum ByWavelength", "neither a number nor rows [nm, value]"),
    ] {
        if message.contains(form) {
            return Error::new(ErrorKind::Syntax, format!("this is {plain}"));
        }
    }
    Error::new(
        ErrorKind::Syntax,
        message.replace("expected f64", "expected a number").replace("expected u64", "expected a whole number"),
    )
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
        typed(message)
    };
    error.at(file, text, e.span())
}

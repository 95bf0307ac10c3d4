//! Where in a scene file something is wrong, and what was probably meant.

use crate::simulate::{Error, ErrorKind};
use crate::text;
use std::ops::Range;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// One step of a path into a scene file.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Key<'a> {
    /// A key of a table.
    Name(&'a str),
    /// A place in an array.
    Index(usize),
}

/// Effects that a user may ask for by key or kind and that are not simulated: what such words start with.
const REFUSED: [(&str, &str); 20] = [
    ("fluoresc", "fluorescence"),
    ("phosphor", "fluorescence"),
    ("luminesc", "fluorescence"),
    ("quantum_yield", "fluorescence"),
    ("birefring", "birefringence"),
    ("extraordinary", "birefringence"),
    ("uniaxial", "birefringence"),
    ("waveplate", "birefringence"),
    ("retarder", "birefringence"),
    ("index_extraordinary", "birefringence"),
    ("index_ordinary", "birefringence"),
    ("ordinary", "birefringence"),
    ("gradient", "gradient index"),
    ("graded", "gradient index"),
    ("index_gradient", "gradient index"),
    ("grin", "gradient index"),
    ("diffract", "diffraction"),
    ("grating", "diffraction"),
    ("interference", "interference of paths"),
    ("coheren", "interference of paths"),
];

/// Returns the effect that a word asks for and that is not simulated; `None` for any other word.
fn unsupported_effect(word: &str) -> Option<&'static str> {
    // Spelling with hyphens or capitals is forgiven: the word is refused either way, and should be with its reason.
    let word = word.to_lowercase().replace('-', "_");
    REFUSED.iter().find(|(start, _)| word.starts_with(start)).map(|(_, effect)| *effect)
}

/// What is asked for by a key that does not exist: how such words start, a key that is known where it is meant, and what to write there.
const ELSEWHERE: [(&str, &str, &str); 3] = [
    (
        "wavelength",
        "spectrum",
        "write spectrum = { values = [[550, 1]] } for 550 nm; `wavelength_nm` in [run] is that of all sources without a spectrum",
    ),
    ("flux", "spectrum", LUMENS),
    ("lumen", "spectrum", LUMENS),
];
const LUMENS: &str = "write `power`: watts, or lumens with unit = \"lm\" in [run]";

/// What to write where a list belongs.
const LISTS: [(&str, &str); 10] = [
    (
        "coating",
        "`coating` takes rows [angle_deg, nm, R, T], as in coating = [[0, 550, 0.1, 0.9], [90, 550, 1, 0]]; for the same shares \
         everywhere give `reflectance` and `transmittance` in its place",
    ),
    ("values", "write pairs of nm and power, as in values = [[450, 1], [620, 2]]"),
    ("index_table", "write pairs of nm and index, as in index_table = [[450, 1.53], [650, 1.51]]"),
    ("sellmeier", "write pairs of B and C (µm²), as in sellmeier = [[1.18, 0.0113]]"),
    ("cauchy", "write the coefficients, as in cauchy = [1.5, 0.004]"),
    ("bins_nm", "write the edges, as in bins_nm = [400, 500, 600, 700]"),
    ("abg", "write A, B and g, as in abg = [0.01, 0.001, 2]"),
    ("metal", "write n and k, as in metal = [1.2, 7.0]"),
    ("tolerance_mm", "write tolerance_mm = [0.05, 0.2]"),
    ("without", "write a list of selectors, as in without = [{ part = \"helper*\" }]"),
];

/// What to write for a line of a STEP file.
const ENTITY: &str = "write the number of the file's line without its `#`, as in entity = 39, or a list of them";

/// What to write for a point near a face.
const POINT: &str = "a point has three numbers, as in at = [0, 0, 25]; several points are a list of such";

/// Returns what to write for a list of so many values.
fn list_help(key: &str, count: usize) -> String {
    format!("write {key} = [{}]", vec!["…"; count].join(", "))
}

/// Returns the bytes of the value at a path, or of the deepest table on the way when the value is not written; `None` where not even its
/// first key is, or the text is no TOML.
pub(super) fn span(text: &str, path: &[Key<'_>]) -> Option<Range<usize>> {
    // The values that were read do not know their places: the text is read once more for them.
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
        // A key that is not written has no place: its table is shown.
        let Some(next) = next else { break };
        span = Some(next.span());
        value = Some(next.get_ref());
    }
    span
}

/// Returns for each table of a list whether a key is written in it; empty where the text has no such list.
pub(super) fn tables_with(text: &str, list: &str, key: &str) -> Vec<bool> {
    let Ok(root) = DeTable::parse(text) else { return Vec::new() };
    let Some(DeValue::Array(tables)) = root.get_ref().get(list).map(Spanned::get_ref) else { return Vec::new() };
    let has_key =
        |table: &Spanned<DeValue<'_>>| matches!(table.get_ref(), DeValue::Table(t) if t.contains_key(key));
    tables.iter().map(has_key).collect()
}

/// What the reader expected, and how to write it.
const TABLES: [(&str, &str); 14] = [
    ("struct SpectrumKey", "spectrum = { kind = \"d65\" }"),
    ("struct Placement", "placement = { at = [0, 0, 10] }"),
    ("struct ScatterKey", "scatter = { lobe = \"gaussian\", sigma_deg = 2 }"),
    ("struct FaceSelector", "on = { part = \"led\" }"),
    ("struct Run", "[run]"),
    ("struct Accuracy", "[accuracy]"),
    ("struct Scene", "[[source]]"),
    ("struct Source", "[[source]]"),
    ("struct Receiver", "[[receiver]]"),
    ("struct Material", "[[material]]"),
    ("struct Medium", "[[medium]]"),
    ("struct ModelUse", "[[model]]"),
    ("struct RegulationUse", "[[regulation]]"),
    ("a sequence", "[[source]], with both brackets doubled, for an entry of a list"),
];

/// What the reader calls numbers, and what people do.
const PLAIN_TYPES: [(&str, &str); 6] = [
    ("expected f64", "expected a number"),
    ("expected u64", "expected a whole number, 0 or more"),
    ("expected u32", "expected a whole number, 0 or more"),
    ("expected u16", "expected a whole number, 0 or more"),
    ("expected u8", "expected a whole number, 0 or more"),
    ("expected usize", "expected a whole number, 0 or more"),
];

/// Makes the error for a message of the TOML reader that names no unknown key or variant, in words that do not speak of the program's
/// own types, with an example where a list or table belongs; other messages stay. `key` is that of the value, empty where not known.
fn type_error(message: &str, key: &str) -> Error {
    let message = &short_numbers(message.trim());
    // A list that is too short is of the right form.
    let lengths =
        message.strip_prefix("invalid length ").and_then(|m| m.split_once(", expected an array of length "));
    if let Some((given, wanted)) = lengths.and_then(|(given, wanted)| Some((given, wanted.parse::<usize>().ok()?)))
    {
        let error = Error::new(ErrorKind::Syntax, format!("{given} in a list where {wanted} values belong"));
        return if key.is_empty() { error } else { error.help(list_help(key, wanted)) };
    }
    // The key is checked first: a list has its own form, which the type does not show.
    if let Some((_, help)) = LISTS.iter().find(|(list, _)| *list == key) {
        let message = plain_types(message).replace("a sequence", "a list").replace("an array", "a list");
        return Error::new(ErrorKind::Syntax, message).help(*help);
    }
    let scalar =
        message.strip_prefix("invalid type: ").and_then(|m| m.split_once(", expected an array of length "));
    if let Some((given, wanted)) = scalar.and_then(|(given, wanted)| Some((given, wanted.parse::<usize>().ok()?))) {
        let error = Error::new(ErrorKind::Syntax, format!("{given} where a list of {wanted} values belongs"));
        return if key.is_empty() { error } else { error.help(list_help(key, wanted)) };
    }
    if let Some((form, example)) = TABLES.iter().find(|(form, _)| message.ends_with(&format!("expected {form}"))) {
        let what = if form.starts_with("struct") { "a table" } else { "a list" };
        let message = message.replace(form, what).replace("invalid type: map", "a single table");
        let message = message.replace("invalid type: sequence", "a list");
        return Error::new(ErrorKind::Syntax, message).help(format!("write it as in {example}"));
    }
    for (form, plain) in [
        ("did not match any variant of untagged enum OneOrMany", "neither one value nor a list of them"),
        ("did not match any variant of untagged enum SolidKey", "neither the number of a solid nor its name"),
        ("did not match any variant of untagged enum ColourKey", "neither \"#rrggbb\" nor [r, g, b]"),
        (
            "did not match any variant of untagged enum Reflectance",
            "neither a share nor rows [angle_deg, share] or [angle_deg, nm, share]",
        ),
        ("did not match any variant of untagged enum ByWavelength", "neither a number nor rows [nm, value]"),
    ] {
        if message.contains(form) {
            let error = Error::new(ErrorKind::Syntax, format!("this is {plain}"));
            return match key {
                "entity" => error.help(ENTITY),
                "at" => error.help(POINT),
                _ => error,
            };
        }
    }
    let error = Error::new(ErrorKind::Syntax, plain_types(message));
    // What the type holds is far more than a receiver may have.
    if key == "cells" { error.help("a receiver has from 1 to 16 million cells in all") } else { error }
}

/// What the reader calls whole numbers of a limited size, and the greatest of them.
const LIMITS: [(&str, u64); 3] =
    [("expected u32", u32::MAX as u64), ("expected u16", u16::MAX as u64), ("expected u8", u8::MAX as u64)];

/// Returns a message of the reader with numbers called as people do.
fn plain_types(message: &str) -> String {
    // Of one that is too large the limit is what is wrong.
    let given = message.strip_prefix("invalid value: integer `").and_then(|rest| rest.split_once('`'));
    let is_too_large = given.is_some_and(|(number, _)| !number.starts_with('-'));
    let limit = LIMITS.iter().find(|(form, _)| is_too_large && message.contains(form));
    if let Some((form, most)) = limit {
        return message.replace(form, &format!("expected a whole number from 0 to {most}"));
    }
    let message = PLAIN_TYPES.iter().fold(message.to_owned(), |m, (form, plain)| m.replace(form, plain));
    // Within a list that has a form of its own.
    let message = match message.split_once("expected struct ") {
        Some((before, _)) => format!("{before}expected a table"),
        None => message,
    };
    message.replace("invalid type: map", "a table").replace("invalid type: sequence", "a list")
}

/// Longest number that a message of the reader keeps: seventeen digits, a sign, a point and an exponent.
const LONGEST_NUMBER: usize = 24;

/// Returns a message of the reader with numbers of many digits, which it puts in backquotes, as they are typed: `1e300`.
fn short_numbers(message: &str) -> String {
    let pieces = message.split('`').enumerate().map(|(k, piece)| {
        let is_long = k % 2 == 1 && piece.len() > LONGEST_NUMBER;
        let number = piece.parse::<f64>().ok().filter(|_| is_long);
        number.map_or_else(|| piece.to_owned(), text::typed_number)
    });
    pieces.collect::<Vec<String>>().join("`")
}

/// Returns the key whose value stands at byte `at` of the text, by its line; empty where there is none.
fn key_before(text: &str, at: usize) -> &str {
    let before = text.get(..at).unwrap_or("");
    let line = before.rsplit('\n').next().unwrap_or("");
    let key = line.rsplit_once('=').map_or("", |(key, _)| key);
    key.rsplit(['{', ',', '.']).next().unwrap_or("").trim()
}

/// Returns the place of the first list of the file that is longer than what was understood of it, and what to say; `None` where all are
/// alike. The reader takes as many entries as it needs and passes over the rest.
pub(super) fn unread_entries(text: &str, understood: &serde_json::Value) -> Option<(Range<usize>, String)> {
    /// Returns the first list within `value` with more entries than the scene has understood, and what to say of it.
    fn unread(value: &Spanned<DeValue<'_>>, known: &serde_json::Value) -> Option<(Range<usize>, String)> {
        match (value.get_ref(), known) {
            (DeValue::Table(table), serde_json::Value::Object(known)) => {
                table.iter().find_map(|(key, v)| unread(v, known.get(&**key.get_ref())?))
            }
            (DeValue::Array(list), serde_json::Value::Array(known)) => {
                if list.len() > known.len() {
                    let message = format!("{} values where {} belong", list.len(), known.len());
                    return Some((value.span(), message));
                }
                list.iter().zip(known).find_map(|(v, known)| unread(v, known))
            }
            _ => None,
        }
    }
    let root = DeTable::parse(text).ok()?;
    let serde_json::Value::Object(known) = understood else { return None };
    root.get_ref().iter().find_map(|(key, v)| unread(v, known.get(&**key.get_ref())?))
}

/// A table of a scene file as it is written, such as `[run]`, and its keys.
pub(super) struct TableKeys {
    pub(super) table: &'static str,
    pub(super) keys: Vec<String>,
}

/// Returns what to say of a key that does not exist where the `known` ones do: what to write there, the tables that it belongs to, the
/// nearest of the known, or all of these.
fn key_advice(word: &str, known: &[&str], tables: &[TableKeys]) -> String {
    let meant = ELSEWHERE.iter().find(|(start, beside, _)| word.starts_with(start) && known.contains(beside));
    if let Some((_, _, help)) = meant {
        return (*help).to_owned();
    }
    let has_word = |table: &&TableKeys| table.keys.iter().any(|key| key == word);
    let owners: Vec<&str> = tables.iter().filter(has_word).map(|table| table.table).collect();
    match &owners[..] {
        [] => text::did_you_mean(word, known.iter().copied())
            .unwrap_or_else(|| format!("known here: {}", known.join(", "))),
        [owner] => format!("`{word}` is a key of {owner}"),
        [first @ .., last] => format!("`{word}` is a key of {} and {last}", first.join(", ")),
    }
}

/// Makes the scene's error of one of the TOML reader, with its place, and the key that was probably meant; `tables` are those of a scene.
pub(super) fn syntax_error(e: &toml::de::Error, file: &str, text: &Arc<str>, tables: &[TableKeys]) -> Error {
    let message = e.message();
    let mut words = message.split('`').skip(1).step_by(2);
    // The reader's errors are texts: known keys stand in backquotes, the unknown one first.
    let error = if message.starts_with("unknown field") {
        let word = words.next().unwrap_or("");
        // A key of another program for an effect that is not simulated must not be taken for a slip.
        if let Some(effect) = unsupported_effect(word) {
            let message = format!("`{word}`: {effect} is not simulated");
            Error::new(ErrorKind::Unsupported, message)
                .help("remove the key; the result would be wrong if it were ignored")
        } else {
            let known: Vec<&str> = words.collect();
            let error = Error::new(ErrorKind::Syntax, format!("unknown key `{word}`"));
            error.help(key_advice(word, &known, tables))
        }
    } else if message.starts_with("unknown variant") {
        let word = words.next().unwrap_or("");
        let known: Vec<&str> = words.collect();
        if let Some(effect) = unsupported_effect(word) {
            Error::new(ErrorKind::Unsupported, format!("`{word}`: {effect} is not simulated"))
        } else {
            let error = Error::new(ErrorKind::Syntax, format!("`{word}` is none of {}", known.join(", ")));
            match text::did_you_mean(word, known.iter().copied()) {
                Some(advice) => error.help(advice),
                None => error,
            }
        }
    } else {
        type_error(message, e.span().map_or("", |span| key_before(text, span.start)))
    };
    // `[0, 0, 25,000]`: what follows the comma is taken for a value of its own.
    let is_behind_comma =
        |at: usize| text.get(..at).is_some_and(|before| before.trim_end_matches('0').ends_with(','));
    let error = if message.contains("leading zero") && e.span().is_some_and(|span| is_behind_comma(span.start)) {
        error.help("a comma parts two values: write thousands as 25000 or 25_000")
    } else {
        error
    };
    error.located(file, text, e.span())
}

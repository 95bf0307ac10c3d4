//! The JSON Schema of a scene as a page for people: every table, every key, what it means and its default.

use serde_json::{Map, Value};

/// Begins the page.
const OPENING: &str = "# Scene files\n\n\
    A scene is a TOML file: what is traced, what it is made of, where light comes from and where it is counted. `lampyris init FILE.stp` \
    writes one to begin with. Lengths are mm, angles degrees, powers those of `unit`. Paths are relative to the scene file. \
    `lampyris schema --text` prints this page, `lampyris schema` the JSON Schema for editors.\n";

/// Returns the definition that a property refers to, as itself, as one of several forms or as the items of a list; `None` for a plain
/// value.
fn definition<'s>(schema: &'s Value, property: &Value) -> Option<&'s Value> {
    let forms = property["anyOf"].as_array().into_iter().flatten();
    let of = |p: &Value| p["$ref"].as_str().map(str::to_owned);
    let reference = of(property).or_else(|| of(&property["items"])).or_else(|| forms.into_iter().find_map(of))?;
    schema["$defs"].get(reference.rsplit('/').next()?)
}

/// Returns the keys of a definition that is a table; `None` for any other.
fn table_keys(definition: &Value) -> Option<&Map<String, Value>> {
    definition["properties"].as_object().filter(|keys| !keys.is_empty())
}

/// Returns the words that a definition allows, each with its meaning; empty if it is no choice of words.
fn allowed_words(definition: &Value) -> Vec<String> {
    let forms = definition["oneOf"].as_array().into_iter().flatten();
    forms
        .filter_map(|w| Some(format!("`{}`: {}", w["const"].as_str()?, description_text(w).trim_end_matches('.'))))
        .collect()
}

/// Returns what the schema says of something, on one line; empty where it says nothing.
fn description_text(value: &Value) -> String {
    value["description"].as_str().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Returns what follows the meaning of a key: the words that it may be, or the key at the top of the page that has the same words.
fn word_list(schema: &Value, property: &Value) -> String {
    let Some(choice) = definition(schema, property) else { return String::new() };
    let allowed = allowed_words(choice);
    if allowed.is_empty() {
        return String::new();
    }
    let mut top = table_keys(schema).into_iter().flatten();
    match top.find(|(_, known)| definition(schema, known) == Some(choice)) {
        Some((key, known)) if known != property => format!(" The words are those of `{key}` at the top."),
        _ => format!(" {}.", allowed.join("; ")),
    }
}

/// Returns the row of a key: what it means, the words that it may be, and its default.
fn key_row(schema: &Value, key: &str, property: &Value) -> String {
    let allowed = word_list(schema, property);
    let default = match &property["default"] {
        Value::Null => String::new(),
        Value::String(s) if s.is_empty() => String::new(),
        Value::Array(list) if list.is_empty() => String::new(),
        Value::Object(_) => String::new(),
        // Numbers are of double precision there, and some are whole.
        other => {
            format!("`{other}`").replace(".0`", "`").replace(".0,", ",").replace(".0]", "]").replace(',', ", ")
        }
    };
    format!("| `{key}` | {}{allowed} | {default} |\n", description_text(property)).replace("  ", " ")
}

/// Returns the keys as a table of Markdown.
fn key_table<'s>(schema: &'s Value, keys: impl Iterator<Item = (&'s String, &'s Value)>) -> String {
    let rows: String = keys.map(|(key, property)| key_row(schema, key, property)).collect();
    format!("\n| key | what it says | default |\n| --- | --- | --- |\n{rows}")
}

/// Returns the page about a scene's schema, as Markdown.
pub(crate) fn schema_page(schema: &Value) -> String {
    let Some(top) = table_keys(schema) else { return OPENING.to_owned() };
    let is_table = |property: &Value| definition(schema, property).and_then(table_keys).is_some();
    let mut page = OPENING.to_owned();
    page += "\n## At the top\n";
    page += &key_table(schema, top.iter().filter(|(_, p)| !is_table(p)));
    let mut inner: Vec<(String, &Value)> = Vec::new();
    for (key, property) in top.iter().filter(|(_, p)| is_table(p)) {
        let heading = if property["type"] == "array" { format!("[[{key}]]") } else { format!("[{key}]") };
        let Some(table) = definition(schema, property) else { continue };
        page += &table_section(schema, &heading, table);
        // A list of tables is explained where a single one is.
        for (key, property) in table_keys(table).into_iter().flatten().filter(|(_, p)| p["type"] != "array") {
            let found = definition(schema, property).filter(|d| table_keys(d).is_some());
            // A table that several others hold is explained once.
            if let Some(found) = found.filter(|d| inner.iter().all(|(_, known)| known != d)) {
                inner.push((format!("{key} = {{ … }}"), found));
            }
        }
    }
    inner.iter().for_each(|(heading, table)| page += &table_section(schema, heading, table));
    page
}

/// Returns the key whose value is a table of keys that `table` has too, as `on` has the selectors of a rule, and these keys.
fn repeated_keys<'s>(
    schema: &'s Value,
    table: &'s Map<String, Value>,
) -> Option<(&'s str, &'s Map<String, Value>)> {
    table.iter().find_map(|(key, property)| {
        let inner = definition(schema, property).and_then(table_keys)?;
        let is_repeated = inner.iter().all(|(name, meaning)| table.get(name) == Some(meaning));
        is_repeated.then_some((key.as_str(), inner))
    })
}

/// Returns a section about one table of the file; keys that a table in it has too are explained in the section of that one.
fn table_section(schema: &Value, heading: &str, definition: &Value) -> String {
    let mut page = format!("\n## `{heading}`\n\n{}\n", description_text(definition));
    let Some(table) = table_keys(definition) else { return page };
    let repeated = repeated_keys(schema, table);
    if let Some((key, inner)) = repeated {
        let names: Vec<String> = inner.keys().map(|name| format!("`{name}`")).collect();
        page += &format!(
            "\nKeys of `{key} = {{ … }}` below may stand in it directly: {}. The others:\n",
            names.join(", ")
        );
    }
    let is_explained = |key: &str| repeated.is_none_or(|(_, inner)| !inner.contains_key(key));
    page + &key_table(schema, table.iter().filter(|(key, _)| is_explained(key)))
}

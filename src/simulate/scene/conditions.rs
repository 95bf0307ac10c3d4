//! What the JSON Schema says of keys that go together, beside the types that it reads off the structs: what an editor can show before
//! the command does. Whatever it refuses the reader of scenes refuses too; not the other way round.

use super::MOST_RAYS;
use super::receiver::LENGTHS_MM;
use crate::model::SurfaceKind;
use crate::tessellate::LEAST_TOLERANCE_MM;
use serde_json::{Value, json};

/// Adds the conditions to the JSON Schema of a scene, in place.
pub(super) fn add_conditions(schema: &mut Value) {
    let needs = |keys: &[&str]| json!({"required": keys});
    // Asked to be there: a scene without `kind` has the default one, whose conditions stand under `never`.
    let of_kind = |kinds: &[&str], then: Value| json!({"if": {"properties": {"kind": {"enum": kinds}}, "required": ["kind"]}, "then": then});
    let never = |keys: &[&str]| json!({"not": {"anyOf": keys.iter().map(|k| needs(&[k])).collect::<Vec<_>>()}});
    let measured = ["ies", "eulumdat", "rays", "data_1"];
    let lumens = json!({"required": ["run"],
        "properties": {"run": {"required": ["unit"], "properties": {"unit": {"const": "lm"}}}}});
    let root = json!({
        "required": ["source"],
        "allOf": [{"if": lumens, "then": {"properties": {"receiver": {"items": never(&["channels"])}}}}],
    });
    let indices = ["index", "catalogue", "sellmeier", "cauchy", "schott", "index_table"];
    let receiver = json!({"required": ["name"], "allOf": [
        {"not": needs(&["channels", "bins_nm"])},
        // Without a kind a receiver is a plane.
        {"if": never(&["kind"]), "then": needs(&["size"])},
        of_kind(&["plane"], needs(&["size"])),
        of_kind(&["sphere", "disc"], needs(&["radius"])),
        of_kind(&["absorbed"], json!({"anyOf": [needs(&["part"]), needs(&["instance"]), needs(&["on"])]})),
        of_kind(&["plane", "far_field", "absorbed"], never(&["radius"])),
        of_kind(&["sphere", "disc", "far_field", "absorbed"], never(&["size"])),
    ]});
    let source = json!({"allOf": [
        of_kind(&["cone"], needs(&["half_angle_deg"])),
        of_kind(&["cosine"], needs(&["exponent"])),
        of_kind(&measured, needs(&["file"])),
        {"not": needs(&["radius", "size"])},
        // Without a kind a source is a point, which has none of these.
        {"if": never(&["kind"]), "then": never(&["half_angle_deg", "exponent", "file"])},
    ]});
    let spectrum = json!({"allOf": [
        of_kind(&["lines", "table"], needs(&["values"])),
        of_kind(&["black_body"], needs(&["kelvin"])),
        of_kind(&["d65", "white_led"], never(&["values", "kelvin"])),
    ]});
    let said: Vec<Value> = ["medium", "surface", "scatter"].iter().map(|k| needs(&[k])).collect();
    let material = json!({
        "anyOf": said,
        // Of a number alone: a table has shares in its rows.
        "properties": {"kind": kind_of_surface(), "reflectance": {"minimum": 0, "maximum": 1}},
    });
    merge(schema, &root);
    for (name, more) in [
        ("Medium", json!({"required": ["name"], "oneOf": indices.map(|k| needs(&[k]))})),
        ("Receiver", receiver),
        ("Source", source),
        ("SpectrumKey", spectrum),
        ("Material", material),
        ("FaceSelector", json!({"properties": {"kind": kind_of_surface()}})),
        (
            "Accuracy",
            json!({"properties": {
                "intersector": {"pattern": any_case_pattern(&["octree", "bvh2", "cwbvh", "exact"])},
                "normals": {"pattern": any_case_pattern(&["flat", "nearest", "bilinear", "cubic", "exact"])},
                "angle_deg": {"exclusiveMinimum": 0, "exclusiveMaximum": 90},
            }}),
        ),
    ] {
        // The schema's own definitions stand under the names of the structs.
        merge(&mut schema["$defs"][name], &more);
    }
    for (name, key, range) in open_ranges() {
        merge(&mut schema["$defs"][name]["properties"][key], &range);
    }
    for direction in ["direction", "normal"] {
        let owner = if direction == "normal" { "Receiver" } else { "Source" };
        schema["$defs"][owner]["properties"][direction]["not"] = json!({"const": [0, 0, 0]});
    }
}

/// Returns the ranges of numbers that have an open end, are written in several forms or stand in pairs, each with the struct and the key
/// that it belongs to.
fn open_ranges() -> [(&'static str, &'static str, Value); 13] {
    let positive = json!({"exclusiveMinimum": 0});
    let length = json!({"minimum": LENGTHS_MM.start(), "maximum": LENGTHS_MM.end()});
    let rays = json!({"minimum": 1, "maximum": MOST_RAYS});
    let least = json!({"minimum": LEAST_TOLERANCE_MM});
    [
        // Each bound is checked on the form that it fits.
        ("Accuracy", "tolerance_mm", json!({"minimum": LEAST_TOLERANCE_MM, "items": least})),
        ("Run", "rays", rays.clone()),
        ("Run", "max_length_mm", positive.clone()),
        ("Run", "power_floor", json!({"exclusiveMaximum": 1})),
        ("Medium", "absorption_per_mm", json!({"minimum": 0})),
        ("Medium", "anisotropy", json!({"exclusiveMinimum": -1, "exclusiveMaximum": 1})),
        ("ScatterKey", "sigma_deg", positive.clone()),
        ("Source", "rays", rays),
        ("Source", "radius", positive.clone()),
        ("Source", "size", json!({"items": positive})),
        ("Source", "half_angle_deg", positive.clone()),
        ("SpectrumKey", "kelvin", positive),
        ("Receiver", "size", json!({"items": length})),
    ]
}

/// Returns what a schema says of a kind of surface, or of each of a list: one of the words, or a pattern with a star.
fn kind_of_surface() -> Value {
    let pattern = format!("^({})$|[*]", SurfaceKind::ALL.map(SurfaceKind::word).join("|"));
    json!({"pattern": pattern, "items": {"pattern": pattern}})
}

/// Returns a regular expression for any of these words in any case.
fn any_case_pattern(words: &[&str]) -> String {
    let letter =
        |c: char| if c.is_ascii_alphabetic() { format!("[{c}{}]", c.to_ascii_uppercase()) } else { c.to_string() };
    let words: Vec<String> = words.iter().map(|w| w.chars().map(letter).collect()).collect();
    format!("^({})$", words.join("|"))
}

/// Puts the keys of one object into another, table by table; where one of them is no object, `more` takes its place.
fn merge(into: &mut Value, more: &Value) {
    match (into, more) {
        (Value::Object(into), Value::Object(more)) => {
            // What the structs say stays; conditions only come beside it.
            more.iter().for_each(|(k, v)| merge(into.entry(k.clone()).or_insert(Value::Null), v));
        }
        (into, more) => *into = more.clone(),
    }
}

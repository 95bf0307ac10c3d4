//! Every key of a document stands in `docs/results.md`.

use crate::files::fixture;
use crate::support::lampyris_in;
use lampyris::study;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// The words of all code in `docs/results.md`, in fences and between backticks.
fn documented_words() -> BTreeSet<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/results.md");
    let text = std::fs::read_to_string(path).unwrap();
    // Fences are three backticks, so that every other piece is code for them as well.
    let code = text.replace("```", "`");
    let code = code.split('`').skip(1).step_by(2);
    let words = code.flat_map(|piece| piece.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')));
    words.map(str::to_owned).collect()
}

/// Adds the keys of a document, wherever they stand in it.
fn add_keys(document: &Value, keys: &mut BTreeSet<String>) {
    match document {
        Value::Object(map) => {
            for (key, value) in map {
                keys.insert(key.clone());
                add_keys(value, keys);
            }
        }
        Value::Array(list) => list.iter().for_each(|value| add_keys(value, keys)),
        _ => {}
    }
}

/// The keys of a row of a study that has measured nothing.
fn keys_of(row: impl Serialize) -> BTreeSet<String> {
    let mut keys = BTreeSet::new();
    add_keys(&serde_json::to_value(row).unwrap(), &mut keys);
    keys
}

/// A lens with everything that a scene can ask for; `run` and `further` are keys of its run and its end.
fn scene(run: &str, further: &str) -> String {
    format!(
        "[run]\nrays = 20_000\nsequences = 3\nfaces = 3\n{run}\n[[model]]\nfile = 'model.stp'\n\
         [[medium]]\nname = 'glass'\nindex = 1.5\nabsorption_per_mm = 0.01\n[[material]]\npart = '*'\nmedium = 'glass'\n\
         [[source]]\nkind = 'cone'\nat = [0, 0, -50]\ndirection = [0, 0, 1]\nhalf_angle_deg = 8\n\
         spectrum = {{ kind = 'black_body', kelvin = 2856 }}\n\
         [[receiver]]\nname = 'road'\nkind = 'far_field'\nnormal = [0, 0, 1]\nh_deg = [-12, 12]\nv_deg = [-6, 6]\n\
         cells = [240, 120]\n{further}\n"
    )
}

#[test]
fn every_key_of_a_document_is_documented() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::copy(fixture("step/lens_planoconvex_nurbs.stp"), at.join("model.stp")).unwrap();
    let wall =
        "[[receiver]]\nname = 'wall'\nat = [0, 0, 100]\nsize = [100, 100]\nabsorbs = false\nchannels = 'xyz'";
    std::fs::write(at.join("colours.toml"), scene("", wall)).unwrap();
    std::fs::write(at.join("lamp.toml"), scene("unit = 'lm'", "[[regulation]]\nid = 'UN R112 B passing'")).unwrap();
    let mut keys = BTreeSet::new();
    let effects = fixture("scenes/s3_reflector.toml").display().to_string();
    for arguments in [
        "trace colours.toml -o chosen",
        "trace colours.toml -o made --tolerance 0.1 --verify-pruning",
        "trace colours.toml -o grown --tolerance 0.1 --until-error 10%@wall",
        "trace lamp.toml -o exact --accuracy 0.1",
        "trace colours.toml --shard 1/2 -o part.tally",
        "info model.stp",
        "info model.stp --faces",
        "check model.stp --rays 1000",
        "facet model.stp -o facets.obj --angle 1",
        "study effects --rays 2000 -o effects EFFECTS",
    ] {
        let arguments: Vec<&str> =
            arguments.split(' ').chain(["--json"]).map(|a| if a == "EFFECTS" { &effects } else { a }).collect();
        let (code, out, err) = lampyris_in(at, &arguments);
        assert!([0, 4].contains(&code), "{arguments:?}: {code} {err}");
        add_keys(&serde_json::from_str(&out).unwrap(), &mut keys);
    }
    keys.extend(keys_of(study::accuracy::Row::default()));
    keys.extend(keys_of(study::interpolation::Row::default()));
    keys.extend(keys_of(study::complexity::Row::default()));
    keys.extend(keys_of(study::receivers::Row::default()));
    let none = String::new();
    let slope =
        study::accuracy::Slope { normals: none, in_sag: 0.0, in_length: 0.0, theory_in_sag: None, points: 0 };
    keys.extend(keys_of(slope));
    let words = documented_words();
    let missing: Vec<&String> = keys.iter().filter(|key| !words.contains(*key)).collect();
    assert!(missing.is_empty(), "not in docs/results.md: {missing:?}");
}

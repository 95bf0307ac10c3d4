//! `info` and what bad STEP files get, with the real binary.

use crate::files::{fixture, part21};
use crate::support::lampyris;
use serde_json::Value;
use std::path::{Path, PathBuf};

fn step(name: &str) -> String {
    fixture("step").join(name).display().to_string()
}

fn written(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn info_tells_what_the_lamp_holds() {
    let (code, out, err) = lampyris(&["info", &step("lamp_multicavity.stp")]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("housing") && out.contains("0 refused") && out.contains("mm"), "{out}");
}

#[test]
fn info_json_is_one_document_with_the_agreed_keys() {
    let (code, out, _) = lampyris(&["info", "--json", &step("lamp_multicavity_inch.stp")]);
    assert_eq!(code, 0);
    let document: Value = serde_json::from_str(&out).unwrap();
    for key in [
        "file",
        "bytes",
        "schema",
        "units",
        "parts",
        "instances",
        "shells",
        "faces",
        "faces_placed",
        "by_surface",
        "bbox_mm",
        "refusals",
        "names",
        "seconds",
        "peak_bytes",
    ] {
        assert!(document.get(key).is_some(), "{key} is missing");
    }
    let size = std::fs::metadata(step("lamp_multicavity_inch.stp")).unwrap().len();
    assert_eq!(document["bytes"], size);
    assert_eq!(document["faces"]["refused"], 0);
    assert_eq!(document["faces"]["found"], document["faces"]["converted"]);
    // The model's own millimetres, whatever the unit of the file: as in the millimetre version.
    let (_, mm, _) = lampyris(&["info", "--json", &step("lamp_multicavity.stp")]);
    let mm: Value = serde_json::from_str(&mm).unwrap();
    for (a, b) in [(0, 0), (0, 2), (1, 1)] {
        let at = |d: &Value| d["bbox_mm"][a][b].as_f64().unwrap();
        assert!((at(&document) - at(&mm)).abs() < 1e-6, "{} {}", at(&document), at(&mm));
    }
}

#[test]
fn files_that_are_no_step_end_with_3_and_say_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let empty = written(f, "empty.stp", b"");
    let picture = written(f, "picture.stp", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    let text = written(f, "notes.stp", "ein Brief, kein Modell\n".as_bytes());
    for (path, says) in [
        (f.join("missing.stp"), "missing.stp"),
        (f.to_path_buf(), "cannot be read"),
        (empty, "the file is empty"),
        (picture, "not a STEP file"),
        (text, "ISO-10303-21"),
    ] {
        for command in [["info", "-q"], ["facet", "-v"], ["check", "-q"]] {
            let (code, out, err) = lampyris(&[command[0], command[1], &path.display().to_string()]);
            assert_eq!((code, out.as_str()), (3, ""), "{command:?} {}: {err}", path.display());
            assert!(err.contains(says), "{command:?} {}: {err}", path.display());
            assert!(!err.contains("panicked"), "{err}");
        }
    }
}

#[test]
fn a_truncated_file_is_read_as_far_as_it_goes_and_the_rest_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let whole = std::fs::read(step("lamp_multicavity.stp")).unwrap();
    for share in [0.1, 0.5, 0.9, 0.999] {
        let cut = written(folder.path(), "cut.stp", &whole[..(whole.len() as f64 * share) as usize]);
        let (code, out, err) = lampyris(&["info", "--json", &cut.display().to_string()]);
        assert!(!err.contains("panicked"), "{err}");
        // Whatever is left is accounted for, and the loss is never silent.
        let document: Value = serde_json::from_str(&out).unwrap();
        let count = |key: &str| document["faces"][key].as_u64().unwrap();
        assert_eq!(count("found"), count("converted") + count("refused"));
        let silent = document["problems"].as_array().is_none_or(Vec::is_empty) && count("refused") == 0;
        assert!(!silent, "{share}: code {code}, nothing was said about the missing end");
        assert_eq!(code, 4, "{share}");
    }
}

#[test]
fn a_number_used_twice_is_named_by_every_command_that_reads_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let whole = std::fs::read_to_string(step("lens_planoconvex_analytic.stp")).unwrap();
    let (data, end) = whole.split_at(whole.rfind("ENDSEC").unwrap());
    let count = |n: usize| "#10=CARTESIAN_POINT('',(0.,0.,0.));\n".repeat(n);
    let mut told = Vec::new();
    for n in [1, 5, 4] {
        let text = format!("{data}{}{end}", count(n));
        let file = written(folder.path(), "twice.stp", text.as_bytes()).display().to_string();
        told.push(["info", "facet", "check"].map(|command| {
            let (code, out, err) = lampyris(&[command, &file]);
            assert_eq!(code, 0, "{command}: {err}");
            out + &err
        }));
    }
    for text in &told[0] {
        assert_eq!(text.matches("#10: its number stands for an earlier instance already").count(), 1, "{text}");
    }
    for text in &told[1][1..] {
        assert!(text.matches("its number").count() == 3 && text.contains("and 2 more problems"), "{text}");
    }
    assert!(told[2][1..].iter().all(|text| text.contains("and 1 more problem;")), "{:?}", told[2]);
}

#[test]
fn what_assemblies_place_has_a_limit_that_an_option_raises() {
    let lamp = step("lamp_multicavity.stp");
    for command in ["info", "facet", "check"] {
        let (code, _, err) = lampyris(&[command, &lamp, "--max-placed", "2"]);
        assert!(code == 3 && err.contains("beyond 2") && err.contains("--max-placed"), "{command}: {code} {err}");
    }
    assert_eq!(lampyris(&["info", &lamp, "--max-placed", "1000"]).0, 0);
}

#[test]
fn a_scene_says_how_much_the_assemblies_of_its_models_may_place() {
    let folder = tempfile::tempdir().unwrap();
    let run = |limit: u32| {
        let scene = format!(
            "[[model]]\nfile = {:?}\nmax_placed = {limit}\n[[source]]\nkind = \"lambertian\"\nat = [-95, 0, 17.69]\n\
             [[receiver]]\nname = \"far\"\nkind = \"far_field\"\n",
            step("lamp_multicavity.stp")
        );
        let path = written(folder.path(), "scene.toml", scene.as_bytes());
        lampyris(&["trace", &path.display().to_string(), "--dry-run"])
    };
    let (code, _, err) = run(2);
    assert!(code == 3 && err.contains("beyond 2") && err.contains("max_placed"), "{code} {err}");
    let (code, _, err) = run(1000);
    assert_eq!(code, 0, "{err}");
}

#[test]
fn the_schema_of_a_scene_is_a_json_schema() {
    let (code, out, _) = lampyris(&["schema"]);
    let schema: Value = serde_json::from_str(&out).unwrap();
    assert!(code == 0 && schema["$schema"].as_str().unwrap().contains("json-schema.org"));
    assert!(schema["properties"]["receiver"].is_object() && schema["properties"]["source"].is_object());
}

/// The page in docs is what `lampyris schema --text > docs/scene.md` writes.
#[test]
fn the_page_of_scenes_is_that_of_the_program() {
    let (code, out, _) = lampyris(&["schema", "--text"]);
    assert!(code == 0 && out == include_str!("../../docs/scene.md"), "{out}");
    for words in ["## `[[receiver]]`", "## `on = { … }`", "| `sequences` |", "`far_field`: All light"] {
        assert!(out.contains(words), "{words}");
    }
}

/// A file of which nothing can be traced says what it holds instead, and is not a success.
#[test]
fn info_on_a_file_without_shapes_names_what_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let points = "#1=CARTESIAN_POINT('',(0.,0.,0.));#2=MY_SHAPE(#1);#3=MY_SHAPE(#1);";
    let face = "#1=CARTESIAN_POINT('',(0.,0.,0.));#2=ADVANCED_FACE('',(),#1,.T.);";
    for (data, said) in [
        (points, "points.stp: no face, surface or mesh was found; commonest are MY_SHAPE (2), CARTESIAN_POINT (1)"),
        (face, "points.stp: the file has faces (1), but no representation of a shape leads to one; commonest are"),
    ] {
        let path = written(folder.path(), "points.stp", part21(data).as_bytes());
        let (code, out, _) = lampyris(&["info", path.to_str().unwrap()]);
        assert!(code == 4 && out.contains(said), "{out}");
    }
}

/// Parts that lost all of their faces are not listed, and the places of those that are stand beside them: of a file without any face the
/// list is empty, and with two parts of which the first is lost it is that of the second.
#[test]
fn faces_are_listed_with_the_places_of_their_own_part() {
    let folder = tempfile::tempdir().unwrap();
    let lens = std::fs::read_to_string(step("lens_planoconvex_nurbs.stp")).unwrap();
    let broken = lens.replace("-2.094395102393,0.,2.094395102393", "2.094395102393,0.,-2.094395102393");
    let listed = |name: &str, text: &str| {
        let path = written(folder.path(), name, text.as_bytes()).display().to_string();
        let (code, out, err) = lampyris(&["info", &path, "--faces", "--json"]);
        assert_eq!(code, 4, "{err}");
        serde_json::from_str::<Value>(&out).unwrap()["parts"].clone()
    };
    assert_eq!(listed("none.stp", &broken), serde_json::json!([]));
    // A part in front whose one shell names no face that exists.
    let lost = "#9001 = SHAPE_DEFINITION_REPRESENTATION(#9002,#9006);\n#9002 = PRODUCT_DEFINITION_SHAPE('','',#9003);\n\
        #9003 = PRODUCT_DEFINITION('','',#9004,#9);\n#9004 = PRODUCT_DEFINITION_FORMATION('','',#9005);\n\
        #9005 = PRODUCT('lost','lost','',(#8));\n#9006 = ADVANCED_BREP_SHAPE_REPRESENTATION('',(#11,#9007),#185);\n\
        #9007 = MANIFOLD_SOLID_BREP('',#9008);\n#9008 = CLOSED_SHELL('',(#9009));\n#9009 = ADVANCED_FACE('',(#9010),#34,.T.);\n";
    let parts = listed("second.stp", &lens.replacen("#1 = ", &format!("{lost}#1 = "), 1));
    let [part] = &parts.as_array().unwrap()[..] else { panic!("{parts}") };
    assert_eq!(
        (&part["name"], &part["places"]),
        (&"Open CASCADE STEP translator 7.8 2".into(), &serde_json::json!(["Open CASCADE STEP translator 7.8 2"]))
    );
}

/// Why faces are missing from the list is stated beside it, with -q too, and in the document as `info` has it without the list.
#[test]
fn faces_that_were_refused_are_told_beside_the_list() {
    let folder = tempfile::tempdir().unwrap();
    let lens = std::fs::read_to_string(step("lens_planoconvex_nurbs.stp")).unwrap();
    let broken = lens.replace("-2.094395102393,0.,2.094395102393", "2.094395102393,0.,-2.094395102393");
    for (text, is_broken) in [(&broken, true), (&lens, false)] {
        let path = written(folder.path(), "lens.stp", text.as_bytes()).display().to_string();
        let path = path.as_str();
        let documents = [&["info", path, "--json"][..], &["info", path, "--json", "--faces"][..]]
            .map(|arguments| serde_json::from_str::<Value>(&lampyris(arguments).1).unwrap());
        for key in ["refusals", "problems"] {
            assert!(documents[1][key].is_array() && documents[0][key] == documents[1][key], "{key}: {documents:?}");
        }
        for option in ["-v", "-q"] {
            let (code, _, err) = lampyris(&["info", path, "--faces", option]);
            assert_eq!(
                (code, err.contains("faces were refused")),
                (if is_broken { 4 } else { 0 }, is_broken),
                "{err}"
            );
            let refusals = documents[0]["refusals"].as_array().unwrap();
            assert_eq!(refusals.is_empty(), !is_broken);
            assert!(refusals.iter().all(|r| err.contains(r["reason"].as_str().unwrap())), "{err}");
        }
    }
}

/// Cut between two records, where nothing else shows it: what is missing is not known, so that the whole is not there either.
#[test]
fn a_file_that_was_cut_off_is_told_and_incomplete() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(step("lamp_multicavity.stp")).unwrap();
    let half = text[..text.len() / 2].rfind(";\n").unwrap() + 2;
    for (cut, limit, expected) in [(half, "0.1", 4), (half, "1", 0), (text.len(), "0", 0)] {
        let path = written(folder.path(), "cut.stp", &text.as_bytes()[..cut]).display().to_string();
        for command in ["info", "facet"] {
            let (code, out, err) = lampyris(&[command, &path, "--max-refused", limit]);
            assert_eq!(code, expected, "{command} {cut}: {out}{err}");
            assert_eq!((out + &err).contains("END-ISO-10303-21"), cut == half, "{command} {cut}");
        }
    }
}

/// A scene in the place of its model.
#[test]
fn a_scene_is_refused_as_one_where_a_step_file_is_needed() {
    let scene = fixture("scenes/s1_lens.toml").display().to_string();
    for command in ["info", "facet", "init"] {
        let (code, _, err) = lampyris(&[command, &scene]);
        assert!(code == 3 && err.contains("a scene, where a STEP file is needed"), "{command}: {code} {err}");
    }
}

#[test]
fn lengths_without_a_unit_are_said_to_be_taken_as_mm() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(step("lamp_multicavity_inch.stp")).unwrap();
    let without = text.replace("GLOBAL_UNIT_ASSIGNED_CONTEXT", "GLOBAL_UNIT_FORGOTTEN");
    for (text, is_said) in [(&without, true), (&text, false)] {
        let path = written(folder.path(), "unit.stp", text.as_bytes()).display().to_string();
        let (_, out, err) = lampyris(&["info", &path]);
        assert_eq!((out + &err).contains("taken to be in mm"), is_said);
    }
}

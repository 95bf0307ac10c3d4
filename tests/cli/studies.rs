//! Studies with the real binary: the table on the terminal, one row for each effect.

use crate::files::fixture;
use crate::support::lampyris;
use serde_json::Value;

#[test]
fn every_effect_that_a_scene_does_not_call_for_is_priced_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().display().to_string();
    let text = std::fs::read_to_string(fixture("scenes/s3_reflector.toml")).unwrap();
    let model = format!("{}/", fixture("step").display());
    let scene = folder.path().join("scene.toml").display().to_string();
    std::fs::write(&scene, text.replace("../step/", &model).replace("[run]", "[run]\nseed = 7")).unwrap();
    let (code, out, err) = lampyris(&["study", "effects", "--rays", "3000", "--json", "-o", &path, &scene]);
    assert_eq!(code, 0, "{err}");
    let document: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(document["seed"], 7, "that of the scene");
    let rows = document["rows"].as_array().unwrap();
    // S3 is mirrors and black faces: eight of the nine effects are not called for.
    assert_eq!((rows.len(), &rows[0]["choice"], &rows[9]["choice"]), (10, &"pruned".into(), &"full".into()));
    assert_eq!(rows[0]["effects"], serde_json::json!(["reflection"]));
    assert_eq!(rows[9]["effects"].as_array().unwrap().len(), 9);
    assert_eq!((&rows[0]["kernel"], &rows[9]["kernel"]), (&"mirror".into(), &"full".into()));
    let added: Vec<&str> = rows[1..9].iter().map(|r| r["added"].as_str().unwrap()).collect();
    assert!(added.contains(&"polarisation") && added.contains(&"bulk_scatter") && !added.contains(&"reflection"));
    for row in rows {
        assert_eq!(row["identical"], true, "{row}");
        assert!(row["seconds_trace_median"].as_f64().unwrap() > 0.0, "{row}");
    }
}

#[test]
fn the_terminal_shows_the_table_and_the_folder_holds_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().display().to_string();
    let scene = fixture("scenes/s3_reflector.toml").display().to_string();
    let (code, out, err) = lampyris(&["study", "effects", "--rays", "3000", "-o", &path, &scene]);
    assert!(code == 0 && !err.contains("polarisation"), "{err}");
    let words = |start: &str| {
        let line =
            out.lines().find(|l| l.trim_start().starts_with(start)).unwrap_or_else(|| panic!("{start}: {out}"));
        line.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    assert!(words("as called for: reflection").contains(&"mirror".into()));
    assert!(words("+ polarisation").ends_with(&["yes".into()]));
    let csv = std::fs::read_to_string(folder.path().join("tables/effects.csv")).unwrap();
    assert_eq!(csv.lines().count(), 11, "{csv}");
}

/// A study that would not look at a file refuses it, whether it is there or not.
#[test]
fn a_file_that_a_study_does_not_use_is_refused() {
    for study in ["complexity", "stability"] {
        let (code, _, err) = lampyris(&["study", study, "no-such-file.stp"]);
        assert!(code == 2 && err.contains("does not take no-such-file.stp"), "{code} {err}");
    }
}

/// A study of what is left of a damaged file says so, and is incomplete.
#[test]
fn what_was_not_read_of_a_model_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(fixture("step/lens_planoconvex_nurbs.stp")).unwrap();
    let cut = folder.path().join("cut.stp").display().to_string();
    std::fs::write(&cut, &text[..text.rfind("ENDSEC").unwrap()]).unwrap();
    let results = folder.path().join("out").display().to_string();
    for study in [&["study", "interpolation", "--rays", "1000"][..], &["study", "bvh", "--rays", "100"]] {
        let (code, _, err) = lampyris(&[study, &["--no-report", "-o", &results, &cut]].concat());
        assert!(code == 4 && err.contains("ends before its end section"), "{code} {err}");
        assert!(folder.path().join("out/study.json").is_file(), "{err}");
    }
}

//! What somebody with a STEP file and no scene does first.

use crate::files::{fixture, part21};
use crate::support::{lampyris, lampyris_in};
use serde_json::Value;
use std::fs;

#[test]
fn a_scene_is_made_for_a_file_and_can_be_traced_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::copy(fixture("step/lens_planoconvex_nurbs.stp"), path.join("my lens.stp")).unwrap();
    let (code, _, err) = lampyris_in(path, &["init", "my lens.stp"]);
    assert!(code == 0 && err.contains("my lens.toml"), "{err}");
    let text = fs::read_to_string(path.join("my lens.toml")).unwrap();
    assert!(
        text.contains("file = \"my lens.stp\"") && text.contains("# A face that no rule names absorbs"),
        "{text}"
    );
    let arguments = ["trace", "my lens.toml", "--rays", "2000", "-o", "out", "--json", "--no-report"];
    let (code, out, err) = lampyris_in(path, &arguments);
    assert_eq!(code, 0, "{err}");
    let found: Value = serde_json::from_str(&out).unwrap();
    // The lens, of radius 20, absorbs its share of a beam that is 1.05 times as wide as the corner of its box is far.
    let share = 1.0 / (1.05f64.powi(2) * 2.0);
    let [absorbed, received] = ["absorbed", "received"].map(|key| found["power"][key].as_f64().unwrap());
    assert!((absorbed - share).abs() < 0.05 && (received - (1.0 - share)).abs() < 0.05, "{absorbed}, not {share}");
    assert!(path.join("out/results.json").is_file() && !path.join("out/report.html").exists());
    // Never over a file that is there; into folders that are not.
    assert_eq!(lampyris_in(path, &["init", "my lens.stp"]).0, 2);
    assert_eq!(lampyris_in(path, &["init", "my lens.stp", "-o", "a/b/s.toml"]).0, 0);
    // Nor under a name that `trace` would take for a STEP file.
    let (code, _, err) = lampyris_in(path, &["init", "my lens.stp", "-o", "other.stp"]);
    assert!(code == 2 && err.contains("-o other.toml") && !path.join("other.stp").exists(), "{err}");
    // A folder is no name.
    for (given, named) in [(".", "-o './my lens.toml'"), ("a/b", "-o 'a/b/my lens.toml'")] {
        let (code, _, err) = lampyris_in(path, &["init", "my lens.stp", "-o", given]);
        assert!(code == 2 && err.contains(named), "{code} {err}");
    }
    assert_eq!(lampyris_in(path, &["trace", "a/b/s.toml", "--dry-run"]).0, 0);
}

/// A damaged file gets a scene of what is left of it, and the user learns what is missing.
#[test]
fn a_scene_for_a_damaged_file_tells_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let model = fs::read_to_string(fixture("step/lens_planoconvex_nurbs.stp")).unwrap();
    // The first face bounds a surface that is not there.
    let at = model.find("ADVANCED_FACE(").unwrap();
    let end = at + model[at..].find(");").unwrap();
    let surface = at + model[at..end].rfind('#').unwrap();
    let rest = surface + model[surface..].find(',').unwrap();
    fs::write(path.join("torn.stp"), format!("{}#999999{}", &model[..surface], &model[rest..])).unwrap();
    let (code, _, err) = lampyris_in(path, &["init", "torn.stp"]);
    assert!(code == 4 && err.contains("wrote torn.toml") && err.contains("of 3 faces was refused"), "{code} {err}");
    let (code, _, err) = lampyris_in(path, &["init", "torn.stp", "-o", "b.toml", "--max-refused", "1"]);
    assert!(code == 0 && err.contains("of 3 faces was refused"), "{code} {err}");
    // The limit that the file needs goes into its scene.
    let limit = ["init", "torn.stp", "-o", "c.toml", "--max-refused", "1", "--max-placed", "7"];
    assert_eq!(lampyris_in(path, &limit).0, 0);
    assert!(fs::read_to_string(path.join("c.toml")).unwrap().contains("{ file = \"torn.stp\", max_placed = 7 }"));
    let (code, _, err) = lampyris_in(path, &["init", "torn.stp", "-o", "d.toml", "--max-placed", "0"]);
    assert!(code == 3 && err.contains("--max-placed"), "{code} {err}");
}

/// The scene that the README shows runs as it stands there, beside a file of the name that it gives.
#[test]
fn the_scene_of_the_readme_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let readme = include_str!("../../README.md");
    let scene = readme.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    assert!(scene.lines().count() <= 15, "a newcomer reads this in a minute:\n{scene}");
    fs::write(path.join("scene.toml"), scene).unwrap();
    fs::copy(fixture("step/lamp_multicavity.stp"), path.join("lamp.stp")).unwrap();
    let arguments = ["trace", "scene.toml", "--rays", "20000", "-o", "out", "--json", "--no-report"];
    let (code, out, err) = lampyris_in(path, &arguments);
    assert_eq!(code, 0, "{err}");
    let found: Value = serde_json::from_str(&out).unwrap();
    // No light starts towards the wall: what arrives has met the mirror once at least.
    let [emitted, received] = ["emitted", "received"].map(|key| found["power"][key].as_f64().unwrap());
    assert!(emitted == 1.0 && received > 0.5 && received < 0.95, "{received} of {emitted}");
}

#[test]
fn media_and_licences_are_listed() {
    let (code, out, _) = lampyris(&["media", "--json"]);
    let found: Value = serde_json::from_str(&out).unwrap();
    let media = found["media"].as_array().unwrap();
    let glass = media.iter().find(|m| m["name"] == "N-BK7").unwrap();
    // Schott's data sheet: n_d = 1.51680.
    assert!(code == 0 && (glass["index"].as_f64().unwrap() - 1.51680).abs() < 5e-6, "{glass}");
    let (code, out, _) = lampyris(&["licences"]);
    assert!(code == 0 && out.contains("UBUNTU FONT LICENCE") && out.contains("Plotly"), "{out}");
    let (code, out, _) = lampyris(&["licences", "--json"]);
    let found: Value = serde_json::from_str(&out).unwrap();
    assert!(code == 0 && found["licence"].is_string() && found["version"] == env!("CARGO_PKG_VERSION"), "{found}");
}

/// The faces of a plano-convex lens: a cap of a sphere, a plane and a rim, with figures in closed form.
#[test]
fn the_faces_of_a_file_are_listed_with_what_selects_them() {
    let file = fixture("step/lens_planoconvex_analytic.stp").display().to_string();
    let (code, out, err) = lampyris(&["info", &file, "--faces", "--json"]);
    assert_eq!(code, 0, "{err}");
    let found: Value = serde_json::from_str(&out).unwrap();
    let solid = &found["parts"][0]["solids"][0];
    assert_eq!(solid["closed"], true);
    let faces = solid["faces"].as_array().unwrap();
    let sphere = faces.iter().find(|f| f["kind"] == "sphere").unwrap();
    let plane = faces.iter().find(|f| f["kind"] == "plane").unwrap();
    let radius = sphere["radius_mm"].as_f64().unwrap();
    // A disc of radius a carries the cap of a sphere of radius r whose area is 2πr(r − √(r² − a²)).
    let disc = plane["area_mm2"].as_f64().unwrap();
    let a2 = disc / std::f64::consts::PI;
    let cap = 2.0 * std::f64::consts::PI * radius * (radius - (radius * radius - a2).sqrt());
    let area = sphere["area_mm2"].as_f64().unwrap();
    assert!((area / cap - 1.0).abs() < 1e-4, "{area} {cap}");
    for face in faces {
        assert!(face["id"].as_u64().is_some() && face["at"].as_array().unwrap().len() == 3, "{face}");
    }
    let (code, out, _) = lampyris(&["info", &file, "--faces"]);
    assert!(code == 0 && out.contains("solid 0") && out.contains("sphere r "), "{out}");
}

/// What selects a face is printed beside it, and stands in a rule as it is; a dry run shows which faces that rule decides.
#[test]
fn selectors_are_pasted_and_shown_with_their_faces() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::copy(fixture("step/lens_planoconvex_analytic.stp"), path.join("lens.stp")).unwrap();
    let (_, out, _) = lampyris_in(path, &["info", "lens.stp", "--faces", "--json"]);
    let found: Value = serde_json::from_str(&out).unwrap();
    let faces = found["parts"][0]["solids"][0]["faces"].as_array().unwrap();
    let selector = faces.iter().find(|f| f["kind"] == "sphere").unwrap()["select"].as_str().unwrap();
    let (_, out, _) = lampyris_in(path, &["info", "lens.stp", "--faces"]);
    assert!(out.contains(selector), "{out}");
    let scene = format!(
        "[run]\nrays = 2000\n[[model]]\nfile = 'lens.stp'\n[[material]]\n{selector}\nsurface = 'mirror'\n\
         [[material]]\nkind = 'plane'\nsurface = 'diffuse'\n[[source]]\nkind = 'point'\nat = [0, 0, -50]\n"
    );
    fs::write(path.join("s.toml"), scene).unwrap();
    let (code, out, err) = lampyris_in(path, &["trace", "s.toml", "--dry-run", "--json"]);
    assert_eq!(code, 0, "{err}");
    let found: Value = serde_json::from_str(&out).unwrap();
    let rules = found["rules"].as_array().unwrap();
    assert_eq!((&rules[0]["faces"], rules[0]["first"][0].as_str()), (&Value::from(1), Some(selector)));
    assert_eq!(rules[1]["gives"], "surface diffuse");
    let unnamed = rules.last().unwrap();
    assert!(unnamed["rule"].is_null() && unnamed["gives"].as_str().unwrap().contains("absorber"), "{unnamed}");
    let (_, out, _) = lampyris_in(path, &["trace", "s.toml", "--dry-run", "--threads", "1"]);
    assert!(out.contains(" on 1 thread "), "{out}");
    assert!(out.contains("Rules and their faces") && out.contains("no rule names them"), "{out}");
    // The report has the table, and the selector of every face for its 3-D view.
    let (code, _, err) = lampyris_in(path, &["trace", "s.toml", "-o", "out"]);
    assert_eq!(code, 0, "{err}");
    let page = fs::read_to_string(path.join("out/report.html")).unwrap();
    let escaped = serde_json::to_string(selector).unwrap();
    assert!(page.contains("Rules and their faces") && page.contains(escaped.trim_matches('"')), "{escaped}");
}

/// Folders of outputs are made where they are missing, whatever is written into them.
#[test]
fn folders_of_outputs_are_made() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::copy(fixture("step/lens_planoconvex_nurbs.stp"), path.join("a.stp")).unwrap();
    for arguments in [
        &["facet", "a.stp", "-o", "one/two/a.stl"][..],
        &["check", "a.stp", "--rays", "300", "--rays-out", "three/all.rays", "--disagreements", "four/odd.rays"],
    ] {
        let (code, _, err) = lampyris_in(path, arguments);
        assert_eq!(code, 0, "{err}");
    }
    assert!(["one/two/a.stl", "three/all.rays", "four/odd.rays"].iter().all(|file| path.join(file).is_file()));
}

/// The notes of a run are printed once on the terminal, those of merged parts too, not in the report alone.
#[test]
fn what_a_run_finds_is_told_on_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scene = "[run]\nrays = 10_000\n[[source]]\npower = 1000\n[[source]]\nname = 'pilot lamp'\nat = [0, 0, 9]\npower = 0.001\n\
                 [[receiver]]\nname = 'all'\nkind = 'far_field'\n";
    fs::write(path.join("scene.toml"), scene).unwrap();
    let told = "the source 'pilot lamp' sends 1 of the";
    let (code, _, err) = lampyris_in(path, &["trace", "scene.toml", "-o", "out", "--no-report"]);
    assert!(code == 0 && err.matches(told).count() == 1, "{code} {err}");
    let (code, _, err) = lampyris_in(path, &["trace", "scene.toml", "-o", "all.tally", "--shard", "1/1"]);
    assert_eq!(code, 0, "{err}");
    let (code, _, err) = lampyris_in(path, &["merge", "all.tally", "-o", "merged", "--no-report"]);
    assert!(code == 0 && err.matches(told).count() == 1, "{code} {err}");
}

/// Darkness is no answer for a lamp whose file holds none of it.
#[test]
fn a_file_without_a_face_is_not_traced_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("points.stp"), part21("#1=CARTESIAN_POINT('',(0.,0.,0.));")).unwrap();
    fs::write(
        path.join("scene.toml"),
        "model = [{ file = 'points.stp' }]\n[[source]]\n[[receiver]]\nname = 'all'\nkind = 'far_field'\n",
    )
    .unwrap();
    let (code, out, err) =
        lampyris_in(path, &["trace", "scene.toml", "-q", "--rays", "2000", "--no-report", "-o", "out"]);
    assert!(code == 4 && out.is_empty() && err.contains("points.stp"), "{code} {out} {err}");
    let (code, out, err) = lampyris_in(path, &["trace", "scene.toml", "-q", "--dry-run"]);
    assert!(code == 4 && out.contains("would trace") && err.contains("it holds no face"), "{code} {out} {err}");
    let results = fs::read_to_string(path.join("out/results.json")).unwrap();
    // Nor is the mesh of a file that was cut off, its last words missing.
    let whole = fs::read_to_string(fixture("step/lens_planoconvex_nurbs.stp")).unwrap();
    fs::write(path.join("cut.stp"), &whole[..whole.rfind("ENDSEC").unwrap()]).unwrap();
    let (code, _, err) = lampyris_in(path, &["facet", "cut.stp", "-q"]);
    assert!(code == 4 && err.contains("ends before its end section"), "{code} {err}");
    let notes = serde_json::from_str::<Value>(&results).unwrap()["notes"].to_string();
    assert!(notes.contains("points.stp holds no face"), "{notes}");
}

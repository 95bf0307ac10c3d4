//! Scenes with mistakes, and what `facet`, `trace` and `check` do with good ones, with the real binary.

use crate::files::fixture;
use crate::support::lampyris_in;
use serde_json::Value;
use std::path::Path;

/// The mirror scene of the fixtures with one text replaced, in a folder of its own.
fn scene(from: &str, to: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(fixture("scenes/s3_reflector.toml")).unwrap();
    assert!(text.contains(from), "the fixture has no '{from}'");
    let model = fixture("step/reflector_freeform_trimmed.stp");
    let text =
        text.replacen(from, to, 1).replace("../step/reflector_freeform_trimmed.stp", &model.display().to_string());
    std::fs::write(folder.path().join("scene.toml"), text).unwrap();
    folder
}

/// What is in a folder beside the scene.
fn left_behind(folder: &Path) -> Vec<String> {
    let names = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned());
    names.filter(|n| n != "scene.toml").collect()
}

#[test]
fn a_value_of_the_wrong_form_is_answered_by_the_right_one() {
    let folder = tempfile::tempdir().unwrap();
    for (text, says) in [
        ("[[source]]\nkind = 'point'\nat = [0, 0, 25,000]\n", "25000 or 25_000"),
        ("[[receiver]]\nname = 'w'\nsize = [1, 1]\ncells = 100\n", "write cells = […, …]"),
        ("[[receiver]]\nname = 'w'\nsize = [1]\n", "write size = […, …]"),
        ("material = [{ at = [0, 0], surface = 'mirror' }]\n", "a point has three numbers"),
    ] {
        std::fs::write(folder.path().join("scene.toml"), text).unwrap();
        let (code, _, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out"]);
        assert!(code == 2 && err.contains(says), "{code} {err}");
    }
}

/// Without a model, or without a receiver, a run says what it lacks.
#[test]
fn a_run_says_what_the_scene_lacks() {
    let folder = tempfile::tempdir().unwrap();
    let trace = |text: &str| {
        std::fs::write(folder.path().join("scene.toml"), text).unwrap();
        let arguments = ["trace", "scene.toml", "-o", "out", "--rays", "1000", "--no-report"];
        let (code, _, err) = lampyris_in(folder.path(), &arguments);
        assert_eq!(code, 0, "{err}");
        err.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let err = trace("[[source]]\nkind = 'point'\n[[receiver]]\nname = 'far_wall'\nsize = [9, 9]\nat = [0, 0, 9]\n");
    assert!(err.contains("Nothing was met, because there is no model.") && !err.contains("facets of"), "{err}");
    // By the name that the scene gives it.
    assert!(err.contains("reach far_wall"), "{err}");
    assert!(trace("[[source]]\nkind = 'point'\n").contains("the scene has no receiver"));
}

/// An error target that was reached is reported once, in the answer.
#[test]
fn a_reached_error_is_part_of_the_answer() {
    let folder = tempfile::tempdir().unwrap();
    let text = "[[source]]\nkind = 'point'\n[[receiver]]\nname = 'far_wall'\nsize = [9, 9]\nat = [0, 0, 9]\n";
    std::fs::write(folder.path().join("scene.toml"), text).unwrap();
    let arguments = ["trace", "scene.toml", "-o", "out", "--until-error", "50%@far_wall", "--no-report"];
    let (code, _, err) = lampyris_in(folder.path(), &arguments);
    let said = err.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(code == 0 && said.matches("on far_wall: reached").count() == 1, "{err}");
}

#[test]
fn mistakes_in_a_scene_end_with_2_show_the_line_and_leave_nothing() {
    for (from, to, says) in [
        ("[[receiver]]", "[[reciever]]", &["scene.toml:", "reciever", "receiver"][..]),
        ("power", "powre", &["scene.toml:", "powre", "power"]),
        ("reflectance = 0.95", "reflectance = \"much\"", &["scene.toml:", "reflectance"]),
        ("kind = \"point\"", "kind = \"sun\"", &["scene.toml:", "sun", "point"]),
    ] {
        let folder = scene(from, to);
        let (code, out, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out"]);
        assert_eq!((code, out.as_str()), (2, ""), "{to}: {err}");
        for word in says {
            assert!(err.contains(word), "{to}: '{word}' is missing in\n{err}");
        }
        assert!(!err.contains("panicked"), "{err}");
        assert_eq!(left_behind(folder.path()), Vec::<String>::new(), "{to}");
    }
}

#[test]
fn a_rule_for_a_part_that_is_not_in_the_model_names_the_parts_that_are() {
    let folder = scene("[[source]]", "[[material]]\npart = \"no such part\"\nsurface = \"mirror\"\n\n[[source]]");
    let (code, _, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out"]);
    assert_eq!(code, 2, "{err}");
    assert!(err.contains("no such part") && err.contains("scene.toml:"), "{err}");
    assert_eq!(left_behind(folder.path()), Vec::<String>::new());
    let folder = scene("[run]", "[run]");
    let (code, _, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "--part", "refelctor=0.1"]);
    assert!(code == 2 && err.contains("--part refelctor"), "{err}");
    assert_eq!(left_behind(folder.path()), Vec::<String>::new());
}

#[test]
fn files_that_cannot_be_read_end_with_3() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("empty.stp"), "").unwrap();
    std::fs::write(folder.path().join("scene.toml"), "[[model]]\nfile = \"gone.stp\"\n").unwrap();
    for (arguments, says) in [
        (&["trace", "gone.toml"][..], "gone.toml"),
        (&["trace", "scene.toml"], "gone.stp"),
        (&["check", "empty.stp"], "the file is empty"),
        (&["facet", "empty.stp", "-o", "a.obj"], "the file is empty"),
        (&["facet", "gone.stp"], "gone.stp"),
    ] {
        let (code, out, err) = lampyris_in(folder.path(), arguments);
        assert_eq!((code, out.as_str()), (3, ""), "{arguments:?}: {err}");
        assert!(err.contains(says) && !err.contains("panicked"), "{arguments:?}: {err}");
    }
    assert_eq!(left_behind(folder.path()), ["empty.stp"]);
}

#[test]
fn facet_writes_what_it_is_asked_for_and_reports_in_the_agreed_keys() {
    let folder = tempfile::tempdir().unwrap();
    let lens = fixture("step/lens_planoconvex_nurbs.stp").display().to_string();
    let names = ["a.obj", "a.ply", "a.stl", "a.vtu", "a.glb", "a.data2"];
    let mut arguments = vec!["facet", lens.as_str(), "--tolerance", "0.05", "--json"];
    names.iter().for_each(|n| arguments.extend(["-o", n]));
    let (code, out, err) = lampyris_in(folder.path(), &arguments);
    assert_eq!(code, 0, "{err}");
    let mut found = left_behind(folder.path());
    found.sort();
    let mut wanted = names.map(str::to_owned);
    wanted.sort();
    assert_eq!(found, wanted);
    let document: Value = serde_json::from_str(&out).unwrap();
    for key in [
        "facets",
        "quads",
        "triangles",
        "vertices",
        "tolerance_mm",
        "sag_mm",
        "over_tolerance",
        "normal_error_deg",
        "quad_area_share",
        "area_mm2",
        "volume_mm3",
        "shells",
        "open_edges",
        "nonmanifold_edges",
        "faces",
        "seconds",
        "peak_bytes",
    ] {
        assert!(document.get(key).is_some(), "{key} is missing");
    }
    assert_eq!(document["over_tolerance"], 0);
    let stl = stl_io::read_stl(&mut std::fs::File::open(folder.path().join("a.stl")).unwrap()).unwrap();
    let triangles = 2 * document["quads"].as_u64().unwrap() + document["triangles"].as_u64().unwrap();
    assert_eq!(stl.faces.len() as u64, triangles);
    // An unknown extension is said before anything is read or written.
    let (code, _, err) = lampyris_in(folder.path(), &["facet", "gone.stp", "-o", "mesh.xyz"]);
    assert!(code == 2 && err.contains("'xyz'") && err.contains(".glb"), "{err}");
}

#[test]
fn a_whole_far_field_in_candela_is_written_as_ies_and_holds_the_flux() {
    let far = "[[receiver]]\nname = \"all\"\nkind = \"far_field\"\nangles = \"C\"\ncells = [36, 180]\n\n[[receiver]]\nabsorbs = false";
    let folder = scene("[[receiver]]", far);
    let text = std::fs::read_to_string(folder.path().join("scene.toml")).unwrap();
    std::fs::write(folder.path().join("scene.toml"), text.replace("[run]", "[run]\nunit = \"lm\"")).unwrap();
    let (code, _, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "--rays", "50000", "-o", "out"]);
    assert_eq!(code, 0, "{err}");
    let out = folder.path().join("out");
    let results: Value = serde_json::from_str(&std::fs::read_to_string(out.join("results.json")).unwrap()).unwrap();
    let received = results["receivers"][0]["power"].as_f64().unwrap();
    let photometry = lampyris::formats::read_ies(&out.join("all.ies")).unwrap();
    // The flux of the file is a trapezium sum over 1° cells of a beam some 10° wide: within 3 %.
    assert!((photometry.flux() / received - 1.0).abs() < 0.03, "{} {received}", photometry.flux());
    let data3 = lampyris::formats::read_data3(&out.join("wall.data3")).unwrap();
    assert_eq!(data3.size, [200, 200]);
    assert!(!data3.rays.is_empty());
}

#[test]
fn trace_writes_its_folder_and_dry_run_does_not() {
    let folder = scene("[run]", "[run]");
    let (code, out, err) =
        lampyris_in(folder.path(), &["trace", "scene.toml", "--rays", "20000", "--dry-run", "-o", "dry"]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("would trace") && !folder.path().join("dry").exists(), "{out}");
    let arguments = ["trace", "scene.toml", "--rays", "20000", "-o", "out", "--verify-pruning", "--json"];
    let (code, out, err) = lampyris_in(folder.path(), &arguments);
    assert_eq!(code, 0, "{err}");
    let document: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(document["pruning"]["identical"], true);
    for file in document["receivers"][0]["files"].as_array().unwrap() {
        assert!(folder.path().join("out").join(file.as_str().unwrap()).is_file());
    }
    assert!(folder.path().join("out/report.html").is_file());
}

#[test]
fn check_counts_no_defect_on_a_lens_and_its_rays_can_be_used_again() {
    let folder = tempfile::tempdir().unwrap();
    let lens = fixture("step/lens_planoconvex_nurbs.stp").display().to_string();
    let arguments = ["check", &lens, "--rays", "6000", "--rays-out", "rays.bin", "--json"];
    let (code, out, err) = lampyris_in(folder.path(), &arguments);
    assert_eq!(code, 0, "{err}");
    let first: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(first["octree_vs_bvh"]["disagree"], 0);
    assert_eq!(first["facets_vs_exact"]["unexplained"], 0);
    for key in ["octree", "octree_single", "bvh2", "cwbvh", "cwbvh_as_shipped", "polish", "exact"] {
        assert!(first["mrays_per_s"][key].as_f64().is_some_and(|r| r > 0.0), "{key}");
    }
    assert_eq!(std::fs::metadata(folder.path().join("rays.bin")).unwrap().len(), 6000 * 56);
    let (code, out, err) = lampyris_in(folder.path(), &["check", &lens, "--rays-in", "rays.bin", "--json"]);
    assert_eq!(code, 0, "{err}");
    let second: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(first["facets_vs_exact"], second["facets_vs_exact"]);
    std::fs::write(folder.path().join("torn.bin"), [0u8; 57]).unwrap();
    for option in ["--rays", "--seed"] {
        let (code, _, err) = lampyris_in(folder.path(), &["check", &lens, "--rays-in", "rays.bin", option, "5"]);
        assert!(code == 2 && err.contains(&format!("does not take {option}")), "{code} {err}");
    }
    let (code, _, err) = lampyris_in(folder.path(), &["check", &lens, "--rays-in", "torn.bin"]);
    assert!(code == 3 && err.contains("record 1"), "{err}");
}

/// A lens without its rim: what has gone in by a face and comes to the opening is lost, and the user is told so before and after.
#[test]
fn a_medium_in_an_open_shell_is_named_before_and_after() {
    let text = std::fs::read_to_string(fixture("step/lens_planoconvex_analytic.stp")).unwrap();
    let solid = text.find("MANIFOLD_SOLID_BREP(").expect("a solid");
    let shell = solid + text[solid..].find('#').unwrap();
    let end = shell + text[shell..].find(')').unwrap();
    let model = format!("SHELL_BASED_SURFACE_MODEL('',({}){}", &text[shell..end], &text[end..]);
    let open = format!("{}{model}", &text[..solid]).replace("CLOSED_SHELL", "OPEN_SHELL");
    let faces = open.find("OPEN_SHELL(").unwrap();
    let (first, last) = (faces + open[faces..].find(",(").unwrap() + 2, faces + open[faces..].find("))").unwrap());
    let kept = open[first..last].rsplit_once(',').expect("several faces").0;
    let open = format!("{}{kept}{}", &open[..first], &open[last..]);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("open.stp"), open).unwrap();
    let text = std::fs::read_to_string(fixture("scenes/s1_lens.toml")).unwrap();
    let text = text.replace("../step/lens_planoconvex_nurbs.stp", "open.stp").replace("1_000_000", "2000");
    let text =
        text.split_once("[[receiver]]").unwrap().0.to_owned() + "[[receiver]]\nname = 'far'\nkind = 'far_field'\n";
    std::fs::write(folder.path().join("scene.toml"), text).unwrap();
    let (code, _, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out"]);
    assert_eq!(code, 4, "{err}");
    for says in ["has the medium 'glass' but no closed shell", "open shell", "lost_rays.csv"] {
        assert!(err.contains(says), "'{says}' is missing in\n{err}");
    }
}

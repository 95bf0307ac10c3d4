//! Parts that a scene leaves out of its model, with the real binary.

use crate::files::{fixture, part21};
use crate::support::lampyris_in;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// The lamp as `lamp.stp`, and as `fewer.stp` without the solid of its part `led`, which stands three times.
fn lamps(folder: &Path) {
    let text = fs::read_to_string(fixture("step/lamp_multicavity.stp")).unwrap();
    let fewer = text.replace("('',(#11,#7588),#8240)", "('',(#11),#8240)");
    assert_ne!(text, fewer);
    fs::write(folder.join("lamp.stp"), text).unwrap();
    fs::write(folder.join("fewer.stp"), fewer).unwrap();
}

/// A scene whose light meets all three LEDs.
fn scene(file: &str, without: &str) -> String {
    format!(
        "[run]\nrays = 20_000\n[[model]]\nfile = '{file}'\n{without}\n\
         [[material]]\npart = 'housing'\nsurface = 'mirror'\nreflectance = 0.9\n\
         [[material]]\npart = 'cover*'\nmedium = 'PMMA'\n\
         [[source]]\nkind = 'collimated'\nat = [0, 0, 120]\ndirection = [0, 0, -1]\nsize = [280, 90]\n\
         [[receiver]]\nname = 'far'\nkind = 'far_field'\ncells = [20, 20]\n"
    )
}

/// Traces a scene with facets of one tolerance and a cache that all runs of the folder share.
fn traced(folder: &Path, file: &str, without: &str) -> Value {
    fs::write(folder.join("s.toml"), scene(file, without)).unwrap();
    let arguments = ["trace", "s.toml", "-o", "out", "--json", "--tolerance", "0.5", "--cache", "kept"];
    let (code, out, err) = lampyris_in(folder, &arguments);
    assert_eq!(code, 0, "{err}");
    serde_json::from_str(&out).unwrap()
}

#[test]
fn what_is_left_out_leaves_the_figures_of_a_file_that_never_had_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    lamps(path);
    let whole = traced(path, "lamp.stp", "");
    let expected = traced(path, "fewer.stp", "");
    assert_ne!(whole["digest"], expected["digest"], "the light meets them");
    assert!(whole["left_out"].is_null());
    for selector in ["{ part = 'led' }", "{ colour = '#fff37c' }", "{ instance = ['led_0', 'led_1', 'led_2'] }"] {
        let found = traced(path, "lamp.stp", &format!("without = [{selector}]"));
        assert_eq!(found["digest"], expected["digest"], "{selector}");
        assert_eq!(found["receivers"][0]["figures"], expected["receivers"][0]["figures"], "{selector}");
        assert_eq!(found["left_out"][0]["faces"], 33, "{selector}");
        let page = fs::read_to_string(path.join("out/report.html")).unwrap();
        assert!(page.contains("Left out") && page.contains("led_0, led_1, led_2"), "{selector}");
    }
    // Of one place alone; the cache holds what was made of the others.
    let two = traced(path, "lamp.stp", "without = [{ instance = 'led_1' }]");
    assert!(two["digest"] != whole["digest"] && two["digest"] != expected["digest"]);
    assert_eq!(traced(path, "lamp.stp", "")["digest"], whole["digest"]);
}

#[test]
fn a_dry_run_lists_what_is_left_out_and_a_check_heeds_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    lamps(path);
    fs::write(path.join("s.toml"), scene("lamp.stp", "without = [{ part = 'led' }, { entity = 51 }]")).unwrap();
    let (code, out, err) = lampyris_in(path, &["trace", "s.toml", "--dry-run", "--tolerance", "0.5"]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("Left out") && out.contains("part = \"led\"") && out.contains("entity = 51"), "{out}");
    let (_, out, _) = lampyris_in(path, &["trace", "s.toml", "--dry-run", "--json", "--tolerance", "0.5"]);
    let found: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(found["left_out"][1]["instances"][0], "housing");
    // 19 faces of the housing but one, 10 of the cover; each LED has 11.
    assert_eq!(found["faces"], 28);
    let patches = |arguments: &[&str]| {
        let (code, out, err) = lampyris_in(path, arguments);
        assert!([0, 4].contains(&code), "{err}");
        serde_json::from_str::<Value>(&out).unwrap()["scene"]["facets"].as_u64().unwrap()
    };
    let without = patches(&["check", "s.toml", "--json", "--rays", "1000", "--tolerance", "0.5"]);
    fs::write(path.join("s.toml"), scene("lamp.stp", "")).unwrap();
    let with = patches(&["check", "s.toml", "--json", "--rays", "1000", "--tolerance", "0.5"]);
    assert!(without < with, "{without} {with}");
}

#[test]
fn parts_of_runs_that_leave_out_different_faces_are_not_merged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    lamps(path);
    for (part, without) in [("1/2", ""), ("2/2", "without = [{ part = 'led' }]")] {
        fs::write(path.join("s.toml"), scene("lamp.stp", without)).unwrap();
        let file = format!("{}.tally", &part[..1]);
        let (code, _, err) =
            lampyris_in(path, &["trace", "s.toml", "--shard", part, "-o", &file, "--tolerance", "0.5"]);
        assert_eq!(code, 0, "{err}");
    }
    let (code, _, err) = lampyris_in(path, &["merge", "1.tally", "2.tally", "-o", "merged"]);
    assert!(code != 0 && !path.join("merged/results.json").exists(), "{code} {err}");
}

#[test]
fn a_selector_that_means_nothing_is_refused_with_what_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    lamps(path);
    for (without, message) in [
        ("without = [{ part = 'leds' }]", "did you mean 'led'?"),
        ("without = [{ part = 'led', kind = 'torus' }]", "matches no face"),
        ("without = [{ entity = 999999 }]", "no face is #999999"),
        ("without = [{ parts = 'led' }]", "did you mean 'part'?"),
        ("without = { part = 'led' }", "without = [{ part = \"helper*\" }]"),
    ] {
        fs::write(path.join("s.toml"), scene("lamp.stp", without)).unwrap();
        let (code, _, err) = lampyris_in(path, &["trace", "s.toml", "-o", "out"]);
        assert!(code == 2 && err.contains(message) && err.contains("s.toml:5"), "{without}: {code} {err}");
    }
}

/// A square and the tip of a wing as OpenVSP writes it, all four corners in one point: nothing that has an area is missing.
#[test]
fn a_face_without_an_area_is_told_and_is_no_reason_to_fail() {
    let folder = tempfile::tempdir().unwrap();
    let patch = |id: u32, points: &str| {
        format!(
            "#{id}=B_SPLINE_SURFACE_WITH_KNOTS('',1,1,({points}),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.);\n"
        )
    };
    let entities = "#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n\
        #2=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#1))REPRESENTATION_CONTEXT('',''));\n\
        #3=GEOMETRIC_SET('',(#10,#11));\n\
        #4=GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION('',(#3),#2);\n\
        #20=CARTESIAN_POINT('',(4985.8,0.,3340.6));\n#21=CARTESIAN_POINT('',(4995.8,0.,3340.6));\n\
        #22=CARTESIAN_POINT('',(4985.8,10.,3340.6));\n#23=CARTESIAN_POINT('',(4995.8,10.,3340.6));\n"
        .to_owned()
        + &patch(10, "(#20,#20),(#20,#20)")
        + &patch(11, "(#20,#21),(#22,#23)");
    fs::write(folder.path().join("tip.stp"), part21(&entities)).unwrap();
    let (code, _, err) = lampyris_in(folder.path(), &["facet", "tip.stp"]);
    assert!(
        code == 0 && err.contains("1 of 2 faces got no facets") && err.contains("#10: it has no area"),
        "{err}"
    );
    let (code, out, err) = lampyris_in(folder.path(), &["facet", "tip.stp", "--json"]);
    assert_eq!(code, 0, "{err}");
    let found: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(found["failed"][0]["cause"], "no_area");
    assert_eq!(found["faces"]["meshed"], 1);
    assert!((found["area_mm2"].as_f64().unwrap() - 100.0).abs() < 1e-9);
}

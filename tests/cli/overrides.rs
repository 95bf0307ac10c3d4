//! Tolerances of single faces and parts from the command line, with the real binary.

use crate::files::fixture;
use crate::support::lampyris_in;
use serde_json::Value;

/// What `facet` says of the lens with further options.
fn report(options: &[&str]) -> Value {
    let lens = fixture("step/lens_planoconvex_analytic.stp").display().to_string();
    let folder = tempfile::tempdir().unwrap();
    let all = [&["facet", &lens, "--json", "--threads", "2"], options].concat();
    let (code, out, err) = lampyris_in(folder.path(), &all);
    assert_eq!(code, 0, "{err}");
    serde_json::from_str(&out).unwrap()
}

/// Facets of the lens with further options.
fn facets(options: &[&str]) -> u64 {
    let report = report(options);
    assert_eq!(report["over_tolerance"], 0);
    report["facets"].as_u64().unwrap()
}

#[test]
fn one_face_of_a_lens_is_finer_than_the_rest() {
    let (coarse, fine) = (facets(&["--tolerance", "0.1"]), facets(&["--tolerance", "0.001"]));
    let mut each = 0;
    // The file's three faces: two of them are curved.
    for face in ["17", "#54", "#109"] {
        let one = facets(&["--tolerance", "0.1", "--face", &format!("{face}=0.001")]);
        assert!(one >= coarse && one < fine, "{face}: {one} of {coarse} and {fine}");
        each += usize::from(one > 2 * coarse);
    }
    assert!(each >= 1);
}

/// What a search says of its facets is true of those that are made: with the angle and the tolerances of single faces.
#[test]
fn an_accuracy_is_reached_with_the_other_settings_of_the_facets() {
    for options in [&["--angle", "2"][..], &["--face", "17=0.001"]] {
        let report = report(&[&["--accuracy", "0.5deg"], options].concat());
        assert_eq!(report["accuracy"]["facets"], report["facets"], "{options:?}");
    }
}

#[test]
fn a_face_that_is_not_there_is_refused_with_what_to_write() {
    let lens = fixture("step/lens_planoconvex_analytic.stp").display().to_string();
    let folder = tempfile::tempdir().unwrap();
    for name in ["#18", "cover"] {
        let (code, _, err) = lampyris_in(folder.path(), &["facet", &lens, "--face", &format!("{name}=0.1")]);
        assert!(code == 2 && err.contains(&format!("--face {name}")), "{err}");
    }
}

/// The mirrors of a scene are finer, whatever parts they belong to; a file alone has no roles.
#[test]
fn an_optical_role_has_its_own_tolerance() {
    let scene = fixture("scenes/s3_reflector.toml").display().to_string();
    let folder = tempfile::tempdir().unwrap();
    let facets = |options: &[&str]| {
        let all = [&["check", &scene, "--rays", "1000", "--tolerance", "0.2", "--json"], options].concat();
        let (code, out, err) = lampyris_in(folder.path(), &all);
        assert_eq!(code, 0, "{err}");
        serde_json::from_str::<Value>(&out).unwrap()["scene"]["facets"].as_u64().unwrap()
    };
    let (plain, mirror) = (facets(&[]), facets(&["--role", "mirror=0.01"]));
    assert!(mirror > 3 * plain, "{plain} {mirror}");
    let lens = fixture("step/lens_planoconvex_analytic.stp").display().to_string();
    for (options, says) in [
        (["facet", &lens, "--role", "mirror=0.1"], "--part"),
        (["check", &scene, "--role", "miror=0.1"], "mirror"),
        (["check", &scene, "--role", "coated=0.001"], "there are faces of: mirror, absorber"),
    ] {
        let (code, _, err) = lampyris_in(folder.path(), &options);
        assert!(code == 2 && err.contains("--role") && err.contains(says), "{err}");
    }
}

//! Models, facets and octrees that are kept from one run to the next, with the real binary.

use crate::growing::{lens, lens_before_a_wall};
use crate::runs::without_times;
use crate::support::lampyris_in;
use serde_json::Value;
use std::path::{Path, PathBuf};

fn traced(folder: &Path, options: &[&str]) -> (Value, String) {
    let arguments = ["trace", "scene.toml", "-o", "out", "--no-report", "--json", "--tolerance", "0.1"];
    let (code, out, err) = lampyris_in(folder, &[&arguments, options].concat());
    assert_eq!(code, 0, "{err}");
    (serde_json::from_str(&out).unwrap(), err)
}

/// The files of a cache, by name.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn runs_are_the_same_with_a_cold_a_warm_a_damaged_and_no_cache() {
    let folder = lens("20_000");
    let path = folder.path();
    let digest = traced(path, &[]).0["digest"].clone();
    let cold = traced(path, &["--cache", "kept"]);
    let files = entries(&path.join("kept"));
    assert_eq!((&cold.0["digest"], files.len()), (&digest, 3), "{files:?}");
    let whole: Vec<_> = files.iter().map(|f| std::fs::read(f).unwrap()).collect();
    assert_eq!(traced(path, &["--cache", "kept"]).0["digest"], digest);
    // Damage anywhere is noticed, named and mended.
    for (file, whole) in files.iter().zip(&whole) {
        for place in [20, whole.len() / 2] {
            let mut bent = whole.clone();
            bent[place] ^= 0x10;
            std::fs::write(file, &bent).unwrap();
            let (found, err) = traced(path, &["--cache", "kept"]);
            assert!(found["digest"] == digest && err.contains("built anew"), "{place}: {err}");
            assert_eq!(&std::fs::read(file).unwrap(), whole);
        }
        std::fs::write(file, &whole[..whole.len() / 3]).unwrap();
        assert_eq!(traced(path, &["--cache", "kept"]).0["digest"], digest);
        assert_eq!(&std::fs::read(file).unwrap(), whole);
    }
    // Other settings and another model are other entries.
    let finer = traced(path, &["--cache", "kept", "--angle", "3"]);
    assert_eq!(entries(&path.join("kept")).len(), 5);
    assert_eq!(finer.0["digest"], traced(path, &["--angle", "3"]).0["digest"]);
    let model = std::fs::read_to_string(path.join("model.stp")).unwrap();
    std::fs::write(path.join("model.stp"), model + "\n").unwrap();
    assert_eq!(traced(path, &["--cache", "kept"]).0["digest"], digest);
    assert_eq!(entries(&path.join("kept")).len(), 8);
}

/// A second run takes what the pilot of the first one found, its seconds among it.
#[test]
fn a_choice_is_kept_too() {
    let folder = lens_before_a_wall();
    let path = folder.path();
    let run = |options: &[&str]| -> Value {
        let arguments = ["trace", "scene.toml", "-o", "out", "--no-report", "--json"];
        let (code, out, err) = lampyris_in(path, &[&arguments, options].concat());
        assert_eq!(code, 0, "{err}");
        serde_json::from_str(&out).unwrap()
    };
    let [without, cold, warm] = [&[][..], &["--cache", "kept"], &["--cache", "kept"]].map(run);
    assert_eq!((&cold["digest"], &warm["digest"]), (&without["digest"], &without["digest"]));
    assert!(cold["chosen"]["pilot_rays"].as_u64().unwrap() > 0);
    for key in ["chosen", "faceting"] {
        assert_eq!(cold[key], warm[key], "{key}");
    }
    assert_eq!(without_times(cold), without_times(without));
}

#[test]
fn a_cache_is_shown_limited_and_cleared() {
    let folder = lens("20_000");
    let path = folder.path();
    let show = |options: &[&str]| {
        let (code, out, err) = lampyris_in(path, &[&["cache", "--cache", "kept", "--json"], options].concat());
        assert_eq!(code, 0, "{err}");
        serde_json::from_str::<Value>(&out).unwrap()
    };
    let (code, out, err) = lampyris_in(path, &["cache", "--cache", "kept"]);
    assert!(code == 3 && out.is_empty() && err.contains("kept: there is no such folder"), "{code} {out} {err}");
    // What is to be emptied may be gone already.
    assert_eq!(lampyris_in(path, &["cache", "--cache", "kept", "--clear"]).0, 0);
    assert_eq!(lampyris_in(path, &["cache"]).0, 2);
    // One that the environment names is made by the first run that needs it.
    let output = std::process::Command::new(assert_cmd::cargo::cargo_bin("lampyris"))
        .current_dir(path)
        .args(["cache", "--json"])
        .env("LAMPYRIS_CACHE", "kept")
        .output()
        .unwrap();
    assert!(output.status.success());
    assert_eq!(serde_json::from_slice::<Value>(&output.stdout).unwrap()["entries"].as_array().unwrap().len(), 0);
    traced(path, &["--cache", "kept"]);
    std::fs::write(path.join("kept/of others.octree"), "stays").unwrap();
    let shown = show(&[]);
    assert_eq!(shown["entries"].as_array().unwrap().len(), 3);
    assert!(shown["bytes"].as_u64().unwrap() > 1000);
    assert_eq!(show(&["--clear"])["removed"], 3);
    assert_eq!(entries(&path.join("kept")), [path.join("kept/of others.octree")]);
    // Nothing fits into a limit of nothing; the run goes on.
    let output = std::process::Command::new(assert_cmd::cargo::cargo_bin("lampyris"))
        .current_dir(path)
        .args(["trace", "scene.toml", "-o", "out", "--no-report", "--tolerance", "0.1"])
        .envs([("LAMPYRIS_CACHE", "kept"), ("LAMPYRIS_CACHE_GB", "0")])
        .output()
        .unwrap();
    assert!(output.status.success());
    assert_eq!(entries(&path.join("kept")).len(), 1);
    // Where nothing can be kept, the run goes on and says so.
    let (_, err) = traced(path, &["--cache", "model.stp"]);
    assert!(err.contains("nothing is kept"), "{err}");
    let (code, _, err) = lampyris_in(path, &["cache", "--cache", "model.stp"]);
    assert!(code == 3 && err.contains("model.stp: it is a file, and a folder is needed"), "{code} {err}");
}

/// Processes that start at once on an empty folder all end well, and leave whole entries behind.
#[test]
fn processes_that_start_at_once_share_a_cache() {
    let folder = lens("2_000");
    let path = folder.path();
    let start = |k: usize| {
        std::process::Command::new(assert_cmd::cargo::cargo_bin("lampyris"))
            .current_dir(path)
            .args([
                "trace",
                "scene.toml",
                "--no-report",
                "--tolerance",
                "0.1",
                "--cache",
                "kept",
                "-q",
                "--threads",
                "1",
            ])
            .args(["--shard", &format!("{k}/12"), "-o", "parts"])
            .spawn()
            .unwrap()
    };
    let processes: Vec<_> = (1..=12).map(start).collect();
    for mut process in processes {
        assert!(process.wait().unwrap().success());
    }
    assert_eq!(entries(&path.join("kept")).len(), 3);
    let (_, err) = traced(path, &["--cache", "kept"]);
    assert!(!err.contains("built anew"), "{err}");
}

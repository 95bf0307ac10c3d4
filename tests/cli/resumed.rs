//! What a run continued with `--resume` says of the commands that traced it.

use crate::runs::{document, lens};
use crate::support::lampyris_in;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// A run continued from a sum of parts reports what traced these, in the order of their numbers, and what traced the rest.
#[test]
fn a_run_that_goes_on_from_a_sum_names_all_that_traced_it() {
    let folder = lens(|m| m);
    let path = folder.path();
    for k in ["10/12", "2/12"] {
        let (code, _, err) = lampyris_in(path, &["trace", "scene.toml", "--shard", k, "-o", "parts"]);
        assert_eq!(code, 0, "{err}");
    }
    let (code, _, err) = lampyris_in(path, &["merge", "parts", "-o", "out/checkpoint.tally"]);
    assert_eq!(code, 0, "{err}");
    let run = document(path, &["trace", "scene.toml", "-o", "out", "--resume", "--json", "--no-report"], 0);
    let commands: Vec<&str> = run["provenance"]["traced_by"]
        .as_array()
        .unwrap()
        .iter()
        .map(|command| command.as_str().unwrap())
        .collect();
    let whose = ["scene.toml --shard 2/12", "scene.toml --shard 10/12", "scene.toml -o out --resume"];
    assert!(
        commands.len() == 3 && commands.iter().zip(whose).all(|(command, whose)| command.contains(whose)),
        "{commands:?}"
    );
    assert_eq!(run["replicates"], 128);
}

/// Searches that end with a run of 20,000 rays, the most that they may trace.
const SEARCHES: [&[&str]; 2] =
    [&["--rays", "20000", "--until-error", "50%@far"], &["--rays", "20000", "--until-settled"]];

/// A folder with a lamp that a regulation judges, under `lamp.toml`.
fn lamp() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scene = "[run]\nunit = 'lm'\n[[source]]\nkind = 'cosine'\nexponent = 40\npower = 18\ndirection = [0, 0, 1]\n\
        [[receiver]]\nname = 'far'\nkind = 'far_field'\nh_deg = [-30, 30]\nv_deg = [-30, 30]\ncells = [60, 60]\n\
        [[regulation]]\nid = 'UN R148-01 rear-position-R1'\n";
    std::fs::write(folder.path().join("lamp.toml"), scene).unwrap();
    folder
}

/// Runs a command that is done, whether what it was to reach is reached or not, and returns it as results name it.
fn done(folder: &Path, arguments: &[&str]) -> String {
    let (code, _, err) = lampyris_in(folder, arguments);
    assert!(code == 0 || code == 4, "{arguments:?}: {code} {err}");
    format!("lampyris {}", arguments.join(" "))
}

/// Traces the lamp with these options, and returns the command.
fn traced(folder: &Path, options: &[&str]) -> String {
    done(folder, &[&["trace", "lamp.toml", "--tolerance", "0.2", "--no-report"], options].concat())
}

/// The results in a folder.
fn results(folder: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("results.json")).unwrap()).unwrap()
}

/// The commands that traced a run from parts.
fn tracers(results: &Value) -> BTreeSet<String> {
    let commands = results["provenance"]["traced_by"].as_array().into_iter().flatten();
    commands.map(|command| command.as_str().unwrap().to_owned()).collect()
}

/// The part of a shard stands for a run that was stopped: it is saved in the same form.
#[test]
fn a_search_that_finishes_a_run_names_the_command_that_began_it() {
    let folder = lamp();
    let path = folder.path();
    let first = traced(path, &["--rays", "20000", "--shard", "2/12", "-o", "part.tally"]);
    for (search, out) in SEARCHES.into_iter().zip(["error", "settled"]) {
        std::fs::create_dir(path.join(out)).unwrap();
        std::fs::copy(path.join("part.tally"), path.join(out).join("checkpoint.tally")).unwrap();
        traced(path, &[search, &["-o", out, "--resume"]].concat());
        let results = results(&path.join(out));
        assert_eq!(results["provenance"]["command"], first.as_str());
        assert_eq!(results["rays"], 20_000);
        assert!(tracers(&results).is_empty(), "{results}");
    }
}

#[test]
fn a_search_that_finishes_a_sum_names_all_that_traced_it() {
    let folder = lamp();
    let path = folder.path();
    let parts = ["2/12", "10/12"].map(|k| traced(path, &["--rays", "20000", "--shard", k, "-o", "parts"]));
    for (search, out) in SEARCHES.into_iter().zip(["error", "settled"]) {
        let sum = done(path, &["merge", "parts", "-o", &format!("{out}/checkpoint.tally")]);
        let last = traced(path, &[search, &["-o", out, "--resume"]].concat());
        let results = results(&path.join(out));
        assert_eq!(results["provenance"]["command"], sum.as_str());
        let all: BTreeSet<String> = parts.iter().cloned().chain([last]).collect();
        assert_eq!(tracers(&results), all);
    }
}

/// Of a run that is longer than the one that was saved every ray is traced anew: the parts of that one traced none of them.
#[test]
fn a_search_that_outgrows_a_sum_names_its_own_command() {
    let folder = lamp();
    let path = folder.path();
    traced(path, &["--rays", "20000", "--shard", "2/12", "-o", "parts"]);
    done(path, &["merge", "parts", "-o", "out/checkpoint.tally"]);
    let search = ["--rays", "40000", "--until-error", "0.0001%@far:cells", "-o", "out", "--resume"];
    let own = traced(path, &search);
    let results = results(&path.join("out"));
    assert_eq!(results["provenance"]["command"], own.as_str());
    assert_eq!(results["rays"], 40_000);
    assert!(tracers(&results).is_empty(), "{results}");
}

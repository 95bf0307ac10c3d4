//! Parts of a run on the engines that people have: the examples, run for real.

use crate::files::fixture;
use std::path::Path;
use std::process::Command;

/// Every engine that can be installed gives digest and files of the run at once; those that cannot are named.
#[test]
#[ignore = "installs Slurm, Open MPI, Dask, GNU parallel and Snakemake"]
fn every_engine_gives_the_run_at_once() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = std::fs::read_to_string(fixture("scenes/s1_lens.toml")).expect("the scene");
    let model = fixture("step/lens_planoconvex_nurbs.stp");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("lens.toml");
    let scene = scene.replace("../step/lens_planoconvex_nurbs.stp", &model.to_string_lossy());
    std::fs::write(&path, scene.replace("1_000_000", "100_000")).expect("a written scene");
    let script = root.join("examples/cluster/test.sh");
    let output = Command::new("bash").arg(script).arg(env!("CARGO_BIN_EXE_lampyris")).arg(&path).output();
    let output = output.expect("bash runs the script");
    let text = String::from_utf8_lossy(&output.stdout);
    println!("{text}");
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("same digest, same files"), "no engine could be installed:\n{text}");
}

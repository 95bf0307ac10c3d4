//! What a command writes never replaces what it reads, and nothing of an earlier run stands beside the results of this one.

use crate::files::fixture;
use crate::support::lampyris_in;
use std::fs;
use std::path::Path;

/// Two rays that meet the plane of the scene below.
const RAYS: &str = "x,y,z,dx,dy,dz,power\n0,0,0,0,0,1,1\n1,0,0,0,0,1,1\n";

/// A folder with a ray list of two rays as the only source, and one plane.
fn list() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rays.csv"), RAYS).unwrap();
    write_scene(folder.path(), "rays.csv", "wall");
    folder
}

fn write_scene(folder: &Path, file: &str, receiver: &str) {
    let scene = format!(
        "[run]\nrays = 400\n[[source]]\nkind = 'rays'\nfile = '{file}'\n[[receiver]]\nname = '{receiver}'\nat = [0, 0, 20]\n\
         size = [10, 10]\ncells = [2, 2]\n"
    );
    fs::write(folder.join("scene.toml"), scene).unwrap();
}

/// Runs it, which must be refused with these words before anything is written.
fn refused(folder: &Path, arguments: &[&str], says: &[&str]) {
    let (code, _, err) = lampyris_in(folder, arguments);
    let err = err.replace('\n', " ");
    assert!(code == 2 && says.iter().all(|word| err.contains(word)), "{arguments:?}: {code} {err}");
}

#[test]
fn no_output_of_a_trace_replaces_a_file_of_its_scene() {
    let folder = list();
    let path = folder.path();
    let trace = ["trace", "scene.toml", "--no-report", "-o"];
    refused(path, &[&trace[..], &["out", "--ends", "./rays.csv"]].concat(), &["--ends", "rays.csv", "is read"]);
    // A plane called as the source writes a file of its name.
    write_scene(path, "rays.csv", "rays");
    refused(path, &[&trace[..], &["."]].concat(), &["rays.csv", "is read"]);
    let pictures = path.join("tables");
    fs::create_dir(&pictures).unwrap();
    fs::copy(path.join("rays.csv"), pictures.join("facets.csv")).unwrap();
    write_scene(path, "tables/facets.csv", "wall");
    refused(path, &[&trace[..], &["."]].concat(), &["facets.csv", "is read"]);
    assert_eq!(fs::read_to_string(path.join("rays.csv")).unwrap(), RAYS);
    // Another name in the same folder is no harm.
    write_scene(path, "rays.csv", "wall");
    let (code, _, err) = lampyris_in(path, &[&trace[..], &[".", "--ends", "ends.csv"]].concat());
    assert!(code == 0 && path.join("ends.csv").is_file() && path.join("wall.csv").is_file(), "{err}");
    assert_eq!(fs::read_to_string(path.join("rays.csv")).unwrap(), RAYS);
}

#[test]
fn no_output_of_a_check_replaces_its_model_or_rays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let model = path.join("lens.stp");
    fs::copy(fixture("step/lens_planoconvex_nurbs.stp"), &model).unwrap();
    let before = fs::read(&model).unwrap();
    refused(path, &["check", "lens.stp", "--disagreements", "lens.stp"], &["--disagreements lens.stp", "is read"]);
    let scene = "[[model]]\nfile = 'lens.stp'\n[[source]]\n[[receiver]]\nname = 'wall'\nsize = [1, 1]\n";
    fs::write(path.join("scene.toml"), scene).unwrap();
    refused(path, &["check", "scene.toml", "--rays-out", "lens.stp"], &["--rays-out lens.stp", "is read"]);
    fs::write(path.join("rays.csv"), RAYS).unwrap();
    let arguments = ["check", "lens.stp", "--rays-in", "rays.csv", "--rays-out", "rays.csv"];
    refused(path, &arguments, &["--rays-out rays.csv", "is read"]);
    assert!(fs::read(&model).unwrap() == before && fs::read_to_string(path.join("rays.csv")).unwrap() == RAYS);
}

#[test]
fn the_demo_replaces_no_lamp_but_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let demo = ["demo", "--rays", "1000", "--no-report", "-o", "."];
    assert_eq!(lampyris_in(folder.path(), &demo).0, 0);
    assert_eq!(lampyris_in(folder.path(), &demo).0, 0);
    for name in ["lamp.stp", "lamp.toml"] {
        let file = folder.path().join(name);
        let written = fs::read(&file).unwrap();
        fs::write(&file, "my lamp").unwrap();
        refused(folder.path(), &demo, &[name, "already"]);
        assert_eq!(fs::read(&file).unwrap(), b"my lamp");
        fs::write(&file, written).unwrap();
    }
}

/// What would be ignored is refused: a range is traced as a shard, other commands know a number of rays alone.
#[test]
fn a_range_of_rays_takes_no_option_of_whole_runs() {
    let folder = list();
    let trace = ["trace", "scene.toml", "--rays", "0..5000"];
    for option in [
        &["--paths", "p.npz"][..],
        &["--ends", "e.csv"],
        &["--verify-pruning"],
        &["--until-error", "5%@wall"],
        &["--until-settled"],
    ] {
        refused(folder.path(), &[&trace[..], option].concat(), &["--rays A..B", option[0]]);
    }
    for command in [&["demo"][..], &["check", "scene.toml"], &["study", "bvh"]] {
        let arguments = [command, &["--rays", "100..200", "-o", "out"]].concat();
        refused(folder.path(), &arguments, &["range of rays", "--rays 100"]);
    }
    refused(folder.path(), &["check", "scene.toml", "--intersector", "octree"], &["--intersector"]);
    assert!(!folder.path().join("out").exists());
}

/// A place that cannot be written is no reason to lose the run, or what it prints.
#[test]
fn ends_are_tried_before_the_run() {
    let folder = list();
    let path = folder.path();
    fs::write(path.join("file"), "").unwrap();
    let trace =
        |ends: &str| lampyris_in(path, &["trace", "scene.toml", "--no-report", "-o", "out", "--ends", ends]);
    let (code, _, err) = trace("file/e.npz");
    assert!(code == 1 && err.contains("file") && !path.join("out/results.json").exists(), "{code} {err}");
    let (code, _, err) = trace("new/e.npz");
    assert!(code == 0 && path.join("new/e.npz").is_file(), "{code} {err}");
}

#[test]
fn nothing_of_an_earlier_run_stays_in_a_folder() {
    let folder = list();
    let path = folder.path();
    let trace = |options: &[&str]| {
        let (code, _, err) = lampyris_in(path, &[&["trace", "scene.toml", "-o", "out"], options].concat());
        assert_eq!(code, 0, "{err}");
    };
    trace(&[]);
    let stays = |name: &str| path.join("out").join(name).exists();
    assert!(stays("report.html") && stays("tables/facets.csv") && stays("wall.data3"));
    for name in ["lost_rays.csv", "own.csv", "figures/own.txt"] {
        fs::write(path.join("out").join(name), "").unwrap();
    }
    // A result of the earlier run is a source of this one.
    fs::copy(path.join("rays.csv"), path.join("out/wall.csv")).unwrap();
    write_scene(path, "out/wall.csv", "screen");
    trace(&["--no-report"]);
    for name in ["report.html", "lost_rays.csv", "tables/facets.csv", "wall.data3", "wall.npz"] {
        assert!(!stays(name), "{name}");
    }
    for name in ["own.csv", "figures/own.txt", "wall.csv", "screen.csv", "results.json"] {
        assert!(stays(name), "{name}");
    }
}

/// A place is tried before the work, under a name that is nobody's.
#[test]
fn what_is_beside_an_output_stays_and_long_names_are_taken() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let model = fixture("step/lens_planoconvex_nurbs.stp");
    fs::write(path.join("y.obj.try"), "mine").unwrap();
    let long = format!("{}.obj", "n".repeat(249));
    for name in ["y.obj", &long] {
        let (code, _, err) = lampyris_in(path, &["facet", model.to_str().unwrap(), "-o", name]);
        assert!(code == 0 && path.join(name).is_file(), "{code} {err}");
    }
    assert_eq!(fs::read(path.join("y.obj.try")).unwrap(), b"mine");
    // Neither a replay nor a plan of a run settles anything.
    let scene = list();
    for other in ["--until-settled", "--dry-run"] {
        refused(scene.path(), &["trace", "scene.toml", "--replay", "5", other], &["--replay", other]);
    }
}

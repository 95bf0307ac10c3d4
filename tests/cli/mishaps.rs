//! Bad luck while a scene is traced: nothing that was traced is lost, and nothing that was saved is written over.

use crate::files::{fixture, part21};
use crate::support::lampyris_in;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A folder with the lens of scene S1 and its model.
fn lens(change: impl Fn(String) -> String) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(fixture("step/lens_planoconvex_nurbs.stp"), folder.path().join("model.stp")).unwrap();
    let scene = fs::read_to_string(fixture("scenes/s1_lens.toml")).unwrap();
    let scene = scene.replace("../step/lens_planoconvex_nurbs.stp", "model.stp").replace("1_000_000", "20_000");
    fs::write(folder.path().join("scene.toml"), change(scene)).unwrap();
    folder
}

fn digest(folder: &Path) -> Value {
    let text = fs::read_to_string(folder.join("results.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()["digest"].clone()
}

/// The names of all that is in a folder, hidden files too.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Rays of a run that takes seconds, saved after each of its 128 replicates.
const LONG: [&str; 9] = ["trace", "scene.toml", "--rays", "3000000", "--threads", "1", "--checkpoint", "0", "-o"];

/// A long run that has saved some of itself.
fn saving_run(folder: &Path) -> Child {
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("lampyris"))
        .current_dir(folder)
        .args(LONG)
        .arg("out")
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    for _ in 0..6000 {
        if folder.join("out/checkpoint.tally").is_file() {
            return child;
        }
        assert!(child.try_wait().unwrap().is_none(), "it ended before it saved anything");
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("nothing was saved");
}

/// Kills a run that has saved what it traced; returns the file with that, and its bytes.
fn killed_run(folder: &Path) -> (PathBuf, Vec<u8>) {
    let mut child = saving_run(folder);
    child.kill().unwrap();
    child.wait().unwrap();
    let saved = folder.join("out/checkpoint.tally");
    let bytes = fs::read(&saved).unwrap();
    (saved, bytes)
}

#[test]
fn a_place_that_cannot_be_written_is_refused_before_tracing() {
    let folder = lens(|s| s.replace("20_000", "2_000_000_000"));
    fs::write(folder.path().join("file"), "").unwrap();
    for place in ["file/out", "file"] {
        let (code, _, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", place]);
        // Before the pilot too, which says what the run is traced on.
        assert!(code == 1 && err.contains("cannot be") && !err.contains("tracing on"), "{place}: {code} {err}");
        let (code, _, err) =
            lampyris_in(folder.path(), &["trace", "scene.toml", "--shard", "1/2", "-o", "file/a.tally"]);
        assert!(code == 1 && err.contains("cannot be"), "{code} {err}");
    }
}

/// What stands in the way is named, with what to do about it.
#[test]
#[cfg(unix)]
fn what_is_no_place_for_a_file_or_folder_and_no_scene_is_named() {
    let folder = lens(|s| s);
    let path = folder.path();
    fs::write(path.join("file"), "").unwrap();
    fs::create_dir(path.join("d.glb")).unwrap();
    fs::write(path.join("odd.toml"), b"title = \"\xff\"").unwrap();
    std::os::unix::fs::symlink("nothing", path.join("link")).unwrap();
    let cases: [(&[&str], i32, [&str; 2]); 8] = [
        (
            &["trace", "scene.toml", "-o", "link"],
            1,
            ["link: cannot be made: it is a link to nothing", "another folder"],
        ),
        (&["trace", "scene.toml", "-o", "file"], 1, ["file: cannot be made: it is a file", "another folder"]),
        (&["trace", "scene.toml", "-o", "file/out"], 1, ["out: cannot be made: file is a file", "another folder"]),
        (&["man", "-o", "file"], 1, ["file: cannot be made: it is a file", "another folder"]),
        (&["facet", "model.stp", "-o", "d.glb"], 1, ["d.glb: cannot be written: it is a folder", "name of a file"]),
        (&["trace", "d.glb"], 3, ["it is a folder", "name the scene file in it"]),
        (&["trace", "/dev/null"], 3, ["a pipe or a device", "a scene is a TOML file"]),
        (&["trace", "odd.toml"], 3, ["no UTF-8 text", "TOML in UTF-8"]),
    ];
    for (arguments, expected, says) in cases {
        let (code, _, err) = lampyris_in(path, arguments);
        let err = err.replace('\n', " ");
        assert!(code == expected && says.iter().all(|words| err.contains(words)), "{arguments:?}: {code} {err}");
        assert!(!err.contains("os error"), "{arguments:?}: {err}");
    }
}

#[test]
fn a_receiver_with_a_name_longer_than_a_file_name_has_its_files() {
    let folder = lens(|s| s.replace("\"focus\"", &format!("\"{}\"", "A".repeat(260))));
    let (code, out, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out", "--json"]);
    assert_eq!(code, 0, "{err}");
    let document: Value = serde_json::from_str(&out).unwrap();
    let files = document["receivers"][0]["files"].as_array().unwrap();
    assert!(files.len() >= 4);
    assert!(files.iter().all(|f| folder.path().join("out").join(f.as_str().unwrap()).is_file()), "{files:?}");
}

#[test]
fn results_that_cannot_be_written_where_they_should_are_written_elsewhere() {
    let folder = lens(|s| s);
    let path = folder.path();
    assert_eq!(lampyris_in(path, &["trace", "scene.toml", "-o", "whole"]).0, 0);
    // A folder where a file should go: found out when the rays are traced.
    fs::create_dir_all(path.join("out/facets.glb/full")).unwrap();
    let (code, _, err) = lampyris_in(path, &["trace", "scene.toml", "-o", "out"]);
    let err = err.replace('\n', " ");
    assert!(code == 1 && err.contains("nothing is lost") && err.contains("facets.glb"), "{code} {err}");
    let rescued = names(path).into_iter().find(|n| n.starts_with("lampyris-rescued-")).unwrap();
    assert_eq!(digest(&path.join(rescued)), digest(&path.join("whole")));
}

/// A limit of the size of files is met as a full disk is: with a message that names the file, not by the signal that the system sends.
#[test]
#[cfg(unix)]
fn a_limit_of_the_size_of_files_does_not_end_a_run() {
    let folder = lens(|s| s);
    let output = Command::new("sh")
        .current_dir(folder.path())
        .args(["-c", "ulimit -f 8; exec \"$0\" trace scene.toml -o out"])
        .arg(assert_cmd::cargo::cargo_bin("lampyris"))
        .output()
        .unwrap();
    let err = String::from_utf8_lossy(&output.stderr).replace('\n', " ");
    assert!(output.status.code() == Some(1) && err.contains("too large") && err.contains("out"), "{output:?}");
}

/// Started where nothing can be written: the sums alone are left, with the facets that an accuracy had come to.
#[test]
#[cfg(target_os = "linux")]
fn the_sums_of_a_run_with_an_accuracy_are_merged() {
    let folder = lens(|s| s);
    let path = folder.path();
    fs::create_dir_all(path.join("out/facets.glb/full")).unwrap();
    let output = Command::new(assert_cmd::cargo::cargo_bin("lampyris"))
        .current_dir("/proc")
        .envs([("HOME", "/proc/none"), ("TMPDIR", "/proc/none")])
        .args(["trace", "--accuracy", "0.2deg", "-o"])
        .args([path.join("out"), path.join("scene.toml")])
        .output()
        .unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && err.contains("lampyris merge"), "{err}");
    let (code, _, err) = lampyris_in(path, &["merge", "out/checkpoint.tally", "-o", "merged"]);
    assert_eq!(code, 0, "{err}");
    assert!(path.join("merged/report.html").is_file());
}

/// Every part of a run would search for its facets anew, for minutes.
#[test]
fn parts_of_a_run_take_no_accuracy() {
    let folder = lens(|s| s);
    for [option, part] in [["--shard", "1/2"], ["--rays", "0..5000"]] {
        let asked = ["trace", "scene.toml", "--accuracy", "1deg", option, part, "-o", "out"];
        let (code, _, err) = lampyris_in(folder.path(), &asked);
        assert!(code == 2 && err.contains("search for its facets again"), "{option}: {code} {err}");
    }
}

#[test]
fn what_an_interrupted_run_saved_is_not_written_over() {
    let folder = lens(|s| s);
    let path = folder.path();
    let (saved, before) = killed_run(path);
    // Before the search for an accuracy too, which says what it reached.
    for asked in [["--rays", "3000000"], ["--rays", "1000"], ["--accuracy", "5deg"]] {
        let (code, _, err) = lampyris_in(path, &[&["trace", "scene.toml", "-o", "out"][..], &asked].concat());
        assert!(code == 2 && err.contains("--resume") && !err.contains("reached"), "{code} {err}");
        assert!(fs::read(&saved).unwrap() == before);
    }
}

/// The number of rays decides no bit of a ray of a run that grows, but a run of other rays cannot go on from what is saved.
#[test]
fn a_saved_run_goes_on_with_its_own_rays_alone() {
    let folder = lens(|s| s);
    let path = folder.path();
    let (saved, before) = killed_run(path);
    let resume = ["trace", "scene.toml", "-o", "out", "--resume", "--json"];
    // Fewer, more, and the scene's own.
    for rays in ["640000", "6e6", "20000"] {
        let (code, _, err) = lampyris_in(path, &[&resume[..], &["--rays", rays]].concat());
        let err = err.replace('\n', " ");
        assert!(code == 2 && err.contains("--rays 3000000 or leave it out"), "{rays}: {code} {err}");
        assert!(!err.contains("tracing") && fs::read(&saved).unwrap() == before, "{rays}: {err}");
    }
    // It is no part of a run that could be merged.
    let (code, _, err) = lampyris_in(path, &["merge", "out", "-o", "merged"]);
    let err = err.replace('\n', " ");
    assert!(code == 3 && err.contains("an interrupted run") && err.contains("-o out --resume"), "{code} {err}");
    let (code, out, err) = lampyris_in(path, &resume);
    assert!(code == 0 && err.contains("going on from"), "{code} {err}");
    let document: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(document["rays"], 3_000_000);
    // The command that is recorded can be typed again for the same rays.
    let command = document["provenance"]["command"].as_str().unwrap();
    assert!(command.contains("--rays 3000000"), "{command}");
}

#[test]
fn a_folder_has_one_owner_at_a_time() {
    let folder = lens(|s| s);
    let path = folder.path();
    let mut child = saving_run(path);
    let (code, _, err) = lampyris_in(path, &["trace", "scene.toml", "-o", "out", "--resume"]);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(code == 1 && err.contains(&format!("process {}", child.id())), "{code} {err}");
}

/// Whether this process, and so every one that it starts, ignores a signal. Where the system does not report it, none is.
#[cfg(unix)]
fn is_ignored(signal: u32) -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|l| l.strip_prefix("SigIgn:"));
    mask.and_then(|m| u64::from_str_radix(m.trim(), 16).ok()).is_some_and(|m| m >> (signal - 1) & 1 == 1)
}

#[test]
#[cfg(unix)]
fn a_signal_saves_the_run_and_the_run_goes_on_to_the_same_bits() {
    let folder = lens(|s| s);
    let path = folder.path();
    for (signal, number) in [("-INT", 2), ("-TERM", 15), ("-HUP", 1)] {
        // Under nohup a run ignores what its starter ignores, and is right to.
        if is_ignored(number) {
            continue;
        }
        let child = saving_run(path);
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let output = child.wait_with_output().unwrap();
        let err = String::from_utf8(output.stderr).unwrap().replace('\n', " ");
        assert_eq!(output.status.code(), Some(1), "{signal}: {err}");
        assert!(err.contains("replicates are saved in") && err.contains("--resume"), "{signal}: {err}");
        assert_eq!(names(&path.join("out")), ["checkpoint.tally"], "{signal}");
        fs::rename(path.join("out"), path.join(signal)).unwrap();
    }
    let whole = [&LONG[..], &["whole", "--threads", "4"]].concat();
    let whole: Vec<&str> = whole.into_iter().filter(|w| !["--threads", "1", "4"].contains(w)).collect();
    assert_eq!(lampyris_in(path, &whole).0, 0);
    let again = [&LONG[..], &["-TERM", "--resume"]].concat();
    let again: Vec<String> = again.iter().map(|w| w.replace("-TERM", "./-TERM")).collect();
    let again: Vec<&str> = again.iter().map(String::as_str).collect();
    let (code, _, err) = lampyris_in(path, &again);
    assert!(code == 0 && err.contains("going on from"), "{code} {err}");
    assert_eq!(digest(&path.join("-TERM")), digest(&path.join("whole")));
}

#[test]
fn a_reader_that_has_gone_away_costs_nothing() {
    let folder = lens(|s| s);
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("lampyris"))
        .current_dir(folder.path())
        .args(["trace", "scene.toml", "-o", "out", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(folder.path().join("out/report.html").is_file());
}

#[test]
#[cfg(target_os = "linux")]
fn a_scene_whose_path_is_no_text_is_traced_in_parts_and_merged() {
    use std::os::unix::ffi::OsStrExt;
    let folder = lens(|s| s);
    let path = folder.path();
    let odd = std::ffi::OsStr::from_bytes(b"sc\xff\xfene.toml");
    fs::copy(path.join("scene.toml"), path.join(odd)).unwrap();
    let run = |arguments: &[&std::ffi::OsStr]| {
        let binary = assert_cmd::cargo::cargo_bin("lampyris");
        Command::new(binary).current_dir(path).args(arguments).output().unwrap()
    };
    for part in ["1/2", "2/2"] {
        let words = ["trace", "--shard", part, "-o", "parts"].map(std::ffi::OsStr::new);
        let output = run(&[&words[..], &[odd]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let (code, _, err) = lampyris_in(path, &["merge", "parts", "-o", "out"]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(lampyris_in(path, &["trace", "scene.toml", "-o", "whole"]).0, 0);
    assert_eq!(digest(&path.join("out")), digest(&path.join("whole")));
}

/// A ball too large for facets: on facets light would pass where it is, and the answer looked like any other.
#[test]
fn faces_that_have_no_facets_make_a_trace_incomplete() {
    let folder = tempfile::tempdir().unwrap();
    let model = part21(
        "#6=SHAPE_REPRESENTATION('',(#900,#901),$);\n#10=CARTESIAN_POINT('',(0.,0.,0.));\n#15=CARTESIAN_POINT('',(4.E6,0.,50.));\n\
         #900=SPHERE('huge',3.E6,#10);\n#901=SPHERE('small',10.,#15);\n",
    );
    fs::write(folder.path().join("model.stp"), model).unwrap();
    let scene = "[[model]]\nfile = \"model.stp\"\n[[source]]\nname = \"lamp\"\nkind = \"point\"\nat = [4e6, 0, 0]\npower = 1\n";
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let run =
        |more: &[&str]| lampyris_in(folder.path(), &[&["trace", "scene.toml", "--rays", "200"], more].concat());
    let (code, _, err) = run(&["--intersector", "octree"]);
    assert!(code == 4 && err.contains("1 of 2 faces has no facets"), "{code} {err}");
    let (code, _, err) = run(&["--intersector", "octree", "--max-refused", "0.5"]);
    assert!(code == 0 && err.contains("1 of 2 faces has no facets"), "{code} {err}");
    // The spline needs none.
    let (code, _, err) = run(&["--intersector", "exact"]);
    assert!(code == 0 && !err.contains("no facets"), "{code} {err}");
}

/// A lamp in an opaque part and a misspelled glass are explained, with what to do, on the terminal and in the report.
#[test]
fn a_source_in_an_opaque_part_and_an_unknown_medium_are_told() {
    let opaque = |scene: String| scene.replace("medium = \"glass\"", "surface = \"mirror\"\nreflectance = 0.9");
    let folder = lens(|scene| opaque(scene).replace("at = [0, 0, -10]", "at = [0, 0, 2]"));
    let (code, _, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out"]);
    assert!(code == 4 && err.contains("as from a source that lies in it"), "{code} {err}");
    assert!(err.contains("give the part a `medium` of index 1"), "{err}");
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("No light came here.") && !page.contains("cuts through the peak"));
    assert!(page.contains("light was lost</strong>") && !page.contains("To halve the statistical errors"));
    let folder = lens(|scene| scene.replace("medium = \"glass\"", "medium = \"D-ZK3\""));
    let (code, _, err) = lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "out"]);
    assert!(code == 2 && err.contains("lampyris media") && err.contains("name = \"D-ZK3\""), "{code} {err}");
}

/// Killed while it saved, a run leaves half a checkpoint, which the next one there removes though it is too short to save anything.
#[test]
fn half_a_checkpoint_of_a_killed_run_is_removed() {
    let folder = lens(|scene| scene);
    fs::create_dir(folder.path().join("out")).unwrap();
    // Without the mark of a machine, as earlier versions wrote them: only the age shows whether its process is gone.
    let [stale, fresh] = [7, 8].map(|process| format!(".checkpoint.tally.{process}-0.part"));
    for (name, age) in [(&stale, 2 * 86_400), (&fresh, 0)] {
        let file = fs::File::create(folder.path().join("out").join(name)).unwrap();
        file.set_modified(std::time::SystemTime::now() - Duration::from_secs(age)).unwrap();
    }
    let options = ["--tolerance", "0.1", "--normals", "bilinear", "--no-report", "-o", "out"];
    let (code, _, err) = lampyris_in(folder.path(), &[&["trace", "scene.toml"][..], &options].concat());
    assert_eq!(code, 0, "{err}");
    let left = names(&folder.path().join("out"));
    assert!(!left.contains(&stale) && left.contains(&fresh), "{left:?}");
}

/// A command that cannot be saved says that it was interrupted, and leaves no lock.
#[cfg(unix)]
#[test]
fn an_interrupted_demo_says_so_and_leaves_no_lock() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["demo", "-o", "out", "--tolerance", "0.5", "--normals", "flat", "--rays", "2e10"];
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("lampyris"))
        .current_dir(folder.path())
        .args(arguments)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let lock = folder.path().join("out/.lampyris.lock");
    let begun = (0..600).any(|_| {
        std::thread::sleep(Duration::from_millis(100));
        lock.exists()
    });
    // Not SIGINT, which stays ignored where whoever runs the tests ignores it.
    let interrupted = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    let ended = (0..600).any(|_| {
        std::thread::sleep(Duration::from_millis(100));
        child.try_wait().unwrap().is_some()
    });
    // One that does not end is not waited for.
    child.kill().unwrap();
    let mut err = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut err).unwrap();
    let status = child.wait().unwrap();
    assert!(begun && interrupted.success() && ended, "{err}");
    assert_eq!(std::os::unix::process::ExitStatusExt::signal(&status), Some(15), "{err}");
    assert!(err.contains("interrupted: what was not saved is lost") && !lock.exists(), "{err}");
}

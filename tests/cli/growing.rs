//! Runs that grow and trees of merges, with the real binary.

use crate::files::fixture;
use crate::runs::without_times;
use crate::support::lampyris_in;
use serde_json::Value;
use std::path::Path;

/// Facets and normals that are asked for, so that no pilot chooses them.
const SETTINGS: [&str; 4] = ["--tolerance", "0.1", "--normals", "bilinear"];

/// A folder with the lens of scene S1 and so many rays.
pub(crate) fn lens(rays: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(fixture("step/lens_planoconvex_nurbs.stp"), folder.path().join("model.stp")).unwrap();
    let scene = std::fs::read_to_string(fixture("scenes/s1_lens.toml")).unwrap();
    let scene = scene.replace("../step/lens_planoconvex_nurbs.stp", "model.stp").replace("1_000_000", rays);
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    folder
}

fn trace(folder: &Path, options: &[&str]) {
    let (code, _, err) =
        lampyris_in(folder, &[&["trace", "scene.toml"], options, &SETTINGS, &["--no-report"]].concat());
    assert_eq!(code, 0, "{options:?}: {err}");
}

fn merge(folder: &Path, parts: &[&str], to: &str) {
    let (code, _, err) = lampyris_in(folder, &[&["merge"], parts, &["-o", to, "--no-report"]].concat());
    assert_eq!(code, 0, "{parts:?}: {err}");
}

/// Every number but times is the same, and every file of a receiver byte for byte.
fn assert_same(folder: &Path, one: &str, other: &str) {
    let document = |name: &str| -> Value {
        let text = std::fs::read_to_string(folder.join(name).join("results.json")).unwrap();
        without_times(serde_json::from_str(&text).unwrap())
    };
    assert_eq!(document(one), document(other), "{other}");
    for file in ["focus.csv", "focus.data3", "paths.vtp"] {
        let read = |name: &str| std::fs::read(folder.join(name).join(file)).unwrap();
        assert!(read(one) == read(other), "{file} of {other}");
    }
}

/// Rays that follow others, traced in parts and merged in a tree or flat, are one run of all of them.
#[test]
fn ranges_of_rays_merge_to_the_bits_of_one_run() {
    let folder = lens("20_000");
    let path = folder.path();
    trace(path, &["--rays", "640000", "-o", "whole"]);
    trace(path, &["--rays", "0..200000", "-o", "parts"]);
    for shard in ["1/2", "2/2"] {
        trace(path, &["--rays", "200000..640000", "--shard", shard, "-o", "parts"]);
    }
    let [first, second, third] = ["", "-shard-1-of-2", "-shard-2-of-2"].map(|shard| {
        let range = if shard.is_empty() { "0-200000" } else { "200000-640000" };
        format!("parts/rays-{range}{shard}.tally")
    });
    merge(path, &["parts"], "flat");
    assert_same(path, "whole", "flat");
    merge(path, &[&third, &first], "some.tally");
    merge(path, &["some.tally", &second], "tree");
    assert_same(path, "whole", "tree");
    // A later range alone is no run; what is missing is named.
    let (code, _, err) = lampyris_in(path, &["merge", &second, &third, "-o", "no"]);
    assert!(code == 3 && err.contains("rays 0..200000"), "{err}");
    let (code, _, err) = lampyris_in(path, &["merge", "some.tally", "-o", "no"]);
    assert!(code == 3 && err.contains("rays 200000..420000"), "{err}");
}

/// A merge takes the spline where its parts chose it, and has no pilot of its own, whose seconds would differ from theirs.
#[test]
fn merge_takes_the_choice_of_its_parts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // Facets miss light at the rim of this reflector, wherever their hits are moved: a run that may grow is not content with them.
    std::fs::copy(fixture("step/reflector_freeform_trimmed.stp"), path.join("model.stp")).unwrap();
    let scene = std::fs::read_to_string(fixture("scenes/s3_reflector.toml")).unwrap();
    std::fs::write(path.join("scene.toml"), scene.replace("../step/reflector_freeform_trimmed.stp", "model.stp"))
        .unwrap();
    for range in ["0..20000", "20000..40000"] {
        let (code, _, err) = lampyris_in(path, &["trace", "scene.toml", "--rays", range, "-o", "parts"]);
        assert_eq!(code, 0, "{err}");
    }
    let refused = |more: &[&str]| {
        let (code, _, err) = lampyris_in(path, &[&["merge", "parts", "-o", "no"], more].concat());
        // Nothing is traced, whatever the parts were traced on.
        assert!(!err.contains("tracing on"), "{err}");
        (code, err.replace('\n', " "))
    };
    let (code, err) = refused(&["--rays", "5"]);
    assert!(code == 2 && err.contains("reach to ray 40000") && err.contains("leave --rays out"), "{code} {err}");
    let other = std::fs::read_to_string(path.join("scene.toml"))
        .unwrap()
        .replace("reflectance = 0.95", "reflectance = 0.9");
    std::fs::write(path.join("other.toml"), other).unwrap();
    let (code, err) = refused(&["--scene", "other.toml"]);
    assert!(
        code == 3 && err.contains("--scene other.toml is not the scene that this part was traced from"),
        "{err}"
    );
    let [once, again] = ["once", "again"].map(|to| {
        merge(path, &["parts"], to);
        let text = std::fs::read_to_string(path.join(to).join("results.json")).unwrap();
        serde_json::from_str::<Value>(&text).unwrap()["chosen"].clone()
    });
    assert_eq!((&once["intersector"], &once), (&"exact".into(), &again));
    assert!(once["pilot_seconds"].as_f64().unwrap() > 0.0);
}

/// A lens in whose light a wall of four cells stands, so that a pilot finds facets good enough.
pub(crate) fn lens_before_a_wall() -> tempfile::TempDir {
    let folder = lens("40_000");
    let scene = std::fs::read_to_string(folder.path().join("scene.toml")).unwrap();
    let wall = "[[receiver]]\nname = 'focus'\nat = [0, 0, 20]\nsize = [60, 60]\ncells = [2, 2]\n";
    let (light, _) = scene.split_once("[[receiver]]").unwrap();
    std::fs::write(folder.path().join("scene.toml"), format!("{light}{wall}")).unwrap();
    folder
}

/// The results that a run left in a folder.
fn results(folder: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("results.json")).unwrap()).unwrap()
}

/// What the pilot found goes with the parts: merged, they answer with both errors as the whole run does, and no pilot is traced again.
#[test]
fn parts_hand_on_what_their_pilot_found() {
    let folder = lens_before_a_wall();
    let path = folder.path();
    let traced = |options: &[&str]| {
        let (code, _, err) = lampyris_in(path, &[&["trace", "scene.toml", "--no-report"], options].concat());
        assert_eq!(code, 0, "{options:?}: {err}");
    };
    traced(&["-o", "whole"]);
    traced(&["--shard", "1/2", "-o", "parts"]);
    traced(&["--shard", "2/2", "-o", "parts"]);
    let [first, second] = [1, 2].map(|k| format!("parts/shard-{k}-of-2.tally"));
    merge(path, &[&first, &second], "merged");
    assert_same(path, "whole", "merged");
    merge(path, &[&second, &first], "again");
    let [merged, again] = ["merged", "again"].map(|name| results(&path.join(name)));
    assert_eq!(merged["chosen"]["intersector"], "octree");
    assert!(merged["faceting"]["rays"].as_u64().unwrap() > 0);
    // Seconds too: there was one pilot, that of the first part.
    for key in ["chosen", "faceting"] {
        assert_eq!(merged[key], again[key], "{key}");
    }
}

/// What merge says is missing, traced and merged again, reaches the error; until then the exit code is 4.
#[test]
fn merged_ranges_grow_until_the_error_is_reached() {
    let folder = lens("20_000");
    let path = folder.path();
    trace(path, &["--rays", "0..5000", "-o", "parts"]);
    let mut rays = 5_000;
    for round in 0.. {
        let arguments =
            ["merge", "parts", "-o", "out", "--until-error", "0.5%@focus:cells", "--no-report", "--json"];
        let (code, out, err) = lampyris_in(path, &arguments);
        let answer: Value = serde_json::from_str(&out).unwrap();
        let written = std::fs::read_to_string(path.join("out/results.json")).unwrap();
        assert_eq!(serde_json::from_str::<Value>(&written).unwrap(), answer, "the file is what --json prints");
        let answer = &answer["until_error"];
        assert_eq!(answer["rays"], rays);
        if answer["reached"] == true {
            assert!(code == 0 && round > 0 && answer["missing_rays"] == 0, "{round}: {code} {err}");
            assert!(answer["found_percent"].as_f64().unwrap() <= 0.5);
            break;
        }
        assert!(code == 4 && round < 6, "{round}: {code} {err}");
        let missing = answer["missing_rays"].as_u64().unwrap();
        assert!(missing > 0 && missing.is_multiple_of(5_000));
        trace(path, &["--rays", &format!("{rays}..{}", rays + missing), "-o", "parts"]);
        rays += missing;
    }
    // Further ranges than there are can be waited for.
    let more = (rays + 5_000).to_string();
    let (code, _, err) = lampyris_in(path, &["merge", "parts", "-o", "no", "--rays", &more, "--wait", "0.1"]);
    assert!(code == 3 && err.contains(&format!("rays {rays}..{more}")), "{err}");
    assert_eq!(lampyris_in(path, &["merge", "parts", "-o", "no", "--rays", "5000"]).0, 2);
}

#[test]
fn ranges_that_do_not_fit_are_refused_with_what_would() {
    let folder = lens("20_000");
    let path = folder.path();
    for (range, says) in [("5..10000", "multiples of 5000"), ("10000..5000", "rise"), ("0..x", "number")] {
        let (code, _, err) = lampyris_in(path, &["trace", "scene.toml", "--rays", range, "-o", "parts"]);
        assert!(code == 2 && err.contains(says), "{range}: {err}");
    }
    trace(path, &["--rays", "0..5000", "-o", "parts"]);
    let finer = ["trace", "scene.toml", "--rays", "5000..10000", "-o", "parts", "--tolerance", "0.05"];
    assert_eq!(lampyris_in(path, &finer).0, 0);
    let (code, _, err) = lampyris_in(path, &["merge", "parts", "-o", "no"]);
    let err = err.replace('\n', " ");
    assert!(code == 3 && err.contains("--tolerance 0.05..0.05") && err.contains("--tolerance 0.1..0.1"), "{err}");
}

/// A part that is there twice is refused, and the files that hold it are named.
#[test]
fn a_part_that_is_there_twice_is_named_with_the_other_one() {
    let folder = lens("20_000");
    let path = folder.path();
    for part in ["first.tally", "again.tally"] {
        trace(path, &["--rays", "0..5000", "-o", part]);
    }
    let (code, _, err) = lampyris_in(path, &["merge", "first.tally", "again.tally", "-o", "no"]);
    assert!(code == 3 && err.contains("again.tally: its replicate 0 is in an earlier part"), "{err}");
    assert!(err.contains("first.tally holds it too: leave one of the two out"), "{err}");
}

/// More parts than replicates: some hold nothing, and together they hold everything once.
#[test]
fn there_may_be_more_parts_than_replicates() {
    in_parts("2_000", 12);
}

/// A scene that its parts name and that cannot be read is refused with what the scene itself is to be mended by, and where else it may be.
#[test]
fn merge_keeps_the_advice_on_a_scene_that_cannot_be_read() {
    let folder = lens("1_000");
    let path = folder.path();
    trace(path, &["-o", "parts", "--shard", "1/2"]);
    let scene = std::fs::read_to_string(path.join("scene.toml")).unwrap();
    std::fs::write(path.join("scene.toml"), scene.replace("title =", "titel =")).unwrap();
    let (code, _, err) = lampyris_in(path, &["merge", "parts", "-o", "out"]);
    assert!(code == 2 && err.contains("'title'") && err.contains("--scene FILE says where it is"), "{code} {err}");
}

/// A thousand processes, merged in one go and by a tree of merges.
#[test]
#[ignore = "starts a thousand processes"]
fn a_thousand_parts_are_one_run() {
    in_parts("20_000", 1000);
}

fn in_parts(rays: &str, count: usize) {
    let folder = lens(rays);
    let path = folder.path();
    let scene = std::fs::read_to_string(path.join("scene.toml")).unwrap();
    std::fs::write(path.join("scene.toml"), scene.replace("[run]", "[run]\nreplicates = 8")).unwrap();
    trace(path, &["-o", "whole"]);
    for k in 1..=count {
        trace(path, &["--shard", &format!("{k}/{count}"), "--threads", "1", "-o", "parts", "-q"]);
    }
    merge(path, &["parts"], "flat");
    assert_same(path, "whole", "flat");
    let files: Vec<String> = (1..=count).map(|k| format!("parts/shard-{k}-of-{count}.tally")).collect();
    let mut sums = Vec::new();
    for (i, group) in files.chunks(count.isqrt()).enumerate() {
        sums.push(format!("sum{i}.tally"));
        merge(path, &group.iter().map(String::as_str).collect::<Vec<_>>(), &sums[i]);
    }
    merge(path, &sums.iter().rev().map(String::as_str).collect::<Vec<_>>(), "tree");
    assert_same(path, "whole", "tree");
}

/// What is written under `.TALLY` is a tally for everybody who looks for one.
#[test]
fn the_case_of_an_extension_does_not_hide_a_part() {
    let folder = lens("20_000");
    let path = folder.path();
    std::fs::create_dir(path.join("parts")).unwrap();
    trace(path, &["--shard", "1/2", "-o", "parts/1.TALLY"]);
    trace(path, &["--shard", "2/2", "-o", "parts/2.Tally"]);
    merge(path, &["parts"], "merged");
    trace(path, &["-o", "whole"]);
    assert_same(path, "whole", "merged");
}

/// A part that is still being copied from elsewhere is waited for, the first of all and a later one; but not without end.
#[test]
fn merge_waits_for_the_end_of_a_part() {
    let folder = lens("20_000");
    let path = folder.path();
    for shard in ["1/2", "2/2"] {
        trace(path, &["--shard", shard, "-o", "parts"]);
    }
    for k in [1, 2] {
        let part = path.join(format!("parts/shard-{k}-of-2.tally"));
        let whole = std::fs::read(&part).unwrap();
        std::fs::write(&part, &whole[..whole.len() / 2]).unwrap();
        let (code, _, err) = lampyris_in(path, &["merge", "parts", "-o", "no", "--wait", "0.1"]);
        assert!(code == 3 && err.contains("cut short"), "{k}: {code} {err}");
        std::thread::scope(|scope| {
            scope.spawn(|| {
                // Long enough for the merge to have found the half.
                std::thread::sleep(std::time::Duration::from_secs(2));
                std::fs::write(&part, &whole).unwrap();
            });
            merge(path, &["parts", "--wait", "120"], &format!("out-{k}"));
        });
    }
}

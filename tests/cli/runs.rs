//! Long runs in pieces, lost rays and ray paths, with the real binary.

use crate::files::fixture;
use crate::support::lampyris_in;
use serde_json::Value;
use std::io::Read;
use std::path::Path;

/// The document that a command prints, which ends with this exit code.
pub(crate) fn document(folder: &Path, arguments: &[&str], code: i32) -> Value {
    let (found, out, err) = lampyris_in(folder, arguments);
    assert_eq!(found, code, "{arguments:?}: {err}");
    serde_json::from_str(&out).unwrap()
}

/// A folder with the lens of scene S1, its model under `model.stp`.
pub(crate) fn lens(change: impl Fn(String) -> String) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let model = std::fs::read_to_string(fixture("step/lens_planoconvex_nurbs.stp")).unwrap();
    std::fs::write(folder.path().join("model.stp"), change(model)).unwrap();
    let scene = std::fs::read_to_string(fixture("scenes/s1_lens.toml")).unwrap();
    let scene = scene.replace("../step/lens_planoconvex_nurbs.stp", "model.stp").replace("1_000_000", "20_000");
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    folder
}

/// The model with an open shell in place of its closed one, without the first face.
fn opened(model: String) -> String {
    let at = model.find("CLOSED_SHELL(").unwrap();
    let list = at + model[at..].find('#').unwrap();
    let rest = list + model[list..].find(',').unwrap() + 1;
    model[..list].to_owned() + &model[rest..]
}

/// Traces the rays of a ledger's rows again, which end as these say.
fn assert_lost_again(folder: &Path, rows: &[Vec<&str>]) {
    let again =
        document(folder, &["trace", "scene.toml", "-o", "again", "--replay", "out/lost_rays.csv", "--json"], 0);
    let rays = again["rays"].as_array().unwrap();
    assert_eq!(rays.len(), rows.len());
    for (row, ray) in rows.iter().zip(rays) {
        assert_eq!(ray["ray"].as_u64(), row[0].parse().ok());
        let end = &ray["lost"][0];
        assert_eq!(end["cause"].as_str(), Some(row[3]));
        for k in 0..3 {
            // The reader of JSON rounds the last bit in its own way.
            let same = |a: &Value, b: &str| {
                let (a, b) = (a.as_f64().unwrap(), b.parse::<f64>().unwrap());
                (a - b).abs() <= 4.0 * f64::EPSILON * b.abs()
            };
            assert!(same(&end["origin"][k], row[5 + k]) && same(&end["direction"][k], row[8 + k]));
        }
        let vertices = ray["vertices"].as_array().unwrap();
        assert_eq!(
            (vertices[0]["event"].as_str(), vertices.last().unwrap()["event"].as_str()),
            (Some("emitted"), Some("lost"))
        );
    }
}

/// A lens without one of its faces loses the light that misses the face; each lost ray is in the ledger and ends the same way
/// when it is traced again.
#[test]
fn lost_rays_are_written_down_and_can_be_traced_again() {
    let folder = lens(opened);
    let arguments = ["trace", "scene.toml", "-o", "out", "--json", "--max-refused", "1"];
    let (code, out, err) = lampyris_in(folder.path(), &arguments);
    assert_eq!(code, 4, "{err}");
    let found: Value = serde_json::from_str(&out).unwrap();
    let lost = found["lost_rays"].as_u64().unwrap();
    // More than the ledger keeps, which must not be said to have all.
    assert!(lost > 1000 && err.contains("lost_rays.csv lists the first 1000 of them"), "{lost} {err}");
    assert!(lost > 0 && found["power"]["lost"].as_f64().unwrap() > 0.0);
    assert_eq!(found["ledger"], "lost_rays.csv");
    let ledger = std::fs::read_to_string(folder.path().join("out/lost_rays.csv")).unwrap();
    let rows: Vec<Vec<&str>> = ledger.lines().skip(1).map(|l| l.split(',').collect()).collect();
    assert_eq!(rows.len() as u64, lost.min(1000));
    assert!(ledger.starts_with("ray,branch,bounce,cause,power,x_mm,"));
    assert_lost_again(folder.path(), &rows);
    assert!(folder.path().join("again/replay.vtp").is_file());
    let (code, out, err) =
        lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "again", "--replay", rows[0][0]]);
    // Light that comes in by the opening meets a face from inside, in a medium that it never entered.
    assert_eq!(rows[0][3], "impossible_medium");
    assert!(code == 0 && out.contains("lost: impossible medium"), "{out}{err}");
    for (wrong, code, says) in
        [("99999999", 2, "20000 rays"), ("gone.csv", 3, "gone.csv"), ("scene.toml", 3, "not a ledger")]
    {
        let (found, _, err) =
            lampyris_in(folder.path(), &["trace", "scene.toml", "-o", "again", "--replay", wrong]);
        assert!(found == code && err.contains(says), "{wrong}: {found} {err}");
    }
}

/// Ranges are divided into replicates of 5000 rays, which a run of 20,000 by itself is not.
#[test]
fn rays_lost_in_merged_ranges_can_be_traced_again() {
    let folder = lens(opened);
    for rays in ["0..10000", "10000..20000"] {
        let part = ["trace", "scene.toml", "--rays", rays, "-o", "parts", "--max-refused", "1"];
        let (code, _, err) = lampyris_in(folder.path(), &part);
        assert!(code == 4 && err.contains("of the energy of this part was lost"), "{code} {err}");
    }
    let (code, _, err) = lampyris_in(folder.path(), &["merge", "parts", "-o", "out", "--no-report"]);
    // The whole run reports that light was lost.
    assert_eq!(code, 4, "{err}");
    let ledger = std::fs::read_to_string(folder.path().join("out/lost_rays.csv")).unwrap();
    let rows: Vec<Vec<&str>> = ledger.lines().skip(1).map(|l| l.split(',').collect()).collect();
    assert!(!rows.is_empty(), "{ledger}");
    assert_lost_again(folder.path(), &rows);
}

/// A document without the keys that differ from run to run.
pub(crate) fn without_times(mut document: Value) -> Value {
    match &mut document {
        Value::Object(map) => {
            for key in [
                "seconds",
                "mrays_per_s",
                "msegments_per_s",
                "threads",
                "provenance",
                "pilot_seconds",
                "halving",
                "cost",
            ] {
                map.remove(key);
            }
            map.values_mut().for_each(|value| *value = without_times(value.take()));
        }
        Value::Array(list) => list.iter_mut().for_each(|value| *value = without_times(value.take())),
        _ => {}
    }
    document
}

/// Parts of a run, merged in any order, are the single run, file by file.
#[test]
fn shards_merge_to_the_bits_of_one_run() {
    let folder = lens(|m| m);
    let path = folder.path();
    let whole = document(path, &["trace", "scene.toml", "-o", "whole", "--json"], 0);
    for k in ["1/3", "2/3", "3/3"] {
        let file = format!("part{}.tally", &k[..1]);
        let part =
            document(path, &["trace", "scene.toml", "--shard", k, "-o", &file, "--json", "--threads", "1"], 0);
        assert_eq!(part["of"], 128);
    }
    let merged =
        document(path, &["merge", "part3.tally", "part1.tally", "part2.tally", "-o", "merged", "--json"], 0);
    assert_eq!(whole["digest"], merged["digest"]);
    assert_eq!(whole["power"], merged["power"]);
    // The merge alone does not show how to reproduce the numbers.
    let traced_by = &merged["provenance"]["traced_by"];
    let shards: Vec<&str> = traced_by.as_array().unwrap().iter().map(|command| command.as_str().unwrap()).collect();
    let is_of_shard =
        |(k, command): (u32, &&str)| command.contains(&format!("lampyris trace scene.toml --shard {k}/3"));
    assert!(shards.len() == 3 && (1..).zip(&shards).all(is_of_shard), "{traced_by}");
    let page = std::fs::read_to_string(path.join("merged/report.html")).unwrap();
    assert!(page.contains("lampyris trace scene.toml --shard 2/3"));
    assert!(whole["provenance"]["traced_by"].is_null());
    // Three processes of one machine, each on one thread.
    let took = &merged["seconds"]["merged"];
    let numbers = [&took["parts"], &took["machines"], &took["threads"], &merged["threads"]];
    assert_eq!(numbers.map(Value::as_u64), [3, 1, 1, 1].map(Some), "{took}");
    assert!(took["slowest"].as_f64().unwrap() > 0.0 && took["cpu"].as_f64().is_none_or(|cpu| cpu > 0.0));
    assert_eq!(merged["check"]["octree_vs_bvh"]["disagree"], 0);
    // Every number of the document but times and what made it: cross-check and figures of both errors too.
    let timeless = |document: &Value| without_times(document.clone());
    assert_eq!(timeless(&whole), timeless(&merged));
    for file in ["focus.csv", "focus.data3", "paths.vtp"] {
        let read = |folder: &str| std::fs::read(path.join(folder).join(file)).unwrap();
        assert!(read("whole") == read("merged"), "{file}");
    }
    // A sum of parts, and one that would replace a part.
    let sum = document(path, &["merge", "part1.tally", "part2.tally", "-o", "sum.tally", "--json"], 0);
    assert_eq!((sum["of"].as_u64(), sum["file"].as_str()), (Some(128), Some("sum.tally")), "{sum}");
    assert!((80..90).contains(&sum["replicates"].as_u64().unwrap()), "two thirds: {sum}");
    let tree = document(path, &["merge", "sum.tally", "part3.tally", "-o", "tree", "--json", "--no-report"], 0);
    assert_eq!(tree["provenance"]["traced_by"], *traced_by);
    let before = std::fs::read(path.join("part1.tally")).unwrap();
    let (code, _, err) = lampyris_in(path, &["merge", "part1.tally", "part2.tally", "-o", "part1.tally"]);
    assert!(code == 2 && err.contains("it would replace") && err.contains("which is read"), "{code} {err}");
    assert!(std::fs::read(path.join("part1.tally")).unwrap() == before);
    // A part too few, one twice, one of another run, a damaged one.
    let other = ["trace", "scene.toml", "--shard", "2/3", "-o", "other.tally", "--seed", "9"];
    assert_eq!(lampyris_in(path, &other).0, 0);
    let mut torn = std::fs::read(path.join("part2.tally")).unwrap();
    torn.pop();
    std::fs::write(path.join("torn.tally"), &torn).unwrap();
    torn[200] ^= 1;
    std::fs::write(path.join("bent.tally"), &torn).unwrap();
    for (second, says) in [
        ("part3.tally", "shard 2/3"),
        ("part1.tally", "in an earlier part already"),
        ("other.tally", "another run"),
        ("torn.tally", "checksum"),
        ("bent.tally", "checksum"),
        ("model.stp", "not a tally file"),
        ("gone.tally", "gone.tally"),
    ] {
        let (code, _, err) = lampyris_in(path, &["merge", "part1.tally", second, "-o", "no"]);
        assert!(code == 3 && err.replace("\n", " ").contains(says), "{second}: {code} {err}");
        assert!(!path.join("no").exists());
    }
    for wrong in ["0/3", "4/3", "x"] {
        assert_eq!(lampyris_in(path, &["trace", "scene.toml", "--shard", wrong]).0, 2, "{wrong}");
    }
}

/// A file holds one shard: another is refused there, to be continued or not, and the file keeps its contents.
#[test]
fn a_shard_does_not_go_into_the_file_of_another() {
    let folder = lens(|m| m);
    let path = folder.path();
    let trace = |shard: &str, more: &[&str]| {
        lampyris_in(path, &[&["trace", "scene.toml", "-o", "part.tally", "--shard", shard][..], more].concat())
    };
    assert_eq!(trace("2/3", &[]).0, 0);
    let before = std::fs::read(path.join("part.tally")).unwrap();
    let ways: [&[&str]; 2] = [&[], &["--resume"]];
    for more in ways {
        let (code, _, err) = trace("3/3", more);
        let err = err.replace('\n', " ");
        assert!(code == 2 && err.contains("it holds shard 2/3 of this run, finished"), "{more:?}: {code} {err}");
        assert!(std::fs::read(path.join("part.tally")).unwrap() == before, "{more:?}");
    }
    let (code, _, err) = trace("2/3", &[]);
    assert!(code == 0 && err.contains("traced already"), "{code} {err}");
}

/// A run that is killed goes on from where it was saved, to the bits of one that was not.
#[test]
fn a_killed_run_resumes_to_the_same_bits() {
    let folder = lens(|m| m);
    let path = folder.path();
    let whole = document(path, &["trace", "scene.toml", "--rays", "200000", "-o", "whole", "--json"], 0);
    let options = ["trace", "scene.toml", "--rays", "200000", "-o", "out", "--threads", "1", "--checkpoint", "0"];
    let binary = assert_cmd::cargo::cargo_bin("lampyris");
    let mut child = std::process::Command::new(binary).current_dir(path).args(options).spawn().unwrap();
    let saved = path.join("out/checkpoint.tally");
    for _ in 0..2000 {
        if saved.is_file() || child.try_wait().unwrap().is_some() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(saved.is_file() && !path.join("out/results.json").exists(), "it was killed on the way");
    let (code, _, err) = lampyris_in(path, &["trace", "scene.toml", "--rays", "100000", "-o", "out", "--resume"]);
    assert!(code == 2 && err.contains("another run"), "{err}");
    let (code, out, err) =
        lampyris_in(path, &["trace", "scene.toml", "--rays", "200000", "-o", "out", "--resume", "--json"]);
    assert!(code == 0 && err.contains("going on from"), "{err}");
    let resumed: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&whole["digest"], &whole["power"]), (&resumed["digest"], &resumed["power"]));
    assert!(!saved.exists());
}

/// A search for a number of rays that is killed continues the run that it was at, to the same bits as one that was not.
#[test]
fn a_killed_search_resumes_to_the_same_bits() {
    let folder = lens(|m| m);
    let path = folder.path();
    let search = ["trace", "scene.toml", "--until-error", "0.0001%@focus", "--rays", "600000", "--json", "-o"];
    let whole = document(path, &[&search[..], &["whole"]].concat(), 4);
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("lampyris"))
        .current_dir(path)
        .args(search)
        .args(["out", "--threads", "1", "--checkpoint", "0"])
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let saved = path.join("out/checkpoint.tally");
    for _ in 0..2000 {
        if saved.is_file() || child.try_wait().unwrap().is_some() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    // Into the second run, which follows the 50,000 rays of the first.
    std::thread::sleep(std::time::Duration::from_millis(200));
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(saved.is_file() && !path.join("out/results.json").exists(), "it was killed on the way");
    let (code, out, err) = lampyris_in(path, &[&search[..], &["out", "--resume"]].concat());
    assert!(code == 4 && err.contains("going on from"), "{code} {err}");
    let resumed: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&whole["digest"], &whole["power"]), (&resumed["digest"], &resumed["power"]));
    assert_eq!(whole["until_error"], resumed["until_error"]);
    // Whichever of its runs the search was at, it is the one that was asked for first.
    let first = format!("lampyris {} out --threads 1 --checkpoint 0", search.join(" "));
    assert_eq!(resumed["provenance"]["command"], first.as_str());
    assert!(!saved.exists());
}

#[test]
fn a_run_goes_on_until_its_error_is_small_enough() {
    let folder = lens(|m| m);
    let path = folder.path();
    let found = document(path, &["trace", "scene.toml", "-o", "out", "--until-error", "0.05%@focus", "--json"], 0);
    let answer = &found["until_error"];
    assert_eq!(answer["reached"], true);
    let written = std::fs::read_to_string(path.join("out/results.json")).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&written).unwrap(), found, "the file is what --json prints");
    let (power, error) = (&found["receivers"][0]["power"], &found["receivers"][0]["power_error"]);
    assert!(error.as_f64().unwrap() <= 0.0005 * power.as_f64().unwrap());
    // The very run with so many rays, on the spline: what may grow is not content with hits that are moved there.
    assert_eq!(found["chosen"]["intersector"], "exact");
    let rays = answer["rays"].to_string();
    let run = ["trace", "scene.toml", "-o", "same", "--rays", &rays, "--intersector", "exact", "--json"];
    let same = document(path, &run, 0);
    assert_eq!(same["digest"], found["digest"]);
    let stopped =
        ["trace", "scene.toml", "-o", "out", "--until-error", "0.0001%@focus", "--rays", "5000", "--json"];
    assert_eq!(document(path, &stopped, 4)["until_error"]["reached"], false);
    let (code, _, err) = lampyris_in(path, &["trace", "scene.toml", "--until-error", "1%@fokus"]);
    assert!(code == 2 && err.contains("fokus") && err.contains("focus"), "{err}");
}

/// An array of an NPZ file, by an independent reader.
fn array<T: npyz::Deserialize>(path: &Path, name: &str) -> Vec<T> {
    let mut zip = zip::ZipArchive::new(std::fs::File::open(path).unwrap()).unwrap();
    let mut bytes = Vec::new();
    zip.by_name(&format!("{name}.npy")).unwrap().read_to_end(&mut bytes).unwrap();
    npyz::NpyFile::new(&bytes[..]).unwrap().into_vec().unwrap()
}

/// Every path is in the file: one start a ray, as many hits as segments, and the power of the ends is that of the results.
#[test]
fn all_ray_paths_are_streamed() {
    let folder = lens(|m| m);
    let path = folder.path();
    let found = document(path, &["trace", "scene.toml", "-o", "out", "--paths", "paths.npz", "--json"], 0);
    let file = path.join("paths.npz");
    let (rays, events) = (array::<u64>(&file, "ray"), array::<u8>(&file, "event"));
    let (points, power) = (array::<f64>(&file, "point"), array::<f64>(&file, "power"));
    assert_eq!((events.len(), points.len(), power.len()), (rays.len(), 3 * rays.len(), rays.len()));
    let of = |event: u8| (0..rays.len()).filter(|&k| events[k] == event).collect::<Vec<_>>();
    let starts = of(0);
    assert_eq!(starts.len(), 20_000);
    let mut seen: Vec<u64> = starts.iter().map(|&k| rays[k]).collect();
    seen.sort_unstable();
    assert!(seen.iter().enumerate().all(|(i, r)| i as u64 == *r), "every ray starts once");
    assert_eq!(found["segments"].as_u64(), Some((rays.len() - starts.len()) as u64));
    let received: f64 = of(6).iter().map(|&k| power[k]).sum::<f64>() / 20_000.0;
    assert!((received - found["power"]["received"].as_f64().unwrap()).abs() < 1e-12);
    for k in of(6) {
        assert!((points[3 * k + 2] - 107.026853).abs() < 1e-9, "light is received on the plane");
    }
    // The sample for pictures is as large as ever, and so are the results.
    let without = document(path, &["trace", "scene.toml", "-o", "without", "--json"], 0);
    assert_eq!(found["digest"], without["digest"]);
    let size = |folder: &str| std::fs::metadata(path.join(folder).join("paths.vtp")).unwrap().len();
    assert_eq!(size("out"), size("without"));
    let (code, _, err) = lampyris_in(path, &["trace", "scene.toml", "--paths", "paths.parquet"]);
    assert!(code == 2 && err.contains(".npz"), "{err}");
}

/// Light that is lost and faces that are refused are the merged run's as well as the single one's; parts are found in their
/// folder, waited for, and merged with the scene at another place.
#[test]
fn merged_parts_end_as_the_single_run_does() {
    let folder = lens(opened);
    let path = folder.path();
    for part in ["1/2", "2/2"] {
        let arguments = ["trace", "scene.toml", "--shard", part, "-o", "parts", "--max-refused", "1"];
        assert_eq!(lampyris_in(path, &[&arguments[..], &["--max-lost", "1"]].concat()).0, 0);
    }
    let (code, _, err) = lampyris_in(path, &["merge", "parts", "-o", "out", "--max-refused", "1"]);
    assert!(code == 4 && err.contains("of the energy was lost"), "{code} {err}");
    // Quiet or not: an exit code alone does not say what is wrong.
    let (code, _, err) = lampyris_in(path, &["merge", "parts", "-o", "out", "--max-refused", "1", "-q"]);
    assert!(code == 4 && err.contains("of the energy was lost") && err.lines().count() == 1, "{code} {err}");
    assert_eq!(lampyris_in(path, &["merge", "parts", "-o", "out", "--max-refused", "1", "--max-lost", "1"]).0, 0);
    std::fs::create_dir(path.join("moved")).unwrap();
    for file in ["scene.toml", "model.stp"] {
        std::fs::rename(path.join(file), path.join("moved").join(file)).unwrap();
    }
    let (code, _, err) = lampyris_in(path, &["merge", "parts", "-o", "out"]);
    assert!(code == 3 && err.contains("--scene"), "{code} {err}");
    let elsewhere = ["merge", "parts", "-o", "out", "--scene", "moved/scene.toml"];
    assert_eq!(lampyris_in(path, &[&elsewhere[..], &["--max-refused", "1", "--max-lost", "1"]].concat()).0, 0);
    // A missing part is waited for as long as requested.
    std::fs::rename(path.join("parts/shard-2-of-2.tally"), path.join("late")).unwrap();
    let start = std::time::Instant::now();
    let (code, _, err) = lampyris_in(path, &[&elsewhere[..], &["--wait", "1"]].concat());
    assert!(code == 3 && err.contains("shard 2/2"), "{code} {err}");
    assert!(start.elapsed() >= std::time::Duration::from_secs(1));
    // So is one that is named, and comes while it is waited for.
    let named = ["merge", "parts/shard-1-of-2.tally", "parts/shard-2-of-2.tally", "-o", "out", "--wait", "60"];
    let rest = ["--scene", "moved/scene.toml", "--max-refused", "1", "--max-lost", "1"];
    let (code, err) = std::thread::scope(|scope| {
        let merge = scope.spawn(|| lampyris_in(path, &[&named[..], &rest].concat()));
        std::thread::sleep(std::time::Duration::from_millis(300));
        std::fs::rename(path.join("late"), path.join("parts/shard-2-of-2.tally")).unwrap();
        let (code, _, err) = merge.join().unwrap();
        (code, err)
    });
    assert_eq!(code, 0, "{err}");
}

/// What a part cannot do is refused, and not dropped; a launcher says which part a process is.
#[test]
fn parts_refuse_what_they_do_not_do() {
    let folder = lens(|m| m);
    let path = folder.path();
    for option in [&["--paths", "p.npz"][..], &["--verify-pruning"], &["--until-error", "1%@focus"]] {
        let (code, _, err) =
            lampyris_in(path, &[&["trace", "scene.toml", "--shard", "1/2", "-o", "a.tally"], option].concat());
        assert!(code == 2 && err.contains("cannot be used with"), "{option:?}: {code} {err}");
    }
    let (code, _, err) = lampyris_in(path, &["trace", "scene.toml", "--shard", "auto", "-o", "parts"]);
    assert!(code == 2 && err.contains("no launcher"), "{code} {err}");
    let output = std::process::Command::new(assert_cmd::cargo::cargo_bin("lampyris"))
        .current_dir(path)
        .args(["trace", "scene.toml", "--shard", "auto", "-o", "parts"])
        .envs([("PMI_RANK", "1"), ("PMI_SIZE", "3")])
        .output()
        .unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && err.contains("shard 2 of 3, from PMI_RANK"), "{err}");
    assert!(path.join("parts/shard-2-of-3.tally").is_file());
    // Once more is nothing to do.
    let (code, _, err) = lampyris_in(path, &["trace", "scene.toml", "--shard", "2/3", "-o", "parts"]);
    assert!(code == 0 && err.contains("traced already"), "{code} {err}");
}

/// A run that ends before it reaches its error target says so on the terminal.
#[test]
fn an_error_that_is_not_reached_is_said() {
    let folder = lens(|m| m);
    let arguments = ["trace", "scene.toml", "-o", "out", "--until-error", "0.0001%@focus", "--rays", "60000"];
    let (code, _, err) = lampyris_in(folder.path(), &arguments);
    assert!(code == 4 && err.replace('\n', " ").contains("not reached with"), "{code} {err}");
    let (code, _, err) = lampyris_in(folder.path(), &[&arguments[..], &["-q"]].concat());
    assert!(code == 4 && err.contains("not reached with"), "{code} {err}");
}

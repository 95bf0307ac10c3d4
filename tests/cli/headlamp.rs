//! A low beam from its STEP file to the verdict of a regulation, in one command.

use crate::files::fixture;
use crate::support::{lampyris, lampyris_in};
use serde_json::Value;
use std::fs;

/// The scene of the fixture with other lines, in a folder of its own.
fn low_beam(change: impl Fn(&str) -> String) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(fixture("headlamp/low_beam.stp"), folder.path().join("low_beam.stp")).unwrap();
    let scene = fs::read_to_string(fixture("headlamp/low_beam.toml")).unwrap();
    fs::write(folder.path().join("low_beam.toml"), change(&scene)).unwrap();
    folder
}

fn verdict(found: &Value) -> &str {
    found["regulations"][0]["verdict"].as_str().unwrap()
}

/// The model is what its program writes.
#[test]
fn the_model_is_made_again_byte_for_byte() {
    let folder = tempfile::tempdir().unwrap();
    let made = folder.path().join("low_beam.stp");
    let program = fixture("headlamp/make_low_beam.py");
    // Without Python there is nothing to compare.
    let Ok(status) = std::process::Command::new("python3").arg(program).arg(&made).status() else { return };
    assert!(status.success());
    assert!(fs::read(made).unwrap() == fs::read(fixture("headlamp/low_beam.stp")).unwrap());
}

#[test]
fn a_low_beam_goes_from_step_to_verdict() {
    let folder = low_beam(str::to_owned);
    let (code, out, err) = lampyris_in(folder.path(), &["trace", "low_beam.toml", "-o", "out", "--json"]);
    assert_eq!(code, 0, "{err}");
    let found: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(verdict(&found), "pass", "{}", found["regulations"][0]);
    let rows = found["regulations"][0]["rows"].as_array().unwrap();
    let value = |id: &str| rows.iter().find(|r| r["id"] == id).unwrap()["value"].as_f64().unwrap();
    // 17 kcd in the hot spot: 90 lm over 8.58 mm² into a cone of 20° (0.379 sr) through 707 mm² of a lens that passes 92 %.
    let expected = 90.0 / 8.58 / 0.379 * 707.0 * 0.92;
    assert!((value("50R") / expected - 1.0).abs() < 0.15, "{} {expected}", value("50R"));
    // The same by assess, from the files alone.
    let arguments = ["assess", "out", "--regulation", "UN R112 B passing", "--json"];
    let (code, out, err) = lampyris_in(folder.path(), &arguments);
    assert_eq!(code, 0, "{err}");
    let again: Value = serde_json::from_str(&out).unwrap();
    for (a, b) in rows.iter().zip(again["rows"].as_array().unwrap()) {
        assert_eq!((&a["id"], &a["verdict"]), (&b["id"], &b["verdict"]));
    }
    assert_eq!(again["aim"], found["regulations"][0]["aim"]);
    // By default by the regulation that the scene names.
    let (code, by_default, err) = lampyris_in(folder.path(), &["assess", "out", "--json"]);
    assert!(code == 0 && by_default == out, "{code} {err}");
    // The report shows the verdict, the pictures of the trade and their words.
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    for word in [
        "Verdict by UN R112 B passing",
        "test points over isocandela lines",
        "The road from above",
        "as the driver sees it",
        "Imax",
        "cut-off",
        "G = ",
        "HV",
        "50R",
        "Zone III",
        "efficiency",
        "width at half",
    ] {
        assert!(page.contains(word), "{word}");
    }
    for picture in ["road-points.png", "road-road.png", "road-driver.png"] {
        assert!(folder.path().join("out/figures").join(picture).is_file(), "{picture}");
    }
}

#[test]
fn a_regulation_that_means_nothing_is_refused_before_tracing() {
    for (from, to, says) in [
        ("\"UN R112 B passing\"", "\"UN R999\"", "no regulation is called"),
        ("\"UN R112 B passing\"", "\"UN R112 B pasing\"", "did you mean 'UN R112 B passing'?"),
        ("\"UN R112 B passing\"", "\"UN R122 B passing\"", "did you mean 'UN R112 B passing'?"),
        ("cells = [210, 105]", "cells = [50, 25]", "0.149"),
        ("kind = \"far_field\"", "kind = \"far_field\"\nangles = \"B\"", "far field over H and V"),
        ("unit = \"lm\"", "unit = \"W\"", "counts watts"),
    ] {
        let folder = low_beam(|scene| scene.replace(from, to));
        let (code, _, err) = lampyris_in(folder.path(), &["trace", "low_beam.toml", "--dry-run"]);
        assert!(code == 2 && err.contains(says), "{to}: {code} {err}");
    }
}

/// A photometer of 65 mm at 25 m sees 0.149°: 21° and 10.5° in cells of at most that are 141 and 71.
#[test]
fn cells_that_are_too_coarse_are_refused_with_those_that_are_enough() {
    let coarse = low_beam(|scene| scene.replace("cells = [210, 105]", "cells = [60, 30]"));
    let (code, _, err) = lampyris_in(coarse.path(), &["trace", "low_beam.toml", "-o", "out"]);
    assert!(code != 0 && err.contains("`cells = [141, 71]`"), "{err}");
    let fine = low_beam(|scene| scene.replace("cells = [210, 105]", "cells = [141, 71]"));
    let (code, _, err) = lampyris_in(fine.path(), &["trace", "low_beam.toml", "-o", "out", "--dry-run"]);
    assert_eq!(code, 0, "{err}");
}

#[test]
fn until_settled_traces_on_or_says_what_it_cannot() {
    // Numbers of rays of their own cannot grow.
    let folder = low_beam(str::to_owned);
    let (code, _, err) = lampyris_in(folder.path(), &["trace", "low_beam.toml", "--until-settled"]);
    assert!(code == 2 && err.contains("does not grow"), "{err}");
    let grown = |most: &str| {
        let folder =
            low_beam(|scene| scene.lines().filter(|l| !l.starts_with("rays")).map(|l| format!("{l}\n")).collect());
        let arguments = [
            "trace",
            "low_beam.toml",
            "--until-settled",
            "--rays",
            most,
            "--json",
            "--no-report",
            "--intersector",
            "exact",
        ];
        let (code, out, err) = lampyris_in(folder.path(), &arguments);
        (code, serde_json::from_str::<Value>(&out).unwrap(), err)
    };
    let (code, found, err) = grown("30_000");
    let rows = found["regulations"][0]["rows"].as_array().unwrap();
    assert!(code == 4 && rows.iter().any(|row| row["verdict"] == "unsure"), "{err}");
    assert!(err.contains("Not settled") && err.contains("unsure at the most rays"), "{err}");
    assert_eq!(found["rays"], 30_000);
}

/// The field of visibility goes on to 45°, the far field to 30°: no rays show what is beyond, and none are traced for it.
#[test]
fn what_no_rays_settle_is_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "[run]\nunit = 'lm'\n[[source]]\nkind = 'cosine'\nexponent = 40\npower = 18\ndirection = [0, 0, 1]\n\
        [[receiver]]\nname = 'far'\nkind = 'far_field'\nh_deg = [-30, 30]\nv_deg = [-30, 30]\ncells = [60, 60]\n\
        [[regulation]]\nid = 'UN R148-01 rear-position-R1'\n";
    std::fs::write(folder.path().join("lamp.toml"), scene).unwrap();
    let arguments = ["trace", "lamp.toml", "--until-settled", "--rays", "4_000_000", "--json", "--no-report"];
    let (code, out, err) = lampyris_in(folder.path(), &arguments);
    assert!(code == 4 && err.contains("beyond the far field") && !err.contains("most rays"), "{err}");
    let (code, out_of_quiet, why) =
        lampyris_in(folder.path(), &["trace", "lamp.toml", "--until-settled", "-q", "-o", "quiet"]);
    assert!(code == 4 && out_of_quiet.is_empty() && why.starts_with("Not settled: "), "{out_of_quiet}{why}");
    let found: Value = serde_json::from_str(&out).unwrap();
    let rows = found["regulations"][0]["rows"].as_array().unwrap();
    assert!(rows.iter().any(|row| row["verdict"] == "unsure" && row["unseen"].as_u64() > Some(0)), "{rows:?}");
    assert!(found["rays"].as_u64().unwrap() < 4_000_000, "{} {err}", found["rays"]);
}

/// A number of rays that changes nothing is refused, and one that changes some of the sources alone is reported.
#[test]
fn rays_that_sources_do_not_heed_are_not_asked_for_in_silence() {
    let run = |folder: &tempfile::TempDir| {
        let (code, _, err) = lampyris_in(folder.path(), &["trace", "low_beam.toml", "--rays", "1000", "--dry-run"]);
        (code, err.replace('\n', " "))
    };
    let (code, err) = run(&low_beam(str::to_owned));
    assert!(
        code == 2 && err.contains("--rays 1000: every source of the scene has `rays` of its own"),
        "{code} {err}"
    );
    let (code, err) = run(&low_beam(|scene| scene.replace("rays = 3_600_000\n", "")));
    assert!(code == 0 && err.contains("3 of 4 sources have `rays` of their own"), "{code} {err}");
}

/// The tolerance of a run stands in one place, whoever chose it.
#[test]
fn results_name_the_tolerance() {
    let folder =
        low_beam(|scene| scene.lines().filter(|l| !l.starts_with("rays")).map(|l| format!("{l}\n")).collect());
    for (option, expected) in [
        (&["--tolerance", "0.01..0.02"][..], serde_json::json!([0.01, 0.02])),
        (&["--intersector", "exact"][..], Value::Null),
    ] {
        let arguments =
            [&["trace", "low_beam.toml", "--rays", "2000", "--json", "--no-report"][..], option].concat();
        let (code, out, err) = lampyris_in(folder.path(), &arguments);
        assert_eq!(code, 0, "{err}");
        let found: Value = serde_json::from_str(&out).unwrap();
        assert_eq!(found["tolerance_mm"], expected);
    }
}

/// A run that misses the error it was asked for says so first, not last.
#[test]
fn a_missed_error_stands_before_the_answer() {
    let scene = fixture("scenes/s3_reflector.toml").display().to_string();
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out").display().to_string();
    let arguments =
        ["trace", &scene, "--until-error", "0.5%@wall:cells", "--rays", "20_000", "-o", &output, "--no-report"];
    let (code, _, err) = lampyris(&arguments);
    assert_eq!(code, 4, "{err}");
    let answer = err.find("emitted,").unwrap();
    assert!(err[..answer].rfind("not reached").is_some(), "{err}");
}

/// A run that is stopped while it looks for its number of rays is saved as any other, and goes on with the number it had come to.
#[test]
#[cfg(unix)]
fn a_signal_saves_a_run_that_is_traced_until_it_is_settled() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};
    let folder =
        low_beam(|scene| scene.lines().filter(|l| !l.starts_with("rays")).map(|l| format!("{l}\n")).collect());
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("lampyris"))
        .current_dir(folder.path())
        .args(["trace", "low_beam.toml", "--until-settled", "--tolerance", "0.2", "--threads", "1", "-o", "out"])
        .env("COLUMNS", "200")
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    let longer = said.find(|line| line.contains("going on with"));
    assert!(longer.is_some());
    // Until its rays are on their way, which the command does not say, a signal would end it at once.
    std::thread::sleep(std::time::Duration::from_millis(500));
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    let said: String = said.collect::<Vec<_>>().join(" ");
    assert_eq!(child.wait().unwrap().code(), Some(1), "{said}");
    assert!(said.contains("replicates are saved in") && said.contains("the same command with --resume"), "{said}");
    assert!(folder.path().join("out/checkpoint.tally").is_file());
}

/// Facets are compared with the spline up to 2²² cells: beyond that nothing is known of what they change, and the results say so.
#[test]
fn a_far_field_of_millions_of_cells_has_results_and_no_sure_verdict() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::copy(fixture("step/lens_planoconvex_nurbs.stp"), path.join("model.stp")).unwrap();
    let scene = "[run]\nrays = 1000\nunit = 'lm'\n[[model]]\nfile = 'model.stp'\n[[medium]]\nname = 'glass'\nindex = 1.5\n\
        [[material]]\npart = '*'\nmedium = 'glass'\n\
        [[source]]\nkind = 'cone'\nat = [0, 0, -50]\ndirection = [0, 0, 1]\nhalf_angle_deg = 8\npower = 100\n\
        [[receiver]]\nname = 'road'\nkind = 'far_field'\nnormal = [0, 0, 1]\nh_deg = [-10.5, 10.5]\nv_deg = [-10.5, 10.5]\n\
        cells = [2100, 2100]\n[[regulation]]\nid = 'UN R112 A passing'\n";
    fs::write(path.join("lamp.toml"), scene).unwrap();
    let arguments = ["trace", "lamp.toml", "--tolerance", "0.1", "-o", "out", "--no-report", "--json"];
    let (code, out, err) = lampyris_in(path, &arguments);
    assert_eq!(code, 0, "{err}");
    let found: Value = serde_json::from_str(&out).unwrap();
    let is_unsure = |found: &Value| {
        assert_eq!(found["verdict"], "unsure");
        let rows = found["rows"].as_array().unwrap();
        let judged: Vec<&Value> = rows.iter().filter(|row| !row["verdict"].is_null()).collect();
        assert!(!judged.is_empty() && judged.iter().all(|row| row["verdict"] == "unsure"), "{judged:?}");
        let read: Vec<&&Value> = judged.iter().filter(|row| !row["value"].is_null()).collect();
        assert!(!read.is_empty() && read.iter().all(|row| row["geometric"].is_null()), "{read:?}");
        assert!(
            judged.iter().all(|row| row["note"].as_str().unwrap().contains("what facets change")),
            "{judged:?}"
        );
    };
    is_unsure(&found["regulations"][0]);
    // From the files alone nobody is surer.
    let arguments = ["assess", "out", "--regulation", "UN R112 A passing", "--json"];
    let (code, out, err) = lampyris_in(path, &arguments);
    assert_eq!(code, 0, "{err}");
    is_unsure(&serde_json::from_str(&out).unwrap());
}

/// A device may have no end, nor a pipe: neither is read, as results or as the far field that they name.
#[cfg(unix)]
#[test]
fn assess_reads_ordinary_files_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let road = serde_json::json!({"name": "road", "kind": "far_field", "angles": "A", "unit": "cd",
        "files": ["road.csv"]});
    let results = serde_json::json!({"rays": 1000, "receivers": [road]});
    fs::write(path.join("results.json"), results.to_string()).unwrap();
    std::os::unix::fs::symlink("/dev/null", path.join("road.csv")).unwrap();
    for given in ["/dev/null", "."] {
        let (code, _, err) = lampyris_in(path, &["assess", given, "--regulation", "UN R112 B passing"]);
        assert!(code == 3 && err.contains("it is a pipe or a device"), "{given}: {code} {err}");
    }
}

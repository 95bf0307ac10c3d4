//! The main job with the real binary, in a folder of its own, with fewer rays: what it writes and what must hold.

use crate::support::lampyris_in;
use serde_json::Value;
use std::path::Path;

fn results(folder: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("results.json")).unwrap()).unwrap()
}

#[test]
fn the_demo_finds_the_light_of_the_lamp_and_says_where_it_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let (code, out, err) = lampyris_in(folder.path(), &["demo", "--rays", "60000", "--threads", "2"]);
    assert_eq!((code, out.as_str()), (0, ""), "{err}");
    let demo = folder.path().join("lampyris-demo");
    for name in [
        "report.html",
        "results.json",
        "far_field.csv",
        "far_field.png",
        "wall_25m.csv",
        "wall_25m.npz",
        "wall_25m.vti",
        "paths.vtp",
        "facets.glb",
        "figures/facets.png",
        "figures/far_field.svg",
        "figures/far_field.png",
        "figures/sag.png",
        "figures/octree-cells.png",
        "tables/times.csv",
    ] {
        assert!(demo.join(name).is_file(), "{name} is missing");
    }
    let unfinished =
        std::fs::read_dir(&demo).unwrap().any(|e| e.unwrap().file_name().to_string_lossy().ends_with(".part"));
    assert!(!unfinished, "an unfinished file was left");
    // The last lines: what was found, which file to open.
    let last: Vec<&str> = err.trim_end().lines().rev().take(8).collect();
    assert!(last.iter().any(|l| l.contains("lampyris-demo/report.html")), "{err}");
    assert!(err.contains("300 lm") && err.contains("none was lost"), "{err}");

    let r = results(&demo);
    let power = |key: &str| r["power"][key].as_f64().unwrap();
    let ends: f64 = ["received", "absorbed", "escaped", "cut_off", "lost"].iter().map(|k| power(k)).sum();
    assert!((ends - power("emitted")).abs() <= 1e-9 * power("emitted"));
    assert_eq!((power("lost"), &r["lost_rays"]), (0.0, &Value::from(0)));
    assert_eq!(r["check"]["octree_vs_bvh"]["disagree"], 0);
    assert_eq!(r["check"]["facets_vs_exact"]["unexplained"], 0);
    // Mitsuba 3.9 on facets of 0.001 mm: 0.75595 of the power on the wall, 3.694 segments a ray. Binomial errors of 60,000 rays:
    // 0.0018 and (of segments, which vary by about 1.5) 0.006; three of them, and 0.002 for the facets.
    let wall = &r["receivers"][0];
    let share = wall["power"].as_f64().unwrap() / power("emitted");
    assert!((share - 0.75595).abs() < 3.0 * 0.0018 + 0.002, "{share}");
    let segments = r["segments"].as_f64().unwrap() / r["rays"].as_f64().unwrap();
    assert!((segments - 3.694).abs() < 3.0 * 0.006 + 0.01, "{segments}");
}

#[test]
fn the_demo_gives_the_same_bits_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let digest = |threads: &str, name: &str| {
        let arguments = ["demo", "--rays", "20000", "--threads", threads, "-o", name, "--json"];
        let (code, out, err) = lampyris_in(folder.path(), &arguments);
        assert_eq!(code, 0, "{err}");
        // Exactly one document, and the same that is written.
        let document: Value = serde_json::from_str(&out).unwrap();
        assert_eq!(document, results(&folder.path().join(name)));
        (document["digest"].clone(), document["check"]["facets_vs_exact"].clone())
    };
    let one = digest("1", "a");
    assert!(one.0.as_str().is_some_and(|d| d.len() > 8));
    assert_eq!(one, digest("4", "b"));
    assert_eq!(one, digest("4", "c"));
}

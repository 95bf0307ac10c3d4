//! Real files: the fixtures in every run, the corpus on demand.

use crate::files::{corpus, fixture, step_files};
use lampyris::step;
use lampyris::tessellate::{Settings, Tessellation, tessellate};
use std::path::Path;

fn mesh(path: &Path, settings: &Settings) -> Tessellation {
    let import = step::read(path, &step::Settings::default()).unwrap();
    tessellate(&import.model, settings)
}

fn line(path: &Path, made: &Tessellation) -> String {
    let r = &made.report;
    format!(
        "{:44} faces {}/{} rep {} facets {} quads {:.3} cert {} over {:?} shells {}/{} open {} nonman {} sag {:.3} {:?} normal {:?} area {:.3} vol {:?} {:.3}s",
        path.file_name().unwrap().to_string_lossy(),
        r.faces.meshed,
        r.faces.failed,
        r.faces.repaired,
        r.facets,
        r.quad_area_share,
        r.facets - r.certified,
        r.over_tolerance,
        r.shells.closed,
        r.shells.open,
        r.open_edges,
        r.nonmanifold_edges,
        r.sag_mm.bound_max,
        r.sag_mm.sampled_max,
        r.normal_error_deg,
        r.area_mm2,
        r.volume_mm3,
        r.seconds.tessellate,
    )
}

#[test]
fn fixtures_are_closed_certified_and_mostly_quads() {
    let folder = fixture("step");
    let expected: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("expected.json")).unwrap()).unwrap();
    let found = step_files(&folder);
    assert!(found.len() >= 10);
    for path in found {
        let made = mesh(&path, &Settings { measure: true, ..Settings::default() });
        println!("{}", line(&path, &made));
        let r = &made.report;
        let name = path.file_name().unwrap().to_string_lossy();
        assert_eq!((r.faces.failed, r.over_tolerance), (0, Some(0)), "{name}");
        assert!(r.certified as f64 >= 0.999 * r.facets as f64, "{name}: {:?}", r.not_certified);
        assert_eq!((r.shells.open, r.open_edges, r.nonmanifold_edges), (0, 0, 0), "{name}");
        assert!(r.quad_area_share >= 0.95, "{name}: {}", r.quad_area_share);
        if let (Some(v), Some(e)) = (r.volume_mm3, expected[&*name]["volume_mm3"].as_f64()) {
            assert!((v - e).abs() < 0.2 * r.area_mm2, "{name}: {v} {e}");
        }
    }
}

#[test]
#[ignore = "reads the whole open corpus, minutes"]
fn corpus_is_meshed() {
    let folder = corpus();
    let tolerance = std::env::var("LAMPYRIS_TOLERANCE").ok().and_then(|t| t.parse().ok()).unwrap_or(0.1);
    let only = std::env::var("LAMPYRIS_ONLY").unwrap_or_default();
    let measure = std::env::var("LAMPYRIS_MEASURE").is_ok();
    for path in step_files(&folder) {
        if !path.to_string_lossy().contains(&only) {
            continue;
        }
        let made = mesh(&path, &Settings { measure, ..Settings::uniform(tolerance) });
        println!("{}", line(&path, &made));
    }
}

#[test]
#[ignore = "prints the facets without proof of the files whose name contains LAMPYRIS_ONLY"]
fn uncertified() {
    let only = std::env::var("LAMPYRIS_ONLY").unwrap_or_default();
    let tolerance: f64 = std::env::var("LAMPYRIS_TOLERANCE").ok().and_then(|t| t.parse().ok()).unwrap_or(0.1);
    let mut all = step_files(&fixture("step"));
    all.extend(step_files(&corpus()));
    for path in all {
        if !path.to_string_lossy().contains(&only) {
            continue;
        }
        let import = step::read(&path, &step::Settings::default()).unwrap();
        let settings = if std::env::var("LAMPYRIS_TOLERANCE").is_ok() {
            Settings::uniform(tolerance)
        } else {
            Settings::default()
        };
        let made = tessellate(&import.model, &settings);
        println!("{}", line(&path, &made));
        let faces: Vec<_> = import.model.placed_faces().collect();
        for n in made.report.not_certified.iter().take(10) {
            let f = faces[n.face as usize].face.unwrap();
            println!(
                "face {} #{:?} {:?} gap {} loops {} domain {:?} of {}",
                n.face,
                n.entity,
                f.analytic,
                f.gap,
                f.loops.len(),
                f.surface.domain(),
                made.mesh.facets.iter().filter(|x| x.face.0 == n.face).count()
            );
            for (i, q) in made
                .quality
                .iter()
                .enumerate()
                .filter(|(i, q)| !q.certified && made.mesh.facets[*i].face.0 == n.face)
                .take(4)
            {
                let v = made.mesh.facets[i].vertices.map(|v| made.mesh.vertices[v as usize]);
                println!(
                    "   bound {} tol {} uv {:?} xyz {:?}",
                    q.bound,
                    q.tolerance,
                    v.map(|v| (v.uv.x, v.uv.y)),
                    made.mesh.corners(i).map(|p| p.to_array())
                );
            }
        }
    }
}

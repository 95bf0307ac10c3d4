//! Accuracy asked for as an angle, on every fixture: whether it is reached, and what it costs beside a full sweep.

use lampyris::intersect::NormalMode;
use lampyris::model::Model;
use lampyris::step;
use lampyris::study::accuracy::{Row, Settings, accuracy};
use lampyris::study::aim::{Ask, aim};
use lampyris::study::{Product, Tree};
use std::path::{Path, PathBuf};

fn fixtures() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step");
    let entries = std::fs::read_dir(folder).expect("fixtures are there");
    let mut all: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
    all.retain(|p| p.extension().is_some_and(|e| e == "stp"));
    all.sort();
    all
}

fn read(path: &Path) -> Model {
    step::read(path, &step::Settings::default()).expect("fixtures are readable").model
}

/// Rays of the job that is asked about.
const JOB: f64 = 1e6;

/// Every combination that the sweep knows, with its seconds for the job.
fn swept(model: &Model) -> Vec<(f64, Row)> {
    let uniform = [1.6, 0.8, 0.4, 0.2, 0.1, 0.05, 0.025, 0.0125, 0.006, 0.003, 0.0015, 7.5e-4];
    let settings = Settings {
        tolerances: uniform.map(|t| [t, t]).into_iter().chain([[0.05, 0.2]]).collect(),
        normals: NormalMode::ALL.to_vec(),
        trees: vec![Tree::Octree],
        rays: 100_000,
        rounds: 3,
        threads: vec![rayon::current_num_threads()],
        seed: 77,
        seconds_after: 0.0,
    };
    let rows = accuracy("", &Product::new(model), &settings, &|_| ()).rows;
    let cost =
        |r: &Row| r.seconds_tessellate.unwrap_or(0.0) + r.seconds_build + r.seconds_trace_min * JOB / r.rays as f64;
    rows.into_iter().map(|r| (cost(&r), r)).collect()
}

#[test]
#[ignore = "minutes: eleven fixtures, seven angles, each beside a full sweep"]
fn asks_are_reached_and_cost_little_more_than_the_cheapest_combination() {
    let asked = [1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001];
    let only = std::env::var("LAMPYRIS_ONLY").unwrap_or_default();
    let (mut total, mut kept, mut ratios) = (0, 0, Vec::new());
    println!(
        "fixture | asked ° | reached ° | normals | tolerance mm | facets | s | cheapest of the sweep | s | ratio | spline s | spent s"
    );
    for path in fixtures().iter().filter(|p| p.to_string_lossy().contains(&only)) {
        let model = read(path);
        let product = Product::new(&model);
        let sweep = swept(&model);
        let spline = sweep.iter().find(|(_, r)| r.intersector == "exact").map_or(f64::NAN, |x| x.0);
        for degrees in asked {
            let found = aim(&model, &product, &Ask { job_rays: JOB, ..Ask::degrees(degrees) }, &|_| ());
            let seconds = found.seconds_prepare + found.seconds_trace;
            let good =
                sweep.iter().filter(|(_, r)| r.intersector != "exact" && r.direction_error_deg_p99 <= degrees);
            let best = good.min_by(|a, b| a.0.total_cmp(&b.0)).expect("exact normals reach any angle");
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            println!(
                "{name} | {degrees} | {:.2e} | {:?} | {:.1e}..{:.1e} | {} | {seconds:.3} | {} {} | {:.3} | {:.2} | {spline:.3} | {:.2}",
                found.reached_deg,
                found.normals,
                found.tolerance_mm[0],
                found.tolerance_mm[1],
                found.facets,
                best.1.tolerance_mm.unwrap_or(0.0),
                best.1.normals,
                best.0,
                seconds / best.0,
                found.seconds
            );
            total += 1;
            kept += usize::from(found.kept);
            ratios.push(seconds / best.0);
        }
    }
    ratios.sort_by(f64::total_cmp);
    let at = |share: f64| ratios[((ratios.len() - 1) as f64 * share) as usize];
    println!("{kept} of {total} kept; ratio median {:.2}, p90 {:.2}, largest {:.2}", at(0.5), at(0.9), at(1.0));
    assert!(kept as f64 >= 0.95 * f64::from(total));
}

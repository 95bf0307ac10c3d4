//! How fast are facets made? Seconds and proved facets a second at 0.05 mm, on fixtures and on any files named in
//! `LAMPYRIS_STEP_FILES` (separated by ':'): the median of eleven rounds and how far they spread.
//!
//! Run: `cargo bench --bench tessellate`. One thread: `RAYON_NUM_THREADS=1`. Against others: `against_occt.py`, and
//! `lampyris facet --baseline` for truck.

use lampyris::step::{Settings as Reading, read};
use lampyris::tessellate::{Settings, tessellate};
use std::path::{Path, PathBuf};

const TOLERANCE: f64 = 0.05;
const ROUNDS: usize = 11;

fn files() -> Vec<PathBuf> {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step");
    let names = ["lens_asphere_nurbs.stp", "reflector_freeform_trimmed.stp", "lamp_multicavity.stp"];
    let mut files: Vec<PathBuf> = names.iter().map(|n| fixtures.join(n)).collect();
    if let Ok(more) = std::env::var("LAMPYRIS_STEP_FILES") {
        files.extend(more.split(':').map(PathBuf::from));
    }
    files
}

fn main() {
    println!(
        "{:36} {:>8} {:>8} {:>10} {:>10} {:>10} {:>12}",
        "file", "facets", "proved", "median ms", "least", "most", "proved/s"
    );
    for path in files() {
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let import = match read(&path, &Reading::default()) {
            Ok(import) => import,
            Err(e) => {
                println!("{name:36} not read: {e}");
                continue;
            }
        };
        let settings = Settings::uniform(TOLERANCE);
        let proved = tessellate(&import.model, &settings).report.certified;
        let mut seconds = Vec::with_capacity(ROUNDS);
        let mut facets = 0;
        for _ in 0..ROUNDS {
            let report = tessellate(&import.model, &settings).report;
            seconds.push(report.seconds.tessellate);
            facets = report.facets;
        }
        seconds.sort_by(f64::total_cmp);
        let [least, median, most] = [0, ROUNDS / 2, ROUNDS - 1].map(|i| 1e3 * seconds[i]);
        let rate = 1e3 * proved as f64 / median;
        println!("{name:36} {facets:8} {proved:8} {median:10.2} {least:10.2} {most:10.2} {rate:12.0}");
    }
}

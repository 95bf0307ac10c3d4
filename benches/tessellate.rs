//! How fast are facets made? Seconds and proved facets a second at 0.05 mm, on fixtures and on any files named in
//! `LAMPYRIS_STEP_FILES` (separated by ':'): the median of eleven rounds, fewer where they would take over five seconds, and how far
//! they spread.
//!
//! Run: `cargo bench --bench tessellate`. One thread: `RAYON_NUM_THREADS=1`. Against others: `against_occt.py`, and
//! `lampyris facet --baseline` for truck.

use lampyris::step::{Settings as Reading, read};
use lampyris::tessellate::{Settings, tessellate};
use std::path::{Path, PathBuf};

const TOLERANCE: f64 = 0.05;
const ROUNDS: usize = 11;
/// Seconds after which a file gets no further round, but three at least.
const LONGEST: f64 = 5.0;

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
    println!("{} threads, {TOLERANCE} mm", rayon::current_num_threads());
    println!(
        "{:36} {:>8} {:>8} {:>7} {:>10} {:>10} {:>10} {:>12}",
        "file", "facets", "proved", "rounds", "median ms", "least", "most", "proved/s"
    );
    let (mut all, mut together) = (0, 0.0);
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
        let first = tessellate(&import.model, &settings).report;
        let mut seconds = Vec::with_capacity(ROUNDS);
        while seconds.len() < ROUNDS && (seconds.len() < 3 || seconds.iter().sum::<f64>() < LONGEST) {
            seconds.push(tessellate(&import.model, &settings).report.seconds.tessellate);
        }
        seconds.sort_by(f64::total_cmp);
        let rounds = seconds.len();
        let [least, median, most] = [0, rounds / 2, rounds - 1].map(|i| 1e3 * seconds[i]);
        let (facets, proved) = (first.facets, first.certified);
        let rate = 1e3 * proved as f64 / median;
        println!("{name:36} {facets:8} {proved:8} {rounds:7} {median:10.2} {least:10.2} {most:10.2} {rate:12.0}");
        (all, together) = (all + proved, together + median);
    }
    println!(
        "in all {all} proved facets in {together:.1} ms, {:.0} a second",
        1e3 * all as f64 / together.max(1e-9)
    );
}

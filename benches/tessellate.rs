//! How fast are facets made? Proved facets per second at 0.05 mm, on the fixtures and on any files named in
//! `LAMPYRIS_STEP_FILES` (separated by ':'), against truck-meshalgo at the same tolerance.
//!
//! Run: `cargo bench --bench tessellate`. One thread: `RAYON_NUM_THREADS=1`.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lampyris::kernel::baseline;
use lampyris::step::{Settings as Reading, read};
use lampyris::tessellate::{Settings, tessellate};
use std::path::{Path, PathBuf};

const TOLERANCE: f64 = 0.05;

fn files() -> Vec<PathBuf> {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step");
    let names = ["lens_asphere_nurbs.stp", "reflector_freeform_trimmed.stp", "lamp_multicavity.stp"];
    let mut files: Vec<PathBuf> = names.iter().map(|n| fixtures.join(n)).collect();
    if let Ok(more) = std::env::var("LAMPYRIS_STEP_FILES") {
        files.extend(more.split(':').map(PathBuf::from));
    }
    files
}

fn facets(c: &mut Criterion) {
    let mut group = c.benchmark_group("tessellate");
    group.sample_size(10);
    for path in files() {
        let Ok(import) = read(&path, &Reading::default()) else { continue };
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let settings = Settings::uniform(TOLERANCE);
        let made = tessellate(&import.model, &settings);
        group.throughput(Throughput::Elements(made.mesh.facets.len() as u64));
        group.bench_function(&name, |b| b.iter(|| tessellate(&import.model, &settings)));
        group.bench_function(format!("{name}, truck"), |b| b.iter(|| baseline::mesh(&import.model, TOLERANCE)));
    }
    group.finish();
}

criterion_group!(benches, facets);
criterion_main!(benches);

//! How fast is a STEP file read? Parse and convert, in MB of text per second, on the fixtures and on any files named in
//! `LAMPYRIS_STEP_FILES` (separated by ':').
//!
//! Run: `cargo bench --bench step_read`. One thread: `RAYON_NUM_THREADS=1`.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lampyris::step::{Settings, read_bytes};
use std::path::{Path, PathBuf};

fn files() -> Vec<PathBuf> {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step");
    let mut files: Vec<PathBuf> =
        ["reflector_facets_96.stp", "lamp_multicavity.stp"].iter().map(|n| fixtures.join(n)).collect();
    if let Ok(more) = std::env::var("LAMPYRIS_STEP_FILES") {
        files.extend(more.split(':').map(PathBuf::from));
    }
    files
}

fn read(c: &mut Criterion) {
    let mut group = c.benchmark_group("step_read");
    group.sample_size(10);
    for path in files() {
        let Ok(bytes) = std::fs::read(&path) else { continue };
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        group.throughput(Throughput::Bytes(bytes.len() as u64));
        group.bench_function(&name, |b| {
            b.iter(|| read_bytes(&name, &bytes, &Settings::default()).expect("a STEP file"));
        });
        // The report tells the two halves apart.
        let seconds: Vec<_> = (0..5)
            .map(|_| read_bytes(&name, &bytes, &Settings::default()).expect("a STEP file").report.seconds)
            .collect();
        let least = |f: fn(&lampyris::step::Seconds) -> f64| seconds.iter().map(f).fold(f64::INFINITY, f64::min);
        let mb = bytes.len() as f64 / 1e6;
        println!(
            "{name}: {mb:.2} MB, parse {:.0} MB/s, convert {:.0} MB/s",
            mb / least(|s| s.parse),
            mb / least(|s| s.convert)
        );
    }
    group.finish();
}

criterion_group!(benches, read);
criterion_main!(benches);

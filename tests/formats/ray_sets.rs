//! Ray files of other programs, where they are at hand: `LAMPYRIS_RAY_FILES` names a folder of them.

use lampyris::formats::{Flux, read_ray_set, read_tm25, write_tm25};
use std::path::PathBuf;

fn samples() -> Vec<PathBuf> {
    let folder = std::env::var("LAMPYRIS_RAY_FILES").expect("LAMPYRIS_RAY_FILES names a folder of ray files");
    let entries = std::fs::read_dir(folder).expect("a readable folder");
    entries.map(|e| e.expect("a readable entry").path()).collect()
}

/// Each file's total is that of its header, and a TM-25 file written again has the same bytes.
#[test]
#[ignore = "needs ray files of other programs"]
fn public_samples_are_read_whole() {
    let mut read = 0;
    let folder = tempfile::tempdir().expect("a temporary folder");
    for path in samples() {
        let start = std::fs::read(&path).expect("a readable file");
        let known = [b"TM25".as_slice(), b"LTRF", &1010i32.to_le_bytes()].iter().any(|m| start.starts_with(m));
        if !known {
            continue;
        }
        let set = read_ray_set(&path, Flux::Luminous).unwrap_or_else(|e| panic!("{e}"));
        let total: f64 = set.rays.iter().map(|r| r.power).sum();
        assert!(!set.rays.is_empty() && total > 0.0, "{}", path.display());
        println!(
            "{}: {} rays, {total} {}, {:?}",
            path.display(),
            set.rays.len(),
            set.flux.expect("a flux"),
            set.notes
        );
        if start.starts_with(b"TM25") {
            let tm25 = read_tm25(&path).expect("a TM-25 file");
            let h = &tm25.header;
            let stated = if set.flux == Some(Flux::Luminous) { h.luminous_flux } else { h.radiant_flux };
            if stated > 0.0 {
                // The sum in f32 of the writer, over some 1e5 rays, is good to 1e-5; a total that was scaled to is met to rounding.
                assert!((total / f64::from(stated) - 1.0).abs() < 1e-4, "{}: {total} for {stated}", path.display());
            }
            let copy = folder.path().join("copy.tm25ray");
            write_tm25(&copy, &tm25).expect("a written copy");
            assert!(start == std::fs::read(&copy).expect("the copy"), "{}: bytes differ", path.display());
        }
        read += 1;
    }
    assert!(read > 0, "no file of a known kind");
}

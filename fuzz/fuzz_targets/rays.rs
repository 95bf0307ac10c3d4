//! Lists of rays of every kind on arbitrary bytes; the first byte says which reader gets the rest.
//!
//! `cargo +nightly fuzz run rays fuzz/corpus/rays -- -timeout=10 -rss_limit_mb=1024 -max_total_time=600`
#![no_main]

use lampyris::formats::{Flux, read_data1, read_data2, read_data3, read_ray_set, read_rays};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, content)) = bytes.split_first() else { return };
    let name = ["csv", "npz", "ray", "data1", "data2", "data3"][usize::from(kind % 6)];
    // The readers take files; memory holds this one.
    let path = std::path::PathBuf::from(format!("/dev/shm/lampyris-fuzz-{}.{name}", std::process::id()));
    std::fs::write(&path, content).expect("a file in memory");
    match name {
        "csv" | "npz" => drop(read_rays(&path)),
        "ray" => drop(read_ray_set(&path, Flux::Radiant)),
        "data1" => drop(read_data1(&path)),
        "data2" => drop(read_data2(&path)),
        _ => drop(read_data3(&path)),
    }
});

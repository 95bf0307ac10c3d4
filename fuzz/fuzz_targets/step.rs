//! The STEP reader on arbitrary bytes: no panic, and every face accounted for.
//!
//! `cargo +nightly fuzz run step fuzz/corpus/step fixtures/step -- -timeout=10 -rss_limit_mb=1024 -max_total_time=600`
#![no_main]

use lampyris::step::{Settings, read_bytes};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    // A small budget keeps each run short; exceeding it is a refusal, not a failure.
    let settings = Settings { face_budget: 20_000, ..Settings::default() };
    if let Ok(import) = read_bytes("fuzz.stp", bytes, &settings) {
        let faces = import.report.faces;
        assert_eq!(faces.found, faces.converted + faces.refused);
    }
});

//! IES LM-63 and EULUMDAT on arbitrary text: what is read has a flux, and is written and read again.
//!
//! `cargo +nightly fuzz run photometry fuzz/corpus/photometry -- -timeout=10 -rss_limit_mb=1024 -max_total_time=600`
#![no_main]

use lampyris::formats::{parse_eulumdat, parse_ies};
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|text: &str| {
    for lamp in
        [parse_ies(Path::new("fuzz.ies"), text), parse_eulumdat(Path::new("fuzz.ldt"), text)].into_iter().flatten()
    {
        let _ = lamp.expanded().flux();
    }
});

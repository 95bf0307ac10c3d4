//! The reader of scenes on arbitrary text: an answer or a refusal that names a place, and no panic when it is bound.
//!
//! `cargo +nightly fuzz run scene fuzz/corpus/scene fixtures/scenes -- -timeout=10 -rss_limit_mb=1024 -max_total_time=600`
#![no_main]

use lampyris::model::Model;
use lampyris::simulate::Scene;
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|text: &str| {
    if let Ok(scene) = Scene::parse(text, "fuzz.toml", Path::new("/nowhere")) {
        let _ = scene.bind(&Model::default());
    }
});

//! Tally files on arbitrary bytes, with and without a right checksum at their end.
//!
//! `cargo +nightly fuzz run tally fuzz/corpus/tally -- -timeout=10 -rss_limit_mb=1024 -max_total_time=600`
#![no_main]

use lampyris::model::Model;
use lampyris::simulate::{BoundScene, Portion, Scene};
use libfuzzer_sys::fuzz_target;
use std::path::Path;
use std::sync::OnceLock;

const SCENE: &str = "[[source]]\nkind = 'point'\n[[receiver]]\nname = 'wall'\nat = [0, 0, 9]\nsize = [1, 1]\ncells = [4, 4]\n";

fuzz_target!(|bytes: &[u8]| {
    static BOUND: OnceLock<BoundScene> = OnceLock::new();
    let bound = BOUND.get_or_init(|| {
        let scene = Scene::parse(SCENE, "fuzz.toml", Path::new(".")).expect("a good scene");
        scene.bind(&Model::default()).expect("a scene without parts")
    });
    let accept = |_: &serde_json::Value| Ok(());
    let _ = Portion::read(bytes, accept, bound);
    // FNV-1a of 128 bits, as the files end in: the checksum hides nothing behind it.
    let hash = bytes.iter().fold(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d_u128, |h, b| {
        (h ^ u128::from(*b)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b)
    });
    let mut sealed = bytes.to_vec();
    sealed.extend(hash.to_le_bytes());
    let _ = Portion::read(&sealed, accept, bound);
});

//! Tally files: arbitrary bytes, and a good file with some bytes changed, each with and without a right checksum at its end.
//!
//! `cargo +nightly fuzz run tally fuzz/corpus/tally -- -timeout=10 -rss_limit_mb=1024 -max_total_time=600`
#![no_main]

use lampyris::intersect::bvh::{Bvh, Settings};
use lampyris::mesh::FacetMesh;
use lampyris::model::Model;
use lampyris::simulate::{BoundScene, Hooks, PartialRun, RunSettings, Scene, trace};
use libfuzzer_sys::fuzz_target;
use std::path::Path;
use std::sync::OnceLock;

const SCENE: &str =
    "[[source]]\nkind = 'point'\n[[receiver]]\nname = 'wall'\nat = [0, 0, 9]\nsize = [1, 1]\ncells = [4, 4]\n";

/// The scene, and the file of a run of 8 rays without the checksum that ends it.
fn good_file() -> (BoundScene, Vec<u8>) {
    let scene = Scene::parse(SCENE, "fuzz.toml", Path::new(".")).expect("a good scene");
    let bound = scene.bind(&Model::default()).expect("a scene without parts");
    let mesh = FacetMesh::default();
    let settings = RunSettings { rays: 8, threads: 1, ..RunSettings::default() };
    let traced =
        trace(&bound, &Bvh::build(&mesh, &Settings::default()), &settings, None, &Hooks::with_progress(&|_| true));
    let mut file = Vec::new();
    traced.partial.write(&serde_json::Value::Null, &mut file).expect("memory to write to");
    file.truncate(file.len() - 16);
    (bound, file)
}

fuzz_target!(|bytes: &[u8]| {
    static GOOD: OnceLock<(BoundScene, Vec<u8>)> = OnceLock::new();
    let (bound, good) = GOOD.get_or_init(good_file);
    // Four bytes are one change: a place in the good file, and what stands there.
    let mut changed = good.clone();
    for change in bytes.chunks_exact(4) {
        let place = u32::from_le_bytes([change[0], change[1], change[2], 0]) as usize;
        changed[place % good.len()] = change[3];
    }
    for file in [bytes, &changed] {
        let accept = |_: &serde_json::Value| Ok(());
        let _ = PartialRun::read(file, accept, bound);
        // FNV-1a of 128 bits, as the files end in: the checksum hides nothing behind it.
        let hash = file.iter().fold(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d_u128, |h, b| {
            (h ^ u128::from(*b)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b)
        });
        let sealed = [file, &hash.to_le_bytes()].concat();
        let _ = PartialRun::read(&sealed, accept, bound);
    }
});

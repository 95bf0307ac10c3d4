//! How fast are whole simulations, receivers included? Scenes S1, S2, S3 on the exact spline.
//!
//! `cargo bench --bench simulate -- [rays] [threads] [scene…]` prints one JSON row for each scene and intersector.

use lampyris::intersect::Intersector;
use lampyris::intersect::exact::{self, Exact};
use lampyris::simulate::{RunSettings, Scene, simulate};
use std::path::Path;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let rays = args.first().and_then(|a| a.parse().ok()).unwrap_or(1_000_000);
    let threads = args.get(1).and_then(|a| a.parse().ok()).unwrap_or(1);
    let wanted = |name: &str| args.len() < 3 || args[2..].iter().any(|a| name.contains(a.as_str()));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scenes");
    for name in ["s1_lens", "s2_lamp", "s3_reflector"].into_iter().filter(|n| wanted(n)) {
        let scene = Scene::read(&folder.join(format!("{name}.toml"))).expect("scene");
        let read = |m: &lampyris::simulate::scene::ModelUse| {
            lampyris::step::read(&scene.resolve(&m.file), &Default::default()).expect("model").model
        };
        let model = scene.assemble(scene.models.iter().map(read).collect()).expect("one model");
        let bound = scene.bind(&model).expect("bound");
        let exact = Exact::build(&model, &exact::Settings::default());
        let engines: [(&str, &dyn Intersector); 1] = [("exact", &exact)];
        for (label, engine) in engines {
            let settings = RunSettings { rays, threads, ..RunSettings::from(&scene.run) };
            let r = simulate(&bound, engine, &settings, &|_| true);
            let w = &r.receivers[0];
            println!(
                "{{\"scene\":\"{name}\",\"intersector\":\"{label}\",\"threads\":{threads},\"rays\":{},\"mrays_per_s\":{:.3},\
                 \"msegments_per_s\":{:.3},\"segments_per_ray\":{:.4},\"power\":{:.6},\"power_error\":{:.6},\"rms\":{:?},\
                 \"centroid\":{:?},\"centre_cell\":{:.5e},\"corrected\":{},\"lost\":{},\"digest\":\"{}\"}}",
                r.rays,
                r.mrays_per_s,
                r.msegments_per_s,
                r.segments as f64 / r.rays as f64,
                w.power,
                w.power_error,
                w.rms,
                w.centroid,
                w.cell(99, 99).max(w.cell(100, 100)) * w.half[0] * w.half[1] * 1e-10,
                r.corrected_normals,
                r.lost_rays,
                r.digest
            );
        }
    }
}

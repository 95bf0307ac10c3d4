//! What does it cost to move a facet hit to the spline, and how near to it does the hit come?
//!
//! `cargo bench --bench polish [-- FILE.stp ...]`: closed forms and a freeform surface, then the files, at 0.05 mm. Rounds
//! alternate between the octree alone and the octree polished, on the same rays that all hit; the difference of the medians is
//! the surcharge a hit. The residual is the distance between the hit and the spline evaluated at the hit's parameters.

#[path = "../tests/support/random.rs"]
mod random;

// The bench uses a part of what the tests share.
#[allow(dead_code)]
#[path = "../tests/exact/support.rs"]
mod support;

use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::polish::Polished;
use lampyris::intersect::{Certainty, Cost, Hit, Intersector};
use lampyris::math::Ray;
use lampyris::model::Model;
use lampyris::tessellate::{self, tessellate};
use std::time::Instant;
use support::*;

const RAYS: usize = 100_000;
const ROUNDS: usize = 11;

fn bench(name: &str, model: &Model) {
    let settings = tessellate::Settings { tolerance: [0.05; 2], measure: false, ..Default::default() };
    let mesh = tessellate(model, &settings).mesh;
    let octree = Octree::build(&mesh, &octree::Settings::default());
    let exact = Exact::build(model, &Settings::default());
    let polished = Polished::new(&octree, &mesh, &exact);
    let (bounds, mut random) = (mesh.bounds(), Random(99));
    let mut rays: Vec<Ray> = (0..4 * RAYS).map(|_| random.ray(bounds.center(), 0.4 * bounds.size())).collect();
    rays.retain(|r| octree.intersect(r, &mut Cost::default()).is_some());
    rays.truncate(RAYS);
    let mut hits: Vec<Option<Hit>> = vec![None; rays.len()];
    let mut seconds = [Vec::new(), Vec::new()];
    let mut cost = Cost::default();
    for _ in 0..ROUNDS {
        for (intersector, times) in [&octree as &dyn Intersector, &polished].into_iter().zip(&mut seconds) {
            cost = Cost::default();
            let start = Instant::now();
            intersector.intersect_batch(&rays, &mut hits, &mut cost);
            times.push(start.elapsed().as_secs_f64());
        }
    }
    let [plain, moved] = seconds.map(|mut s| {
        s.sort_by(f64::total_cmp);
        s[ROUNDS / 2] / rays.len() as f64 * 1e9
    });
    let faces: Vec<_> = model.placed_faces().collect();
    let mut residuals: Vec<f64> = rays
        .iter()
        .zip(&hits)
        .filter_map(|(ray, hit)| {
            let hit = hit.filter(|h| h.certainty == Certainty::Polished)?;
            let placed = &faces[hit.face.index()];
            let point = placed.placement.point(placed.face?.surface.evaluate(hit.uv));
            Some(point.distance(ray.point_at(hit.t)))
        })
        .collect();
    residuals.sort_by(f64::total_cmp);
    let quantile = |q: f64| residuals[((residuals.len() - 1) as f64 * q) as usize];
    println!(
        "{name:32} {:7} hits {plain:7.0} ns a ray, polished {moved:7.0}: {:5.0} ns a hit; residual p50 {:.1e} p99.9 {:.1e} max {:.1e} mm; {} fell back",
        rays.len(),
        moved - plain,
        quantile(0.5),
        quantile(0.999),
        quantile(1.0),
        cost.fallbacks
    );
}

fn main() {
    bench("bicubic patch", &model([bicubic()]));
    bench("sphere", &model([sphere(50.0)]));
    bench("torus", &model([torus(50.0, 15.0)]));
    bench("freeform 20 x 20", &model([reflector(20)]));
    for file in std::env::args().skip(1).filter(|a| !a.starts_with('-')) {
        match lampyris::step::read(file.as_ref(), &lampyris::step::Settings::default()) {
            Ok(import) => bench(file.rsplit('/').next().unwrap_or(&file), &import.model),
            Err(e) => eprintln!("{file}: {e}"),
        }
    }
}

//! How many certified rays a second does the exact intersector answer on one thread?
//!
//! `cargo bench --bench exact_rays [-- FILE.stp ...]`: closed forms and freeform surfaces, then the files. Rays come from a
//! sphere of three radii towards the bounding box. Rounds alternate between the models; the minimum and the median count.

#[path = "../tests/support/random.rs"]
mod random;

// The bench uses a part of what the tests share.
#[allow(dead_code)]
#[path = "../tests/exact/support.rs"]
mod support;

use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::{Certainty, Cost, Hit, Intersector};
use lampyris::math::{Aabb, Ray};
use lampyris::model::Model;
use std::time::Instant;
use support::*;

const RAYS: usize = 100_000;
const ROUNDS: usize = 15;

struct Case {
    name: String,
    exact: Exact,
    rays: Vec<Ray>,
    seconds: Vec<f64>,
}

fn bounds(model: &Model) -> Aabb {
    model.placed_faces().filter_map(|p| p.face.map(|f| (f, p.placement))).fold(Aabb::EMPTY, |b, (f, place)| {
        b.union(Aabb::from_points(f.surface.points.iter().map(|p| place.point(p.project()))))
    })
}

fn case(name: &str, model: &Model) -> Case {
    let bounds = bounds(model);
    let mut random = Random(99);
    let rays = (0..RAYS).map(|_| random.ray(bounds.center(), 0.5 * bounds.size())).collect();
    Case { name: name.into(), exact: Exact::build(model, &Settings::default()), rays, seconds: Vec::new() }
}

fn main() {
    let mut cases = vec![
        case("bicubic patch", &model([bicubic()])),
        case("sphere", &model([sphere(50.0)])),
        case("torus", &model([torus(50.0, 15.0)])),
        case("freeform 20 x 20", &model([reflector(20)])),
        case("10,000 patches", &model([reflector(103)])),
    ];
    for file in std::env::args().skip(1).filter(|a| !a.starts_with('-')) {
        match lampyris::step::read(file.as_ref(), &lampyris::step::Settings::default()) {
            Ok(import) => cases.push(case(file.rsplit('/').next().unwrap_or(&file), &import.model)),
            Err(e) => eprintln!("{file}: {e}"),
        }
    }
    if let Ok(only) = std::env::var("LAMPYRIS_ONLY") {
        cases.retain(|c| c.name.contains(&only));
    }
    let mut hits: Vec<Option<Hit>> = vec![None; RAYS];
    for _ in 0..ROUNDS {
        for case in &mut cases {
            let start = Instant::now();
            case.exact.intersect_batch(&case.rays, &mut hits, &mut Cost::default());
            case.seconds.push(start.elapsed().as_secs_f64());
        }
    }
    println!(
        "{:32} {:>7} {:>8} {:>6} {:>7} {:>7} {:>9} {:>8} {:>8} {:>6} {:>8}",
        "model",
        "patches",
        "leaves",
        "hits %",
        "max M/s",
        "med M/s",
        "uncertain",
        "p99 µs",
        "max µs",
        "tests",
        "build s"
    );
    for case in &mut cases {
        case.seconds.sort_by(f64::total_cmp);
        let rate = |s: f64| RAYS as f64 / s / 1e6;
        let (mut cost, mut flagged, mut hit) = (Cost::default(), 0, 0);
        // The shortest of three: a ray takes microseconds, and being interrupted by other work milliseconds.
        let mut each = vec![f64::INFINITY; RAYS];
        for pass in 0..3 {
            for (ray, shortest) in case.rays.iter().zip(&mut each) {
                let start = Instant::now();
                let answer = case.exact.first(ray, &mut cost);
                *shortest = shortest.min(start.elapsed().as_secs_f64() * 1e6);
                flagged += usize::from(pass == 0 && answer.certainty != Certainty::Certified);
                hit += usize::from(pass == 0 && answer.hit.is_some());
            }
        }
        each.sort_by(f64::total_cmp);
        println!(
            "{:32} {:7} {:8} {:6.1} {:7.2} {:7.2} {:9} {:8.1} {:8.1} {:6.2} {:8.3}",
            case.name,
            case.exact.patch_count(),
            case.exact.leaf_count(),
            100.0 * hit as f64 / RAYS as f64,
            rate(case.seconds[0]),
            rate(case.seconds[ROUNDS / 2]),
            flagged,
            each[RAYS * 99 / 100],
            each[RAYS - 1],
            cost.tests as f64 / cost.rays as f64,
            case.exact.footprint().build_seconds
        );
    }
}

//! What a tolerance costs: facets, proved and measured distance, and how far hits and normals lie from the spline.
//!
//! `cargo run --release --example tolerance_study`

use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Cost, Intersector};
use lampyris::math::{Point, Ray};
use lampyris::{step, tessellate};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step/lens_biconvex_nurbs.stp");
    let model = step::read(&file, &step::Settings::default())?.model;
    let spline = Exact::build(&model, &exact::Settings::default());
    // A grid of rays along the axis, through the aperture.
    let steps = || (-20..=20).map(|k| 0.35 * f64::from(k));
    let rays: Vec<Ray> =
        steps().flat_map(|x| steps().map(move |y| Ray::new(Point::new(x, y, -100.0), Point::Z))).collect();

    println!(
        "{:>12} {:>8} {:>12} {:>14} {:>14}",
        "tolerance mm", "facets", "proved mm", "worst hit mm", "worst normal °"
    );
    let mut before = f64::INFINITY;
    for tolerance in [0.2, 0.05, 0.0125] {
        let made = tessellate::tessellate(&model, &tessellate::Settings::uniform(tolerance));
        let octree = Octree::build(&made.mesh, &octree::Settings::default());
        let mut cost = Cost::default();
        let mut distance = 0f64;
        let mut angle = 0f64;
        for ray in &rays {
            let (Some(near), Some(true_hit)) = (octree.intersect(ray, &mut cost), spline.intersect(ray, &mut cost))
            else {
                continue;
            };
            distance = distance.max((near.t - true_hit.t).abs());
            angle = angle.max(near.normal.cross(true_hit.normal).length().asin().to_degrees());
        }
        let proved = made.report.sag_mm.bound_max;
        println!("{tolerance:>12} {:>8} {proved:>12.5} {distance:>14.6} {angle:>14.6}", made.mesh.facets.len());
        assert!(proved <= tolerance && distance < before);
        before = distance;
    }
    Ok(())
}

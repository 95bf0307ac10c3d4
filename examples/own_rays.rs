//! Rays of your own against every intersector: octree and BVH hold the same facets, the spline judges both.
//!
//! `cargo run --release --example own_rays`

use lampyris::intersect::bvh::{self, Bvh};
use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Certainty, Cost, Hit, Intersector};
use lampyris::math::{Point, Ray, Vector};
use lampyris::{step, tessellate};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step/lamp_multicavity.stp");
    let model = step::read(&file, &step::Settings::default())?.model;
    let mesh = tessellate::tessellate(&model, &tessellate::Settings::default()).mesh;
    let octree = Octree::build(&mesh, &octree::Settings::default());
    let bvh = Bvh::build(&mesh, &bvh::Settings::default());
    let exact = Exact::build(&model, &exact::Settings::default());

    // A fan of rays out of the middle cavity.
    let fan = |k: u32| {
        let turn = 2.399_963 * f64::from(k);
        let z = 1.0 - 2.0 * (f64::from(k) + 0.5) / 2000.0;
        let radius = (1.0 - z * z).sqrt();
        Ray::new(Point::new(0.0, 0.0, 20.0), Vector::new(radius * turn.cos(), radius * turn.sin(), z))
    };
    let rays: Vec<Ray> = (0..2000).map(fan).collect();
    let answers = |intersector: &dyn Intersector| {
        let mut hits: Vec<Option<Hit>> = vec![None; rays.len()];
        let mut cost = Cost::default();
        intersector.intersect_batch(&rays, &mut hits, &mut cost);
        (hits, cost)
    };
    let (on_octree, octree_cost) = answers(&octree);
    let (on_bvh, bvh_cost) = answers(&bvh);
    let (on_spline, exact_cost) = answers(&exact);

    for (name, cost) in [("octree", octree_cost), ("bvh", bvh_cost), ("exact", exact_cost)] {
        println!("{name:7} {} nodes, {} tests", cost.nodes, cost.tests);
    }
    let distance = |hit: &Option<Hit>| hit.map(|h| h.t);
    let same = on_octree.iter().zip(&on_bvh).filter(|(a, b)| distance(a) == distance(b)).count();
    let certified = on_spline.iter().flatten().filter(|h| h.certainty == Certainty::Certified).count();
    let same_face = |(a, b): &(&Option<Hit>, &Option<Hit>)| a.map(|h| h.face) == b.map(|h| h.face);
    let agreeing = on_octree.iter().zip(&on_spline).filter(same_face).count();
    println!(
        "octree and BVH agree on {same} of {}, {certified} hits certified, {agreeing} on the same face",
        rays.len()
    );
    assert_eq!(same, rays.len());
    assert!(agreeing as f64 > 0.99 * rays.len() as f64);
    Ok(())
}

//! A ray in a mirror ball keeps its angular momentum: what normals are off on one side adds up over 100,000 bounces.

use crate::support::*;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::polish::Polished;
use lampyris::intersect::{Cost, Intersector};
use lampyris::math::{Point, Ray, Vector};
use lampyris::tessellate;

const BOUNCES: usize = 100_000;

/// How far the angular momentum about the middle has moved after all bounces, as a share of what it was.
fn drift(mirror: &dyn Intersector, radius: f64) -> f64 {
    let mut ray = Ray::new(Point::new(0.2, -0.1, 0.3) * radius, Vector::new(0.48, 0.6, 0.64));
    let before = ray.origin.cross(ray.direction);
    for k in 0..BOUNCES {
        let hit = mirror.intersect(&ray, &mut Cost::default()).unwrap_or_else(|| panic!("bounce {k}: {ray:?}"));
        let d = ray.direction;
        let mirrored = (d - hit.normal * (2.0 * d.dot(hit.normal))).normalize();
        let from = hit.departure();
        ray = Ray::new(ray.point_at(hit.t), mirrored).with_departure(from);
    }
    (ray.origin.cross(ray.direction) - before).length() / before.length()
}

#[test]
fn angular_momentum_is_kept_on_the_spline() {
    for radius in [1e-3, 50.0, 1e4] {
        let exact = Exact::build(&model([sphere(radius)]), &Settings::default());
        let drift = drift(&exact, radius);
        println!("spline, radius {radius}: {drift:e}");
        assert!(drift < 1e-10, "radius {radius}: {drift:e}");
    }
}

#[test]
fn angular_momentum_is_kept_on_polished_facets() {
    for radius in [1e-3, 50.0] {
        let model = model([sphere(radius)]);
        let exact = Exact::build(&model, &Settings::default());
        let tolerance = [2e-3 * radius; 2];
        let mesh = tessellate::tessellate(
            &model,
            &tessellate::Settings { tolerance, measure: false, ..Default::default() },
        )
        .mesh;
        let facets = Octree::build(&mesh, &octree::Settings::default());
        let drift = drift(&Polished::new(&facets, &mesh, &exact), radius);
        println!("polished, radius {radius}: {drift:e}");
        assert!(drift < 1e-9, "radius {radius}: {drift:e}");
    }
}

//! Rays that start on facets, anywhere and exactly on edges and corners, against arithmetic of twice the digits and another hierarchy.

use crate::support::Random;
use lampyris::intersect::bvh::{self, Bvh};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Cost, Hit, Intersector};
use lampyris::math::{Departure, Point, QuadHalf, Ray, Uv, Vector};
use lampyris::mesh::FacetMesh;
use lampyris::study::arbiter::{Arbitration, arbitrate};
use lampyris::study::rays::RaySource;
use lampyris::study::surface_rays::SurfacePaths;
use lampyris::{step, tessellate};
use rayon::prelude::*;
use std::path::Path;

/// A hit nearer than this is one of a neighbour that rises from the edge or corner where the ray starts, mm. Starts there are moved
/// inside by at most 1024·2⁻⁴⁰ of 200 mm, which a grazing ray makes a thousand times longer.
const NEAR: f64 = 1e-3;

fn lamp(tolerance: f64) -> FacetMesh {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step/lamp_multicavity.stp");
    let model = step::read(&file, &step::Settings::default()).unwrap().model;
    tessellate::tessellate(&model, &tessellate::Settings::uniform(tolerance)).mesh
}

/// Where on its triangle a ray starts.
#[derive(Clone, Copy, Debug)]
enum Start {
    Inside,
    Edge,
    Corner,
}

/// The triangle of a facet.
fn corners(mesh: &FacetMesh, facet: u32, triangle: Option<QuadHalf>) -> [Point; 3] {
    let [a, b, c, d] = mesh.corners(facet as usize);
    if triangle == Some(QuadHalf::Second) { [a, c, d] } else { [a, b, c] }
}

/// A ray that leaves a random triangle to either side in a cosine-distributed direction.
fn surface_ray(mesh: &FacetMesh, start: Start, r: &mut Random) -> Ray {
    loop {
        let primitive = (r.within(0.0, 1.0) * mesh.facets.len() as f64) as u32;
        let facet = mesh.facets[primitive as usize];
        let second = !facet.is_triangle() && r.within(0.0, 1.0) < 0.5;
        let triangle = Some(if second { QuadHalf::Second } else { QuadHalf::First });
        let [a, b, c] = corners(mesh, primitive, triangle);
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
        let side = if r.within(0.0, 1.0) < 0.5 { normal } else { -normal };
        let Some(direction) = (side + r.direction()).try_normalize() else { continue };
        let along = r.within(0.0, 1.0);
        let origin = match start {
            Start::Inside => a + (b - a) * (1.0 - along.sqrt()) + (c - a) * (along.sqrt() * r.within(0.0, 1.0)),
            Start::Edge => b + (c - b) * along,
            Start::Corner => [a, b, c][(3.0 * along) as usize % 3],
        };
        let departure = Departure { face: facet.face, primitive, uv: Uv::ZERO, triangle };
        return Ray::new(origin, direction).with_departure(departure);
    }
}

/// Whether a hit next to the start is of a facet that begins there, rises on the side to which the ray leaves, and is passed away from
/// the facet that it leaves: nothing else can be met at once.
fn is_of_rising_neighbour(mesh: &FacetMesh, ray: &Ray, hit: &Hit) -> bool {
    let from = ray.departure.unwrap();
    let theirs = mesh.corner_positions(hit.primitive as usize);
    let shares = mesh.corner_positions(from.primitive as usize).iter().any(|p| theirs.contains(p));
    let [a, b, c] = corners(mesh, from.primitive, from.triangle);
    let up = (b - a).cross(c - a).normalize();
    let up: Vector = up * up.dot(ray.direction).signum();
    let other = corners(mesh, hit.primitive, hit.triangle);
    let rises = other.iter().any(|p| up.dot(*p - ray.origin) > 0.0);
    let normal = (other[1] - other[0]).cross(other[2] - other[0]);
    let middle = (a + b + c) / 3.0;
    shares && rises && normal.dot(ray.direction) * normal.dot(middle - other[0]) < 0.0
}

#[test]
fn starts_on_edges_and_corners_are_right_with_twice_the_digits() {
    let mesh = lamp(0.2);
    let octree = Octree::build(&mesh, &octree::Settings::default());
    let mut r = Random(21);
    let mut hits_at_start = 0;
    for start in [Start::Inside, Start::Edge, Start::Corner] {
        let rays: Vec<Ray> = (0..400).map(|_| surface_ray(&mesh, start, &mut r)).collect();
        let mut hits = vec![None; rays.len()];
        octree.intersect_batch(&rays, &mut hits, &mut Cost::default());
        for (ray, hit) in rays.iter().zip(&hits) {
            if let Some(hit) = hit.filter(|hit| hit.t < NEAR) {
                assert!(is_of_rising_neighbour(&mesh, ray, &hit), "{start:?} {ray:?} {hit:?}");
                hits_at_start += 1;
                continue;
            }
            // An answer that no ray has, so that the verdict is about the octree's alone.
            let impossible = Hit { t: -1.0, ..octree.intersect(&toward(&mesh), &mut Cost::default()).unwrap() };
            let ahead = ray.with_range(NEAR, f64::INFINITY);
            let verdict = arbitrate(&mesh, &ahead, hit.as_ref(), Some(&impossible));
            assert_eq!(verdict, Arbitration::First, "{start:?} {ray:?} {hit:?}");
        }
    }
    assert!(hits_at_start > 10, "concave edges are among them: {hits_at_start}");
}

/// A ray that hits.
fn toward(mesh: &FacetMesh) -> Ray {
    let [a, b, c] = corners(mesh, 0, None);
    let normal = (b - a).cross(c - a).normalize();
    Ray::new((a + b + c) / 3.0 + normal, -normal)
}

#[test]
#[ignore = "a hundred million rays, LAMPYRIS_RAYS of them, from LAMPYRIS_SEED on: three minutes in release"]
fn surface_rays_are_answered_as_by_the_cured_bvh() {
    let number = |name: &str, default: u64| std::env::var(name).map_or(default, |n| n.parse().unwrap());
    let (count, seed) = (number("LAMPYRIS_RAYS", 100_000_000), number("LAMPYRIS_SEED", 77));
    for (k, tolerance) in [0.2, 0.02, 0.0018].into_iter().enumerate() {
        let mesh = lamp(tolerance);
        let octree = Octree::build(&mesh, &octree::Settings::default());
        let cured = Bvh::build(&mesh, &bvh::Settings::default());
        let paths = SurfacePaths::new(&mesh, &octree, seed + k as u64, count / 3);
        let differ: usize = (0..(count / 3).div_ceil(10_000))
            .into_par_iter()
            .map(|part| {
                let rays = paths.rays(10_000 * part..10_000 * (part + 1));
                let (mut ours, mut theirs) = (vec![None; rays.len()], vec![None; rays.len()]);
                octree.intersect_batch(&rays, &mut ours, &mut Cost::default());
                cured.intersect_batch(&rays, &mut theirs, &mut Cost::default());
                ours.iter().zip(&theirs).filter(|(a, b)| a != b).count()
            })
            .sum();
        assert_eq!(differ, 0, "{tolerance} mm, {} facets", mesh.facets.len());
        println!("{} facets: {} surface rays, none differs", mesh.facets.len(), count / 3);
    }
}

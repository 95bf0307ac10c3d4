//! Rays that leave a facet, on every intersector: they meet what lies ahead, and not what they leave.

use crate::facets::{all, ask, at_a_seam};
use crate::support::*;
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Cost, Hit, Intersector};
use lampyris::math::{Departure, Point, Ray, Vector};
use lampyris::mesh::FacetMesh;

pub(crate) fn leave(ray: Ray, hit: &Hit, direction: Vector) -> Ray {
    Ray::new(ray.point_at(hit.t), direction).with_departure(hit.departure())
}

#[test]
fn grazing_rays_that_start_on_edges_stay_inside() {
    for (size, shift) in [(50.0, 0.0), (50.0, 1e6), (5e-5, 0.0)] {
        let middle = Point::new(shift, -shift, shift);
        for mesh in [globe(24, 13, |v| v * size + middle), globe(64, 33, |v| v * size + middle)] {
            let mut r = Random(77);
            let mut rays = Vec::new();
            let octree = Octree::build(&mesh, &octree::Settings::default());
            for k in 0..4000 {
                let first = at_a_seam(&mesh, middle, size, k, &mut r);
                let Some(hit) = octree.intersect(&first, &mut Cost::default()) else {
                    panic!("slipped through: {first:?}")
                };
                let inward = -hit.geometric_normal;
                let sideways = r.direction();
                let sideways = (sideways - inward * inward.dot(sideways)).normalize();
                let sine = 10f64.powi(-((k % 10) as i32)) * r.within(0.1, 0.999);
                let direction = (sideways * (1.0 - sine * sine).sqrt() + inward * sine).normalize();
                rays.push(leave(first, &hit, direction));
            }
            let lost = ask(&mesh, &rays).iter().filter(|hit| hit.is_none()).count();
            assert_eq!(lost, 0, "of {} rays in a mesh of {size} mm at {middle}", rays.len());
        }
    }
}

/// A globe whose vertices lie in and out by a share of the radius: its quads are folded both ways.
fn crumpled(n: usize, m: usize, share: f64, map: impl Fn(Vector) -> Point) -> FacetMesh {
    let mut r = Random(1234);
    let mut mesh = globe(n, m, |v| v);
    for p in &mut mesh.positions {
        *p = map(*p * (1.0 + r.within(-share, share)));
    }
    mesh
}

#[test]
fn grazing_rays_that_start_on_the_diagonal_of_a_folded_quad_stay_inside() {
    for (size, shift) in [(50.0, 0.0), (50.0, 1e6), (5e-5, 0.0)] {
        let middle = Point::new(shift, -shift, shift);
        // A kilometre away folds of down to a nanometre, where a start is rounded by a ten-thousandth of that.
        let smallest: &[f64] = if shift > 0.0 { &[1e-6, 1e-7, 2e-8] } else { &[1e-7] };
        for &share in [0.03, 1e-4].iter().chain(smallest) {
            let mesh = crumpled(16, 9, share, |v| v * size + middle);
            let octree = Octree::build(&mesh, &octree::Settings::default());
            let mut r = Random(78);
            let mut rays = Vec::new();
            for k in 0..3000 {
                let facet = 2 * 16 + r.below(mesh.facets.len() - 2 * 16);
                let [a, _, c, _] = mesh.corners(facet);
                let target = a.lerp(c, r.unit());
                let origin = middle + r.direction() * (size * 0.4 * r.unit());
                let first = Ray::new(origin, (target - origin).normalize());
                let Some(hit) = octree.intersect(&first, &mut Cost::default()) else {
                    panic!("slipped through: {first:?}")
                };
                let inward = -hit.geometric_normal;
                let sideways = r.direction();
                let sideways = (sideways - inward * inward.dot(sideways)).normalize();
                let sine = 10f64.powi(-(k % 11)) * r.within(0.1, 0.999);
                let direction = (sideways * (1.0 - sine * sine).sqrt() + inward * sine).normalize();
                rays.push(leave(first, &hit, direction));
            }
            let lost = ask(&mesh, &rays).iter().filter(|hit| hit.is_none()).count();
            assert_eq!(lost, 0, "of {} rays in a mesh of {size} mm at {middle}, folded by {share}", rays.len());
        }
    }
}

#[test]
fn a_facet_is_not_met_by_what_leaves_it_wherever_its_start_was_rounded_to() {
    // Starts of a ten-millionth of a millimetre above a facet in an axis plane, running down onto it.
    let mut mesh = FacetMesh::default();
    add_grid(&mut mesh, 4, 4, 0, |u, v| Point::new(100.0 * u, 100.0 * v, 30.0));
    add_grid(&mut mesh, 4, 4, 1, |u, v| Point::new(100.0 * u, 100.0 * v, -30.0));
    let mut r = Random(3);
    let mut rays = Vec::new();
    for k in 0..2000 {
        let facet = r.below(16);
        let [a, _, c, _] = mesh.corners(facet);
        let start = a.lerp(c, r.within(0.3, 0.7)) + Vector::new(r.within(-5.0, 5.0), r.within(-5.0, 5.0), 1.2e-7);
        let down = 10f64.powi(-(k % 9));
        let direction = Vector::new(r.within(-1.0, 1.0), r.within(-1.0, 1.0), -down).normalize();
        let departure = Departure {
            face: mesh.facets[facet].face,
            primitive: facet as u32,
            uv: Default::default(),
            triangle: None,
        };
        rays.push(Ray::new(start, direction).with_departure(departure));
    }
    for (ray, hit) in rays.iter().zip(ask(&mesh, &rays)) {
        let own = ray.departure.map(|d| d.primitive);
        assert!(hit.is_none_or(|hit| Some(hit.primitive) != own), "{hit:?} by {ray:?}");
    }
}

#[test]
fn a_ray_reflected_inside_a_closed_mesh_stays_inside() {
    for mesh in [ball(10, |v| v * 50.0), globe(40, 20, |v| v * 50.0 + Vector::splat(1e3))] {
        let middle = mesh.bounds().center();
        let mut r = Random(5);
        for (name, structure) in all(&mesh) {
            let mut bounces = 0;
            for _ in 0..300 {
                let mut ray = Ray::new(middle, r.direction());
                for _ in 0..30 {
                    let hit = structure.intersect(&ray, &mut Cost::default());
                    let Some(hit) = hit else { panic!("{name}: left through {ray:?}") };
                    bounces += 1;
                    assert!(
                        ray.direction.dot(hit.geometric_normal) > 0.0,
                        "{name}: met from outside, {ray:?} {hit:?}"
                    );
                    let n = hit.geometric_normal;
                    let direction = if bounces % 3 == 0 {
                        // Anywhere inward, often at grazing angles.
                        let d = r.direction() - n * r.unit();
                        let lift = d.dot(n);
                        (d - n * (lift + lift.abs().max(1e-5))).normalize()
                    } else {
                        (ray.direction - n * (2.0 * ray.direction.dot(n))).normalize()
                    };
                    ray = leave(ray, &hit, direction);
                }
            }
            assert_eq!(bounces, 9000);
        }
    }
}

#[test]
fn a_ray_leaving_a_convex_body_meets_nothing() {
    let mesh = ball(10, |v| v * 50.0);
    let mut r = Random(17);
    let mut rays = Vec::new();
    for f in 0..mesh.facets.len() {
        let [a, b, c, d] = mesh.corners(f);
        for k in 0..40 {
            // On both triangles, on their edges and corners.
            let (s, t) = ([0.0, 0.5, 1.0, r.unit()][k % 4], [0.0, 1.0, 0.5, r.unit()][k / 4 % 4]);
            let second = k % 2 == 1;
            let [p, q, w] = if second { [a, c, d] } else { [a, b, c] };
            let start = p + ((q - p) * s + (w - q) * (s * t));
            let normal = (q - p).cross(w - p).normalize();
            let direction = (r.direction() * 0.99 + normal).normalize();
            let from = Departure {
                face: mesh.facets[f].face,
                primitive: f as u32,
                uv: Default::default(),
                triangle: None,
            };
            // The blown-up cube has quads folded inward or outward by up to this much: start directions above.
            if direction.dot(normal) > 0.1 {
                rays.push(Ray::new(start, direction).with_departure(from));
            }
        }
    }
    let hits = ask(&mesh, &rays);
    for (ray, hit) in rays.iter().zip(hits) {
        assert!(hit.is_none(), "{ray:?} met {hit:?}");
    }
}

//! What is known of a source in advance changes no hit: rays from one point, and along one direction, on every kind of mesh.

use crate::support::*;
use lampyris::intersect::bvh::{self, Bvh};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Beam, Cost, ExpectedRays, Intersector};
use lampyris::math::{Point, Ray, Vector};
use lampyris::mesh::FacetMesh;

fn meshes() -> Vec<(&'static str, FacetMesh)> {
    let sphere = |d: Vector| Point::ZERO + d * 20.0;
    let bean = |d: Vector| Point::new(30.0 * d.x, 20.0 * d.y + 0.02 * (30.0 * d.x).powi(2), 9.0 * d.z);
    let mut broken = ball(4, sphere);
    broken.positions[3] = Point::new(f64::NAN, 0.0, 0.0);
    broken.positions[9] = broken.positions[8];
    let far = ball(6, |d| Point::new(1e6, -2e6, 5e5) + d * 3.0);
    vec![
        ("ball", ball(12, sphere)),
        ("globe", globe(24, 12, sphere)),
        ("bean", ball(12, bean)),
        ("heap", heap(500, 50.0, 6.0, 5)),
        ("lamp", lamp(1000).0),
        ("stadium", stadium(1000).0),
        ("broken", broken),
        ("far", far),
        ("nothing", FacetMesh::default()),
    ]
}

/// Asks a tree that expects the beam, one that does not, and a structure that knows no beams.
fn same(name: &str, mesh: &FacetMesh, beam: Beam, rays: &[Ray]) {
    let knowing = Octree::build(mesh, &octree::Settings::default());
    let plain = Octree::build(mesh, &octree::Settings::default());
    let judge = Bvh::build(mesh, &bvh::Settings::default());
    let beams = [(Beam::Point(Point::splat(0.5)), u64::MAX), (beam, u64::MAX)];
    knowing.prepare_for(&ExpectedRays { rays: u64::MAX, threads: 2, beams: &beams, sag: 0.0 });
    let ask = |intersector: &dyn Intersector| {
        let (mut hits, mut cost) = (vec![None; rays.len()], Cost::default());
        intersector.intersect_batch(rays, &mut hits, &mut cost);
        (hits, cost)
    };
    let ((known, less), (walked, more)) = (ask(&knowing), ask(&plain));
    let (judged, _) = ask(&judge);
    assert!(known.iter().all(Option::is_none) || less.nodes < more.nodes / 4, "{name}: {less:?} against {more:?}");
    for instruction_set in [octree::InstructionSet::Avx2, octree::InstructionSet::Portable] {
        let other = Octree::build(mesh, &octree::Settings { instruction_set, ..octree::Settings::default() });
        other.prepare_for(&ExpectedRays { rays: u64::MAX, threads: 2, beams: &beams, sag: 0.0 });
        assert!(ask(&other).0 == walked, "{name}: {beam:?} {instruction_set:?}");
    }
    for (k, ray) in rays.iter().enumerate() {
        assert_eq!(known[k], walked[k], "{name}: {beam:?} {ray:?}");
        assert_eq!(known[k].map(|h| h.t), judged[k].map(|h| h.t), "{name}: {beam:?} {ray:?}");
    }
}

/// A corner, the middle of an edge, or a place in a facet: what rays and sources are aimed at.
fn place(mesh: &FacetMesh, dice: &mut Random) -> Point {
    if mesh.facets.is_empty() {
        return Point::new(dice.unit(), dice.unit(), dice.unit());
    }
    let [a, b, c, _] = mesh.corners(dice.below(mesh.facets.len()));
    let p = match dice.below(3) {
        0 => a,
        1 => a + (b - a) * 0.5,
        _ => a + (b - a) * (0.5 * dice.unit()) + (c - a) * (0.5 * dice.unit()),
    };
    if p.is_finite() { p } else { Point::ZERO }
}

#[test]
fn rays_from_a_point() {
    let mut dice = Random(11);
    for (name, mesh) in meshes() {
        let bounds = lampyris::math::Aabb::from_points(mesh.positions.iter().copied().filter(|p| p.is_finite()));
        let (middle, size) =
            if bounds.is_empty() { (Point::ZERO, 1.0) } else { (bounds.center(), bounds.diagonal()) };
        let mut sources =
            vec![middle, middle + Vector::new(0.0, 0.0, size), middle + dice.direction() * (100.0 * size)];
        sources.extend((0..4).map(|_| middle + dice.direction() * (size * dice.unit())));
        sources.extend((0..4).map(|_| place(&mesh, &mut dice)));
        for from in sources {
            let mut rays = Vec::new();
            for k in 0..1500 {
                let aimed = Ray::from_points(from, place(&mesh, &mut dice));
                let any = Ray::new(from, dice.direction());
                let axis = [Vector::X, -Vector::Y, Vector::Z, Vector::new(1.0, 1.0, -1.0).normalize()][k % 4];
                rays.extend([aimed.unwrap_or(any), any]);
                if k < 8 {
                    rays.push(Ray::new(from, axis));
                }
            }
            rays.iter_mut().step_by(7).for_each(|r| r.t_max = size * dice.unit());
            same(name, &mesh, Beam::Point(from), &rays);
        }
    }
}

#[test]
fn rays_along_a_direction() {
    let mut dice = Random(12);
    for (name, mesh) in meshes() {
        let bounds = lampyris::math::Aabb::from_points(mesh.positions.iter().copied().filter(|p| p.is_finite()));
        let (middle, size) =
            if bounds.is_empty() { (Point::ZERO, 1.0) } else { (bounds.center(), bounds.diagonal()) };
        let mut directions = vec![Vector::Z, -Vector::X];
        directions.extend((0..4).map(|_| dice.direction()));
        for (k, direction) in directions.into_iter().enumerate() {
            // The plane stands before the mesh, and in its midst.
            let origin = middle - direction * (size * if k % 2 == 0 { 1.0 } else { 0.1 });
            let mut rays = Vec::new();
            for _ in 0..3000 {
                let target = match dice.below(2) {
                    0 => place(&mesh, &mut dice),
                    _ => middle + dice.direction() * (size * dice.unit()),
                };
                let start = target - direction * (target - origin).dot(direction);
                rays.push(Ray::new(start, direction));
            }
            rays.iter_mut().step_by(7).for_each(|r| r.t_max = size * dice.unit());
            same(name, &mesh, Beam::Collimated { origin, direction }, &rays);
        }
    }
}

/// Many sources, each with too few rays for a buffer of its own, that shine along one direction from one plane, or from one point.
#[test]
fn sources_with_rays_in_common_share_what_is_known() {
    let mut dice = Random(13);
    let mesh = ball(12, |d| Point::ZERO + d * 20.0);
    let direction = dice.direction();
    let (x, y) = lampyris::math::orthonormal_pair(direction);
    let beside: Vec<Point> = (0..500)
        .map(|_| direction * -60.0 + x * (20.0 * dice.unit() - 10.0) + y * (20.0 * dice.unit() - 10.0))
        .collect();
    let along = |origin: &Point| (Beam::Collimated { origin: *origin, direction }, 1000);
    let beams: Vec<(Beam, u64)> = beside.iter().map(along).collect();
    let rays: Vec<Ray> = beside.iter().map(|origin| Ray::new(*origin, direction)).collect();
    shared(&mesh, &beams, &rays);
    let point = Point::new(3.0, -40.0, 7.0);
    let beams = vec![(Beam::Point(point), 1000); 500];
    let rays: Vec<Ray> = (0..500).filter_map(|_| Ray::from_points(point, place(&mesh, &mut dice))).collect();
    shared(&mesh, &beams, &rays);
}

/// Asks a tree that expects the beams, and one that expects the first of them alone, which does not pay.
fn shared(mesh: &FacetMesh, beams: &[(Beam, u64)], rays: &[Ray]) {
    let [all, one] = [(); 2].map(|()| Octree::build(mesh, &octree::Settings::default()));
    all.prepare_for(&ExpectedRays { rays: 500_000, threads: 1, beams, sag: 0.0 });
    one.prepare_for(&ExpectedRays { rays: 1000, threads: 1, beams: &beams[..1], sag: 0.0 });
    let ask = |tree: &Octree<'_>| {
        let (mut hits, mut cost) = (vec![None; rays.len()], Cost::default());
        tree.intersect_batch(rays, &mut hits, &mut cost);
        (hits, cost.nodes)
    };
    let ((known, less), (walked, more)) = (ask(&all), ask(&one));
    assert_eq!(known, walked);
    assert!(more > 500 && less == 0, "{less} nodes against {more}");
}

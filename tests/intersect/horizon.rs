//! A ray that the octree reports as escaped meets nothing, checked on every kind of mesh by a structure without horizons.

use crate::support::*;
use lampyris::intersect::bvh::{self, Bvh};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Cost, ExpectedRays, Intersector};
use lampyris::math::{Departure, FaceId, Point, Ray, Uv, Vector};
use lampyris::mesh::{Facet, FacetMesh, MeshVertex};

/// A ray from a random place of a random facet, to all sides, half of them grazing; the place is often on a border.
fn leaving(mesh: &FacetMesh, dice: &mut Random) -> Ray {
    let facet = dice.below(mesh.facets.len());
    let [a, b, c, d] = mesh.corners(facet);
    let (q, r) = if dice.unit() < 0.5 { (b, c) } else { (c, d) };
    let (mut u, mut v) = (dice.unit(), dice.unit());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    match dice.below(8) {
        0 => u = 0.0,
        1 => v = 0.0,
        2 => v = 1.0 - u,
        _ => {}
    }
    let origin = a + (q - a) * u + (r - a) * v;
    let normal = (q - a).cross(r - a).normalize_or_zero();
    let mut direction = dice.direction();
    if dice.unit() < 0.5 {
        direction = (direction - normal * (direction.dot(normal) * (1.0 - 0.1 * dice.unit()))).normalize();
    }
    let from = Departure { face: FaceId(0), primitive: facet as u32, uv: Uv::ZERO, triangle: None };
    Ray::new(origin, direction).with_departure(from)
}

/// The same, but all rays of a facet run nearly the same way, which differs from facet to facet.
fn in_a_bundle(mesh: &FacetMesh, dice: &mut Random) -> Ray {
    let ray = leaving(mesh, dice);
    let facet = ray.departure.map_or(0, |from| from.primitive);
    // Spread by the golden ratio: the first numbers of small seeds are small.
    let bundle = Random((u64::from(facet) + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15)).direction();
    Ray { direction: (bundle + dice.direction() * 0.2).normalize(), ..ray }
}

/// Heights up to this share of the largest coordinate are nothing to a ray that leaves a facet: its start is off by as much.
const REACH: f64 = 1.0 / (1u64 << 40) as f64;

/// How far from the plane of the facet that it leaves, mm, a ray is at `t`: of the two triangles' planes, the nearer one.
fn height_over_start(mesh: &FacetMesh, ray: &Ray, t: f64) -> f64 {
    let [a, b, c, d] = mesh.corners(ray.departure.map_or(0, |from| from.primitive as usize));
    let height = |q: Point, r: Point| (q - a).cross(r - a).normalize().dot(ray.point_at(t) - a).abs();
    height(b, c).min(height(c, d))
}

/// The share of rays to the outside that are called gone, of those that meet nothing.
fn share_found(name: &str, mesh: &FacetMesh) -> f64 {
    share_found_of(name, mesh, leaving)
}

fn share_found_of(name: &str, mesh: &FacetMesh, ray: fn(&FacetMesh, &mut Random) -> Ray) -> f64 {
    let tree = Octree::build(mesh, &octree::Settings::default());
    let judge = Bvh::build(mesh, &bvh::Settings::default());
    let mut dice = Random(707);
    let rays: Vec<Ray> = (0..60_000).map(|_| ray(mesh, &mut dice)).collect();
    assert!(!rays.iter().any(|r| tree.escapes(r)), "{name}: nothing is known before it was worth it");
    let bytes = tree.footprint().bytes;
    tree.prepare_for(&many());
    // Cones and records are held from now on.
    assert!(tree.footprint().bytes > bytes + mesh.facets.len() * 16, "{name}");
    let reach = REACH * mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let mut found = 0.0;
    // Horizons are found from the rays that left a facet before.
    for _ in 0..8 {
        let (mut gone, mut free) = (0, 0);
        for ray in &rays {
            let hit = judge.intersect(ray, &mut Cost::default());
            free += usize::from(hit.is_none());
            if tree.escapes(ray) {
                // Where parts touch without sharing corners a ray can start on both.
                let is_at_start = |t: f64| height_over_start(mesh, ray, t) <= reach;
                assert!(hit.is_none_or(|h| is_at_start(h.t)), "{name}: {ray:?} meets {hit:?}");
                gone += 1;
            }
        }
        found = gone as f64 / free.max(1) as f64;
    }
    found
}

fn many() -> ExpectedRays<'static> {
    ExpectedRays { rays: u64::MAX, threads: 2, beams: &[], sag: 0.0 }
}

#[test]
fn a_ray_above_the_horizon_meets_nothing() {
    let sphere = |d: Vector| Point::ZERO + d * 20.0;
    // Squeezed and bent: facets that are folded inward and outward.
    let bean = |d: Vector| Point::new(30.0 * d.x, 20.0 * d.y + 0.02 * (30.0 * d.x).powi(2), 9.0 * d.z);
    let found = [
        ("ball", share_found("ball", &ball(12, sphere))),
        ("globe", share_found("globe", &globe(24, 12, sphere))),
        ("bean", share_found("bean", &ball(12, bean))),
        ("heap", share_found("heap", &heap(2000, 50.0, 3.0, 5))),
        ("lamp", share_found("lamp", &lamp(4000).0)),
        ("stadium", share_found("stadium", &stadium(4000).0)),
    ];
    // A convex body hides nothing: all but rays that graze a fold are found, though half of these do graze.
    assert!(found[0].1 > 0.85 && found[1].1 > 0.95, "{found:?}");
    assert!(found[2].1 > 0.7, "{found:?}");
}

#[test]
fn a_ray_of_a_bundle_in_the_free_cone_meets_nothing() {
    let bean = |d: Vector| Point::new(30.0 * d.x, 20.0 * d.y + 0.02 * (30.0 * d.x).powi(2), 9.0 * d.z);
    let found = [
        ("ball", share_found_of("ball", &ball(12, |d| Point::ZERO + d * 20.0), in_a_bundle)),
        ("bean", share_found_of("bean", &ball(12, bean), in_a_bundle)),
        ("heap", share_found_of("heap", &heap(2000, 50.0, 3.0, 5), in_a_bundle)),
        ("lamp", share_found_of("lamp", &lamp(4000).0, in_a_bundle)),
        ("stadium", share_found_of("stadium", &stadium(4000).0, in_a_bundle)),
    ];
    assert!(found[0].1 > 0.9 && found[1].1 > 0.8, "{found:?}");
}

#[test]
fn a_folded_facet_is_met_by_what_leaves_its_other_half() {
    let mut dice = Random(3);
    for k in 0..4000 {
        // A kite with its fold along x, turned up by an angle on one side.
        let fold = 2.5 * dice.unit().powi(1 + k % 6);
        let mut side = |y: f64| Point::new(0.3 + 0.4 * dice.unit(), y * fold.cos().max(-0.5), y * fold.sin());
        let d = side(0.7);
        let corners = [Point::ZERO, Point::new(0.5, -0.7, 0.0), Point::X, d];
        let at = |[a, b, c]: [Point; 3], r: &mut Random| {
            let (u, v) = (0.1 + 0.35 * r.unit(), 0.1 + 0.35 * r.unit());
            a + (b - a) * u + (c - a) * v
        };
        let first = at([corners[0], corners[1], corners[2]], &mut dice);
        let second = at([corners[0], corners[2], corners[3]], &mut dice);
        let mesh = FacetMesh {
            positions: corners.to_vec(),
            vertices: (0..4).map(|position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO }).collect(),
            facets: vec![Facet { vertices: [0, 1, 2, 3], face: FaceId(0) }],
            sag: vec![],
        };
        let (from, to) = if k % 2 == 0 { (first, second) } else { (second, first) };
        let height = (to - from).z.abs();
        if height < 1e-6 {
            continue;
        }
        let departure = Departure { face: FaceId(0), primitive: 0, uv: Uv::ZERO, triangle: None };
        let ray = Ray::new(from, (to - from).normalize()).with_departure(departure);
        let tree = Octree::build(&mesh, &octree::Settings::default());
        let judge = Bvh::build(&mesh, &bvh::Settings::default());
        let mut batch = [None; 2];
        tree.intersect_batch(&[ray, ray], &mut batch, &mut Cost::default());
        let alone = tree.intersect(&ray, &mut Cost::default());
        let t = alone.map(|h| h.t);
        assert!(
            t.is_some_and(|t| (t - (to - from).length()).abs() < 1e-9 / height),
            "fold {fold}: {ray:?} {alone:?}"
        );
        assert_eq!([alone, alone], batch);
        assert_eq!(t, judge.intersect(&ray, &mut Cost::default()).map(|h| h.t));
    }
}

/// How far a ray goes to what it meets, but for the facets around its own that it comes through from behind.
fn meets_beyond_sheet(judge: &Bvh, mesh: &FacetMesh, ray: &Ray) -> Option<f64> {
    let own = ray.departure.map_or(0, |from| from.primitive as usize);
    let is_sheet = |other: usize| {
        mesh.facets[other].face == mesh.facets[own].face
            && mesh.corner_positions(other).iter().any(|p| mesh.corner_positions(own).contains(p))
    };
    let mut ahead = Ray { departure: None, ..*ray };
    loop {
        let hit = judge.intersect(&ahead, &mut Cost::default())?;
        if !is_sheet(hit.primitive as usize) || hit.geometric_normal.dot(ray.direction) < 0.0 {
            return Some(hit.t);
        }
        ahead.t_min = hit.t.next_up();
    }
}

/// Rays of bundles that start up to a sag off their facet, to facets that are up to a sag off theirs: the ray is off by both.
#[test]
fn a_ray_from_the_spline_is_free_of_all_that_lies_within_the_sag() {
    let bean = |d: Vector| Point::new(30.0 * d.x, 20.0 * d.y + 0.02 * (30.0 * d.x).powi(2), 9.0 * d.z);
    // A wall between two floors, of the same face as both, which its neighbours come to from its front.
    let mut kerb = FacetMesh::default();
    add_grid(&mut kerb, 5, 5, 0, |x, y| Point::new(50.0 * x, 50.0 * y, if x > 0.5 { 15.0 } else { 0.0 }));
    let meshes = [
        ("ball", ball(12, |d| Point::ZERO + d * 20.0), 0.1),
        ("bean", ball(12, bean), 0.1),
        ("heap", heap(600, 50.0, 3.0, 5), 0.5),
        ("kerb", kerb, 0.05),
    ];
    for (name, mesh, sag) in meshes {
        let tree = Octree::build(&mesh, &octree::Settings::default());
        let judge = Bvh::build(&mesh, &bvh::Settings::default());
        tree.prepare_for(&ExpectedRays { sag, ..many() });
        let mut dice = Random(11);
        let mut found = 0;
        for _ in 0..100_000 {
            let ray = in_a_bundle(&mesh, &mut dice);
            assert!(!tree.escapes(&ray) && !tree.escapes_spline(&ray, 2.0 * sag), "{name}: not asked for");
            if tree.escapes_spline(&ray, sag) {
                found += 1;
                for _ in 0..4 {
                    let off = (dice.direction() + dice.direction()) * sag;
                    let moved = Ray { origin: ray.origin + off, ..ray };
                    let met = meets_beyond_sheet(&judge, &mesh, &moved);
                    assert!(met.is_none(), "{name}: {moved:?} meets something at {met:?}");
                }
            }
        }
        assert!(found > 1000, "{name}: {found}");
    }
}

#[test]
fn no_horizon_for_facets_without_area_or_corners_that_are_no_numbers() {
    let mut mesh = ball(4, |d| Point::ZERO + d * 20.0);
    mesh.positions[3] = Point::new(f64::NAN, 0.0, 0.0);
    mesh.positions[9] = mesh.positions[8];
    share_found("broken ball", &mesh);
    let empty = FacetMesh::default();
    let tree = Octree::build(&empty, &octree::Settings::default());
    tree.prepare_for(&many());
    assert!(!tree.escapes(&Ray::new(Point::ZERO, Vector::Z)));
}

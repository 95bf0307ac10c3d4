//! The contract of intersectors on facets, asked of every one of them.

use crate::support::*;
use lampyris::intersect::bvh::{self, Bvh, Kind};
use lampyris::intersect::octree::{self, InstructionSet, Octree};
use lampyris::intersect::{Cost, Hit, Intersector};
use lampyris::math::{Departure, Point, Ray, Vector};
use lampyris::mesh::FacetMesh;

/// Names and structures under test: all must give the same bits.
fn all(mesh: &FacetMesh) -> Vec<(&'static str, Box<dyn Intersector + '_>)> {
    let octree = octree::Settings::default();
    let portable = octree::Settings { instruction_set: InstructionSet::Portable, ..octree };
    let bvh = bvh::Settings::default();
    vec![
        ("octree", Box::new(Octree::build(mesh, &octree))),
        (
            "octree, AVX2",
            Box::new(Octree::build(
                mesh,
                &octree::Settings { instruction_set: InstructionSet::Avx2, ..octree::Settings::default() },
            )),
        ),
        ("octree, portable", Box::new(Octree::build(mesh, &portable))),
        ("octree, textbook", Box::new(Octree::build(mesh, &octree::Settings::textbook()))),
        ("Bvh2", Box::new(Bvh::build(mesh, &bvh::Settings { kind: Kind::Bvh2, ..bvh }))),
        ("CwBvh", Box::new(Bvh::build(mesh, &bvh::Settings { kind: Kind::CwBvh, ..bvh }))),
    ]
}

/// Asks all structures one by one and in a batch; all answers must be the same bits.
fn ask(mesh: &FacetMesh, rays: &[Ray]) -> Vec<Option<Hit>> {
    let mut first: Option<Vec<Option<Hit>>> = None;
    for (name, structure) in all(mesh) {
        let mut batch = vec![None; rays.len()];
        structure.intersect_batch(rays, &mut batch, &mut Cost::default());
        let single: Vec<_> = rays.iter().map(|r| structure.intersect(r, &mut Cost::default())).collect();
        for (i, (b, s)) in batch.iter().zip(&single).enumerate() {
            assert_eq!(b, s, "{name}: batch and single differ on {:?}", rays[i]);
            if let Some(first) = &first {
                assert_eq!(b, &first[i], "{name} against the first, ray {i}: {:?}", rays[i]);
            }
        }
        first.get_or_insert(batch);
    }
    first.unwrap_or_default()
}

fn rays_about(size: f64, count: usize, seed: u64) -> Vec<Ray> {
    let mut r = Random(seed);
    (0..count)
        .map(|k| {
            let far = [0.5, 1.0, 3.0, 1e4][k % 4];
            let origin = r.direction() * (size * far);
            let target = Point::new(r.within(-size, size), r.within(-size, size), r.within(-size, size));
            Ray::from_points(origin, target).unwrap()
        })
        .collect()
}

#[test]
fn nearest_hit_is_that_of_trying_all_facets() {
    let mesh = heap(700, 10.0, 1.5, 7);
    let mut rays = rays_about(10.0, 4000, 11);
    for (k, ray) in rays.iter_mut().enumerate() {
        match k % 5 {
            0 => *ray = ray.with_range(4.0, 9.0),
            1 => *ray = Ray::new(ray.origin, [Vector::X, -Vector::Y, Vector::Z][k % 3]),
            _ => {}
        }
    }
    for (ray, hit) in rays.iter().zip(ask(&mesh, &rays)) {
        let (expected, doubtful) = by_hand(&mesh, ray);
        match (hit, expected) {
            _ if doubtful => {}
            (Some(hit), Some(t)) => assert!((hit.t - t).abs() <= 1e-9 * t.max(1.0), "{} for {t} on {ray:?}", hit.t),
            (None, None) => {}
            other => panic!("{other:?} on {ray:?}"),
        }
    }
}

/// A ray from inside a closed mesh at a vertex, a point of an edge or of a diagonal, or along an axis.
fn at_a_seam(mesh: &FacetMesh, middle: Point, size: f64, k: usize, r: &mut Random) -> Ray {
    let corners = mesh.corners(r.below(mesh.facets.len()));
    let (a, b) = (corners[0], corners[[1, 2, 3][k % 3]]);
    let target = match k % 4 {
        0 => a,
        1 => a.midpoint(b),
        _ => a + (b - a) * r.unit(),
    };
    let origin = middle + r.direction() * (size * 0.4 * r.unit());
    let direction = if k % 8 == 7 {
        let mut d = Vector::ZERO;
        d[k / 8 % 3] = [1.0, -1.0][k / 24 % 2];
        d
    } else {
        (target - origin).normalize()
    };
    Ray::new(origin, direction)
}

/// None of such rays may slip through.
fn leaks(mesh: &FacetMesh, middle: Point, size: f64, count: usize) {
    let mut r = Random(99);
    let mut rays = Vec::new();
    for k in 0..count {
        rays.push(at_a_seam(mesh, middle, size, k, &mut r));
    }
    let hits = ask(mesh, &rays);
    let missed = hits.iter().filter(|h| h.is_none()).count();
    assert_eq!(missed, 0, "of {count} rays {missed} slipped through");
}

#[test]
fn nothing_slips_through_a_closed_mesh() {
    leaks(&ball(24, |v| v * 300.0 + Vector::new(111.1, -77.7, 33.3)), Point::new(111.1, -77.7, 33.3), 300.0, 8000);
    leaks(&globe(64, 32, |v| v), Point::ZERO, 1.0, 8000);
    leaks(&globe(500, 5, |v| v * Vector::new(1.0, 1.0, 20.0)), Point::ZERO, 1.0, 8000);
}

#[test]
fn nothing_slips_through_scaled_shifted_rotated() {
    let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -2.0);
    for scale in [1e-3, 1.0, 1e3] {
        for shift in [0.0, 1e6] {
            let middle = Point::new(shift, -0.5 * shift, 0.1 * shift);
            leaks(&ball(12, |v| turn * v * scale + middle), middle, scale, 3000);
        }
    }
}

#[test]
fn nothing_slips_through_a_mesh_smaller_than_a_wavelength() {
    // Absolute limits inside the BVH's crate let one ray in thirty through.
    for size in [5e-5, 5e-7] {
        let mesh = globe(24, 13, |v| v * size);
        let mut r = Random(9);
        let rays: Vec<Ray> = (0..3000)
            .map(|k| {
                let corners = mesh.corners(r.below(mesh.facets.len()));
                let target =
                    [corners[0], corners[0].lerp(corners[1], r.unit()), corners[0].midpoint(corners[2])][k % 3];
                let inside = r.direction() * (0.8 * size * r.unit());
                let direction = (inside - target).normalize();
                Ray::new(target - direction * (size * 10f64.powf(r.within(0.5, 5.0))), direction)
            })
            .collect();
        // From far away the target itself is rounded; all structures agree all the same.
        ask(&mesh, &rays);
    }
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
        let departure =
            Departure { face: mesh.facets[facet].face, primitive: facet as u32, uv: Default::default() };
        rays.push(Ray::new(start, direction).with_departure(departure));
    }
    for (ray, hit) in rays.iter().zip(ask(&mesh, &rays)) {
        let own = ray.departure.map(|d| d.primitive);
        assert!(hit.is_none_or(|hit| Some(hit.primitive) != own), "{hit:?} by {ray:?}");
    }
}

fn leave(ray: Ray, hit: &Hit, direction: Vector) -> Ray {
    Ray::new(ray.point_at(hit.t), direction).with_departure(Departure {
        face: hit.face,
        primitive: hit.primitive,
        uv: hit.uv,
    })
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
            let from = Departure { face: mesh.facets[f].face, primitive: f as u32, uv: Default::default() };
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

#[test]
fn a_gap_of_a_micrometre_is_seen() {
    let mut mesh = FacetMesh::default();
    add_grid(&mut mesh, 20, 20, 0, |a, b| Point::new(100.0 * a, 100.0 * b, 0.0));
    add_grid(&mut mesh, 20, 20, 1, |a, b| Point::new(100.0 * a, 100.0 * b, 1e-3));
    let mut r = Random(3);
    let mut rays = Vec::new();
    for k in 0..2000 {
        let start = if k % 2 == 0 {
            Point::new(5.0 * r.below(20) as f64, 5.0 * r.below(20) as f64, 0.0)
        } else {
            Point::new(r.within(1.0, 99.0), r.within(1.0, 99.0), 0.0)
        };
        let start = start.clamp(Point::splat(0.0), Point::new(95.0, 95.0, 0.0))
            + Point::new(1.0, 1.0, 0.0) * f64::from(k % 3);
        let above = Ray::new(start + Vector::Z * 1e-4, -Vector::Z);
        rays.push(above);
    }
    let down = ask(&mesh, &rays);
    let up: Vec<Ray> = rays.iter().zip(&down).map(|(r, h)| leave(*r, &h.unwrap(), Vector::Z)).collect();
    for (ray, hit) in up.iter().zip(ask(&mesh, &up)) {
        let hit = hit.unwrap_or_else(|| panic!("gap not seen by {ray:?}"));
        assert_eq!(hit.face.0, 1);
        assert!((hit.t - 1e-3).abs() < 1e-12, "{}", hit.t);
    }
}

#[test]
fn t_range_is_honoured_to_the_bit() {
    let mut mesh = FacetMesh::default();
    add_grid(&mut mesh, 3, 3, 0, |a, b| Point::new(9.0 * a - 3.9, 9.0 * b - 3.7, 0.0));
    let down = Ray::new(Point::new(0.1, 0.2, 0.7), -Vector::Z);
    let t = ask(&mesh, &[down])[0].unwrap().t;
    assert!((t - 0.7).abs() < 1e-15);
    let rays = [
        down.with_range(0.0, t),
        down.with_range(t, 2.0),
        down.with_range(0.0, t.next_down()),
        down.with_range(t.next_up(), 2.0),
        Ray::new(Point::new(0.1, 0.2, -0.7), -Vector::Z).with_range(-1.0, 5.0),
        Ray::new(Point::new(f64::NAN, 0.0, 1.0), -Vector::Z),
        Ray::new(Point::new(0.1, 0.2, 1.0), Vector::ZERO),
        down.with_range(f64::NAN, 5.0),
        down.with_range(2.0, 1.0),
    ];
    let hits = ask(&mesh, &rays);
    let t_of = |i: usize| hits[i].map(|h| h.t);
    assert_eq!((t_of(0), t_of(1), t_of(2), t_of(3)), (Some(t), Some(t), None, None));
    assert!((t_of(4).unwrap() + 0.7).abs() < 1e-15);
    assert!(hits[5..].iter().all(Option::is_none));
}

#[test]
fn equal_distances_go_to_the_lowest_facet() {
    let mut mesh = FacetMesh::default();
    for face in 0..20 {
        add_grid(&mut mesh, 8, 8, face, |a, b| Point::new(8.0 * a, 8.0 * b, 0.0));
    }
    let mut r = Random(21);
    let rays: Vec<Ray> = (0..500)
        .map(|k| {
            let at = if k % 2 == 0 { Point::new(3.0, 5.0, 0.0) } else { Point::new(r.within(0.0, 8.0), 4.0, 0.0) };
            Ray::new(at + Vector::Z * 2.0, -Vector::Z)
        })
        .collect();
    for hit in ask(&mesh, &rays) {
        assert_eq!(hit.map(|h| h.face.0), Some(0));
    }
}

#[test]
fn odd_meshes_do_no_harm() {
    let ray = Ray::new(Point::new(0.2, 0.1, 5.0), -Vector::Z);
    assert_eq!(ask(&FacetMesh::default(), &[ray]), [None]);
    // One facet; a point; a line; corners at infinity; a fan of thousands at one vertex.
    let far = Point::X * 1e300;
    let positions = vec![Point::ZERO, Point::X, Point::new(1.0, 1.0, 0.0), Point::Y, Point::splat(f64::NAN), far];
    let mut mesh = FacetMesh { positions, ..FacetMesh::default() };
    add_facet(&mut mesh, [0, 1, 2, 3], 0);
    assert!(ask(&mesh, &[ray])[0].is_some());
    for odd in [[0, 0, 0, 0], [0, 1, 1, 0], [0, 1, 4, 3], [4, 4, 4, 4], [0, 1, 5, 3]] {
        add_facet(&mut mesh, odd, 1);
    }
    assert_eq!(ask(&mesh, &[ray])[0].map(|h| h.primitive), Some(0));
    let fan = globe(6000, 3, |v| v);
    leaks(&fan, Point::ZERO, 1.0, 300);
    let stack: FacetMesh = (0..600).fold(FacetMesh::default(), |mut mesh, _| {
        add_grid(&mut mesh, 1, 1, 0, |a, b| Point::new(a, b, 0.0));
        mesh
    });
    assert_eq!(ask(&stack, &[ray])[0].map(|h| h.primitive), Some(0));
}

#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let (mesh, sources) = lamp(60_000);
    let mut r = Random(8);
    let rays: Vec<Ray> =
        (0..5000).map(|k| Ray::new(sources[k % sources.len()] + r.direction() * 0.3, r.direction())).collect();
    let build = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let tree = Octree::build(&mesh, &octree::Settings::default());
            let mut hits = vec![None; rays.len()];
            let mut cost = Cost::default();
            tree.intersect_batch(&rays, &mut hits, &mut cost);
            (tree.statistics().clone(), tree.boxes(), hits, cost)
        })
    };
    let (one, four) = (build(1), build(4));
    assert!(one == four, "trees or answers differ");
    assert!(one.0.references >= mesh.facets.len() && one.0.depth() < 20);
    let around = mesh.bounds().grown(1.0);
    assert!(one.1.iter().all(|(_, b)| around.contains(b.min) && around.contains(b.max)));
}

#[test]
fn parameters_follow_the_corners() {
    let mut mesh = FacetMesh::default();
    add_grid(&mut mesh, 1, 1, 0, |a, b| Point::new(a, b, 0.0));
    let mut r = Random(6);
    for _ in 0..200 {
        let (u, v) = (r.unit(), r.unit());
        let hit = ask(&mesh, &[Ray::new(Point::new(u, v, 1.0), -Vector::Z)])[0].unwrap();
        assert!((hit.uv.x - u).abs() < 1e-14 && (hit.uv.y - v).abs() < 1e-14, "{} for ({u}, {v})", hit.uv);
        assert_eq!(hit.geometric_normal, Vector::Z);
    }
}

#[test]
#[ignore = "ten million rays at edges, vertices and poles: a minute in release"]
fn ten_million_rays_slip_through_nowhere() {
    let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -2.0);
    let mut asked = 0;
    for (k, scale) in [1e-3, 1.0, 300.0, 1e3].into_iter().cycle().take(20).enumerate() {
        let shift = if k % 2 == 0 { 0.0 } else { 1e6 };
        let middle = Point::new(shift, -0.5 * shift, 0.1 * shift);
        let mesh = if k % 3 == 0 {
            globe(200, 100, |v| turn * v * scale + middle)
        } else {
            ball(60, |v| turn * v * scale + middle)
        };
        let tree = Octree::build(&mesh, &octree::Settings::default());
        let mut r = Random(1000 + k as u64);
        for _ in 0..50 {
            let rays: Vec<Ray> = (0..10_000).map(|i| at_a_seam(&mesh, middle, scale, i, &mut r)).collect();
            let mut hits = vec![None; rays.len()];
            tree.intersect_batch(&rays, &mut hits, &mut Cost::default());
            for (ray, hit) in rays.iter().zip(&hits) {
                assert!(hit.is_some(), "scale {scale}, shift {shift}: {ray:?} slipped through");
            }
            asked += rays.len();
        }
    }
    assert_eq!(asked, 10_000_000);
}

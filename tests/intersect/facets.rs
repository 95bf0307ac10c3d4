//! The contract of intersectors on facets, tested on every one of them.

use crate::departures::leave;
use crate::support::*;
use lampyris::intersect::bvh::{self, Bvh, Kind};
use lampyris::intersect::instanced::Instanced;
use lampyris::intersect::octree::{self, InstructionSet, Octree};
use lampyris::intersect::{Cost, Hit, Intersector};
use lampyris::math::{Aabb, FaceId, Frame, Point, Ray, Vector};
use lampyris::mesh::FacetMesh;
use lampyris::model::{Instancing, Placement};

/// Names and structures under test: all must give the same bits.
pub(crate) fn all(mesh: &FacetMesh) -> Vec<(&'static str, Box<dyn Intersector + '_>)> {
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
        ("octree, placed", Box::new(placed(mesh))),
        ("Bvh2", Box::new(Bvh::build(mesh, &bvh::Settings { kind: Kind::Bvh2, ..bvh }))),
        ("CwBvh", Box::new(Bvh::build(mesh, &bvh::Settings { kind: Kind::CwBvh, ..bvh }))),
    ]
}

/// The octree as that of a part which is placed where it is.
fn placed(mesh: &FacetMesh) -> Instanced<'_> {
    let usable = mesh.positions.iter().copied().filter(|p| p.abs().max_element() <= 1e12);
    let bounds = Aabb::from_points(usable).with_room();
    let place = Placement { group: 1, frame: Frame::IDENTITY, bounds, first_face: FaceId(0) };
    // Kept for the rest of the test run.
    let instancing = Box::leak(Box::new(Instancing::from_placements(Vec::new(), vec![place])));
    let nothing: &FacetMesh = Box::leak(Box::default());
    let octree = |mesh| Box::new(Octree::build(mesh, &octree::Settings::default())) as Box<dyn Intersector>;
    Instanced::new(instancing, vec![octree(nothing), octree(mesh)])
}

/// Asks all structures one by one and in a batch; all answers must be the same bits.
pub(crate) fn ask(mesh: &FacetMesh, rays: &[Ray]) -> Vec<Option<Hit>> {
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
            // From before the start on, by less and by more than the size of the mesh.
            2 => *ray = ray.with_range(-[0.3, 6.0, 300.0][k % 3], 9.0),
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
pub(crate) fn at_a_seam(mesh: &FacetMesh, middle: Point, size: f64, k: usize, r: &mut Random) -> Ray {
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
fn nothing_slips_through_a_small_mesh_seen_from_a_thousand_kilometres() {
    // The place where such a ray enters is rounded by 1e-7 mm: of a globe of a micrometre more than what single precision rounds.
    for (around, from_pole_to_pole, radius) in [(24, 13, 5e-3), (96, 49, 5e-4)] {
        seen_from_a_thousand_kilometres(&globe(around, from_pole_to_pole, |v| v * radius), radius);
    }
}

fn seen_from_a_thousand_kilometres(mesh: &FacetMesh, radius: f64) {
    let mut r = Random(90);
    let rays: Vec<Ray> = (0..6000)
        .map(|k| {
            let corners = mesh.corners(r.below(mesh.facets.len()));
            let target =
                [corners[0], corners[0].lerp(corners[1], r.unit()), corners[0].lerp(corners[2], r.unit())][k % 3];
            let inside = r.direction() * (0.4 * radius * r.unit());
            let origin = target + (target - inside).normalize() * 1e9;
            Ray::new(origin, (target - origin).normalize())
        })
        .collect();
    for instruction_set in [octree::Settings::default().instruction_set, InstructionSet::Portable] {
        let tree = Octree::build(mesh, &octree::Settings { instruction_set, ..octree::Settings::default() });
        let lost = rays.iter().filter(|ray| tree.intersect(ray, &mut Cost::default()).is_none()).count();
        assert_eq!(lost, 0);
    }
}

#[test]
fn an_edge_is_passed_on_the_side_where_it_is_passed() {
    // Cassini: of Fibonacci's numbers F(n − 1)·F(n + 1) − F(n)² is ±1, and their products in floats are the same. An edge from
    // (F(n − 1), F(n)) to −(F(n), F(n + 1)) passes the origin by 1e-15 of its length.
    let fibonacci = |n: usize| (0..n).fold([0i64, 1], |[a, b], _| [b, a + b])[0];
    for n in [70, 71] {
        let [a, b, c] = [n - 1, n, n + 1].map(|k| fibonacci(k) as f64 * 2f64.powi(-47));
        let left_of_edge =
            i128::from(fibonacci(n)).pow(2) - i128::from(fibonacci(n - 1)) * i128::from(fibonacci(n + 1));
        assert_eq!(b * b, a * c);
        for (corner, is_left) in [([2.0, -1.0], true), ([-2.0, 1.0], false)] {
            let corners = [Point::new(a, b, 0.0), Point::new(-b, -c, 0.0), Point::new(corner[0], corner[1], 0.0)];
            let mut mesh = FacetMesh { positions: corners.to_vec(), ..FacetMesh::default() };
            add_facet(&mut mesh, [0, 1, 2, 2], 0);
            let hits = ask(&mesh, &[Ray::new(Point::Z, -Vector::Z), Ray::new(-Point::Z, Vector::Z)]);
            for hit in hits {
                assert_eq!(hit.is_some(), is_left == (left_of_edge > 0), "F({n}), {corners:?}");
            }
        }
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

//! Trees of many levels, whose walk keeps longer stacks, and facets that no level parts.

use lampyris::intersect::bvh::{self, Bvh, Kind, Quality};
use lampyris::intersect::octree::{InstructionSet, Octree, Settings};
use lampyris::intersect::{Cost, Intersector};
use lampyris::math::{FaceId, Point, Ray, Uv, Vector};
use lampyris::mesh::{Facet, FacetMesh, MeshVertex};

/// Squares of sides 1, 1/2, 1/4 … that shrink toward the origin, so that each level of cells parts one of them from all smaller ones.
fn shrinking(count: u32) -> FacetMesh {
    let corner = |i: u32, k: u32| {
        let size = 0.5f64.powi(i as i32);
        Point::new(size * f64::from(1 + ((k ^ k >> 1) & 1)), size * f64::from(1 + (k >> 1)), size)
    };
    let positions: Vec<Point> = (0..count).flat_map(|i| (0..4).map(move |k| corner(i, k))).collect();
    let vertices =
        (0..4 * count).map(|position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO }).collect();
    let square = |i: u32| Facet { vertices: std::array::from_fn(|k| 4 * i + k as u32), face: FaceId(0) };
    FacetMesh { positions, vertices, facets: (0..count).map(square).collect(), sag: vec![] }
}

#[test]
fn rays_find_their_way_through_a_tree_that_is_not_shallow() {
    let mesh = shrinking(24);
    let rays: Vec<Ray> = (0..24)
        .map(|i| {
            let size = 0.5f64.powi(i);
            Ray::new(Point::new(1.25 * size, 1.5 * size, 4.0), -Vector::Z)
        })
        .collect();
    for instruction_set in [InstructionSet::Fastest, InstructionSet::Avx2, InstructionSet::Portable] {
        let settings = Settings { threshold: 1, max_depth: 32, instruction_set, ..Settings::textbook() };
        let octree = Octree::build(&mesh, &settings);
        assert!(octree.statistics().depth() > 8, "{}", octree.statistics());
        let mut hits = vec![None; rays.len()];
        octree.intersect_batch(&rays, &mut hits, &mut Cost::default());
        for (i, (ray, hit)) in rays.iter().zip(&hits).enumerate() {
            assert_eq!(hit.map(|hit| (hit.primitive, hit.t)), Some((i as u32, 4.0 - 0.5f64.powi(i as i32))));
            assert_eq!(octree.intersect(ray, &mut Cost::default()), *hit);
        }
    }
}

/// A square of 1 mm and, 1 mm above it, as many as `count` of 0.125 mm in one place.
fn stack(count: u32) -> FacetMesh {
    let corner = |from: f64, size: f64, z: f64, k: u32| {
        Point::new(from + size * f64::from((k ^ (k >> 1)) & 1), from + size * f64::from(k >> 1), z)
    };
    let square = |from: f64, size: f64, z: f64| (0..4).map(move |k| corner(from, size, z, k));
    let positions: Vec<Point> = square(0.0, 1.0, 0.0).chain(square(0.5, 0.125, 1.0)).collect();
    let vertices = (0..8).map(|position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO }).collect();
    let facet = |i: u32| Facet { vertices: [0, 1, 2, 3].map(|k| if i == 0 { k } else { 4 + k }), face: FaceId(0) };
    FacetMesh { positions, vertices, facets: (0..=count).map(facet).collect(), sag: vec![] }
}

/// A ray that ends at this place after 2 mm, slantwise: as shipped, obvhs loses rays along an axis.
fn onto(place: Point) -> Ray {
    let direction = Vector::new(0.1, 0.05, -1.0).normalize();
    Ray::new(place - 2.0 * direction, direction)
}

/// obvhs alone takes as many passes over them as there are facets.
#[test]
fn trees_over_twenty_thousand_facets_in_one_place_are_built() {
    let mesh = stack(20_000);
    let beside = onto(Point::new(0.25, 0.125, 0.0));
    let through = onto(Point::new(0.53, 0.56, 1.0));
    for (kind, quality, cured) in [
        (Kind::CwBvh, Quality::Medium, true),
        (Kind::Bvh2, Quality::Medium, true),
        (Kind::CwBvh, Quality::Medium, false),
        (Kind::Bvh2, Quality::VerySlow, false),
    ] {
        let tree = Bvh::build(&mesh, &bvh::Settings { kind, quality, cured, ..bvh::Settings::default() });
        let hit = tree.intersect(&beside, &mut Cost::default()).unwrap();
        assert!(hit.primitive == 0 && (hit.t - 2.0).abs() < 1e-5, "{kind:?} {cured}: {hit:?}");
        let hit = tree.intersect(&through, &mut Cost::default()).unwrap();
        assert!(hit.primitive > 0 && (hit.t - 2.0).abs() < 1e-5, "{kind:?} {cured}: {hit:?}");
    }
}

#[cfg(feature = "contenders")]
#[test]
fn contenders_build_over_twenty_thousand_facets_in_one_place() {
    use lampyris::intersect::contenders::{BinaryBvh, Parry};
    let mesh = stack(20_000);
    let beside = onto(Point::new(0.25, 0.125, 0.0));
    let (binary, parry) = (BinaryBvh::build(&mesh), Parry::build(&mesh));
    for tree in [&binary as &dyn Intersector, &parry] {
        let hit = tree.intersect(&beside, &mut Cost::default()).unwrap();
        assert!(hit.primitive == 0 && (hit.t - 2.0).abs() < 1e-5, "{hit:?}");
    }
}

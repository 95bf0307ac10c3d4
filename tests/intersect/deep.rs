//! Trees of many levels, whose walk keeps longer stacks.

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

//! The crate `parry3d`: a binary tree in f32, walked depth first, its triangles tested by its own test.

use crate::intersect::facet_triangles::TriangleCode;
use crate::intersect::{Cost, Footprint, Hit, Intersector, NormalMode, normals};
use crate::math::{Point, Ray};
use crate::mesh::FacetMesh;
use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector as Vector32;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};
use parry3d::query::Ray as Ray32;
use parry3d::query::details::local_ray_intersection_with_triangle;
use std::cell::Cell;
use std::time::Instant;

/// The hierarchy of the crate `parry3d` over the triangles of a mesh.
pub struct Parry<'m> {
    mesh: &'m FacetMesh,
    tree: Bvh,
    triangles: Vec<[Vector32; 3]>,
    codes: Vec<TriangleCode>,
    build_seconds: f64,
}

impl<'m> Parry<'m> {
    /// Builds the tree on one thread; facets with corners that are not finite or beyond 1e12 mm are left out.
    pub fn build(mesh: &'m FacetMesh) -> Self {
        let started = Instant::now();
        let codes = TriangleCode::enumerate(mesh);
        let triangles: Vec<[Vector32; 3]> = codes.iter().map(|code| code.corners(mesh).map(vector32)).collect();
        let boxes: Vec<Aabb> =
            (triangles.iter()).map(|[a, b, c]| Aabb { mins: a.min(*b).min(*c), maxs: a.max(*b).max(*c) }).collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        Self { mesh, tree, triangles, codes, build_seconds: started.elapsed().as_secs_f64() }
    }
}

fn vector32(p: Point) -> Vector32 {
    Vector32::new(p.x as f32, p.y as f32, p.z as f32)
}

impl Intersector for Parry<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        let own = ray.departure.map(|d| d.primitive);
        let query = Ray32::new(vector32(ray.origin), vector32(ray.direction));
        // Beyond what `f32` holds a range is as good as endless.
        let t_max = if ray.t_max < f64::from(f32::MAX) { ray.t_max as f32 } else { f32::MAX };
        let t_min = ray.t_min as f32;
        let tests = Cell::new(0);
        let nearest = self.tree.cast_ray(&query, t_max, |index, nearest| {
            if own == Some(self.codes[index as usize].facet()) {
                return None;
            }
            tests.set(tests.get() + 1);
            let [a, b, c] = self.triangles[index as usize];
            let t = local_ray_intersection_with_triangle(a, b, c, &query)?.0.time_of_impact;
            (t >= t_min && t <= nearest).then_some(t)
        });
        // Of a miss too.
        cost.tests += tests.get();
        let (found, t) = nearest?;
        let [a, b, c] = self.triangles[found as usize];
        let (_, weights) = local_ray_intersection_with_triangle(a, b, c, &query)?;
        let hit = self.codes[found as usize].hit(f64::from(t), [weights.y, weights.z].map(f64::from));
        Some(normals::describe(self.mesh, ray, &hit, NormalMode::default()))
    }

    fn footprint(&self) -> Footprint {
        let bytes = self.tree.total_memory_size() + size_of_val(&*self.triangles) + size_of_val(&*self.codes);
        Footprint { bytes, primitives: self.mesh.facets.len(), build_seconds: self.build_seconds }
    }
}

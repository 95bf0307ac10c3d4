//! The crate `bvh`: a binary tree in f64, its triangles tested by its own Möller–Trumbore.

use crate::intersect::facet_triangles::TriangleCode;
use crate::intersect::{Cost, Footprint, Hit, Intersector, NormalMode, normals};
use crate::math::{Point, Ray, Vector};
use crate::mesh::FacetMesh;
use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::Bvh;
use nalgebra::{Point3, Vector3};
use std::time::Instant;

/// The hierarchy of the crate `bvh` over the triangles of a mesh.
pub struct BinaryBvh<'m> {
    mesh: &'m FacetMesh,
    /// `None` over nothing, of which the crate makes no tree.
    tree: Option<Bvh<f64, 3>>,
    triangles: Vec<Triangle>,
    build_seconds: f64,
}

/// A triangle as the crate requires it.
struct Triangle {
    corners: [Point3<f64>; 3],
    code: TriangleCode,
    node: usize,
}

impl Bounded<f64, 3> for Triangle {
    fn aabb(&self) -> Aabb<f64, 3> {
        self.corners.iter().fold(Aabb::empty(), |bounds, corner| bounds.grow(corner))
    }
}

impl BHShape<f64, 3> for Triangle {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl<'m> BinaryBvh<'m> {
    /// Builds the tree on one thread; facets with corners that are not finite or beyond 1e12 mm are left out.
    pub fn build(mesh: &'m FacetMesh) -> Self {
        let started = Instant::now();
        let mut triangles: Vec<Triangle> = (TriangleCode::enumerate(mesh).into_iter())
            .map(|code| Triangle { corners: code.corners(mesh).map(point3), code, node: 0 })
            .collect();
        let tree = (!triangles.is_empty()).then(|| Bvh::build(&mut triangles));
        Self { mesh, tree, triangles, build_seconds: started.elapsed().as_secs_f64() }
    }
}

fn point3(p: Point) -> Point3<f64> {
    Point3::new(p.x, p.y, p.z)
}

fn vector3(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

impl Intersector for BinaryBvh<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        let tree = self.tree.as_ref()?;
        let own = ray.departure.map(|d| d.primitive);
        let query = bvh::ray::Ray::new(point3(ray.origin), vector3(ray.direction));
        let mut nearest = None;
        let mut t_max = ray.t_max;
        // Triangles come by the distance at which their boxes are entered: those behind the nearest hit end the search.
        for triangle in tree.nearest_traverse_iterator(&query, &self.triangles) {
            let entered = query.intersection_slice_for_aabb(&triangle.aabb()).map(|(t, _)| t);
            if entered.is_some_and(|t| t > t_max) {
                break;
            }
            if own == Some(triangle.code.facet()) {
                continue;
            }
            cost.tests += 1;
            let [a, b, c] = &triangle.corners;
            // The crate's test sees one side alone: from the other the corners come the other way around, and so do the weights.
            let front = query.intersects_triangle(a, b, c);
            let (found, weights) = if front.distance.is_finite() {
                (front.distance, [front.u, front.v])
            } else {
                let back = query.intersects_triangle(a, c, b);
                (back.distance, [back.v, back.u])
            };
            // A miss is reported as an infinite distance.
            if found.is_finite() && (ray.t_min..=t_max).contains(&found) {
                t_max = found;
                nearest = Some(triangle.code.hit(found, weights));
            }
        }
        nearest.map(|hit| normals::describe(self.mesh, ray, &hit, NormalMode::default()))
    }

    fn footprint(&self) -> Footprint {
        let nodes = self.tree.as_ref().map_or(0, |tree| size_of_val(&*tree.nodes));
        let bytes = nodes + size_of_val(&*self.triangles);
        Footprint { bytes, primitives: self.mesh.facets.len(), build_seconds: self.build_seconds }
    }
}

//! Surface rays, the most frequent in a simulation: they start on facets, where the ray before them hit.

use super::Random;
use super::rays::RaySource;
use crate::intersect::{Cost, Intersector};
use crate::math::{Departure, QuadHalf, Ray, Uv, Vector};
use crate::mesh::FacetMesh;
use std::ops::Range;

/// Rays of one path: it ends earlier where it leaves the model, and the next one begins.
pub const PATH: u64 = 4;

/// Paths of up to four rays that leave facets to either side in cosine-distributed directions; the first starts on the first triangle of a
/// facet drawn by area.
pub struct SurfacePaths<'a> {
    mesh: &'a FacetMesh,
    guide: &'a dyn Intersector,
    /// Area of the facets up to each, mm²; one whose first triangle has none adds nothing, because no ray can start there.
    areas: Vec<f64>,
    area: f64,
    seed: u64,
    count: u64,
}

impl<'a> SurfacePaths<'a> {
    /// Makes `count` rays, none where no facet's first triangle has an area; `guide` finds the points that the rays after the first leave,
    /// on the facets of `mesh`.
    pub fn new(mesh: &'a FacetMesh, guide: &'a dyn Intersector, seed: u64, count: u64) -> Self {
        let mut sum = 0.0;
        let areas: Vec<f64> = (0..mesh.facets.len())
            .map(|facet| {
                if first_normal(mesh, facet).is_some() {
                    sum += mesh.facet_area(facet);
                }
                sum
            })
            .collect();
        // Without area there is nowhere to start.
        let count = if sum > 0.0 { count } else { 0 };
        Self { mesh, guide, areas, area: sum, seed, count }
    }

    /// Makes the rays of a path: at the end of a shorter one the others start anew, so that each has its index.
    fn path_rays(&self, path: u64) -> Vec<Ray> {
        let mut random = Random::new(self.seed ^ 0x2f6b_1c09_a3d5_e871, path);
        let mut rays = Vec::with_capacity(PATH as usize);
        let mut ray = self.first_ray(&mut random);
        for _ in 0..PATH {
            rays.push(ray);
            ray = match self.guide.intersect(&ray, &mut Cost::default()) {
                // The side from which the ray came: paths stay in the space that they are in.
                Some(hit) => {
                    let side = if hit.geometric_normal.dot(ray.direction) > 0.0 { -1.0 } else { 1.0 };
                    let direction = cosine_direction(&mut random, hit.geometric_normal * side);
                    Ray::new(ray.point_at(hit.t), direction).with_departure(hit.departure())
                }
                None => self.first_ray(&mut random),
            };
        }
        rays
    }

    /// Draws a ray from anywhere on the first triangle of a facet drawn by area; facets whose first triangle has none are drawn again.
    fn first_ray(&self, random: &mut Random) -> Ray {
        loop {
            let wanted = random.unit() * self.area;
            let facet = self.areas.partition_point(|&area| area < wanted).min(self.areas.len() - 1);
            let [a, b, c, _] = self.mesh.corners(facet);
            let (mut u, mut v) = (random.unit(), random.unit());
            // The other half of the parallelogram, folded back into the triangle.
            if u + v > 1.0 {
                u = 1.0 - u;
                v = 1.0 - v;
            }
            // Either side: facets that bound nothing have two outsides.
            let side = if random.unit() < 0.5 { -1.0 } else { 1.0 };
            // A number exactly between two facets may fall on one that is left out.
            if let Some(normal) = first_normal(self.mesh, facet) {
                let (face, triangle) = (self.mesh.facets[facet].face, Some(QuadHalf::First));
                let departure = Departure { face, primitive: facet as u32, uv: Uv::ZERO, triangle };
                let direction = cosine_direction(random, normal * side);
                return Ray::new(a + (b - a) * u + (c - a) * v, direction).with_departure(departure);
            }
        }
    }
}

/// Returns the unit normal of the first triangle of a facet; `None` where it is a line or a point, as it may be where the second has all
/// the area.
fn first_normal(mesh: &FacetMesh, facet: usize) -> Option<Vector> {
    let [a, b, c, _] = mesh.corners(facet);
    (b - a).cross(c - a).try_normalize()
}

/// Draws a direction about a normal, cosine-distributed: the normal and a uniform direction added up.
fn cosine_direction(random: &mut Random, normal: Vector) -> Vector {
    (normal + random.direction()).try_normalize().unwrap_or(normal)
}

impl RaySource for SurfacePaths<'_> {
    fn len(&self) -> u64 {
        self.count
    }
    fn rays(&self, range: Range<u64>) -> Vec<Ray> {
        let range = range.start..range.end.min(self.count);
        let mut rays = Vec::new();
        let mut path = range.start / PATH;
        while path * PATH < range.end {
            let indexed = (path * PATH..).zip(self.path_rays(path));
            rays.extend(indexed.filter(|(index, _)| range.contains(index)).map(|(_, ray)| ray));
            path += 1;
        }
        rays
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::octree::Octree;
    use crate::math::{FaceId, Point};
    use crate::mesh::{Facet, MeshVertex};

    #[test]
    fn facets_whose_first_triangle_is_a_line_start_no_ray() {
        // Along x, then aside: the first three corners lie on a line, the second triangle has all the area.
        let places = [Point::ZERO, Point::X, 2.0 * Point::X, Point::Y];
        let vertex = |k: u32| MeshVertex { position: k, normal: Vector::Z, uv: Uv::ZERO };
        let mesh = FacetMesh {
            positions: places.to_vec(),
            vertices: (0..4).map(vertex).collect(),
            facets: vec![Facet { vertices: [0, 1, 2, 3], face: FaceId(0) }],
            sag: vec![0.0],
        };
        let octree = Octree::build(&mesh, &Default::default());
        assert_eq!(SurfacePaths::new(&mesh, &octree, 1, 8).len(), 0);
    }
}

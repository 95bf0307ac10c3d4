//! Intersectors that are slow and obviously right, to judge the judge with.
#![allow(dead_code, unreachable_pub)]

use lampyris::intersect::{Certainty, Cost, Footprint, Hit, Intersector};
use lampyris::math::{FaceId, Point, Ray, Uv, Vector};
use lampyris::mesh::FacetMesh;
use lampyris::nurbs::conic;
use std::f64::consts::PI;

/// Every facet of a mesh, one after the other (Möller and Trumbore).
pub struct Brute<'a>(pub &'a FacetMesh);

impl Intersector for Brute<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        let mut best: Option<Hit> = None;
        for (i, facet) in self.0.facets.iter().enumerate() {
            let corners = self.0.corners(i);
            let vertex = facet.vertices.map(|v| self.0.vertices[v as usize]);
            let triangles: &[[usize; 3]] = if facet.is_triangle() { &[[0, 1, 2]] } else { &[[0, 1, 2], [0, 2, 3]] };
            for &[a, b, c] in triangles {
                let Some((t, v, w)) = triangle(ray, [corners[a], corners[b], corners[c]]) else { continue };
                if t < ray.t_min || t > best.map_or(ray.t_max, |h| h.t) {
                    continue;
                }
                // The point that the ray leaves, on whichever facets share it.
                if ray.from.is_some() && t < 1e-12 * (1.0 + ray.origin.length()) {
                    continue;
                }
                let u = 1.0 - v - w;
                best = Some(Hit {
                    t,
                    normal: (vertex[a].normal * u + vertex[b].normal * v + vertex[c].normal * w).normalize(),
                    geometric_normal: (corners[b] - corners[a]).cross(corners[c] - corners[a]).normalize(),
                    face: facet.face,
                    primitive: i as u32,
                    uv: vertex[a].uv * u + vertex[b].uv * v + vertex[c].uv * w,
                    certainty: Certainty::Facet,
                });
            }
        }
        best
    }
    fn footprint(&self) -> Footprint {
        Footprint { primitives: self.0.facets.len(), ..Footprint::default() }
    }
}

fn triangle(ray: &Ray, [a, b, c]: [Point; 3]) -> Option<(f64, f64, f64)> {
    let (e, f) = (b - a, c - a);
    let p = ray.direction.cross(f);
    let det = e.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = ray.origin - a;
    let v = s.dot(p) / det;
    let q = s.cross(e);
    let w = ray.direction.dot(q) / det;
    // A hair of overlap: leaks of this test are none of the court's business.
    let inside = v >= -1e-12 && w >= -1e-12 && v + w <= 1.0 + 1e-12;
    inside.then(|| (f.dot(q) / det, v, w))
}

/// Spheres in closed form, each the one face of its number; parameters as in `nurbs::sweep::sphere` about z.
pub struct Balls(pub Vec<(Point, f64)>);

impl Intersector for Balls {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        let mut best: Option<Hit> = None;
        for (i, &(centre, radius)) in self.0.iter().enumerate() {
            let o = ray.origin - centre;
            let b = o.dot(ray.direction);
            let miss = (o - ray.direction * b).length_squared();
            if miss > radius * radius {
                continue;
            }
            let half = (radius * radius - miss).sqrt();
            for t in [-b - half, -b + half] {
                if t < ray.t_min || t > best.map_or(ray.t_max, |h| h.t) {
                    continue;
                }
                let n = (ray.at(t) - centre).normalize();
                best = Some(Hit {
                    t,
                    normal: n,
                    geometric_normal: n,
                    face: FaceId(i as u32),
                    primitive: i as u32,
                    uv: sphere_uv(n),
                    certainty: Certainty::Certified,
                });
            }
        }
        best
    }
    fn footprint(&self) -> Footprint {
        Footprint { primitives: self.0.len(), ..Footprint::default() }
    }
}

fn sphere_uv(n: Vector) -> Uv {
    let longitude = n.y.atan2(n.x).rem_euclid(2.0 * PI);
    let latitude = n.z.clamp(-1.0, 1.0).asin();
    Uv::new(
        conic::parameter_of_angle([0.0, 2.0 * PI], longitude),
        conic::parameter_of_angle([-PI / 2.0, PI / 2.0], latitude),
    )
}

/// Another intersector with its answers changed on the way.
pub struct Changed<'a, F>(pub &'a dyn Intersector, pub F);

impl<F: Fn(&Ray, Option<Hit>) -> Option<Hit> + Sync> Intersector for Changed<'_, F> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        (self.1)(ray, self.0.intersect(ray, cost))
    }
    fn footprint(&self) -> Footprint {
        self.0.footprint()
    }
}

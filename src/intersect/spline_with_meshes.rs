//! The exact spline beside facets of the faces that have no spline, as ready meshes have none: one nearest hit over both.
//!
//! A ray is traced against the spline first, then against an octree over those facets up to the hit on the spline.
//!
//! Guarantee: the nearest hit of both, of equal ones that on the spline; the same bits for a single ray and a batch.
//! Known weakness: where a ready mesh and a spline meet in one border each ends where it says itself, so that rays may pass between them.

use super::exact::Exact;
use super::octree::{self, Octree};
use super::{Cost, ExpectedRays, Footprint, Hit, Intersector};
use crate::math::Ray;
use crate::mesh::FacetMesh;
use smallvec::SmallVec;

/// Rays that are traced against one and then the other: as many as fit into the first-level cache with their hits.
const BATCH: usize = 64;

/// The spline of a model, and facets of the faces that it leaves out.
///
/// ```
/// use lampyris::intersect::exact::{self, Exact};
/// use lampyris::intersect::{Certainty, Cost, Intersector, octree, spline_with_meshes::SplineWithMeshes};
/// use lampyris::math::{FaceId, Frame, Point, Ray, Uv, Vector};
/// use lampyris::mesh::{Facet, FacetMesh, MeshVertex};
/// use lampyris::model::{Face, Model, Part, Shell};
/// use lampyris::nurbs::sweep;
/// # use std::f64::consts::{FRAC_PI_2, PI};
/// let ball = Face::whole(sweep::sphere(&Frame::IDENTITY, 1.0, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2]));
/// let part = Part { shells: vec![Shell { faces: vec![ball], ..Shell::default() }], ..Part::default() };
/// let exact = Exact::build(&Model::from_part(part), &exact::Settings::default());
///
/// let positions = [[0.0, -9.0], [9.0, -9.0], [9.0, 9.0], [0.0, 9.0]].map(|[x, y]| Point::new(x, y, 3.0)).to_vec();
/// let vertices = (0..4).map(|position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO }).collect();
/// let facets = vec![Facet { vertices: [0, 1, 2, 3], face: FaceId(1) }];
/// let half_plane = FacetMesh { positions, vertices, facets, sag: vec![] };
///
/// let both = SplineWithMeshes::new(&exact, &half_plane, &octree::Settings::default());
/// let down = |x: f64| both.intersect(&Ray::new(Point::new(x, 0.0, 5.0), -Vector::Z), &mut Cost::default()).unwrap();
/// assert_eq!((down(0.6).face, down(0.6).t), (FaceId(1), 2.0));
/// assert_eq!((down(-0.6).face, down(-0.6).certainty), (FaceId(0), Certainty::Certified));
/// ```
pub struct SplineWithMeshes<'a> {
    exact: &'a Exact,
    meshes: Octree<'a>,
}

impl<'a> SplineWithMeshes<'a> {
    /// Builds the octree over `meshes`, the facets of faces that the spline leaves out ([`Exact::skipped`]), with their numbers.
    pub fn new(exact: &'a Exact, meshes: &'a FacetMesh, settings: &octree::Settings) -> Self {
        Self { exact, meshes: Octree::build(meshes, settings) }
    }

    /// The ray for the spline: one that leaves a mesh leaves nothing of the spline.
    fn spline_ray(&self, ray: &Ray) -> Ray {
        Ray { departure: ray.departure.filter(|from| self.exact.traces(from.face)), ..*ray }
    }

    /// The ray for the meshes, up to the spline's hit.
    fn mesh_ray(&self, ray: &Ray, spline: Option<&Hit>) -> Ray {
        let departure = ray.departure.filter(|from| !self.exact.traces(from.face));
        Ray { departure, t_max: spline.map_or(ray.t_max, |hit| hit.t), ..*ray }
    }

    /// Answers at most [`BATCH`] rays: overwrites `hits` and counts each ray once.
    fn intersect_chunk(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        let mut queries: SmallVec<[Ray; BATCH]> = rays.iter().map(|ray| self.spline_ray(ray)).collect();
        self.exact.intersect_batch(&queries, hits, cost);
        for (query, (ray, hit)) in queries.iter_mut().zip(rays.iter().zip(hits.iter())) {
            *query = self.mesh_ray(ray, hit.as_ref());
        }
        let mut on_meshes = [None; BATCH];
        let on_meshes = &mut on_meshes[..rays.len()];
        // However many structures were queried, it was one ray.
        let counted = cost.rays;
        self.meshes.intersect_batch(&queries, on_meshes, cost);
        cost.rays = counted;
        for (hit, on_mesh) in hits.iter_mut().zip(on_meshes) {
            let Some(found) = on_mesh else { continue };
            if hit.is_none_or(|spline| found.t < spline.t) {
                *hit = Some(*found);
            }
        }
    }
}

impl Intersector for SplineWithMeshes<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        let mut hit = [None];
        self.intersect_chunk(std::slice::from_ref(ray), &mut hit, cost);
        hit[0]
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            self.intersect_chunk(rays, hits, cost);
        }
    }

    fn prepare_for(&self, expected: &ExpectedRays<'_>) {
        self.exact.prepare_for(expected);
        self.meshes.prepare_for(expected);
    }

    fn footprint(&self) -> Footprint {
        self.exact.footprint() + self.meshes.footprint()
    }
}

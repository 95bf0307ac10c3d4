//! The way before: every ray against every spline surface, without a search structure over the patches and without proof.
//!
//! Each surface is rejected by its bounding box alone. On what is left Newton's method starts from sampled seeds: the local
//! minima, over a grid of samples, of the distance to the ray. The points found are collected, trimmed and sorted by distance.
//! With a single seed in the middle it is the plain iterative tracer.
//!
//! Guarantee: none; a hit is on the spline, but it may not be the first, and a hit may be missed. Evaluation runs on Bézier
//! patches, as fast as the polishing of facet hits.

use super::newton::SurfacePoint;
use super::structure::Exact;
use super::tolerances::SAME_POINT;
use crate::intersect::{Certainty, Cost, Footprint, Hit, Intersector};
use crate::math::{Aabb, FaceId, Point, Ray, Uv};
use crate::model::Model;
use std::time::Instant;

/// A point this near to the one that a ray leaves is that point, mm: a thousand times what a start is off.
const OWN_POINT: f64 = 1e-6;
/// Newton steps from a seed.
const STEPS: u32 = 20;

/// Where Newton's method starts on a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seeds {
    /// At local minima of the distance to the ray over a grid with this many samples to a Bézier patch and direction.
    Sampled(u32),
    /// Once, in the middle of the domain.
    Middle,
}

/// Every ray against every surface.
///
/// ```
/// use lampyris::intersect::exact::traditional::{Seeds, Traditional};
/// use lampyris::intersect::exact::{Exact, Settings};
/// use lampyris::intersect::{Cost, Intersector};
/// use lampyris::math::{Frame, Point, Ray, Vector};
/// use lampyris::model::{Face, Model, Part, Shell};
/// use lampyris::nurbs::sweep;
///
/// let tube = Face::whole(sweep::cylinder(&Frame::IDENTITY, 10.0, [0.0, 3.0], [0.0, 20.0]));
/// let model = Model::from_part(Part { shells: vec![Shell { faces: vec![tube], ..Shell::default() }], ..Part::default() });
/// let exact = Exact::build(&model, &Settings::default());
/// let slow = Traditional::new(&model, &exact, Seeds::Sampled(4));
/// let hit = slow.intersect(&Ray::new(Point::new(0.0, 30.0, 5.0), -Vector::Y), &mut Cost::default()).unwrap();
/// assert!((hit.t - 20.0).abs() < 1e-9);
/// ```
#[derive(Debug)]
pub struct Traditional<'a> {
    exact: &'a Exact,
    surfaces: Vec<SampledSurface>,
    build_seconds: f64,
}

/// A face's surface with the samples from which Newton's method starts.
#[derive(Debug)]
struct SampledSurface {
    face: FaceId,
    /// Around its control points, in the world.
    bounds: Aabb,
    /// Samples in u and in v.
    counts: [usize; 2],
    /// Parameters and the place in the world, v fastest.
    samples: Vec<(Uv, Point)>,
}

impl<'a> Traditional<'a> {
    /// Samples the surfaces of `model`, which must be the one that `exact` was built from; faces that this skips are left out.
    pub fn new(model: &Model, exact: &'a Exact, seeds: Seeds) -> Self {
        let start = Instant::now();
        let surfaces = model
            .placed_faces()
            .filter_map(|placed| {
                let record = *exact.geometry.by_id.get(&placed.id)? as usize;
                let surface = &placed.face?.surface;
                let points = surface.points.iter().map(|p| placed.placement.point(p.project()));
                let bounds = Aabb::from_points(points);
                let grid = &exact.geometry.grids[exact.geometry.faces[record].grid as usize];
                let [us, vs] = [0, 1].map(|d| match seeds {
                    Seeds::Middle => {
                        let [a, b] = surface.domain()[d];
                        vec![0.5 * (a + b)]
                    }
                    Seeds::Sampled(n) => grid.breaks[d].windows(2).flat_map(|w| middles(w[0], w[1], n)).collect(),
                });
                let samples = us
                    .iter()
                    .flat_map(|&u| vs.iter().map(move |&v| Uv::new(u, v)))
                    .map(|uv| (uv, placed.placement.point(surface.evaluate(uv))))
                    .collect();
                Some(SampledSurface {
                    face: placed.id,
                    bounds: bounds.grown(SAME_POINT * (1.0 + bounds.diagonal())),
                    counts: [us.len(), vs.len()],
                    samples,
                })
            })
            .collect();
        Self { exact, surfaces, build_seconds: start.elapsed().as_secs_f64() }
    }

    /// Adds the roots of a surface inside its trims that Newton's method reaches from samples that are nearer to the ray than their
    /// neighbours, whatever the range of the ray; one may be added twice.
    fn candidates(&self, ray: &Ray, surface: &SampledSurface, found: &mut Vec<(FaceId, SurfacePoint)>) {
        let distances: Vec<f64> =
            // Squared distances suffice to find the minima.
            surface.samples.iter().map(|(_, p)| (*p - ray.origin).cross(ray.direction).length_squared()).collect();
        let [nu, nv] = surface.counts;
        for i in 0..nu {
            for j in 0..nv {
                let here = distances[i * nv + j];
                let is = i.saturating_sub(1)..=(i + 1).min(nu - 1);
                let js = j.saturating_sub(1)..=(j + 1).min(nv - 1);
                // Newton's method starts where a sample is nearer to the ray than its neighbours.
                if is.flat_map(|a| js.clone().map(move |b| a * nv + b)).any(|k| distances[k] < here) {
                    continue;
                }
                let seed = surface.samples[i * nv + j].0;
                if let Some(point) = self.exact.converge(ray, surface.face, seed, STEPS).filter(|p| p.inside) {
                    found.push((surface.face, point));
                }
            }
        }
    }
}

/// The middles of `n` equal parts of an interval.
fn middles(a: f64, b: f64, n: u32) -> impl Iterator<Item = f64> {
    (0..n).map(move |k| a + (b - a) * (f64::from(k) + 0.5) / f64::from(n))
}

impl Intersector for Traditional<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        let mut found = Vec::new();
        for surface in &self.surfaces {
            cost.nodes += 1;
            if surface.bounds.clip(ray).is_some() {
                cost.tests += 1;
                self.candidates(ray, surface, &mut found);
            }
        }
        found.sort_by(|a, b| a.1.t.total_cmp(&b.1.t));
        let leaving = |face: FaceId, p: &SurfacePoint| {
            ray.departure.is_some_and(|f| {
                f.face == face
                    && p.t.abs() < OWN_POINT
                    && self.exact.distance_at(face, f.uv, ray.point_at(p.t)).is_some_and(|d| d < OWN_POINT)
            })
        };
        let first = found.into_iter().find(|(face, p)| p.t >= ray.t_min && p.t <= ray.t_max && !leaving(*face, p));
        first.map(|(face, p)| Hit {
            t: p.t,
            normal: p.normal,
            geometric_normal: p.normal,
            face,
            primitive: p.patch,
            triangle: None,
            uv: p.uv,
            certainty: Certainty::Uncertified,
        })
    }

    fn footprint(&self) -> Footprint {
        let samples: usize = self.surfaces.iter().map(|s| size_of_val(&*s.samples)).sum();
        Footprint {
            bytes: size_of_val(&*self.surfaces) + samples,
            primitives: self.surfaces.len(),
            build_seconds: self.build_seconds,
        }
    }
}

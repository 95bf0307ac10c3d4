//! Rays that facets are tried with, and how far off they send them.

use super::direction_error::error_of_hit;
use super::light::JobLight;
use super::survey::{Survey, p99};
use crate::intersect::{Cost, Hit, Intersector};
use crate::math::{FaceId, Ray};
use crate::study::mesh_source::{MeshSource, answer};
use rayon::prelude::*;
use std::time::Instant;

/// Rays with their exact hits.
pub(super) struct ReferenceRays {
    pub(super) rays: Vec<Ray>,
    pub(super) truth: Vec<Option<Hit>>,
    /// Of each ray that hits something the refractive index before its hit over that behind it; `None` where no light passes.
    index_ratios: Vec<Option<f64>>,
}

impl ReferenceRays {
    /// Traces all rays on the spline, on the current rayon pool, and keeps its hits, with the indices that `light` has there.
    pub(super) fn new(mesh_source: &dyn MeshSource, rays: Vec<Ray>, light: JobLight<'_>) -> Self {
        let mut truth = vec![None; rays.len()];
        answer(mesh_source.exact(), &rays, rayon::current_num_threads(), &mut truth);
        let index_ratio = |(ray, hit): (&Ray, &Option<Hit>)| (light.index_ratio)(ray, hit.as_ref()?);
        let index_ratios = rays.par_iter().zip(&truth).map(index_ratio).collect();
        Self { rays, truth, index_ratios }
    }

    /// Traces the rays on facets, on the current rayon pool, and compares where light goes with the spline, as [`error_of_hit`] does; what
    /// hits flat faces, of which `survey` knows, is only counted.
    pub(super) fn compare(&self, facets: &dyn Intersector, apart_mm: f64, survey: &Survey) -> DirectionErrors {
        let mut hits = vec![None; self.rays.len()];
        let start = Instant::now();
        let cost = answer(facets, &self.rays, rayon::current_num_threads(), &mut hits);
        let mut found = DirectionErrors { cost, seconds: start.elapsed().as_secs_f64(), ..Default::default() };
        let truths = self.truth.iter().zip(&self.index_ratios);
        for ((ray, hit), (truth, &index_ratio)) in self.rays.iter().zip(&hits).zip(truths) {
            let error = match (hit, truth) {
                (None, None) => continue,
                (Some(hit), Some(truth)) => {
                    let error = error_of_hit(ray.direction, [hit, truth], apart_mm, index_ratio);
                    error.map(|error| (truth.face, error))
                }
                _ => None,
            };
            // In another place there is no angle: such rays are counted apart from the percentile.
            match error {
                // However many they are, they must not make up for those that err.
                Some((face, _)) if survey.is_flat(face) => found.flat += 1,
                Some(error) => found.errors.push(error),
                None => found.flips += 1,
            }
        }
        found
    }
}

/// Direction errors of some rays on facets.
#[derive(Default)]
pub(super) struct DirectionErrors {
    /// Of hits on curved faces, degrees, with the face that the spline's hit is on.
    pub(super) errors: Vec<(FaceId, f64)>,
    /// Rays that hit flat faces, where facets do not err.
    pub(super) flat: u64,
    /// Rays that hit facets or spline alone, or faces in other places.
    pub(super) flips: u64,
    /// The facets' work and seconds for all rays.
    pub(super) cost: Cost,
    pub(super) seconds: f64,
}

impl DirectionErrors {
    /// Returns the 99th percentile over curved faces, degrees, 0 where rays hit flat ones alone; `None` where no ray has an angle.
    pub(super) fn percentile(&self) -> Option<f64> {
        p99(&mut self.errors.iter().map(|e| e.1).collect::<Vec<f64>>()).or(self.of_flat_faces())
    }

    /// Returns the largest error, degrees; `None` where no ray has an angle.
    pub(super) fn largest(&self) -> Option<f64> {
        self.errors.iter().map(|e| e.1).max_by(f64::total_cmp).or(self.of_flat_faces())
    }

    /// Returns the error of rays that hit flat faces; `None` where there are none.
    fn of_flat_faces(&self) -> Option<f64> {
        (self.flat > 0).then_some(0.0)
    }
}

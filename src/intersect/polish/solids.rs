//! Whether an answer fits the inside of closed solids, which a ray enters and leaves in turn.

use super::Polished;
use crate::intersect::Hit;
use crate::math::{Departure, Ray, Vector};

impl Polished<'_> {
    /// Whether an answer cannot be: a ray that goes into a closed solid comes out of it again, one that comes out goes into it. Always
    /// `false` for a ray that leaves no closed solid; no answer is impossible only for an endless ray that goes in.
    pub(super) fn is_impossible(
        &self,
        ray: &Ray,
        (from, normal): (&Departure, Vector),
        answer: Option<&Hit>,
    ) -> bool {
        let Some(solid) = self.exact.solid_of(from.face) else { return false };
        let inward = normal.dot(ray.direction) < 0.0;
        match answer {
            // In a range that ends it may just not have come out yet.
            None => inward && ray.t_max == f64::INFINITY,
            Some(hit) if self.exact.solid_of(hit.face) == Some(solid) => {
                inward != (hit.geometric_normal.dot(ray.direction) > 0.0)
            }
            Some(_) => false,
        }
    }

    /// Whether the spline must be asked about an answer: it cannot be, or where two solids touch the facets of one may hide the other's, as
    /// when a ray inside a solid comes to another first, or comes out of one that it has not been seen to enter.
    pub(super) fn is_doubtful(&self, ray: &Ray, left: (&Departure, Vector), answer: Option<&Hit>) -> bool {
        let solid = |face| self.exact.solid_of(face);
        let other = |hit: &Hit| {
            let (inward, out) = (left.1.dot(ray.direction) < 0.0, hit.geometric_normal.dot(ray.direction) > 0.0);
            (inward || out) && solid(hit.face).is_some() && solid(hit.face) != solid(left.0.face)
        };
        answer.is_some_and(other) || self.is_impossible(ray, left, answer)
    }

    /// Whether a ray comes out of a closed solid by its answer, no answer being none: beside an edge it may have passed the facets of the
    /// side where it went in.
    pub(super) fn comes_out(&self, ray: &Ray, answer: Option<&Hit>) -> bool {
        answer.is_some_and(|hit| {
            hit.geometric_normal.dot(ray.direction) > 0.0 && self.exact.solid_of(hit.face).is_some()
        })
    }
}

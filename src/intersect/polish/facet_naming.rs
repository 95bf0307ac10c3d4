//! The facets at places that the spline alone answered.
//!
//! A ray that leaves a place of which no facet is known is asked of the spline, and so would be all that follow it on their path: in a rod or
//! an integrating sphere these were most segments.

use super::limits::OWN_POINT;
use super::{NO_FACET, Polished};
use crate::intersect::{Cost, Hit};
use crate::math::Ray;

/// Memory of a search.
#[derive(Default)]
pub(super) struct Probes {
    /// Short rays across the spline, and the hits that each starts from, by index.
    rays: Vec<Ray>,
    of: Vec<u32>,
    hits: Vec<Option<Hit>>,
}

impl Polished<'_> {
    /// Names in `hits`, those of `rays`, the facets that lie at places of which none is known; where another face's comes first none is
    /// named. No ray is counted.
    pub(super) fn name_facets(&self, rays: &[Ray], hits: &mut [Option<Hit>], probes: &mut Probes, cost: &mut Cost) {
        let Probes { rays: across, of, hits: met } = probes;
        across.clear();
        of.clear();
        // Across the spline, not along the ray, which may come in flat and meet the facet far away.
        let reach = 2.0 * self.sag + OWN_POINT;
        for (k, (ray, hit)) in rays.iter().zip(hits.iter()).enumerate() {
            if let Some(hit) = hit.filter(|hit| hit.primitive == NO_FACET) {
                let normal = hit.geometric_normal;
                across.push(Ray::new(ray.point_at(hit.t) - reach * normal, normal).with_range(0.0, 2.0 * reach));
                of.push(k as u32);
            }
        }
        if across.is_empty() {
            return;
        }
        met.clear();
        met.resize(across.len(), None);
        let mut own = Cost::default();
        self.facets.intersect_batch(across, met, &mut own);
        *cost += Cost { rays: 0, ..own };
        for (&k, met) in of.iter().zip(met.iter()) {
            if let (Some(hit), Some(met)) = (&mut hits[k as usize], met)
                && met.face == hit.face
            {
                (hit.primitive, hit.triangle) = (met.primitive, met.triangle);
            }
        }
    }
}

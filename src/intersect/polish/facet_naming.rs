//! The facets at places that the spline alone answered.
//!
//! A ray that leaves a place of which no facet is known is traced on the spline, and so would be all that follow it on their path: in a rod
//! or an integrating sphere most segments.

use super::limits::{OWN_POINT, PLACE_OF_SAGS};
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
    /// Names in `hits`, those of `rays`, the facets that lie at places of which none is known. None is named where another comes first: of
    /// another face, or of the far side of a part that is thinner than the largest sag. No ray is counted.
    pub(super) fn name_facets(&self, rays: &[Ray], hits: &mut [Option<Hit>], probes: &mut Probes, cost: &mut Cost) {
        let Probes { rays: across, of, hits: met } = probes;
        across.clear();
        of.clear();
        // Across the spline, not along the ray, which may come in flat and meet the facet far away.
        let reach = PLACE_OF_SAGS * self.sag + OWN_POINT;
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
            let (Some(hit), Some(met)) = (&mut hits[k as usize], met) else { continue };
            let sag = f64::from(self.records[met.primitive as usize].sag);
            let is_near = (met.t - reach).abs() <= PLACE_OF_SAGS * sag + OWN_POINT;
            let faces_alike = met.geometric_normal.dot(hit.geometric_normal) > 0.0;
            if met.face == hit.face && is_near && faces_alike {
                (hit.primitive, hit.triangle) = (met.primitive, met.triangle);
            }
        }
    }
}

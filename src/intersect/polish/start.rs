//! Which rays are traced on the facets: those whose start is on the same side of the facets as of the spline.

use super::Polished;
use super::clear_start::ClearStart;
use super::curved_cells::LOOK_BACK_OF_FLAT;
use super::limits::{BEND_OF_SAGS, HIDDEN_BENDS, LEAST_SLACK_SINE, SHORT_OF_SAGS};
#[cfg(doc)]
use super::slabs::Slabs;
use crate::math::{Departure, Point, Ray, Uv, Vector, distance_to_triangle};

/// To which side of its surface a ray leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Inward,
    Outward,
}

/// How a ray is traced on the facets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// How far before and behind its range it looks for facets, mm.
    pub(super) slack: [f64; 2],
    /// `None` for a ray that leaves no surface.
    pub(super) side: Option<Side>,
}

impl Polished<'_> {
    /// How a ray is traced on the facets; `None` for one that must be traced on the spline, as it is short, names no facet of its face,
    /// leaves so flat that its next root may hide from the facets, or starts between a face and its facets.
    #[inline(always)]
    pub(super) fn start(&self, ray: &Ray, clear: &[ClearStart]) -> Option<Start> {
        let slack = 2.0 * self.sag;
        let Some(from) = &ray.departure else {
            // Where nothing can lie behind the start no look back is needed, and the ray stays one that light
            // buffers know.
            let is_clear = ray.t_min == 0.0 && clear.iter().any(|start| start.holds(ray));
            if is_clear {
                return Some(Start { slack: [0.0, slack], side: None });
            }
            let place = ray.point_at(ray.t_min);
            let is_near = self.curved.may_be_near(place);
            // Of what starts between a facet and the spline the way back may miss the facet, and light left a ball that it began in.
            if is_near && self.slabs.hold(self.mesh, place) {
                return None;
            }
            let back = if is_near { slack } else { LOOK_BACK_OF_FLAT };
            return Some(Start { slack: [back, slack], side: None });
        };
        // A departure from the spline alone names no facet, and one that names another face's says nothing of the
        // side that is left.
        let record = self.records.get(from.primitive as usize).filter(|r| r.face == from.face)?;
        let is_long = ray.t_max - ray.t_min > SHORT_OF_SAGS * self.sag;
        let place = ray.point_at(ray.t_min);
        let is_covered = is_long && self.is_covered(from.primitive, from.uv, place);
        if !is_covered || self.slabs.meet(self.mesh, from.primitive, [place; 2]) {
            return None;
        }
        let sine = match record.decisive_sine(ray) {
            Some(sine) => f64::from(sine),
            None => self.sine_of_spline(ray, from)?,
        };
        let side = if sine < 0.0 { Side::Inward } else { Side::Outward };
        Some(Start { slack: [slack / sine.abs().max(LEAST_SLACK_SINE); 2], side: Some(side) })
    }

    /// Whether a place, mm, of the spline with its parameters is so near to a facet that [`Slabs::meet`] covers it: on the facet's own
    /// piece, or within reach. Of a ray that came in flat the root lies beside the piece.
    #[inline(always)]
    pub(super) fn is_covered(&self, facet: u32, uv: Uv, place: Point) -> bool {
        self.pieces[facet as usize].contains(uv) || {
            let [a, b, c, d] = self.mesh.corners(facet as usize);
            let distance = distance_to_triangle(place, [a, b, c]).min(distance_to_triangle(place, [a, c, d]));
            distance <= self.slabs.reach()
        }
    }

    /// The sine at which a ray leaves the spline, negative for rays that go in, or one of its sign that is no larger; `None` where its next
    /// root may hide between the spline and the facet, or nothing is known of the spline.
    ///
    /// On the way to such a root the sine to the surface turns from the one at the start to its negative, and it does so within about a
    /// facet; as far as the normals at the corners show, it must not.
    fn sine_of_spline(&self, ray: &Ray, from: &Departure) -> Option<f64> {
        let facet = from.primitive as usize;
        let sines =
            self.mesh.facets[facet].vertices.map(|v| self.mesh.vertices[v as usize].normal.dot(ray.direction));
        let least = sines.into_iter().fold(f64::INFINITY, f64::min);
        let most = sines.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let [a, b, c, d] = self.mesh.corners(facet);
        let sides = [b - a, c - b, d - c, a - d].map(Vector::length_squared);
        let length = sides.into_iter().fold(0.0, f64::max).sqrt();
        let least_bend = BEND_OF_SAGS * f64::from(self.records[facet].sag) / length;
        // The sine at the start is between those at the corners: where these differ little beside it, it need not be known, and the
        // spline need not be evaluated.
        let bounded = if least > 0.0 { least } else { most };
        if least * most > 0.0 && bounded.abs() > HIDDEN_BENDS * (most - least).max(least_bend) {
            return Some(bounded);
        }
        let normal = self.exact.normal_at(from.face, from.uv)?;
        let sine = normal.dot(ray.direction);
        let bend = (sine - least).max(most - sine).max(least_bend);
        (sine.abs() > HIDDEN_BENDS * bend).then_some(sine)
    }
}

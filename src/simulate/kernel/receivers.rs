//! Receivers on the way of a ray.

use super::context::Context;
use super::path::{NO_RECEIVER, Path, SCATTERS};
use super::payload::RayPayload;
use super::receiver_index::Candidates;
use super::tolerances::{LONGEST_SEGMENT, in_front};
use super::tracer::{Tracer, remaining_quanta};
use crate::intersect::Hit;
use crate::math::{Point, Ray};
use crate::simulate::random::Purpose;
use crate::simulate::receiver::{Receiver, Spot};
use crate::simulate::sequence::DepositPlace;
use crate::simulate::tally::{quanta_as_integer, round_quanta};

/// Sets `ray.t_max` and `path.receiver` to the next scattering, or to the nearest receiver among the faces that stops light; leaves the ray
/// unclipped where there is neither. A face may still come first.
#[inline(always)]
pub(super) fn clip_segment<C: RayPayload>(context: &Context<'_>, path: &mut Path<C>, ray: &mut Ray) {
    path.receiver = NO_RECEIVER;
    if C::MEDIA
        && let Some(scatter) = &context.bound.bodies[path.payload.body() as usize].scatter
    {
        // The free path is drawn for each segment anew: it has no memory, so that a face in between changes nothing
        // of its law.
        ray.t_max = scatter.free_path(path.key(context).unit(Purpose::Bulk));
        path.receiver = SCATTERS;
    }
    let mut room = Candidates::new();
    for &r in context.blocking.candidates(ray, ray.t_max, &mut room) {
        if let Some(t) = context.bound.receivers[r as usize].crossing(ray, ray.t_min, ray.t_max) {
            // One that lies in a face is met before the face.
            ray.t_max = (t - in_front(ray, t)).max(ray.t_min);
            path.receiver = r;
        }
    }
}

/// Sets `ray.t_max` and `path.receiver` to the nearest receiver outside the scene's box that stops light, if it comes before the hit, and
/// returns `None` then; else returns `hit`.
#[inline(always)]
pub(super) fn clip_outside<'h, C: RayPayload>(
    context: &Context<'_>,
    path: &mut Path<C>,
    ray: &mut Ray,
    hit: Option<&'h Hit>,
) -> Option<&'h Hit> {
    if context.outside.is_empty() {
        return hit;
    }
    let mut end = ray.t_max;
    if let Some(h) = hit {
        // The box is convex: with both ends inside, all of the segment is.
        if context.region.contains(ray.origin) && context.region.contains(ray.point_at(h.t)) {
            return hit;
        }
        end = h.t;
    }
    let mut first = None;
    let mut room = Candidates::new();
    // `end` shrinks with every receiver that is met, so that the nearest one is left.
    for &r in context.outside.candidates(ray, end, &mut room) {
        if let Some(t) = context.bound.receivers[r as usize].crossing(ray, ray.t_min, end) {
            (end, first) = (t, Some(r));
        }
    }
    let Some(r) = first else { return hit };
    ray.t_max = end;
    path.receiver = r;
    None
}

/// Returns where on its ray a segment without a hit ends, mm: on a receiver at the receiver itself, of which `ray.t_max` may come a
/// rounding short; else at `ray.t_max`.
#[inline(always)]
fn end_without_hit<C: RayPayload>(context: &Context<'_>, path: &Path<C>, ray: &Ray) -> f64 {
    if matches!(path.receiver, NO_RECEIVER | SCATTERS) {
        return ray.t_max;
    }
    // The crossing that clipped the segment is the nearest one of its receiver, and so is found once more, to the last bit.
    let receiver = &context.bound.receivers[path.receiver as usize];
    receiver.crossing(ray, ray.t_min, f64::INFINITY).unwrap_or(ray.t_max)
}

impl<C: RayPayload> Tracer<'_, '_, C> {
    /// Counts the light of a segment on receivers that let it pass, as what a body of this absorption, 1/mm, leaves of it up to there; a
    /// sphere may count it twice.
    pub(super) fn count_passing(&mut self, path: &Path<C>, ray: &Ray, hit: Option<&Hit>, absorption: f64) {
        let context = self.context;
        let length = hit.map_or(ray.t_max, |h| h.t);
        let end = hit.map_or_else(|| end_without_hit(context, path, ray), |h| h.t);
        // A receiver that lies in a face, or on one that ends light, is crossed on the way there, not on the way from it.
        let start = ray.t_min + in_front(ray, 0.0);
        let end = end + in_front(ray, end.min(LONGEST_SEGMENT));
        let mut room = Candidates::new();
        for &r in context.passing.candidates(ray, end, &mut room) {
            // A sphere may be crossed twice.
            let mut passed = start;
            while let Some(t) = context.bound.receivers[r as usize].crossing(ray, passed, end) {
                // No more than the body takes on the whole segment: a receiver in its end is met a rounding later.
                let arriving = remaining_quanta(path.quanta, absorption, t.min(length));
                self.count_at(path, arriving, r, ray.point_at(t));
                passed = t;
            }
        }
    }

    /// Adds so many quanta of a path to receiver `r`, a plane, disc or sphere, which it meets at a point; nothing after another number of
    /// bounces than the receiver asks for.
    #[inline(always)]
    pub(super) fn count_at(&mut self, path: &Path<C>, quanta: f64, r: u32, point: Point) {
        let receiver = &self.context.bound.receivers[r as usize];
        // Receivers that count light after so many bounces only.
        if !C::ENDS_ONLY && receiver.interactions.is_some_and(|n| n != path.bounce) {
            return;
        }
        if let Some(spot) = receiver.spot(point) {
            self.deposit(receiver, path, quanta, r, &spot);
        }
    }

    /// Counts light that leaves the scene in every far field, and returns whether its direction is in the range of any: also of one that
    /// counts other bounces only.
    #[inline(always)]
    pub(super) fn count_far(&mut self, path: &Path<C>, ray: &Ray) -> bool {
        let context = self.context;
        let mut received = false;
        for &r in &context.far {
            let receiver = &context.bound.receivers[r as usize];
            if let Some(spot) = receiver.direction(ray.direction) {
                received = true;
                if C::ENDS_ONLY || receiver.interactions.is_none_or(|n| n == path.bounce) {
                    self.deposit(receiver, path, path.quanta, r, &spot);
                }
            }
        }
        received
    }

    /// Adds so many quanta of a path to receiver `r` at a spot: to its cell, its total, its moments and its channels.
    #[inline(always)]
    fn deposit(&mut self, receiver: &Receiver, path: &Path<C>, quanta: f64, r: u32, spot: &Spot) {
        let r = r as usize;
        let tally = &mut *self.tally;
        // Cells are added up later, in order; the total is a whole number of quanta, for which order does not
        // matter.
        tally.receivers[r].add_deferred(spot.cell, quanta);
        tally.receiver_totals[r] += u128::from(quanta_as_integer(quanta));
        tally.moments[r].add(quanta, spot.at, spot.radius2);
        if !C::ENDS_ONLY {
            self.note_deposit(path, DepositPlace::Receiver(r as u32), quanta_as_integer(quanta));
        }
        let tally = &mut *self.tally;
        if !C::ENDS_ONLY && receiver.channels.count() > 0 {
            let cells = receiver.cell_count();
            let nm = path.payload.wavelength().unwrap_or(self.context.bound.light.wavelength);
            receiver.channels.weigh(nm, |channel, weight| {
                tally.receivers[r].add((channel + 1) * cells + spot.cell, round_quanta(quanta * weight));
            });
        }
    }
}

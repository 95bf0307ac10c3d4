//! Receivers on the way of a ray.

use super::{Carry, Context, Local, NO_RECEIVER, Path, SCATTERS, key};
use crate::intersect::Hit;
use crate::math::{Point, Ray};
use crate::simulate::random::Purpose;
use crate::simulate::receiver::{Receiver, Spot};
use crate::simulate::tally::{count, whole};

/// Ends the ray at its next scattering or at the nearest receiver that stops light and stands among the faces, unless a face comes
/// first.
#[inline(always)]
pub(super) fn aim<C: Carry>(context: &Context<'_>, path: &mut Path<C>, ray: &mut Ray) {
    path.receiver = NO_RECEIVER;
    if C::MEDIA
        && let Some(scatter) = &context.bound.bodies[path.carry.body() as usize].scatter
    {
        let key = key(context, path);
        ray.t_max = scatter.free_path(key.unit(Purpose::Bulk));
        path.receiver = SCATTERS;
    }
    for &r in &context.blocking {
        if let Some(t) = context.bound.receivers[r as usize].crossing(ray, ray.t_min, ray.t_max) {
            // One that lies in a face is met before the face.
            ray.t_max = (t - in_front(ray, t)).max(ray.t_min);
            path.receiver = r;
        }
    }
}

/// How far in front of a face a receiver that lies in it is met, mm: more than both are off by rounding.
#[inline(always)]
fn in_front(ray: &Ray, t: f64) -> f64 {
    1e-9 + 1e-12 * (t + ray.origin.abs().max_element())
}

/// Ends the ray at the nearest receiver that stops light and stands outside the scene's box, unless a face comes first.
///
/// A segment inside the box cannot meet one, so that rays from face to face are not asked: 1 test in place of 3 for each ray of a
/// lens.
#[inline(always)]
pub(super) fn late<'h, C: Carry>(
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
        if context.region.contains(ray.origin) && context.region.contains(ray.point_at(h.t)) {
            return hit;
        }
        end = h.t;
    }
    let mut first = None;
    for &r in &context.outside {
        if let Some(t) = context.bound.receivers[r as usize].crossing(ray, ray.t_min, end) {
            (end, first) = (t, Some(r));
        }
    }
    let Some(r) = first else { return hit };
    (ray.t_max, path.receiver) = (end, r);
    None
}

/// Counts the light on receivers that let it pass.
pub(super) fn pass<C: Carry>(context: &Context<'_>, path: &Path<C>, ray: &Ray, end: f64, local: &mut Local) {
    for &r in &context.passing {
        // A receiver that lies in a face is crossed on the way to the face, not on the way from it.
        let (mut after, end) = (ray.t_min + in_front(ray, 0.0), end + in_front(ray, end.min(1e12)));
        // A sphere may be crossed twice.
        while let Some(t) = context.bound.receivers[r as usize].crossing(ray, after, end) {
            receive(context, path, r, ray.point_at(t), local);
            after = t;
        }
    }
}

#[inline(always)]
pub(super) fn receive<C: Carry>(context: &Context<'_>, path: &Path<C>, r: u32, point: Point, local: &mut Local) {
    let receiver = &context.bound.receivers[r as usize];
    if !C::PLAIN && receiver.interactions.is_some_and(|n| n != path.bounce) {
        return;
    }
    if let Some(spot) = receiver.spot(point) {
        deposit(context, receiver, path, r, &spot, local);
    }
}

#[inline(always)]
pub(super) fn deposit<C: Carry>(
    context: &Context<'_>,
    receiver: &Receiver,
    path: &Path<C>,
    r: u32,
    spot: &Spot,
    local: &mut Local,
) {
    let r = r as usize;
    local.receivers[r].add_soon(spot.cell, path.quanta);
    local.receiver_totals[r] += count(path.quanta);
    local.moments[r].add(path.quanta, spot.at, spot.radius2);
    if !C::PLAIN && receiver.channels.count() > 0 {
        let cells = receiver.cell_count();
        let nm = path.carry.wavelength().unwrap_or(context.bound.light.wavelength);
        receiver.channels.weigh(nm, |channel, weight| {
            local.receivers[r].add((channel + 1) * cells + spot.cell, whole(path.quanta * weight));
        });
    }
}

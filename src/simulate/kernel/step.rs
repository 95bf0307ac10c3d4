use super::arrive::{aim, deposit, late, pass, receive};
use super::{Carry, Cause, Context, Event, Local, LostRay, NO_RECEIVER, Path, PathVertex, SCATTERS, key};
use super::{around, contact, surface};
use crate::intersect::Hit;
use crate::math::{Departure, FaceId, Point, Ray, Vector};
use crate::optics::polarised::Stokes;
use crate::simulate::bind::{AMBIENT, FaceOptics, Surface};
use crate::simulate::random::Purpose;
use crate::simulate::tally::{QUANTA, count, whole};
use std::cell::Cell;

/// Notes a vertex of a path that is recorded.
#[inline(always)]
pub(super) fn record<C: Carry>(
    context: &Context<'_>,
    path: &Path<C>,
    point: Point,
    event: Event,
    local: &mut Local,
) {
    if !C::PLAIN && context.plan.records(path.ray) {
        let (ray, branch, bounce) = (path.ray, path.branch, path.bounce);
        local.paths.push(PathVertex { ray, branch, bounce, point, power: path.quanta / QUANTA, event });
    }
}

/// Carries a path over its segment and through what it meets; false when the path ends.
#[inline(always)]
pub(super) fn step<C: Carry>(
    context: &Context<'_>,
    path: &mut Path<C>,
    ray: &mut Ray,
    hit: Option<&Hit>,
    local: &mut Local,
    pending: &mut Vec<(Path<C>, Ray)>,
) -> bool {
    let hit = late(context, path, ray, hit);
    let end = hit.map_or(ray.t_max, |h| h.t);
    if !C::PLAIN && !context.passing.is_empty() {
        pass(context, path, ray, end, local);
    }
    if C::MEDIA && (end.is_finite() || path.carry.body() == AMBIENT) {
        attenuate(context, path, end, local);
    }
    let Some(hit) = hit else {
        if C::MEDIA && path.receiver == SCATTERS {
            return scatter(context, path, ray, local);
        }
        leave(context, path, ray, local);
        return false;
    };
    let point = ray.point_at(hit.t);
    path.length += hit.t;
    let Some(&face) = context.bound.faces.get(hit.face.index()) else {
        lose(path, ray, Cause::NotANumber, Some(hit.face), local);
        return false;
    };
    if !(hit.t.is_finite() && hit.normal.is_finite()) {
        lose(path, ray, Cause::NotANumber, Some(hit.face), local);
        return false;
    }
    let entering = ray.direction.dot(hit.geometric_normal) < 0.0;
    let touched = match C::MEDIA && !entering && (face.sealed || face.against && face.body != AMBIENT) {
        true => contact::contact(context, ray, hit, face, point),
        false => None,
    };
    let pair = match C::MEDIA && context.bound.dressed && face.touching && touched.is_none() {
        true => contact::dressed(context, ray, hit, face, point),
        false => None,
    };
    let (hit, face, entering, point) = match (&touched, &pair) {
        (Some((hit, face, point)), _) => (hit, *face, true, *point),
        (None, Some(Ok((hit, face, point)))) => (hit, *face, !entering, *point),
        (None, _) => (hit, face, entering, point),
    };
    if face.sealed && !entering {
        record(context, path, point, Event::Lost, local);
        lose(path, ray, Cause::InsideSolid, Some(hit.face), local);
        return false;
    }
    let meeting = Meeting { hit, face, entering, point, skip: Cell::new(0.0) };
    if C::MEDIA && (pair.is_some() || face.against && face.body == AMBIENT && path.carry.body() != AMBIENT) {
        // Light that comes back from an opaque face does not meet the face of its own body on it once more.
        meeting.skip.set(context.bound.scene.run.glue_mm);
    }
    let going = match &context.bound.surfaces[face.surface as usize] {
        Surface::Absorber => {
            record(context, path, point, Event::Absorbed, local);
            local.absorb(hit.face, path.quanta);
            return false;
        }
        Surface::Mirror(share) => {
            stray(path);
            Some(surface::mirror(context, *share, path, ray.direction, &meeting, local))
        }
        Surface::Interface if C::MEDIA && face.body != AMBIENT => {
            surface::interface(context, path, ray, &meeting, local, pending)
        }
        // A bare face without a medium behind it is not there for light.
        Surface::Interface => Some(ray.direction),
        Surface::Coated(c) if C::COATED => {
            stray(path);
            surface::coated(context, c, path, ray, &meeting, local, pending)
        }
        Surface::Coated(_) => unreachable!("scenes with such faces have a kernel for them"),
    };
    match going {
        Some(going) => onward(context, path, ray, &meeting, going, local),
        None => false,
    }
}

/// Ends a path whose ray is known to meet no face; `false` where it is not to be followed straight on.
#[inline(always)]
pub(super) fn go<C: Carry>(context: &Context<'_>, path: &mut Path<C>, ray: &mut Ray, local: &mut Local) -> bool {
    if path.receiver == SCATTERS {
        return false;
    }
    local.counts.segments += 1;
    late(context, path, ray, None);
    if !C::PLAIN && !context.passing.is_empty() {
        pass(context, path, ray, ray.t_max, local);
    }
    if C::MEDIA && (ray.t_max.is_finite() || path.carry.body() == AMBIENT) {
        attenuate(context, path, ray.t_max, local);
    }
    leave(context, path, ray, local);
    true
}

/// A ray meets a face.
pub(super) struct Meeting<'a> {
    pub(super) hit: &'a Hit,
    pub(super) face: FaceOptics,
    pub(super) entering: bool,
    pub(super) point: Point,
    /// Distance from the face that the next segment passes over, mm: the glue distance at touching faces, else 0.
    pub(super) skip: Cell<f64>,
}

/// Starts the next segment; false when a limit cuts the path off.
#[inline(always)]
pub(super) fn onward<C: Carry>(
    context: &Context<'_>,
    path: &mut Path<C>,
    ray: &mut Ray,
    meeting: &Meeting<'_>,
    going: Vector,
    local: &mut Local,
) -> bool {
    let (hit, point) = (meeting.hit, meeting.point);
    let from = Departure { face: hit.face, primitive: hit.primitive, uv: hit.uv };
    path.bounce += 1;
    let mut next = Ray::new(point, going).with_departure(from);
    if C::MEDIA && meeting.skip.get() > 0.0 {
        let reach = meeting.skip.get() / going.dot(hit.geometric_normal).abs().max(1e-3);
        next.t_min = contact::beyond(context, &next, hit.geometric_normal, reach);
    }
    proceed(context, path, ray, next, local)
}

/// Takes the next ray of a path, unless a limit cuts the path off.
#[inline(always)]
fn proceed<C: Carry>(
    context: &Context<'_>,
    path: &mut Path<C>,
    ray: &mut Ray,
    next: Ray,
    local: &mut Local,
) -> bool {
    let s = context.settings;
    if path.bounce >= s.max_bounces
        || path.length > s.max_length_mm
        || path.quanta <= s.power_floor * path.first
        || path.quanta < 1.0
    {
        cut_off(context, path, next.origin, local);
        return false;
    }
    *ray = next;
    aim(context, path, ray);
    true
}

/// Ends a path at a limit.
#[cold]
fn cut_off<C: Carry>(context: &Context<'_>, path: &Path<C>, at: Point, local: &mut Local) {
    if path.quanta > 0.0 {
        local.ends.cut_off += count(path.quanta);
        local.counts.cut_off += 1;
        record(context, path, at, Event::CutOff, local);
    }
}

/// Notes that a path has just met what is no total reflection.
#[inline(always)]
pub(super) fn stray<C: Carry>(path: &mut Path<C>) {
    if C::MEDIA {
        path.free = path.length as f32;
    }
}

/// Whether a path that has just been reflected totally goes round in its body for ever; it ends here then.
#[inline(always)]
pub(super) fn caught<C: Carry>(context: &Context<'_>, path: &Path<C>, at: Point, local: &mut Local) -> bool {
    let body = &context.bound.bodies[path.carry.body() as usize];
    let caught = path.length - f64::from(path.free) > body.patience;
    if caught {
        local.counts.caught += u64::from(path.quanta > 0.0);
        cut_off(context, path, at, local);
    }
    caught
}

/// Beer's law over the segment, for bodies that absorb.
#[inline(always)]
fn attenuate<C: Carry>(context: &Context<'_>, path: &mut Path<C>, length: f64, local: &mut Local) {
    let body = path.carry.body();
    let alpha = context.bound.bodies[body as usize].absorption(path.carry.wavelength());
    if alpha > 0.0 {
        let kept = whole(path.quanta * (-alpha * length).exp());
        let taken = path.quanta - kept;
        local.ends.absorbed += count(taken);
        local.bulk.add(body as usize, taken);
        path.quanta = kept;
    }
}

/// Scattering inside a body.
#[inline(never)]
fn scatter<C: Carry>(context: &Context<'_>, path: &mut Path<C>, ray: &mut Ray, local: &mut Local) -> bool {
    let Some(scatter) = &context.bound.bodies[path.carry.body() as usize].scatter else { return false };
    let point = ray.point_at(ray.t_max);
    let numbers = key(context, path).pair(Purpose::BulkDirection);
    path.length += ray.t_max;
    stray(path);
    path.bounce += 1;
    record(context, path, point, Event::Scattered, local);
    let going = scatter.sample(ray.direction, numbers);
    if let Some(stokes) = path.carry.stokes() {
        *stokes = Stokes::unpolarised(1.0, going);
    }
    proceed(context, path, ray, Ray::new(point, going), local)
}

/// The end of a path that meets no face: on a receiver, in the far field, or lost inside a body.
#[inline(always)]
fn leave<C: Carry>(context: &Context<'_>, path: &mut Path<C>, ray: &Ray, local: &mut Local) {
    if path.receiver != NO_RECEIVER {
        let point = ray.point_at(ray.t_max);
        if C::MEDIA && around::is_out(context, &path.carry, ray, point) {
            record(context, path, point, Event::Lost, local);
            return lose(path, ray, Cause::NoExit, None, local);
        }
        record(context, path, point, Event::Received, local);
        local.ends.received += count(path.quanta);
        receive(context, path, path.receiver, point, local);
        return;
    }
    if C::MEDIA && path.carry.body() != AMBIENT {
        match around::regained(context, &path.carry, ray, f64::INFINITY, false) {
            Some(found) if found.body() == AMBIENT => path.carry = found,
            _ => {
                record(context, path, ray.point_at(1.0), Event::Lost, local);
                return lose(path, ray, Cause::NoExit, None, local);
            }
        }
    }
    let mut caught = false;
    for &r in &context.far {
        let receiver = &context.bound.receivers[r as usize];
        if let Some(spot) = receiver.direction(ray.direction) {
            caught = true;
            if C::PLAIN || receiver.interactions.is_none_or(|n| n == path.bounce) {
                deposit(context, receiver, path, r, &spot, local);
            }
        }
    }
    record(context, path, ray.point_at(context.plan.reach), Event::Escaped, local);
    let end = if caught { &mut local.ends.received } else { &mut local.ends.escaped };
    *end += count(path.quanta);
}

#[cold]
pub(super) fn lose<C: Carry>(path: &Path<C>, ray: &Ray, cause: Cause, face: Option<FaceId>, local: &mut Local) {
    local.lose(LostRay {
        ray: path.ray,
        branch: path.branch,
        bounce: path.bounce,
        cause,
        quanta: count(path.quanta),
        origin: ray.origin,
        direction: ray.direction,
        face: face.map(|f| f.0),
        body: path.carry.body(),
    });
}

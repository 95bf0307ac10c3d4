use super::{Carry, Cause, Context, Event, Local, LostRay, NO_RECEIVER, Path, PathVertex};
use crate::intersect::Hit;
use crate::math::{Departure, FaceId, Point, Ray, Vector};
use crate::optics::{fresnel, reflect, refract};
use crate::simulate::bind::Surface;
use crate::simulate::random::{Key, Purpose};
use crate::simulate::scene::Interfaces;
use crate::simulate::tally::QUANTA;

/// Ends the ray at the nearest receiver that stops light, unless a face comes first.
#[inline]
pub(super) fn aim<C>(context: &Context<'_>, path: &mut Path<C>, ray: &mut Ray) {
    path.receiver = NO_RECEIVER;
    for &r in &context.blocking {
        if let Some(t) = context.bound.receivers[r as usize].crossing(ray, ray.t_min, ray.t_max) {
            ray.t_max = t;
            path.receiver = r;
        }
    }
}

/// Notes a vertex of a path that is recorded.
#[inline]
pub(super) fn record<C>(context: &Context<'_>, path: &Path<C>, point: Point, event: Event, local: &mut Local) {
    if context.plan.records(path.ray) {
        let (ray, branch, bounce) = (path.ray, path.branch, path.bounce);
        local.paths.push(PathVertex { ray, branch, bounce, point, power: path.quanta / QUANTA, event });
    }
}

/// Carries a path over its segment and through what it meets; false when the path ends.
#[inline]
pub(super) fn step<C: Carry>(
    context: &Context<'_>,
    path: &mut Path<C>,
    ray: &mut Ray,
    hit: Option<&Hit>,
    local: &mut Local,
    pending: &mut Vec<(Path<C>, Ray)>,
) -> bool {
    let end = hit.map_or(ray.t_max, |h| h.t);
    if !context.passing.is_empty() {
        pass(context, path, ray, end, local);
    }
    if C::MEDIA {
        attenuate(context, path, end, local);
    }
    let Some(hit) = hit else {
        leave(context, path, ray, local);
        return false;
    };
    let point = ray.at(hit.t);
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
    if face.sealed && !entering {
        record(context, path, point, Event::Lost, local);
        lose(path, ray, Cause::InsideSolid, Some(hit.face), local);
        return false;
    }
    let going = match &context.bound.surfaces[face.surface as usize] {
        Surface::Absorber => {
            record(context, path, point, Event::Absorbed, local);
            local.absorb(hit.face, path.quanta);
            return false;
        }
        Surface::Mirror(share) => {
            let (normal, cos_i) = shading(ray.direction, hit, local);
            let kept = (path.quanta * share.at(cos_i)).round();
            record(context, path, point, Event::Reflected, local);
            local.absorb(hit.face, path.quanta - kept);
            path.quanta = kept;
            mirrored(ray.direction, normal, hit, local)
        }
        Surface::Interface if C::MEDIA => {
            match interface(context, path, ray, hit, face.body, entering, local, pending) {
                Some(direction) => direction,
                None => return false,
            }
        }
        Surface::Interface => ray.direction,
    };
    onward(context, path, ray, point, going, hit, local)
}

/// Starts the next segment; false when a limit cuts the path off.
#[inline]
fn onward<C: Carry>(
    context: &Context<'_>,
    path: &mut Path<C>,
    ray: &mut Ray,
    point: Point,
    going: Vector,
    hit: &Hit,
    local: &mut Local,
) -> bool {
    path.bounce += 1;
    let s = context.settings;
    if path.bounce >= s.max_bounces
        || path.length > s.max_length_mm
        || path.quanta <= s.power_floor * path.first
        || path.quanta < 1.0
    {
        if path.quanta > 0.0 {
            local.ends.cut_off += path.quanta as u64;
            local.counts.cut_off += 1;
            record(context, path, point, Event::CutOff, local);
        }
        return false;
    }
    *ray = Ray::new(point, going).leaving(departure(hit));
    aim(context, path, ray);
    true
}

fn departure(hit: &Hit) -> Departure {
    Departure { face: hit.face, primitive: hit.primitive, uv: hit.uv }
}

/// The normal to shade with and the cosine of incidence. A normal that looks away from the ray is replaced by the facet's.
#[inline]
fn shading(direction: Vector, hit: &Hit, local: &mut Local) -> (Vector, f64) {
    let (shaded, flat) = (direction.dot(hit.normal), direction.dot(hit.geometric_normal));
    if shaded * flat > 0.0 {
        (hit.normal, shaded.abs().min(1.0))
    } else {
        local.counts.corrected_normals += 1;
        (hit.geometric_normal, flat.abs().min(1.0))
    }
}

/// The reflected direction, on the side of the facet the ray came from.
#[inline]
fn mirrored(direction: Vector, normal: Vector, hit: &Hit, local: &mut Local) -> Vector {
    let flat = hit.geometric_normal;
    let r = reflect(direction, normal);
    if r.dot(flat) * direction.dot(flat) < 0.0 {
        return r;
    }
    local.counts.corrected_normals += 1;
    reflect(direction, flat)
}

/// Reflection or refraction at the boundary of a body; `None` when the ray is lost.
#[inline]
#[expect(clippy::too_many_arguments, reason = "one hit has that many parts; a struct would only rename them")]
fn interface<C: Carry>(
    context: &Context<'_>,
    path: &mut Path<C>,
    ray: &Ray,
    hit: &Hit,
    body: u16,
    entering: bool,
    local: &mut Local,
    pending: &mut Vec<(Path<C>, Ray)>,
) -> Option<Vector> {
    let Some(across) = path.carry.across(body, entering) else {
        record(context, path, ray.at(hit.t), Event::Lost, local);
        lose(path, ray, Cause::ImpossibleMedium, Some(hit.face), local);
        return None;
    };
    let bodies = &context.bound.bodies;
    let (here, there) = (path.carry.body(), across.body());
    if here == there {
        path.carry = across;
        return Some(ray.direction);
    }
    let eta = bodies[here as usize].index / bodies[there as usize].index;
    let (mut normal, mut cos_i) = shading(ray.direction, hit, local);
    let mut transmitted = refract(ray.direction, normal, eta);
    if transmitted.is_some_and(|t| t.dot(hit.geometric_normal) * ray.direction.dot(hit.geometric_normal) <= 0.0) {
        local.counts.corrected_normals += 1;
        normal = hit.geometric_normal;
        cos_i = ray.direction.dot(normal).abs().min(1.0);
        transmitted = refract(ray.direction, normal, eta);
    }
    let point = ray.at(hit.t);
    let Some(transmitted) = transmitted else {
        record(context, path, point, Event::Reflected, local);
        return Some(mirrored(ray.direction, normal, hit, local));
    };
    let share = fresnel::dielectric(cos_i, eta).unpolarised();
    let s = context.settings;
    if s.interfaces == Interfaces::Split && path.quanta > s.split_floor * path.first {
        let kept = (path.quanta * share).round();
        if kept >= 1.0 {
            let mut child = Path { quanta: kept, branch: branch(path.branch, path.bounce), ..*path };
            let going = mirrored(ray.direction, normal, hit, local);
            let mut child_ray = *ray;
            record(context, &child, point, Event::Split, local);
            if onward(context, &mut child, &mut child_ray, point, going, hit, local) {
                pending.push((child, child_ray));
            }
        }
        path.quanta -= kept;
    } else {
        let key = Key { seed: s.seed, ray: path.ray, branch: path.branch, bounce: path.bounce };
        if key.unit(Purpose::Interface) < share {
            record(context, path, point, Event::Reflected, local);
            return Some(mirrored(ray.direction, normal, hit, local));
        }
    }
    record(context, path, point, Event::Transmitted, local);
    path.carry = across;
    Some(transmitted)
}

/// A number for the path that splits off at a hit; it depends on the splits before alone, not on the order of tracing.
fn branch(parent: u32, bounce: u32) -> u32 {
    let mixed = (parent ^ bounce.wrapping_mul(0x9e37_79b9)).wrapping_add(0x7f4a_7c15).wrapping_mul(0x85eb_ca6b);
    (mixed ^ mixed >> 15).max(1)
}

/// Beer's law over the segment, for bodies that absorb.
#[inline]
fn attenuate<C: Carry>(context: &Context<'_>, path: &mut Path<C>, length: f64, local: &mut Local) {
    let body = path.carry.body();
    let alpha = context.bound.bodies[body as usize].absorption;
    if alpha > 0.0 {
        let kept = (path.quanta * (-alpha * length).exp()).round();
        let taken = path.quanta - kept;
        local.ends.absorbed += taken as u64;
        local.bulk.add(body as usize, taken);
        path.quanta = kept;
    }
}

/// Counts the light on receivers that let it pass.
fn pass<C>(context: &Context<'_>, path: &Path<C>, ray: &Ray, end: f64, local: &mut Local) {
    for &r in &context.passing {
        let mut after = ray.t_min;
        // A sphere may be crossed twice.
        while let Some(t) = context.bound.receivers[r as usize].crossing(ray, after, end) {
            count(context, path, r, ray.at(t), local);
            after = t;
        }
    }
}

fn count<C>(context: &Context<'_>, path: &Path<C>, r: u32, point: Point, local: &mut Local) {
    let receiver = &context.bound.receivers[r as usize];
    if receiver.interactions.is_some_and(|n| n != path.bounce) {
        return;
    }
    if let Some(spot) = receiver.spot(point) {
        deposit(path.quanta, r, &spot, local);
    }
}

#[inline]
fn deposit(quanta: f64, r: u32, spot: &crate::simulate::receiver::Spot, local: &mut Local) {
    let r = r as usize;
    local.receivers[r].add(spot.cell, quanta);
    local.receiver_totals[r] += quanta as u64;
    local.moments[r].add(quanta, spot.at, spot.radius2);
}

/// The end of a path that meets no face: on a receiver, in the far field, or lost inside a body.
#[inline]
fn leave<C: Carry>(context: &Context<'_>, path: &mut Path<C>, ray: &Ray, local: &mut Local) {
    if path.receiver != NO_RECEIVER {
        let point = ray.at(ray.t_max);
        record(context, path, point, Event::Received, local);
        local.ends.received += path.quanta as u64;
        count(context, path, path.receiver, point, local);
        return;
    }
    if C::MEDIA && path.carry.body() != crate::simulate::bind::AMBIENT {
        record(context, path, ray.at(1.0), Event::Lost, local);
        return lose(path, ray, Cause::NoExit, None, local);
    }
    let mut caught = false;
    for &r in &context.far {
        let receiver = &context.bound.receivers[r as usize];
        if let Some(spot) = receiver.direction(ray.direction) {
            caught = true;
            if receiver.interactions.is_none_or(|n| n == path.bounce) {
                deposit(path.quanta, r, &spot, local);
            }
        }
    }
    record(context, path, ray.at(context.plan.reach), Event::Escaped, local);
    let end = if caught { &mut local.ends.received } else { &mut local.ends.escaped };
    *end += path.quanta as u64;
}

#[cold]
fn lose<C>(path: &Path<C>, ray: &Ray, cause: Cause, face: Option<FaceId>, local: &mut Local) {
    local.lose(LostRay {
        ray: path.ray,
        branch: path.branch,
        bounce: path.bounce,
        cause,
        quanta: path.quanta as u64,
        origin: ray.origin,
        direction: ray.direction,
        face: face.map(|f| f.0),
    });
}

//! What happens to a path at a face.

use super::around::regained;
use super::contact::{alike, glued, twin};
use super::rough::rough;
use super::step::{Meeting, caught, lose, onward, record, stray};
use super::{Carry, Cause, Context, Event, Local, Path, key};
use crate::math::{Ray, Vector};
use crate::optics::polarised::{self, Mueller, Stokes};
use crate::optics::{Coating, Split, fresnel, reflect, refract_with_cosine};
use crate::simulate::bind::{AMBIENT, Coated};
use crate::simulate::random::Purpose;
use crate::simulate::scene::Interfaces;
use crate::simulate::tally::whole;

/// A perfect conductor: s keeps its sign, p changes it, in the convention of [`Stokes`].
const CONDUCTOR: Mueller = Mueller { a: 1.0, b: 0.0, c: -1.0, e: 0.0 };

/// The normal to shade with and the cosine of incidence. A normal that looks away from the ray is replaced by the facet's.
#[inline(always)]
fn shading(direction: Vector, at: &Meeting<'_>, local: &mut Local) -> (Vector, f64) {
    let (shaded, flat) = (direction.dot(at.hit.normal), direction.dot(at.hit.geometric_normal));
    if shaded * flat > 0.0 {
        (at.hit.normal, shaded.abs().min(1.0))
    } else {
        local.counts.corrected_normals += 1;
        (at.hit.geometric_normal, flat.abs().min(1.0))
    }
}

/// The reflected direction, on the side of the facet the ray came from.
#[inline(always)]
fn mirrored(direction: Vector, normal: Vector, at: &Meeting<'_>, local: &mut Local) -> Vector {
    let flat = at.hit.geometric_normal;
    let r = reflect(direction, normal);
    if r.dot(flat) * direction.dot(flat) < 0.0 {
        return r;
    }
    local.counts.corrected_normals += 1;
    reflect(direction, flat)
}

/// Reflects a constant share and absorbs the rest; the direction to go on in.
#[inline(always)]
pub(super) fn mirror<C: Carry>(
    context: &Context<'_>,
    share: f64,
    path: &mut Path<C>,
    direction: Vector,
    at: &Meeting<'_>,
    local: &mut Local,
) -> Vector {
    let (normal, _) = shading(direction, at, local);
    let kept = whole(path.quanta * share);
    record(context, path, at.point, Event::Reflected, local);
    local.absorb(at.hit.face, path.quanta - kept);
    path.quanta = kept;
    turn(context, path, &CONDUCTOR, direction, normal);
    mirrored(direction, normal, at, local)
}

/// Passes the polarisation of a path through an interface; its power stays 1.
#[inline(always)]
fn turn<C: Carry>(context: &Context<'_>, path: &mut Path<C>, m: &Mueller, d: Vector, n: Vector) {
    if let Some(stokes) = path.carry.stokes() {
        let after = stokes.through(m, d, n);
        let whole = if after.i > 0.0 { after.scaled(1.0 / after.i) } else { Stokes::unpolarised(1.0, d) };
        *stokes = if context.polarised() { whole } else { Stokes { i: 1.0, ..whole.depolarised() } };
    }
}

/// What the share of power would be for the polarisation of a path; the unpolarised share when it is not followed.
#[inline]
fn polarised_share<C: Carry>(
    context: &Context<'_>,
    path: &mut Path<C>,
    unpolarised: f64,
    m: &Mueller,
    d: Vector,
    n: Vector,
) -> f64 {
    match path.carry.stokes() {
        Some(stokes) if context.polarised() => stokes.through(m, d, n).i.clamp(0.0, 1.0),
        _ => unpolarised,
    }
}

/// Reflection or refraction at the bare boundary of a body; the direction to go on in, `None` when the path is lost.
#[inline(always)]
pub(super) fn interface<C: Carry>(
    context: &Context<'_>,
    path: &mut Path<C>,
    ray: &Ray,
    at: &Meeting<'_>,
    local: &mut Local,
    pending: &mut Vec<(Path<C>, Ray)>,
) -> Option<Vector> {
    let across = cross(context, path, ray, at, local)?;
    let (here, there) = (path.carry.body(), across.body());
    let (bodies, nm) = (&context.bound.bodies, path.carry.wavelength());
    if here == there {
        let left = at.face.body;
        let other = || bodies[left as usize].index(nm) != bodies[here as usize].index(nm);
        if !at.entering && left != here && at.skip.get() == 0.0 && other() {
            local.counts.overlap([left.min(here), left.max(here)], 1);
        }
        path.carry = across;
        return Some(ray.direction);
    }
    let eta = bodies[here as usize].index(nm) / bodies[there as usize].index(nm);
    let d = ray.direction;
    let (normal, cos_i, transmitted) = refracted(d, eta, at, local);
    let Some((transmitted, cos_t)) = transmitted else {
        if caught(context, path, at.point, local) {
            return None;
        }
        record(context, path, at.point, Event::Reflected, local);
        if path.carry.stokes().is_some() {
            turn(context, path, &polarised::reflected(cos_i, eta), d, normal);
        }
        return Some(mirrored(d, normal, at, local));
    };
    // Into a glued body of the same index light goes straight on: it is still on its way round.
    if eta != 1.0 {
        stray(path);
    }
    let mut share = fresnel::of_cosines(cos_i, cos_t, eta).unpolarised();
    let mut matrices = None;
    if path.carry.stokes().is_some() {
        let [r, t] = [polarised::reflected(cos_i, eta), polarised::transmitted(cos_i, eta)];
        share = polarised_share(context, path, share, &r, d, normal);
        matrices = Some([r, t]);
    }
    let both = Both { share, matrices, normal, across, transmitted, scatter: None };
    divide(context, path, ray, at, both, local, pending)
}

/// Both ways on from a partly reflecting face.
struct Both<'a, C> {
    /// Share of the power that is reflected; the rest is transmitted.
    share: f64,
    matrices: Option<[Mueller; 2]>,
    normal: Vector,
    across: C,
    transmitted: Vector,
    scatter: Option<&'a Coated>,
}

/// Chooses one of both ways, or splits the path.
#[inline(always)]
fn divide<C: Carry>(
    context: &Context<'_>,
    path: &mut Path<C>,
    ray: &Ray,
    at: &Meeting<'_>,
    both: Both<'_, C>,
    local: &mut Local,
    pending: &mut Vec<(Path<C>, Ray)>,
) -> Option<Vector> {
    let (s, d) = (context.settings, ray.direction);
    let reflects = match s.interfaces == Interfaces::Split && path.quanta > s.split_floor * path.first {
        true => !split(context, path, ray, at, &both, local, pending),
        false => key(context, path).unit(Purpose::Interface) < both.share,
    };
    if reflects {
        record(context, path, at.point, Event::Reflected, local);
        return Some(reflected(context, path, d, at, &both, local));
    }
    record(context, path, at.point, Event::Transmitted, local);
    if let Some([_, t]) = &both.matrices {
        turn(context, path, t, d, both.normal);
    }
    path.carry = C::moved(&path.carry, both.across);
    Some(rough(context, both.scatter, path, both.transmitted, both.normal, at, local))
}

/// Splits off what is reflected, if it is anything; whether something is left to be transmitted.
#[inline(never)]
fn split<C: Carry>(
    context: &Context<'_>,
    path: &mut Path<C>,
    ray: &Ray,
    at: &Meeting<'_>,
    both: &Both<'_, C>,
    local: &mut Local,
    pending: &mut Vec<(Path<C>, Ray)>,
) -> bool {
    let kept = whole(path.quanta * both.share);
    if kept >= 1.0 && kept < path.quanta {
        let mut child = Path { quanta: kept, branch: branch(path.branch, path.bounce), ..*path };
        record(context, &child, at.point, Event::Split, local);
        let going = reflected(context, &mut child, ray.direction, at, both, local);
        let mut child_ray = *ray;
        if onward(context, &mut child, &mut child_ray, at, going, local) {
            pending.push((child, child_ray));
        }
        path.quanta -= kept;
        return true;
    }
    kept != path.quanta
}

/// The direction to go on in of what a partly reflecting face reflects.
#[inline(always)]
fn reflected<C: Carry>(
    context: &Context<'_>,
    path: &mut Path<C>,
    d: Vector,
    at: &Meeting<'_>,
    both: &Both<'_, C>,
    local: &mut Local,
) -> Vector {
    if let Some([r, _]) = &both.matrices {
        turn(context, path, r, d, both.normal);
    }
    let specular = mirrored(d, both.normal, at, local);
    rough(context, both.scatter, path, specular, both.normal, at, local)
}

/// The path on the other side of the boundary; lost when it cannot be there.
#[inline(always)]
fn cross<C: Carry>(
    context: &Context<'_>,
    path: &mut Path<C>,
    ray: &Ray,
    at: &Meeting<'_>,
    local: &mut Local,
) -> Option<C> {
    if at.face.twin && path.carry.across(at.face.body, false).is_some() && twin(context, ray, at) {
        // From one solid of a part into the next.
        at.skip.set(context.bound.scene.run.glue_mm);
        return Some(path.carry);
    }
    let mut across = path.carry.across(at.face.body, at.entering);
    if across.is_none()
        && let Some(found) = regained(context, &path.carry, ray, at.hit.t, at.face.touching)
        && let Some(there) = found.across(at.face.body, at.entering)
    {
        (path.carry, across) = (found, Some(there));
    }
    if at.face.touching
        && let Some(other) = glued(context, ray, at)
    {
        // Whichever way the light goes on, it has met both faces.
        at.skip.set(context.bound.scene.run.glue_mm);
        across = match across {
            // Through both faces at once, whichever the ray met first.
            Some(first) if !(at.entering && path.carry.body() == at.face.body) => {
                let both = first.across(other, !at.entering).or_else(|| {
                    // The other body is not where the light should be: it has passed an edge of three or more unseen.
                    let found = regained(context, &path.carry, ray, at.hit.t, true)?;
                    let both = found.across(at.face.body, at.entering)?.across(other, !at.entering)?;
                    path.carry = found;
                    Some(both)
                });
                Some(both.unwrap_or(first))
            }
            // The second face of an interface that was crossed at the first.
            _ => Some(path.carry),
        };
    } else if at.face.touching
        && let Some(other) = alike(context, ray, at)
    {
        let [first, second] = [at.face.body.min(other), at.face.body.max(other)];
        let holds = |body: u16| path.carry.across(body, false).is_some();
        let both = path.carry.across(first, at.entering).and_then(|c| c.across(second, at.entering));
        match [holds(first), holds(second)] {
            // What looks the same way but is not passed here, as beyond an edge.
            [a, b] if a != b => {}
            [inside, _] => {
                at.skip.set(context.bound.scene.run.glue_mm);
                // The second of two faces that were passed at the first.
                across = if inside == at.entering { Some(path.carry) } else { both };
            }
        }
    }
    if across.is_none() {
        record(context, path, at.point, Event::Lost, local);
        let cause = if path.carry.is_full() && at.entering { Cause::TooDeep } else { Cause::ImpossibleMedium };
        lose(path, ray, cause, Some(at.hit.face), local);
    }
    across
}

/// The normal, the cosine of incidence, and the refracted direction on the far side of the facet with its cosine; `None` for these
/// at total reflection.
#[inline(always)]
fn refracted(d: Vector, eta: f64, at: &Meeting<'_>, local: &mut Local) -> (Vector, f64, Option<(Vector, f64)>) {
    let flat = at.hit.geometric_normal;
    let (normal, cos_i) = shading(d, at, local);
    let transmitted = refract_with_cosine(d, normal, eta);
    if transmitted.is_none_or(|(t, _)| t.dot(flat) * d.dot(flat) > 0.0) {
        return (normal, cos_i, transmitted);
    }
    local.counts.corrected_normals += 1;
    (flat, d.dot(flat).abs().min(1.0), refract_with_cosine(d, flat, eta))
}

/// A surface with a coating, scatter or both; the direction to go on in, `None` when the path ends.
pub(super) fn coated<C: Carry>(
    context: &Context<'_>,
    coated: &Coated,
    path: &mut Path<C>,
    ray: &Ray,
    at: &Meeting<'_>,
    local: &mut Local,
    pending: &mut Vec<(Path<C>, Ray)>,
) -> Option<Vector> {
    let here = path.carry.body();
    let across = match C::MEDIA && at.face.body != AMBIENT && !coated.opaque {
        true => cross(context, path, ray, at, local)?,
        false => path.carry,
    };
    let (bodies, nm, d) = (&context.bound.bodies, path.carry.wavelength(), ray.direction);
    let index = |body: u16| bodies[body as usize].index(nm);
    let (n1, n2) = (index(here), index(across.body()));
    let (normal, cos_i, transmitted) = refracted(d, n1 / n2, at, local);
    let wavelength = nm.unwrap_or(context.bound.light.wavelength);
    let split = coated.coating.split(cos_i, n1, n2, wavelength);
    let mut shares = [split.reflected.unpolarised(), split.transmitted.unpolarised()];
    let mut matrices = None;
    if path.carry.stokes().is_some() {
        let m = mueller(&coated.coating, &split, cos_i, n1, n2);
        shares = [0, 1].map(|i| polarised_share(context, path, shares[i], &m[i], d, normal));
        matrices = Some(m);
    }
    let total = (shares[0] + shares[1]).min(1.0);
    let kept = whole(path.quanta * total);
    if kept < path.quanta {
        local.absorb(at.hit.face, path.quanta - kept);
        path.quanta = kept;
    }
    if kept == 0.0 {
        record(context, path, at.point, Event::Absorbed, local);
        return None;
    }
    let share = match transmitted {
        None => 1.0,
        Some(_) => shares[0] / (shares[0] + shares[1]),
    };
    let scatter = coated.scatter.is_some().then_some(coated);
    let transmitted = transmitted.map_or(d, |(t, _)| t);
    divide(context, path, ray, at, Both { share, matrices, normal, across, transmitted, scatter }, local, pending)
}

/// The matrices of reflection and transmission; a table has no phases, and reflects like a conductor.
fn mueller(coating: &Coating, split: &Split, cos_i: f64, n1: f64, n2: f64) -> [Mueller; 2] {
    match coating {
        Coating::Bare => [polarised::reflected(cos_i, n1 / n2), polarised::transmitted(cos_i, n1 / n2)],
        Coating::Metal { n, k } => [polarised::metal(cos_i, n1, *n, *k), Mueller::without_phase(split.transmitted)],
        _ => {
            let r = Mueller::without_phase(split.reflected);
            [Mueller { c: -r.c, ..r }, Mueller::without_phase(split.transmitted)]
        }
    }
}

/// A number for the path that splits off at a hit; it depends on the splits before alone, not on the order of tracing.
fn branch(parent: u32, bounce: u32) -> u32 {
    let mixed = (parent ^ bounce.wrapping_mul(0x9e37_79b9)).wrapping_add(0x7f4a_7c15).wrapping_mul(0x85eb_ca6b);
    (mixed ^ mixed >> 15).max(1)
}

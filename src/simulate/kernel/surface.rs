//! The laws of light at a face, as what they make of one ray.

use super::context::Context;
use super::crossing::{Crossing, cross_face};
use super::interaction::{CONDUCTOR, Division, Interaction, SurfaceInteraction, turn_polarisation};
use super::path::Path;
use super::payload::RayPayload;
use crate::math::{Ray, Vector};
use crate::optics::polarised::{self, Mueller};
use crate::optics::{Coating, Split, fresnel};
use crate::simulate::body::AMBIENT;
use crate::simulate::surfaces::{Coated, Surface};
use crate::simulate::tally::round_quanta;

/// Returns what the surface of a face does to the light that meets it; books nothing. Notes in `at` corrected normals, overlaps and refused
/// contacts, and, where two faces are crossed at once, how far to skip.
#[inline(always)]
pub(super) fn interact<'s, C: RayPayload>(
    context: &'s Context<'_>,
    path: &Path<C>,
    ray: &Ray,
    at: &mut SurfaceInteraction<'_>,
) -> Interaction<'s, C> {
    match &context.bound.surfaces[at.face.surface as usize] {
        Surface::Absorber => Interaction::Absorb,
        Surface::Mirror(share) => mirror_interaction(context, *share, path, ray.direction, at),
        Surface::Interface if C::MEDIA && at.face.body != AMBIENT => interface_interaction(context, path, ray, at),
        // A bare face without a medium behind it is not there for light.
        Surface::Interface => Interaction::Pass { payload: path.payload },
        Surface::Coated(c) if C::COATED => coating_interaction(context, c, path, ray, at),
        Surface::Coated(_) => unreachable!("scenes with such faces have a kernel for them"),
    }
}

/// Returns the reflection of a constant share of the path's quanta, rounded to whole ones, with the polarisation turned as by a conductor;
/// the face is to absorb the rest. Counts corrected normals in `at`.
#[inline(always)]
fn mirror_interaction<'s, C: RayPayload>(
    context: &Context<'_>,
    share: f64,
    path: &Path<C>,
    direction: Vector,
    at: &mut SurfaceInteraction<'_>,
) -> Interaction<'s, C> {
    let (normal, _) = at.normals.facing(direction);
    let mut payload = path.payload;
    turn_polarisation(context, &mut payload, &CONDUCTOR, direction, normal);
    // In whole quanta, so that what is kept and what is absorbed add up to the last one.
    let kept = round_quanta(path.quanta * share);
    Interaction::Reflect { kept, direction: at.normals.reflected(direction, normal), payload }
}

/// Returns what the bare boundary of a body does to light: both ways on with their shares; nothing is drawn or booked.
///
/// Light passes unchanged where its innermost body stays the same. After too long by total reflection alone it is trapped, and it is lost
/// where its media cannot be on the other side even when found anew. Writes `skip`, `overlap`, `refused_contact` and the corrections of
/// `normals` in `at`.
#[inline(always)]
fn interface_interaction<'s, C: RayPayload>(
    context: &Context<'_>,
    path: &Path<C>,
    ray: &Ray,
    at: &mut SurfaceInteraction<'_>,
) -> Interaction<'s, C> {
    // Media first: between two solids of one body there is no surface where both are bare.
    let Crossing { here: mut payload, across } = match cross_face(context, path.payload, ray, at) {
        Ok(crossing) => crossing,
        Err(cause) => return Interaction::Lose(cause),
    };
    let (here, there) = (payload.body(), across.body());
    // The innermost body stays the same: the face is that of a body which lies around it. Light goes on as if nothing were there.
    if here == there {
        at.overlap = overlapping_bodies(context, &payload, at);
        return Interaction::Pass { payload: across };
    }
    let eta = context.index(here, &payload) / context.index(there, &payload);
    let d = ray.direction;
    let (normal, cos_i, transmitted) = at.normals.refracted(d, eta);
    // Total reflection: no light is on the other side, so `across` is dropped.
    let Some((transmitted, cos_t)) = transmitted else {
        if path.is_trapped_in(context, here) {
            return Interaction::Trap;
        }
        if payload.stokes_mut().is_some() {
            turn_polarisation(context, &mut payload, &polarised::reflected(cos_i, eta), d, normal);
        }
        return Interaction::ReflectTotally { direction: at.normals.reflected(d, normal), payload };
    };
    // From both cosines, which refraction has already worked out: no further root.
    let mut share = fresnel::of_cosines(cos_i, cos_t, eta).unpolarised();
    let mut matrices = None;
    if payload.stokes_mut().is_some() {
        let [r, t] = [polarised::reflected(cos_i, eta), polarised::transmitted(cos_i, eta)];
        share = polarised_share(context, &mut payload, share, &r, d, normal);
        matrices = Some([r, t]);
    }
    Interaction::Divide(Division {
        kept: path.quanta,
        share,
        matrices,
        normal,
        payload,
        across,
        transmitted,
        scatter: None,
        // Into a touching body of the same index light goes straight on: it is still on its way round.
        releases: eta != 1.0,
    })
}

/// Returns two bodies of different index that overlap, the lower number first: light leaves one of them below the one it has come into
/// later. `None` at a contact, and where they do not overlap here.
#[inline(always)]
fn overlapping_bodies<C: RayPayload>(
    context: &Context<'_>,
    payload: &C,
    at: &SurfaceInteraction<'_>,
) -> Option<[u32; 2]> {
    let here = payload.body();
    let left = at.face.body;
    // At a contact one body lies below the other on the stack by design; only a crossing away from one shows an overlap.
    let below = !at.entering && left != here && at.skip == 0.0;
    (below && context.index(left, payload) != context.index(here, payload))
        .then(|| [left.min(here), left.max(here)])
}

/// Returns what a surface with a coating, scatter or both does to light: both ways on with their shares, without what the coating takes;
/// absorbed where less than half a quantum is left, lost as at a bare boundary. Nothing is drawn or booked. A face without a medium, or an
/// opaque one, needs no body behind it.
fn coating_interaction<'s, C: RayPayload>(
    context: &Context<'_>,
    coated: &'s Coated,
    path: &Path<C>,
    ray: &Ray,
    at: &mut SurfaceInteraction<'_>,
) -> Interaction<'s, C> {
    // What lets nothing through needs no medium behind it, so that mirrors may be open sheets.
    let transmits = C::MEDIA && at.face.body != AMBIENT && !coated.opaque;
    let crossing = if transmits {
        cross_face(context, path.payload, ray, at)
    } else {
        Ok(Crossing { here: path.payload, across: path.payload })
    };
    let Crossing { here: mut payload, across } = match crossing {
        Ok(crossing) => crossing,
        Err(cause) => return Interaction::Lose(cause),
    };
    // The shares of the coating between these media, which may have been found anew.
    let [n1, n2] = [payload.body(), across.body()].map(|body| context.index(body, &payload));
    let d = ray.direction;
    let (normal, cos_i, transmitted) = at.normals.refracted(d, n1 / n2);
    let wavelength = payload.wavelength().unwrap_or(context.bound.light.wavelength);
    let split = coated.coating.split(cos_i, n1, n2, wavelength);
    let mut shares = [split.reflected.unpolarised(), split.transmitted.unpolarised()];
    // For polarised light the shares depend on its state: Mueller matrices give them and the state after.
    let mut matrices = None;
    if payload.stokes_mut().is_some() {
        let m = mueller(&coated.coating, &split, cos_i, n1, n2);
        shares = [0, 1].map(|i| polarised_share(context, &mut payload, shares[i], &m[i], d, normal));
        matrices = Some(m);
    }
    // What is neither reflected nor transmitted is absorbed.
    let total = (shares[0] + shares[1]).min(1.0);
    // In quanta, as below one nothing is left to go on.
    let kept = round_quanta(path.quanta * total);
    if kept == 0.0 {
        return Interaction::Absorb;
    }
    // Beyond the critical angle no direction is left for what the coating would transmit: `split` has added it to what is reflected.
    let share = if transmitted.is_some() { shares[0] / (shares[0] + shares[1]) } else { 1.0 };
    let transmitted = transmitted.map_or(d, |(t, _)| t);
    let scatter = coated.scatter.as_ref();
    Interaction::Divide(Division {
        kept,
        share,
        matrices,
        normal,
        payload,
        across,
        transmitted,
        scatter,
        releases: true,
    })
}

/// Returns the share of its power, 0 to 1, that the interface `m` leaves of a ray along `d` at the normal `n`, of either side, in its state
/// of polarisation; `unpolarised` where that is not followed. The payload is read alone.
#[inline]
fn polarised_share<C: RayPayload>(
    context: &Context<'_>,
    payload: &mut C,
    unpolarised: f64,
    m: &Mueller,
    d: Vector,
    n: Vector,
) -> f64 {
    match payload.stokes_mut() {
        Some(stokes) if context.polarised() => stokes.through(m, d, n).i.clamp(0.0, 1.0),
        _ => unpolarised,
    }
}

/// Returns the matrices of reflection and transmission; a table has no phases, and reflects like a conductor.
fn mueller(coating: &Coating, split: &Split, cos_i: f64, n1: f64, n2: f64) -> [Mueller; 2] {
    match coating {
        Coating::Bare => [polarised::reflected(cos_i, n1 / n2), polarised::transmitted(cos_i, n1 / n2)],
        Coating::Metal { n, k } => [polarised::metal(cos_i, n1, *n, *k), Mueller::without_phase(split.transmitted)],
        _ => {
            let r = Mueller::without_phase(split.reflected);
            // Reflection turns p, as at a conductor; a table of shares says no more.
            [Mueller { c: -r.c, ..r }, Mueller::without_phase(split.transmitted)]
        }
    }
}

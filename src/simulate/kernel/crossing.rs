//! From one body into the next: the media on both sides of a face, where bodies touch or overlap too.

use super::contact::{aligned_body, siblings_at, touching_body};
use super::context::Context;
use super::interaction::SurfaceInteraction;
use super::media_at::recover_media;
use super::payload::RayPayload;
use crate::math::Ray;
use crate::simulate::outcome::LostCause;

/// The payload of a ray on both sides of a face.
pub(super) struct Crossing<C> {
    /// Before the face: what it came with, unless it was found to be somewhere else.
    pub(super) here: C,
    /// Behind the face.
    pub(super) across: C,
}

/// Returns the payload of a ray on both sides of the face at `at`. Where two faces are crossed at once, sets `at.skip` to the glue
/// distance; notes in `at.refused_contact` where the second of them could not be.
///
/// # Errors
/// The cause of loss, when a ray with these media, or those found anew from geometry, cannot be on the other side.
#[inline(always)]
pub(super) fn cross_face<C: RayPayload>(
    context: &Context<'_>,
    payload: C,
    ray: &Ray,
    at: &mut SurfaceInteraction<'_>,
) -> Result<Crossing<C>, LostCause> {
    let siblings = siblings_at(context, ray, &at.face_hit());
    // Two solids of one part have one medium: a bare boundary between them is drawn in the file and absent in the glass, and a coated one,
    // as of a beam splitter cemented of two prisms, has that medium on both sides. Only when the ray is in that body: from outside the
    // other solid is entered as usual.
    if siblings.against && payload.cross(at.face.body, false).is_some() {
        // From one solid of a part into the next.
        at.skip = context.glue_mm();
        return Ok(Crossing { here: payload, across: payload });
    }
    // Solids of one part that overlap and end at one place are entered or left at once.
    at.flush_solids = siblings.flush_solids;
    if at.flush_solids > 1 {
        at.skip = context.glue_mm();
    }
    // `cross_solids` refuses what cannot be, as leaving a body that the ray is not in.
    let cross_own = |payload: C| cross_solids(payload, at.face.body, at.entering, siblings.flush_solids);
    let mut here = payload;
    let mut across = cross_own(payload);
    // A ray may have slipped through a crack or a touching edge unseen. Before it is lost, its media are found anew from where it is; the
    // crossing is tried once more with them.
    let touching = at.face.touches_body || at.face.touches_sibling;
    if across.is_none()
        && let Some(recovered) = recover_media(context, &payload, ray, at.hit.t, touching)
        && let Some(beyond) = cross_own(recovered)
    {
        (here, across) = (recovered, Some(beyond));
    }
    // Where another body touches, light leaves the one and enters the other at one point, and meets no gap of air between.
    if at.face.touches_body {
        cross_contact(context, ray, at, &mut here, &mut across);
    }
    match across {
        Some(across) => Ok(Crossing { here, across }),
        // A full stack refuses every entry: that is a limit of ours and no flaw of the model, so it is counted apart.
        None if here.is_full() && at.entering => Err(LostCause::TooDeep),
        None => Err(LostCause::ImpossibleMedium),
    }
}

/// Returns the payload of a ray that enters or leaves so many solids of one body at once; `None` for what cannot be. Light that is known to
/// be in fewer of them leaves those.
#[inline(always)]
fn cross_solids<C: RayPayload>(payload: C, body: u32, entering: bool, solids: u32) -> Option<C> {
    let mut crossed = payload.cross(body, entering)?;
    for _ in 1..solids {
        match crossed.cross(body, entering) {
            Some(next) => crossed = next,
            None if entering => return None,
            None => break,
        }
    }
    Some(crossed)
}

/// Crosses both faces at once where the face lies on one of another body, against it or, where bodies overlap, looking the same way,
/// whichever the ray met first. Sets `across` to the payload behind both, `here` where its media had to be found anew, `at.skip`, and
/// `at.refused_contact` where only the first can be crossed. Changes nothing where no other face lies there.
#[inline(always)]
fn cross_contact<C: RayPayload>(
    context: &Context<'_>,
    ray: &Ray,
    at: &mut SurfaceInteraction<'_>,
    here: &mut C,
    across: &mut Option<C>,
) {
    let place = at.face_hit();
    if let Some(other) = touching_body(context, ray, &place) {
        // Whichever way the light goes on, it has met both faces.
        at.skip = context.glue_mm();
        let (body, solids) = (other.face.body, siblings_at(context, ray, &other).flush_solids);
        *across = match *across {
            // Through both faces at once, whichever the ray met first.
            Some(first) if !(at.entering && here.body() == at.face.body) => {
                // A first face that is met from outside of its own body leads into it, and the other one is left
                // behind it.
                let both = cross_solids(first, body, !at.entering, solids).or_else(|| {
                    // The other body is not where the light should be: it has passed an edge of three or more unseen.
                    let recovered = recover_media(context, here, ray, at.hit.t, true)?;
                    let first = cross_solids(recovered, at.face.body, at.entering, at.flush_solids)?;
                    let both = cross_solids(first, body, !at.entering, solids)?;
                    *here = recovered;
                    Some(both)
                });
                // The second face has no body to enter or leave here: only the first is crossed, which is counted.
                at.refused_contact = both.is_none();
                Some(both.unwrap_or(first))
            }
            // The second face of an interface that was crossed at the first.
            _ => Some(*here),
        };
    // Numbered alike from both sides, so that the order of crossing does not depend on which face came first.
    } else if let Some(other) = aligned_body(context, ray, &place) {
        let others = siblings_at(context, ray, &other).flush_solids;
        let mut crossed = [(at.face.body, at.flush_solids), (other.face.body, others)];
        crossed.sort_unstable();
        let [(first, of_first), (second, of_second)] = crossed;
        let both = cross_solids(*here, first, at.entering, of_first)
            .and_then(|payload| cross_solids(payload, second, at.entering, of_second));
        let inside = here.cross(first, false).is_some();
        // What looks the same way but is not passed here, as beyond an edge, is left alone.
        if inside == here.cross(second, false).is_some() {
            at.skip = context.glue_mm();
            // The second of two faces that were passed at the first.
            *across = if inside == at.entering { Some(*here) } else { both };
        }
    }
}

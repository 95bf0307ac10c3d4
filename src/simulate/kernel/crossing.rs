//! From one body into the next: the media on both sides of a face, where bodies touch or overlap too.

use super::contact::{aligned_body, touches_sibling, touching_body};
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
    // Two solids of one part have one medium: a bare boundary between them is drawn in the file and absent in the glass, and a coated one,
    // as of a beam splitter cemented of two prisms, has that medium on both sides. Only when the ray is in that body: from outside the
    // other solid is entered as usual.
    let leaves_sibling = at.face.touches_sibling && payload.cross(at.face.body, false).is_some();
    if leaves_sibling && touches_sibling(context, ray, &at.face_hit()) {
        // From one solid of a part into the next.
        at.skip = context.glue_mm();
        return Ok(Crossing { here: payload, across: payload });
    }
    // `payload.cross` refuses what cannot be, as leaving a body that the ray is not in.
    let mut here = payload;
    let mut across = payload.cross(at.face.body, at.entering);
    // A ray may have slipped through a crack or a touching edge unseen. Before it is lost, its media are found anew from where it is; the
    // crossing is tried once more with them.
    if across.is_none()
        && let Some(recovered) = recover_media(context, &payload, ray, at.hit.t, at.face.touches_body)
        && let Some(beyond) = recovered.cross(at.face.body, at.entering)
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
        *across = match *across {
            // Through both faces at once, whichever the ray met first.
            Some(first) if !(at.entering && here.body() == at.face.body) => {
                // A first face that is met from outside of its own body leads into it, and the other one is left
                // behind it.
                let both = first.cross(other, !at.entering).or_else(|| {
                    // The other body is not where the light should be: it has passed an edge of three or more unseen.
                    let recovered = recover_media(context, here, ray, at.hit.t, true)?;
                    let both = recovered.cross(at.face.body, at.entering)?.cross(other, !at.entering)?;
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
        let [first, second] = [at.face.body.min(other), at.face.body.max(other)];
        let both = here.cross(first, at.entering).and_then(|c| c.cross(second, at.entering));
        let inside = here.cross(first, false).is_some();
        // What looks the same way but is not passed here, as beyond an edge, is left alone.
        if inside == here.cross(second, false).is_some() {
            at.skip = context.glue_mm();
            // The second of two faces that were passed at the first.
            *across = if inside == at.entering { Some(*here) } else { both };
        }
    }
}

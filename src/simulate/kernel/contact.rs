//! Faces of two solids at one place.

use super::context::Context;
use super::tolerances::{ALIGNED, MOST_COINCIDENT_FACES, rounding_at, way_through_glue};
use crate::intersect::{Cost, Hit};
use crate::math::{Departure, FaceId, Point, Ray, Vector};
use crate::simulate::body::AMBIENT;
use crate::simulate::surfaces::{FaceOptics, Surface};
use smallvec::SmallVec;

/// A hit with what its face is to light.
#[derive(Clone, Copy)]
pub(super) struct FaceHit {
    pub(super) hit: Hit,
    pub(super) face: FaceOptics,
    pub(super) point: Point,
}

impl FaceHit {
    /// Returns the place as one that a ray leaves.
    pub(super) fn departure(&self) -> Departure {
        self.hit.departure()
    }
}

/// Returns the face of another body that a face lies on within the glue distance; `None` where there is none.
///
/// Found by asking for faces from just before the hit, this face left out: so a face at the very same place is found whether rounding puts
/// it before or behind.
pub(super) fn touching_body(context: &Context<'_>, ray: &Ray, at: &FaceHit) -> Option<FaceHit> {
    touching_face(context, ray, at, |other| touches_other(&at.face, other))
}

/// Whether two faces are of different bodies, of which this one touches others.
fn touches_other(face: &FaceOptics, other: &FaceOptics) -> bool {
    other.touches_body && other.body != face.body
}

/// Whether two faces are of one body, of two of its solids that may touch.
pub(super) fn may_be_siblings(face: &FaceOptics, other: &FaceOptics) -> bool {
    face.touches_sibling && other.touches_sibling && other.body == face.body && other.solid != face.solid
}

/// Other solids of the body of a face, at the place of a hit.
#[derive(Clone, Copy)]
pub(super) struct Siblings {
    /// Whether one lies against the face, looking the other way: between them there is no interface.
    pub(super) against: bool,
    /// Solids of the body that are entered or left there at once: the face's own, and those that overlap it and end at the same place.
    pub(super) flush_solids: u32,
}

/// Returns what other solids of its body have within the glue distance of a face.
#[inline(always)]
pub(super) fn siblings_at(context: &Context<'_>, ray: &Ray, at: &FaceHit) -> Siblings {
    if at.face.touches_sibling {
        find_siblings(context, ray, at)
    } else {
        Siblings { against: false, flush_solids: 1 }
    }
}

/// Finds the siblings of [`siblings_at`] along the ray.
#[inline(never)]
fn find_siblings(context: &Context<'_>, ray: &Ray, at: &FaceHit) -> Siblings {
    let entering = ray.direction.dot(at.hit.geometric_normal) < 0.0;
    let probe = probe_at(context, ray, at);
    let own_t = 0.5 * probe.t_max;
    // What lies behind the start of the ray was crossed before, as by light that has come in beside the edge of a solid.
    let start_t = own_t - (at.point - ray.origin).dot(ray.direction) + ray.t_min + rounding_at(at.point);
    let mut against = false;
    let mut flush: SmallVec<[u32; MOST_COINCIDENT_FACES]> = SmallVec::new();
    for (hit, face) in faces_along(context, probe) {
        if !may_be_siblings(&at.face, &face) {
            continue;
        }
        let cosine = hit.geometric_normal.dot(at.hit.geometric_normal);
        against |= cosine < -ALIGNED;
        let same_way = (ray.direction.dot(hit.geometric_normal) < 0.0) == entering;
        let behind_start = hit.t < own_t && hit.t <= start_t;
        if cosine > ALIGNED && same_way && !behind_start && !flush.contains(&face.solid) {
            // As of two bodies: where the own solid lies against that face it ends where the other begins.
            let place = FaceHit { hit, face, point: probe.point_at(hit.t) };
            if !lies_on_solid(context, ray, &place, &at.face) {
                flush.push(face.solid);
            }
        }
    }
    Siblings { against, flush_solids: 1 + flush.len() as u32 }
}

/// Returns the face of another body that lies at the same place and looks the same way: bodies that overlap and end at the same plane. Both
/// are entered or left at once, wherever rounding puts the second face. `None` where there is none, or where the own solid lies against
/// that face, as next to the edge of a wedge: its body ends where the other begins.
#[inline(never)]
pub(super) fn aligned_body(context: &Context<'_>, ray: &Ray, at: &FaceHit) -> Option<FaceHit> {
    // The direction of the ray against the outward normal shows whether it goes in or out, whichever of the two
    // faces is met first.
    let entering = ray.direction.dot(at.hit.geometric_normal) < 0.0;
    let probe = probe_at(context, ray, at);
    let (hit, face) = faces_along(context, probe).find(|(found, other)| {
        let same_way = (ray.direction.dot(found.geometric_normal) < 0.0) == entering;
        let aligned = found.geometric_normal.dot(at.hit.geometric_normal) > ALIGNED;
        other.touches_body && other.body != at.face.body && same_way && aligned
    })?;
    let other = FaceHit { hit, face, point: probe.point_at(hit.t) };
    (!lies_on_solid(context, ray, &other, &at.face)).then_some(other)
}

/// Whether the solid that the face `of_solid` bounds lies against another face within the glue distance.
pub(super) fn lies_on_solid(context: &Context<'_>, ray: &Ray, at: &FaceHit, of_solid: &FaceOptics) -> bool {
    let counts = |other: &FaceOptics| other.body == of_solid.body && other.solid == of_solid.solid;
    touching_face(context, ray, at, counts).is_some()
}

/// Returns the piece of a ray around its hit that lies within the glue distance of the face; that face is its departure, and left out.
fn probe_at(context: &Context<'_>, ray: &Ray, at: &FaceHit) -> Ray {
    let reach = way_through_glue(context.glue_mm(), ray.direction.dot(at.hit.geometric_normal));
    Ray::new(at.point - ray.direction * reach, ray.direction)
        .with_range(0.0, 2.0 * reach)
        .with_departure(at.departure())
}

/// Goes through the faces that a short ray meets, in order, at most [`MOST_COINCIDENT_FACES`] of them; ends at a face that the scene does
/// not know.
///
/// An intersector may return a root again, moved by rounding to the query's start; the next query then starts a little farther on.
/// Without that, light that was reflected beside an edge of a touching body was lost on the spline: the face that stands across came six
/// times, and the partner behind it not at all.
pub(super) fn faces_along<'a>(
    context: &'a Context<'a>,
    mut probe: Ray,
) -> impl Iterator<Item = (Hit, FaceOptics)> + 'a {
    let rounding = rounding_at(probe.origin);
    let mut last: Option<(FaceId, f64)> = None;
    (0..2 * MOST_COINCIDENT_FACES)
        .map_while(move |_| {
            let found = context.intersector.intersect(&probe, &mut Cost::default())?;
            // The same face no farther than rounding: it is the root that was just passed.
            let repeated = last.is_some_and(|(face, t)| face == found.face && found.t <= t + rounding);
            probe.t_min = if repeated { found.t + rounding } else { found.t.next_up() };
            last = Some((found.face, found.t));
            let optics = *context.bound.faces.get(found.face.index())?;
            Some((!repeated).then_some((found, optics)))
        })
        .flatten()
        .take(MOST_COINCIDENT_FACES)
}

/// The contact of two faces that a segment starts from.
pub(super) struct LeftContact {
    /// The face that the segment leaves.
    pub(super) face: FaceOptics,
    /// Its outward normal.
    pub(super) normal: Vector,
    /// Length, mm, within which the segment meets the other face.
    pub(super) reach: f64,
    /// Whether other solids of its body that end there were entered or left at once with it.
    pub(super) flush_siblings: bool,
}

impl LeftContact {
    /// Whether a face that lies along the contact is one that the light on `next` has crossed there or was reflected at: one by which it
    /// cannot enter or leave a body, because it is in it already or no more.
    ///
    /// What is entered against the face that it leaves counts as the second of the pair too, unless the body that the light is in ends
    /// there: where two bodies lie side by side on a third, the one that light was taken to enter need not be the one that it meets.
    fn was_crossed(
        &self,
        context: &Context<'_>,
        next: &Ray,
        found: &FaceHit,
        is_inside: &dyn Fn(u32) -> bool,
    ) -> bool {
        let face = &found.face;
        let enters = |normal: Vector| next.direction.dot(normal) < 0.0;
        let entering = enters(found.hit.geometric_normal);
        let against = entering != enters(self.normal);
        if face.body == AMBIENT {
            // Of two sheets or solids at the very same place the first decides, and the back of a solid cannot be met.
            return found.hit.t <= rounding_at(next.origin) || face.opaque_solid && !entering;
        }
        // Solids of one body that end at one place were all met there, whichever of them the light is in besides.
        if self.flush_siblings && !against && may_be_siblings(&self.face, face) {
            return true;
        }
        if entering {
            let ends_there = |other: &FaceOptics| is_inside(other.body);
            return is_inside(face.body) || against && touching_face(context, next, found, ends_there).is_none();
        }
        // Light in one of two solids of one body is in that body, whichever of their faces it has met.
        !is_inside(face.body) || against && may_be_siblings(&self.face, face)
    }
}

/// Returns how far along `next` the segment starts, mm, of light that has met both of two faces at one place: past the faces along them
/// within reach that it has crossed already, to judge by the bodies that it is in now (`is_inside`); see [`LeftContact::was_crossed`].
///
/// Not past a face that it is yet to cross, as the other side of a wedge near its edge: light that grazed the end of a contact was lost.
/// Nor past a face that stands across, as beside an edge: 4 % of what is trapped in eight touching bricks got out between their faces in
/// 200 times their length.
///
/// What has been passed is passed by its rounding, as the spline returns a root again for a query that starts next to it: light that was
/// reflected within the glue distance of an edge met the second face there, and 9 % of that in a square die was lost.
#[inline(never)]
pub(super) fn end_of_contact(
    context: &Context<'_>,
    next: &Ray,
    contact: &LeftContact,
    is_inside: &dyn Fn(u32) -> bool,
) -> f64 {
    let rounding = rounding_at(next.origin);
    let mut passed = 0.0;
    let mut start = 0.0;
    for (found, face) in faces_along(context, next.with_range(0.0, contact.reach)) {
        // Beyond a face across the ray is beside the pair.
        let across = found.geometric_normal.dot(contact.normal).abs() <= ALIGNED;
        let place = FaceHit { hit: found, face, point: next.point_at(found.t) };
        if across || !contact.was_crossed(context, next, &place, is_inside) {
            // Nearer than rounding to the face that ends the contact, the start lies between both.
            return f64::min(start, 0.5 * (passed + found.t));
        }
        passed = found.t.next_up();
        start = found.t + rounding;
    }
    contact.reach
}

/// Returns the face of those that `counts` that lies against this one within the glue distance; of several, as about a thin wedge between
/// two bodies, the nearest along the ray; `None` where there is none.
fn touching_face(
    context: &Context<'_>,
    ray: &Ray,
    at: &FaceHit,
    counts: impl Fn(&FaceOptics) -> bool,
) -> Option<FaceHit> {
    let along = ray.direction.dot(at.hit.geometric_normal);
    let probe = probe_at(context, ray, at);
    let own_t = 0.5 * probe.t_max;
    let rounding = rounding_at(at.point);
    let mut nearest: Option<FaceHit> = None;
    // Near an edge others come in between.
    for (hit, face) in faces_along(context, probe) {
        if nearest.is_some_and(|n| hit.t - own_t >= own_t - n.hit.t) {
            break;
        }
        let opposite = (ray.direction.dot(hit.geometric_normal) < 0.0) != (along < 0.0);
        let against = hit.geometric_normal.dot(at.hit.geometric_normal) < -ALIGNED;
        if counts(&face) && opposite && against {
            nearest = Some(FaceHit { hit, face, point: probe.point_at(hit.t) });
            // From the face itself on all that follows is farther off.
            if hit.t >= own_t - rounding {
                break;
            }
        }
    }
    nearest
}

/// Which of two faces at one place says what happens there.
pub(super) enum ContactSurface {
    /// Both are bare, or there is no such pair.
    Bare,
    /// The face that was hit.
    Own,
    /// The face that lies against it.
    Partner(FaceHit),
}

/// Decides which of two faces at one place, of two bodies or of two solids of one, says what happens there: the one that is not bare, of
/// two such the one that the light is leaving; so it does not depend on which of them rounding puts first.
#[inline(never)]
pub(super) fn contact_surface(context: &Context<'_>, ray: &Ray, at: &FaceHit) -> ContactSurface {
    let counts = |other: &FaceOptics| touches_other(&at.face, other) || may_be_siblings(&at.face, other);
    let Some(partner) = touching_face(context, ray, at, counts) else { return ContactSurface::Bare };
    // Bare: what happens follows from the two media alone, and is the same from either face.
    let is_bare = |f: &FaceOptics| context.bound.surfaces[f.surface as usize] == Surface::Interface;
    let entering = ray.direction.dot(at.hit.geometric_normal) < 0.0;
    match [is_bare(&at.face), is_bare(&partner.face)] {
        [true, true] => ContactSurface::Bare,
        [true, false] => ContactSurface::Partner(partner),
        [false, true] => ContactSurface::Own,
        [false, false] if entering => ContactSurface::Partner(partner),
        [false, false] => ContactSurface::Own,
    }
}

/// Finds the body that lies on the opaque face of a source: light shines into what is glued on a die, not against it. Moves the start
/// (`t_min`) of `ray` to behind that body's face, and returns the ray that begins there; `None`, `ray` unchanged, where there is none.
#[inline(never)]
pub(super) fn emit_into_contact(context: &Context<'_>, face: FaceId, normal: Vector, ray: &mut Ray) -> Option<Ray> {
    // Only a source that lies on an opaque solid can have a body glued over it.
    let optics = context.bound.faces.get(face.index()).filter(|f| f.medium_on_opaque && f.body == AMBIENT)?;
    let reach = way_through_glue(context.glue_mm(), ray.direction.dot(normal));
    let back = ray.origin - ray.direction * reach;
    let probe = Ray { departure: ray.departure, ..Ray::new(back, ray.direction).with_range(0.0, 2.0 * reach) };
    let lies_on_it = |(found, other): (Hit, FaceOptics)| {
        let against = found.geometric_normal.dot(normal) < -ALIGNED;
        other.medium_on_opaque && other.body != optics.body && against
    };
    faces_along(context, probe).any(lies_on_it).then(|| {
        // Its media are not known yet: of the body on the die only the face against it is passed.
        let contact = LeftContact { face: *optics, normal, reach, flush_siblings: false };
        ray.t_min = end_of_contact(context, ray, &contact, &|_| true);
        Ray::new(ray.point_at(ray.t_min), ray.direction)
    })
}

/// How far back the front of a solid is looked for, mm, that a ray has slipped into between the facets of two touching faces: the
/// largest gap that facets of a usual sag leave between them.
const DEEPEST_SLIP: f64 = 1.0;

/// Returns the opaque face that lies against the one by which light leaves a body, within the glue distance; for a hit on an opaque solid
/// from inside, its front up to [`DEEPEST_SLIP`] before the ray's start. `None` where there is no such face.
#[cold]
pub(super) fn opaque_contact(context: &Context<'_>, ray: &Ray, at: &FaceHit) -> Option<FaceHit> {
    let probe = if at.face.opaque_solid {
        // Only light that has just left another face can have slipped in.
        let back = ray.origin - ray.direction * DEEPEST_SLIP;
        Ray::new(back, ray.direction).with_range(0.0, DEEPEST_SLIP).with_departure(ray.departure?)
    } else {
        probe_at(context, ray, at)
    };
    let slipped = at.face.opaque_solid;
    let cosine = |found: &Hit| found.geometric_normal.dot(at.hit.geometric_normal);
    // The nearest that lies along the face, and no other: behind it the ray would be inside of the solid. A face that stands across is of
    // an edge: the wall of a dome that light was reflected at just above its board, or that of a dot which light comes to beside it.
    let lies_along = |found: &Hit| slipped || cosine(found).abs() > ALIGNED;
    let (hit, face) = faces_along(context, probe).find(|(found, _)| lies_along(found))?;
    let is_opaque = face.medium_on_opaque && face.body == AMBIENT;
    let is_front = ray.direction.dot(hit.geometric_normal) < 0.0 && (slipped || cosine(&hit) < 0.0);
    (is_opaque && is_front).then(|| FaceHit { hit, face, point: probe.point_at(hit.t) })
}

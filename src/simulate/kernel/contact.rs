//! Faces of two solids at one place.

use super::Context;
use super::step::Meeting;
use crate::intersect::{Cost, Hit};
use crate::math::{Departure, FaceId, Point, Ray, Vector};
use crate::simulate::bind::{AMBIENT, FaceOptics, Surface};

/// The body on the other side of a face that lies on a face of another body within the glue distance.
///
/// Found by asking for the nearest face from just before the hit, this face left out: so a face at the very same place is found
/// whether rounding puts it before or behind.
pub(super) fn glued(context: &Context<'_>, ray: &Ray, at: &Meeting<'_>) -> Option<u16> {
    partner(context, ray, at.hit, at.face, at.point).map(|(_, other, _)| other.body)
}

/// Whether another solid of the same body lies against the face, looking the other way: between them there is no interface.
#[inline(never)]
pub(super) fn twin(context: &Context<'_>, ray: &Ray, at: &Meeting<'_>) -> bool {
    met(context, beside(context, ray, at.hit, at.point)).any(|(found, other)| {
        other.twin && other.body == at.face.body && found.geometric_normal.dot(at.hit.geometric_normal) < -0.5
    })
}

/// Another body whose face lies at the same place and looks the same way: bodies that overlap and end at the same plane. Both are
/// entered or left at once, wherever rounding puts the second face.
#[inline(never)]
pub(super) fn alike(context: &Context<'_>, ray: &Ray, at: &Meeting<'_>) -> Option<u16> {
    let mut met = met(context, beside(context, ray, at.hit, at.point));
    let (_, other) = met.find(|(found, other)| {
        let same = (ray.direction.dot(found.geometric_normal) < 0.0) == at.entering;
        let along = found.geometric_normal.dot(at.hit.geometric_normal) > 0.5;
        other.touching && other.body != at.face.body && same && along
    })?;
    Some(other.body)
}

/// The piece of a ray around its hit that lies within the glue distance of the face, that face left out.
fn beside(context: &Context<'_>, ray: &Ray, hit: &Hit, point: Point) -> Ray {
    let cos = ray.direction.dot(hit.geometric_normal).abs().max(1e-3);
    let reach = context.bound.scene.run.glue_mm / cos;
    let from = Departure { face: hit.face, primitive: hit.primitive, uv: hit.uv };
    Ray::new(point - ray.direction * reach, ray.direction).with_range(0.0, 2.0 * reach).with_departure(from)
}

/// Faces within the glue distance among which the partner is looked for.
const NEAR: usize = 6;

/// The faces that a short ray meets, one after another.
///
/// An intersector may give a root once more, moved up to where it is asked from by rounding; it is asked from a little farther on
/// then. Without that, light that was reflected beside an edge of a glued body was lost on the spline: the face that stands across
/// came six times, and the partner behind it not at all.
fn met<'a>(context: &'a Context<'a>, mut probe: Ray) -> impl Iterator<Item = (Hit, FaceOptics)> + 'a {
    let rounding = 1e-9 + 1e-12 * probe.origin.abs().max_element();
    let mut last: Option<(FaceId, f64)> = None;
    (0..2 * NEAR)
        .map_while(move |_| {
            let found = context.intersector.intersect(&probe, &mut Cost::default())?;
            let again = last.is_some_and(|(face, t)| face == found.face && found.t <= t + rounding);
            probe.t_min = if again { found.t + rounding } else { found.t.next_up() };
            last = Some((found.face, found.t));
            let optics = *context.bound.faces.get(found.face.index())?;
            Some((!again).then_some((found, optics)))
        })
        .flatten()
        .take(NEAR)
}

/// Where the segment of light starts that has met both of two faces at one place, mm: behind all faces along them within `reach`,
/// but not behind a face that stands across, as beside an edge. Without that, 4 % of what is caught in eight glued bricks got out
/// between their faces in 200 times their length.
#[inline(never)]
pub(super) fn beyond(context: &Context<'_>, next: &Ray, normal: Vector, reach: f64) -> f64 {
    let mut behind = 0.0;
    for (found, _) in met(context, next.with_range(0.0, reach)) {
        if found.geometric_normal.dot(normal).abs() <= 0.5 {
            return behind;
        }
        behind = found.t.next_up();
    }
    reach
}

/// That face, with its optics and the place.
fn partner(
    context: &Context<'_>,
    ray: &Ray,
    hit: &Hit,
    face: FaceOptics,
    point: Point,
) -> Option<(Hit, FaceOptics, Point)> {
    let along = ray.direction.dot(hit.geometric_normal);
    let probe = beside(context, ray, hit, point);
    // Near an edge others come in between.
    let (found, other) = met(context, probe).find(|(found, other)| {
        let opposite = (ray.direction.dot(found.geometric_normal) < 0.0) != (along < 0.0);
        let against = found.geometric_normal.dot(hit.geometric_normal) < -0.5;
        other.touching && other.body != face.body && opposite && against
    })?;
    Some((found, other, probe.point_at(found.t)))
}

/// Which of two faces at one place says what happens there, when not both are bare: the one that is not, of two such the one that
/// the light is leaving; so it does not depend on which of them rounding puts first. `Ok` is the partner, `Err` the face itself,
/// none when there is no such pair.
#[inline(never)]
pub(super) fn dressed(
    context: &Context<'_>,
    ray: &Ray,
    hit: &Hit,
    face: FaceOptics,
    point: Point,
) -> Option<Result<(Hit, FaceOptics, Point), ()>> {
    let (found, other, place) = partner(context, ray, hit, face, point)?;
    let bare = |f: &FaceOptics| context.bound.surfaces[f.surface as usize] == Surface::Interface;
    let entering = ray.direction.dot(hit.geometric_normal) < 0.0;
    match [bare(&face), bare(&other)] {
        [true, true] => None,
        [true, false] => Some(Ok((found, other, place))),
        [false, true] => Some(Err(())),
        [false, false] => Some(if entering { Ok((found, other, place)) } else { Err(()) }),
    }
}

/// The ray of a source on an opaque face that a body lies on, moved to behind the body's face: light shines into what is glued on a
/// die, not against it. `None` where there is no such body.
#[inline(never)]
pub(super) fn lit_from(context: &Context<'_>, face: FaceId, normal: Vector, ray: &mut Ray) -> Option<Ray> {
    let optics = context.bound.faces.get(face.index()).filter(|f| f.against && f.body == AMBIENT)?;
    let reach = context.bound.scene.run.glue_mm / ray.direction.dot(normal).abs().max(1e-3);
    let back = ray.origin - ray.direction * reach;
    let probe = Ray { departure: ray.departure, ..Ray::new(back, ray.direction).with_range(0.0, 2.0 * reach) };
    let on_it = |(found, other): (Hit, FaceOptics)| {
        other.against && other.body != optics.body && found.geometric_normal.dot(normal) < -0.5
    };
    met(context, probe).any(on_it).then(|| {
        ray.t_min = beyond(context, ray, normal, reach);
        Ray::new(ray.point_at(ray.t_min), ray.direction)
    })
}

/// How far back the front of a solid is looked for, mm, that a ray has slipped into between the facets of two touching faces.
const SLIP: f64 = 1.0;

/// The face of an opaque solid in front of light that leaves a body there, within the glue distance; or in front of light that
/// is in a solid where none can be. With its optics and the place.
#[cold]
pub(super) fn contact(
    context: &Context<'_>,
    ray: &Ray,
    hit: &Hit,
    face: FaceOptics,
    point: Point,
) -> Option<(Hit, FaceOptics, Point)> {
    let probe = match face.sealed {
        // Only light that has just left another face can have slipped in.
        true => Ray::new(ray.origin - ray.direction * SLIP, ray.direction)
            .with_range(0.0, SLIP)
            .with_departure(ray.departure?),
        false => beside(context, ray, hit, point),
    };
    let found = context.intersector.intersect(&probe, &mut Cost::default())?;
    let other = *context.bound.faces.get(found.face.index())?;
    let entering = ray.direction.dot(found.geometric_normal) < 0.0;
    (other.against && other.body == AMBIENT && entering).then(|| (found, other, probe.point_at(found.t)))
}

//! The bodies around a point, from geometry: for sources that do not say what they lie in, and for light that has passed an edge unseen.

use super::contact::{FaceHit, faces_along, lies_on_solid, may_be_siblings};
use super::context::{Bodies, Context};
use super::payload::RayPayload;
use super::tolerances::{ALIGNED, MOST_COINCIDENT_FACES, rounding_at, way_through_glue};
use crate::intersect::{Cost, Hit};
use crate::math::{FaceId, Point, Ray, orthonormal_pair};
use crate::simulate::body::AMBIENT;
use crate::simulate::surfaces::FaceOptics;
use smallvec::SmallVec;

/// Faces on the way out after which it is given up: a few times what stands in one line in any model of the corpus.
const MOST_FACES_ON_WAY_OUT: usize = 1000;

/// How far a second and a third way out are turned off the first, as slopes along two axes across it: some degrees, far enough to pass
/// an edge elsewhere, near enough to leave by the same bodies.
const TILTS: [[f64; 2]; 2] = [[0.031, 0.017], [-0.013, 0.029]];

/// Length into the segment, mm, at whose half the bodies are asked for: a place that is surely past the edge.
const LONGEST_LOOK: f64 = 1.0;

/// Returns the bodies around the start of a ray, outermost first, by following it straight out of the scene; empty in the surroundings.
/// Bodies whose box the start is out of are left out, whatever was met on the way.
///
/// Where solids touch, a way out that comes near an edge of three of them may miss one; then a second and a third way are followed, and two
/// that agree decide, or the first where none do.
pub(super) fn media_at(context: &Context<'_>, ray: &Ray) -> Bodies {
    let mut bodies = media_on_way_out(context, ray);
    // A way that comes in by the opening of a body and leaves by a face would suggest that it began there. Sources beside such a body were
    // probed ray by ray for that.
    bodies.retain(|&mut body| is_within_box(context, body, ray.origin));
    bodies
}

/// Whether a point, mm, lies in the box around a body, to within rounding and the glue distance.
fn is_within_box(context: &Context<'_>, body: u32, point: Point) -> bool {
    context.bound.bodies[body as usize].bounds.grown(context.glue_mm() + rounding_at(point)).contains(point)
}

/// Returns the bodies that two of three ways out leave without having entered them, outermost first.
fn media_on_way_out(context: &Context<'_>, ray: &Ray) -> Bodies {
    // Away from edges of touching solids the first way out is beyond doubt, and it is nearly always enough.
    let (first, certain) = bodies_left(context, ray);
    if certain {
        return first;
    }
    let (x, y) = orthonormal_pair(ray.direction);
    let tilted = |[a, b]: [f64; 2]| {
        let direction = (ray.direction + x * a + y * b).normalize();
        bodies_left(context, &Ray { direction, ..*ray }).0
    };
    let second = tilted(TILTS[0]);
    if second == first {
        return first;
    }
    let third = tilted(TILTS[1]);
    // Two of three: an edge that is missed on one way is not missed on another some degrees off.
    if third == second { second } else { first }
}

/// Returns the bodies that a ray leaves on its straight way out without having entered them, outermost first, and whether no two of them
/// touched on it. Given up after [`MOST_FACES_ON_WAY_OUT`] faces, uncertain, with what was found so far.
fn bodies_left(context: &Context<'_>, ray: &Ray) -> (Bodies, bool) {
    let mut crossings = Crossings::default();
    let mut certain = true;
    let mut segment = Ray { t_max: f64::INFINITY, ..*ray };
    // From the start of the ray to that of the segment.
    let mut length = 0.0;
    let mut passed = PassedFaces::default();
    let mut faces = 0;
    // Straight out of the scene: what is left without having been entered must have been around the start, whatever the shapes are.
    while let Some(hit) = context.intersector.intersect(&segment, &mut Cost::default()) {
        if faces == MOST_FACES_ON_WAY_OUT {
            certain = false;
            break;
        }
        faces += 1;
        let d = segment.direction;
        let point = segment.point_at(hit.t);
        // Against the outward normal the ray goes in, along it out.
        let entering = d.dot(hit.geometric_normal) < 0.0;
        let here = PassedFace { face: hit.face, entering, distance: length + hit.t };
        let rounding = rounding_at(point);
        if passed.contains(&here, rounding) {
            // The second face of a contact, noted with the first.
            segment.t_min = hit.t + rounding;
            continue;
        }
        segment = Ray::new(point, d).with_departure(hit.departure());
        length = here.distance;
        // A face that the scene does not know bounds no body.
        let Some(face) = context.bound.faces.get(hit.face.index()) else { continue };
        crossings.note_crossing(face.body, entering);
        if !(face.touches_body || face.medium_on_opaque || face.touches_sibling) {
            continue;
        }
        passed.0.push(here);
        // Both faces of touching solids are crossed at once, as light crosses them, wherever rounding puts the second.
        if let Some((second, other)) = second_of_contact(context, &segment, &hit, length, &passed) {
            crossings.note_crossing(other.body, second.entering);
            passed.0.push(second);
            certain = false;
        }
    }
    (crossings.bodies_around(), certain)
}

/// Returns the face that lies within the glue distance of one that the way out has just met, at the start of `segment` and at this length
/// of the way, and what it is to light: the nearest that may touch that face and is not passed yet. `None` where there is none.
fn second_of_contact(
    context: &Context<'_>,
    segment: &Ray,
    hit: &Hit,
    length: f64,
    passed: &PassedFaces,
) -> Option<(PassedFace, FaceOptics)> {
    let face = context.bound.faces.get(hit.face.index())?;
    let (point, d) = (segment.origin, segment.direction);
    let rounding = rounding_at(point);
    let along = d.dot(hit.geometric_normal);
    let reach = way_through_glue(context.glue_mm(), along);
    let may_touch = |other: &FaceOptics| {
        if other.body == face.body {
            may_be_siblings(face, other)
        } else {
            other.touches_body && face.touches_body || other.medium_on_opaque && face.medium_on_opaque
        }
    };
    let probe = Ray::new(point - d * reach, d).with_range(0.0, 2.0 * reach).with_departure(hit.departure());
    faces_along(context, probe)
        .filter(|(_, other)| may_touch(other))
        .filter_map(|(found, other)| {
            let behind = found.t - reach;
            let entering = d.dot(found.geometric_normal) < 0.0;
            // Touching bodies look against each other. Overlapping ones that end at one plane look the same way there; what does so and was
            // met before is another face of the body that is left.
            let opposite = entering == (along >= 0.0);
            let aligned = found.geometric_normal.dot(hit.geometric_normal) > ALIGNED && behind >= -rounding;
            let second = PassedFace { face: found.face, entering, distance: length + behind };
            if !(opposite || aligned) || passed.contains(&second, rounding) {
                return None;
            }
            // Nor does a body that begins where the first one ends overlap it.
            let place = FaceHit { hit: found, face: other, point: probe.point_at(found.t) };
            let overlaps = opposite || !lies_on_solid(context, &probe, &place, face);
            overlaps.then_some((behind.abs(), second, other))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, second, other)| (second, other))
}

/// Returns the payload of a ray with the media that geometry finds on its way to `end` (mm), for a ray that carries media that cannot be.
/// `None` where the innermost body stays the same, more bodies are found than it can carry, or neither it nor the face it comes to
/// (`touching`) is where bodies touch: there alone it may have passed an edge of three or more of them unseen.
#[cold]
pub(super) fn recover_media<C: RayPayload>(
    context: &Context<'_>,
    payload: &C,
    ray: &Ray,
    end: f64,
    touching: bool,
) -> Option<C> {
    // Without nesting a ray has one body at most, and a crossing that cannot be is a fault of the model.
    if !(context.bound.nested && (touching || ray.t_min > 0.0)) {
        return None;
    }
    // Half-way to the end, but near the start: far along there may be another body.
    let middle = 0.5 * (ray.t_min + end.min(ray.t_min + LONGEST_LOOK));
    let recovered = payload.moved_inside(&media_at(context, &Ray::new(ray.point_at(middle), ray.direction)))?;
    (recovered.body() != payload.body()).then_some(recovered)
}

/// Whether light that a receiver would end has left its body by an opening: the body is open, and on the way on it is not left.
#[inline]
pub(super) fn has_left_by_opening<C: RayPayload>(
    context: &Context<'_>,
    payload: &C,
    ray: &Ray,
    point: Point,
) -> bool {
    let body = payload.body();
    let open = context.bound.bodies[body as usize].open;
    // Outside its box no check is needed.
    open && (!is_within_box(context, body, point)
        || !media_at(context, &Ray::new(point, ray.direction)).contains(&body))
}

/// A face that a way out has passed.
#[derive(Clone, Copy)]
struct PassedFace {
    face: FaceId,
    entering: bool,
    /// From the start of the way, mm.
    distance: f64,
}

/// Faces of solids that may touch, in the order in which a way out passed them.
#[derive(Default)]
struct PassedFaces(SmallVec<[PassedFace; 8]>);

impl PassedFaces {
    /// Whether a face was passed there, to within `rounding`, mm. Only the last faces are checked: no others can be as near.
    fn contains(&self, other: &PassedFace, rounding: f64) -> bool {
        self.0.iter().rev().take(MOST_COINCIDENT_FACES).any(|passed| {
            passed.face == other.face
                && passed.entering == other.entering
                && (passed.distance - other.distance).abs() <= rounding
        })
    }
}

/// Faces of bodies crossed one after another on the way out.
#[derive(Default)]
struct Crossings {
    left: Bodies,
    entered: Bodies,
}

impl Crossings {
    /// Notes that the way goes into, or out of, a body; the surroundings are left out.
    fn note_crossing(&mut self, body: u32, entering: bool) {
        if body == AMBIENT {
            return;
        }
        // A body may have been entered on the way out, and is then left as it was entered.
        match self.entered.iter().rposition(|b| *b == body) {
            Some(k) if !entering => drop(self.entered.remove(k)),
            None if !entering => self.left.push(body),
            _ => self.entered.push(body),
        }
    }

    /// Returns the bodies that the way left without having entered them, the outermost first.
    fn bodies_around(mut self) -> Bodies {
        // A solid that is turned inside out is left before it is entered.
        self.left.retain(|b| !self.entered.contains(b));
        self.left.reverse();
        self.left
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_and_was_not_entered_is_around() {
        let around = |crossings: &[(u32, bool)]| {
            let mut c = Crossings::default();
            crossings.iter().for_each(|&(body, entering)| c.note_crossing(body, entering));
            c.bodies_around().to_vec()
        };
        assert_eq!(around(&[(1, true), (1, false)]), Vec::<u32>::new());
        assert_eq!(around(&[(2, false), (3, true), (3, false), (1, false)]), [1, 2]);
        assert_eq!(around(&[(1, true), (2, true), (1, false), (2, false)]), Vec::<u32>::new());
        // Inside out.
        assert_eq!(around(&[(1, false), (1, true)]), Vec::<u32>::new());
        assert_eq!(around(&[(AMBIENT, false)]), Vec::<u32>::new());
    }
}

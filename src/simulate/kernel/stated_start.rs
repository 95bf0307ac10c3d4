//! Where rays begin whose source lies near faces and whose scene states what it is inside of: on the side of each face on
//! which that is true, whichever side the source was drawn on, or rounding puts it. Where it is true on both sides of a thin body, on the
//! nearer one.
//!
//! Known weaknesses: between two bodies that touch there is no room, so that light that is stated to be in neither counts as coming out of
//! the one behind it. Light that is stated to be outside of a body and starts in an edge of it is aimed at that edge, where two faces let
//! it in at once: what goes into the body may be lost, and is reported as such.

use super::context::Context;
use super::tolerances::{ALIGNED, MOST_COINCIDENT_FACES, rounding_at, way_through_glue};
use crate::intersect::{Cost, Hit};
use crate::math::Ray;
use crate::simulate::body::AMBIENT;
use crate::simulate::surfaces::FaceOptics;
use smallvec::SmallVec;

/// A face that the line of a ray meets near its start.
struct NearFace {
    hit: Hit,
    face: FaceOptics,
    /// Place on the ray, mm: negative behind its start.
    t: f64,
    entering: bool,
}

impl NearFace {
    /// Whether it bounds a body or an opaque solid.
    fn bounds_solid(&self) -> bool {
        self.face.opaque_solid || self.face.body != AMBIENT
    }

    /// Whether light that is inside of these bodies has the face behind it: one by which it came into one of them, or out of another or of
    /// an opaque solid. A sheet stays where it is.
    fn lies_behind(&self, inside: &[u32]) -> bool {
        if self.face.body != AMBIENT {
            self.entering == inside.contains(&self.face.body)
        } else if self.face.opaque_solid {
            !self.entering
        } else {
            self.t <= 0.0
        }
    }
}

/// Returns the ray of a source that is stated to lie inside of these bodies, and of no others, started where that is true: before the faces
/// that it is yet to cross, of those within the glue distance of its start, and behind the others. The ray as it is where it lies clear of
/// them, and where no body and no opaque solid has a face there.
///
/// Distances to faces are those across them: along a ray that slants by 60° faces within the glue distance are met up to twice as far off.
#[cold]
pub(super) fn start_in_stated_media(context: &Context<'_>, inside: &[u32], ray: &Ray) -> Ray {
    let near = faces_near_start(context, ray);
    if !near.iter().any(NearFace::bounds_solid) {
        return *ray;
    }
    let room = 2.0 * rounding_at(ray.origin);
    let is_passed = |f: &NearFace| is_undone(&near, f, inside, room) || passes_edge(&near, f, room);
    let is_ahead = |f: &&NearFace| f.bounds_solid() && !f.lies_behind(inside) && !is_passed(f);
    let ahead = near.iter().find(is_ahead).map_or(f64::INFINITY, |f| f.t);
    // At one place rounding puts them in either order.
    let behind = near.iter().rfind(|f| f.lies_behind(inside) && f.t <= ahead + room);
    let begin = behind.map_or(f64::NEG_INFINITY, |f| f.t);
    // A sheet that is yet to be met is not passed.
    let is_sheet_ahead = |f: &&NearFace| !f.bounds_solid() && f.t > f64::max(begin, 0.0) + 2.0 * room;
    let sheet = near.iter().find(is_sheet_ahead).map_or(f64::INFINITY, |f| f.t);
    let end = f64::min(ahead, sheet);
    if begin < -room && end > room {
        return *ray;
    }
    let glue = context.glue_mm();
    let start = |t: f64| Ray::new(ray.point_at(t), ray.direction);
    let clear = f64::min(glue, 0.5 * (end - begin));
    match behind {
        None => start(f64::min(end - room, -glue)),
        // By the glue distance, for facets that lie a little off the hits that are moved to the spline.
        Some(_) if end == f64::INFINITY => start(f64::max(begin + room, glue)),
        Some(_) if end - begin > 2.0 * room => start(f64::min(f64::max(0.0, begin + clear), end - clear)),
        // No place is between them: just before both, and past the one.
        Some(behind) => start(f64::min(begin, end) - room).with_departure(behind.hit.departure()),
    }
}

/// Whether a face that is to be crossed by light inside of these bodies lies so far back that the ray crosses its solid back, by a face
/// nearer to the start, of those near it: behind a thin plate light is as truly outside of it as before it, and stays on the side that it
/// was drawn on. `room`, mm, is what rounding makes of one place.
fn is_undone(near: &[NearFace], face: &NearFace, inside: &[u32], room: f64) -> bool {
    let crosses_back = |f: &NearFace| {
        // Inside of a body is inside of any of its solids, outside is outside of all.
        let same_solid = f.face.body == face.face.body && (f.face.solid == face.face.solid || f.entering);
        same_solid
            && f.bounds_solid()
            && f.lies_behind(inside)
            && f.entering != face.entering
            && f.t > face.t + room
    };
    near.iter().any(|f| crosses_back(f) && f.t + face.t < -room)
}

/// Whether a ray that comes in by this face, of those near its start, goes out of the same solid over an edge at once; `room`, mm, is what
/// rounding makes of one place. The faces of a thin plate look away from each other, and are no edge.
fn passes_edge(near: &[NearFace], face: &NearFace, room: f64) -> bool {
    let is_of_edge = |f: &NearFace| {
        let same_solid = f.face.body == face.face.body && f.face.solid == face.face.solid;
        let looks_away = f.hit.geometric_normal.dot(face.hit.geometric_normal) < -ALIGNED;
        same_solid && f.bounds_solid() && !f.entering && f.t + room >= face.t && !looks_away
    };
    face.entering && near.iter().any(is_of_edge)
}

/// Returns the faces within the glue distance of the start of a ray that its line meets, in order; of faces at one place in either.
fn faces_near_start(context: &Context<'_>, ray: &Ray) -> SmallVec<[NearFace; MOST_COINCIDENT_FACES]> {
    let (d, rounding) = (ray.direction, rounding_at(ray.origin));
    // As far as a ray that grazes a face has to go across the glue distance.
    let farthest = way_through_glue(context.glue_mm(), 0.0);
    let mut probe = Ray::new(ray.point_at(-farthest), d).with_range(0.0, 2.0 * farthest);
    // Place of the start of the probe on the ray.
    let mut place = -farthest;
    let mut near: SmallVec<[NearFace; MOST_COINCIDENT_FACES]> = SmallVec::new();
    // Of two faces at one place the other comes next, and then the first once more.
    for _ in 0..2 * MOST_COINCIDENT_FACES {
        let Some(hit) = context.intersector.intersect(&probe, &mut Cost::default()) else { break };
        let Some(&face) = context.bound.faces.get(hit.face.index()) else { break };
        let t = place + hit.t;
        if near.iter().any(|f| f.hit.face == hit.face && (f.t - t).abs() <= 2.0 * rounding) {
            probe.t_min = hit.t + rounding;
            continue;
        }
        near.push(NearFace { hit, face, t, entering: d.dot(hit.geometric_normal) < 0.0 });
        place = t;
        probe = Ray::new(probe.point_at(hit.t), d)
            .with_range(-rounding, probe.t_max - hit.t)
            .with_departure(hit.departure());
    }
    near.retain(|f| f.t.abs() * d.dot(f.hit.geometric_normal).abs() <= context.glue_mm() + rounding);
    near
}

//! Receivers that lie in a flat face: on which side of it light is counted that passes them, rounding decides; light that ends on them
//! does so before it meets the face.

use super::bound_scene::BoundScene;
use crate::math::polygon::{is_inside_sides, nearest_on_side, polygon_sides};
use crate::math::{Aabb, BoxTree, Point, Uv, Vector};
use crate::model::{Analytic, Model, PlacedFace};
use crate::simulate::body::AMBIENT;
use crate::simulate::receiver::{FLUSH, FlatShape, NAMED_RECEIVERS, Receiver};
use crate::text::{count_of, first_sentences};
use std::cell::OnceCell;

/// Share of a receiver's half side by which a face must reach into it: a receiver may fill an opening, whose round border is followed by
/// chords, within a third of that.
const LEAST_REACH: f64 = 1e-3;
/// Pieces into which a span of a curved border is divided: of a circle of four spans the chords are beside it by 3e-4 of the radius.
const SPAN_PIECES: usize = 32;

/// Returns sentences about receivers that lie in a flat face of the model, each naming the first such face; of those that absorb, in a face
/// that lets light out of a body. One for each of the first receivers, and one that counts the others.
pub(super) fn flush_receiver_notes(bound: &BoundScene, model: &Model) -> Vec<String> {
    let flat: Vec<(&Receiver, FlatShape<'_>)> =
        bound.receivers.iter().filter_map(|receiver| Some((receiver, receiver.flat()?))).collect();
    if flat.is_empty() {
        return Vec::new();
    }
    let boxes: Vec<Aabb> = flat.iter().map(|(receiver, flat)| receiver.bounds().grown(flat.near())).collect();
    let tree = BoxTree::new(&boxes);
    let mut flush: Vec<Option<PlacedFace<'_>>> = vec![None; flat.len()];
    let planes = model.placed_faces().filter_map(|face| Some((face, plane_of(&face)?)));
    for (face, plane) in planes {
        let border = OnceCell::new();
        tree.any_meeting(&face.bounds(), |k| {
            let (receiver, shape) = &flat[k as usize];
            let first = &mut flush[k as usize];
            let matters = || !receiver.absorbs || stops_leaving(bound, shape, &face);
            let reaches_in = || is_reached_by(border.get_or_init(|| placed_border(&face)), shape);
            if first.is_none() && is_in_plane(&plane, shape) && matters() && reaches_in() {
                *first = Some(face);
            }
            false
        });
    }
    let sentences = flat.iter().zip(&flush).filter_map(|((receiver, _), face)| {
        let face = face.as_ref()?;
        let what = face.entity().map_or_else(|| format!("face {}", face.id.0), |id| format!("face #{id}"));
        let part = &bound.instances[face.instance];
        let consequence = if receiver.absorbs {
            "light from inside ends on it before it leaves through the face, with what the face would have reflected; move it off by a \
             hundredth of a millimetre, outwards, to measure what comes out"
        } else {
            "light that crosses or leaves the face there is counted on one side of it or on neither; move it off by a thousandth of a \
             millimetre, to the side that is meant"
        };
        Some(format!("the receiver '{}' lies in {what} of '{part}': {consequence}", receiver.name))
    });
    first_sentences(sentences, NAMED_RECEIVERS, |further| {
        format!("the same holds for {}, each in a face of the model", count_of(further as u64, "more receiver"))
    })
}

/// Whether an absorbing receiver in a face ends light that would have left a body through it. On an opaque face the receiver takes what
/// would have met the face, as it is meant to.
fn stops_leaving(bound: &BoundScene, flat: &FlatShape<'_>, face: &PlacedFace<'_>) -> bool {
    let optics = &bound.faces[face.id.index()];
    let lets_light_out = optics.body != AMBIENT && !bound.surfaces[usize::from(optics.surface)].is_opaque();
    // One that counts what comes from outside alone lets the light that leaves pass unseen.
    lets_light_out && !(flat.is_one_sided && outward(face).is_some_and(|n| n.dot(flat.frame.z) > 0.0))
}

/// Returns the normal of a flat face out of its body; `None` for a ready mesh.
fn outward(face: &PlacedFace<'_>) -> Option<Vector> {
    let spline = face.face?;
    let [[u0, u1], [v0, v1]] = spline.surface.domain();
    let normal = spline.surface.limit_normal(Uv::new(0.5 * (u0 + u1), 0.5 * (v0 + v1)))?;
    Some(face.placement.normal(if spline.reversed { -normal } else { normal }))
}

/// A point of a flat face and its normal, where it is placed, mm.
struct FacePlane {
    origin: Point,
    normal: Vector,
}

/// Returns the plane of a face; `None` for one that is not flat.
fn plane_of(face: &PlacedFace<'_>) -> Option<FacePlane> {
    let Some(Analytic::Plane { frame }) = face.face.map(|f| &f.analytic) else { return None };
    Some(FacePlane { origin: face.placement.point(frame.origin), normal: face.placement.direction(frame.z) })
}

/// Whether a plane is that of a receiver.
fn is_in_plane(plane: &FacePlane, receiver: &FlatShape<'_>) -> bool {
    let height = receiver.frame.local_point(plane.origin).z;
    height.abs() <= receiver.near() && receiver.frame.z.cross(plane.normal).length() <= FLUSH
}

/// Returns the loops that bound a face as polygons, where it is placed, mm; none for a ready mesh.
fn placed_border(face: &PlacedFace<'_>) -> Vec<Vec<Point>> {
    let Some(spline) = face.face else { return Vec::new() };
    let loops = spline.bounding_loops();
    let whole = loops.is_empty().then(|| spline.domain_border());
    let place = |uv: Uv| face.placement.point(spline.surface.evaluate(uv));
    let polygons =
        loops.iter().chain(&whole).map(|l| l.polygon(|s| if s.curve.degree == 1 { 1 } else { SPAN_PIECES }));
    polygons.map(|polygon| polygon.into_iter().map(place).collect()).collect()
}

/// Whether some of a face in the plane of a receiver lies within it: not where the receiver stands in an opening of the face, beside it, or
/// touches its border alone. `border` is the face's, as polygons.
fn is_reached_by(border: &[Vec<Point>], receiver: &FlatShape<'_>) -> bool {
    let FlatShape { frame, half, is_round, .. } = *receiver;
    // In half sides, so that the receiver is the square from −1 to 1 or the circle within it.
    let local = |p: &Point| {
        let p = frame.local_point(*p);
        Uv::new(p.x / half[0], p.y / half[1])
    };
    let polygons: Vec<Vec<Uv>> = border.iter().map(|polygon| polygon.iter().map(local).collect()).collect();
    let mut sides = polygons.iter().flat_map(|polygon| polygon_sides(polygon));
    // Where no border passes, all of the receiver is in the face or beside it, as its middle is.
    is_inside_sides(sides.clone(), Uv::ZERO)
        || sides.any(|side| if is_round { enters_disc(side) } else { enters_square(side) })
}

/// Whether a side reaches into the circle of radius 1 about 0.
fn enters_disc(side: [Uv; 2]) -> bool {
    nearest_on_side(side, Uv::ZERO).length() < 1.0 - LEAST_REACH
}

/// Whether a side reaches into the square from −1 to 1.
fn enters_square([a, b]: [Uv; 2]) -> bool {
    const HALF: f64 = 1.0 - LEAST_REACH;
    let along = b - a;
    let (mut first, mut last) = (0.0f64, 1.0f64);
    for d in 0..2 {
        if along[d] == 0.0 {
            if a[d].abs() >= HALF {
                return false;
            }
            continue;
        }
        let (low, high) = ((-HALF - a[d]) / along[d], (HALF - a[d]) / along[d]);
        first = first.max(low.min(high));
        last = last.min(low.max(high));
    }
    first < last
}

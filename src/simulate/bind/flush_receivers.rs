//! Receivers that lie in a flat face: on which side of it light is counted that passes them, rounding decides; light that ends on them
//! does so before it meets the face.

use super::bound_scene::BoundScene;
use crate::math::{Aabb, Uv, Vector};
use crate::model::{Analytic, Model, PlacedFace};
use crate::simulate::body::AMBIENT;
use crate::simulate::receiver::{FLUSH, FlatShape};

/// Returns a sentence for each receiver that lies in a flat face of the model, naming the first such face; of one that absorbs, in a face
/// that lets light out of a body.
pub(super) fn flush_receiver_notes(bound: &BoundScene, model: &Model) -> Vec<String> {
    // On an opaque face the receiver takes what would have met the face, as it is meant to.
    let lets_light_out = |face: &PlacedFace<'_>| {
        let optics = &bound.faces[face.id.index()];
        optics.body != AMBIENT && !bound.surfaces[usize::from(optics.surface)].is_opaque()
    };
    let notes = bound.receivers.iter().filter_map(|receiver| {
        let flat = receiver.flat()?;
        // One that counts what comes from outside alone lets the light that leaves pass unseen.
        let stops_leaving = |face: &PlacedFace<'_>| {
            lets_light_out(face) && !(flat.is_one_sided && outward(face).is_some_and(|n| n.dot(flat.frame.z) > 0.0))
        };
        let mut faces = model.placed_faces().filter(|face| is_flush(face, &flat));
        let face = faces.find(|face| !receiver.absorbs || stops_leaving(face))?;
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
    notes.collect()
}

/// Returns the normal of a flat face out of its body; `None` for a ready mesh.
fn outward(face: &PlacedFace<'_>) -> Option<Vector> {
    let spline = face.face?;
    let [[u0, u1], [v0, v1]] = spline.surface.domain();
    let normal = spline.surface.limit_normal(Uv::new(0.5 * (u0 + u1), 0.5 * (v0 + v1)))?;
    Some(face.placement.normal(if spline.reversed { -normal } else { normal }))
}

/// Whether a flat face lies in the plane of a receiver and meets its rectangle.
fn is_flush(face: &PlacedFace<'_>, receiver: &FlatShape<'_>) -> bool {
    let Some(Analytic::Plane { frame: plane }) = face.face.map(|f| &f.analytic) else { return false };
    let (near, frame) = (receiver.near(), receiver.frame);
    let normal = face.placement.direction(plane.z);
    let height = frame.local_point(face.placement.point(plane.origin)).z;
    if height.abs() > near || frame.z.cross(normal).length() > FLUSH {
        return false;
    }
    !Aabb::from_points(receiver.corners()).grown(near).intersection(face.bounds()).is_empty()
}

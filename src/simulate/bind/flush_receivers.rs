//! Receivers that lie in a flat face: on which side of it light is counted there, rounding decides.

use super::nearest::face_bounds;
use crate::math::{Aabb, Frame};
use crate::model::{Analytic, Model, PlacedFace};
use crate::simulate::receiver::{Receiver, Shape};

/// Distance, as a share of the receiver's half side, below which a face is in its plane.
const FLUSH: f64 = 1e-9;

/// Returns a sentence for each receiver that lets light pass and lies in a flat face of the model, naming the first such face. `labels` are
/// what to call the instances.
pub(super) fn flush_receiver_notes(receivers: &[Receiver], model: &Model, labels: &[String]) -> Vec<String> {
    let notes = receivers.iter().filter(|r| !r.absorbs).filter_map(|receiver| {
        let (frame, half) = match &receiver.shape {
            Shape::Plane { frame, half, .. } => (frame, *half),
            Shape::Disc { frame, radius, .. } => (frame, [*radius; 2]),
            _ => return None,
        };
        let face = model.placed_faces().find(|face| is_flush(face, frame, half))?;
        let what = face.entity().map_or_else(|| format!("face {}", face.id.0), |id| format!("face #{id}"));
        let part = &labels[face.instance];
        Some(format!(
            "the receiver '{}' lies in {what} of '{part}': light that crosses or leaves the face there is counted on one side of it or on \
             neither; move it off by a thousandth of a millimetre, to the side that is meant",
            receiver.name
        ))
    });
    notes.collect()
}

/// Whether a flat face lies in the plane of a receiver of this frame and these half sides, mm, and meets its rectangle.
fn is_flush(face: &PlacedFace<'_>, frame: &Frame, half: [f64; 2]) -> bool {
    let Some(Analytic::Plane { frame: plane }) = face.face.map(|f| &f.analytic) else { return false };
    let near = FLUSH * half[0].max(half[1]);
    let normal = face.placement.direction(plane.z);
    let height = frame.local_point(face.placement.point(plane.origin)).z;
    if height.abs() > near || frame.z.cross(normal).length() > FLUSH {
        return false;
    }
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
    let rectangle = corners.map(|[a, b]| frame.origin + frame.x * (a * half[0]) + frame.y * (b * half[1]));
    !Aabb::from_points(rectangle).grown(near).intersection(face_bounds(face)).is_empty()
}

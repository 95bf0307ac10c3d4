//! Which side of a shared edge a ray passes: one computation that both faces of the edge ask, so that a ray which crosses
//! a closed shell at an edge finds exactly one of them.
//!
//! The edge's curve is seen along the ray, as a plane curve about the ray at the origin. Newton's method runs to its nearest
//! point from one of [`SEEDS`] fixed parameters, so that both faces compute the same bits.

use super::geometry::{FaceRecord, Geometry};
use super::query::Query;
use crate::math::{Point, Vector};
use crate::nurbs::Curve;

/// Fixed parameters from which the nearest point is sought.
const SEEDS: f64 = 64.0;

/// Whether the ray passes to the left of the edge, seen along the ray; `None` when the ray runs along the edge.
fn left_of(curve: &Curve, near: f64, [o, n1, n2]: [Vector; 3]) -> Option<bool> {
    let [t0, t1] = curve.domain();
    let relative = ((near - t0) / (t1 - t0) * SEEDS).round().clamp(0.0, SEEDS);
    let mut t = t0 + (t1 - t0) * relative / SEEDS;
    let mut side = None;
    for step in 0..24 {
        let c = curve.derivatives(t);
        let (x, d) = (c.point - o, c.first);
        let (x, d) = ((n1.dot(x), n2.dot(x)), (n1.dot(d), n2.dot(d)));
        let length = d.0 * d.0 + d.1 * d.1;
        if !(length > 1e-20 * c.first.length_squared()) {
            return None;
        }
        side = Some(d.1 * x.0 - d.0 * x.1 > 0.0);
        let next = (t - (x.0 * d.0 + x.1 * d.1) / length).clamp(t0, t1);
        // Past quadratic convergence the iterate alternates in its last bits: an even number of steps fixes which.
        if (next - t).abs() <= 1e-15 * (t1 - t0) || step >= 20 {
            break;
        }
        t = next;
    }
    side
}

impl Geometry {
    /// Whether a root of a face near one of its trims counts, by the side of the shared edge; `None` where no edge can tell.
    ///
    /// `facing` is the sign of `(Su × Sv) · d` at the root, `piece` and `t` the nearest trimming piece and the parameter on it.
    pub(super) fn side_of_edge(
        &self,
        face: &FaceRecord,
        q: &Query,
        facing: f64,
        (piece, t): (u32, f64),
    ) -> Option<bool> {
        let piece = &self.trims[face.trim as usize].pieces[piece as usize];
        let curve = self.edges.get(face.part as usize)?.get(piece.edge?.0 as usize)?;
        let parameter = piece.range[0] + (piece.range[1] - piece.range[0]) * t;
        let place = &face.placement;
        // Mirrored placements turn sides around; `facing` is measured in the world as well, so the frame stays the world's.
        let o: Point = place.local_point(q.o);
        let frame = [o, place.local_direction(q.n1), place.local_direction(q.n2)];
        let left = left_of(curve, parameter, frame)?;
        Some(left ^ piece.reversed ^ (facing < 0.0))
    }
}

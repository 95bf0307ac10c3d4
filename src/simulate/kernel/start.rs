//! The first segment of a ray that leaves a face.

use super::context::Context;
use crate::intersect::{Cost, Hit};
use crate::math::{FaceId, Point, Ray, Vector, orthonormal_pair};
use crate::optics::reflect;
use crate::simulate::outcome::Counts;
use std::f64::consts::TAU;

/// Distances from the spline within which its face is looked for on the intersector, mm: five times the loosest facets of the default,
/// nearer where another face is in between. Coarser facets that a user asks for may lie farther off, which is counted.
const REACHES: [f64; 4] = [1.0, 0.1, 0.01, 1e-3];

/// How far beside a point of the spline its face is looked for, mm: facets of a face with a round border end at chords within it.
const ASIDE: [f64; 3] = [0.02, 0.1, 0.5];
/// Directions in which it is looked for beside.
const WAYS: usize = 8;

/// Moves the start of a ray from the spline of a face to where the intersector has that face, and marks it as leaving it. `normal` is the
/// spline's, outward.
///
/// Facets lie up to their sag off the spline, and as far within a round border: a ray that started there could hit its own facet, or its
/// solid from inside. A ray whose face is not found within 1 mm, nor beside that within half of it, starts on the spline. One that would
/// go below the facet is turned to above it. Both are counted.
#[inline(never)]
pub(super) fn start_on_face(
    context: &Context<'_>,
    face: FaceId,
    normal: Vector,
    ray: &mut Ray,
    counts: &mut Counts,
) {
    let found = face_behind(context, face, normal, ray.origin).or_else(|| {
        let (x, y) = orthonormal_pair(normal);
        // The nearest first, so that no start is moved farther than it must.
        ASIDE.iter().flat_map(|r| (0..WAYS).map(move |k| (r, k))).find_map(|(r, k)| {
            let (sin, cos) = (k as f64 * TAU / WAYS as f64).sin_cos();
            face_behind(context, face, normal, ray.origin + (x * cos + y * sin) * *r)
        })
    });
    let Some((point, hit)) = found else {
        counts.misplaced_starts += 1;
        return;
    };
    // Drawn about the spline's normal, a grazing ray may point below the tilted facet that it starts from.
    let below = ray.direction.dot(hit.geometric_normal) <= 0.0;
    let direction = if below { reflect(ray.direction, hit.geometric_normal) } else { ray.direction };
    *ray = Ray::new(point, direction).with_departure(hit.departure());
    counts.corrected_normals += u64::from(below);
}

/// Finds where the intersector has a face before or behind a point, along `normal` and within the longest of [`REACHES`].
fn face_behind(context: &Context<'_>, face: FaceId, normal: Vector, point: Point) -> Option<(Point, Hit)> {
    // From the longest: a mesh of coarse facets has its face that far from the spline.
    REACHES.into_iter().find_map(|reach| {
        let probe = Ray::new(point + normal * reach, -normal).with_range(0.0, 2.0 * reach);
        // Where another face is met within a long probe, a shorter one does not reach that far.
        let mut hit = context.intersector.intersect(&probe, &mut Cost::default())?;
        let mut point = probe.point_at(hit.t);
        if hit.face != face {
            // A face of a body that lies on it may come first; the own face then lies behind it, within the glue.
            let behind =
                Ray::new(point, -normal).with_range(0.0, context.glue_mm()).with_departure(hit.departure());
            let next = context.intersector.intersect(&behind, &mut Cost::default())?;
            (point, hit) = (behind.point_at(next.t), next);
        }
        (hit.face == face).then_some((point, hit))
    })
}

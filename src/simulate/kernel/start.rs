//! The first segment of a ray that leaves a face.

use super::context::Context;
use crate::intersect::Cost;
use crate::math::{FaceId, Ray, Vector};
use crate::optics::reflect;
use crate::simulate::outcome::Counts;

/// Distances from the spline within which its face is looked for on the intersector, mm: five times the loosest facets of the default,
/// nearer where another face is in between. Coarser facets that a user asks for may lie farther off, which is counted.
const REACHES: [f64; 4] = [1.0, 0.1, 0.01, 1e-3];

/// Moves the start of a ray from the spline of a face to where the intersector has that face, and marks it as leaving it. `normal` is the
/// spline's, outward.
///
/// Facets lie up to their sag off the spline: a ray that started there could hit its own facet. A ray whose face is not found within 1 mm
/// starts on the spline. One that would go below the facet is turned to above it. Both are counted.
#[inline(never)]
pub(super) fn start_on_face(
    context: &Context<'_>,
    face: FaceId,
    normal: Vector,
    ray: &mut Ray,
    counts: &mut Counts,
) {
    // From the longest: a mesh of coarse facets has its face that far from the spline.
    for reach in REACHES {
        let probe = Ray::new(ray.origin + normal * reach, -normal).with_range(0.0, 2.0 * reach);
        // Where another face is met within a long probe, a shorter one does not reach that far.
        let Some(mut hit) = context.intersector.intersect(&probe, &mut Cost::default()) else { continue };
        let mut point = probe.point_at(hit.t);
        if hit.face != face {
            // A face of a body that lies on it may come first; the own face then lies behind it, within the glue.
            let behind =
                Ray::new(point, -normal).with_range(0.0, context.glue_mm()).with_departure(hit.departure());
            let Some(next) = context.intersector.intersect(&behind, &mut Cost::default()) else { continue };
            (point, hit) = (behind.point_at(next.t), next);
        }
        if hit.face == face {
            // Drawn about the spline's normal, a grazing ray may point below the tilted facet that it starts from.
            let below = ray.direction.dot(hit.geometric_normal) <= 0.0;
            let direction = if below { reflect(ray.direction, hit.geometric_normal) } else { ray.direction };
            *ray = Ray::new(point, direction).with_departure(hit.departure());
            counts.corrected_normals += u64::from(below);
            return;
        }
    }
    counts.misplaced_starts += 1;
}

//! Sources around which no facet lies so near that a ray must look for it behind its start.
//!
//! A facet behind the start of a ray may stand for a piece of spline ahead of it, so that polishing looks back by two sags. Where nothing
//! is there it need not: the facets then get the very rays of the source, which their light buffers know.

use crate::intersect::{Beam, ExpectedRays};
use crate::math::{Aabb, Point, Ray, Vector};
use crate::mesh::FacetMesh;

/// By how much starts of a collimated source may stray from its plane, relative to its place and the mesh: a million roundings.
const PLANE_ROOM: f64 = 1e-9;

/// Rays that need not look back.
#[derive(Clone, Copy, Debug)]
pub(super) enum ClearStart {
    /// They start at a point.
    Point(Point),
    /// They run in a unit direction and start where the product of place and direction is `depth`, give or take `stray`, mm.
    Plane { direction: Vector, depth: f64, stray: f64 },
}

impl ClearStart {
    /// The starts of expected beams that are known to have no facet near: of a point none within `reach` mm on any side, of a collimated
    /// beam none across its whole plane or within `reach` mm behind it. A beam that is left out may be clear too.
    pub(super) fn of_expected(expected: &ExpectedRays<'_>, mesh: &FacetMesh, reach: f64) -> Vec<Self> {
        expected.beams.iter().filter_map(|(beam, _)| Self::of_beam(beam, mesh, reach)).collect()
    }

    /// The start of a beam's rays; `None` where a facet may lie within `reach` mm of its point, or behind its plane.
    fn of_beam(beam: &Beam, mesh: &FacetMesh, reach: f64) -> Option<Self> {
        let start = match beam {
            Beam::Point(origin) => Self::Point(*origin),
            Beam::Collimated { origin, direction } => {
                let depth = origin.dot(*direction);
                let stray = PLANE_ROOM * (depth.abs() + mesh.bounds().diagonal());
                Self::Plane { direction: *direction, depth, stray }
            }
        };
        (0..mesh.facets.len()).all(|f| start.is_clear_of(mesh.corners(f), reach)).then_some(start)
    }

    /// Whether it is known that no ray, taken back by `reach` mm behind its start, meets the facet of these corners there.
    fn is_clear_of(&self, corners: [Point; 4], reach: f64) -> bool {
        match self {
            // To the facet's box, which is no farther than the facet: an error here costs a look back, never a hit.
            Self::Point(origin) => {
                let bounds = Aabb::from_points(corners);
                (origin.clamp(bounds.min, bounds.max) - *origin).length() > reach
            }
            Self::Plane { direction, depth, stray } => {
                // Wholly ahead of the plane, or farther behind it than any ray looks back.
                let along = corners.map(|p| p.dot(*direction) - depth);
                along.iter().all(|&x| x > *stray) || along.iter().all(|&x| x < -(reach + stray))
            }
        }
    }

    /// Whether a ray is of this source, by origin or by direction and plane; its departure is not looked at.
    #[inline(always)]
    pub(super) fn holds(&self, ray: &Ray) -> bool {
        match self {
            Self::Point(origin) => ray.origin == *origin,
            Self::Plane { direction, depth, stray } => {
                ray.direction == *direction && (ray.origin.dot(*direction) - depth).abs() <= *stray
            }
        }
    }
}

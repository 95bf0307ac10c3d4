//! How a source sees places: from a point, or along a direction.

use crate::intersect::Beam;
use crate::intersect::octree::tree::Tree;
use crate::math::{Ray, Vector, orthonormal_pair};
use std::cmp::{Ordering, Reverse};

/// By how much the grid of a collimated source is wider than the mesh, relative to it: sixteen roundings of f32, far above those of f64.
const SPAN_ROOM: f64 = 1e-6;
/// Distance of the mesh from the origin, in half widths of the grid, above which none is drawn: a place is then wrong by up to
/// 2⁻⁵³·10⁶ ≈ 1e-10 of the grid, a hundredth of the room around its squares.
const FARTHEST_MIDDLE: f64 = 1e6;
/// By how much starts may stray from the plane of a collimated source, relative to its place and the mesh: a million roundings, so that
/// starts which were computed in any way are taken.
pub(super) const PLANE_ROOM: f64 = 1e-9;

/// How places are seen from a source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum View {
    /// From a point, on the sides of a cube around it.
    Point([f64; 3]),
    /// Along a direction, in units of half the side of a square around all facets, from a plane at the depth `start`, which rays
    /// may miss by `stray`.
    Along { direction: Vector, across: [Vector; 2], middle: [f64; 2], start: f64, stray: f64 },
}

impl View {
    /// The view of a beam; `None` where it is not finite, a direction is not of unit length, the mesh has no extent across it, or lies so
    /// far off that rounding would not be small against a square.
    fn from_beam(beam: &Beam, tree: &Tree) -> Option<Self> {
        match beam {
            Beam::Point(origin) => origin.is_finite().then(|| Self::Point(origin.to_array())),
            Beam::Collimated { origin, direction } => {
                let (x, y) = orthonormal_pair(*direction);
                let span = |axis: Vector| {
                    // The grid must hold the shadow of the whole mesh, which lies between those of its box's
                    // corners.
                    let along = tree.surroundings.bounds.corners().map(|p| p.dot(axis));
                    let (low, high) =
                        along.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(*a), h.max(*a)));
                    (0.5 * (low + high), 0.5 * (high - low) * (1.0 + SPAN_ROOM))
                };
                // A little wider, so that a place on the border is not rounded out of the grid.
                let ((a, width), (b, height)) = (span(x), span(y));
                let half = width.max(height);
                // Rounding must stay small against a square.
                let fits = half > 0.0 && (a.abs() + b.abs()) < FARTHEST_MIDDLE * half && direction.is_normalized();
                let start = origin.dot(*direction);
                let stray = PLANE_ROOM * (start.abs() + half);
                let (across, middle) = ([x / half, y / half], [a / half, b / half]);
                (fits && origin.is_finite()).then_some(Self::Along {
                    direction: *direction,
                    across,
                    middle,
                    start,
                    stray,
                })
            }
        }
    }

    /// Whether it shows the rays of `other` too, whose starts may lie in their plane to within rounding.
    fn serves(&self, other: &Self) -> bool {
        match (self, other) {
            // The half of its room that is not for the starts of one source is for the planes of others.
            (
                Self::Along { direction, start, stray, .. },
                Self::Along { direction: other_direction, start: other_start, .. },
            ) => direction == other_direction && (start - other_start).abs() <= 0.5 * stray,
            _ => self == other,
        }
    }

    /// By point or direction, and then by depth: views that share a buffer follow one another.
    fn order(&self, other: &Self) -> Ordering {
        let key = |view: &Self| match view {
            Self::Point(origin) => (0, origin.map(f64::to_bits), 0.0),
            Self::Along { direction, start, .. } => (1, direction.to_array().map(f64::to_bits), *start),
        };
        let ((a, a_bits, a_start), (b, b_bits, b_start)) = (key(self), key(other));
        (a, a_bits).cmp(&(b, b_bits)).then(a_start.total_cmp(&b_start))
    }

    /// Number of grids: the six sides of a cube, or one.
    pub(super) fn sides(&self) -> usize {
        if matches!(self, Self::Point(_)) { 6 } else { 1 }
    }

    /// Whether a ray that starts on no face is one of those that the buffer shows, by origin or by direction and plane.
    #[inline(always)]
    pub(super) fn shows(&self, ray: &Ray) -> bool {
        match self {
            Self::Point(origin) => ray.origin.to_array() == *origin,
            Self::Along { direction, start, stray, .. } => {
                ray.direction == *direction && (ray.origin.dot(*direction) - start).abs() <= *stray
            }
        }
    }
}

/// Returns the views of the beams, each with the number of its rays: one for all beams that share a point, or a direction and a plane. The
/// one with most rays comes first.
pub(super) fn shared_views(tree: &Tree, beams: &[(Beam, u64)]) -> Vec<(View, u64)> {
    let view = |(beam, rays): &(Beam, u64)| Some((View::from_beam(beam, tree)?, *rays));
    let mut views: Vec<_> = beams.iter().filter_map(view).collect();
    views.sort_by(|(a, _), (b, _)| a.order(b));
    views.dedup_by(|(next, rays), (first, all)| {
        let shared = first.serves(next);
        if shared {
            *all = all.saturating_add(*rays);
        }
        shared
    });
    views.sort_by_key(|(_, rays)| Reverse(*rays));
    views
}

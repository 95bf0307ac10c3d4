//! Lengths and cosines within which the kernel takes two places, or two directions, for one.

use crate::math::{Point, Ray};

/// Rounding of a place near the origin, mm: far more than its last digit, far less than any facet.
const ROUNDING_MM: f64 = 1e-9;

/// Rounding of a place, as a share of its largest coordinate: 10^4 last digits of an `f64`, what is lost on the way through a few
/// placements and a division by a cosine.
const ROUNDING_SHARE: f64 = 1e-12;

/// Largest distance to the end of a segment that rounding is reckoned from, mm: a segment that leaves the scene has none.
pub(super) const LONGEST_SEGMENT: f64 = 1e12;

/// Returns how far from its true place, mm, a point at this distance from the origin, mm, may be by rounding.
#[inline(always)]
pub(super) fn rounding(distance: f64) -> f64 {
    ROUNDING_MM + ROUNDING_SHARE * distance
}

/// Returns how far from its true place, mm, a point may be by rounding.
#[inline(always)]
pub(super) fn rounding_at(point: Point) -> f64 {
    rounding(point.abs().max_element())
}

/// Returns how far in front of a face, mm, a receiver that lies in it is taken to be, at distance `t`, mm, of a ray: the rounding of a
/// place there.
#[inline(always)]
pub(in crate::simulate) fn in_front(ray: &Ray, t: f64) -> f64 {
    rounding(t + ray.origin.abs().max_element())
}

/// Returns the way of a ray through a layer of the glue distance, mm, for the cosine between ray and normal. Below a cosine of 1e-3 (0.06°
/// off the face) it grows no further: a ray that grazes a face more than that would reach a millimetre for the default of 1 µm.
#[inline(always)]
pub(super) fn way_through_glue(glue_mm: f64, cosine: f64) -> f64 {
    glue_mm / cosine.abs().max(LEAST_COSINE)
}

/// Cosine below which the way through a layer grows no further, see [`way_through_glue`].
const LEAST_COSINE: f64 = 1e-3;

/// Faces at one place among which the next one is looked for: touching faces come in pairs, three pairs at an edge of three bodies.
pub(super) const MOST_COINCIDENT_FACES: usize = 6;

/// Cosine above which two normals at one place look the same way, and below whose negative they look at each other: 60°, between
/// faces that lie on each other (0°, facets some degrees) and those that meet at an edge (90°).
pub(super) const ALIGNED: f64 = 0.5;

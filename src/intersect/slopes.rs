//! Which rays that leave a facet are known not to meet it again: all but those that graze one of its two triangles.
//!
//! One in three exact tests of a ray that refracts or reflects was of the facet that it had just left.

use crate::math::{Point, Vector};
use bytemuck::{AnyBitPattern, NoUninit};

/// The least sine of the angle between a ray and the planes of both triangles of its own facet over which nothing of the facet is
/// ahead of it, whichever triangle it leaves and whether they fold to it or away.
pub(crate) const LEAST_SINE: f64 = 1e-3;
/// Added to that sine for what `f32` rounds in axis and direction: ten thousand times as much.
const ROOM_OF_F32: f64 = 1e-3;
/// Facets folded by more than 120° have no slope over which both triangles are left, nor has one without area.
const LEAST_COSINE: f64 = 0.5;

/// The slope above which a ray that leaves a facet is known not to meet it again, on either side.
#[derive(Clone, Copy, Debug, NoUninit, AnyBitPattern)]
#[repr(C)]
pub(crate) struct Slopes {
    /// Mean unit normal of both triangles, and the sine over the plane across it that is enough: infinite where none is.
    axis: [f32; 3],
    sine: f32,
}

impl Slopes {
    /// Takes the corners of a facet, the last two equal for a triangle. Of one without area, or folded by more than 120°, [`Self::leaves`]
    /// says nothing.
    pub(crate) fn new([a, b, c, d]: [Point; 4]) -> Self {
        let first = (b - a).cross(c - a).normalize_or_zero();
        let second = if c == d { first } else { (c - a).cross(d - a).normalize_or_zero() };
        let axis = (first + second).normalize_or_zero();
        // Half the fold and the angle over the plane, with room for f32.
        let cosine = axis.dot(first).min(axis.dot(second));
        let sine = (axis.cross(first).length() + LEAST_SINE + ROOM_OF_F32) / cosine;
        let sine = if cosine > LEAST_COSINE { sine as f32 } else { f32::INFINITY };
        Self { axis: axis.as_vec3().to_array(), sine }
    }

    /// Whether a ray of this unit direction that leaves the facet is known not to meet it again; `false` says nothing.
    #[inline(always)]
    pub(crate) fn leaves(&self, direction: Vector) -> bool {
        let ([x, y, z], d) = (self.axis, direction.as_vec3());
        (x * d.x + y * d.y + z * d.z).abs() > self.sine
    }
}

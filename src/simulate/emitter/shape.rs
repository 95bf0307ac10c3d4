//! Where on a source its rays start and which way they go: the formulas that one ray and a packet of rays share.

use super::area::Area;
use super::ray_list::RayList;
use crate::math::Vector;
use crate::optics::IntensitySampler;

/// Where the rays of a source start.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    Point,
    Faces(Area),
    /// Origins and directions of measured rays.
    List(RayList),
    /// Radius, mm.
    Disc(f64),
    /// Half sides, mm.
    Rectangle([f64; 2]),
}

/// Which way the rays of a source go.
#[derive(Clone, Debug)]
pub(super) enum Lobe {
    Measured(IntensitySampler),
    /// Uniform within a cone: `1 − cos` of its half angle, which keeps the digits that the cosine of a narrow cone has lost; 2 for all
    /// directions.
    Cone(f64),
    Collimated,
    /// Intensity ∝ cosⁿ; `1/(n+1)` is kept.
    Cosine(f64),
}

/// `1/(n+1)` of Lambert's cosine, n = 1: its power is a square root.
pub(super) const LAMBERTIAN: f64 = 0.5;

impl Shape {
    /// Whether a place is drawn for each ray; a list of rays draws no place of its own.
    pub(super) fn is_extended(&self) -> bool {
        matches!(self, Self::Disc(_) | Self::Rectangle(_) | Self::Faces(_))
    }

    /// Returns it with a rectangle's first side along the second axis of the source's frame; others as they are.
    pub(super) fn with_sides_swapped(self) -> Self {
        match self {
            Self::Rectangle([a, b]) => Self::Rectangle([b, a]),
            other => other,
        }
    }
}

/// Returns the distance from the middle of a disc for a uniform number `u`; equal areas are equally likely.
#[inline(always)]
pub(super) fn radius_on_disc(radius: f64, u: f64) -> f64 {
    radius * u.sqrt()
}

/// Returns a point of a rectangle, from its middle, for uniform numbers `u` and `v`; `a` and `b` are half its sides.
#[inline(always)]
pub(super) fn point_on_rectangle([a, b]: [f64; 2], [u, v]: [f64; 2]) -> [f64; 2] {
    [a * (2.0 * u - 1.0), b * (2.0 * v - 1.0)]
}

/// Returns `1 − cos` of an angle, rad, without the loss of digits of a small one.
pub(super) fn versine(angle: f64) -> f64 {
    2.0 * (0.5 * angle).sin().powi(2)
}

/// Returns `1 − cos` of an angle to the axis for a uniform number `u`; `rim` is that of the half angle. Equal solid angles are equally
/// likely.
#[inline(always)]
pub(super) fn versine_in_cone(rim: f64, u: f64) -> f64 {
    u * rim
}

/// Returns the cosine of an angle to the axis for a uniform number `u` in `[0, 1)`, by Lambert's law (Malley's method: the root of a
/// uniform number).
#[inline(always)]
pub(super) fn lambertian_cosine(u: f64) -> f64 {
    // From (0, 1], as a cosine of zero would be grazing light.
    (1.0 - u).sqrt()
}

/// Returns the cosine of an angle to the axis for a uniform number `u` in `[0, 1)`, intensity ∝ cosⁿ; `exponent` is `1/(n+1)`.
#[inline(always)]
pub(super) fn cosine_of_power(exponent: f64, u: f64) -> f64 {
    if exponent == LAMBERTIAN { lambertian_cosine(u) } else { (1.0 - u).powf(exponent) }
}

/// Returns the sine of an angle from 0 to π by its `1 − cos`.
#[inline(always)]
pub(super) fn sine_from_versine(versine: f64) -> f64 {
    (versine * (2.0 - versine)).max(0.0).sqrt()
}

/// Returns the sine of an angle from 0 to π by its cosine.
#[inline(always)]
pub(super) fn sine_from_cosine(cosine: f64) -> f64 {
    ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt()
}

/// Returns the direction at an angle to the last of three axes, given by its cosine and sine, and at an azimuth, given by its sine and
/// cosine, from the first towards the second.
#[inline(always)]
pub(super) fn direction_about_axis(
    axes: [Vector; 3],
    [cos_theta, sin_theta]: [f64; 2],
    (sin_phi, cos_phi): (f64, f64),
) -> Vector {
    axes[0] * (sin_theta * cos_phi) + axes[1] * (sin_theta * sin_phi) + axes[2] * cos_theta
}

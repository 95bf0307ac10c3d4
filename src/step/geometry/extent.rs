//! Where a face is: this decides how much of an unbounded curve, and which side of an axis, its surface needs.

use crate::math::{Aabb, Point};

/// A ball around a face and some of its points, for surfaces whose curves have no ends or cross their axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceExtent<'r> {
    /// Middle of the box around its edges, mm.
    pub(crate) center: Point,
    /// Distance from there that holds them all, mm.
    pub(crate) radius: f64,
    /// Some points of its edges; empty where nothing is known.
    pub(crate) points: &'r [Point],
    /// The ranges of u and v, in the file's own parameters, that are wanted of a surface without edges, ascending.
    pub(crate) parameters: Option<[[f64; 2]; 2]>,
}

impl<'r> FaceExtent<'r> {
    /// Nothing is known of the face.
    pub(crate) const UNKNOWN: Self = Self { center: Point::ZERO, radius: 0.0, points: &[], parameters: None };

    /// Makes the ball around the box of a face's edges; [`Self::UNKNOWN`] for an empty box.
    pub(crate) fn from_bounds(bounds: Aabb, points: &'r [Point]) -> Self {
        if bounds.is_empty() {
            return Self::UNKNOWN;
        }
        Self { center: bounds.center(), radius: 0.5 * bounds.diagonal(), points, parameters: None }
    }

    /// Returns the same, and where it has neither edges nor ranges of parameters, with these, which may be in either order; numbers that
    /// are none leave it as it is.
    pub(crate) fn over_parameters(self, ranges: [[Option<f64>; 2]; 2]) -> Self {
        if !self.points.is_empty() || self.parameters.is_some() {
            return self;
        }
        let [[Some(u0), Some(u1)], [Some(v0), Some(v1)]] = ranges else { return self };
        Self { parameters: Some([[u0.min(u1), u0.max(u1)], [v0.min(v1), v0.max(v1)]]), ..self }
    }

    /// Returns the same with a radius larger by `by`, mm.
    pub(crate) fn grown_by(self, by: f64) -> Self {
        Self { radius: self.radius + by, ..self }
    }
}

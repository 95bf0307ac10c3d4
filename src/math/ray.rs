//! Rays, and the surface point that a ray leaves.

use super::{FaceId, Point, Uv, Vector};

/// A half-line or segment `origin + t·direction`, `t` in `[t_min, t_max]`.
///
/// ```
/// use lampyris::math::{Point, Ray};
/// let ray = Ray::from_points(Point::ZERO, Point::new(3.0, 4.0, 0.0)).unwrap();
/// assert!((ray.point_at(10.0) - Point::new(6.0, 8.0, 0.0)).length() < 1e-14);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where `t = 0`.
    pub origin: Point,
    /// Unit length, so that `t` is a distance in mm.
    pub direction: Vector,
    /// Smallest accepted `t`, mm; honoured exactly.
    pub t_min: f64,
    /// Largest accepted `t`, mm; may be infinite.
    pub t_max: f64,
    /// The surface point the ray starts on, if it starts on one. An intersector excludes that very point by
    /// identity and geometry, never by a global epsilon.
    pub departure: Option<Departure>,
}

/// A point on a surface that a ray leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Departure {
    /// The placed face.
    pub face: FaceId,
    /// The intersector's own primitive: `Hit::primitive` of the hit that the ray leaves.
    pub primitive: u32,
    /// Surface parameters of the point on its face.
    pub uv: Uv,
    /// The triangle of its facet, where that is known: on the diagonal of a folded quad rounding does not decide.
    pub triangle: Option<QuadHalf>,
}

/// Which triangle of a facet: a quad is traced as two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum QuadHalf {
    /// Of the corners 0, 1, 2.
    First,
    /// Of the corners 0, 2, 3.
    Second,
}

impl Ray {
    /// A ray that leaves no surface, with `t` in `[0, ∞)`. `direction` must be of unit length; it is not normalised.
    pub fn new(origin: Point, direction: Vector) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f64::INFINITY, departure: None }
    }

    /// A ray from `origin` through `target`, with `t` in `[0, ∞)`, so that it goes on behind `target`; `None` when they coincide.
    pub fn from_points(origin: Point, target: Point) -> Option<Self> {
        (target - origin).try_normalize().map(|direction| Self::new(origin, direction))
    }

    /// The same ray, leaving a known surface point.
    pub fn with_departure(self, departure: Departure) -> Self {
        Self { departure: Some(departure), ..self }
    }

    /// The same ray with another range of `t`.
    pub fn with_range(self, t_min: f64, t_max: f64) -> Self {
        Self { t_min, t_max, ..self }
    }

    /// The point at distance `t`.
    pub fn point_at(&self, t: f64) -> Point {
        self.origin + self.direction * t
    }
}

//! Placements: similarity transforms as axes at an origin.

use super::{Point, Vector};
use serde::{Deserialize, Serialize};

/// A similarity placement `x ↦ origin + scale · (x·X + y·Y + z·Z)`: right- or left-handed axes of unit length.
///
/// Placements of parts, and positions of analytic surfaces, are frames; `scale` is 1 for the latter.
///
/// ```
/// use lampyris::math::{Frame, Point, Vector};
/// let frame = Frame::from_axis(Point::new(1.0, 2.0, 3.0), Vector::X, Some(Vector::Y));
/// assert_eq!(frame.point(Point::new(0.0, 0.0, 5.0)), Point::new(6.0, 2.0, 3.0));
/// assert_eq!(frame.compose(&frame.inverse()).point(Point::ONE), Point::ONE);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Image of the origin.
    pub origin: Point,
    /// Image of the x direction, unit length.
    pub x: Vector,
    /// Image of the y direction, unit length.
    pub y: Vector,
    /// Image of the z direction, unit length; `-x × y` for a mirrored frame.
    pub z: Vector,
    /// Uniform scale, positive.
    pub scale: f64,
}

/// Sine below which a hint runs along the axis: its part across is then four digits of rounding.
const PARALLEL: f64 = 1e-12;
/// Sine below which the part across a hint loses a digit or more.
const STEEP: f64 = 0.1;

/// Returns the unit vector of a direction of any length, even one whose square is beyond all numbers; `None` without a direction.
fn unit(direction: Vector) -> Option<Vector> {
    direction.try_normalize().or_else(|| (direction / direction.abs().max_element()).try_normalize())
}

impl Frame {
    /// Leaves everything where it is.
    pub const IDENTITY: Self = Self { origin: Point::ZERO, x: Vector::X, y: Vector::Y, z: Vector::Z, scale: 1.0 };

    /// A shift by a vector, mm, that turns and scales nothing.
    pub fn translation(by: Vector) -> Self {
        Self { origin: by, ..Self::IDENTITY }
    }

    /// Makes a right-handed frame of scale 1 from its axis and an approximate x direction, of any length, as in STEP's AXIS2_PLACEMENT_3D.
    ///
    /// Missing or parallel `x_hint` falls back to a perpendicular of the axis; a zero axis falls back to `Z`.
    pub fn from_axis(origin: Point, axis: Vector, x_hint: Option<Vector>) -> Self {
        let z = unit(axis).unwrap_or(Vector::Z);
        let x = x_hint
            .and_then(unit)
            .map(|h| h - z * h.dot(z))
            .filter(|p| p.length_squared() > PARALLEL * PARALLEL)
            .and_then(|p| p.try_normalize().map(|x| (x, p.length_squared() < STEEP * STEEP)))
            // Of a hint close to the axis little is left but rounding, a part of which lies along the axis: taken away once more.
            .and_then(|(x, near_axis)| if near_axis { (x - z * x.dot(z)).try_normalize() } else { Some(x) })
            .unwrap_or_else(|| {
                // Whichever of the two is not nearly along the axis.
                let pick = if z.x.abs() < 0.9 { Vector::X } else { Vector::Y };
                (pick - z * pick.dot(z)).normalize()
            });
        Self { origin, x, y: z.cross(x), z, scale: 1.0 }
    }

    /// The image of a point: from the frame's coordinates to those that the frame is in.
    pub fn point(&self, p: Point) -> Point {
        self.origin + self.vector(p)
    }

    /// The image of a difference of points, scaled.
    pub fn vector(&self, v: Vector) -> Vector {
        self.scale * self.direction(v)
    }

    /// The image of a direction, not scaled.
    pub fn direction(&self, v: Vector) -> Vector {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// The image of a unit normal: mirrored placements keep outward normals outward.
    pub fn normal(&self, n: Vector) -> Vector {
        self.direction(n)
    }

    /// Coordinates of a point in this frame: the inverse of [`Frame::point`].
    pub fn local_point(&self, p: Point) -> Point {
        self.local_direction(p - self.origin) / self.scale
    }

    /// Coordinates of a direction in this frame: the inverse of [`Frame::direction`].
    pub fn local_direction(&self, v: Vector) -> Vector {
        Vector::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Joins two placements, `self ∘ inner`: the placement by `inner` first, then by `self`.
    pub fn compose(&self, inner: &Self) -> Self {
        Self {
            origin: self.point(inner.origin),
            x: self.direction(inner.x),
            y: self.direction(inner.y),
            z: self.direction(inner.z),
            scale: self.scale * inner.scale,
        }
    }

    /// Another frame moved along, its scale kept: where a thing of fixed size goes that stands in this one.
    pub fn carry(&self, inner: &Self) -> Self {
        // The frame of the scene changes no bit.
        if self.is_identity() { *inner } else { Self { scale: inner.scale, ..self.compose(inner) } }
    }

    /// The placement that undoes this one.
    pub fn inverse(&self) -> Self {
        // Axes of unit length at right angles: the inverse of the turn is its transpose.
        let row = |i: usize| Vector::new(self.x[i], self.y[i], self.z[i]);
        let turned = Self { origin: Point::ZERO, x: row(0), y: row(1), z: row(2), scale: 1.0 / self.scale };
        Self { origin: -turned.vector(self.origin), ..turned }
    }

    /// Whether the placement turns right hands into left hands.
    pub fn is_mirrored(&self) -> bool {
        self.x.cross(self.y).dot(self.z) < 0.0
    }

    /// Whether the placement is [`Frame::IDENTITY`] to the last bit.
    pub fn is_identity(&self) -> bool {
        *self == Self::IDENTITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn odd_frame() -> Frame {
        Frame { scale: 25.4, ..Frame::from_axis(Point::new(3.0, -2.0, 7.0), Vector::new(1.0, 2.0, -0.5), None) }
    }

    #[test]
    fn a_direction_may_have_any_length() {
        let turned = Frame::from_axis(Point::ZERO, Vector::Y, Some(Vector::Z));
        for length in [1e-300, 1e-200, 1.0, 1e200, 1e308] {
            let frame = Frame::from_axis(Point::ZERO, length * Vector::Y, Some(length * Vector::Z));
            assert_eq!((frame.z, frame.x), (turned.z, turned.x), "{length}");
        }
    }

    #[test]
    fn inverse_undoes() {
        let f = odd_frame();
        let p = Point::new(0.3, 11.0, -5.0);
        assert!((f.inverse().point(f.point(p)) - p).length() < 1e-13);
        assert!((f.local_point(f.point(p)) - p).length() < 1e-13);
    }

    #[test]
    fn composition_is_application_in_turn() {
        let (f, g) = (odd_frame(), Frame::translation(Vector::new(1.0, 0.0, 2.0)));
        let p = Point::new(-4.0, 0.5, 2.0);
        assert!((f.compose(&g).point(p) - f.point(g.point(p))).length() < 1e-12);
    }

    #[test]
    fn a_mirrored_and_scaled_frame_is_undone_and_carries_sizes_as_they_are() {
        let odd = odd_frame();
        let f = Frame { z: -odd.z, scale: 2.5, ..odd };
        let p = Point::new(0.3, 11.0, -5.0);
        assert!(f.is_mirrored() && !odd.is_mirrored());
        assert!((f.inverse().point(f.point(p)) - p).length() < 1e-13);
        assert!((f.compose(&odd).point(p) - f.point(odd.point(p))).length() < 1e-12);
        let carried = f.carry(&odd);
        assert!((carried.origin - f.point(odd.origin)).length() < 1e-12);
        assert_eq!(carried.scale, odd.scale);
    }

    /// At a sine of 1e-11 rounding leaves five digits of the part across: x and z must stay at right angles all the same.
    #[test]
    fn a_hint_close_to_the_axis_gives_right_angles() {
        let axis = Vector::new(0.48, -0.6, 0.64);
        for across in [Vector::new(1.0, 0.0, 0.0), Vector::new(0.1, 0.7, -0.4)] {
            let f = Frame::from_axis(Point::ZERO, axis, Some(axis + 1e-11 * across));
            assert!(f.x.dot(f.z).abs() < 4e-16 && f.x.dot(f.y).abs() < 4e-16, "{}", f.x.dot(f.z));
        }
    }

    #[test]
    fn an_x_hint_along_the_axis_is_replaced() {
        let f = Frame::from_axis(Point::ZERO, Vector::X, Some(Vector::X));
        assert!(f.x.dot(f.z).abs() < 1e-15 && (f.x.length() - 1.0).abs() < 1e-15);
        assert!(!f.is_mirrored());
    }
}

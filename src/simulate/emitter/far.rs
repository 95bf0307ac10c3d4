//! Sources far away from the scene: their rays start beside it.
//!
//! A place 1 AU away is known to 0.03 mm in an `f64`, and so is every hit of a ray that starts there. A ray is the same wherever on it
//! one starts: it is moved along its direction, with products and sums that keep what is rounded off.

use super::near_start::NearStart;
use super::{Emitter, Lobe, Shape};
use crate::math::{Aabb, Point, Vector};

/// Diagonals of the scene from which on a start is far: nearer, its rounding is below 10^-12 of the scene.
const FAR_DIAGONALS: f64 = 1e3;

/// Largest share of the scene's diagonal by which rounding may shift the rays of a source that is far and not collimated. They cross the
/// scene side by side as evenly as before; by more than a hundredth of it their pattern would be that of rounding.
const LARGEST_SHIFT: f64 = 1e-2;

/// Rounding of a unit direction, and so of where its ray is after a unit of length.
const DIRECTION_ROUNDING: f64 = f64::EPSILON;

/// A number as the sum of two: the nearest `f64`, and what that is off.
#[derive(Clone, Copy)]
struct TwoFold {
    high: f64,
    low: f64,
}

impl TwoFold {
    /// Returns the exact sum of two numbers.
    fn sum(a: f64, b: f64) -> Self {
        // Knuth's sum without a condition on which is larger; what is rounded off is exact.
        let high = a + b;
        let b_share = high - a;
        Self { high, low: (a - (high - b_share)) + (b - b_share) }
    }

    /// Returns the exact product of two numbers, short of underflow.
    fn product(a: f64, b: f64) -> Self {
        let high = a * b;
        Self { high, low: a.mul_add(b, -high) }
    }

    fn plus(self, other: Self) -> Self {
        let s = Self::sum(self.high, other.high);
        Self::sum(s.high, s.low + self.low + other.low)
    }

    fn times(self, x: f64) -> Self {
        let p = Self::product(self.high, x);
        Self::sum(p.high, p.low + self.low * x)
    }

    fn over(self, divisor: Self) -> Self {
        let first = self.high / divisor.high;
        let remainder = self.plus(divisor.times(-first));
        Self::sum(first, remainder.high / divisor.high)
    }

    fn value(self) -> f64 {
        self.high + self.low
    }
}

/// Returns the point of a line nearest to `centre`, mm; `direction` may have any length but 0. Exact but for its last rounding.
fn foot_on_line(origin: Point, direction: Vector, centre: Point) -> Point {
    let zero = TwoFold { high: 0.0, low: 0.0 };
    let along = (0..3).fold(zero, |sum, k| sum.plus(TwoFold::sum(centre[k], -origin[k]).times(direction[k])));
    let square = (0..3).fold(zero, |sum, k| sum.plus(TwoFold::product(direction[k], direction[k])));
    let t = along.over(square);
    Point::from_array([0, 1, 2].map(|k| t.times(direction[k]).plus(TwoFold { high: origin[k], low: 0.0 }).value()))
}

impl Emitter {
    /// Makes the rays of a source that is more than [`FAR_DIAGONALS`] diagonals away start beside `scene_box` (mm); leaves one that is
    /// nearer, and any source where the box is empty. A collimated source itself is moved along its axis; of others each ray is, when it is
    /// emitted. Not for surroundings that absorb or scatter, which would act on the way that is skipped. `direction` is the axis as the
    /// scene gives it, of any length but zero; on an error nothing is changed.
    ///
    /// # Errors
    /// With what is wrong, when the source is so far away that its rays are not known within the scene.
    pub(crate) fn start_near(&mut self, scene_box: &Aabb, direction: Vector) -> Result<(), String> {
        if scene_box.is_empty() {
            return Ok(());
        }
        let centre = scene_box.center();
        let diagonal = scene_box.diagonal();
        let far = FAR_DIAGONALS * diagonal.max(f64::MIN_POSITIVE);
        let size = self.bounding_radius();
        let distance = self.farthest_start(centre);
        if !distance.is_finite() {
            return Err("it lies farther away than numbers reach".into());
        }
        if distance <= far {
            // Nearer, a start is known to the last digits that matter.
            return Ok(());
        }
        let collimated = matches!(self.lobe, Lobe::Collimated)
            && matches!(self.shape, Shape::Point | Shape::Disc(_) | Shape::Rectangle(_));
        // Parallel light is the same wherever on its way it starts.
        if collimated && size <= far {
            // The whole source moves along its direction, to before the scene, unless it shines away from it.
            let foot = foot_on_line(self.frame.origin, direction, centre);
            if (centre - self.frame.origin).dot(self.frame.z) > 0.0 {
                self.frame.origin = foot - self.frame.z * diagonal;
            }
            return Ok(());
        }
        // A direction is known to its last bit alone: over this distance that moves the ray aside.
        let shift = distance * DIRECTION_ROUNDING;
        if shift > LARGEST_SHIFT * diagonal {
            return Err(format!(
                "it lies {distance:.1e} mm away from a scene of {diagonal:.1e} mm, where rounding shifts its rays by {shift:.1e} mm"
            ));
        }
        self.near_start = Some(NearStart { centre, before: diagonal, far });
        Ok(())
    }

    /// Returns the distance from a point to the farthest start of its rays, mm, of a list a bound of it; 0 for faces, which belong to the
    /// scene.
    fn farthest_start(&self, centre: Point) -> f64 {
        match &self.shape {
            Shape::Faces(_) => 0.0,
            // The corners of the box around them lie no nearer than the starts.
            Shape::List(list) => {
                let starts = list.origins.corners().map(|corner| self.frame.point(corner));
                starts.iter().map(|p| (*p - centre).length()).fold(0.0, f64::max)
            }
            Shape::Point | Shape::Disc(_) | Shape::Rectangle(_) => {
                (self.frame.origin - centre).length() + self.bounding_radius()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pythagorean directions and whole coordinates: the foot is known to the last bit, and single precision of products misses it.
    #[test]
    fn the_foot_on_a_line_from_afar_is_exact() {
        let au = 2f64.powi(47);
        for (d, offset) in [
            (Vector::new(2.0, 3.0, 6.0), Vector::new(3.0, -2.0, 0.0)),
            (Vector::new(-1.0, 4.0, 8.0), Vector::new(4.0, 1.0, 0.0)),
        ] {
            let centre = Point::new(7.0, -5.0, 11.0);
            let origin = centre + offset - d * au;
            assert_eq!(foot_on_line(origin, d, centre), centre + offset);
        }
    }
}

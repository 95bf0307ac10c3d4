//! Axis-aligned boxes and where rays cross them.

use super::{Frame, Point, Ray, Vector};

/// An axis-aligned box `[min, max]`; empty when any `min > max`.
///
/// ```
/// use lampyris::math::{Aabb, Point, Ray, Vector};
/// let cube = Aabb::from_points([Point::ZERO, Point::ONE]);
/// let (near, far) = cube.clip(&Ray::new(Point::new(0.5, 0.5, -2.0), Vector::Z)).unwrap();
/// // Wider by a few roundings, never narrower.
/// assert!(near <= 2.0 && far >= 3.0 && far - near < 1.0 + 1e-14);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower corner, mm.
    pub min: Point,
    /// Upper corner, mm.
    pub max: Point,
}

/// By how much [`Aabb::with_room`] grows a box, in its own size and in the largest coordinate: a crossing is rounded by 1e-15 of these.
const ROOM: [f64; 2] = [1e-6, 1e-9];

impl Aabb {
    /// The box that contains nothing and is neutral to [`Aabb::union`].
    pub const EMPTY: Self = Self { min: Point::INFINITY, max: Point::NEG_INFINITY };

    /// The smallest box around the points; [`Aabb::EMPTY`] without any.
    pub fn from_points(points: impl IntoIterator<Item = Point>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The common part; empty when they do not meet, of no thickness when they touch.
    pub fn intersection(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// Whether the box contains no point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Whether the point lies inside or on the boundary.
    pub fn contains(&self, p: Point) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }

    /// Centre of the box; NaN for [`Aabb::EMPTY`].
    pub fn center(&self) -> Point {
        0.5 * (self.min + self.max)
    }

    /// Edge lengths, mm; some are negative for an empty box.
    pub fn size(&self) -> Vector {
        self.max - self.min
    }

    /// Length of the diagonal, 0 when empty.
    pub fn diagonal(&self) -> f64 {
        if self.is_empty() { 0.0 } else { self.size().length() }
    }

    /// Half the surface area (the measure of the surface-area heuristic), 0 when empty.
    pub fn half_area(&self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        let s = self.size();
        s.x * s.y + s.y * s.z + s.z * s.x
    }

    /// The box grown by `margin` mm on every side; [`Aabb::EMPTY`] stays empty.
    pub fn grown(self, margin: f64) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// The box grown on every side by far more than the rounding of a crossing: 1e-6 of its diagonal and 1e-9 of its largest coordinate.
    /// Not for an empty box, which becomes NaN.
    pub fn with_room(self) -> Self {
        let largest = self.min.abs().max(self.max.abs()).max_element();
        self.grown(ROOM[0] * self.diagonal() + ROOM[1] * largest)
    }

    /// The smallest box around this one where a placement puts it; an empty one stays empty.
    pub fn placed(&self, placement: &Frame) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        Self::from_points(self.corners().map(|p| placement.point(p)))
    }

    /// The eight corners; bit 0, 1 or 2 of the index is set where x, y or z is the upper one.
    pub fn corners(&self) -> [Point; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, lo: f64, hi: f64| if i >> bit & 1 == 0 { lo } else { hi };
            Point::new(
                pick(0, self.min.x, self.max.x),
                pick(1, self.min.y, self.max.y),
                pick(2, self.min.z, self.max.z),
            )
        })
    }

    /// The `t` at which a ray that starts inside comes out, rounded by some 1e-16 of the box's coordinates; the ray's own range does not
    /// count. Infinite where it runs along sides alone.
    #[inline]
    pub fn exit(&self, ray: &Ray) -> f64 {
        let inverse = ray.direction.recip();
        let (low, high) = ((self.min - ray.origin) * inverse, (self.max - ray.origin) * inverse);
        // `f64::max` and `min` leave out the NaN of 0 · ∞.
        (0..3).map(|axis| low[axis].max(high[axis])).fold(f64::INFINITY, f64::min)
    }

    /// The range of `t` in which the ray is inside, cut to the ray's own range; `None` for a miss, and for an empty box.
    ///
    /// Conservative: the range is widened by a few ulp so that rounding never loses a box that is touched.
    pub fn clip(&self, ray: &Ray) -> Option<(f64, f64)> {
        if self.is_empty() {
            return None;
        }
        let (mut near, mut far) = (ray.t_min, ray.t_max);
        for axis in 0..3 {
            let (o, d) = (ray.origin[axis], ray.direction[axis]);
            // 0/0 would be no number where the ray runs in a side.
            if d == 0.0 {
                if o < self.min[axis] || o > self.max[axis] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((self.min[axis] - o) / d, (self.max[axis] - o) / d);
            let (a, b) = if a <= b { (a, b) } else { (b, a) };
            // The difference and the quotient round by half an ulp each: four times that.
            near = near.max(a - a.abs() * 4.0 * f64::EPSILON);
            far = far.min(b + b.abs() * 4.0 * f64::EPSILON);
        }
        (near <= far).then_some((near, far))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clip_of_a_unit_box() {
        let b = Aabb { min: Point::ZERO, max: Point::ONE };
        let through = Ray::new(Point::new(0.5, 0.5, -2.0), Vector::Z);
        let (near, far) = b.clip(&through).unwrap();
        assert!((near - 2.0).abs() < 1e-14 && (far - 3.0).abs() < 1e-14);
        assert!(b.clip(&Ray::new(Point::new(1.5, 0.5, -2.0), Vector::Z)).is_none());
        assert!(b.clip(&Ray::new(Point::new(1.0, 0.5, -2.0), Vector::Z)).is_some(), "a ray in a wall touches");
        assert!(b.clip(&through.with_range(0.0, 1.0)).is_none());
    }

    #[test]
    fn empty_is_neutral() {
        let b = Aabb::from_points([Point::ONE, Point::new(2.0, 0.0, 3.0)]);
        assert_eq!(Aabb::EMPTY.union(b), b);
        assert!(Aabb::EMPTY.is_empty() && Aabb::EMPTY.half_area() == 0.0);
        let ray = Ray::new(Point::ZERO, Vector::new(0.6, 0.0, 0.8));
        assert!(Aabb::EMPTY.clip(&ray).is_none());
        let corners = b.corners();
        assert_eq!(Aabb::from_points(corners), b);
        assert!((0..8).all(|i| (0..i).all(|k| corners[i] != corners[k])), "each corner once");
    }
}

//! Lines of points with values, as ray paths are shown and written.

use crate::math::{Aabb, Point};

/// Open polylines with one value each of any number of quantities: ray paths, usually.
///
/// ```
/// use lampyris::formats::Polylines;
/// use lampyris::math::Point;
/// let mut paths = Polylines::default();
/// paths.push([Point::ZERO, Point::X]);
/// paths.push([Point::Y, Point::Z, Point::ONE]);
/// assert_eq!(paths.lines().map(|line| line.len()).collect::<Vec<_>>(), [2, 3]);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Polylines {
    /// The points of all lines, one line after the other, mm.
    pub points: Vec<Point>,
    /// For each line, one past its last point.
    pub ends: Vec<usize>,
    /// Named values (unit in the name), one a line.
    pub values: Vec<(String, Vec<f64>)>,
}

impl Polylines {
    /// Adds a line, which may have no points; `values` is not touched, and the caller's to keep in step.
    pub fn push(&mut self, points: impl IntoIterator<Item = Point>) {
        self.points.extend(points);
        self.ends.push(self.points.len());
    }

    /// The points of each line, mm, in order.
    pub fn lines(&self) -> impl Iterator<Item = &[Point]> {
        (0..self.ends.len()).map(|k| {
            let start = if k == 0 { 0 } else { self.ends[k - 1] };
            &self.points[start..self.ends[k]]
        })
    }

    /// Cuts lines off where they first leave a box, so that rays to infinity do not decide what a viewer shows. Values stay with their
    /// lines; lines that start outside become their first point. An empty box cuts nothing.
    pub fn inside(&self, bounds: &Aabb) -> Self {
        if bounds.is_empty() {
            return self.clone();
        }
        let mut cut = Self { values: self.values.clone(), ..Self::default() };
        for line in self.lines() {
            let mut kept: Vec<Point> = line.iter().copied().take_while(|p| bounds.contains(*p)).collect();
            // The next point lies outside: the line goes on towards it to the wall.
            if let (Some(&a), Some(&b)) = (kept.last(), line.get(kept.len()))
                && let Some(direction) = (b - a).try_normalize()
                && let Some((_, far)) = bounds.clip(&crate::math::Ray::new(a, direction))
            {
                kept.push(a + direction * far);
            }
            if kept.is_empty() {
                // A line keeps one point at least, or values would belong to the wrong lines.
                kept.extend(line.first());
            }
            cut.push(kept);
        }
        cut
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_at_the_wall_they_leave_through() {
        let mut lines = Polylines::default();
        lines.push([Point::splat(0.5), Point::new(0.5, 0.5, 0.9), Point::new(0.5, 0.5, 1e5)]);
        lines.push([Point::splat(3.0), Point::splat(0.5)]);
        let cut = lines.inside(&Aabb { min: Point::ZERO, max: Point::ONE });
        let points: Vec<&[Point]> = cut.lines().collect();
        assert_eq!(points[0].len(), 3);
        assert!((points[0][2] - Point::new(0.5, 0.5, 1.0)).length() < 1e-14);
        assert_eq!(points[1], [Point::splat(3.0)]);
        assert_eq!(lines.inside(&Aabb::EMPTY), lines);
    }
}

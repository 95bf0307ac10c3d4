//! Lines of points with values, as ray paths are shown and written.

use crate::math::{Aabb, Point, Ray};

/// Share of a model's diagonal up to which lines are drawn around it.
const DRAWN_AROUND: f64 = 0.35;

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

    /// Cuts lines a little outside of a model in this box, so that rays to infinity do not make it a speck in a picture; see
    /// [`Self::inside`].
    pub fn near(&self, model: &Aabb) -> Self {
        self.inside(&model.grown(DRAWN_AROUND * model.diagonal()))
    }

    /// Cuts lines to where they first pass a box, so that rays to infinity, and sources far away, do not decide what a viewer shows. Values
    /// stay with their lines; lines that pass the box by become their first point. An empty box cuts nothing.
    pub fn inside(&self, bounds: &Aabb) -> Self {
        if bounds.is_empty() {
            return self.clone();
        }
        let mut cut = Self { values: self.values.clone(), ..Self::default() };
        for line in self.lines() {
            let mut kept: Vec<Point> = Vec::new();
            for pair in line.windows(2) {
                let (a, b) = (pair[0], pair[1]);
                let Some(direction) = (b - a).try_normalize() else { continue };
                let stretch = Ray::new(a, direction).with_range(0.0, a.distance(b));
                let Some((near, far)) = bounds.clip(&stretch) else { continue };
                // The box is entered in the middle of a stretch where its beginning lies outside.
                if kept.is_empty() {
                    kept.push(if bounds.contains(a) { a } else { a + direction * near });
                }
                if !bounds.contains(b) {
                    kept.push(a + direction * far);
                    break;
                }
                kept.push(b);
            }
            // A line keeps one point at least, or values would belong to the wrong lines.
            if kept.is_empty() {
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
        lines.push([Point::new(2.0, 2.0, 2.0), Point::new(1.5, 1.5, 1.5), Point::splat(0.5)]);
        lines.push([Point::new(3.0, 0.0, 0.0), Point::new(3.0, 1.0, 0.0)]);
        let cut = lines.inside(&Aabb { min: Point::ZERO, max: Point::ONE });
        let points: Vec<&[Point]> = cut.lines().collect();
        assert_eq!(points[0].len(), 3);
        assert!((points[0][2] - Point::new(0.5, 0.5, 1.0)).length() < 1e-14);
        // From outside it begins at the wall, and what passes by is a point.
        assert_eq!(points[1].len(), 2);
        assert!((points[1][0] - Point::ONE).length() < 1e-14 && points[1][1] == Point::splat(0.5));
        assert_eq!(points[2], [Point::new(3.0, 0.0, 0.0)]);
        assert_eq!(lines.inside(&Aabb::EMPTY), lines);
    }
}

use crate::math::Point;

/// Open polylines with one value each of any number of quantities: ray paths, usually.
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
    /// Adds a line; its values are the caller's to keep in step.
    pub fn push(&mut self, points: impl IntoIterator<Item = Point>) {
        self.points.extend(points);
        self.ends.push(self.points.len());
    }

    /// The points of each line.
    pub fn lines(&self) -> impl Iterator<Item = &[Point]> {
        (0..self.ends.len()).map(|k| {
            let start = if k == 0 { 0 } else { self.ends[k - 1] };
            &self.points[start..self.ends[k]]
        })
    }
}

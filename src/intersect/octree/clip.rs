//! Boxes around the part of a facet inside a cell: Sutherland–Hodgman on both triangles, rounded outward to f32.

use crate::math::Point;

/// A box in f32, in coordinates relative to the middle of the mesh, mm; empty where a low exceeds its high.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Box32 {
    pub(super) low: [f32; 3],
    pub(super) high: [f32; 3],
}

impl Box32 {
    pub(super) const EMPTY: Self = Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    /// Grows the box to hold `other` too.
    pub(super) fn union(&mut self, other: &Self) {
        for a in 0..3 {
            // One instruction each: `f32::min` takes three for the sake of NaN, which boxes never hold.
            self.low[a] = if other.low[a] < self.low[a] { other.low[a] } else { self.low[a] };
            self.high[a] = if other.high[a] > self.high[a] { other.high[a] } else { self.high[a] };
        }
    }

    /// Half the surface, 0 when empty.
    pub(super) fn half_area(&self) -> f32 {
        let [x, y, z] = std::array::from_fn(|a| (self.high[a] - self.low[a]).max(0.0));
        x * y + y * z + z * x
    }

    /// The box around points, rounded outward to f32; empty without points.
    pub(super) fn bounding(points: &[Point]) -> Self {
        let mut low = Point::INFINITY;
        let mut high = Point::NEG_INFINITY;
        for &p in points {
            low = low.min(p);
            high = high.max(p);
        }
        Self { low: low.to_array().map(round_down), high: high.to_array().map(round_up) }
    }
}

/// The largest f32 that is not above `x`.
pub(super) fn round_down(x: f64) -> f32 {
    let y = x as f32;
    if f64::from(y) > x { y.next_down() } else { y }
}

/// The least f32 that is not below `x`.
pub(super) fn round_up(x: f64) -> f32 {
    let y = x as f32;
    if f64::from(y) < x { y.next_up() } else { y }
}

/// A triangle cut by six planes has at most nine corners.
#[derive(Clone, Copy)]
struct Polygon {
    points: [[f64; 3]; 10],
    count: usize,
}

impl Polygon {
    /// Cuts off what lies below the plane `axis = position`, or above it where `sign` is −1; nothing may be left.
    fn cut(&mut self, axis: usize, position: f64, sign: f64) {
        let height = |p: &[f64; 3]| (p[axis] - position) * sign;
        let points = &self.points[..self.count];
        // Most facets of a cell lie on one side: they are neither copied nor rounded.
        if points.iter().all(|p| height(p) >= 0.0) {
            return;
        }
        let mut kept = Self { points: [[0.0; 3]; 10], count: 0 };
        for (i, p) in points.iter().enumerate() {
            let q = &points[if i + 1 == points.len() { 0 } else { i + 1 }];
            let (hp, hq) = (height(p), height(q));
            if hp >= 0.0 {
                kept.push(*p);
            }
            if (hp > 0.0 && hq < 0.0) || (hp < 0.0 && hq > 0.0) {
                let s = hp / (hp - hq);
                let mut between: [f64; 3] = std::array::from_fn(|a| p[a] + (q[a] - p[a]) * s);
                // On the plane to the last bit, which interpolation would not hit: both cells that share it then
                // see one corner.
                between[axis] = position;
                kept.push(between);
            }
        }
        *self = kept;
    }

    /// Adds a corner; drops it where there are ten.
    fn push(&mut self, p: [f64; 3]) {
        // Rounding could in principle add a corner to a sliver; the hull of the first ten is kept then.
        if self.count < self.points.len() {
            self.points[self.count] = p;
            self.count += 1;
        }
    }
}

/// Finds the box around the part of a facet inside `cell`, grown by `pad` mm but not beyond `cell`; `None` when they do not meet.
///
/// Corners are relative to the middle of the mesh. Cuts are computed in f64; their rounding is covered by `pad`.
pub(super) fn clip(corners: &[Point; 4], cell: &Box32, pad: f64) -> Option<Box32> {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    let [a, b, c, d] = corners.map(|p| p.to_array());
    let triangles = [[a, b, c], [a, c, d]];
    // Of a triangle the second half has no area.
    for triangle in &triangles[..if c == d { 1 } else { 2 }] {
        let mut polygon = Polygon { points: [[0.0; 3]; 10], count: 3 };
        polygon.points[..3].copy_from_slice(triangle);
        for axis in 0..3 {
            polygon.cut(axis, f64::from(cell.low[axis]), 1.0);
            polygon.cut(axis, f64::from(cell.high[axis]), -1.0);
        }
        for p in &polygon.points[..polygon.count] {
            for axis in 0..3 {
                low[axis] = low[axis].min(p[axis]);
                high[axis] = high[axis].max(p[axis]);
            }
        }
    }
    if low[0] > high[0] {
        return None;
    }
    Some(Box32 {
        // Never beyond the cell: what `pad` adds would make a facet's parts overlap where the cell cuts them.
        low: std::array::from_fn(|a| round_down(low[a] - pad).max(cell.low[a])),
        high: std::array::from_fn(|a| round_up(high[a] + pad).min(cell.high[a])),
    })
}

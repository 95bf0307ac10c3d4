//! Where slabs are near a facet that has many of them: a grid over its box, in which most places of a large facet are far from all.

use crate::math::{Aabb, Point, Vector};

/// Cells a side, one bit each.
const CELLS: usize = 32;

/// A grid over the two longer sides of a box, with the cells that slabs reach into.
#[derive(Clone, Debug)]
pub(super) struct SlabMap {
    /// Corner of its box, in cells.
    corner: [f64; 2],
    /// Along the two axes, cells per mm; zero along a side without length.
    axes: [Vector; 2],
    rows: [u32; CELLS],
}

impl SlabMap {
    /// A map of what lies within `bounds`, mm, empty so far.
    pub(super) fn new(bounds: Aabb) -> Self {
        let size = bounds.size();
        let shortest = (1..3).fold(0, |shortest, a| if size[a] < size[shortest] { a } else { shortest });
        let axes = [(shortest + 1) % 3, (shortest + 2) % 3].map(|a| {
            let per_mm = if size[a] > 0.0 { CELLS as f64 / size[a] } else { 0.0 };
            Vector::AXES[a] * per_mm
        });
        Self { corner: axes.map(|axis| bounds.min.dot(axis)), axes, rows: [0; CELLS] }
    }

    /// The row and the column of a place. Neither falls where a coordinate rises, so that what lies in a box lies in its cells.
    #[inline(always)]
    fn cell(&self, p: Point) -> [usize; 2] {
        // A product with zeros beside one number is that number's: an index into the point would be a branch. Casts to the
        // processor's own integers cut off and saturate.
        let along = |k: usize| ((p.dot(self.axes[k]) - self.corner[k]) as i32).clamp(0, CELLS as i32 - 1) as usize;
        [along(0), along(1)]
    }

    /// Marks the cells that a box reaches into.
    pub(super) fn mark(&mut self, bounds: &Aabb) {
        let ([first_row, first], [last_row, last]) = (self.cell(bounds.min), self.cell(bounds.max));
        let columns = columns(first, last);
        self.rows[first_row..=last_row].iter_mut().for_each(|row| *row |= columns);
    }

    /// Whether something that was marked may touch the box around a way within the map.
    #[inline(always)]
    pub(super) fn may_touch(&self, [a, b]: [Point; 2]) -> bool {
        let ([first_row, first], [last_row, last]) = (self.cell(a.min(b)), self.cell(a.max(b)));
        let columns = columns(first, last);
        self.rows[first_row..=last_row].iter().any(|row| row & columns != 0)
    }
}

/// The bits of columns, of which the last is not below the first.
#[inline(always)]
fn columns(first: usize, last: usize) -> u32 {
    u32::MAX >> (CELLS - 1 - last) & u32::MAX << first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_touches_a_marked_box_is_detected() {
        let bounds = Aabb { min: Point::new(-3.0, 10.0, 5.0), max: Point::new(13.0, 12.0, 37.0) };
        let mut map = SlabMap::new(bounds);
        let slabs = [[0.0, 11.0, 9.0, 0.4], [12.9, 11.5, 36.0, 2.0], [5.0, 10.0, 20.0, 0.0]];
        let slabs = slabs.map(|[x, y, z, size]| {
            let min = Point::new(x, y, z);
            Aabb { min, max: min + Vector::splat(size) }
        });
        slabs.iter().for_each(|slab| map.mark(slab));
        let mut free = 0;
        for k in 0..20_000u32 {
            let unit = |m: f64| (f64::from(k) * m).fract();
            let place = bounds.min + bounds.size() * Vector::new(unit(0.618), unit(0.755), unit(0.569));
            let way = [place, place + Vector::new(unit(0.31) - 0.5, 0.0, unit(0.57) - 0.5)];
            let touches = slabs.iter().any(|slab| !slab.intersection(Aabb::from_points(way)).is_empty());
            let may_touch = map.may_touch(way);
            assert!(may_touch || !touches, "{way:?}");
            free += u32::from(!may_touch);
        }
        assert!(free > 15_000, "{free}");
    }
}

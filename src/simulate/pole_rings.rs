//! Rings of cells at the poles of planes C all around: slivers of one direction, and the brightest of so many that few rays meet would be
//! the luckiest.

use std::ops::Range;

/// Angles nearer than this are one, degrees.
const SAME_ANGLE_DEG: f64 = 1e-6;
/// Fewer planes than these leave cells that are no slivers.
const LEAST_PLANES: usize = 4;

/// The rings of cells at γ 0° and 180° of a grid over planes C, row after row with C running fastest.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct PoleRings {
    /// The cells of each.
    rings: Vec<Range<usize>>,
}

impl PoleRings {
    /// The rings of a grid of so many planes and cells of γ between these bounds, in degrees; none where the planes are not all around.
    pub(crate) fn new([planes, rows]: [usize; 2], c: [f64; 2], gamma: [f64; 2]) -> Self {
        let is_all_around = planes >= LEAST_PLANES && (c[1] - c[0] - 360.0).abs() < SAME_ANGLE_DEG;
        if !is_all_around || rows == 0 {
            return Self::default();
        }
        let poles = [(gamma[0], 0.0, 0), (gamma[1], 180.0, rows - 1)];
        let at_pole = poles.into_iter().filter(|(end, pole, _)| (end - pole).abs() < SAME_ANGLE_DEG);
        Self { rings: at_pole.map(|(.., row)| row * planes..(row + 1) * planes).collect() }
    }

    /// Whether the grid has no pole.
    pub(crate) fn is_empty(&self) -> bool {
        self.rings.is_empty()
    }

    /// Whether the first row is a ring at γ 0°, and the last one at γ 180°, of a grid of so many cells.
    pub(crate) fn has_poles(&self, cells: usize) -> [bool; 2] {
        [self.rings.iter().any(|ring| ring.start == 0), self.rings.iter().any(|ring| ring.end == cells)]
    }

    /// Sets the values of each ring to their mean.
    pub(crate) fn level(&self, values: &mut [f64]) {
        for ring in &self.rings {
            let mean = values[ring.clone()].iter().sum::<f64>() / ring.len() as f64;
            values[ring.clone()].fill(mean);
        }
    }

    /// Sets the standard errors of each ring to that of its mean.
    pub(crate) fn level_errors(&self, errors: &mut [f64]) {
        for ring in &self.rings {
            // Cells of a ring count different rays.
            let squares: f64 = errors[ring.clone()].iter().map(|e| e * e).sum();
            errors[ring.clone()].fill(squares.sqrt() / ring.len() as f64);
        }
    }

    /// Clears the errors of all cells of a ring but its last, which of equal cells is the brightest: one value, whose cells are no rivals
    /// of each other.
    pub(crate) fn clear_rivals(&self, errors: &mut [f64]) {
        for ring in &self.rings {
            errors[ring.start..ring.end - 1].fill(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_are_where_the_planes_meet() {
        let all = PoleRings::new([4, 3], [0.0, 360.0], [0.0, 180.0]);
        assert_eq!(all.has_poles(12), [true, true]);
        let back = PoleRings::new([4, 3], [-180.0, 180.0], [90.0, 180.0]);
        assert_eq!(back.has_poles(12), [false, true]);
        assert!(PoleRings::new([4, 3], [0.0, 180.0], [0.0, 180.0]).is_empty());
        assert!(PoleRings::new([3, 3], [0.0, 360.0], [0.0, 180.0]).is_empty());

        let mut values = [1.0, 2.0, 3.0, 6.0, 5.0, 5.0, 5.0, 9.0, 0.0, 0.0, 0.0, 8.0];
        all.level(&mut values);
        assert_eq!(values, [3.0, 3.0, 3.0, 3.0, 5.0, 5.0, 5.0, 9.0, 2.0, 2.0, 2.0, 2.0]);
        // Of four independent cells: √(4 · 2²)/4.
        let mut errors = [2.0; 12];
        back.level_errors(&mut errors);
        back.clear_rivals(&mut errors);
        assert_eq!(errors, [2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0, 1.0]);
    }
}

//! Rings of cells at and beside the poles of planes C all around, where planes draw together: slivers that few rays meet, and the brightest
//! of so many would be the luckiest.
//!
//! The ring at a pole is one direction, and stands at its mean. In a ring beside it neighbours are joined while their noise asks for it,
//! at most as many as have the solid angle of a cell at γ 90° together. So the peak of a smooth distribution is as noisy as far from the
//! poles, and what rays do tell apart there stays apart.

use crate::math::error_of_mean;
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// Angles nearer than this are one, degrees.
const SAME_ANGLE_DEG: f64 = 1e-6;
/// The angle all around, degrees.
const FULL_TURN_DEG: f64 = 360.0;
/// Fewer planes than these leave cells that are no slivers.
const LEAST_PLANES: usize = 4;
/// Standard error of a ring's cells, as a share of them, from which on neighbours are joined: the largest of a hundred values with as much
/// is 7 % too bright on average.
const NOISY: f64 = 0.03;

/// The rings of cells at γ 0° and 180° of a grid over planes C, row after row with C running fastest, and beside them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct PoleRings {
    rings: Vec<Ring>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Ring {
    cells: Range<usize>,
    /// How many cells may be joined; `None` at a pole, where all are.
    most_joined: Option<usize>,
}

/// Groups of neighbouring cells that count as one.
pub(crate) struct JoinedCells(Vec<Range<usize>>);

/// Whether an angle between these bounds, in degrees, goes all around: both are one direction.
pub(super) fn is_whole_turn(bounds: [f64; 2]) -> bool {
    (bounds[1] - bounds[0] - FULL_TURN_DEG).abs() < SAME_ANGLE_DEG
}

impl PoleRings {
    /// The rings of a grid of so many planes and cells of γ between these bounds, in degrees; none where the planes are not all around.
    pub(crate) fn new([planes, rows]: [usize; 2], c: [f64; 2], gamma: [f64; 2]) -> Self {
        let is_all_around = planes >= LEAST_PLANES && is_whole_turn(c);
        if !is_all_around || rows == 0 {
            return Self::default();
        }
        let is_pole = |row: usize| {
            row == 0 && gamma[0].abs() < SAME_ANGLE_DEG
                || row + 1 == rows && (gamma[1] - 180.0).abs() < SAME_ANGLE_DEG
        };
        let ring = |row: usize| {
            let middle = gamma[0] + (gamma[1] - gamma[0]) * (row as f64 + 0.5) / rows as f64;
            // Cells are as wide as the sine of γ.
            let joined = 1.0 / middle.to_radians().clamp(0.0, 2.0 * FRAC_PI_2).sin();
            let most_joined = (!is_pole(row)).then_some((joined.round() as usize).min(planes));
            let is_even = most_joined.is_none_or(|most| most > 1);
            is_even.then_some(Ring { cells: row * planes..(row + 1) * planes, most_joined })
        };
        Self { rings: (0..rows).filter_map(ring).collect() }
    }

    /// Whether the grid has neither poles nor slivers beside them.
    pub(crate) fn is_empty(&self) -> bool {
        self.rings.is_empty()
    }

    /// Whether the first row is a ring at γ 0°, and the last one at γ 180°, of a grid of so many cells.
    pub(crate) fn has_poles(&self, cells: usize) -> [bool; 2] {
        let mut poles = self.rings.iter().filter(|ring| ring.most_joined.is_none()).map(|ring| &ring.cells);
        [poles.clone().any(|ring| ring.start == 0), poles.any(|ring| ring.end == cells)]
    }

    /// Returns which cells with these values and standard errors are to be joined; without errors those at the poles alone.
    pub(crate) fn joined_cells(&self, values: &[f64], errors: Option<&[f64]>) -> JoinedCells {
        let groups = self.rings.iter().flat_map(|ring| {
            let (first, cells) = (ring.cells.start, ring.cells.len());
            let noise =
                errors.map_or(0.0, |errors| noise_share(&values[ring.cells.clone()], &errors[ring.cells.clone()]));
            // Noise falls with the root of the number of cells.
            let wanted = (noise / NOISY).powi(2).ceil().max(1.0);
            let count = match ring.most_joined {
                None => 1,
                Some(most) => cells.div_ceil((wanted as usize).min(most)),
            };
            (0..count).map(move |k| first + k * cells / count..first + (k + 1) * cells / count)
        });
        JoinedCells(groups.filter(|group| group.len() > 1).collect())
    }

    /// Clears the error of each cell that is one with the next of its ring, in value and error, so that of joined cells the last, which of
    /// equal ones is the brightest, stands for all: they are no rivals of each other.
    pub(crate) fn clear_rivals(&self, values: &[f64], errors: &mut [f64]) {
        for k in self.rings.iter().flat_map(|ring| ring.cells.start..ring.cells.end - 1) {
            if values[k] == values[k + 1] && errors[k] == errors[k + 1] {
                errors[k] = 0.0;
            }
        }
    }
}

/// Returns the standard error of the cells of a ring that have light, as a share of them, weighted by it; in the dark infinite where errors
/// are stated, which are those of one ray, and 0 without any.
fn noise_share(values: &[f64], errors: &[f64]) -> f64 {
    let lit = || values.iter().zip(errors).filter(|(value, _)| **value > 0.0);
    let light: f64 = lit().map(|(value, _)| value * value).sum();
    let noise: f64 = lit().map(|(_, error)| error * error).sum();
    if light > 0.0 {
        (noise / light).sqrt()
    } else if errors.iter().any(|error| *error > 0.0) {
        f64::INFINITY
    } else {
        0.0
    }
}

impl JoinedCells {
    /// Sets the values of each group to their mean: cells of a ring have one solid angle.
    pub(crate) fn level(&self, values: &mut [f64]) {
        for group in &self.0 {
            let mean = values[group.clone()].iter().sum::<f64>() / group.len() as f64;
            values[group.clone()].fill(mean);
        }
    }

    /// Sets the standard errors of each group to that of its mean; `values` are those of the single cells, not yet levelled.
    pub(crate) fn level_errors(&self, values: &[f64], errors: &mut [f64]) {
        for group in &self.0 {
            // Cells of a ring count different rays.
            let error = error_of_mean(group.clone().map(|k| [values[k], errors[k]]));
            errors[group.clone()].fill(error);
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
        all.joined_cells(&values, None).level(&mut values);
        assert_eq!(values, [3.0, 3.0, 3.0, 3.0, 5.0, 5.0, 5.0, 9.0, 2.0, 2.0, 2.0, 2.0]);
        // Of four independent cells: √(4 · 2²)/4.
        let (lit, mut errors) = ([100.0; 12], [2.0; 12]);
        back.joined_cells(&lit, Some(&errors.clone())).level_errors(&lit, &mut errors);
        back.clear_rivals(&lit, &mut errors);
        assert_eq!(errors, [2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0, 1.0]);
    }

    /// Rows of 20°, of which the second has its middle at 30°: two cells there are as wide as one at 90°. A ring between has none.
    #[test]
    fn cells_beside_a_pole_are_joined_for_noise_alone() {
        let rings = PoleRings::new([6, 9], [0.0, 360.0], [0.0, 180.0]);
        let values: Vec<f64> = (0..54).map(|k| 100.0 + f64::from(k % 6)).collect();
        let means = |share: f64| {
            let errors: Vec<f64> = values.iter().map(|v| share * v).collect();
            let mut even = values.clone();
            rings.joined_cells(&values, Some(&errors)).level(&mut even);
            even
        };
        let quiet = means(0.02);
        assert_eq!(quiet[..6], [102.5; 6]);
        assert_eq!(quiet[6..48], values[6..48]);
        let noisy = means(0.2);
        assert_eq!(noisy[6..12], [100.5, 100.5, 102.5, 102.5, 104.5, 104.5]);
        assert_eq!(noisy[12..42], values[12..42]);
        assert_eq!(noisy[42..48], noisy[6..12]);
    }

    /// One ray that adds 6 to a cell adds 3 to two of them and 1 to the six at the pole.
    #[test]
    fn what_a_ray_may_add_in_the_dark_is_spread_over_the_joined_cells() {
        let rings = PoleRings::new([6, 9], [0.0, 360.0], [0.0, 180.0]);
        let (dark, mut errors) = ([0.0; 54], [6.0; 54]);
        rings.joined_cells(&dark, Some(&errors.clone())).level_errors(&dark, &mut errors);
        assert_eq!((errors[..6].to_vec(), errors[6..12].to_vec()), (vec![1.0; 6], vec![3.0; 6]));
        assert_eq!(errors[24..30], [6.0; 6], "cells of γ 90° are joined with none");
    }
}

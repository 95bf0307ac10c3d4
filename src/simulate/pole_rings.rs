//! Rings of cells at and beside the poles of far fields and spheres: slivers that few rays meet, and the brightest of so many would be the
//! luckiest. Planes C draw together at γ 0° and 180°, columns of type A and of spheres at V ±90°, rows of type B at H ±90°.
//!
//! The ring at a pole is one direction, unless its cells are tall, and stands at its mean. In a ring beside it, and a tall one at it,
//! neighbours are joined while their noise asks for it, at most as many as have the solid angle of a cell on the equator together. So the
//! peak of a smooth distribution is as noisy as far from the poles, and what rays do distinguish there stays apart.

use super::scene::FarFieldType;
use crate::math::error_of_mean;
use std::f64::consts::PI;
use std::iter::StepBy;
use std::ops::Range;

/// Angles nearer than this are one, degrees.
const SAME_ANGLE_DEG: f64 = 1e-6;
/// The angle all around, degrees.
const FULL_TURN_DEG: f64 = 360.0;
/// From pole to pole, and what a field of the half space ahead covers of the angle about its poles, degrees.
const HALF_TURN_DEG: f64 = 180.0;
/// Fewer cells about a pole than these are no slivers.
const LEAST_PLANES: usize = 4;
/// Cells that reach farther from a pole than this, degrees, are no one direction: their ring has directions that are twice that apart.
const MOST_POLE_DEG: f64 = 15.0;
/// Standard error of a ring's cells, as a share of them, from which on neighbours are joined: the largest of a hundred values with as much
/// is 7 % too bright on average.
const NOISY: f64 = 0.03;

/// The rings of cells at and beside the poles of a grid over both angles of directions, row after row with the first running fastest.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct PoleRings {
    rings: Vec<Ring>,
    polar_axis: usize,
    reaches_poles: [bool; 2],
    poles: [Option<usize>; 2],
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Ring {
    cells: CellLine,
    /// How many cells may be joined; `None` at a pole, where all are.
    most_joined: Option<usize>,
}

/// Cells one behind the other in a row or a column of their grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct CellLine {
    first: usize,
    /// From one to the next, in the order of the grid.
    step: usize,
    count: usize,
}

impl CellLine {
    /// Goes through the indices of its cells, rising.
    fn indices(self) -> StepBy<Range<usize>> {
        (self.first..self.first + self.step * self.count).step_by(self.step)
    }

    /// Returns its `k`-th part of so many.
    fn part(self, k: usize, parts: usize) -> Self {
        let [from, to] = [k, k + 1].map(|k| k * self.count / parts);
        Self { first: self.first + self.step * from, count: to - from, ..self }
    }
}

/// Groups of neighbouring cells that count as one.
pub(crate) struct JoinedCells(Vec<CellLine>);

/// Whether an angle between these bounds, in degrees, goes all around: both are one direction.
pub(super) fn is_whole_turn(bounds: [f64; 2]) -> bool {
    (bounds[1] - bounds[0] - FULL_TURN_DEG).abs() < SAME_ANGLE_DEG
}

impl PoleRings {
    /// The rings of a grid over the angles of a type, of so many cells along both, between these bounds in degrees; none where planes C do
    /// not go all around, or the cells of types A and B not through half a turn about their poles.
    pub(crate) fn new(angles: FarFieldType, cells: [usize; 2], bounds: [[f64; 2]; 2]) -> Self {
        // Which angle gives how far a direction is from the poles, what it is at the first, and how far the other goes about them at least.
        let (polar_axis, first_pole_deg, least_turn_deg) = match angles {
            FarFieldType::A => (1, -0.5 * HALF_TURN_DEG, HALF_TURN_DEG),
            FarFieldType::B => (0, -0.5 * HALF_TURN_DEG, HALF_TURN_DEG),
            FarFieldType::C => (1, 0.0, FULL_TURN_DEG),
        };
        let (count, around) = (cells[polar_axis], cells[1 - polar_axis]);
        let [from, to] = bounds[1 - polar_axis];
        let reaches_around = around >= LEAST_PLANES && to - from > least_turn_deg - SAME_ANGLE_DEG;
        if !reaches_around || count == 0 {
            return Self::default();
        }
        let [low, high] = bounds[polar_axis].map(|angle| angle - first_pole_deg);
        let reaches_poles = [low, high - HALF_TURN_DEG].map(|beyond| beyond.abs() < SAME_ANGLE_DEG);
        let is_one_direction = high - low < MOST_POLE_DEG * count as f64 + SAME_ANGLE_DEG;
        let pole = |end: usize, place: usize| (is_one_direction && reaches_poles[end]).then_some(place);
        let poles = [pole(0, 0), pole(1, count - 1)];
        let ring = |place: usize| {
            let middle = low + (high - low) * (place as f64 + 0.5) / count as f64;
            // Cells are as wide as the sine of their angle from a pole.
            let joined = 1.0 / middle.to_radians().clamp(0.0, PI).sin();
            let is_pole = poles.contains(&Some(place));
            let most_joined = (!is_pole).then_some((joined.round() as usize).min(around));
            let cells = if polar_axis == 1 {
                CellLine { first: place * around, step: 1, count: around }
            } else {
                CellLine { first: place, step: count, count: around }
            };
            let is_even = most_joined.is_none_or(|most| most > 1);
            is_even.then_some(Ring { cells, most_joined })
        };
        Self { rings: (0..count).filter_map(ring).collect(), polar_axis, reaches_poles, poles }
    }

    /// Whether the grid has neither poles nor slivers beside them.
    pub(crate) fn is_empty(&self) -> bool {
        self.rings.is_empty()
    }

    /// Returns which axis of the grid (0 or 1) has the angle from the poles: its rings are columns or rows. 0 of a grid without rings.
    pub(crate) fn polar_axis(&self) -> usize {
        self.polar_axis
    }

    /// Whether the grid begins at the first pole, and ends at the last one, however tall its cells are there.
    #[cfg(feature = "report")]
    pub(crate) fn reaches_poles(&self) -> [bool; 2] {
        self.reaches_poles
    }

    /// Returns which columns or rows lie at the first pole and at the last one, the first and the last of the grid; `None` where it ends
    /// before, or its cells there are too tall for one direction.
    pub(crate) fn poles(&self) -> [Option<usize>; 2] {
        self.poles
    }

    /// Returns which cells with these values and standard errors are to be joined; without errors those at the poles alone.
    pub(crate) fn joined_cells(&self, values: &[f64], errors: Option<&[f64]>) -> JoinedCells {
        let groups = self.rings.iter().flat_map(|ring| {
            let cells = ring.cells;
            let noise = errors.map_or(0.0, |errors| noise_share(cells.indices().map(|k| [values[k], errors[k]])));
            // Noise falls with the root of the number of cells.
            let wanted = (noise / NOISY).powi(2).ceil().max(1.0);
            let count = match ring.most_joined {
                None => 1,
                Some(most) => cells.count.div_ceil((wanted as usize).min(most)),
            };
            (0..count).map(move |k| cells.part(k, count))
        });
        JoinedCells(groups.filter(|group| group.count > 1).collect())
    }

    /// Clears the error of each cell that is one with the next of its ring, in value and error, so that of joined cells the last, which of
    /// equal ones is the brightest, stands for all: they are no rivals of each other.
    pub(crate) fn clear_rivals(&self, values: &[f64], errors: &mut [f64]) {
        for ring in &self.rings {
            for (k, next) in ring.cells.indices().zip(ring.cells.indices().skip(1)) {
                if values[k] == values[next] && errors[k] == errors[next] {
                    errors[k] = 0.0;
                }
            }
        }
    }
}

/// Returns the standard error of the cells of a ring that have light, as a share of them, weighted by it; in the dark infinite where errors
/// are stated, which are those of one ray, and 0 without any. Each cell is `[value, error]`.
fn noise_share(mut cells: impl Iterator<Item = [f64; 2]> + Clone) -> f64 {
    let lit = cells.clone().filter(|[value, _]| *value > 0.0);
    let light: f64 = lit.clone().map(|[value, _]| value * value).sum();
    let noise: f64 = lit.map(|[_, error]| error * error).sum();
    if light > 0.0 {
        (noise / light).sqrt()
    } else if cells.any(|[_, error]| error > 0.0) {
        f64::INFINITY
    } else {
        0.0
    }
}

impl JoinedCells {
    /// Sets the values of each group to their mean: cells of a ring have one solid angle.
    pub(crate) fn level(&self, values: &mut [f64]) {
        for group in &self.0 {
            let mean = group.indices().map(|k| values[k]).sum::<f64>() / group.count as f64;
            group.indices().for_each(|k| values[k] = mean);
        }
    }

    /// Sets the standard errors of each group to that of its mean; `values` are those of the single cells, not yet levelled.
    pub(crate) fn level_errors(&self, values: &[f64], errors: &mut [f64]) {
        for group in &self.0 {
            // Cells of a ring count different rays.
            let error = error_of_mean(group.indices().map(|k| [values[k], errors[k]]));
            group.indices().for_each(|k| errors[k] = error);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: [[f64; 2]; 2] = [[0.0, 360.0], [0.0, 180.0]];

    #[test]
    fn rings_are_where_the_planes_meet() {
        let planes = |cells, bounds| PoleRings::new(FarFieldType::C, cells, bounds);
        let all = planes([4, 12], WHOLE);
        assert_eq!((all.polar_axis(), all.poles()), (1, [Some(0), Some(11)]));
        let back = planes([4, 6], [[-180.0, 180.0], [90.0, 180.0]]);
        assert_eq!(back.poles(), [None, Some(5)]);
        assert!(planes([4, 12], [[0.0, 180.0], [0.0, 180.0]]).is_empty());
        assert!(planes([3, 12], WHOLE).is_empty());

        let mut values = [5.0; 48];
        values[..8].copy_from_slice(&[1.0, 2.0, 3.0, 6.0, 5.0, 5.0, 5.0, 9.0]);
        values[44..].copy_from_slice(&[0.0, 0.0, 0.0, 8.0]);
        all.joined_cells(&values, None).level(&mut values);
        assert_eq!(values[..8], [3.0, 3.0, 3.0, 3.0, 5.0, 5.0, 5.0, 9.0]);
        assert_eq!((&values[8..44], &values[44..]), (&[5.0; 36][..], &[2.0; 4][..]));
        // Of four independent cells: √(4 · 2²)/4. No two of those before are equal.
        let lit: Vec<f64> = (0..24).map(|k| if k < 20 { 100.0 + f64::from(k % 4) } else { 100.0 }).collect();
        let mut errors = [2.0; 24];
        back.joined_cells(&lit, Some(&errors.clone())).level_errors(&lit, &mut errors);
        back.clear_rivals(&lit, &mut errors);
        assert_eq!((&errors[..20], &errors[20..]), (&[2.0; 20][..], &[0.0, 0.0, 0.0, 1.0][..]));
    }

    /// A cell that is lit alone is as bright as it is: one of 18° to 180° from a pole has directions far from those of the others there.
    #[test]
    fn a_tall_row_at_a_pole_is_no_one_direction() {
        let (half, turn) = ([-90.0, 90.0], [-180.0, 180.0]);
        for (angles, cells, bounds) in [
            (FarFieldType::A, [36, 1], [half, half]),
            (FarFieldType::A, [36, 2], [turn, half]),
            (FarFieldType::A, [12, 6], [turn, half]),
            (FarFieldType::B, [2, 36], [half, half]),
            (FarFieldType::C, [7, 5], WHOLE),
            (FarFieldType::C, [36, 10], WHOLE),
        ] {
            let rings = PoleRings::new(angles, cells, bounds);
            assert_eq!(rings.poles(), [None; 2], "{angles:?} {cells:?}");
            let mut values = vec![0.0; cells[0] * cells[1]];
            values[0] = 36.0;
            let (lit, errors) = (values.clone(), vec![0.36; values.len()]);
            rings.joined_cells(&lit, Some(&errors)).level(&mut values);
            assert_eq!(values, lit, "{angles:?} {cells:?}");
        }
        // Rows of 36° have their middle at 18°: three cells there are as wide as one at 90°, and joined as far as noise asks for it.
        let rings = PoleRings::new(FarFieldType::C, [6, 5], WHOLE);
        let mut values = [3.0; 30];
        values[0] = 9.0;
        rings.joined_cells(&values.clone(), Some(&[3.0; 30])).level(&mut values);
        assert_eq!((&values[..3], &values[3..]), (&[5.0; 3][..], &[3.0; 27][..]));
    }

    /// Type A has its poles in the first and the last row, type B in the first and the last column; half a space ends at both.
    #[test]
    fn types_a_and_b_have_their_poles_across() {
        let (half, turn) = ([-90.0, 90.0], [-180.0, 180.0]);
        for around in [half, turn] {
            let rows = PoleRings::new(FarFieldType::A, [4, 12], [around, half]);
            assert_eq!((rows.polar_axis(), rows.poles()), (1, [Some(0), Some(11)]));
            let columns = PoleRings::new(FarFieldType::B, [12, 4], [half, around]);
            assert_eq!((columns.polar_axis(), columns.poles()), (0, [Some(0), Some(11)]));
            // Four rows that have 0, 1, 2, 3 at the first pole, twice as much at the last, and 20 more between.
            let values: Vec<f64> = (0..48)
                .map(|k| match (f64::from(k / 12), k % 12) {
                    (row, 0) => row,
                    (row, 11) => 2.0 * row,
                    (row, _) => 20.0 + row,
                })
                .collect();
            let mut even = values.clone();
            columns.joined_cells(&values, None).level(&mut even);
            for (row, before) in even.chunks(12).zip(values.chunks(12)) {
                assert_eq!((row[0], &row[1..11], row[11]), (1.5, &before[1..11], 3.0));
            }
        }
        let part = PoleRings::new(FarFieldType::A, [4, 8], [turn, [-30.0, 90.0]]);
        assert_eq!(part.poles(), [None, Some(7)]);
        let values: Vec<f64> = (0..32).map(|k| f64::from(k * k)).collect();
        let mut even = values.clone();
        part.joined_cells(&values, None).level(&mut even);
        // 784, 841, 900 and 961.
        assert_eq!((&even[..28], &even[28..]), (&values[..28], &[871.5; 4][..]));
        // As a headlamp is measured: no pole is near.
        assert!(PoleRings::new(FarFieldType::A, [400, 200], [[-40.0, 40.0], [-20.0, 20.0]]).is_empty());

        // Two columns of four cells with an error of 2: at the pole √(4 · 2²)/4, for the last of them.
        let columns = PoleRings::new(FarFieldType::B, [2, 4], [[60.0, 90.0], turn]);
        let (lit, mut errors) = ([100.0; 8], [2.0; 8]);
        columns.joined_cells(&lit, Some(&errors.clone())).level_errors(&lit, &mut errors);
        assert_eq!(errors, [2.0, 1.0, 2.0, 1.0, 2.0, 1.0, 2.0, 1.0]);
        // Those beside are not joined, but equal.
        columns.clear_rivals(&lit, &mut errors);
        assert_eq!(errors, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 1.0]);
    }

    /// Rows of 15°, of which the second and third have their middles at 22.5° and 37.5°: three and two cells there are as wide as one at
    /// 90°. A ring between has none.
    #[test]
    fn cells_beside_a_pole_are_joined_for_noise_alone() {
        let rings = PoleRings::new(FarFieldType::C, [6, 12], WHOLE);
        let values: Vec<f64> = (0..72).map(|k| 100.0 + f64::from(k % 6)).collect();
        let means = |share: f64| {
            let errors: Vec<f64> = values.iter().map(|v| share * v).collect();
            let mut even = values.clone();
            rings.joined_cells(&values, Some(&errors)).level(&mut even);
            even
        };
        let quiet = means(0.02);
        assert_eq!(quiet[..6], [102.5; 6]);
        assert_eq!(quiet[6..66], values[6..66]);
        let noisy = means(0.2);
        assert_eq!(noisy[6..12], [101.0, 101.0, 101.0, 104.0, 104.0, 104.0]);
        assert_eq!(noisy[12..18], [100.5, 100.5, 102.5, 102.5, 104.5, 104.5]);
        assert_eq!(noisy[18..54], values[18..54]);
        assert_eq!((&noisy[54..60], &noisy[60..66]), (&noisy[12..18], &noisy[6..12]));
    }

    /// One ray that adds 6 to a cell adds 2 to three of them and 1 to the six at the pole.
    #[test]
    fn what_a_ray_may_add_in_the_dark_is_spread_over_the_joined_cells() {
        let rings = PoleRings::new(FarFieldType::C, [6, 12], WHOLE);
        let (dark, mut errors) = ([0.0; 72], [6.0; 72]);
        rings.joined_cells(&dark, Some(&errors.clone())).level_errors(&dark, &mut errors);
        assert_eq!((errors[..6].to_vec(), errors[6..12].to_vec()), (vec![1.0; 6], vec![2.0; 6]));
        assert_eq!(errors[36..42], [6.0; 6], "cells of γ 90° are joined with none");
    }
}

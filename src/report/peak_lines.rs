//! Lines of cells through the brightest one: along both axes of a grid, or in planes C of one that is all around.

use super::even_poles::{is_all_around, plane_rings};
use super::number::with_unit;
use crate::formats::Grid;
use crate::math::error_of_mean;
use crate::text::figures;

/// A quarter of the turn, degrees.
const QUARTER_DEG: f64 = 90.0;

/// A line of cells.
pub(super) struct Line {
    /// Which way it runs: `along H`, `in the plane C 5°`.
    pub name: String,
    /// Where it crosses the other axis: ` at V = 3°`; empty for a plane, whose name says it.
    pub place: String,
    /// Distance of two of its cells, in units of its axis.
    pub step: f64,
    /// Its cells, in their order: each twice, or the two beside it where it runs between them and has their mean.
    pub cells: Vec<[usize; 2]>,
    /// Where they lie on its axis; γ is negative on the far side of its pole.
    pub positions: Vec<f64>,
    /// Whether it runs through the brightest cell: the plane across that of the peak does at a pole alone.
    pub has_peak: bool,
}

impl Line {
    /// Returns the value at its `k`-th place.
    pub(super) fn value(&self, grid: &Grid, k: usize) -> f64 {
        let [a, b] = self.cells[k];
        0.5 * (grid.values[a] + grid.values[b])
    }

    /// Returns the error of that, as [`Grid::combined_error`].
    pub(super) fn error(&self, grid: &Grid, k: usize) -> Option<f64> {
        let [a, b] = self.cells[k];
        let errors = grid.error.as_ref()?;
        // Cells that were joined to their mean are one.
        if grid.values[a] == grid.values[b] && errors[a] == errors[b] {
            return grid.combined_error(a);
        }
        let rays = error_of_mean([a, b].map(|cell| [grid.values[cell], errors[cell]]).into_iter());
        // What facets change they change alike in neighbouring cells.
        let facets = grid.geometric.as_ref().map_or(0.0, |errors| 0.5 * (errors[a] + errors[b]));
        Some(rays.hypot(facets))
    }
}

/// Returns the columns, of `planes` all around, that lie so many quarters of the turn from the middle of column `i`: one twice, or both
/// beside that direction where it is the edge between them.
fn turned_columns(planes: usize, i: usize, quarters: usize) -> [usize; 2] {
    let (whole, rest) = (planes * quarters / 4, planes * quarters % 4);
    // A column reaches half of its width to either side of its middle.
    let steps = match rest {
        2 => [whole, whole + 1],
        3 => [whole + 1; 2],
        _ => [whole; 2],
    };
    steps.map(|step| (i + step) % planes)
}

/// Returns the lines along both axes through the brightest cell, or in its plane and the one across where the grid is over planes C all
/// around, in which γ runs to both sides of its pole; `None` for a grid without cells.
pub(super) fn lines_through_peak(grid: &Grid) -> Option<[Line; 2]> {
    let [a, b] = &grid.axes;
    let (i, j) = grid.peak_cell()?;
    if !is_all_around(grid) {
        let line = |[axis, fixed]: [&crate::formats::Axis; 2], at: usize, cells: Vec<usize>| Line {
            name: format!("along {}", axis.label),
            place: format!(" at {} = {}", fixed.label, with_unit(&figures(fixed.center(at), 3), &fixed.unit)),
            step: axis.step(),
            cells: cells.into_iter().map(|k| [k; 2]).collect(),
            positions: (0..axis.cells).map(|k| axis.center(k)).collect(),
            has_peak: true,
        };
        let row = (j * a.cells..(j + 1) * a.cells).collect();
        let column = (0..b.cells).map(|j| j * a.cells + i).collect();
        return Some([line([a, b], j, row), line([b, a], i, column)]);
    }
    // All planes have the cells at a pole.
    let is_at_pole = plane_rings(grid).poles().contains(&Some(j));
    let gammas = (0..b.cells).map(|j| b.center(j));
    let half_plane = |quarters: usize| {
        let columns = turned_columns(a.cells, i, quarters);
        (0..b.cells).map(move |j| columns.map(|column| j * a.cells + column))
    };
    let plane = |quarters: usize| {
        let angle = a.center(i) + QUARTER_DEG * quarters as f64;
        let angle = if angle < a.range[1] { angle } else { angle - (a.range[1] - a.range[0]) };
        Line {
            name: format!("in the plane C {}°", figures(angle, 3)),
            place: String::new(),
            step: b.step(),
            cells: half_plane(quarters + 2).rev().chain(half_plane(quarters)).collect(),
            positions: gammas.clone().rev().map(|gamma| -gamma).chain(gammas.clone()).collect(),
            has_peak: quarters == 0 || is_at_pole,
        }
    };
    Some([plane(0), plane(1)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Axis;

    /// Five planes of 72° with their own numbers for values, so many cells of γ, and a peak of 100 in one cell.
    fn five_planes(rows: usize, peak: usize) -> Grid {
        let axis = |label: &str, end: f64, cells| Axis {
            label: label.into(),
            unit: "deg".into(),
            range: [0.0, end],
            cells,
        };
        let axes = [axis("C", 360.0, 5), axis("gamma", 180.0, rows)];
        let values = (0..5 * rows).map(|k| if k == peak { 100.0 } else { (k % 5) as f64 }).collect();
        let (name, quantity, unit) = ("far".to_owned(), String::new(), "cd".to_owned());
        let error = Some(vec![0.3; 5 * rows]);
        let geometric = Some(vec![0.4; 5 * rows]);
        Grid { name, quantity, unit, axes, values, error, geometric, layers: Vec::new() }
    }

    /// Opposite the plane at C 36° lies the edge at 216° between those at 180° and 252°; across it the directions 126° and 306° lie in the
    /// planes from 72° and from 288° on.
    #[test]
    fn an_odd_number_of_planes_has_edges_opposite() {
        let grid = five_planes(2, 5);
        let lines = lines_through_peak(&grid).unwrap();
        let values = lines.each_ref().map(|line| (0..4).map(|k| line.value(&grid, k)).collect::<Vec<_>>());
        assert_eq!(values, [vec![2.5, 2.5, 0.0, 100.0], vec![4.0, 4.0, 1.0, 1.0]]);
        assert_eq!(lines.each_ref().map(|line| line.name.as_str()), ["in the plane C 36°", "in the plane C 126°"]);
        assert_eq!(lines[0].positions, [-135.0, -45.0, 45.0, 135.0]);
        // Two cells of other rays, which facets change alike.
        let [opposite, own] = [0, 2].map(|k| lines[0].error(&grid, k).unwrap());
        assert!((opposite - (0.3f64 / 2f64.sqrt()).hypot(0.4)).abs() < 1e-15 && (own - 0.5).abs() < 1e-15);
    }

    #[test]
    fn the_plane_across_has_the_peak_at_the_pole_alone() {
        // In twelve rows at γ 0, beside it and at γ 180°; two are too tall for one direction.
        for (rows, peak, is_at_pole) in [(12, 2, true), (12, 7, false), (12, 57, true), (2, 2, false)] {
            let lines = lines_through_peak(&five_planes(rows, peak)).unwrap();
            assert_eq!(lines.map(|line| line.has_peak), [true, is_at_pole], "cell {peak} of {rows} rows");
        }
    }

    /// Of a multiple of four planes each has one opposite and one across; of six the one across is an edge.
    #[test]
    fn planes_are_found_by_quarters_of_the_turn() {
        assert_eq!([0, 1, 2, 3].map(|q| turned_columns(8, 7, q)), [[7; 2], [1; 2], [3; 2], [5; 2]]);
        assert_eq!([0, 1, 2, 3].map(|q| turned_columns(6, 1, q)), [[1; 2], [2, 3], [4; 2], [5, 0]]);
    }
}

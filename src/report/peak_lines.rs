//! Lines of cells through the brightest one: along both axes of a grid, or in planes C of one that is all around.

use super::even_poles::is_all_around;
use super::number::with_unit;
use crate::formats::Grid;
use crate::text::figures;

/// A line of cells.
pub(super) struct Line {
    /// Which way it runs: `along H`, `in the plane C 5°`.
    pub name: String,
    /// Where it crosses the other axis: ` at V = 3°`; empty for a plane, which its name tells.
    pub place: String,
    /// Distance of two of its cells, in units of its axis.
    pub step: f64,
    /// Its cells, in their order.
    pub cells: Vec<usize>,
    /// Where they lie on its axis; γ is negative on the far side of its pole.
    pub positions: Vec<f64>,
}

/// Returns the lines along both axes through the brightest cell, or in its plane and the one across where the grid is over planes C all
/// around, in which γ runs to both sides of its pole; `None` for a grid without cells.
pub(super) fn lines_through_peak(grid: &Grid) -> Option<[Line; 2]> {
    let [a, b] = &grid.axes;
    let (i, j) = grid.peak_cell()?;
    let column = |i: usize| (0..b.cells).map(move |j| j * a.cells + i % a.cells);
    if !is_all_around(grid) {
        let line = |[axis, fixed]: [&crate::formats::Axis; 2], at: usize, cells| Line {
            name: format!("along {}", axis.label),
            place: format!(" at {} = {}", fixed.label, with_unit(&figures(fixed.center(at), 3), &fixed.unit)),
            step: axis.step(),
            cells,
            positions: (0..axis.cells).map(|k| axis.center(k)).collect(),
        };
        let row = (j * a.cells..(j + 1) * a.cells).collect();
        return Some([line([a, b], j, row), line([b, a], i, column(i).collect())]);
    }
    let gammas = (0..b.cells).map(|j| b.center(j));
    let plane = |i: usize| Line {
        name: format!("in the plane C {}°", figures(a.center(i % a.cells), 3)),
        place: String::new(),
        step: b.step(),
        cells: column(i + a.cells / 2).rev().chain(column(i)).collect(),
        positions: gammas.clone().rev().map(|gamma| -gamma).chain(gammas.clone()).collect(),
    };
    Some([plane(i), plane(i + a.cells / 4)])
}

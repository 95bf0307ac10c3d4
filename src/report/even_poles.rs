//! Grids over planes C all around, whose cells at a pole are slivers of one direction, and nearly so beside it.

use super::number::{coordinate_figures, without_rounding};
use crate::formats::Grid;
use crate::simulate::PoleRings;
use std::borrow::Cow;
use std::iter::once;

/// Returns the rings of cells at and beside the poles of a grid over planes C; none for any other.
pub(super) fn pole_rings(grid: &Grid) -> PoleRings {
    let [c, gamma] = &grid.axes;
    if c.label == "C" { PoleRings::new([c.cells, gamma.cells], c.range, gamma.range) } else { PoleRings::default() }
}

/// Whether a grid is over planes C all around, with γ from its pole on.
pub(super) fn is_all_around(grid: &Grid) -> bool {
    pole_rings(grid).has_poles(grid.values.len())[0]
}

/// Returns the brightest direction of a far field in words, and how bright it is; a pole has no plane.
pub(super) fn brightest_direction(grid: &Grid) -> Option<(String, f64)> {
    let ([h, v], value) = grid.peak()?;
    let [_, gamma] = &grid.axes;
    let (_, row) = grid.peak_cell()?;
    let ends = [(0, gamma.range[0]), (gamma.cells - 1, gamma.range[1])];
    let poles = pole_rings(grid).has_poles(grid.values.len());
    let pole = ends.iter().zip(poles).find(|((end, _), is_pole)| *is_pole && row == *end);
    let direction = match pole {
        Some(((_, angle), _)) => format!("{} {}°", symbol(&gamma.label), coordinate_figures(*angle)),
        None => direction_text(grid, [h, v]),
    };
    Some((direction, value))
}

/// Returns a direction of a far field, degrees, in words.
pub(super) fn direction_text(grid: &Grid, at: [f64; 2]) -> String {
    let [h, v] = at.map(|x| coordinate_figures(without_rounding(x)));
    format!("{} {h}°, {} {v}°", grid.axes[0].label, symbol(&grid.axes[1].label))
}

/// Returns the name of an axis as people write it; files have it in plain letters.
fn symbol(label: &str) -> &str {
    if label == "gamma" { "γ" } else { label }
}

/// Returns a grid in which all cells of the ring at a pole (γ 0° and 180°) have the mean of the ring, with the error of that, in its
/// layers too; any other grid as it is.
pub(crate) fn with_even_poles(grid: &Grid) -> Cow<'_, Grid> {
    with_joined_cells(grid, None)
}

/// Returns the grid with even poles in which noisy neighbours beside them have their mean too, as the figure of the brightest direction
/// takes them. For the report alone: files for other programs keep their cells.
pub(super) fn with_joined_slivers(grid: &Grid) -> Cow<'_, Grid> {
    with_joined_cells(grid, grid.error.as_deref())
}

/// Returns a grid whose cells are joined at its poles, and beside them where `errors` ask for it.
fn with_joined_cells<'g>(grid: &'g Grid, errors: Option<&[f64]>) -> Cow<'g, Grid> {
    let rings = pole_rings(grid);
    if rings.is_empty() {
        return Cow::Borrowed(grid);
    }
    let joined = rings.joined_cells(&grid.values, errors);
    let mut even = grid.clone();
    let layers =
        even.layers.iter_mut().map(|layer| (&mut layer.values, Some(&mut layer.error), &mut layer.geometric));
    for (values, errors, geometric) in
        once((&mut even.values, even.error.as_mut(), &mut even.geometric)).chain(layers)
    {
        if let Some(errors) = errors {
            joined.level_errors(values, errors);
        }
        joined.level(values);
        if let Some(geometric) = geometric {
            // What facets change they change alike in all cells of a ring.
            joined.level(geometric);
        }
    }
    Cow::Owned(even)
}

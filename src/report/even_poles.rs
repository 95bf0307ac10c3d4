//! Grids over the angles of directions, whose cells at a pole are slivers of one direction, and nearly so beside it.

use super::number::{coordinate_figures, without_rounding};
use crate::formats::Grid;
use crate::simulate::PoleRings;
use crate::simulate::scene::FarFieldType;
use std::borrow::Cow;
use std::iter::once;

/// Returns the rings of cells at and beside the poles of a grid over planes C; none for any other, whose axes do not show their poles.
pub(super) fn plane_rings(grid: &Grid) -> PoleRings {
    let [c, gamma] = &grid.axes;
    if c.label != "C" {
        return PoleRings::default();
    }
    PoleRings::new(FarFieldType::C, [c.cells, gamma.cells], [c.range, gamma.range])
}

/// Whether a grid is over planes C all around, with γ from its pole on, however tall its cells are there.
pub(super) fn is_all_around(grid: &Grid) -> bool {
    plane_rings(grid).reaches_poles()[0]
}

/// Returns the brightest direction of a far field with these rings in words, and how bright it is; a pole has one angle alone.
pub(super) fn brightest_direction(grid: &Grid, rings: &PoleRings) -> Option<(String, f64)> {
    let (at, value) = grid.peak()?;
    let (column, row) = grid.peak_cell()?;
    let polar = &grid.axes[rings.polar_axis()];
    let place = [column, row][rings.polar_axis()];
    let pole = rings.poles().into_iter().zip(polar.range).find(|(pole, _)| *pole == Some(place));
    let direction = match pole {
        Some((_, angle)) => format!("{} {}°", symbol(&polar.label), coordinate_figures(angle)),
        None => direction_text(grid, at),
    };
    Some((direction, value))
}

/// Returns a direction of a far field, degrees, in words.
pub(super) fn direction_text(grid: &Grid, at: [f64; 2]) -> String {
    let [h, v] = at.map(|x| coordinate_figures(without_rounding(x)));
    format!("{} {h}°, {} {v}°", grid.axes[0].label, symbol(&grid.axes[1].label))
}

/// Returns the name of an axis as people write it; files have it in plain letters.
pub(super) fn symbol(label: &str) -> &str {
    if label == "gamma" { "γ" } else { label }
}

/// Returns a grid in which all cells of the ring at a pole have the mean of the ring, with the error of that, in its layers too; one
/// without rings as it is.
pub(crate) fn with_even_poles<'g>(grid: &'g Grid, rings: &PoleRings) -> Cow<'g, Grid> {
    with_joined_cells(grid, rings, None)
}

/// Returns the grid with even poles in which noisy neighbours beside them have their mean too, as the figure of the brightest direction
/// takes them. For the report alone: files for other programs keep their cells.
pub(super) fn with_joined_slivers<'g>(grid: &'g Grid, rings: &PoleRings) -> Cow<'g, Grid> {
    with_joined_cells(grid, rings, grid.error.as_deref())
}

/// Returns a grid whose cells are joined at its poles, and beside them where `errors` ask for it.
fn with_joined_cells<'g>(grid: &'g Grid, rings: &PoleRings, errors: Option<&[f64]>) -> Cow<'g, Grid> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Axis;

    /// Two columns of 15° of four cells: of type B the brightest is the ring at H 90°, which has no V; of type A, whose rows have no ring
    /// there, it is a cell.
    #[test]
    fn a_pole_of_type_b_is_named_by_h_alone() {
        let axis = |label: &str, range, cells| Axis { label: label.into(), unit: "deg".into(), range, cells };
        let (name, quantity, unit) = ("far".to_owned(), String::new(), "cd".to_owned());
        let axes = [axis("H", [60.0, 90.0], 2), axis("V", [-80.0, 80.0], 4)];
        let values = vec![1.0, 2.0, 1.0, 2.0, 1.0, 6.0, 1.0, 2.0];
        let grid = Grid { name, quantity, unit, axes, values, error: None, geometric: None, layers: Vec::new() };
        let named = |angles| {
            let rings = PoleRings::new(angles, [2, 4], [[60.0, 90.0], [-90.0, 90.0]]);
            brightest_direction(&with_even_poles(&grid, &rings), &rings).unwrap()
        };
        assert_eq!(named(FarFieldType::B), ("H 90°".to_owned(), 3.0));
        assert_eq!(named(FarFieldType::A), ("H 82.5°, V 20°".to_owned(), 6.0));
    }
}

//! What a receiver counted as maps: the grid for files and pictures, its cuts, and what stands below them.

use super::framing::{LIT_PART_SHOWN, lit_part};
use super::number::unit_in_words;
use super::{AxisStyle, Chart, Series, SeriesStyle, figures};
use crate::formats::file_stem;
use crate::formats::{Axis, Grid, Layer};
use crate::simulate::scene::FarFieldType;
use crate::simulate::{ChannelResult, ReceiverResult, Results};
use crate::study::figures::{cell_errors, channel_cell_errors, light_weighted_error};
use crate::study::geometric_error::GeometricError;

/// Returns the cells of a receiver with their axes, mm or degrees; `None` for a receiver that has one number only.
pub fn receiver_grid(r: &ReceiverResult) -> Option<Grid> {
    // One cell is a number, not a map.
    if r.grid[0] * r.grid[1] < 2 || r.cells.len() != r.grid[0] * r.grid[1] {
        return None;
    }
    let (labels, unit) = match r.kind {
        "plane" | "disc" => (["x", "y"], "mm"),
        _ if r.angles == Some(FarFieldType::C) => (["C", "gamma"], "deg"),
        _ => (["H", "V"], "deg"),
    };
    let axis = |k: usize| Axis {
        label: labels[k].into(),
        unit: unit.into(),
        range: [r.middle[k] - r.half[k], r.middle[k] + r.half[k]],
        cells: r.grid[k],
    };
    let quantity = match r.unit {
        "cd" => "luminous intensity",
        "W/sr" => "radiant intensity",
        "lx" => "illuminance",
        _ => "irradiance",
    };
    Some(Grid {
        name: r.name.clone(),
        quantity: quantity.into(),
        unit: r.unit.into(),
        axes: [axis(0), axis(1)],
        values: on_receiver(r, &r.cells),
        // Where errors were not kept for cells there are none.
        error: (r.errors.len() == r.cells.len()).then(|| on_receiver(r, &cell_errors(r))),
        geometric: None,
        layers: r.channels.iter().map(|channel| layer(r, channel)).collect(),
    })
}

/// Returns the values of a receiver's cells, NaN for those off a disc.
pub(crate) fn on_receiver(r: &ReceiverResult, cells: &[f64]) -> Vec<f64> {
    let mut values = cells.to_vec();
    r.off.iter().for_each(|&k| values[k] = f64::NAN);
    values
}

/// Makes a layer of a grid from a channel of a receiver: its values with their statistical errors.
fn layer(r: &ReceiverResult, channel: &ChannelResult) -> Layer {
    Layer {
        quantity: match (channel.name.as_str(), channel.unit) {
            ("lm", "lx") => "illuminance".into(),
            ("lm", _) => "luminous intensity".into(),
            (name, _) => name.into(),
        },
        unit: channel.unit.into(),
        values: on_receiver(r, &channel.cells),
        error: on_receiver(r, &channel_cell_errors(r, channel)),
        geometric: None,
    }
}

/// Returns what the eye sees of a receiver in watts that counts lumens or CIE values too: the grid of its candela or lux; `None` for
/// others.
pub fn photometric_grid(r: &ReceiverResult) -> Option<Grid> {
    let (grid, Layer { unit, values, error, .. }) = (receiver_grid(r)?, layer(r, r.photometric()?));
    let quantity = if unit == "lx" { "illuminance" } else { "luminous intensity" };
    Some(Grid {
        quantity: quantity.into(),
        unit,
        values,
        error: Some(error),
        geometric: None,
        layers: Vec::new(),
        ..grid
    })
}

/// Returns every receiver's grids, the photometric one of those that have it first, with the receiver's index, and the errors from the
/// facets where these are known; receivers without cells have none.
pub(super) fn grids(results: &Results, error: Option<&GeometricError>) -> Vec<(usize, Grid)> {
    let mut grids = Vec::new();
    for (k, r) in results.receivers.iter().enumerate() {
        let measured = error.and_then(|e| e.receivers.get(k));
        // Errors of other cells than these are none of them.
        let of_all = |cells: &Vec<f64>| (cells.len() == r.cells.len()).then(|| cells.clone());
        let of_seen = r.photometric().and_then(|seen| measured?.channels.iter().find(|c| c.name == seen.name));
        let geometric = of_seen.and_then(|channel| of_all(&channel.cells));
        grids.extend(photometric_grid(r).map(|grid| (k, Grid { geometric, ..in_words(grid) })));
        let geometric = measured.and_then(|m| of_all(&m.cells));
        grids.extend(receiver_grid(r).map(|grid| (k, Grid { geometric, ..in_words(grid) })));
    }
    grids
}

/// Writes the units of a grid and its layers for people; files keep those of the results.
fn in_words(mut grid: Grid) -> Grid {
    let layers = grid.layers.iter_mut().map(|layer| &mut layer.unit);
    std::iter::once(&mut grid.unit).chain(layers).for_each(|unit| *unit = unit_in_words(unit));
    grid
}

/// Cells of a cut that are drawn: more than a screen has pixels, and 400 kB of the page.
const MOST_CUT_POINTS: usize = 2000;

/// Draws the values along both axes through the peak, with their errors, as far as the map shows them; `None` for a grid without cells or
/// without light.
pub(super) fn cuts(r: &ReceiverResult, grid: &Grid) -> Option<Chart> {
    let part = lit_part(grid);
    let grid = part.as_ref().unwrap_or(grid);
    let [a, b] = &grid.axes;
    let (column, row) = grid.peak_cell().filter(|(column, row)| grid.values[row * a.cells + column] > 0.0)?;
    // Every so many-th cell of a very fine receiver, the brightest among them: each has a bar of its error in the page.
    let shown = |axis: &Axis, peak: usize| {
        let step = axis.cells.div_ceil(MOST_CUT_POINTS);
        (peak % step..axis.cells).step_by(step)
    };
    let along = |[axis, fixed]: [&Axis; 2], [peak, at]: [usize; 2], cell: &dyn Fn(usize) -> usize| Series {
        name: format!("along {} at {} = {} {}", axis.label, fixed.label, figures(fixed.center(at), 3), fixed.unit),
        points: shown(axis, peak).map(|k| [axis.center(k), grid.values[cell(k)]]).collect(),
        errors: shown(axis, peak).filter_map(|k| grid.combined_error(cell(k))).collect(),
        style: SeriesStyle::Line,
        ..Series::default()
    };
    let series = vec![
        along([a, b], [column, row], &|k| row * a.cells + k),
        along([b, a], [row, column], &|k| k * a.cells + column),
    ];
    // Cuts along two axes of different units have no unit in common.
    let unit = if a.unit == b.unit { a.unit.as_str() } else { "" };
    let axes = [AxisStyle::linear("position", unit), AxisStyle::linear(&grid.quantity, &grid.unit)];
    let name = format!("{}-cuts", file_stem(&r.name));
    let errors = if grid.geometric.is_some() { "rays and facets together" } else { "the rays" };
    let mut caption = format!("One row and one column of cells; bars are one standard error of {errors}.");
    if part.is_some() {
        caption += LIT_PART_SHOWN;
    }
    Some(Chart::series(&name, &format!("{}: cuts through the peak", spoken(&r.name)), &caption, axes, series))
}

/// Writes what a map shows: its peak, its noise and its cells.
pub(super) fn reading(r: &ReceiverResult, grid: &Grid) -> String {
    let peak = grid.peak().map(|([x, y], value)| {
        if value <= 0.0 {
            return "No light came here. ".to_owned();
        }
        format!(
            "Peak {} {} at {} {} {}, {} {} {}. ",
            figures(value, 3),
            grid.unit,
            grid.axes[0].label,
            figures(x, 3),
            grid.axes[0].unit,
            grid.axes[1].label,
            figures(y, 3),
            grid.axes[1].unit
        )
    });
    let error = grid.error.as_ref().and_then(|errors| light_weighted_error(&grid.values, errors)).map(|share| {
        format!("Statistical error of a cell, weighted by its light: {} %. ", figures(100.0 * share, 2))
    });
    let steps = grid.axes.each_ref().map(|axis| format!("{} {}", figures(axis.step(), 3), axis.unit));
    let size = if steps[0] == steps[1] { steps[0].clone() } else { steps.join(" × ") };
    let cells = format!("{} × {} cells of {size}.", r.grid[0], r.grid[1]);
    [peak, error, Some(cells)].into_iter().flatten().collect()
}

/// Returns a name as words: with spaces in place of underscores.
pub(super) fn spoken(name: &str) -> String {
    name.replace('_', " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_maps_are_written_for_people() {
        let axis = |label: &str| Axis { label: label.into(), unit: "mm".into(), range: [0.0, 2.0], cells: 2 };
        let layer = Layer {
            quantity: "red".into(),
            unit: "W/m2".into(),
            values: vec![0.0; 4],
            error: vec![0.0; 4],
            geometric: None,
        };
        let grid = in_words(Grid {
            name: "wall".into(),
            quantity: "irradiance".into(),
            unit: "W/m2".into(),
            axes: [axis("x"), axis("y")],
            values: vec![0.0; 4],
            error: None,
            geometric: None,
            layers: vec![layer],
        });
        assert_eq!([grid.unit.as_str(), &grid.layers[0].unit], ["W/m²"; 2]);
    }
}

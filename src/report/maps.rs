//! What a receiver counted as maps: the grid for files and pictures, its cuts, and what stands below them.

use super::even_poles::{brightest_direction, is_all_around, symbol};
use super::framing::{LIT_PART_SHOWN, lit_part};
use super::number::{coordinate_figures, error_figures, known_figures, unit_in_words, with_unit};
use super::peak_lines::lines_through_peak;
use super::{AxisStyle, Chart, Series, SeriesStyle};
use crate::formats::file_stem;
use crate::formats::{Axis, Grid, Layer};
use crate::math::error_of_maximum;
use crate::simulate::scene::FarFieldType;
use crate::simulate::{ChannelResult, PoleRings, ReceiverResult, Results};
use crate::study::figures::{Figure, cell_errors, channel_cell_errors, light_weighted_error};
use crate::study::geometric_error::GeometricError;
use crate::text::figures;

/// Returns the cells of a receiver with their axes, mm or degrees; `None` for a receiver that has one number only.
pub fn receiver_grid(r: &ReceiverResult) -> Option<Grid> {
    // One cell is a number, not a map.
    if r.grid[0] * r.grid[1] < 2 || r.cells.len() != r.grid[0] * r.grid[1] {
        return None;
    }
    let labels = axis_labels(r);
    let unit = if labels[0] == "x" { "mm" } else { "deg" };
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

/// Returns the names of the axes of a receiver, as its files have them.
pub(super) fn axis_labels(r: &ReceiverResult) -> [&'static str; 2] {
    match r.kind {
        "plane" | "disc" => ["x", "y"],
        _ if r.angles == Some(FarFieldType::C) => ["C", "gamma"],
        _ => ["H", "V"],
    }
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

/// Writes the units of a grid and its layers, and the names of its axes, for people; files keep those of the results.
fn in_words(mut grid: Grid) -> Grid {
    grid.axes.iter_mut().for_each(|axis| axis.label = symbol(&axis.label).into());
    let layers = grid.layers.iter_mut().map(|layer| &mut layer.unit);
    std::iter::once(&mut grid.unit).chain(layers).for_each(|unit| *unit = unit_in_words(unit));
    grid
}

/// Cells of a cut that are drawn: more than a screen has pixels, and 400 kB of the report.
const MOST_CUT_POINTS: usize = 2000;

/// Draws the values along both axes through the peak, or of a luminaire in its plane and the one across, with their errors, as far as the
/// map shows them; `None` for a grid without cells or without light.
pub(super) fn cuts(grid: &Grid) -> Option<Chart> {
    let part = lit_part(grid);
    let framed = part.as_ref().unwrap_or(grid);
    let lines = lines_through_peak(grid).filter(|_| grid.peak().is_some_and(|(_, value)| value > 0.0))?;
    let [a, b] = &grid.axes;
    let is_framed = |cell: &usize| {
        let at = [a.center(cell % a.cells), b.center(cell / a.cells)];
        framed.axes.iter().zip(at).all(|(axis, x)| (axis.range[0]..=axis.range[1]).contains(&x))
    };
    let series = lines.map(|line| {
        let points = line.positions.iter().enumerate().map(|(k, x)| (*x, k));
        let points: Vec<(f64, usize)> = points.filter(|(_, k)| line.cells[*k].iter().any(is_framed)).collect();
        // Every so many-th cell of a very fine receiver, the brightest among them: each has a bar of its error in the report.
        let step = points.len().div_ceil(MOST_CUT_POINTS).max(1);
        let value = |k: &usize| line.value(grid, points[*k].1);
        let brightest = (0..points.len()).max_by(|k, l| value(k).total_cmp(&value(l))).unwrap_or(0);
        let shown = || points.iter().skip(brightest % step).step_by(step);
        Series {
            name: format!("{}{}", line.name, line.place),
            points: shown().map(|(x, k)| [*x, line.value(grid, *k)]).collect(),
            errors: shown().filter_map(|(_, k)| line.error(grid, *k)).collect(),
            style: SeriesStyle::Line,
            ..Series::default()
        }
    });
    // Cuts along two axes of different units have no unit in common.
    let unit = if a.unit == b.unit { a.unit.as_str() } else { "" };
    let (position, cut) = if is_all_around(grid) {
        (b.label.as_str(), "The plane C of the peak and the one across, with negative angles for their far sides")
    } else if a.unit == "deg" {
        ("angle", "One row and one column of cells")
    } else {
        ("position", "One row and one column of cells")
    };
    let axes = [AxisStyle::linear(position, unit), AxisStyle::linear(&grid.quantity, &grid.unit)];
    let name = format!("{}-cuts", file_stem(&grid.name));
    let errors = if grid.geometric.is_some() { "rays and facets together" } else { "the rays" };
    let mut caption = format!("{cut}; bars are one standard error of {errors}.");
    if part.is_some() {
        caption += LIT_PART_SHOWN;
    }
    let title = format!("{}: cuts through the peak", grid.name);
    Some(Chart::series(&name, &title, &caption, axes, series.into()))
}

/// Returns the standard error of the largest value, in its unit: that of the receiver's figure `max` where that has the unit of the grid,
/// else the statistical one with the upward bias of a noisy maximum ([`error_of_maximum`]) and the geometric one of its cell, as squares;
/// `None` without statistical errors. `rings` are the even poles of `grid`.
pub(super) fn peak_error(grid: &Grid, rings: &PoleRings, max: Option<&Figure>) -> Option<f64> {
    if let Some(max) = max.filter(|max| unit_in_words(&max.unit) == grid.unit) {
        return Some(max.combined());
    }
    let (i, j) = grid.peak_cell()?;
    let mut errors = grid.error.clone()?;
    rings.clear_rivals(&grid.values, &mut errors);
    let geometric = grid.geometric.as_ref().map_or(0.0, |geometric| geometric[j * grid.axes[0].cells + i]);
    let values = grid.values.iter().zip(&errors).map(|(&value, &error)| [value, error]);
    Some(error_of_maximum(values).hypot(geometric))
}

/// Writes what a map of a receiver shows: its peak with its error, its noise and its cells. `max` is the receiver's figure of the peak, in
/// the unit of this map or of another.
pub(super) fn reading(r: &ReceiverResult, grid: &Grid, max: Option<&Figure>) -> String {
    let place = |[x, y]: [f64; 2]| {
        let [x, y] = [(0, x), (1, y)].map(|(a, at)| {
            let Axis { label, unit, .. } = &grid.axes[a];
            format!("{label} {}", with_unit(&coordinate_figures(at), unit))
        });
        format!("{x}, {y}")
    };
    let rings = r.pole_rings();
    let peak = match brightest_direction(grid, &rings).filter(|_| r.kind == "far_field") {
        Some(direction) => Some(direction),
        None => grid.peak().map(|(at, value)| (place(at), value)),
    };
    let peak = peak.map(|(place, value)| {
        if value <= 0.0 {
            return "No light came here. ".to_owned();
        }
        let of = if max.is_some_and(|max| max.geometric.is_none()) { " (± of the rays alone)" } else { "" };
        let value = match peak_error(grid, &rings, max) {
            Some(error) => format!("{} ± {}", known_figures(value, error, 3), error_figures(error)),
            None => figures(value, 3),
        };
        format!("Peak {value} {}{of} at {place}. ", grid.unit)
    });
    let error = grid.error.as_ref().and_then(|errors| light_weighted_error(&grid.values, errors)).map(|share| {
        format!("Statistical error of a cell, weighted by its light: {} %. ", figures(100.0 * share, 2))
    });
    let steps = grid.axes.each_ref().map(|axis| with_unit(&figures(axis.step(), 3), &axis.unit));
    let size = if steps[0] == steps[1] { steps[0].clone() } else { steps.join(" × ") };
    let cells = format!("{} × {} cells of {size}.", r.grid[0], r.grid[1]);
    [peak, error, Some(cells)].into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Content;
    use crate::report::even_poles::plane_rings;

    /// A beam along γ 0 of 2° cells, with faint light beside and behind it.
    fn beam() -> Grid {
        let axis = |label: &str, end: f64, cells| Axis {
            label: label.into(),
            unit: "deg".into(),
            range: [0.0, end],
            cells,
        };
        let axes = [axis("C", 360.0, 72), axis("gamma", 180.0, 90)];
        let values = (0..72 * 90).map(|k| match axes[1].center(k / 72) {
            gamma if gamma < 20.0 => 1000.0 * (1.0 - gamma / 20.0) + (k % 72) as f64,
            _ => 4.0,
        });
        let (name, quantity, unit) = ("spot".to_owned(), "luminous intensity".to_owned(), "cd".to_owned());
        let values = values.collect();
        Grid { name, quantity, unit, axes, values, error: None, geometric: None, layers: Vec::new() }
    }

    #[test]
    fn cuts_of_a_luminaire_run_through_its_pole_as_far_as_it_is_lit() {
        let grid = beam();
        let chart = cuts(&grid).unwrap();
        let Content::Series(series) = chart.content else { panic!("curves") };
        assert_eq!(series[0].name, "in the plane C 358°");
        for s in series {
            let positions: Vec<f64> = s.points.iter().map(|p| p[0]).collect();
            assert!(positions.is_sorted() && positions[0] == -positions[positions.len() - 1], "{positions:?}");
            // As far as the frame of the map, and from cell to cell through the pole.
            assert!((20.0..50.0).contains(&-positions[0]), "{positions:?}");
            assert!(positions.windows(2).all(|p| (p[1] - p[0] - 2.0).abs() < 1e-9), "{positions:?}");
        }
    }

    #[test]
    fn the_peak_has_the_error_of_its_figure_in_the_same_unit() {
        let mut grid = beam();
        grid.error = Some(grid.values.iter().map(|v| 0.01 * v).collect());
        let max = |unit: &str, geometric| Figure::new(1071.0, unit, 30.0, geometric);
        let rings = plane_rings(&grid);
        assert_eq!(peak_error(&grid, &rings, Some(&max("cd", Some(40.0)))), Some(50.0));
        // Watts a steradian are another map's: the cell's own 1 %, 10.21, or more for its rivals; were all cells of two rows alike, the
        // largest of 144 would be too large by 2.59 of these, 28.4 in all.
        assert!((10.2..28.4).contains(&peak_error(&grid, &rings, Some(&max("W/sr", None))).unwrap()));
    }

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

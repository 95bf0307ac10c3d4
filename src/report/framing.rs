//! What a picture shows of a grid: the part that is lit, in no more cells than a screen has use for.

use super::contour::round_levels;
use super::even_poles::is_all_around;
use crate::formats::{Axis, Grid, Layer};

/// Share of the peak below which a cell is dark to the eye on a linear scale of colours.
const DARK: f64 = 2e-3;

/// Dark cells kept around the light, as a share of its extent.
const MARGIN: f64 = 0.06;

/// A part that is larger than this share of its grid along both axes is not worth another frame.
const WORTH: f64 = 0.75;

/// Fewest cells along an axis: a narrow spot is shown with its surroundings.
const FEWEST_CELLS: usize = 24;

/// What the caption of a picture of the [`lit_part`] ends with.
pub(super) const LIT_PART_SHOWN: &str = " Shown: the part that is lit; the files hold all of it.";

/// Most cells along an axis of a picture in the report: as many as it has pixels, and 2 MB of the report.
const MOST_CELLS: usize = 600;

/// Joins cells of the values to blocks, so that at most [`MOST_CELLS`] remain along each axis, each with the mean of its finite cells;
/// errors and layers are left out. Returns the cells of a block along both axes too; `None` where no joining is needed. The last blocks
/// may reach beyond the grid.
pub(super) fn joined_cells(grid: &Grid) -> Option<(Grid, [usize; 2])> {
    let cells = grid.axes.each_ref().map(|axis| axis.cells);
    let block = cells.map(|n| n.div_ceil(MOST_CELLS).max(1));
    if block == [1, 1] {
        return None;
    }
    let joined = [0, 1].map(|k: usize| cells[k].div_ceil(block[k]));
    let (mut sums, mut counts) = (vec![0.0; joined[0] * joined[1]], vec![0.0; joined[0] * joined[1]]);
    for (k, value) in grid.values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
        let at = k / cells[0] / block[1] * joined[0] + k % cells[0] / block[0];
        sums[at] += value;
        counts[at] += 1.0;
    }
    let axis = |k: usize| {
        let axis = &grid.axes[k];
        let end = axis.range[0] + axis.step() * (joined[k] * block[k]) as f64;
        Axis { range: [axis.range[0], end], cells: joined[k], ..axis.clone() }
    };
    let grid = Grid {
        axes: [axis(0), axis(1)],
        // A block without a cell, as beyond the rim of a disc, has no value: 0/0.
        values: sums.iter().zip(&counts).map(|(sum, count)| sum / count).collect(),
        error: None,
        geometric: None,
        layers: Vec::new(),
        ..grid.clone()
    };
    Some((grid, block))
}

/// Returns the value up to which a cell is dark. Over all directions there is some stray light everywhere: light below the lowest
/// isocandela line does not count for the frame of a luminaire.
fn dark_value(grid: &Grid, peak: f64) -> f64 {
    let lowest = round_levels(peak).first().copied().filter(|_| is_all_around(grid));
    lowest.unwrap_or(DARK * peak)
}

/// Cuts a grid to the part around all cells that are not dark against the brightest; `None` where that is most of it, or nothing.
pub(super) fn lit_part(grid: &Grid) -> Option<Grid> {
    let [a, b] = [grid.axes[0].cells, grid.axes[1].cells];
    // A dark receiver has no part that is lit.
    let peak = grid.values.iter().copied().fold(0.0, f64::max);
    let dark = dark_value(grid, peak);
    let lit: Vec<usize> = (0..grid.values.len()).filter(|&k| grid.values[k] > dark).collect();
    let extent = |place: &dyn Fn(usize) -> usize, cells: usize| {
        let first = lit.iter().map(|&k| place(k)).min()?;
        let last = lit.iter().map(|&k| place(k)).max()?;
        let margin =
            // Half of what is missing to the least frame goes to each side.
            ((last - first) as f64 * MARGIN).ceil() as usize + FEWEST_CELLS.saturating_sub(last - first) / 2 + 1;
        Some([first.saturating_sub(margin), (last + margin + 1).min(cells)])
    };
    let columns = extent(&|k| k % a, a)?;
    let rows = extent(&|k| k / a, b)?;
    let share = |[from, to]: [usize; 2], cells: usize| (to - from) as f64 / cells as f64;
    if share(columns, a) > WORTH && share(rows, b) > WORTH {
        return None;
    }
    let cut = |values: &[f64]| -> Vec<f64> {
        (rows[0]..rows[1]).flat_map(|j| values[j * a + columns[0]..j * a + columns[1]].iter().copied()).collect()
    };
    let axis = |axis: &Axis, [from, to]: [usize; 2]| {
        // By the edges of cells, so that the axes of the part agree with those of the whole.
        let edge = |k: usize| axis.range[0] + axis.step() * k as f64;
        Axis { range: [edge(from), edge(to)], cells: to - from, ..axis.clone() }
    };
    let layer = |l: &Layer| Layer {
        values: cut(&l.values),
        error: cut(&l.error),
        geometric: l.geometric.as_deref().map(cut),
        ..l.clone()
    };
    Some(Grid {
        axes: [axis(&grid.axes[0], columns), axis(&grid.axes[1], rows)],
        values: cut(&grid.values),
        error: grid.error.as_deref().map(cut),
        geometric: grid.geometric.as_deref().map(cut),
        layers: grid.layers.iter().map(layer).collect(),
        ..grid.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_cells_have_their_mean() {
        let axis = |cells: usize| Axis { label: "x".into(), unit: "mm".into(), range: [0.0, cells as f64], cells };
        // 1201 × 2 cells make 401 × 2: blocks of three columns, of which the last has one.
        let mut values: Vec<f64> = (0..2402).map(|k| (k % 1201) as f64).collect();
        values[1] = f64::NAN;
        let (name, quantity, unit) = (String::new(), String::new(), "lx".into());
        let axes = [axis(1201), axis(2)];
        let grid = Grid { name, quantity, unit, axes, values, error: None, geometric: None, layers: Vec::new() };
        let (joined, block) = joined_cells(&grid).unwrap();
        assert_eq!((block, joined.axes[0].cells, joined.axes[1].cells), ([3, 1], 401, 2));
        assert_eq!(
            [joined.values[0], joined.values[1], joined.values[400], joined.values[401]],
            [1.0, 4.0, 1200.0, 1.0]
        );
        assert_eq!(joined.axes[0].step(), 3.0);
        assert!(joined_cells(&joined).is_none());
    }

    /// 4 cd behind a beam of 1000 cd, whose lowest line is that of 10 cd; 20 cd are more than stray light.
    #[test]
    fn stray_light_does_not_widen_the_frame_of_a_luminaire() {
        let axis = |label: &str, end: f64, cells| Axis {
            label: label.into(),
            unit: "deg".into(),
            range: [0.0, end],
            cells,
        };
        let frame = |label: &str, stray: f64| {
            let axes = [axis(label, 360.0, 72), axis("gamma", 180.0, 90)];
            let value = |k: usize| if k / 72 < 10 { 1010.0 } else { stray };
            let (name, quantity, unit) = (String::new(), String::new(), "cd".into());
            let values = (0..72 * 90).map(value).collect();
            let grid =
                Grid { name, quantity, unit, axes, values, error: None, geometric: None, layers: Vec::new() };
            lit_part(&grid).map(|part| part.axes.map(|axis| axis.range[1]))
        };
        let [all_around, gamma] = frame("C", 4.0).unwrap();
        assert!(all_around == 360.0 && (20.0..50.0).contains(&gamma), "{gamma}");
        assert_eq!(frame("C", 20.0), None);
        // A headlamp's dark side, where glare is measured, stays.
        assert_eq!(frame("H", 4.0), None);
    }

    #[test]
    fn a_spot_on_a_wide_wall_is_framed() {
        let axis = |cells| Axis { label: "x".into(), unit: "mm".into(), range: [0.0, 1000.0], cells };
        let mut values = vec![0.0; 200 * 100];
        for j in 40..60 {
            for i in 100..150 {
                values[j * 200 + i] = (i + j) as f64;
            }
        }
        let (name, quantity, unit) = (String::new(), String::new(), "lx".into());
        let axes = [axis(200), axis(100)];
        let grid = Grid { name, quantity, unit, axes, values, error: None, geometric: None, layers: Vec::new() };
        let part = lit_part(&grid).unwrap();
        assert!(part.axes[0].cells < 65 && part.axes[1].cells < 40, "{:?}", part.axes);
        assert_eq!(part.peak(), grid.peak(), "the peak stays where it is");
        assert_eq!(part.values.iter().sum::<f64>(), grid.values.iter().sum::<f64>());
        assert_eq!(lit_part(&part), None);
    }
}

//! The part of a grid that is lit: what a picture shows of a receiver that is larger than its light.

use crate::formats::{Axis, Grid, Layer};

/// Share of the peak below which a cell is dark to the eye on a linear scale of colours.
const DARK: f64 = 2e-3;

/// Dark cells kept around the light, as a share of its extent.
const MARGIN: f64 = 0.06;

/// A part that is larger than this share of its grid along both axes is not worth another frame.
const WORTH: f64 = 0.75;

/// Fewest cells along an axis: a narrow spot is shown with its surroundings.
const FEWEST_CELLS: usize = 24;

/// Cuts a grid to the part around all cells that are not dark; `None` where that is most of it, or nothing.
pub(super) fn lit_part(grid: &Grid) -> Option<Grid> {
    let [a, b] = [grid.axes[0].cells, grid.axes[1].cells];
    // A dark receiver has no part that is lit.
    let peak = grid.values.iter().copied().fold(0.0, f64::max);
    let lit: Vec<usize> = (0..grid.values.len()).filter(|&k| grid.values[k] > DARK * peak).collect();
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
    let layer = |l: &Layer| Layer { values: cut(&l.values), error: cut(&l.error), ..l.clone() };
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

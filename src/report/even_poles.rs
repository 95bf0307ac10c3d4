//! Grids over planes C all around, whose cells at a pole are slivers of one direction.

use crate::formats::Grid;

/// Angles nearer than this are one, degrees.
const SAME_ANGLE_DEG: f64 = 1e-6;

/// Whether a grid is over planes C all around, with γ from its pole on.
pub(super) fn is_all_around(grid: &Grid) -> bool {
    let [c, gamma] = &grid.axes;
    let is_whole_turn = (c.range[1] - c.range[0] - 360.0).abs() < SAME_ANGLE_DEG;
    c.label == "C" && c.cells >= 4 && is_whole_turn && gamma.range[0].abs() < SAME_ANGLE_DEG
}

/// Whether γ goes on to the pole at 180°.
pub(super) fn has_far_pole(grid: &Grid) -> bool {
    (grid.axes[1].range[1] - 180.0).abs() < SAME_ANGLE_DEG
}

/// Returns a grid with each ring of cells at a pole (γ 0° and 180°) at its mean, where it is over planes C all around: these cells are
/// slivers of one direction, and the brightest of so many that few rays meet would be the luckiest.
pub(super) fn with_even_poles(grid: &Grid) -> Grid {
    let mut even = grid.clone();
    if !is_all_around(grid) {
        return even;
    }
    let [c, gamma] = &grid.axes;
    let (n, count) = (c.cells, c.cells as f64);
    for row in std::iter::once(0).chain(has_far_pole(grid).then_some(gamma.cells - 1)) {
        let ring = row * n..(row + 1) * n;
        let mean = |values: &[f64]| values[ring.clone()].iter().sum::<f64>() / count;
        even.values[ring.clone()].fill(mean(&grid.values));
        // Cells of a ring count different rays; what facets change they change alike.
        if let (Some(all), Some(error)) = (&mut even.error, &grid.error) {
            let squares: f64 = error[ring.clone()].iter().map(|e| e * e).sum();
            all[ring.clone()].fill(squares.sqrt() / count);
        }
        if let (Some(all), Some(geometric)) = (&mut even.geometric, &grid.geometric) {
            all[ring.clone()].fill(mean(geometric));
        }
    }
    even
}

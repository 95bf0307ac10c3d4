//! The cells of a round receiver: those of the square around it whose middles lie on the disc, which they share out among them.
//!
//! A cell that the rim cuts so that its middle lies beyond has little area, in which few rays would look like a bright spot: the next cell
//! inwards takes its area and its light. So no cell has much less area than a whole one, and areas and powers add up to those of the disc.

/// Radius within which the rounding of a point on the rim of a disc of radius 1 keeps it, with room to spare.
const REACH: f64 = 1.0 + 1e-9;

/// The partition of a disc of radius 1.
#[derive(Clone, Debug)]
pub(crate) struct DiscCells {
    /// For each cell of the square the one that counts its light.
    homes: Vec<u32>,
    /// Area of each cell with what it takes of its neighbours; 0 for one that lies off the disc.
    measures: Vec<f64>,
}

impl DiscCells {
    /// Divides a disc by the square around it, of so many columns and rows, at most 16 million cells in all.
    pub(super) fn new(count: [u32; 2]) -> Self {
        let [columns, rows] = count;
        let edge = |k: u32, n: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
        let cells = columns as usize * rows as usize;
        let (mut homes, mut measures) = (Vec::with_capacity(cells), vec![0.0; cells]);
        for row in 0..rows {
            for column in 0..columns {
                let x = [edge(column, columns), edge(column + 1, columns)];
                let y = [edge(row, rows), edge(row + 1, rows)];
                let nearest = [x, y].map(|[low, high]| 0f64.clamp(low, high));
                // Far beyond the rim no light is counted, and the way inwards would be long.
                let is_far = nearest[0].hypot(nearest[1]) > REACH;
                let [i, j] = if is_far { [column, row] } else { inner_cell([column, row], count) };
                let home = j * columns + i;
                homes.push(home);
                measures[home as usize] += if is_far { 0.0 } else { area_on_disc(x, y) };
            }
        }
        Self { homes, measures }
    }

    /// Returns the index of the cell that counts the light of a cell of the square: the cell itself where its middle lies on the disc.
    #[inline(always)]
    pub(super) fn home(&self, cell: usize) -> usize {
        self.homes[cell] as usize
    }

    /// Area of a cell, for a radius of 1.
    pub(super) fn measure(&self, cell: usize) -> f64 {
        self.measures[cell]
    }
}

/// Returns the cell itself where its centre lies on the disc, else the first such cell inwards: each step goes along the axis on which the
/// cell's centre lies farther from that of the disc. `count` is that of columns and rows.
fn inner_cell(mut cell: [u32; 2], count: [u32; 2]) -> [u32; 2] {
    let middle = |k: usize, at: u32| (2.0 * f64::from(at) + 1.0) / f64::from(count[k]) - 1.0;
    loop {
        let at = [middle(0, cell[0]), middle(1, cell[1])];
        // The innermost middles lie within 0.71 of the disc's, so that this ends.
        if at[0].hypot(at[1]) <= 1.0 {
            return cell;
        }
        let axis = usize::from(at[1].abs() > at[0].abs());
        cell[axis] = if at[axis] > 0.0 { cell[axis] - 1 } else { cell[axis] + 1 };
    }
}

/// Area that a rectangle has in common with the disc of radius 1 about the origin.
fn area_on_disc(x: [f64; 2], y: [f64; 2]) -> f64 {
    // Differences of the area between the axes and a corner may leave a rounding error where there is none in common.
    let area =
        corner_area(x[1], y[1]) - corner_area(x[0], y[1]) - corner_area(x[1], y[0]) + corner_area(x[0], y[0]);
    area.max(0.0)
}

/// Signed area of the disc between the axes and a corner: the integral over t from 0 to x of y, cut off at the height √(1 − t²).
fn corner_area(x: f64, y: f64) -> f64 {
    let (sign, x, y) = (x.signum() * y.signum(), x.abs().min(1.0), y.abs().min(1.0));
    // Up to here the line at height y lies on the disc.
    let flat = (1.0 - y * y).sqrt();
    let below_arc = |t: f64| 0.5 * (t * (1.0 - t * t).sqrt() + t.asin());
    let arc = if x > flat { below_arc(x) - below_arc(flat) } else { 0.0 };
    sign * (y * x.min(flat) + arc)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_4, PI};

    #[test]
    fn cells_share_out_the_whole_disc() {
        for count in [[1, 1], [2, 2], [3, 7], [100, 100], [1, 40], [251, 13]] {
            let cells = DiscCells::new(count);
            let sum: f64 = cells.measures.iter().sum();
            assert!((sum - PI).abs() < 1e-12, "{count:?} {sum}");
            // Light is counted where there is area.
            for (k, home) in cells.homes.iter().enumerate() {
                let is_counted = cells.measures[*home as usize] > 0.0;
                assert!(is_counted || *home as usize == k, "{count:?} {k}");
            }
        }
    }

    #[test]
    fn no_cell_has_much_less_area_than_a_whole_one() {
        let cells = DiscCells::new([60, 60]);
        let whole = 4.0 / 3600.0;
        let least = cells.measures.iter().copied().filter(|m| *m > 0.0).fold(f64::INFINITY, f64::min);
        let most = cells.measures.iter().copied().fold(0.0, f64::max);
        assert!(least > 0.48 * whole && most < 2.0 * whole, "{} {}", least / whole, most / whole);
    }

    /// A quarter, a half, and the square that lies wholly on the disc; the segment beyond x = ½ is π/3 − √3/4.
    #[test]
    fn areas_in_common_are_those_of_segments() {
        assert!((area_on_disc([0.0, 1.0], [0.0, 1.0]) - FRAC_PI_4).abs() < 1e-15);
        assert!((area_on_disc([-2.0, 0.0], [-2.0, 2.0]) - 2.0 * FRAC_PI_4).abs() < 1e-15);
        assert_eq!(area_on_disc([0.25, 0.5], [-0.5, -0.25]), 0.0625);
        assert!((area_on_disc([0.5, 1.0], [-1.0, 1.0]) - (PI / 3.0 - 0.75f64.sqrt() / 2.0)).abs() < 1e-15);
        assert_eq!(area_on_disc([0.8, 1.0], [0.8, 1.0]), 0.0);
    }
}

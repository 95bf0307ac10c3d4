//! Values over a regular grid, and how they are written as CSV and NPZ.

use super::npz::{NpyArray, write_npz};
use super::{Error, ErrorKind, write_atomic};
use std::io::{self, Write};
use std::path::Path;

/// Values over a regular grid of cells: what a receiver recorded.
///
/// ```
/// use lampyris::formats::{Axis, Grid};
///
/// let axis = |cells| Axis { label: "x".into(), unit: "mm".into(), range: [0.0, 4.0], cells };
/// let grid = Grid {
///     name: "wall".into(),
///     quantity: "illuminance".into(),
///     unit: "lx".into(),
///     axes: [axis(4), axis(1)],
///     values: vec![0.0, 1.0, 7.0, 2.0],
///     error: None,
///     geometric: None,
///     layers: Vec::new(),
/// };
/// assert_eq!(grid.peak(), Some(([2.5, 2.0], 7.0)));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Name of the receiver.
    pub name: String,
    /// What is measured, such as `luminous intensity`.
    pub quantity: String,
    /// Its unit, such as `cd`.
    pub unit: String,
    /// The two axes; the first runs fastest in `values`.
    pub axes: [Axis; 2],
    /// `values[j * axes[0].cells + i]`; NaN where there is no cell, as beyond the rim of a disc.
    pub values: Vec<f64>,
    /// Standard error of each value, where it was estimated.
    pub error: Option<Vec<f64>>,
    /// Error of each value from the facets it was traced on, one standard error, where it is known; 0 on the true surfaces.
    pub geometric: Option<Vec<f64>>,
    /// Further quantities over the same cells: colours, bands of wavelengths.
    pub layers: Vec<Layer>,
}

/// A further quantity over the cells of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// What is measured, such as `X` or `380-480 nm`.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// One value for each cell, in the order of the grid's own.
    pub values: Vec<f64>,
    /// Standard error of each value.
    pub error: Vec<f64>,
    /// Error of each value from the facets, as [`Grid::geometric`].
    pub geometric: Option<Vec<f64>>,
}

impl Layer {
    /// Name of a column or array, of the quantity and its unit: `X_lx`.
    pub fn column(&self) -> String {
        column(&self.quantity, &self.unit)
    }
}

/// Joins a quantity and its unit to a name without blanks and commas, with `_per_` for a slash of the unit.
fn column(quantity: &str, unit: &str) -> String {
    format!("{}_{}", quantity.replace([' ', ','], "_"), unit.replace('/', "_per_").replace('²', "2"))
}

/// One axis of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// What runs along it, such as `x` or `H`.
    pub label: String,
    /// Its unit, such as `mm` or `deg`.
    pub unit: String,
    /// Outer bounds of the first and the last cell.
    pub range: [f64; 2],
    /// Number of cells.
    pub cells: usize,
}

impl Axis {
    /// Width of a cell in the axis' unit; of an axis without cells the whole range.
    pub fn step(&self) -> f64 {
        (self.range[1] - self.range[0]) / self.cells.max(1) as f64
    }

    /// Centre of a cell, counted from 0, in the axis' unit.
    pub fn center(&self, cell: usize) -> f64 {
        self.range[0] + (cell as f64 + 0.5) * self.step()
    }

    /// The label with its unit as a column name: `x_mm`.
    pub fn column(&self) -> String {
        format!("{}_{}", self.label, self.unit)
    }
}

impl Grid {
    /// Name of a column or array, of the quantity and its unit: `luminous_intensity_cd`.
    pub fn column(&self) -> String {
        column(&self.quantity, &self.unit)
    }

    /// Returns the error of cell `k` from rays and facets together, from rays alone where that of the facets is not known; `None` where
    /// none was estimated.
    #[cfg(feature = "report")]
    pub(crate) fn combined_error(&self, k: usize) -> Option<f64> {
        let statistical = *self.error.as_ref()?.get(k)?;
        let geometric = self.geometric.as_ref().and_then(|errors| errors.get(k));
        Some(geometric.map_or(statistical, |geometric| statistical.hypot(*geometric)))
    }

    /// Lists both errors of the values, where both are known, and the geometric ones of the layers that have them, under the names that
    /// every format gives them.
    pub(super) fn error_layers(&self) -> impl Iterator<Item = (String, &Vec<f64>)> {
        let both = self.error.as_ref().zip(self.geometric.as_ref());
        let of_values = both.into_iter().flat_map(|(statistical, geometric)| {
            [("statistical".to_owned(), statistical), ("geometric".to_owned(), geometric)]
        });
        let of_layer = |layer: &'_ Layer| format!("{}_geometric", layer.column());
        let layers = self.layers.iter().filter_map(move |l| Some((of_layer(l), l.geometric.as_ref()?)));
        of_values.chain(layers)
    }

    /// Checks that every list of values has one for each cell; `path` is of the file to be written, for the message.
    pub(super) fn check_filled(&self, path: &Path) -> Result<(), Error> {
        let [a, b] = self.axes.each_ref().map(|axis| axis.cells);
        let own = [Some(&self.values), self.error.as_ref(), self.geometric.as_ref()];
        let layers = self.layers.iter().flat_map(|l| [Some(&l.values), Some(&l.error), l.geometric.as_ref()]);
        let mut lists = own.into_iter().chain(layers).flatten();
        match lists.find(|list| a.checked_mul(b) != Some(list.len())) {
            Some(list) => {
                let message = format!("{} values do not fill the grid of {a} × {b} cells", list.len());
                Err(Error::new(path, ErrorKind::Malformed(message)))
            }
            None => Ok(()),
        }
    }

    /// The range of values that colours stand for: from 0, or the smallest value when negative, to the largest; never empty.
    pub(crate) fn colour_range(&self) -> [f64; 2] {
        // From zero, so that darkness is dark; a grid of negative values needs its own floor.
        let [low, high] = self.extremes().map_or([0.0, 1.0], |[lo, hi]| [lo.min(0.0), hi]);
        // A grid of equal values has no span to divide by.
        [low, if high > low { high } else { low + low.abs().max(1.0) }]
    }

    /// Smallest and largest finite value; `None` without any.
    pub fn extremes(&self) -> Option<[f64; 2]> {
        let finite = self.values.iter().copied().filter(|v| v.is_finite());
        finite.fold(None, |e, v| Some(e.map_or([v, v], |[lo, hi]: [f64; 2]| [lo.min(v), hi.max(v)])))
    }

    /// Column and row of the largest finite value; `None` without any.
    pub fn peak_cell(&self) -> Option<(usize, usize)> {
        let nx = self.axes[0].cells.max(1);
        let best = (0..self.values.len())
            .filter(|&k| self.values[k].is_finite())
            .max_by(|&a, &b| self.values[a].total_cmp(&self.values[b]))?;
        Some((best % nx, best / nx))
    }

    /// Position and value of the largest finite value.
    pub fn peak(&self) -> Option<([f64; 2], f64)> {
        let (i, j) = self.peak_cell()?;
        Some(([self.axes[0].center(i), self.axes[1].center(j)], self.values[j * self.axes[0].cells.max(1) + i]))
    }
}

/// Writes a grid as CSV: a header line, then one cell a line with its centre, value and standard error, the same of each
/// layer, then both errors of the value as `statistical` and `geometric`, and the geometric ones of the layers, where they are known.
///
/// # Errors
/// When values do not fill the grid, and when the file cannot be written.
pub fn write_grid_csv(path: &Path, grid: &Grid) -> Result<(), Error> {
    grid.check_filled(path)?;
    let [a, b] = &grid.axes;
    write_atomic(path, |w| {
        write!(w, "{},{},{}", a.column(), b.column(), grid.column())?;
        write!(w, "{}", if grid.error.is_some() { ",standard_error" } else { "" })?;
        for layer in &grid.layers {
            write!(w, ",{0},{0}_standard_error", layer.column())?;
        }
        for (name, _) in grid.error_layers() {
            write!(w, ",{name}")?;
        }
        writeln!(w)?;
        // The shortest digits of a number cost more than all else of a dark cell: those of a column are found once.
        let columns: Vec<String> = (0..a.cells).map(|i| a.center(i).to_string()).collect();
        let own = [Some(&grid.values), grid.error.as_ref()].into_iter().flatten();
        let layers = grid.layers.iter().flat_map(|layer| [&layer.values, &layer.error]);
        let fields: Vec<&Vec<f64>> =
            own.chain(layers).chain(grid.error_layers().map(|(_, values)| values)).collect();
        // A row of cells at a time: to hand over each number cost as much as its digits.
        let (mut lines, mut numbers) = (Vec::new(), NumberWriter::default());
        for j in 0..b.cells {
            let row = b.center(j).to_string();
            for (i, column) in columns.iter().enumerate() {
                lines.extend_from_slice(column.as_bytes());
                lines.push(b',');
                lines.extend_from_slice(row.as_bytes());
                for values in &fields {
                    lines.push(b',');
                    numbers.append(&mut lines, values[j * a.cells + i])?;
                }
                lines.push(b'\n');
            }
            w.write_all(&lines)?;
            lines.clear();
        }
        Ok(())
    })
}

/// Writes numbers as their shortest digits. To find them costs more than all else of a cell, and of a short run most cells are 0 and have
/// the error of one ray: the digits of the last number are kept.
#[derive(Default)]
pub(super) struct NumberWriter {
    bits: u64,
    digits: Vec<u8>,
}

impl NumberWriter {
    /// Appends a number to `text`.
    pub(super) fn append(&mut self, text: &mut Vec<u8>, number: f64) -> io::Result<()> {
        let bits = number.to_bits();
        if bits == 0 {
            text.push(b'0');
            return Ok(());
        }
        if bits != self.bits {
            self.bits = bits;
            self.digits.clear();
            write!(self.digits, "{number}")?;
        }
        text.extend_from_slice(&self.digits);
        Ok(())
    }
}

/// Writes a grid as NPZ: `values[j, i]`, `error[j, i]`, the cell edges of both axes, and of each layer an array of its name and one
/// of its errors; `statistical[j, i]` and `geometric[j, i]` are both errors of the values, and an array of its name and `_geometric` is
/// that of a layer, where they are known.
///
/// # Errors
/// When values do not fill the grid, and when the file cannot be written.
pub fn write_grid_npz(path: &Path, grid: &Grid) -> Result<(), Error> {
    let [a, b] = &grid.axes;
    let edges =
        |axis: &Axis| -> Vec<f64> { (0..=axis.cells).map(|k| axis.range[0] + k as f64 * axis.step()).collect() };
    let (ea, eb) = (edges(a), edges(b));
    let (na, nb) = (format!("{}_edges", a.column()), format!("{}_edges", b.column()));
    let mut arrays = vec![
        NpyArray { name: "values", shape: vec![b.cells, a.cells], data: &grid.values },
        NpyArray { name: &na, shape: vec![ea.len()], data: &ea },
        NpyArray { name: &nb, shape: vec![eb.len()], data: &eb },
    ];
    if let Some(error) = &grid.error {
        arrays.push(NpyArray { name: "error", shape: vec![b.cells, a.cells], data: error });
    }
    let shape = || vec![b.cells, a.cells];
    // The names must outlive the arrays that borrow them.
    let names: Vec<[String; 2]> =
        (grid.layers.iter()).map(|layer| [layer.column(), format!("{}_error", layer.column())]).collect();
    for (layer, [name, error]) in grid.layers.iter().zip(&names) {
        arrays.push(NpyArray { name, shape: shape(), data: &layer.values });
        arrays.push(NpyArray { name: error, shape: shape(), data: &layer.error });
    }
    let errors: Vec<(String, &Vec<f64>)> = grid.error_layers().collect();
    for (name, values) in &errors {
        arrays.push(NpyArray { name, shape: shape(), data: values });
    }
    write_npz(path, &arrays)
}

#[cfg(test)]
mod tests {
    use super::NumberWriter;

    /// Equal numbers are the same digits, and signs, zeros and what is no number are kept apart.
    #[test]
    fn numbers_are_written_as_they_are() {
        let (mut text, mut numbers) = (Vec::new(), NumberWriter::default());
        for x in [0.0, 1.5, 1.5, 0.0, 1.5, -1.5, -0.0, 0.1, f64::NAN, f64::NAN, f64::INFINITY, 1e-7, 0.0] {
            numbers.append(&mut text, x).unwrap();
            text.push(b' ');
        }
        assert_eq!(String::from_utf8(text).unwrap(), "0 1.5 1.5 0 1.5 -1.5 -0 0.1 NaN NaN inf 0.0000001 0 ");
    }
}

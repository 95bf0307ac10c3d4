use super::npz::{NpyArray, write_npz};
use super::{Error, write_atomic};
use std::path::Path;

/// Values over a regular grid of cells: what a receiver recorded.
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
    /// `values[j * axes[0].cells + i]`.
    pub values: Vec<f64>,
    /// Standard error of each value, where it was estimated.
    pub error: Option<Vec<f64>>,
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
    /// Width of a cell.
    pub fn step(&self) -> f64 {
        (self.range[1] - self.range[0]) / self.cells.max(1) as f64
    }

    /// Centre of a cell.
    pub fn center(&self, cell: usize) -> f64 {
        self.range[0] + (cell as f64 + 0.5) * self.step()
    }

    /// The label with its unit as a column name: `x_mm`.
    pub fn column(&self) -> String {
        format!("{}_{}", self.label, self.unit)
    }
}

impl Grid {
    /// Smallest and largest finite value; `None` without any.
    pub fn extremes(&self) -> Option<[f64; 2]> {
        let finite = self.values.iter().copied().filter(|v| v.is_finite());
        finite.fold(None, |e, v| Some(e.map_or([v, v], |[lo, hi]: [f64; 2]| [lo.min(v), hi.max(v)])))
    }

    /// Index, position and value of the largest finite value.
    pub fn peak(&self) -> Option<([f64; 2], f64)> {
        let nx = self.axes[0].cells.max(1);
        let best = (0..self.values.len())
            .filter(|&k| self.values[k].is_finite())
            .max_by(|&a, &b| self.values[a].total_cmp(&self.values[b]))?;
        Some(([self.axes[0].center(best % nx), self.axes[1].center(best / nx)], self.values[best]))
    }
}

/// Writes a grid as CSV: a header line, then one cell a line with its centre, value and standard error.
///
/// # Errors
/// When the file cannot be written.
pub fn write_grid_csv(path: &Path, grid: &Grid) -> Result<(), Error> {
    let [a, b] = &grid.axes;
    let unit = grid.unit.replace('/', "_per_").replace('²', "2");
    write_atomic(path, |w| {
        write!(w, "{},{},{}_{unit}", a.column(), b.column(), grid.quantity.replace([' ', ','], "_"))?;
        writeln!(w, "{}", if grid.error.is_some() { ",standard_error" } else { "" })?;
        for (k, value) in grid.values.iter().enumerate() {
            let (i, j) = (k % a.cells.max(1), k / a.cells.max(1));
            write!(w, "{},{},{value}", a.center(i), b.center(j))?;
            match &grid.error {
                Some(error) => writeln!(w, ",{}", error[k])?,
                None => writeln!(w)?,
            }
        }
        Ok(())
    })
}

/// Writes a grid as NPZ: `values[j, i]`, `error[j, i]` and the cell edges of both axes.
///
/// # Errors
/// When the file cannot be written.
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
    write_npz(path, &arrays)
}

//! Borders of cells along an angle.

/// Degrees by which an interval may end outside, for edges are rounded in their files.
const EDGE_ROUNDING_DEG: f64 = 1e-9;

/// Rising borders of cells along an angle, with a measure of it: what is integrated over.
#[derive(Clone, Debug)]
pub(super) struct CellAxis {
    /// Degrees.
    edges: Vec<f64>,
    /// The measure up to each of them.
    // Kept: a zone asks for the same sines thousands of times.
    measures: Vec<f64>,
    /// The measure up to an angle in degrees.
    measure: fn(f64) -> f64,
}

/// The part of a cell that an interval covers.
pub(super) struct Overlap {
    pub(super) cell: usize,
    pub(super) measure: f64,
    /// How far its middle is beyond that of the cell, in widths of the cell.
    pub(super) offset: f64,
}

impl CellAxis {
    /// Takes edges that rise, degrees, at least two.
    pub(super) fn new(edges: Vec<f64>, measure: fn(f64) -> f64) -> Self {
        let measures = edges.iter().map(|edge| measure(*edge)).collect();
        Self { edges, measures, measure }
    }

    /// Number of cells.
    pub(super) fn cells(&self) -> usize {
        self.edges.len() - 1
    }

    /// First and last border, degrees.
    pub(super) fn extent(&self) -> [f64; 2] {
        [self.edges[0], self.edges[self.cells()]]
    }

    /// Width of the widest cell, degrees.
    pub(super) fn coarsest_deg(&self) -> f64 {
        self.edges.windows(2).map(|e| e[1] - e[0]).fold(0.0, f64::max)
    }

    /// The measure of a cell.
    pub(super) fn cell_measure(&self, cell: usize) -> f64 {
        self.measures[cell + 1] - self.measures[cell]
    }

    /// The same borders on the other side of 0, rising again.
    pub(super) fn mirrored(&self) -> Self {
        Self::new(self.edges.iter().rev().map(|edge| -edge).collect(), self.measure)
    }

    /// Lists the parts of cells that an interval covers, degrees, `from` below `to`; `None` where it leaves the borders.
    pub(super) fn overlaps(&self, from: f64, to: f64) -> Option<impl Iterator<Item = Overlap>> {
        let [low, high] = self.extent();
        if from < low - EDGE_ROUNDING_DEG || to > high + EDGE_ROUNDING_DEG {
            return None;
        }
        let ends = [(self.measure)(from), (self.measure)(to)];
        // The cell that holds the start, not the one behind it.
        let first = self.edges.partition_point(|e| *e <= from).saturating_sub(1);
        let cells = (first..self.cells()).take_while(move |k| self.edges[*k] < to);
        let part = move |k: usize| {
            let [left, right] = [self.edges[k], self.edges[k + 1]];
            let (low, below) = if from > left { (from, ends[0]) } else { (left, self.measures[k]) };
            let (high, above) = if to < right { (to, ends[1]) } else { (right, self.measures[k + 1]) };
            let offset = 0.5 * (low + high - left - right) / (right - left);
            Overlap { cell: k, measure: above - below, offset }
        };
        Some(cells.map(part).filter(|part| part.measure > 0.0))
    }
}

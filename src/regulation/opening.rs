//! What a photometer's opening adds up of the cells below it.

/// The cells that a photometer in one or several directions adds up, and by which weights.
#[derive(Clone, Debug, Default)]
pub(super) struct CellWeights {
    /// Cells by their rising index, each with its weight.
    // Ordered: sums over cells come in one order, and two runs agree to the last bit. A list: most hold a dozen of cells.
    pub(super) by_cell: Vec<(usize, f64)>,
    /// Standard error of what the width of the cells leaves open, cd.
    pub(super) unresolved: f64,
}

impl CellWeights {
    /// Adds to the weight of a cell.
    pub(super) fn add(&mut self, cell: usize, amount: f64) {
        // Cells come nearly in order.
        match self.by_cell.last() {
            Some(last) if cell <= last.0 => match self.by_cell.binary_search_by_key(&cell, |w| w.0) {
                Ok(place) => self.by_cell[place].1 += amount,
                Err(place) => self.by_cell.insert(place, (cell, amount)),
            },
            _ => self.by_cell.push((cell, amount)),
        }
    }

    /// Adds `factor` times weights of the same map; cells that both hold are then counted with their correlation.
    pub(super) fn plus(mut self, factor: f64, other: &Self) -> Self {
        for (cell, weight) in &other.by_cell {
            self.add(*cell, factor * weight);
        }
        // One edge of light crosses both: their errors have a common cause.
        self.unresolved += factor.abs() * other.unresolved;
        self
    }
}

/// What an opening adds up of cells, not yet divided by its measure.
#[derive(Default)]
pub(super) struct OpeningSum {
    pub(super) weights: CellWeights,
    /// Measure of what was added.
    pub(super) total: f64,
}

impl OpeningSum {
    /// Divides by the measure that was added, which is not 0.
    pub(super) fn mean(mut self) -> CellWeights {
        // By what was met: rounding of edges must not make the mean too large.
        for (_, weight) in &mut self.weights.by_cell {
            *weight /= self.total;
        }
        self.weights.unresolved /= self.total;
        self.weights
    }
}

/// Form of a photometer's opening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sensor {
    /// Half a side of a square, or the radius of a disc, degrees.
    pub(super) half_deg: f64,
    pub(super) round: bool,
}

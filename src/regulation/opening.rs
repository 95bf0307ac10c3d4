//! What a photometer's opening adds up of the cells below it.

/// What a photometer in one or several directions adds up: cells with weights.
#[derive(Clone, Debug, Default)]
pub(super) struct Measurement {
    /// Cells by their rising index.
    // Ordered: sums over cells come in one order, and two runs agree to the last bit. A list: most hold a dozen of cells.
    pub(super) weights: Vec<(usize, f64)>,
}

impl Measurement {
    /// Adds to the weight of a cell.
    pub(super) fn add(&mut self, cell: usize, amount: f64) {
        // Cells come nearly in order.
        match self.weights.last() {
            Some(last) if cell <= last.0 => match self.weights.binary_search_by_key(&cell, |w| w.0) {
                Ok(place) => self.weights[place].1 += amount,
                Err(place) => self.weights.insert(place, (cell, amount)),
            },
            _ => self.weights.push((cell, amount)),
        }
    }

    /// Adds `factor` times another measurement of the same map; cells that both hold are then counted with their correlation.
    pub(super) fn plus(mut self, factor: f64, other: &Self) -> Self {
        for (cell, weight) in &other.weights {
            self.add(*cell, factor * weight);
        }
        self
    }
}

/// What an opening adds up of cells, not yet divided by its measure.
#[derive(Default)]
pub(super) struct OpeningSum {
    pub(super) measurement: Measurement,
    /// Measure of what was added.
    pub(super) total: f64,
}

impl OpeningSum {
    pub(super) fn mean(mut self) -> Measurement {
        // By what was met: rounding of edges must not make the mean too large.
        for (_, weight) in &mut self.measurement.weights {
            *weight /= self.total;
        }
        self.measurement
    }
}

/// Form of a photometer's opening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sensor {
    /// Half a side of a square, or the radius of a disc, degrees.
    pub(super) half_deg: f64,
    pub(super) round: bool,
}

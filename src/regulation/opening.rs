//! A photometer's opening, as weights of the cells below it.

/// Cosine of the elevation that an opening's width is divided by at least, so that it stays finite at the poles.
const LEAST_COSINE: f64 = 1e-3;

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

/// Sums of an opening over cells, not yet divided by its measure.
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

/// Returns the shares of a cell and its neighbours along an axis, in order, in how much brighter it gets over its width, from the steps to
/// it and from it: the monotonised central difference (van Leer, J. Comput. Phys. 23, 1977), half of that between the neighbours, at most
/// twice that from either, and none where both are brighter, or darker; so no cell that lies between two others is taken beyond them.
pub(super) fn slope_shares([before, after]: [f64; 2]) -> [f64; 3] {
    if before * after <= 0.0 {
        return [0.0; 3];
    }
    let central = 0.5 * (before + after).abs();
    if central <= 2.0 * before.abs().min(after.abs()) {
        [-0.5, 0.0, 0.5]
    } else if before.abs() < after.abs() {
        [-2.0, 2.0, 0.0]
    } else {
        [0.0, -2.0, 2.0]
    }
}

/// Returns the share of its slopes with which no part of a cell is darker than none, from its value and how much brighter the part is by
/// the slopes: each alone leaves it some light, both together at its corner may not.
pub(super) fn least_share(value: f64, rise: f64) -> f64 {
    /// Less than all, by far more than the rounding of the sums.
    const NEARLY_ALL: f64 = 1.0 - 1e-12;
    if value + rise < 0.0 { NEARLY_ALL * value.max(0.0) / -rise } else { 1.0 }
}

/// Form of a photometer's opening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sensor {
    /// Half a side of a square, or the radius of a disc, degrees.
    pub(super) half_deg: f64,
    pub(super) round: bool,
}

/// The azimuth that a small angle to the side takes at an elevation, degrees: the angle over the cosine of the elevation, which is taken to
/// be no less than [`LEAST_COSINE`].
pub(super) fn azimuth_deg(angle_deg: f64, v_deg: f64) -> f64 {
    angle_deg / v_deg.to_radians().cos().max(LEAST_COSINE)
}

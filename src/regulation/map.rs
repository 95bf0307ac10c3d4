//! A far field as a photometer reads it: intensities over azimuth and elevation with the errors of every cell.

use super::cell_axis::{CellAxis, Overlap};
use super::error::Error;
use super::few_rays::{LandedRays, MANY_REPLICATES, Noise, RaySample};
use super::opening::{CellWeights, OpeningSum, Sensor, azimuth_deg, least_share, slope_shares};

/// Luminous intensities in cells over azimuth H and elevation V (type A angles: the polar axis is vertical).
#[derive(Clone, Debug)]
pub struct IntensityMap {
    /// Measured in radians of azimuth, and by the sine of the elevation: their product is a solid angle.
    h: CellAxis,
    v: CellAxis,
    /// Row after row, V slow: candela, its statistical and its geometric standard error.
    cells: Vec<[f64; 3]>,
    /// Whether the geometric errors are those of the cells; else nothing is known of what facets change.
    knows_facets: bool,
    /// What is known of the rays that made them.
    landed: Option<LandedRays>,
}

/// A value with both its errors, candela.
///
/// ```
/// // Errors of different causes add as squares.
/// let reading = lampyris::regulation::Reading { value: 1000.0, statistical: 3.0, geometric: Some(4.0), cells: 0.0 };
/// assert_eq!(reading.known_error(), 5.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// The value.
    pub value: f64,
    /// Standard error of the sampling.
    pub statistical: f64,
    /// Standard error of what facets change; `None` where that is not known.
    pub geometric: Option<f64>,
    /// Standard error of what the width of the map's cells leaves open: how light falls within one is not known.
    pub cells: f64,
}

impl Reading {
    /// Root of the sum of squares of the statistical and, where it is known, the geometric standard error: of what more rays and finer
    /// facets would reduce.
    pub fn known_error(&self) -> f64 {
        self.geometric.map_or(self.statistical, |geometric| self.statistical.hypot(geometric))
    }
}

/// Standard error of the slope within a cell, as a share of the range that it may lie in: three of them were not passed by beams of closed
/// form in cells of 0.0625° to 0.145°.
const SLOPE_ERROR: f64 = 0.75;

/// Standard errors of a change of slope that count as noise: what lies within is in the statistical error already.
const NOISE_OF_SLOPE: f64 = 2.0;

/// Bands of elevation in which the cells below a round sensor are weighed; a band's error is its share of the disc's rim, below 1e-3.
const DISC_BANDS: usize = 32;

impl IntensityMap {
    /// Makes a map of the edges of its cells (rising, degrees) and of each cell candela, its statistical and its geometric standard error,
    /// V slow.
    ///
    /// # Errors
    /// When the edges do not rise, the number of cells is another, or a value is no number.
    pub fn new(h_edges: Vec<f64>, v_edges: Vec<f64>, cells: Vec<[f64; 3]>) -> Result<Self, Error> {
        for (name, edges) in [("H", &h_edges), ("V", &v_edges)] {
            if edges.len() < 2 || !edges.windows(2).all(|e| e[0] < e[1]) {
                return Err(Error::invalid_map(format!("the edges of {name} do not rise")));
            }
        }
        let expected = (h_edges.len() - 1) * (v_edges.len() - 1);
        if cells.len() != expected {
            return Err(Error::invalid_map(format!("{} cells where the edges make {expected}", cells.len())));
        }
        if cells.iter().flatten().any(|x| !x.is_finite()) {
            return Err(Error::invalid_map("an intensity or an error is no finite number"));
        }
        let h = CellAxis::new(h_edges, f64::to_radians);
        let v = CellAxis::new(v_edges, |v| v.to_radians().sin());
        Ok(Self { h, v, cells, knows_facets: true, landed: None })
    }

    /// Forgets the geometric errors: the cells are of facets that were not compared with the spline, and no verdict on them is sure.
    pub fn without_geometric_errors(mut self) -> Self {
        self.cells.iter_mut().for_each(|[_, _, geometric]| *geometric = 0.0);
        self.knows_facets = false;
        self
    }

    /// Declares that the light was traced on the spline, so that facets change nothing of cells whose geometric errors were not known.
    pub fn of_spline(mut self) -> Self {
        self.knows_facets = true;
        self
    }

    /// Whether it is known what facets change of the cells.
    pub(super) fn knows_facets(&self) -> bool {
        self.knows_facets
    }

    /// Adds what is known of the rays that made the map: a reading of few of them is then judged by what may not have come. Errors of cells
    /// without light are not read.
    pub fn with_rays(mut self, sample: RaySample) -> Self {
        let cells =
            self.cells.iter().enumerate().map(|(k, [value, error, _])| [*value, *error, self.solid_angle(k)]);
        self.landed = Some(LandedRays::new(sample, self.h.cells(), cells));
        self
    }

    /// Solid angle of a cell, sr.
    fn solid_angle(&self, cell: usize) -> f64 {
        self.h.cell_measure(cell % self.h.cells()) * self.v.cell_measure(cell / self.h.cells())
    }

    /// The largest side of a cell, degrees.
    pub(super) fn coarsest_deg(&self) -> f64 {
        self.h.coarsest_deg().max(self.v.coarsest_deg())
    }

    /// Outer edges of the map, degrees: azimuths from and to, then elevations.
    pub(super) fn extent(&self) -> [[f64; 2]; 2] {
        [self.h.extent(), self.v.extent()]
    }

    /// The same light seen in a mirror, left for right.
    pub(super) fn mirrored(&self) -> Self {
        let cells = self.cells.chunks(self.h.cells()).flat_map(|row| row.iter().rev().copied()).collect();
        let knows_facets = self.knows_facets;
        let map = Self { h: self.h.mirrored(), v: self.v.clone(), cells, knows_facets, landed: None };
        match &self.landed {
            Some(landed) => map.with_rays(landed.sample),
            None => map,
        }
    }

    /// What a photometer aimed at `(h, v)`, degrees of the map, adds up: the mean over its opening, weighed by solid angle; within a cell
    /// that the opening covers in part light is taken to rise evenly from neighbour to neighbour. `None` where the opening leaves the map.
    pub(super) fn measure(&self, sensor: Sensor, h: f64, v: f64) -> Option<CellWeights> {
        let bands = if sensor.round { DISC_BANDS } else { 1 };
        let mut sum = OpeningSum::default();
        for band in 0..bands {
            // Bands of equal height; in a square opening all of it is one.
            let from = v + sensor.half_deg * (2.0 * band as f64 / bands as f64 - 1.0);
            let to = v + sensor.half_deg * (2.0 * (band + 1) as f64 / bands as f64 - 1.0);
            // The band's width at its middle.
            let offset = 0.5 * (from + to) - v;
            let half =
                if sensor.round { (sensor.half_deg.powi(2) - offset.powi(2)).sqrt() } else { sensor.half_deg };
            // By the elevation of the aim, not of the band: over an opening of a degree they hardly differ.
            let half = azimuth_deg(half, v);
            self.add_box(&mut sum, [h - half, h + half], [from, to])?;
        }
        Some(sum.mean())
    }

    /// The same of an opening with sides of its own, given by half of each, degrees across and up.
    pub(super) fn measure_slit(&self, half_deg: [f64; 2], [h, v]: [f64; 2]) -> Option<CellWeights> {
        let mut sum = OpeningSum::default();
        let half_h = azimuth_deg(half_deg[0], v);
        self.add_box(&mut sum, [h - half_h, h + half_h], [v - half_deg[1], v + half_deg[1]])?;
        Some(sum.mean())
    }

    /// Adds the cells in a box of azimuths and elevations, degrees; `None` where it leaves the map.
    fn add_box(&self, sum: &mut OpeningSum, h: [f64; 2], v: [f64; 2]) -> Option<()> {
        let (rows, columns) = (self.v.cells(), self.h.cells());
        let h_parts: Vec<Overlap> = self.h.overlaps(h[0], h[1])?.collect();
        for v_part in self.v.overlaps(v[0], v[1])? {
            for h_part in &h_parts {
                let weight = v_part.measure * h_part.measure;
                let cell = v_part.cell * columns + h_part.cell;
                sum.weights.add(cell, weight);
                sum.total += weight;
                // A cell is not as bright in the part that is covered as on its mean.
                let axes =
                    [((v_part.cell, rows, columns), v_part.offset), ((h_part.cell, columns, 1), h_part.offset)];
                let rise: f64 = axes.iter().map(|&(place, offset)| offset * self.rise(cell, place)).sum();
                let share = least_share(self.cells[cell][0], rise);
                for (place, offset) in axes {
                    self.add_slope(&mut sum.weights, cell, place, [weight * offset, share]);
                }
            }
        }
        Some(())
    }

    /// How far a photometer's opening aimed at `(h, v)` reaches beyond the sides of the map, degrees of azimuth.
    pub(super) fn beyond_sides(&self, sensor: Sensor, [h, v]: [f64; 2]) -> f64 {
        let [left, right] = self.h.extent();
        let half = azimuth_deg(sensor.half_deg, v);
        (left - (h - half)).max(h + half - right).max(0.0)
    }

    /// Returns how much brighter a cell gets over its width along an axis, cd, on which it has this place, of so many, and its neighbours
    /// are `step` cells off; none at the ends.
    fn rise(&self, cell: usize, (place, count, step): (usize, usize, usize)) -> f64 {
        if place == 0 || place + 1 == count {
            return 0.0;
        }
        let [below, here, above] = [cell - step, cell, cell + step].map(|cell| self.cells[cell][0]);
        let [a, b, c] = slope_shares([here - below, above - here]);
        a * below + b * here + c * above
    }

    /// Adds this share of `amount` times how much brighter a cell gets over its width along an axis, as [`Self::rise`] has it; what the
    /// width of the cell leaves open is that of the whole amount.
    fn add_slope(
        &self,
        weights: &mut CellWeights,
        cell: usize,
        (place, count, step): (usize, usize, usize),
        [amount, share]: [f64; 2],
    ) {
        if place == 0 || place + 1 == count || amount == 0.0 {
            return;
        }
        let cells = [cell - step, cell, cell + step];
        let [below, here, above] = cells.map(|cell| self.cells[cell][0]);
        let [before, after] = [here - below, above - here];
        if before == 0.0 && after == 0.0 {
            return;
        }
        // What rises evenly from cell to cell does so within them. Where it does not, the slope may lie anywhere between none and that
        // beyond which the cell would be brighter or darker somewhere than its neighbours are on the mean.
        let spread = cells.map(|cell| self.cells[cell][1]);
        let noise = NOISE_OF_SLOPE * spread[0].hypot(2.0 * spread[1]).hypot(spread[2]);
        let uneven = ((after - before).abs() - noise).max(0.0);
        weights.unresolved += amount.abs() * SLOPE_ERROR * uneven.min(2.0 * before.abs().min(after.abs()));
        let shares = slope_shares([before, after]);
        for (cell, of_cell) in cells.into_iter().zip(shares).filter(|(_, of_cell)| *of_cell != 0.0) {
            weights.add(cell, amount * share * of_cell);
        }
    }

    /// Reads cells of this map by their weights: its value and errors, cd. Statistical errors of cells are independent; those of
    /// the geometry push neighbours the same way, so that they add without sign.
    pub(super) fn read(&self, weights: &CellWeights) -> Reading {
        let mut value = 0.0;
        let mut variance = 0.0;
        let mut geometric = 0.0;
        for (cell, weight) in &weights.by_cell {
            let [i, s, g] = self.cells[*cell];
            value += weight * i;
            variance += (weight * self.spread(i, s)).powi(2);
            geometric += (weight * g).abs();
        }
        let geometric = self.knows_facets.then_some(geometric);
        Reading { value, statistical: variance.sqrt(), geometric, cells: weights.unresolved }
    }

    /// Reads the value of cells by their weights and its known error, cd, to which cells without light add what one ray would make.
    pub(super) fn read_with_dark(&self, weights: &CellWeights) -> [f64; 2] {
        let reading = self.read(weights);
        let is_dark = |cell: usize| self.cells[cell][0] <= 0.0 && self.landed.is_some();
        let dark = weights.by_cell.iter().filter(|(cell, _)| is_dark(*cell));
        let variance: f64 = dark.map(|(cell, weight)| (weight * self.cells[*cell][1]).powi(2)).sum();
        [reading.value, variance.sqrt().hypot(reading.known_error())]
    }

    /// The error of a cell as far as rays made it: none of a dark one, whose stated error is what one ray would make.
    fn spread(&self, value: f64, error: f64) -> f64 {
        if self.landed.is_some() && value <= 0.0 { 0.0 } else { error }
    }

    /// Returns how far the truth may lie from a reading that is `margin` cd from its limit: above it for a `sign` of 1, below for −1.
    pub(super) fn noise(&self, weights: &CellWeights, sign: f64, margin: f64, sigmas: f64) -> Noise {
        let replicates = self.landed.as_ref().map_or(u32::MAX, |landed| landed.sample.replicates);
        let (mut light, mut window) = (0.0, 0);
        let mut noise =
            Noise { ray_cd: 0.0, hidden: 0.0, hidden_ray_cd: 0.0, counted: 0.0, other: 0.0, replicates };
        for &(cell, weight) in &weights.by_cell {
            let [value, error, _] = self.cells[cell];
            let variance = (weight * self.spread(value, error)).powi(2);
            match &self.landed {
                // More rays here bring the reading nearer to what it might be.
                Some(landed) if sign * weight > 0.0 => {
                    let ray = landed.landing_ray(cell, margin, sigmas, &mut window);
                    noise.counted += variance;
                    let candela = |flux: f64| weight.abs() * flux / self.solid_angle(cell);
                    noise.ray_cd = noise.ray_cd.max(candela(ray.flux));
                    noise.hidden_ray_cd = noise.hidden_ray_cd.max(candela(ray.heaviest));
                    noise.hidden += weight.abs() * ray.hidden;
                }
                _ => noise.other += variance,
            }
            if sign * weight > 0.0 {
                light += weight.abs() * value.max(0.0);
            }
        }
        // A few replicates may agree by chance: then the count of rays says more than their spread.
        if replicates < MANY_REPLICATES {
            noise.counted = noise.counted.max(light * noise.ray_cd);
        }
        noise
    }
}

#[cfg(test)]
impl IntensityMap {
    /// The same cells with a value and a statistical error of each that `noise` makes of its value.
    pub(super) fn with_noise(mut self, mut noise: impl FnMut(f64) -> [f64; 2]) -> Self {
        for cell in &mut self.cells {
            let [value, statistical] = noise(cell[0]);
            *cell = [value, statistical, 0.0];
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edges(from: f64, to: f64, cells: usize) -> Vec<f64> {
        (0..=cells).map(|k| from + (to - from) * k as f64 / cells as f64).collect()
    }

    /// Cells of 0.1° whose intensity is linear in H and V.
    fn linear() -> IntensityMap {
        let (h, v) = (edges(-5.0, 5.0, 100), edges(-3.0, 3.0, 60));
        let middle = |e: &[f64], k: usize| 0.5 * (e[k] + e[k + 1]);
        let cells = (0..60).flat_map(|j| (0..100).map(move |i| (i, j)));
        let cells = cells.map(|(i, j)| [100.0 + 10.0 * middle(&h, i) + middle(&v, j), 2.0, 0.5]).collect();
        IntensityMap::new(h.clone(), v.clone(), cells).unwrap()
    }

    /// At a cut-off, which is as sharp as cells are fine, cells of one brightness would blur the edge: by 9 % of the reading on the mean
    /// and by up to 37 %.
    #[test]
    fn a_cut_off_is_read_within_its_cells() {
        let (hot, glare, sharpness) = (18_000.0, 200.0, 0.05);
        // ∫ hot / (1 + e^(v/g)) dv = hot · (v − g · ln(1 + e^(v/g))).
        let integral = |v: f64| hot * (v - sharpness * (v / sharpness).exp().ln_1p()) + glare * v;
        let mean = |from: f64, to: f64| (integral(to) - integral(from)) / (to - from);
        let (h, v) = (edges(-1.0, 1.0, 20), edges(-2.0, 2.0, 40));
        let cells = v.windows(2).flat_map(|e| std::iter::repeat_n([mean(e[0], e[1]), 0.0, 0.0], 20)).collect();
        let map = IntensityMap::new(h, v.clone(), cells).unwrap();
        let sensor = Sensor { half_deg: 0.0745, round: false };
        let places: Vec<f64> = (0..100).map(|k| -0.6 + 0.012 * f64::from(k)).collect();
        let errors = places.iter().map(|v| {
            let read = map.read(&map.measure(sensor, 0.03, *v).unwrap());
            let truth = mean(v - sensor.half_deg, v + sensor.half_deg);
            assert!((read.value - truth).abs() <= 3.0 * read.cells + 1e-9 * truth, "{read:?} for {truth} at {v}");
            read.value / truth - 1.0
        });
        let (squares, largest) = errors.fold((0.0, 0.0f64), |(s, l), e| (s + e * e, l.max(e.abs())));
        let mean_square = (squares / places.len() as f64).sqrt();
        assert!(mean_square < 0.05 && largest < 0.2, "{mean_square} {largest}");
    }

    #[test]
    fn a_sensor_reads_the_mean_of_its_opening() {
        let map = linear();
        for round in [false, true] {
            let sensor = Sensor { half_deg: 0.0745, round };
            for (h, v) in [(0.0, 0.0), (1.23, -0.57), (-3.43, 0.57)] {
                let reading = map.read(&map.measure(sensor, h, v).unwrap());
                // What rises evenly is read where the opening is, but for cells that are smaller towards the poles.
                assert!((reading.value - (100.0 + 10.0 * h + v)).abs() < 1e-3, "{reading:?}");
                // Slopes between neighbours have errors of their own.
                assert!(
                    reading.statistical < 2.0 && (0.5 - 1e-12..0.8).contains(&reading.geometric.unwrap()),
                    "{reading:?}"
                );
            }
        }
        // Exactly one cell.
        let one = map.read(&map.measure(Sensor { half_deg: 0.05, round: false }, 0.05, 0.05).unwrap());
        assert!((one.value - 100.55).abs() < 1e-9 && (one.statistical - 2.0).abs() < 1e-6);
        assert!(map.measure(Sensor { half_deg: 0.05, round: false }, 5.0, 0.0).is_none());
    }

    #[test]
    fn a_difference_of_one_cell_with_itself_has_no_error() {
        let map = linear();
        let sensor = Sensor { half_deg: 0.05, round: false };
        let here = map.measure(sensor, 0.05, 0.05).unwrap();
        let none = map.read(&here.clone().plus(-1.0, &here));
        assert!(none.value.abs() < 1e-12 && none.statistical < 1e-12);
        let there = map.measure(sensor, 1.05, 0.05).unwrap();
        let two = map.read(&here.plus(-1.0, &there));
        // The opening is wider than its cell by 1/cos 0.05°, 4e-7 on either side.
        assert!((two.statistical - 8f64.sqrt()).abs() < 1e-5);
    }

    #[test]
    fn a_mirrored_map_has_left_for_right() {
        let map = linear();
        let sensor = Sensor { half_deg: 0.05, round: false };
        let read = |m: &IntensityMap, h: f64| m.read(&m.measure(sensor, h, 0.05).unwrap()).value;
        assert!((read(&map.mirrored(), 2.05) - read(&map, -2.05)).abs() < 1e-9);
    }
}

//! What facets change of the cells of a receiver: of each alone or with its neighbours, of the brightest, of all together.
//!
//! The square of a measured difference exceeds that of the true one by its variance, so sums of `d² − s²` over many cells reveal a
//! geometric error that no single cell could.

use super::paired::{Paired, SIGNIFICANT};
use super::replicates::{ReplicateSums, ReplicatedRun};
use crate::math::units::SQUARE_METRE;
use crate::math::{error_of_sum, variance_of_sum};
use crate::simulate::BoundScene;
use serde::Serialize;

/// Rays that the brightest square of cells holds at least: one of this many is known within 7 % alone, and its change better.
const PEAK_RAYS: f64 = 200.0;
/// Rays of a square of cells above which it is divided into four, where they can be judged apart.
const POOLED_RAYS: f64 = 256.0;

/// What facets change of all cells together, as shares of the root of the sum of their squares.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MapError {
    /// Root of the sum of the squares of the cells' differences, their noise taken away.
    pub geometric: f64,
    /// What that may be by chance alone.
    pub noise: f64,
    /// Root of the sum of the squares of the cells' standard errors, from these rays alone.
    pub statistical: f64,
}

/// The brightest place of a receiver.
pub(super) struct Peak {
    /// Its density, in the receiver's unit.
    pub(super) density: Paired,
    /// Cells a side that it was taken over.
    pub(super) cells: usize,
    /// Standard error of one cell there, in the receiver's unit.
    pub(super) statistical: f64,
}

/// One cell on facets and on the spline, in quanta.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cell {
    pub(super) facets: f64,
    pub(super) spline: f64,
    /// Sum over replicates of the squares of their differences, then the variance of the whole difference.
    pub(super) difference_variance: f64,
    /// Sum of the squares of the spline's replicates, then the variance of the spline's cell.
    pub(super) spline_variance: f64,
}

impl Cell {
    /// Returns how much more the cell got on facets than on the spline, quanta.
    fn difference(&self) -> f64 {
        self.facets - self.spline
    }

    /// Returns the square of the difference less what noise adds to it on average, quanta²; may be negative.
    fn excess(&self) -> f64 {
        self.difference().powi(2) - self.difference_variance
    }
}

/// A rectangle of cells, cut off at the sides of the grid.
#[derive(Clone, Copy)]
struct Block {
    x: usize,
    y: usize,
    size: [usize; 2],
}

impl Block {
    /// Makes the column (`axis` 0) or the row (1) at a place of a grid of so many cells.
    fn line(axis: usize, place: usize, grid: [usize; 2]) -> Self {
        if axis == 0 {
            Self { x: place, y: 0, size: [1, grid[1]] }
        } else {
            Self { x: 0, y: place, size: [grid[0], 1] }
        }
    }

    /// Makes a square of `side` cells a side whose first cell is in column `x` and row `y`.
    fn square(x: usize, y: usize, side: usize) -> Self {
        Self { x, y, size: [side; 2] }
    }

    /// Whether it has the cell of column `x` and row `y`.
    fn contains(&self, x: usize, y: usize) -> bool {
        (self.x..self.x + self.size[0]).contains(&x) && (self.y..self.y + self.size[1]).contains(&y)
    }
}

/// The cells of a receiver in two runs of the same rays.
pub(super) struct CellPairs<'r> {
    grid: [usize; 2],
    /// Rows or columns of cells that are slivers of one direction, a pole.
    poles: Vec<Block>,
    cells: Vec<Cell>,
    /// The cells of power, whose quanta give the number of rays; `None` where the layer's own do, as it is not weighted.
    power: Option<Vec<Cell>>,
    /// Quanta of a ray of the mean power.
    ray: f64,
    /// From quanta to the receiver's unit, cell by cell; 0 for cells off a disc, where no light is counted.
    unit: Vec<f64>,
    /// The inverse of that, and 0 too off a disc.
    measure: Vec<f64>,
    /// Of the run on facets, then on the spline.
    replicates: [Vec<&'r ReplicateSums>; 2],
    /// 0 for power, then the further channels.
    layer: usize,
}

impl<'r> CellPairs<'r> {
    /// Pairs the cells of receiver `k`, of power for `layer` 0 or of a further channel; `None` where there are too many to be kept apart.
    pub(super) fn new(bound: &BoundScene, runs: [&'r ReplicatedRun; 2], k: usize, layer: usize) -> Option<Self> {
        let (receiver, result) = (&bound.receivers[k], &runs[1].results.receivers[k]);
        let replicates = runs.map(|run| run.replicates.iter().filter_map(|r| r.get(k)).collect::<Vec<_>>());
        let grid = result.grid;
        let cells_of_layer = |layer: usize| {
            let sums = |r: &'r ReplicateSums| r.layers.get(layer).map(Vec::as_slice);
            let pairs = replicates[0].iter().zip(&replicates[1]).map(|(a, b)| Some([sums(a)?, sums(b)?]));
            Some(paired_cells(grid[0] * grid[1], &pairs.collect::<Option<Vec<_>>>()?))
        };
        let worth = if layer == 0 { 1.0 } else { receiver.channels.worth() };
        let power = if worth == 1.0 { None } else { Some(cells_of_layer(0)?) };
        let cells = cells_of_layer(layer)?;
        // Lux and W/m² of cells in mm².
        let scale = if result.kind == "far_field" { 1.0 } else { SQUARE_METRE };
        let results = &runs[1].results;
        // A power of two, which rounding of the quotient must not blur.
        let ray =
            2f64.powi((results.power.emitted / (results.rays as f64 * results.quantum)).log2().round() as i32);
        let quantum = results.quantum * worth;
        let per_measure = |m: f64| if m > 0.0 { quantum * scale / m } else { 0.0 };
        let unit: Vec<f64> =
            (0..cells.len()).map(|c| per_measure(receiver.measure(c % grid[0], c / grid[0]))).collect();
        let rings = result.pole_rings();
        let places = rings.poles().into_iter().flatten();
        let poles = places.map(|place| Block::line(rings.polar_axis(), place, grid)).collect();
        let measure = unit.iter().map(|u| if *u > 0.0 { 1.0 / u } else { 0.0 }).collect();
        Some(Self { grid, poles, cells, power, ray, unit, measure, replicates, layer })
    }

    /// Goes through the indices of the cells of a block, as far as the grid goes.
    fn cells_of(&self, block: Block) -> impl Iterator<Item = usize> + '_ {
        let [nx, ny] = self.grid;
        let [width, height] = block.size;
        let rows = block.y..(block.y + height).min(ny);
        rows.flat_map(move |y| (block.x..(block.x + width).min(nx)).map(move |x| y * nx + x))
    }

    /// Returns the side, cells, of the smallest square that covers the grid and has a power of two of them a side.
    fn covering_side(&self) -> usize {
        self.grid[0].max(self.grid[1]).next_power_of_two()
    }

    /// Returns the square of `side` cells that is brightest by `quanta`, of those side by side from the first corner, and its density; of
    /// single cells those around a pole are one, as in the figure that is printed. Squares wholly off a disc are left out.
    fn brightest(&self, side: usize, quanta: impl Fn(&Cell) -> f64) -> (Block, f64) {
        let corners =
            (0..self.grid[1]).step_by(side).flat_map(|y| (0..self.grid[0]).step_by(side).map(move |x| (x, y)));
        let poles = if side == 1 { self.poles.as_slice() } else { &[] };
        let is_at_pole = |x: usize, y: usize| poles.iter().any(|ring| ring.contains(x, y));
        let squares = corners.filter(|&(x, y)| !is_at_pole(x, y)).map(|(x, y)| Block::square(x, y, side));
        let on_receiver = squares
            .chain(poles.iter().copied())
            .map(|b| (b, self.measure_of(b)))
            .filter(|(_, measure)| *measure > 0.0);
        let brought = |block: Block| self.cells_of(block).map(|c| quanta(&self.cells[c])).sum::<f64>();
        let blocks = on_receiver.map(|(block, measure)| (block, brought(block) / measure));
        blocks.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((Block::square(0, 0, side), 0.0))
    }

    /// Returns what the quanta of a block are divided by for its density in the receiver's unit; 0 where all of it is off a disc.
    fn measure_of(&self, block: Block) -> f64 {
        self.cells_of(block).map(|c| self.measure[c]).sum()
    }

    /// Finds the brightest place of each run, over the smallest squares of cells that hold [`PEAK_RAYS`] on the spline, and compares them
    /// wherever they are.
    pub(super) fn peak(&self) -> Peak {
        // Power is counted in quanta: as many make one ray of the mean power.
        let rays = |block: Block| self.cells_of(block).map(|c| self.cells[c].spline).sum::<f64>() / self.ray;
        let mut side = 1;
        let (mut block, mut spline) = self.brightest(side, |c| c.spline);
        while rays(block) < PEAK_RAYS && side < self.covering_side() {
            side *= 2;
            (block, spline) = self.brightest(side, |c| c.spline);
        }
        // Facets may have their brightest place elsewhere: places are compared by how bright they are.
        let (on_facets, facets) = self.brightest(side, |c| c.facets);
        let measures = [on_facets, block].map(|block| self.measure_of(block));
        let by_replicate = |run: usize, block: Block| {
            let (nx, layer) = (self.grid[0], self.layer);
            let within = move |c: usize| block.contains(c % nx, c / nx);
            let sum = move |s: &&ReplicateSums| {
                s.layers[layer].iter().filter(|(c, _)| within(*c as usize)).map(|(_, q)| *q as f64).sum::<f64>()
            };
            self.replicates[run].iter().map(move |s| sum(s) / measures[run])
        };
        let differences = by_replicate(0, on_facets).zip(by_replicate(1, block)).map(|(a, b)| a - b);
        let noise = error_of_sum(&differences.collect::<Vec<_>>());
        // Facets may blur what is finer than the square: counted where it is beyond what noise makes of it.
        let unit = |c: usize| self.unit[c];
        let count = self.cells_of(block).count().max(1) as f64;
        let excess: f64 = self.cells_of(block).map(|c| self.cells[c].excess() * unit(c).powi(2)).sum();
        let chance: f64 =
            self.cells_of(block).map(|c| 2.0 * (self.cells[c].difference_variance * unit(c).powi(2)).powi(2)).sum();
        let blurred = ((excess - SIGNIFICANT * chance.sqrt()).max(0.0) / count).sqrt();
        let variance: f64 = self.cells_of(block).map(|c| self.cells[c].spline_variance * unit(c).powi(2)).sum();
        let density = Paired { facets, spline, error: if side > 1 { noise.hypot(blurred) } else { noise } };
        // A ring about a pole is one place, which is known as well as all its cells together.
        let places = if block.size == [side; 2] { count } else { count * count };
        Peak { density, cells: side.min(self.grid[0].max(self.grid[1])), statistical: (variance / places).sqrt() }
    }

    /// Compares all cells together, as shares of the root of the sum of the spline's squares.
    pub(super) fn map(&self) -> MapError {
        let sum = |of: &dyn Fn(&Cell) -> f64| self.cells.iter().map(of).sum::<f64>();
        let norm = sum(&|c| c.spline * c.spline).sqrt().max(1.0);
        MapError {
            // A sum that noise made negative means that nothing was found.
            geometric: sum(&Cell::excess).max(0.0).sqrt() / norm,
            // The variance of a squared normal deviation is twice the square of its variance.
            noise: sum(&|c| 2.0 * c.difference_variance.powi(2)).powf(0.25) / norm,
            statistical: sum(&|c| c.spline_variance).sqrt() / norm,
        }
    }

    /// Returns the estimated geometric error of each cell, row by row and in the unit of the receiver or channel, and the side, in cells,
    /// of the largest square that shares one error because its rays were few; a cell whose own rays show a larger error has that. What
    /// noise is left after pooling is in it; squares without rays have 0. Cells around a pole are one place, and have the error of their
    /// mean.
    pub(super) fn cell_errors(&self) -> (Vec<f64>, usize) {
        let mut layer = vec![0.0; self.cells.len()];
        let mut pooled = 1;
        let mut stack = vec![Block::square(0, 0, self.covering_side())];
        while let Some(block) = stack.pop() {
            let quanta = |of: fn(&Cell) -> f64| self.cells_of(block).map(|c| of(&self.cells[c])).sum::<f64>();
            let counted = self.power.as_ref().unwrap_or(&self.cells);
            let power = |of: fn(&Cell) -> f64| self.cells_of(block).map(|c| of(&counted[c])).sum::<f64>();
            // A quantum of a weighted channel is a small part of one of power: its own would be taken for far fewer rays.
            let rays = power(|c| c.facets).max(power(|c| c.spline)) / self.ray;
            if rays == 0.0 {
                continue;
            }
            // Where rays are many a block is parted in four; where they are few its cells stay pooled, so that their noise averages.
            let whole_side = block.size[0];
            if rays > POOLED_RAYS && whole_side > 1 {
                let side = whole_side / 2;
                let quarters = [(0, 0), (side, 0), (0, side), (side, side)];
                stack.extend(quarters.map(|(dx, dy)| Block::square(block.x + dx, block.y + dy, side)));
                continue;
            }
            let count = self.cells_of(block).count().max(1) as f64;
            pooled = pooled.max(whole_side.min(self.grid[0].max(self.grid[1])));
            let excess = quanta(Cell::excess) / count;
            let mean = quanta(Cell::difference) / count;
            let noise = quanta(|c| c.difference_variance) / (count * count);
            // The mean of a square of cells may say more than their scatter, where all err the same way.
            let shared = excess.max(mean * mean);
            for c in self.cells_of(block) {
                // Where facets fold light they move it by whole cells: the few that lose or gain it err by more than their neighbours.
                layer[c] = (shared.max(self.cells[c].excess()) + noise).sqrt() * self.unit[c];
            }
        }
        for &pole in &self.poles {
            let ring = || self.cells_of(pole);
            let difference: f64 = ring().map(|c| self.cells[c].difference()).sum();
            let variance: f64 = ring().map(|c| self.cells[c].difference_variance).sum();
            let error = difference.hypot(variance.sqrt()) / ring().count() as f64;
            ring().for_each(|c| layer[c] = error * self.unit[c]);
        }
        (layer, pooled)
    }
}

/// Sums up `count` cells from the pairs of what each replicate brought on facets and on the spline: lists of cell and quanta that rise by
/// cell.
pub(super) fn paired_cells(count: usize, replicates: &[[&[(u32, u64)]; 2]]) -> Vec<Cell> {
    let mut cells = vec![Cell::default(); count];
    for [facets, spline] in replicates {
        add_replicate(&mut cells, facets, spline);
    }
    for c in &mut cells {
        c.difference_variance = variance_of_sum(c.difference_variance, c.difference(), replicates.len());
        c.spline_variance = variance_of_sum(c.spline_variance, c.spline, replicates.len());
    }
    cells
}

/// Adds what one replicate of both runs brought, lists of cell and quanta that rise by cell, to the sums of the cells.
fn add_replicate(cells: &mut [Cell], facets: &[(u32, u64)], spline: &[(u32, u64)]) {
    // Both lists rise: they are merged like two sorted files.
    let (mut a, mut b) = (facets.iter().peekable(), spline.iter().peekable());
    loop {
        let cell = match (a.peek(), b.peek()) {
            (None, None) => break,
            (Some((c, _)), None) | (None, Some((c, _))) => *c,
            (Some((c, _)), Some((d, _))) => *c.min(d),
        };
        let f = a.next_if(|(c, _)| *c == cell).map_or(0.0, |(_, q)| *q as f64);
        let s = b.next_if(|(c, _)| *c == cell).map_or(0.0, |(_, q)| *q as f64);
        let sum = &mut cells[cell as usize];
        sum.facets += f;
        sum.spline += s;
        sum.difference_variance += (f - s) * (f - s);
        sum.spline_variance += s * s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of sixteen slivers each second one got ten rays more on facets, and ten fewer in the other replicate, but for one: their mean is as
    /// uncertain as sixteen such cells together, in a row as in a column.
    #[test]
    fn cells_around_a_pole_have_the_error_of_their_mean() {
        let quanta = 1u64 << 40;
        let list = |more: [u64; 2]| (0..16).map(|c| (c, (100 + more[c as usize % 2]) * quanta)).collect::<Vec<_>>();
        let sums = |cells| ReplicateSums { layers: vec![cells], ..ReplicateSums::default() };
        let facets = [sums(list([10, 0])), sums(list([1, 11]))];
        let spline = [sums(list([0, 10])), sums(list([10, 0]))];
        let pairs: Vec<_> =
            facets.iter().zip(&spline).map(|(a, b)| [a.layers[0].as_slice(), b.layers[0].as_slice()]).collect();
        for (axis, grid) in [(1, [16, 1]), (0, [1, 16])] {
            let pairs = CellPairs {
                grid,
                poles: vec![Block::line(axis, 0, grid)],
                cells: paired_cells(16, &pairs),
                power: None,
                ray: quanta as f64,
                unit: vec![1.0; 16],
                measure: vec![1.0; 16],
                replicates: [facets.iter().collect(), spline.iter().collect()],
                layer: 0,
            };
            let (errors, _) = pairs.cell_errors();
            // All got one ray more, with a variance of 2 · (10² + 9² − ½) and 2 · (10² + 11² − ½) rays.
            let error = (16f64.powi(2) + 8.0 * (361.0 + 441.0)).sqrt() / 16.0;
            assert!(errors.iter().all(|e| (e / quanta as f64 / error - 1.0).abs() < 1e-12), "{errors:?}");
            // The ring is one place, as well known as its cells together.
            let variance: f64 = pairs.cells.iter().map(|c| c.spline_variance).sum();
            let peak = pairs.peak();
            assert!((peak.statistical / (variance.sqrt() / 16.0) - 1.0).abs() < 1e-12, "{}", peak.statistical);
            assert_eq!(peak.cells, 1);
        }
    }

    /// A disc of 4 × 4 cells whose corners lie off it: 300 rays in one cell of the spline, none on facets.
    #[test]
    fn a_disc_that_is_dark_on_facets_lacks_all_its_light() {
        let quanta = 300 * (1u64 << 40);
        let sums = |cells: Vec<(u32, u64)>| ReplicateSums { layers: vec![cells], ..ReplicateSums::default() };
        let dark = vec![sums(Vec::new()); 2];
        let lit = vec![sums(vec![(5, quanta / 2)]), sums(vec![(5, quanta / 2)])];
        let lists = |sums: &[ReplicateSums]| sums.iter().map(|s| s.layers[0].clone()).collect::<Vec<_>>();
        let (facets, spline) = (lists(&dark), lists(&lit));
        let pairs: Vec<_> = facets.iter().zip(&spline).map(|(a, b)| [a.as_slice(), b.as_slice()]).collect();
        let measure: Vec<f64> = (0..16).map(|c| if [0, 3, 12, 15].contains(&c) { 0.0 } else { 1.0 }).collect();
        let pairs = CellPairs {
            grid: [4; 2],
            poles: Vec::new(),
            cells: paired_cells(16, &pairs),
            power: None,
            ray: (1u64 << 40) as f64,
            unit: measure.clone(),
            measure,
            replicates: [dark.iter().collect(), lit.iter().collect()],
            layer: 0,
        };
        let density = pairs.peak().density;
        assert_eq!((density.facets, density.spline, density.error), (0.0, quanta as f64, 0.0));
        assert!(density.is_significant());
    }
}

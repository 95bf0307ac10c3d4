//! Faces of a model that shine: points drawn by area on the spline.

use super::cover::Cover;
use super::stream::{RayIndex, Stream};
use crate::math::{FaceId, Frame, Point, Uv, Vector};
use crate::model::{Face, Model};
use crate::nurbs::Surface;
use crate::simulate::trim_loops::TrimRegion;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Cells across a face in each parameter, at least.
const CELLS: usize = 32;
/// Most of them: a face of more knots has several to a cell.
const MOST_CELLS: usize = 256;
/// By how much a piece between knots may be wider than a cell, as a share of it, for its rounding.
const ROUNDED_WIDTH: f64 = 1e-9;

/// Bound of the area element in a cell, over the largest of nine samples of it.
const BOUND_MARGIN: f64 = 1.2;
/// Places of the samples along a cell, as shares of it: the last one is just before its end, where the next piece of the spline begins.
const SAMPLES: [f64; 3] = [0.0, 0.5, 1.0 - 1e-6];

/// Attempts at a point inside the trims. A face of which less than 1/1000 lies inside them would be a sliver.
const MOST_ATTEMPTS: u32 = 10_000;

/// Faces of a model that shine evenly: points are drawn by area on the spline, inside the trims and where nothing opaque lies against them.
///
/// A cell is drawn by a bound of its area, a point in it by rejection. The bound is [`BOUND_MARGIN`] times the largest of 9 samples
/// of the area element; where a surface bends more than that inside 1/32 of a face, the density is too low by the excess. Cells end at
/// the knots of the spline: between even ones a piece much longer than its neighbours, as the straight of a polyline with arcs, may have
/// no sample at all. They lie over the trims alone.
#[derive(Clone, Debug)]
pub(crate) struct Area {
    faces: Vec<LuminousFace>,
    /// Bounds of area up to and including each cell, face by face.
    sums: Vec<f64>,
}

/// A face that emits, at its place.
#[derive(Clone, Debug)]
struct LuminousFace {
    id: FaceId,
    face: Face,
    placement: Frame,
    region: TrimRegion,
    /// Borders of its cells in both parameters.
    borders: [Vec<f64>; 2],
    /// Place of its first cell among those of all faces.
    first: usize,
    /// Bound of `|Su × Sv|` in each cell.
    bounds: Vec<f64>,
    /// Opaque faces that may lie against it.
    covers: Vec<Arc<Cover>>,
}

/// How much of a luminous face is covered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CoveredArea {
    pub(crate) face: FaceId,
    /// Its area, and the part of it that nothing opaque lies against, mm², both from the same samples.
    pub(crate) whole: f64,
    pub(crate) free: f64,
}

impl LuminousFace {
    /// Returns the lower corner and the size of cell `k` in spline parameters.
    fn cell(&self, k: usize) -> [Uv; 2] {
        let [u, v] = &self.borders;
        let (i, j) = (k / (v.len() - 1), k % (v.len() - 1));
        let corner = Uv::new(u[i], v[j]);
        [corner, Uv::new(u[i + 1], v[j + 1]) - corner]
    }

    /// Number of its cells.
    fn cell_count(&self) -> usize {
        (self.borders[0].len() - 1) * (self.borders[1].len() - 1)
    }

    /// Returns the area in the scene per unit of spline parameters, mm²; 0 at a pole.
    fn area_element(&self, uv: Uv) -> f64 {
        let d = self.face.surface.derivatives(uv);
        d.du.cross(d.dv).length() * self.placement.scale.powi(2)
    }

    /// Returns a point in the scene, mm, and the unit outward normal there.
    fn point_and_normal(&self, uv: Uv) -> (Point, Vector) {
        // At a pole, a point without area, the spline may have no normal.
        let normal = self.face.surface.normal(uv).unwrap_or(Vector::Z);
        let outward = if self.face.reversed { -normal } else { normal };
        (self.placement.point(self.face.surface.evaluate(uv)), self.placement.normal(outward).normalize())
    }

    /// Whether no opaque face lies against a point of it, given in spline parameters; trims are not checked.
    fn is_free(&self, uv: Uv) -> bool {
        let (point, normal) = self.point_and_normal(uv);
        !self.covers.iter().any(|cover| cover.covers(point, normal))
    }

    /// Measures how much of it is covered, by the middles of its cells.
    fn measure_cover(&self) -> CoveredArea {
        let mut area = CoveredArea { face: self.id, whole: 0.0, free: 0.0 };
        for k in 0..self.cell_count() {
            let [corner, size] = self.cell(k);
            let uv = corner + size * 0.5;
            if self.region.contains(uv) {
                let element = self.area_element(uv) * size.x * size.y;
                area.whole += element;
                area.free += if self.is_free(uv) { element } else { 0.0 };
            }
        }
        area
    }
}

/// Returns the ranges of both parameters that hold the trims of a face: those of the surface where it has none.
fn trimmed_ranges(surface: &Surface, region: &TrimRegion) -> [[f64; 2]; 2] {
    let domain = surface.domain();
    let Some([low, high]) = region.bounds() else { return domain };
    let trimmed = [[low.x, high.x], [low.y, high.y]];
    [0, 1].map(|k| {
        let range = trimmed[k].map(|x| x.clamp(domain[k][0], domain[k][1]));
        if range[0] < range[1] { range } else { domain[k] }
    })
}

/// Returns the borders of cells along a direction of a surface, 0 for u and 1 for v, from one parameter to another: at all knots between,
/// unless they are very many, and so near that no cell is wider than 1/32 of the way. A curved piece has two cells at least.
fn cell_borders(surface: &Surface, direction: usize, [from, to]: [f64; 2]) -> Vec<f64> {
    let widest = (to - from) / CELLS as f64 * (1.0 + ROUNDED_WIDTH);
    let least = surface.degree[direction].min(2);
    let knots: Vec<f64> =
        surface.breakpoints(direction).into_iter().filter(|knot| from < *knot && *knot < to).collect();
    let every = (least * knots.len()).div_ceil(MOST_CELLS).max(1);
    let mut borders = vec![from];
    let mut start = from;
    for end in knots.into_iter().step_by(every).chain([to]) {
        let pieces = ((end - start) / widest).ceil().max(least as f64) as usize;
        borders.extend((1..pieces).map(|k| start + (end - start) * (k as f64 / pieces as f64)));
        borders.push(end);
        start = end;
    }
    borders
}

impl Area {
    /// Prepares the chosen faces (indices of placed faces), each with the opaque faces that may lie against it; `None` when none of them
    /// has a spline surface with area. Ready meshes are skipped.
    pub(crate) fn new(model: &Model, chosen: &[usize], covers: &HashMap<usize, Vec<Arc<Cover>>>) -> Option<Self> {
        let chosen: HashSet<usize> = chosen.iter().copied().collect();
        let mut faces = Vec::new();
        let mut sums = Vec::new();
        let mut sum = 0.0;
        for f in model.placed_faces().filter(|f| chosen.contains(&f.id.index())) {
            // Ready meshes have no spline to draw points on.
            let Some(face) = f.face else { continue };
            let (id, placement, region) = (f.id, *f.placement, TrimRegion::new(face));
            let covers = covers.get(&id.index()).cloned().unwrap_or_default();
            let ranges = trimmed_ranges(&face.surface, &region);
            let borders = [0, 1].map(|direction| cell_borders(&face.surface, direction, ranges[direction]));
            let (face, first, bounds) = (face.clone(), sums.len(), Vec::new());
            let mut luminous = LuminousFace { id, face, placement, region, borders, first, bounds, covers };
            for k in 0..luminous.cell_count() {
                let [low, size] = luminous.cell(k);
                // What the trims leave out of a cell costs attempts; a patch may be a thousandth of its surface.
                if !luminous.region.may_reach(low, low + size) {
                    luminous.bounds.push(0.0);
                    sums.push(sum);
                    continue;
                }
                let samples = (0..9).map(|i| Uv::new(SAMPLES[i / 3], SAMPLES[i % 3]));
                // Area per parameter, the rejection's bound: sampled on a grid of three by three, and raised by a margin for what lies
                // between.
                let largest = samples.map(|s| luminous.area_element(low + size * s)).fold(0.0, f64::max);
                luminous.bounds.push(BOUND_MARGIN * largest);
                sum += BOUND_MARGIN * largest * size.x * size.y;
                sums.push(sum);
            }
            faces.push(luminous);
        }
        (sum > 0.0 && sum.is_finite()).then_some(Self { faces, sums })
    }

    /// Measures of each face how much of it is covered.
    pub(crate) fn measure_cover(&self) -> Vec<CoveredArea> {
        self.faces.iter().map(LuminousFace::measure_cover).collect()
    }

    /// Draws a point (mm, scene coordinates), its unit outward normal and its face. Where no attempt of [`MOST_ATTEMPTS`] was accepted, the
    /// last one is returned, which may lie outside the trims or be covered.
    pub(crate) fn point(&self, stream: &Stream, index: RayIndex) -> (Point, Vector, FaceId) {
        let whole = self.sums[self.sums.len() - 1];
        let mut last = None;
        for attempt in 0..MOST_ATTEMPTS {
            // The first try takes the pair of the low-discrepancy sequence, which then covers the area evenly; further ones are
            // independent, and their pairs, from 10 on, are the area's alone.
            let [u, v] = if attempt == 0 { stream.pair(index, 0) } else { stream.random(index, 2 * attempt + 10) };
            let at = u * whole;
            let cell = self.sums.partition_point(|s| *s <= at).min(self.sums.len() - 1);
            let low = if cell == 0 { 0.0 } else { self.sums[cell - 1] };
            let luminous = &self.faces[self.faces.partition_point(|face| face.first <= cell) - 1];
            let own_cell = cell - luminous.first;
            let [corner, size] = luminous.cell(own_cell);
            // What is left of u within its cell is uniform again and serves as the coordinate.
            let s = ((at - low) / (self.sums[cell] - low)).clamp(0.0, 1.0);
            let uv = corner + size * Uv::new(s, v);
            last = Some((luminous, uv));
            let [keep, _] = stream.random(index, 2 * attempt + 11);
            let bound = luminous.bounds[own_cell];
            // Rejection makes uniform in parameters into uniform in area.
            let accepted = luminous.region.contains(uv) && keep * bound <= luminous.area_element(uv);
            if accepted && luminous.is_free(uv) {
                break;
            }
        }
        let Some((luminous, uv)) = last else { return (Point::ZERO, Vector::Z, FaceId(0)) };
        let (point, normal) = luminous.point_and_normal(uv);
        (point, normal, luminous.id)
    }
}

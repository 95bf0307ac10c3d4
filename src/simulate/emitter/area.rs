//! Faces of a model that shine: points drawn by area on the spline.

use super::cover::Cover;
use super::stream::{RayIndex, Stream};
use crate::math::{FaceId, Frame, Point, Uv, Vector};
use crate::model::{Face, Model};
use crate::simulate::trim_loops::TrimRegion;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Cells across a face in each parameter.
const CELLS: usize = 32;

/// Bound of the area element in a cell, over the largest of nine samples of it.
const BOUND_MARGIN: f64 = 1.2;

/// Attempts at a point inside the trims. A face of which less than 1/1000 lies inside them would be a sliver.
const MOST_ATTEMPTS: u32 = 10_000;

/// Faces of a model that shine evenly: points are drawn by area on the spline, inside the trims and where nothing opaque lies against them.
///
/// A cell is drawn by a bound of its area, a point in it by rejection. The bound is [`BOUND_MARGIN`] times the largest of 9 samples
/// of the area element; where a surface bends more than that inside 1/32 of a face, the density is too low by the excess.
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
        let [[u0, u1], [v0, v1]] = self.face.surface.domain();
        let size = Uv::new(u1 - u0, v1 - v0) / CELLS as f64;
        [Uv::new(u0, v0) + size * Uv::new((k / CELLS) as f64, (k % CELLS) as f64), size]
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

    /// Whether no opaque face lies against a point of it, given in spline parameters; trims are not asked.
    fn is_free(&self, uv: Uv) -> bool {
        let (point, normal) = self.point_and_normal(uv);
        !self.covers.iter().any(|cover| cover.covers(point, normal))
    }

    /// Measures how much of it is covered, by the middles of its cells.
    fn measure_cover(&self) -> CoveredArea {
        let mut area = CoveredArea { face: self.id, whole: 0.0, free: 0.0 };
        for k in 0..CELLS * CELLS {
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
            let mut luminous =
                LuminousFace { id, face: face.clone(), placement, region, bounds: Vec::new(), covers };
            for k in 0..CELLS * CELLS {
                let [low, size] = luminous.cell(k);
                let samples = (0..9).map(|i| Uv::new((i / 3) as f64, (i % 3) as f64) * 0.5);
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
            let luminous = &self.faces[cell / (CELLS * CELLS)];
            let [corner, size] = luminous.cell(cell % (CELLS * CELLS));
            // What is left of u within its cell is uniform again and serves as the coordinate.
            let s = ((at - low) / (self.sums[cell] - low)).clamp(0.0, 1.0);
            let uv = corner + size * Uv::new(s, v);
            last = Some((luminous, uv));
            let [keep, _] = stream.random(index, 2 * attempt + 11);
            let bound = luminous.bounds[cell % (CELLS * CELLS)];
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

//! Where in space a curved facet is near: there alone a ray that starts at no surface must look for facets behind its start.
//!
//! A facet behind the start may stand for a piece of spline ahead of it, but only where it is curved, as a flat one lies on the spline.
//! Chips, boards and windows are flat, and light starts a hundredth of a millimetre over them: each of its rays found the chip behind it,
//! and was traced on the facets a second time.

use super::facet_record::FacetRecord;
use super::limits::LEAST_SLACK_SINE;
use crate::math::{Aabb, Point, Vector};
use crate::mesh::FacetMesh;

/// Cells along each axis: 32 kB of bits, found once for each mesh.
const CELLS: usize = 64;
/// Cells marked a facet, and in all besides, before every cell counts as near: a second at most for a million facets.
const MOST_MARKED_OF_FACET: usize = 100;
const MOST_MARKED: usize = 16 * CELLS * CELLS * CELLS;
/// A facet of no more sag, mm, is flat: ten times what the proof of a plane of 1 m leaves for rounding.
pub(super) const FLAT_SAG: f32 = 1e-8;
/// How far behind its start a ray that is near no curved facet looks, mm: twice [`FLAT_SAG`] at the least sine by which that is lengthened.
pub(super) const LOOK_BACK_OF_FLAT: f64 = 2.0 * FLAT_SAG as f64 / LEAST_SLACK_SINE;

/// Cells of space, each marked if a curved facet may lie within a reach of a place in it.
pub(super) struct CurvedCells {
    /// Around all curved facets, and the reach.
    bounds: Aabb,
    /// Cells per mm.
    density: Vector,
    /// One bit a cell, along x first.
    marks: Vec<u64>,
}

impl CurvedCells {
    /// Marks the cells within `reach`, mm, of the boxes around the curved facets of the mesh that `records` are of.
    pub(super) fn of_mesh(mesh: &FacetMesh, records: &[FacetRecord], reach: f64) -> Self {
        let box_of = |f: usize| Aabb::from_points(mesh.corners(f)).grown(reach);
        let curved = || (0..mesh.facets.len()).filter(|&f| records[f].sag > FLAT_SAG);
        let bounds = curved().map(box_of).fold(Aabb::EMPTY, |all, b| all.union(b));
        let mut cells =
            Self { bounds, density: CELLS as f64 / bounds.size(), marks: vec![0; CELLS * CELLS * CELLS / 64] };
        let mut marked = 0;
        for f in curved() {
            let b = box_of(f);
            // Rounding is the same here and where a place is looked up, and keeps the order.
            let (low, high) = (cells.cell(b.min), cells.cell(b.max));
            marked += (0..3).map(|axis| high[axis] - low[axis] + 1).product::<usize>();
            // Long facets across the grid, each in half of all cells: then no cell is distinguished.
            if marked > MOST_MARKED_OF_FACET * records.len() + MOST_MARKED {
                cells.marks.fill(u64::MAX);
                break;
            }
            for z in low[2]..=high[2] {
                for y in low[1]..=high[1] {
                    for x in low[0]..=high[0] {
                        let (word, bit) = place_of_mark([x, y, z]);
                        cells.marks[word] |= 1 << bit;
                    }
                }
            }
        }
        cells
    }

    /// The cell of a place, by axis, the outermost one for places beyond.
    #[inline(always)]
    fn cell(&self, place: Point) -> [usize; 3] {
        let at = (place - self.bounds.min) * self.density;
        at.to_array().map(|x| (x as usize).min(CELLS - 1))
    }

    /// Whether a curved facet may lie within the reach of a place; `true` says nothing.
    #[inline(always)]
    pub(super) fn may_be_near(&self, place: Point) -> bool {
        if !self.bounds.contains(place) {
            return false;
        }
        let (word, bit) = place_of_mark(self.cell(place));
        self.marks[word] >> bit & 1 == 1
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.marks)
    }
}

/// The word of [`CurvedCells::marks`] that holds the mark of a cell, and its bit there.
#[inline(always)]
fn place_of_mark([x, y, z]: [usize; 3]) -> (usize, usize) {
    let bit = (z * CELLS + y) * CELLS + x;
    (bit / 64, bit % 64)
}

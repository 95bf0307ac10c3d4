//! Growing the tree: cells split at their middle, facets clipped to the cells they meet.

use super::cell::{Cell, ClippedFacet, bounds};
use super::clip::{Box32, clip};
use super::pack::pack;
use super::{Settings, Statistics};
use crate::intersect::facet::is_usable;
use crate::math::Point;
use crate::mesh::FacetMesh;
use rayon::prelude::*;

/// What cuts of facets in f64 may be wrong by, relative to the largest coordinate: some hundred roundings over six planes.
const CUT_ERROR: f64 = 1e-13;

/// Share of its longest side below which a side of a cell is not halved. With a half, as of a cube at the root, rays in lamps that are
/// three times as long as they are thick took 5 % longer.
const THIN: f32 = 0.125;

/// What stays the same over the whole tree.
struct Subdivision<'a> {
    mesh: &'a FacetMesh,
    /// Middle of the mesh, which all boxes are relative to.
    center: Point,
    /// As in [`Settings`].
    threshold: usize,
    max_depth: u32,
    max_duplication: f64,
    /// What clipped boxes are grown by, mm.
    pad: f64,
}

/// Below this many facets a cell is grown by one thread.
const PARALLEL: usize = 2048;
/// Facets a thread sorts into octants at a time.
const CHUNK: usize = 16384;

/// Divides all usable facets into a tree of cells relative to `center`; `None` when there are none. Sets `stats.left_out` to the number
/// of facets with a corner that is not finite or beyond 1e12 mm.
pub(super) fn subdivide(
    mesh: &FacetMesh,
    center: Point,
    settings: &Settings,
    stats: &mut Statistics,
) -> Option<Cell> {
    let facets: Vec<ClippedFacet> = (0..mesh.facets.len())
        .into_par_iter()
        .filter_map(|f| {
            let corners = mesh.corners(f);
            let clipped =
                || ClippedFacet { facet: f as u32, bounds: Box32::bounding(&corners.map(|p| p - center)) };
            corners.iter().all(|&p| is_usable(p)).then(clipped)
        })
        .collect();
    stats.left_out = mesh.facets.len() - facets.len();
    if facets.is_empty() {
        return None;
    }
    let cell = bounds(&facets);
    let reach = cell.low.iter().chain(&cell.high).fold(0f32, |m, x| m.max(x.abs()));
    let subdivision = Subdivision {
        mesh,
        center,
        threshold: settings.threshold.max(1),
        max_depth: settings.max_depth.min(32),
        max_duplication: settings.max_duplication,
        pad: f64::from(reach) * CUT_ERROR,
    };
    Some(subdivision.make_cell(facets, cell, 0, 1.0))
}

impl Subdivision<'_> {
    /// Makes the cell of these facets, at least one: divided into octants as long as that parts them, else packed. `duplication` is how
    /// often facets have been duplicated on the way here.
    fn make_cell(&self, facets: Vec<ClippedFacet>, cell: Box32, depth: u32, duplication: f64) -> Cell {
        let n = facets.len();
        if n <= self.threshold || depth >= self.max_depth || duplication > self.max_duplication {
            return pack(facets);
        }
        let middle = self.split_point(&cell);
        let octants = self.split_facets(&facets, &middle);
        let total: usize = octants.iter().map(Vec::len).sum();
        let largest = octants.iter().map(Vec::len).fold(0, usize::max);
        // No progress: one octant still meets all while others meet some too, or all meet nearly everything.
        if (largest == n && total > n) || total >= 4 * n || (n < 64 && total >= 3 * n) {
            return pack(facets);
        }
        let bounds = bounds(&facets);
        drop(facets);
        let duplication = duplication * total as f64 / n as f64;
        let inner = |(octant, facets): (usize, Vec<ClippedFacet>)| {
            let mut cell = cell;
            for a in 0..3 {
                if octant >> a & 1 == 0 { cell.high[a] = middle[a] } else { cell.low[a] = middle[a] }
            }
            (!facets.is_empty()).then(|| self.make_cell(facets, cell, depth + 1, duplication))
        };
        let mut cells: Vec<Cell> = if n > PARALLEL {
            octants.into_par_iter().enumerate().filter_map(inner).collect()
        } else {
            octants.into_iter().enumerate().filter_map(inner).collect()
        };
        if cells.len() == 1
            && let Some(only) = cells.pop()
        {
            return only;
        }
        Cell::of_cells(bounds, cells)
    }

    /// The point where a cell is split. Along an axis where it is thin that is its end, so that all facets go to the lower side: halving
    /// the thickness of flat scenes with each level cut the facets of an array of lenses into six pieces each.
    fn split_point(&self, cell: &Box32) -> [f32; 3] {
        let extent = |a: usize| cell.high[a] - cell.low[a];
        let longest = extent(0).max(extent(1)).max(extent(2));
        std::array::from_fn(|a| {
            if extent(a) > THIN * longest { 0.5 * (cell.low[a] + cell.high[a]) } else { cell.high[a] }
        })
    }

    /// The parts of facets in each octant about `middle`, in the order of the facets; bit `a` of an octant's index is its upper side
    /// along axis `a`.
    fn split_facets(&self, facets: &[ClippedFacet], middle: &[f32; 3]) -> [Vec<ClippedFacet>; 8] {
        if facets.len() <= CHUNK {
            // A surface mostly meets four octants of a cell.
            let mut octants: [Vec<ClippedFacet>; 8] = std::array::from_fn(|_| Vec::with_capacity(facets.len() / 4));
            for facet in facets {
                self.distribute(facet, middle, &mut octants);
            }
            return octants;
        }
        let pieces: Vec<[Vec<ClippedFacet>; 8]> =
            facets.par_chunks(CHUNK).map(|chunk| self.split_facets(chunk, middle)).collect();
        std::array::from_fn(|k| {
            let mut octant = Vec::with_capacity(pieces.iter().map(|p| p[k].len()).sum());
            for piece in &pieces {
                octant.extend_from_slice(&piece[k]);
            }
            octant
        })
    }

    /// Adds a facet, clipped, to the lists of the octants that it meets; one that lies in a wall goes to the lower side alone.
    fn distribute(&self, facet: &ClippedFacet, middle: &[f32; 3], octants: &mut [Vec<ClippedFacet>; 8]) {
        let Box32 { low, high } = facet.bounds;
        // Bit 0: meets the lower half, bit 1: the upper.
        let sides: [u8; 3] = std::array::from_fn(|a| {
            if high[a] <= middle[a] {
                1
            } else if low[a] >= middle[a] {
                2
            } else {
                3
            }
        });
        if !sides.contains(&3) {
            let octant: usize = (0..3).map(|a| usize::from(sides[a] >> 1) << a).sum();
            octants[octant].push(*facet);
            return;
        }
        let mut corners = self.mesh.corners(facet.facet as usize);
        for p in &mut corners {
            *p -= self.center;
        }
        for (octant, inside) in octants.iter_mut().enumerate() {
            let mut cell = facet.bounds;
            let mut meets = true;
            for a in 0..3 {
                let upper = octant >> a & 1 == 1;
                meets &= sides[a] & (1 << usize::from(upper)) != 0;
                if sides[a] == 3 {
                    if upper { cell.low[a] = middle[a] } else { cell.high[a] = middle[a] }
                }
            }
            if meets && let Some(bounds) = clip(&corners, &cell, self.pad) {
                inside.push(ClippedFacet { facet: facet.facet, bounds });
            }
        }
    }
}

//! Growing the tree: cells split at their middle, facets clipped to the cells they meet.

use super::clip::{Box32, clip};
use super::pack::pack;
use super::{Settings, Statistics};
use crate::intersect::facet::is_usable;
use crate::math::Point;
use crate::mesh::FacetMesh;
use rayon::prelude::*;

/// A facet in a cell, with the box around its part inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub(super) facet: u32,
    pub(super) bounds: Box32,
}

/// A cell with something in it.
#[derive(Debug)]
pub(super) struct Cell {
    pub(super) bounds: Box32,
    pub(super) content: Content,
}

#[derive(Debug)]
pub(super) enum Content {
    /// Up to four facets; the count, then the facets.
    Block(u8, [u32; 4]),
    Cells(Vec<Cell>),
}

/// What stays the same over the whole tree.
pub(super) struct Grower<'a> {
    mesh: &'a FacetMesh,
    center: Point,
    threshold: usize,
    max_depth: u32,
    max_duplication: f64,
    pad: f64,
}

/// Below this many facets a cell is grown by one thread.
const PARALLEL: usize = 2048;
/// Facets a thread sorts into octants at a time.
const CHUNK: usize = 16384;

/// The tree of cells over all facets, `None` when there are none.
pub(super) fn grow(mesh: &FacetMesh, center: Point, settings: &Settings, stats: &mut Statistics) -> Option<Cell> {
    let parts: Vec<Part> = (0..mesh.facets.len())
        .into_par_iter()
        .filter_map(|f| {
            let corners = mesh.corners(f);
            let part = || Part { facet: f as u32, bounds: Box32::around(&corners.map(|p| p - center)) };
            corners.iter().all(|&p| is_usable(p)).then(part)
        })
        .collect();
    stats.left_out = mesh.facets.len() - parts.len();
    if parts.is_empty() {
        return None;
    }
    let cell = bounds(&parts);
    let reach = cell.low.iter().chain(&cell.high).fold(0f32, |m, x| m.max(x.abs()));
    let grower = Grower {
        mesh,
        center,
        threshold: settings.threshold.max(1),
        max_depth: settings.max_depth.min(32),
        max_duplication: settings.max_duplication,
        pad: f64::from(reach) * 1e-13,
    };
    Some(grower.grow(parts, cell, 0, 1.0))
}

/// The box around all parts.
pub(super) fn bounds(parts: &[Part]) -> Box32 {
    let mut all = Box32::EMPTY;
    for p in parts {
        all.union(&p.bounds);
    }
    all
}

impl Grower<'_> {
    fn grow(&self, parts: Vec<Part>, cell: Box32, depth: u32, duplication: f64) -> Cell {
        let n = parts.len();
        if n <= self.threshold || depth >= self.max_depth || duplication > self.max_duplication {
            return pack(parts);
        }
        let middle: [f32; 3] = std::array::from_fn(|a| 0.5 * (cell.low[a] + cell.high[a]));
        let octants = self.split(&parts, &middle);
        let total: usize = octants.iter().map(Vec::len).sum();
        let largest = octants.iter().map(Vec::len).max().unwrap_or(0);
        // No progress: one octant still meets all while others meet some too, or all meet nearly everything.
        if (largest == n && total > n) || total >= 4 * n || (n < 64 && total >= 3 * n) {
            return pack(parts);
        }
        let bounds = bounds(&parts);
        drop(parts);
        let duplication = duplication * total as f64 / n as f64;
        let inner = |(octant, parts): (usize, Vec<Part>)| {
            let mut cell = cell;
            for a in 0..3 {
                if octant >> a & 1 == 0 { cell.high[a] = middle[a] } else { cell.low[a] = middle[a] }
            }
            (!parts.is_empty()).then(|| self.grow(parts, cell, depth + 1, duplication))
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
        Cell { bounds, content: Content::Cells(cells) }
    }

    fn split(&self, parts: &[Part], middle: &[f32; 3]) -> [Vec<Part>; 8] {
        if parts.len() <= CHUNK {
            let mut octants: [Vec<Part>; 8] = Default::default();
            for part in parts {
                self.sort_in(part, middle, &mut octants);
            }
            return octants;
        }
        let pieces: Vec<[Vec<Part>; 8]> = parts.par_chunks(CHUNK).map(|chunk| self.split(chunk, middle)).collect();
        std::array::from_fn(|k| {
            let mut octant = Vec::with_capacity(pieces.iter().map(|p| p[k].len()).sum());
            for piece in &pieces {
                octant.extend_from_slice(&piece[k]);
            }
            octant
        })
    }

    /// Puts a part into the octants it meets; one that lies in a wall goes to the lower side alone.
    fn sort_in(&self, part: &Part, middle: &[f32; 3], octants: &mut [Vec<Part>; 8]) {
        let Box32 { low, high } = part.bounds;
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
            octants[octant].push(*part);
            return;
        }
        let corners = self.mesh.corners(part.facet as usize).map(|p| p - self.center);
        for (octant, inside) in octants.iter_mut().enumerate() {
            let mut cell = part.bounds;
            let mut meets = true;
            for a in 0..3 {
                let upper = octant >> a & 1 == 1;
                meets &= sides[a] & (1 << usize::from(upper)) != 0;
                if sides[a] == 3 {
                    if upper { cell.low[a] = middle[a] } else { cell.high[a] = middle[a] }
                }
            }
            if meets && let Some(bounds) = clip(&corners, &cell, self.pad) {
                inside.push(Part { facet: part.facet, bounds });
            }
        }
    }
}

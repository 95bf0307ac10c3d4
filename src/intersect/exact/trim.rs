//! Inside or outside of a trimmed face: a grid of decided cells over the domain, and curve by curve where a trim passes.
//!
//! The test counts crossings of a half-line towards +u with pieces monotone in v whose joints are bit-equal, so it has one
//! answer for every point, however close to a curve. Uses that pass within `band` mm are named.

use super::edge_use::{EdgeUse, edge_uses};
use super::piece_lists::PieceLists;
use super::tolerances::FLAGGED_OF_GAP;
use super::trim_cutting::trim_pieces;
use super::trim_piece::{TrimPiece, TrimPieces};
use crate::intersect::prefetch;
use crate::math::Uv;
use crate::math::quadrature::GAUSS;
use crate::model::Face;
use smallvec::SmallVec;

/// Share of a cell by which a rectangle is kept wider than its cells, so that rounding takes no point into one beyond.
const CELL_ROUNDING: f64 = 1e-6;
/// Share of the loops' extent by which the grid is larger than they are.
const GRID_MARGIN: f64 = 1e-3;
/// Cells keep so many bands off a trim: a ray that grazes a face at a sine down to 1/64 has its root within the band of the edge as
/// it sees it.
const REACH_OF_BAND: f64 = 64.0;
/// The least share of the domain that cells keep off a trim: parameters in files have nine digits.
const LEAST_REACH: f64 = 1e-9;
/// The largest share of the domain that cells keep off a trim: with more, none would be decided.
const LARGEST_REACH: f64 = 1e-2;

/// Loops that enclose less than this share of the box around them, turns either way taken off one another, are none that cut holes: a loop
/// like an eight has rounding for a sign.
const NO_AREA: f64 = 1e-12;

/// What a cell or rectangle of the domain is; `Border` where it is not decided as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Region {
    Inside,
    Outside,
    Border,
}

/// Where a point of the domain lies.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub(super) inside: bool,
    /// The uses within the band.
    pub(super) near: SmallVec<[Near; 2]>,
}

/// A use of an edge near a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    /// Index into [`Trim::uses`].
    pub(super) owner: u32,
    /// The edge's parameter at the nearest point, and the surface's.
    pub(super) parameter: f64,
    pub(super) uv: Uv,
    /// mm.
    pub(super) distance: f64,
}

/// The trimming of one face.
#[derive(Debug)]
pub(super) struct Trim {
    pieces: TrimPieces,
    /// What pieces belong to; they name it by its index.
    pub(super) uses: Vec<EdgeUse>,
    /// Low corner of the grid of cells.
    origin: Uv,
    /// Whether the grid ends before the domain does, at the low and the high end of u, and of v: beyond is outside.
    ends: [[bool; 2]; 2],
    /// Cells per unit of u and v.
    density: Uv,
    /// Cells along u and v; they are listed along u first.
    count: [usize; 2],
    cells: Vec<Region>,
    /// Pieces that touch each row and rise or fall, for the parity.
    rows: PieceLists,
    /// Pieces near each border cell, by cell index.
    near: PieceLists,
    /// The state far away: inside when the loops only cut holes.
    outside_is_inside: bool,
    /// Whether the domain is whole: no loops at all.
    pub(super) whole: bool,
}

impl Trim {
    /// Prepares the trims of a face: in which directions its surface is `closed`, the widest band of any place where its part stands, and
    /// the gap of each edge of its part, both lengths in the units of the part. Without loops the face is whole.
    pub(super) fn new(face: &Face, closed: [bool; 2], part_band: f64, gaps: &[f64]) -> Self {
        let [[u0, u1], [v0, v1]] = face.surface.domain();
        let extent = Uv::new(u1 - u0, v1 - v0);
        let segments: usize = face.loops.iter().flat_map(|l| &l.uses).map(|u| u.uv.points.len()).sum();
        // Fine enough that most cells are decided, coarse enough to stay in a cache.
        let n = match segments {
            0 => 1,
            1..=24 => 24,
            25..=200 => 48,
            _ => 96,
        };
        let uses = edge_uses(face, closed, gaps);
        let widest = uses.iter().map(|u| u.gap).fold(0.0, f64::max);
        let reach = cell_margin(face, extent, part_band.max(FLAGGED_OF_GAP * widest));
        let ([lo, hi], ends) = grid_bounds(face, reach);
        let cell = (hi - lo) / n as f64;
        let mut trim = Self {
            pieces: trim_pieces(face, cell),
            uses,
            origin: lo,
            ends,
            density: Uv::ONE / cell,
            count: [n, n],
            cells: vec![Region::Inside; n * n],
            rows: PieceLists::default(),
            near: PieceLists::default(),
            outside_is_inside: false,
            whole: false,
        };
        if trim.pieces.len() == 0 {
            trim.whole = true;
            return trim;
        }
        // Outer loops run counterclockwise and holes clockwise: a negative sum says that there are holes alone, and
        // the face goes on to the ends of the domain.
        trim.outside_is_inside = trim.signed_area() < -NO_AREA * (hi - lo).element_product();
        if trim.outside_is_inside {
            // Holes alone: what lies around them counts too.
            let cell = extent / n as f64;
            trim.pieces = trim_pieces(face, cell);
            (trim.origin, trim.density, trim.ends) = (Uv::new(u0, v0), Uv::ONE / cell, Default::default());
        }
        trim.fill_cells(reach);
        trim
    }

    /// The widest of the gaps along its edges, in the units of the part; 0 without edges.
    pub(super) fn widest_gap(&self) -> f64 {
        self.uses.iter().map(|u| u.gap).fold(0.0, f64::max)
    }

    /// Signed area within the loops in parameters, negative where they run clockwise: by Green's theorem along every piece, for chords of
    /// two circles of a thin ring may sweep less by the outer one.
    fn signed_area(&self) -> f64 {
        // About the grid's corner: far from the origin of the parameters the products would cancel.
        let swept = |piece: TrimPiece<'_>| {
            let along = |(t, weight): (f64, f64)| {
                let (place, derivative) = piece.evaluate(t);
                weight * (place - self.origin).perp_dot(derivative)
            };
            0.5 * GAUSS.map(along).into_iter().sum::<f64>()
        };
        self.pieces.iter().map(|p| if p.is_reversed() { -swept(p) } else { swept(p) }).sum()
    }

    /// The cells of an axis that an interval meets, held to the grid.
    fn cell_range(&self, lo: f64, hi: f64, d: usize) -> std::ops::RangeInclusive<usize> {
        let at = |x: f64| (((x - self.origin[d]) * self.density[d]).max(0.0) as usize).min(self.count[d] - 1);
        at(lo)..=at(hi)
    }

    /// Decides the cells that no piece of a trim comes within `reach` of, in u and v, and lists the pieces of the others and of rows.
    fn fill_cells(&mut self, reach: Uv) {
        let (mut rows, mut near) = (Vec::new(), Vec::new());
        for (k, piece) in (0u32..).zip(self.pieces.iter()) {
            // Flat pieces cross no half-line towards +u.
            if !piece.is_level() {
                let [low, high] = piece.v_range();
                rows.extend(self.cell_range(low - reach.y, high + reach.y, 1).map(|j| (j as u32, k)));
            }
            for [min, max] in piece.boxes(Uv::ONE / self.density) {
                let (lo, hi) = (min - reach, max + reach);
                for j in self.cell_range(lo.y, hi.y, 1) {
                    for i in self.cell_range(lo.x, hi.x, 0) {
                        near.push(((j * self.count[0] + i) as u32, k));
                    }
                }
            }
        }
        (self.rows, self.near) = (PieceLists::new(rows), PieceLists::new(near));
        for &cell in &self.near.keys {
            self.cells[cell as usize] = Region::Border;
        }
        for j in 0..self.count[1] {
            let middle = |i: usize| self.origin + Uv::new(i as f64 + 0.5, j as f64 + 0.5) / self.density;
            // Crossings of the row's middle height, once for all its cells.
            let v = middle(0).y;
            let spanning = self.rows.pieces_of(j as u32).iter().map(|&k| self.pieces.get(k)).filter(|p| p.spans(v));
            let mut crossings: Vec<f64> = spanning.map(|p| p.u_at(v)).collect();
            crossings.sort_by(f64::total_cmp);
            for i in 0..self.count[0] {
                let cell = j * self.count[0] + i;
                // A cell that no trim comes near has one answer for all its points: that of its middle.
                if self.cells[cell] != Region::Border {
                    // Even–odd: what the half-line towards +u crosses an odd number of times is inside.
                    let right = crossings.len() - crossings.partition_point(|&u| u <= middle(i).x);
                    let inside = (right % 2 == 1) != self.outside_is_inside;
                    self.cells[cell] = if inside { Region::Inside } else { Region::Outside };
                }
            }
        }
    }

    /// Whether `q`, which lies in a border cell, is inside, as [`Self::locate`] says too: no certificate hangs on a polished root, so that
    /// no edge near it is looked up, nor the metric that this needs.
    #[inline(never)]
    pub(super) fn is_inside(&self, q: Uv) -> bool {
        self.parity(q, *self.cell_range(q.y, q.y, 1).start())
    }

    /// Bytes that it holds.
    pub(super) fn bytes(&self) -> usize {
        let lists = self.rows.bytes() + self.near.bytes();
        size_of_val(self) + self.pieces.bytes() + size_of_val(&*self.uses) + self.cells.len() + lists
    }

    /// Whether a point lies inside, by the pieces of its row that the half-line towards +u crosses.
    fn parity(&self, q: Uv, row: usize) -> bool {
        let crossings = self.rows.pieces_of(row as u32).iter().filter(|&&k| self.pieces.get(k).crosses(q)).count();
        (crossings % 2 == 1) != self.outside_is_inside
    }

    /// Whether a point lies beyond a side of the grid where the domain goes on, so that it is outside.
    fn is_beyond(&self, q: Uv) -> bool {
        (0..2).any(|d| {
            let x = (q[d] - self.origin[d]) * self.density[d];
            self.ends[d][0] && x < 0.0 || self.ends[d][1] && x > self.count[d] as f64
        })
    }

    /// Shrinks a rectangle of the domain to a part that holds all of it that is not outside; `None` when all is.
    pub(super) fn bounds_within(&self, rect: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
        if self.whole {
            return Some(rect);
        }
        let [us, vs] = [0, 1].map(|d| self.cell_range(rect[d][0], rect[d][1], d));
        let (mut lo, mut hi) = ([usize::MAX; 2], [0; 2]);
        for j in vs.clone() {
            let row = &self.cells[j * self.count[0]..][us.clone()];
            let counts = |c: &Region| *c != Region::Outside;
            let (Some(first), Some(last)) = (row.iter().position(counts), row.iter().rposition(counts)) else {
                continue;
            };
            (lo[0], hi[0]) = (lo[0].min(us.start() + first), hi[0].max(us.start() + last));
            (lo[1], hi[1]) = (lo[1].min(j), hi[1].max(j));
        }
        if lo[0] == usize::MAX {
            return None;
        }
        // A little more, so that rounding takes no point into a cell beyond; and the first and last cells hold what the
        // domain has beyond the grid unless it ends there.
        let place = |d: usize, cell: f64| self.origin[d] + cell / self.density[d];
        let kept = [0, 1].map(|d: usize| {
            let [a, b] = rect[d];
            let low = if lo[d] == 0 && !self.ends[d][0] { a } else { place(d, lo[d] as f64 - CELL_ROUNDING) };
            let last = self.count[d] - 1;
            let high =
                if hi[d] == last && !self.ends[d][1] { b } else { place(d, hi[d] as f64 + 1.0 + CELL_ROUNDING) };
            [a.max(low), b.min(high)]
        });
        kept.iter().all(|[a, b]| a < b).then_some(kept)
    }

    /// What a rectangle of the domain is: inside or outside only when all its cells are, else `Border`.
    pub(super) fn region(&self, [u, v]: [[f64; 2]; 2]) -> Region {
        if self.whole {
            return Region::Inside;
        }
        // A rectangle that reaches beyond the grid holds something that is outside.
        let beyond = [[u[0], v[0]], [u[1], v[1]]].map(|[u, v]| self.is_beyond(Uv::new(u, v)));
        let mut found = beyond.contains(&true).then_some(Region::Outside);
        for j in self.cell_range(v[0], v[1], 1) {
            for i in self.cell_range(u[0], u[1], 0) {
                let cell = self.cells[j * self.count[0] + i];
                if cell == Region::Border || found.is_some_and(|f| f != cell) {
                    return Region::Border;
                }
                found = Some(cell);
            }
        }
        found.unwrap_or(Region::Border)
    }

    /// What the cell that holds a point of the domain is; outside where that lies beyond the grid and the domain goes on.
    #[inline]
    pub(super) fn cell_at(&self, q: Uv) -> Region {
        if self.is_beyond(q) {
            return Region::Outside;
        }
        let [i, j] = [0, 1].map(|d| *self.cell_range(q[d], q[d], d).start());
        self.cells[j * self.count[0] + i]
    }

    /// Prefetches the memory of the cell that holds `q`.
    #[inline(always)]
    pub(super) fn fetch_cell(&self, q: Uv) {
        let [i, j] = [0, 1].map(|d| *self.cell_range(q[d], q[d], d).start());
        prefetch(&self.cells, j * self.count[0] + i);
    }

    /// Whether `q`, which lies in a border cell, is inside, and what uses pass within `band` mm, each at its nearest point; `metric` as for
    /// [`TrimPiece::nearest`].
    pub(super) fn locate(&self, q: Uv, metric: [f64; 3], band: f64) -> Place {
        let [i, j] = [0, 1].map(|d| *self.cell_range(q[d], q[d], d).start());
        let cell = j * self.count[0] + i;
        // How far a millimetre reaches in u and v: from the inverse of the metric.
        let determinant = (metric[0] * metric[2] - metric[1] * metric[1]).max(f64::MIN_POSITIVE);
        let reach = band * Uv::new((metric[2] / determinant).sqrt(), (metric[0] / determinant).sqrt());
        let mut near: SmallVec<[Near; 2]> = SmallVec::new();
        // A box test first: the nearest point takes iterations.
        for &k in self.near.pieces_of(cell as u32) {
            let piece = self.pieces.get(k);
            let is_beyond = |x: f64, [low, high]: [f64; 2], reach: f64| x < low - reach || x > high + reach;
            if is_beyond(q.x, piece.u_range(), reach.x) || is_beyond(q.y, piece.v_range(), reach.y) {
                continue;
            }
            let (t, distance) = piece.nearest(q, metric);
            if distance > band {
                continue;
            }
            let (owner, parameter) = (piece.owner(), piece.edge_parameter(t));
            let found = Near { owner, parameter, uv: piece.evaluate(t).0, distance };
            // An edge comes in several pieces; its nearest one is where the search on the edge itself begins.
            match near.iter_mut().find(|n| n.owner == owner) {
                Some(n) if distance < n.distance => *n = found,
                Some(_) => {}
                None => near.push(found),
            }
        }
        Place { inside: self.parity(q, j), near }
    }
}

/// The rectangle over which cells are laid: around the loops as far as `reach`, within the domain; and which of its
/// sides end before the domain does.
fn grid_bounds(face: &Face, reach: Uv) -> ([Uv; 2], [[bool; 2]; 2]) {
    let domain = face.surface.domain();
    let whole = [0, 1].map(|end| Uv::new(domain[0][end], domain[1][end]));
    let points = face.loops.iter().flat_map(|l| &l.uses).flat_map(|u| &u.uv.points);
    let (mut lo, mut hi) = (Uv::INFINITY, Uv::NEG_INFINITY);
    for p in points {
        let at = p.truncate() / p.z;
        (lo, hi) = (lo.min(at), hi.max(at));
    }
    let margin = reach + GRID_MARGIN * (hi - lo);
    let (lo, hi) = ((lo - margin).max(whole[0]), (hi + margin).min(whole[1]));
    // Loops without extent leave no rectangle to divide: cells are laid over the whole domain.
    if !(lo.x < hi.x && lo.y < hi.y) {
        return (whole, Default::default());
    }
    ([lo, hi], [0, 1].map(|d| [lo[d] > whole[0][d], hi[d] < whole[1][d]]))
}

/// How far, in u and v, a cell must keep from a trimming curve to be decided: [`REACH_OF_BAND`] bands as if parameters ran evenly along the
/// longest row of control points, held between [`LEAST_REACH`] and [`LARGEST_REACH`] of the domain. No proof where parameters run more
/// unevenly than that, or a face is so short that the largest holds.
fn cell_margin(face: &Face, extent: Uv, part_band: f64) -> Uv {
    let [nu, nv] = face.surface.counts();
    let point = |i: usize, j: usize| face.surface.points[i * nv + j].project();
    let longest = |outer: usize, inner: usize, at: &dyn Fn(usize, usize) -> crate::math::Point| {
        (0..outer)
            .map(|a| (1..inner).map(|b| at(a, b).distance(at(a, b - 1))).sum::<f64>())
            .fold(f64::MIN_POSITIVE, f64::max)
    };
    let along_u = longest(nv, nu, &|j, i| point(i, j));
    let along_v = longest(nu, nv, &|i, j| point(i, j));
    // As if parameters ran evenly along the longest row of control points. Clamped: of a face of no length the margin would be
    // infinite, of a huge one below the digits of its parameters.
    let relative = |length: f64| (REACH_OF_BAND * part_band / length).clamp(LEAST_REACH, LARGEST_REACH);
    Uv::new(extent.x * relative(along_u), extent.y * relative(along_v))
}

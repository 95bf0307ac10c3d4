//! The tree over the parameter rectangle: cells are halved across the direction that bends more until they fit.
//!
//! Cuts fall on preferred parameters, so that neighbouring cells and the border line up; between these they halve. A cell is kept whole
//! when it is clear of the border, or when the border runs along its sides, corner on sample.

use super::candidate_facet::CandidateFacet;
use super::cell::{Cell, ProvedCell, Subdivision, parameter_resolution};
use super::preferred_cuts::preferred_cuts;
use crate::math::{Enclosure, Uv};
use crate::tessellate::border::polygons::{BorderPolygons, BorderSide};
use crate::tessellate::face_surface::FaceSurface;
use crate::tessellate::proof::pole;
use crate::tessellate::proof::prover::Prover;
use crate::tessellate::settings::Acceptance;

/// Part of a cell's size that it must keep from the border.
const CLEARANCE: f64 = 0.3;

/// Once a branch has used up its share of the budget, what is left of it is held to tolerances so many times as large, with a part of
/// that share on top, and again. On a lump of 20 m the largest sag fell from 820 tolerances to 4 (to 12 in steps of 4).
const COARSER: f64 = 2.0;
const RESERVE: usize = 16;
/// Largest such tolerance, in tolerances.
const COARSEST: f64 = 1e9;

/// Depth at which splitting ends: parameters have no more digits.
const MAX_DEPTH: u32 = 60;
/// Share of a closed direction by which a border may fall short of all of it, and a cell of half of it: far above what parameters are
/// rounded by.
const TURN_SLACK: f64 = 1e-6;
/// Share of a cell's size that a preferred cut keeps from its sides.
const CUT_CLEARANCE: f64 = 1e-3;

/// What cells of a face are split by.
pub(super) struct Tree<'s, 'a> {
    surface: &'s FaceSurface<'a>,
    acceptance: Acceptance,
    /// Those of the border, then those that are imprinted.
    pub(super) segments: Vec<[Uv; 2]>,
    /// How many are the border's.
    border: usize,
    /// What those enclose.
    enclosure: Enclosure,
    /// Of each border segment, whether it is one point in space.
    poles: Vec<bool>,
    /// Parameters nearer than this are one.
    resolution: Uv,
    /// Parameters at which cells are cut rather than elsewhere, in u and v.
    preferred: [Vec<f64>; 2],
    /// A cell must be shorter than this, in u and v: half of a direction in which the face comes back to where it began, else infinite.
    longest: Uv,
    /// Largest angle between a facet and its normals, radians; `None` where none was requested.
    max_angle: Option<f64>,
}

/// The state of one branch of the tree.
pub(super) struct Branch<'s, 'a> {
    prover: Prover<'s, 'a>,
    pub(super) cells: Subdivision,
    /// Cells that it may have; grows with `slack`.
    pub(super) budget: usize,
    /// What cells are held to, in tolerances.
    slack: f64,
}

impl<'s, 'a> Branch<'s, 'a> {
    /// Begins a branch without cells, with slack 1 and room for `budget` cells.
    pub(super) fn new(tree: &Tree<'s, 'a>, budget: usize) -> Self {
        let prover = Prover::new(tree.surface, tree.acceptance);
        Self { prover, cells: Subdivision::default(), budget, slack: 1.0 }
    }

    /// Whether a cell at `depth` may be split further. Where the budget is used up, doubles the slack and enlarges the budget a little
    /// until [`COARSEST`]; notes in `cells` that splitting ended early.
    fn may_split(&mut self, depth: u32) -> bool {
        if self.prover.gives_up() {
            self.cells.exhausted = true;
            return false;
        }
        let used_up = self.cells.len() >= self.budget;
        self.cells.exhausted |= used_up;
        self.cells.out_of_share |= used_up;
        if used_up && self.slack < COARSEST {
            self.slack *= COARSER;
            self.budget += self.budget / RESERVE + 4;
            return true;
        }
        let may = !used_up && depth <= MAX_DEPTH;
        self.cells.exhausted |= !may;
        may
    }
}

/// A cell on its way down the tree.
#[derive(Clone, Copy)]
pub(super) struct Visit<'n> {
    pub(super) cell: Cell,
    /// Segments of the border that it may meet.
    pub(super) near: &'n [u32],
    /// Whether it is known to lie inside.
    pub(super) inside: bool,
    pub(super) depth: u32,
    /// How many cells stand before it at its depth.
    pub(super) place: usize,
}

/// The halves of a cell, and what is known of both.
pub(super) struct Halves {
    cells: [Cell; 2],
    /// Segments of the border that they may meet.
    near: Vec<u32>,
    inside: bool,
}

impl Halves {
    /// Returns the visits of the two, one below that of the whole.
    pub(super) fn visits(&self, whole: &Visit<'_>) -> [Visit<'_>; 2] {
        let (depth, inside) = (whole.depth + 1, self.inside);
        [0, 1].map(|k| Visit { cell: self.cells[k], near: &self.near, inside, depth, place: 2 * whole.place + k })
    }
}

impl<'s, 'a> Tree<'s, 'a> {
    /// Makes the tree over the box around a border in surface parameters, and its first cell; no cell is to cross an `imprinted` line, and
    /// `max_angle` is in radians. `None` on an affine surface and for a border without extent.
    pub(super) fn new(
        surface: &'s FaceSurface<'a>,
        acceptance: Acceptance,
        border: &BorderPolygons,
        imprinted: &[[Uv; 2]],
        max_angle: Option<f64>,
    ) -> Option<(Self, Cell)> {
        let mut segments: Vec<[Uv; 2]> = border
            .polygons
            .iter()
            .flat_map(|p| (0..p.len()).map(move |i| [p[i].uv, p[(i + 1) % p.len()].uv]))
            .collect();
        let (lo, hi) = border.bounds();
        // On a plane the border alone makes the facets.
        if !(lo.x < hi.x && lo.y < hi.y) || surface.affine {
            return None;
        }
        let root = Cell { lo, hi };
        let preferred = [0, 1].map(|d| preferred_cuts(surface, border, root, d));
        let poles = border.polygons.iter().flatten().map(|v| v.side == BorderSide::Pole).collect();
        let border = segments.len();
        let enclosure = Enclosure::new(segments.clone());
        segments.extend(imprinted);
        let resolution = parameter_resolution(lo, hi);
        let longest = longest_cells(surface, root);
        let tree = Tree {
            surface,
            acceptance,
            segments,
            border,
            enclosure,
            poles,
            resolution,
            preferred,
            longest,
            max_angle,
        };
        Some((tree, root))
    }
}

impl Tree<'_, '_> {
    /// Visits a cell and all below it, one after the other.
    pub(super) fn visit(&self, branch: &mut Branch<'_, '_>, visit: Visit<'_>) {
        if let Some(halves) = self.sort_or_halve(branch, &visit) {
            halves.visits(&visit).into_iter().for_each(|half| self.visit(branch, half));
        }
    }

    /// Sorts a cell into the branch: inside if it fits whole, to the border if it fits but is cut or splitting ends, dropped if it lies
    /// outside; else returns its halves.
    pub(super) fn sort_or_halve(&self, branch: &mut Branch<'_, '_>, visit: &Visit<'_>) -> Option<Halves> {
        let cell = visit.cell;
        let (near, inside) = self.border_near(visit)?;
        if !branch.may_split(visit.depth) {
            branch.cells.border.push(cell);
            return None;
        }
        let candidate = CandidateFacet::new(self.surface, cell);
        let cut = self.crease_to_cut(cell).or_else(|| self.turn_to_cut(cell));
        // No curvature is needed where the samples are farther off than the loosest tolerance: so are those of most cells above leaves.
        let loosest = self.surface.field.loosest() * branch.slack;
        let is_too_large = candidate.largest_sag() > loosest;
        // A crease is cut along before anything is proved: no facet may lie across it.
        if cut.is_none()
            && !is_too_large
            && let Some((bound, tolerance)) = self.prove_fit(branch, cell, &candidate)
        {
            // At the border the samples' aligned sides let a cell be whole; else the transition takes it, and this
            // one only gave the size.
            if inside || self.is_aligned(cell, &near) && self.contains(cell.center()) {
                let (first, places) = (candidate.first_corner(), candidate.places());
                let slack = branch.slack;
                branch.cells.inside.push(ProvedCell { cell, bound, tolerance, slack, first, places });
            } else {
                branch.cells.border.push(cell);
            }
            return None;
        }
        let (direction, at) = cut.unwrap_or_else(|| {
            let limit = if is_too_large { loosest } else { self.surface.tolerance(cell.center()) * branch.slack };
            // What sags as little as it may is cut where its normals turn: a twisted strip does not sag along its rulings, however fine.
            let is_turned = candidate.largest_sag() <= limit && self.is_over_angle(cell, &candidate, branch.slack);
            let turning = if is_turned { CandidateFacet::direction_of_turn(self.surface, cell) } else { None };
            let d = turning.unwrap_or_else(|| candidate.parameter_to_halve(self.surface, cell, limit));
            (d, self.cut_parameter(cell, d))
        });
        // Beside a wall that a damaged coordinate makes halves got as thin as the digits of parameters, in stacks of thousands which the
        // triangulation took six minutes for.
        let least = self.resolution[direction];
        if !(at - cell.lo[direction] > least && cell.hi[direction] - at > least) {
            branch.cells.exhausted = true;
            branch.cells.border.push(cell);
            return None;
        }
        let (mut low, mut high) = (cell, cell);
        low.hi[direction] = at;
        high.lo[direction] = at;
        Some(Halves { cells: [low, high], near, inside })
    }

    /// Returns the indices of the segments within [`CLEARANCE`] of a cell, and whether the cell is known to lie inside; `None` where it
    /// lies wholly outside.
    fn border_near(&self, visit: &Visit<'_>) -> Option<(Vec<u32>, bool)> {
        if visit.inside {
            return Some((Vec::new(), true));
        }
        let cell = visit.cell;
        let grow = CLEARANCE * (cell.hi - cell.lo);
        let (lo, hi) = (cell.lo - grow, cell.hi + grow);
        let touching = |s: &u32| segment_touches_rectangle(self.segments[*s as usize], lo, hi);
        let near: Vec<u32> = visit.near.iter().copied().filter(touching).collect();
        // Free of the border all of it is inside or outside, as its middle is.
        let clear = near.is_empty();
        (!clear || self.contains(cell.center())).then_some((near, clear))
    }

    /// Returns a bound and tolerance, mm, of a cell that is proved within the branch's slack; `None` where it is not.
    fn prove_fit(&self, branch: &mut Branch<'_, '_>, cell: Cell, candidate: &CandidateFacet) -> Option<(f64, f64)> {
        // Nine samples first: they turn most cells away before any bound is made.
        let tolerance = self.sampled_fit(cell, candidate, branch.slack)?;
        let limit = tolerance * branch.slack;
        // A cell at the border is only a measure of size, but samples alone leave them larger: 6 % more facets on a lens.
        let prover = &mut branch.prover;
        let bound = pole_bound(prover, cell, limit).unwrap_or_else(|| candidate.bound(prover, cell, limit));
        (bound <= limit).then_some((bound, tolerance))
    }

    /// Whether the border segments `near` leave a cell whole: each runs along a side, or beyond it and parallel, with no corner of the cell
    /// strictly between its ends. False where an imprinted line is near.
    fn is_aligned(&self, cell: Cell, near: &[u32]) -> bool {
        // What the border's segments do not cross, and no sample of theirs divides, meets neighbours corner to corner.
        near.iter().all(|&s| {
            // No cell's side may be divided that another solid's border runs along.
            if s as usize >= self.border {
                return false;
            }
            let [a, b] = self.segments[s as usize];
            (0..2).any(|d| {
                let (e, eps) = (1 - d, self.resolution);
                // A pole is one point, whatever its parameters.
                if (a[d] - b[d]).abs() > eps[d] || self.poles[s as usize] {
                    return false;
                }
                // Both ends: of a slanting segment one may be a corner of the cell, and the other beside it.
                let beyond = a[d].max(b[d]) < cell.lo[d] - eps[d] || a[d].min(b[d]) > cell.hi[d] + eps[d];
                let on = |level: f64| (a[d] - level).abs().max((b[d] - level).abs()) <= eps[d];
                let on = on(cell.lo[d]) || on(cell.hi[d]);
                let (from, to) = (a[e].min(b[e]) + eps[e], a[e].max(b[e]) - eps[e]);
                let between = |x: f64| from < x && x < to;
                beyond || on && !between(cell.lo[e]) && !between(cell.hi[e])
            })
        })
    }

    /// Returns the middle one of the creases across a cell, with the parameter it is constant in (0 for u, 1 for v); `None` without one.
    /// Creases within the resolution of a side do not count.
    fn crease_to_cut(&self, cell: Cell) -> Option<(usize, f64)> {
        (0..2).find_map(|d| {
            let c = &self.surface.creases[d];
            let (lo, hi) = (cell.lo[d] + self.resolution[d], cell.hi[d] - self.resolution[d]);
            let (i, j) = (c.partition_point(|&x| x <= lo), c.partition_point(|&x| x < hi));
            (i < j).then(|| (d, c[(i + j) / 2]))
            // The middle one of several, so that the halves are left with as many each.
        })
    }

    /// Returns where a cell that goes halfway round the face is cut, with the parameter that is constant there; `None` for a shorter one.
    fn turn_to_cut(&self, cell: Cell) -> Option<(usize, f64)> {
        let is_long = |d: &usize| cell.hi[*d] - cell.lo[*d] >= self.longest[*d];
        (0..2).find(is_long).map(|d| (d, self.cut_parameter(cell, d)))
    }

    /// Returns where a cell is cut in direction `d`: at the middle one of the preferred cuts that keep off its sides, else half-way.
    fn cut_parameter(&self, cell: Cell, d: usize) -> f64 {
        let (lo, hi) = (cell.lo[d], cell.hi[d]);
        let l = &self.preferred[d];
        let slack = CUT_CLEARANCE * (hi - lo);
        let (i, j) = (l.partition_point(|&x| x <= lo + slack), l.partition_point(|&x| x < hi - slack));
        // Preferred cuts near a side would leave slivers.
        if i < j { l[(i + j) / 2] } else { 0.5 * (lo + hi) }
    }

    /// Returns the tightest tolerance, mm, at the cell's corners and middle if the nine samples are within `slack` times as much and, at
    /// slack 1, the normals at the corners within the angle; else `None`. Proves nothing.
    fn sampled_fit(&self, cell: Cell, candidate: &CandidateFacet, slack: f64) -> Option<f64> {
        let sag = candidate.largest_sag();
        let mut xi = f64::INFINITY;
        // The first place that is too tight decides: half of all cells end there, and curvatures take a tenth of the time.
        for place in [cell.center()].into_iter().chain(cell.corners()) {
            xi = xi.min(self.surface.tolerance(place));
            if sag > xi * slack {
                return None;
            }
        }
        if self.is_over_angle(cell, candidate, slack) {
            return None;
        }
        Some(xi)
    }

    /// Whether a cell is to be divided for the angle, which does not matter any more once tolerances have grown.
    fn is_over_angle(&self, cell: Cell, candidate: &CandidateFacet, slack: f64) -> bool {
        let is_divided = slack == 1.0 && candidate.extent() > self.surface.field.least_of_angle();
        self.max_angle.is_some_and(|most| is_divided && candidate.is_steep(self.surface, cell, most))
    }

    /// Whether `p` lies inside the border's loops, imprinted lines not counted.
    fn contains(&self, p: Uv) -> bool {
        self.enclosure.encloses(p)
    }
}

/// Returns the longest sides that cells may have: a little less than half of `root` in a direction in which the face closes on itself and
/// `root` holds the whole turn, else infinity. Of a tube thinner than its tolerance two facets around would have their corners in the same
/// two places: the facets of one side would be those of the other.
fn longest_cells(surface: &FaceSurface<'_>, root: Cell) -> Uv {
    let (lengths, whole) = (root.hi - root.lo, surface.extent());
    let half = |d: usize| {
        let comes_back = surface.closed[d] && lengths[d] >= (1.0 - TURN_SLACK) * whole[d];
        // A little less, so that rounding leaves no two cells of one half each.
        if comes_back { (0.5 - TURN_SLACK) * lengths[d] } else { f64::INFINITY }
    };
    Uv::new(half(0), half(1))
}

/// Returns a bound, mm, of a cell with a side on a pole as the triangle that it becomes; `None` for a cell without one, and where none is
/// found.
fn pole_bound(prover: &mut Prover<'_, '_>, cell: Cell, limit: f64) -> Option<f64> {
    let c = cell.corners();
    let polar = c.map(|x| prover.surface.pole(x).is_some());
    // Two corners off the pole and two on it: the triangle between them is what is traced.
    let k = (0..4).find(|&k| !polar[k] && !polar[(k + 1) % 4] && polar[(k + 2) % 4] && polar[(k + 3) % 4])?;
    let uv = [0, 1, 2].map(|i| c[(k + i) % 4]);
    let xyz = uv.map(|x| prover.surface.point(x));
    pole::sector_bound(prover, uv, xyz, [None; 3], limit)
}

/// Whether a segment meets the rectangle from `lo` to `hi`, its sides included.
fn segment_touches_rectangle([a, b]: [Uv; 2], lo: Uv, hi: Uv) -> bool {
    if a.max(b).cmplt(lo).any() || a.min(b).cmpgt(hi).any() {
        return false;
    }
    // Separating axis across the segment.
    let (d, c, h) = (b - a, 0.5 * (lo + hi), 0.5 * (hi - lo));
    let off = d.perp_dot(c - a).abs();
    off <= d.x.abs() * h.y + d.y.abs() * h.x
}

//! The tree over the parameter rectangle: cells are halved across the direction that bends more until they fit.
//!
//! Cuts fall on a ladder of preferred parameters, so that neighbouring cells and the border line up; below the ladder they
//! halve. A cell is kept whole when it is clear of the border, or when the border runs along its sides, corner on sample.

use super::ladder::ladder;
use super::look::Look;
use crate::math::{Point, Uv};
use crate::tessellate::border::rings::{Follows, Rings};
use crate::tessellate::proof::bound::Prover;
use crate::tessellate::settings::Judge;
use crate::tessellate::sheet::Sheet;
use crate::tessellate::strip::sector;

/// A rectangle `[lo, hi]` of the parameter plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::tessellate) struct Cell {
    pub(in crate::tessellate) lo: Uv,
    pub(in crate::tessellate) hi: Uv,
}

impl Cell {
    pub(in crate::tessellate) fn corners(&self) -> [Uv; 4] {
        [self.lo, Uv::new(self.hi.x, self.lo.y), self.hi, Uv::new(self.lo.x, self.hi.y)]
    }

    pub(in crate::tessellate) fn center(&self) -> Uv {
        0.5 * (self.lo + self.hi)
    }
}

/// A cell that is proved.
#[derive(Clone, Copy, Debug)]
pub(in crate::tessellate) struct Leaf {
    pub(in crate::tessellate) cell: Cell,
    pub(in crate::tessellate) bound: f64,
    /// The tolerance at its place.
    pub(in crate::tessellate) tolerance: f64,
    /// How many times that it was held to: 1, more once the budget has ended.
    pub(in crate::tessellate) slack: f64,
    /// The corner at which the traced diagonal starts: 0 or 1.
    pub(in crate::tessellate) first: usize,
    /// Where its corners lie.
    pub(in crate::tessellate) places: [Point; 4],
}

/// The leaves.
#[derive(Default)]
pub(in crate::tessellate) struct Leaves {
    /// Wholly inside, not cut by the border, and proved.
    pub(in crate::tessellate) inside: Vec<Leaf>,
    /// Those that the border cuts or comes near to.
    pub(in crate::tessellate) border: Vec<Cell>,
    /// Whether splitting ended before all cells fitted.
    pub(in crate::tessellate) exhausted: bool,
    /// Whether it did so because a branch had used up its share of the budget.
    short: bool,
}

/// Part of a cell's size that it must keep from the border.
const CLEARANCE: f64 = 0.3;

/// Once a branch has used up its share of the budget, what is left of it is held to tolerances so many times as large, with a part of
/// that share on top, and again. On a lump of 20 m the largest sag fell from 820 tolerances to 4 (to 12 in steps of 4).
const COARSER: f64 = 2.0;
const RESERVE: usize = 16;
/// Largest such tolerance, in tolerances.
const COARSEST: f64 = 1e9;

/// Depth down to which the halves are visited in parallel, each with half of the budget.
const PARALLEL: u32 = 5;

struct Tree<'s, 'a> {
    sheet: &'s Sheet<'a>,
    judge: Judge,
    segments: Vec<[Uv; 2]>,
    /// Segments that are one point in space.
    poles: Vec<bool>,
    /// Parameters nearer than this are one.
    same: Uv,
    ladder: [Vec<f64>; 2],
    max_angle: Option<f64>,
}

/// What one branch of the tree works with.
struct Branch<'s, 'a> {
    prover: Prover<'s, 'a>,
    leaves: Leaves,
    budget: usize,
    /// What cells are held to, in tolerances.
    slack: f64,
}

/// Splits the box around the rings until every cell fits.
pub(in crate::tessellate) fn split(
    sheet: &Sheet<'_>,
    judge: Judge,
    rings: &Rings,
    budget: usize,
    max_angle: Option<f64>,
) -> Leaves {
    let segments: Vec<[Uv; 2]> =
        rings.rings.iter().flat_map(|r| (0..r.len()).map(move |i| [r[i].uv, r[(i + 1) % r.len()].uv])).collect();
    let (lo, hi) =
        segments.iter().flatten().fold((Uv::INFINITY, Uv::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
    if !(lo.x < hi.x && lo.y < hi.y) || sheet.affine {
        return Leaves::default();
    }
    let root = Cell { lo, hi };
    let ladder = [ladder(sheet, rings, root, 0), ladder(sheet, rings, root, 1)];
    let all: Vec<u32> = (0..segments.len() as u32).collect();
    let poles = rings.rings.iter().flatten().map(|v| v.follows == Follows::Pole).collect();
    let tree = Tree { sheet, judge, segments, poles, same: same(lo, hi), ladder, max_angle };
    // Branches have equal shares whatever they need: where one is short while the whole is not, all get twice as much. The last try
    // leaves at most twice the budget.
    let mut share = budget;
    loop {
        let mut branch =
            Branch { prover: Prover::new(sheet, judge), leaves: Leaves::default(), budget: share, slack: 1.0 };
        tree.visit(&mut branch, root, &all, false, 0);
        let leaves = branch.leaves;
        if !leaves.short || leaves.inside.len() + leaves.border.len() >= budget || share >> PARALLEL >= budget {
            return leaves;
        }
        share *= 2;
    }
}

/// Parameters nearer than this are one, in a face that spans the box.
pub(in crate::tessellate) fn same(lo: Uv, hi: Uv) -> Uv {
    1e-7 * (hi - lo)
}

impl Tree<'_, '_> {
    fn visit(&self, out: &mut Branch<'_, '_>, cell: Cell, candidates: &[u32], known_inside: bool, depth: u32) {
        let mut inside = known_inside;
        let mut near: Vec<u32> = Vec::new();
        if !inside {
            let grow = CLEARANCE * (cell.hi - cell.lo);
            let (lo, hi) = (cell.lo - grow, cell.hi + grow);
            near = candidates.iter().copied().filter(|&s| touches(self.segments[s as usize], lo, hi)).collect();
            if near.is_empty() {
                if !self.contains(cell.center()) {
                    return;
                }
                inside = true;
            }
        }
        let short = out.leaves.inside.len() + out.leaves.border.len() >= out.budget;
        out.leaves.exhausted |= short;
        out.leaves.short |= short;
        if short && out.slack < COARSEST {
            out.slack *= COARSER;
            out.budget += out.budget / RESERVE + 4;
        } else if short || depth > 60 {
            out.leaves.exhausted = true;
            out.leaves.border.push(cell);
            return;
        }
        let look = Look::new(self.sheet, cell);
        let crease = self.crease(cell);
        if crease.is_none()
            && let Some(xi) = self.looks_fit(cell, &look, out.slack)
        {
            let limit = xi * out.slack;
            // A cell at the border is only a measure of size, but a look alone leaves them larger: 6 % more facets on a lens.
            let prover = &mut out.prover;
            let bound = at_pole(prover, cell, limit).unwrap_or_else(|| look.bound(prover, cell, limit));
            if bound <= limit {
                if inside || self.aligned(cell, &near) && self.contains(cell.center()) {
                    let (first, places) = (look.first(), look.places());
                    out.leaves.inside.push(Leaf { cell, bound, tolerance: xi, slack: out.slack, first, places });
                } else {
                    out.leaves.border.push(cell);
                }
                return;
            }
        }
        let (direction, at) = crease.unwrap_or_else(|| {
            let d = look.direction();
            (d, self.cut(cell, d))
        });
        if !(at > cell.lo[direction] && at < cell.hi[direction]) {
            out.leaves.border.push(cell);
            return;
        }
        let (mut a, mut b) = (cell, cell);
        a.hi[direction] = at;
        b.lo[direction] = at;
        if depth >= PARALLEL {
            self.visit(out, a, &near, inside, depth + 1);
            self.visit(out, b, &near, inside, depth + 1);
            return;
        }
        let budget = out.budget / 2;
        let half = |cell: Cell| {
            let prover = Prover::new(self.sheet, self.judge);
            let mut branch = Branch { prover, leaves: Leaves::default(), budget, slack: 1.0 };
            self.visit(&mut branch, cell, &near, inside, depth + 1);
            branch.leaves
        };
        let (first, second) = rayon::join(|| half(a), || half(b));
        for part in [first, second] {
            out.leaves.inside.extend(part.inside);
            out.leaves.border.extend(part.border);
            out.leaves.exhausted |= part.exhausted;
            out.leaves.short |= part.short;
        }
    }

    /// Whether the segments near a cell leave it whole: they run along its sides, or beyond and along them, and no
    /// corner stands between two samples.
    fn aligned(&self, cell: Cell, near: &[u32]) -> bool {
        near.iter().all(|&s| {
            let [a, b] = self.segments[s as usize];
            (0..2).any(|d| {
                let (e, eps) = (1 - d, self.same);
                if (a[d] - b[d]).abs() > eps[d] || self.poles[s as usize] {
                    return false;
                }
                let beyond = a[d] < cell.lo[d] - eps[d] || a[d] > cell.hi[d] + eps[d];
                let on = (a[d] - cell.lo[d]).abs() <= eps[d] || (a[d] - cell.hi[d]).abs() <= eps[d];
                let (from, to) = (a[e].min(b[e]) + eps[e], a[e].max(b[e]) - eps[e]);
                let between = |x: f64| from < x && x < to;
                beyond || on && !between(cell.lo[e]) && !between(cell.hi[e])
            })
        })
    }

    /// A crease of the surface across the cell.
    fn crease(&self, cell: Cell) -> Option<(usize, f64)> {
        (0..2).find_map(|d| {
            let c = &self.sheet.creases[d];
            let (i, j) = (c.partition_point(|&x| x <= cell.lo[d]), c.partition_point(|&x| x < cell.hi[d]));
            (i < j).then(|| (d, c[(i + j) / 2]))
        })
    }

    /// The ladder's middle step inside the cell, or the cell's middle.
    fn cut(&self, cell: Cell, d: usize) -> f64 {
        let (lo, hi) = (cell.lo[d], cell.hi[d]);
        let l = &self.ladder[d];
        let slack = 1e-3 * (hi - lo);
        let (i, j) = (l.partition_point(|&x| x <= lo + slack), l.partition_point(|&x| x < hi - slack));
        if i < j { l[(i + j) / 2] } else { 0.5 * (lo + hi) }
    }

    /// The tolerance of a cell that seems to be within `slack` times as much.
    fn looks_fit(&self, cell: Cell, look: &Look, slack: f64) -> Option<f64> {
        let xi =
            cell.corners().iter().fold(self.sheet.tolerance(cell.center()), |x, &c| x.min(self.sheet.tolerance(c)));
        if look.sag[0].max(look.sag[1]) > xi * slack {
            return None;
        }
        if let Some(max) = self.max_angle.filter(|_| slack == 1.0) {
            let n: Vec<_> = cell.corners().iter().filter_map(|&c| self.sheet.normal(c)).collect();
            let turned = n.iter().any(|a| n.iter().any(|b| a.angle_between(*b) > 2.0 * max));
            if turned {
                return None;
            }
        }
        Some(xi)
    }

    /// Whether a point lies inside the rings: parity of crossings along u.
    fn contains(&self, p: Uv) -> bool {
        let mut odd = false;
        for [a, b] in &self.segments {
            if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
                odd = !odd;
            }
        }
        odd
    }
}

/// Bound of a cell with a side on a pole, which becomes a triangle.
fn at_pole(prover: &mut Prover<'_, '_>, cell: Cell, limit: f64) -> Option<f64> {
    let c = cell.corners();
    let polar = c.map(|x| prover.sheet.pole(x).is_some());
    let k = (0..4).find(|&k| !polar[k] && !polar[(k + 1) % 4] && polar[(k + 2) % 4] && polar[(k + 3) % 4])?;
    let uv = [0, 1, 2].map(|i| c[(k + i) % 4]);
    let xyz = uv.map(|x| prover.sheet.point(x));
    sector::bound(prover, uv, xyz, [None; 3], limit)
}

/// Whether a segment meets a rectangle.
fn touches([a, b]: [Uv; 2], lo: Uv, hi: Uv) -> bool {
    if a.max(b).cmplt(lo).any() || a.min(b).cmpgt(hi).any() {
        return false;
    }
    // Separating axis across the segment.
    let (d, c, h) = (b - a, 0.5 * (lo + hi), 0.5 * (hi - lo));
    let off = d.perp_dot(c - a).abs();
    off <= d.x.abs() * h.y + d.y.abs() * h.x
}

//! The tree over the parameter rectangle: cells are halved across the direction that bends more until they fit.
//!
//! Cuts fall on a ladder of preferred parameters (samples of border edges that run along parameter lines, or lines spread
//! evenly in curvature), so that neighbouring cells and the border line up; below the ladder they halve.

use super::bound::{Prover, from_line};
use super::rings::{Follows, Rings};
use super::settings::Judge;
use super::sheet::Sheet;
use crate::math::{Point, Uv};

/// A rectangle `[lo, hi]` of the parameter plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    pub(super) lo: Uv,
    pub(super) hi: Uv,
}

impl Cell {
    pub(super) fn corners(&self) -> [Uv; 4] {
        [self.lo, Uv::new(self.hi.x, self.lo.y), self.hi, Uv::new(self.lo.x, self.hi.y)]
    }

    pub(super) fn center(&self) -> Uv {
        0.5 * (self.lo + self.hi)
    }
}

/// The leaves.
#[derive(Default)]
pub(super) struct Leaves {
    /// Wholly inside, clear of the border, and proved: with the bound and the tolerance it was held to.
    pub(super) inside: Vec<(Cell, f64, f64)>,
    /// Those that the border touches.
    pub(super) border: Vec<Cell>,
    /// Whether the budget ended the splitting.
    pub(super) exhausted: bool,
}

/// Part of a cell's size that it must keep from the border.
const CLEARANCE: f64 = 0.3;

/// Depth down to which the halves are visited in parallel, each with half of the budget.
const PARALLEL: u32 = 5;

struct Tree<'s, 'a> {
    sheet: &'s Sheet<'a>,
    judge: Judge,
    segments: Vec<[Uv; 2]>,
    ladder: [Vec<f64>; 2],
    max_angle: Option<f64>,
}

/// What one branch of the tree works with.
struct Branch<'s, 'a> {
    prover: Prover<'s, 'a>,
    leaves: Leaves,
    budget: usize,
}

/// Splits the box around the rings until every cell fits.
pub(super) fn split(
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
    let tree = Tree { sheet, judge, segments, ladder, max_angle };
    let mut branch = Branch { prover: Prover::new(sheet, judge), leaves: Leaves::default(), budget };
    tree.visit(&mut branch, root, &all, false, 0);
    branch.leaves
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
        if out.leaves.inside.len() + out.leaves.border.len() >= out.budget || depth > 60 {
            out.leaves.exhausted = true;
            out.leaves.border.push(cell);
            return;
        }
        let look = Look::new(self.sheet, cell);
        let crease = self.crease(cell);
        if crease.is_none()
            && let Some((bound, xi)) = self.fits(&mut out.prover, cell, &look)
        {
            if inside {
                out.leaves.inside.push((cell, bound, xi));
            } else {
                out.leaves.border.push(cell);
            }
            return;
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
            let mut branch = Branch { prover, leaves: Leaves::default(), budget };
            self.visit(&mut branch, cell, &near, inside, depth + 1);
            branch.leaves
        };
        let (first, second) = rayon::join(|| half(a), || half(b));
        for part in [first, second] {
            out.leaves.inside.extend(part.inside);
            out.leaves.border.extend(part.border);
            out.leaves.exhausted |= part.exhausted;
        }
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

    /// Bound and tolerance of a cell that is within it.
    fn fits(&self, prover: &mut Prover<'_, '_>, cell: Cell, look: &Look) -> Option<(f64, f64)> {
        let xi =
            cell.corners().iter().fold(self.sheet.tolerance(cell.center()), |x, &c| x.min(self.sheet.tolerance(c)));
        if look.sag[0].max(look.sag[1]) > xi {
            return None;
        }
        if let Some(max) = self.max_angle {
            let n: Vec<_> = cell.corners().iter().filter_map(|&c| self.sheet.normal(c)).collect();
            let turned = n.iter().any(|a| n.iter().any(|b| a.angle_between(*b) > 2.0 * max));
            if turned {
                return None;
            }
        }
        // A cell at the border is only a measure of size, but often the strip gets the same rectangle again.
        let bound = quad_bound(prover, &look.facet(cell), xi);
        (bound <= xi).then_some((bound, xi))
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

/// Corners of a facet: parameters and places, the traced diagonal from the first to the third.
pub(super) type Corners = [(Uv, Point); 4];

/// Bound of a quad's two triangles, edges and diagonal included.
pub(super) fn quad_bound(prover: &mut Prover<'_, '_>, c: &Corners, limit: f64) -> f64 {
    let mut worst = 0f64;
    for [i, j, k] in [[0, 1, 2], [0, 2, 3]] {
        worst = worst.max(prover.piece([c[i].0, c[j].0, c[k].0], [c[i].1, c[j].1, c[k].1], limit));
        if worst > limit {
            return worst;
        }
    }
    for [i, j] in [[0, 2], [0, 1], [1, 2], [2, 3], [3, 0]] {
        worst = worst.max(prover.side([c[i].0, c[j].0], [c[i].1, c[j].1], limit));
        if worst > limit {
            return worst;
        }
    }
    worst
}

/// Nine points of a cell and what they show.
struct Look {
    p: [[Point; 3]; 3],
    /// Largest distance of a middle from its chord, for lines along u and along v.
    sag: [f64; 2],
}

impl Look {
    fn new(sheet: &Sheet<'_>, cell: Cell) -> Self {
        let step = 0.5 * (cell.hi - cell.lo);
        let at = |i: usize, j: usize| {
            let mut uv = cell.lo + step * Uv::new(i as f64, j as f64);
            if i == 2 {
                uv.x = cell.hi.x;
            }
            if j == 2 {
                uv.y = cell.hi.y;
            }
            sheet.point(uv)
        };
        let p: [[Point; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| at(i, j)));
        let u = (0..3).map(|j| from_line(p[1][j], &[p[0][j], p[2][j]])).fold(0.0, f64::max);
        let v = (0..3).map(|i| from_line(p[i][1], &[p[i][0], p[i][2]])).fold(0.0, f64::max);
        Self { p, sag: [u, v] }
    }

    fn direction(&self) -> usize {
        let [u, v] = self.sag;
        let p = &self.p;
        let length = |a: usize, b: usize, c: usize, d: usize| (p[c][d] - p[a][b]).length();
        if (u - v).abs() > 0.05 * u.max(v) {
            return if u > v { 0 } else { 1 };
        }
        let along_u = length(0, 1, 2, 1).max(length(0, 1, 1, 1));
        let along_v = length(1, 0, 1, 2).max(length(1, 0, 1, 1));
        if along_u >= along_v { 0 } else { 1 }
    }

    /// The cell as a facet, cut along the diagonal that lies nearer to the surface.
    fn facet(&self, cell: Cell) -> Corners {
        let p = [self.p[0][0], self.p[2][0], self.p[2][2], self.p[0][2]];
        let uv = cell.corners();
        let m = self.p[1][1];
        let r = if from_line(m, &[p[1], p[3]]) < from_line(m, &[p[0], p[2]]) * (1.0 - 1e-9) { 1 } else { 0 };
        std::array::from_fn(|k| (uv[(k + r) % 4], p[(k + r) % 4]))
    }
}

/// The facet of a cell with its better diagonal.
pub(super) fn facet_of(sheet: &Sheet<'_>, cell: Cell) -> Corners {
    Look::new(sheet, cell).facet(cell)
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

/// Preferred cuts in direction `d`.
fn ladder(sheet: &Sheet<'_>, rings: &Rings, root: Cell, d: usize) -> Vec<f64> {
    let other = 1 - d;
    let (lo, hi) = (root.lo[d], root.hi[d]);
    let flat = 1e-7 * (root.hi[other] - root.lo[other]);
    // Runs of samples along a parameter line, longest first.
    let mut runs: Vec<Vec<f64>> = Vec::new();
    for ring in &rings.rings {
        let n = ring.len();
        let level = |i: usize| {
            let (a, b) = (ring[i % n], ring[(i + 1) % n]);
            a.follows != Follows::Pole && (a.uv[other] - b.uv[other]).abs() <= flat
        };
        let start = (0..n).find(|&i| !level(i)).map_or(0, |i| i + 1);
        let mut run: Vec<f64> = Vec::new();
        for i in start..start + n {
            if level(i) {
                if run.is_empty() {
                    run.push(ring[i % n].uv[d]);
                }
                run.push(ring[(i + 1) % n].uv[d]);
            }
            if !level(i) || i + 1 == start + n {
                if run.len() > 2 {
                    run.sort_by(f64::total_cmp);
                    runs.push(std::mem::take(&mut run));
                }
                run.clear();
            }
        }
    }
    runs.sort_by_key(|r| std::cmp::Reverse(r.len()));
    let mut covered: Vec<[f64; 2]> = Vec::new();
    let mut steps: Vec<f64> = Vec::new();
    for run in runs {
        let fresh = |x: f64| !covered.iter().any(|c| c[0] - 1e-9 <= x && x <= c[1] + 1e-9);
        let new: Vec<f64> = run.iter().copied().filter(|&x| fresh(x)).collect();
        steps.extend(new);
        covered.push([run[0], run[run.len() - 1]]);
    }
    let share: f64 = covered.iter().map(|c| c[1] - c[0]).sum();
    if share < 0.5 * (hi - lo) {
        steps = even(sheet, root, d);
    }
    steps.sort_by(f64::total_cmp);
    steps.dedup_by(|b, a| *b - *a <= 1e-9 * (hi - lo));
    steps.retain(|&x| x > lo && x < hi);
    steps
}

/// Lines spread evenly in `√(curvature / tolerance)`, as many as the sharpest of a few lines needs, times a power of two.
fn even(sheet: &Sheet<'_>, root: Cell, d: usize) -> Vec<f64> {
    let (n, m) = (32, 5);
    let other = 1 - d;
    let at = |i: usize, j: usize| {
        let mut f = Uv::ZERO;
        f[d] = i as f64 / n as f64;
        f[other] = (j as f64 + 0.5) / m as f64;
        root.lo + f * (root.hi - root.lo)
    };
    let mut density = vec![0f64; n + 1];
    for j in 0..m {
        for (i, slot) in density.iter_mut().enumerate() {
            let uv = at(i, j);
            let der = sheet.surface.second_derivatives(uv);
            let Some(forms) = crate::nurbs::FundamentalForms::new(&der) else { continue };
            let (mut along, mut across) = (Uv::ZERO, Uv::ZERO);
            along[d] = 1.0;
            across[other] = 1.0;
            let (k, c) = (forms.along(along), forms.along(across));
            let wide = if d == 0 { der.dv } else { der.du }.length() * (root.hi[other] - root.lo[other]);
            let xi = sheet.field.at(forms.sharpest());
            let share = if k * c > 0.0 { 1.0 - (c.abs() * wide * wide / (8.0 * xi)).min(0.5) } else { 1.0 };
            let speed = if d == 0 { der.du } else { der.dv }.length();
            *slot = slot.max((k.abs() / (8.0 * xi * share)).sqrt() * speed);
        }
    }
    let step = (root.hi[d] - root.lo[d]) / n as f64;
    let mut sum = vec![0.0];
    for i in 0..n {
        sum.push(sum[i] + 0.5 * (density[i] + density[i + 1]) * step);
    }
    let total = sum[n];
    if !total.is_finite() || total <= 1.0 {
        return Vec::new();
    }
    let count = (total * 1.03).ceil().min(4096.0) as usize;
    (1..count)
        .map(|k| {
            let goal = total * k as f64 / count as f64;
            let i = sum.partition_point(|&s| s <= goal).clamp(1, n) - 1;
            root.lo[d] + step * (i as f64 + ((goal - sum[i]) / (sum[i + 1] - sum[i])).clamp(0.0, 1.0))
        })
        .collect()
}

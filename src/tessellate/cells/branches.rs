//! The branches of the tree: shares of the budget of cells, and the visits in parallel.

use super::cell::Subdivision;
use super::tree::{Branch, Tree, Visit};
use crate::math::Uv;
use crate::tessellate::border::polygons::BorderPolygons;
use crate::tessellate::face_surface::FaceSurface;
use crate::tessellate::settings::Acceptance;

/// Depth down to which the halves are visited in parallel, each with half of the budget.
const PARALLEL: u32 = 5;

/// What one visit of the upper levels leaves.
struct Piece {
    /// Where it stands among all: how many branches of depth [`PARALLEL`] may be before it.
    place: usize,
    /// Whether it is such a branch.
    is_branch: bool,
    cells: Subdivision,
}

/// Splits the parameter box around the border until every cell fits its tolerance. It ends before that, which `exhausted` says, where the
/// budget of cells, the proof steps of the surface or the digits of its parameters are used up; the result has up to twice the budget.
/// Empty on a surface that is affine in its parameters and for a border without extent. `max_angle` is in radians; no cell crosses an
/// `imprinted` line.
pub(in crate::tessellate) fn split(
    surface: &FaceSurface<'_>,
    acceptance: Acceptance,
    border: &BorderPolygons,
    imprinted: &[[Uv; 2]],
    budget: usize,
    max_angle: Option<f64>,
) -> Subdivision {
    let Some((tree, cell)) = Tree::new(surface, acceptance, border, imprinted, max_angle) else {
        return Subdivision::default();
    };
    // Branches have equal shares whatever they need: where one is short while the whole is not, all get twice as much. The last try
    // leaves at most twice the budget.
    let all: Vec<u32> = (0..tree.segments.len() as u32).collect();
    let root = Visit { cell, near: &all, inside: false, depth: 0, place: 0 };
    // Branches that were not short are the same with more.
    let mut settled: Vec<Option<Subdivision>> = (0..1 << PARALLEL).map(|_| None).collect();
    let mut share = budget;
    loop {
        let pieces = tree.visit_branches(share, root, &settled);
        let is_short = pieces.iter().any(|p| p.cells.out_of_share);
        let made: usize =
            pieces.iter().map(|p| &p.cells).chain(settled.iter().flatten()).map(Subdivision::len).sum();
        let ends = !is_short || surface.steps.are_too_many() || made >= budget || share >> PARALLEL >= budget;
        if ends {
            return in_order(settled, pieces);
        }
        // With less than a cell for each, branches are cut from what was held to a larger tolerance.
        if share >> PARALLEL > 0 {
            for piece in pieces.into_iter().filter(|p| p.is_branch && !p.cells.out_of_share) {
                settled[piece.place] = Some(piece.cells);
            }
        }
        share *= 2;
    }
}

/// Joins branches and what was made above them in the order of their places.
fn in_order(branches: Vec<Option<Subdivision>>, pieces: Vec<Piece>) -> Subdivision {
    let mut places: Vec<Subdivision> = branches.into_iter().map(Option::unwrap_or_default).collect();
    pieces.into_iter().for_each(|piece| places[piece.place].append(piece.cells));
    let mut all = Subdivision::default();
    places.into_iter().for_each(|cells| all.append(cells));
    all
}

impl Tree<'_, '_> {
    /// Visits a cell and all below it, in parallel down to the branches of depth [`PARALLEL`]. `budget` is shared out beforehand: what a
    /// branch may use must not depend on which thread comes first. Those that are `settled`, by place, are left out.
    fn visit_branches(&self, budget: usize, visit: Visit<'_>, settled: &[Option<Subdivision>]) -> Vec<Piece> {
        let is_branch = visit.depth == PARALLEL;
        if is_branch && settled[visit.place].is_some() {
            return Vec::new();
        }
        let mut branch = Branch::new(self, budget);
        let place = visit.place << (PARALLEL - visit.depth);
        if is_branch {
            self.visit(&mut branch, visit);
            return vec![Piece { place, is_branch, cells: branch.cells }];
        }
        let halves = self.sort_or_halve(&mut branch, &visit);
        let mut pieces = vec![Piece { place, is_branch, cells: branch.cells }];
        if let Some(halves) = halves {
            let [low, high] = halves.visits(&visit);
            let below = |half: Visit<'_>| self.visit_branches(branch.budget / 2, half, settled);
            let (first, second) = rayon::join(|| below(low), || below(high));
            pieces.extend(first);
            pieces.extend(second);
        }
        pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Homogeneous;
    use crate::nurbs::Surface;
    use crate::tessellate::border::polygons::{BorderSide, PolygonVertex};
    use crate::tessellate::cells::cell::Cell;
    use crate::tessellate::nodes::Position;
    use crate::tessellate::settings::ToleranceField;

    /// Side of the square sheet, mm, and its control points along it.
    const SIDE: f64 = 100.0;
    const POINTS: usize = 12;

    fn at(k: usize) -> f64 {
        SIDE * k as f64 / (POINTS - 1) as f64
    }

    /// A bicubic sheet, bent to a radius of 200 mm everywhere, with a spike of 60 mm near one corner.
    fn spiked_sheet() -> Surface {
        sheet(|i, j| {
            let bent = (at(i).powi(2) + at(j).powi(2)) / 400.0;
            if [i, j] == [2, 2] { bent + 60.0 } else { bent }
        })
    }

    /// A bicubic sheet of these heights, mm, at its control points, with knots one apart.
    fn sheet(height: impl Fn(usize, usize) -> f64) -> Surface {
        let points = (0..POINTS * POINTS).map(|k| [k / POINTS, k % POINTS]);
        let points = points.map(|[i, j]| Homogeneous::new(at(i), at(j), height(i, j), 1.0)).collect();
        let spans = POINTS - 3;
        let knots: Vec<f64> = [0; 3].into_iter().chain(0..=spans).chain([spans; 3]).map(|k| k as f64).collect();
        Surface { degree: [3, 3], knots: [knots.clone(), knots], points }
    }

    /// Splits a whole sheet within a budget of cells; returns them and the steps of their proofs.
    fn split_within(sheet: &Surface, budget: usize) -> (Subdivision, u64) {
        let field = ToleranceField::new([0.005; 2], [1.0, 10.0], Default::default(), 1.0);
        let surface = FaceSurface::new(sheet, false, field);
        let [[u0, u1], [v0, v1]] = sheet.domain();
        let corners = [[u0, v0], [u1, v0], [u1, v1], [u0, v1]].map(Uv::from_array);
        let vertex =
            |(k, uv): (usize, Uv)| PolygonVertex { uv, position: Position::Own(k as u32), side: BorderSide::Seam };
        let own = corners.iter().map(|uv| sheet.evaluate(*uv)).collect();
        let border = BorderPolygons {
            polygons: vec![corners.into_iter().enumerate().map(vertex).collect()],
            own,
            ..BorderPolygons::default()
        };
        let cells = split(&surface, Acceptance::Proved, &border, &[], budget, None);
        (cells, surface.steps.count())
    }

    /// A branch that needs more than its share is split again, and the others are left as they are: where all were, the second try took as
    /// much as the first.
    #[test]
    fn only_branches_that_are_short_are_split_again() {
        let sheet = spiked_sheet();
        let (once, steps) = split_within(&sheet, 1_000_000);
        let (again, of_both) = split_within(&sheet, 2 * once.len());
        let all = |s: &Subdivision| -> Vec<(Cell, f64)> { s.inside.iter().map(|c| (c.cell, c.bound)).collect() };
        assert_eq!((all(&again), &again.border), (all(&once), &once.border));
        assert!(!again.exhausted && !again.out_of_share);
        assert!(of_both > steps && of_both < steps + steps / 4, "{steps} {of_both}");
    }

    /// A wall of kilometres across a thousand-millionth of the sheet: no cell is thinner than parameters can resolve, and the result
    /// says that not all fit.
    #[test]
    fn cells_are_no_thinner_than_parameters_tell_apart() {
        let mut wall = sheet(|i, j| if i < POINTS / 2 { 0.0 } else { 1e4 * (1.0 + at(j)) });
        let middle = wall.knots[0].len() / 2;
        let gap = 1e-9 * (POINTS - 3) as f64;
        for (k, knot) in (middle - 2..middle + 2).enumerate() {
            wall.knots[0][knot] = wall.knots[0][middle] + gap * (k as f64 - 2.0);
        }
        let (cells, _) = split_within(&wall, 10_000);
        let [[u0, u1], _] = wall.domain();
        let all = cells.inside.iter().map(|c| c.cell).chain(cells.border.iter().copied());
        let thinnest = all.map(|cell| cell.hi.x - cell.lo.x).fold(f64::INFINITY, f64::min);
        assert!(thinnest >= 1e-7 * (u1 - u0) && cells.exhausted, "{thinnest}");
    }
}

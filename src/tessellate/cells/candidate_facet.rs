//! A cell as a facet that may do: nine points of it, the better diagonal, the bound.

use super::cell::Cell;
use crate::math::{Point, Uv, Vector};
use crate::tessellate::face_surface::FaceSurface;
use crate::tessellate::proof::flat_triangle::distance_to_chord;
use crate::tessellate::proof::prover::Prover;
use smallvec::SmallVec;
use std::iter;

/// Shares of the tolerance that the curve over the diagonal may stray from it in a cell that is proved as one quad. With hanging vertices
/// the cell falls into triangles, which are held to such curves: without a limit 250 of 19,690 facets of a very rough surface are not
/// proved.
const FARTHEST: f64 = 2.0;
/// Share by which the second diagonal must be nearer to the surface to be taken: rounding does not decide.
const NEARER: f64 = 1e-9;
/// Share by which the sags along u and v must differ to decide where a cell is cut; else its longer side is.
const SAG_DIFFERENCE: f64 = 0.05;
/// The same for the turns of the normals along u and v.
const TURN_DIFFERENCE: f64 = 0.05;
/// Width of a triangle, in shares of its longest side, below which it lies in no plane: at a pole two of its corners are one.
const LEAST_WIDTH: f64 = 1e-9;
/// Where a line is looked at besides its middle.
const QUARTERS: [f64; 2] = [0.25, 0.75];
/// Most knot spans of a line that are looked at.
const MOST_SPANS: usize = 64;

/// Corners of a facet: parameters and places, the traced diagonal from the first to the third.
pub(in crate::tessellate) type Corners = [(Uv, Point); 4];

/// Returns a bound, mm, of the distance between the surface and the triangles (0, 1, 2) and (0, 2, 3), sides and diagonal included, where
/// it is at most `limit`; a larger value only says that none was proved. The corners lie on the surface.
pub(in crate::tessellate) fn quad_bound(prover: &mut Prover<'_, '_>, c: &Corners, limit: f64) -> f64 {
    let mut worst = 0f64;
    let mut open: SmallVec<[[usize; 3]; 2]> = SmallVec::new();
    for [i, j, k] in [[0, 1, 2], [0, 2, 3]] {
        // First the quick look, which decides most; inside and sides one by one only where it does not.
        match prover.facet_bound([c[i].0, c[j].0, c[k].0], [c[i].1, c[j].1, c[k].1], true, limit) {
            Some(bound) if bound > limit => return bound,
            Some(bound) => worst = worst.max(bound),
            None => open.push([i, j, k]),
        }
    }
    for &[i, j, k] in &open {
        worst = worst.max(prover.triangle_bound([c[i].0, c[j].0, c[k].0], [c[i].1, c[j].1, c[k].1], limit));
        if worst > limit {
            return worst;
        }
    }
    for (i, j) in open.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]) {
        // Both triangles hold the diagonal: once is enough.
        if (i, j) == (0, 2) && open.len() == 2 {
            continue;
        }
        worst = worst.max(prover.side_bound([c[i].0, c[j].0], [c[i].1, c[j].1], limit));
        if worst > limit {
            return worst;
        }
    }
    worst
}

/// A cell seen at nine points of the surface: its corners, the middles of its sides, and its middle.
pub(in crate::tessellate) struct CandidateFacet {
    /// Places, by step along u and then along v.
    p: [[Point; 3]; 3],
    /// The largest distance, mm, of a middle point from the chord between its ends, among the three lines along u and the three along v.
    pub(in crate::tessellate) sag: [f64; 2],
}

impl CandidateFacet {
    /// The longer of the diagonals between its corners, mm.
    pub(in crate::tessellate) fn extent(&self) -> f64 {
        self.p[0][0].distance(self.p[2][2]).max(self.p[0][2].distance(self.p[2][0]))
    }

    /// Evaluates the surface at the corners, side middles and middle of the cell, and measures sags; proves nothing.
    pub(in crate::tessellate) fn new(surface: &FaceSurface<'_>, cell: Cell) -> Self {
        let middle = cell.center();
        let p = surface.lattice([cell.lo.x, middle.x, cell.hi.x], [cell.lo.y, middle.y, cell.hi.y]);
        let u = (0..3).map(|j| distance_to_chord(p[1][j], &[p[0][j], p[2][j]])).fold(0.0, f64::max);
        let v = (0..3).map(|i| distance_to_chord(p[i][1], &[p[i][0], p[i][2]])).fold(0.0, f64::max);
        Self { p, sag: [u, v] }
    }

    /// Returns the larger of the two sags, mm.
    pub(in crate::tessellate) fn largest_sag(&self) -> f64 {
        self.sag[0].max(self.sag[1])
    }

    /// Returns which parameter's range to halve where the cell does not fit within `limit`, mm: 0 for u, 1 for v. May evaluate the surface
    /// at four points more, then once in each knot span.
    pub(in crate::tessellate) fn parameter_to_halve(
        &self,
        surface: &FaceSurface<'_>,
        cell: Cell,
        limit: f64,
    ) -> usize {
        let [mut u, mut v] = self.sag;
        // A profile like an S passes through the middle of its chord: by the middle alone a trumpet was cut into 100,000 columns, and
        // never across. Where middles do not show why a cell fails, quarters are examined.
        if u.max(v) <= limit {
            let share = |d: usize, share: f64| cell.lo[d] + (cell.hi[d] - cell.lo[d]) * share;
            let quarters = |d: usize| self.middle_line_sag(surface, cell, d, QUARTERS.map(|q| share(d, q)));
            (u, v) = (u.max(quarters(0)), v.max(quarters(1)));
        }
        // Of four turns of a spring the quarters lie over the chord too, and half of its strip was cut into 100,000 columns.
        if u.max(v) <= limit {
            let spans =
                |d: usize| self.middle_line_sag(surface, cell, d, span_middles(&surface.breaks[d], cell, d));
            (u, v) = (u.max(spans(0)), v.max(spans(1)));
        }
        let p = &self.p;
        let length = |a: usize, b: usize, c: usize, d: usize| (p[c][d] - p[a][b]).length();
        // Only where one sag is clearly larger: on a ball both are alike, and rounding would make a different tree
        // at every tolerance.
        if (u - v).abs() > SAG_DIFFERENCE * u.max(v) {
            return if u > v { 0 } else { 1 };
        }
        let along_u = length(0, 1, 2, 1).max(length(0, 1, 1, 1));
        let along_v = length(1, 0, 1, 2).max(length(1, 0, 1, 1));
        if along_u >= along_v { 0 } else { 1 }
    }

    /// Returns the largest distance, mm, from its chord of the middle line along direction `d` at these parameters; 0 without any.
    fn middle_line_sag(
        &self,
        surface: &FaceSurface<'_>,
        cell: Cell,
        d: usize,
        parameters: impl IntoIterator<Item = f64>,
    ) -> f64 {
        let chord = [[self.p[0][1], self.p[2][1]], [self.p[1][0], self.p[1][2]]][d];
        let mut at = cell.center();
        let off = |parameter: f64| {
            at[d] = parameter;
            distance_to_chord(surface.point(at), &chord)
        };
        parameters.into_iter().map(off).fold(0.0, f64::max)
    }

    /// Whether one of the two triangles along the better diagonal lies farther than `most`, radians, from the surface normal at one of its
    /// corners, or two normals at the cell's corners differ by twice as much. Corners without a normal are passed over.
    pub(in crate::tessellate) fn is_steep(&self, surface: &FaceSurface<'_>, cell: Cell, most: f64) -> bool {
        let normals = corner_normals(surface, cell);
        let known = || normals.iter().flatten();
        // Normals within the angle of one facet differ by twice as much at most.
        if known().any(|a| known().any(|b| a.angle_between(*b) > 2.0 * most)) {
            return true;
        }
        let (p, r) = (self.places(), self.first_corner());
        [[0, 1, 2], [0, 2, 3]].into_iter().any(|t: [usize; 3]| {
            let corners = t.map(|k| (k + r) % 4);
            let [a, b, c] = corners.map(|k| p[k]);
            let across = (b - a).cross(c - a);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            // Which way it is turned is not checked here.
            let off = |n: Vector| across.angle_between(n).min((-across).angle_between(n));
            across.length() > LEAST_WIDTH * longest * longest
                && corners.iter().filter_map(|&k| normals[k]).any(|n| off(n) > most)
        })
    }

    /// Returns the parameter, 0 for u and 1 for v, along which the normals at the corners turn farther; `None` where one of them is
    /// missing or they turn about as far along both.
    pub(in crate::tessellate) fn direction_of_turn(surface: &FaceSurface<'_>, cell: Cell) -> Option<usize> {
        let [a, b, c, d] = corner_normals(surface, cell);
        let (a, b, c, d) = (a?, b?, c?, d?);
        let along_u = a.angle_between(b).max(d.angle_between(c));
        let along_v = b.angle_between(c).max(a.angle_between(d));
        let is_clear = (along_u - along_v).abs() > TURN_DIFFERENCE * along_u.max(along_v);
        is_clear.then_some(if along_u > along_v { 0 } else { 1 })
    }

    /// Places of the corners, in the order of [`Cell::corners`].
    pub(in crate::tessellate) fn places(&self) -> [Point; 4] {
        [self.p[0][0], self.p[2][0], self.p[2][2], self.p[0][2]]
    }

    /// Returns the corner at which the better diagonal starts, the one that lies nearer to the surface: 0 or 1.
    pub(in crate::tessellate) fn first_corner(&self) -> usize {
        self.diagonal().0
    }

    /// Returns the corner at which the diagonal nearer to the middle starts, 0 or 1, and the distance of the middle from it, mm.
    fn diagonal(&self) -> (usize, f64) {
        let (p, m) = (self.places(), self.p[1][1]);
        let (a, b) = (distance_to_chord(m, &[p[0], p[2]]), distance_to_chord(m, &[p[1], p[3]]));
        // Near ties go to the first diagonal, or rounding would decide and mirror-symmetric faces come out unlike.
        if b < a * (1.0 - NEARER) { (1, b) } else { (0, a) }
    }

    /// Returns a bound, mm, of the cell as a facet cut along the better diagonal, proved where it is at most `limit`; above, it says only
    /// that none was.
    pub(in crate::tessellate) fn bound(&self, prover: &mut Prover<'_, '_>, cell: Cell, limit: f64) -> f64 {
        let (r, off) = self.diagonal();
        // Cells with hanging vertices are cut along this diagonal after all, and must not be far from it.
        if off <= FARTHEST * limit
            && let Some(bound) = prover.quad_bound([cell.lo, cell.hi], &self.places(), r, limit)
        {
            return bound;
        }
        // The middle of the cell is that of the diagonal's curve: no bound can be below.
        if off > limit {
            return off;
        }
        let (p, uv) = (self.places(), cell.corners());
        quad_bound(prover, &std::array::from_fn(|k| (uv[(k + r) % 4], p[(k + r) % 4])), limit)
    }
}

/// Returns the unit normals at a cell's corners, in the order of [`Cell::corners`], on creases those of its side; `None` where there is
/// none.
fn corner_normals(surface: &FaceSurface<'_>, cell: Cell) -> [Option<Vector>; 4] {
    cell.corners().map(|corner| surface.normal_towards(corner, cell.center()))
}

/// Returns the middles of the knot spans that a cell crosses in direction `d`, of [`MOST_SPANS`] at most, evenly chosen; of a single span
/// none.
fn span_middles(breaks: &[f64], cell: Cell, d: usize) -> impl Iterator<Item = f64> {
    let (lo, hi) = (cell.lo[d], cell.hi[d]);
    let inner = &breaks[breaks.partition_point(|&t| t <= lo)..breaks.partition_point(|&t| t < hi)];
    let ends = iter::once(lo).chain(inner.iter().copied());
    let middles = ends.zip(inner.iter().copied().chain([hi])).map(|(a, b)| 0.5 * (a + b));
    middles.skip(usize::from(inner.is_empty())).step_by(inner.len() / MOST_SPANS + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Homogeneous;
    use crate::nurbs::Surface;
    use crate::tessellate::settings::ToleranceField;

    #[test]
    fn a_profile_like_an_s_is_cut_across() {
        // Along v from (0, 0) to (6, 6) through the middle of the chord; along u an arc that sags by 0.01.
        let profile = [(0.0, 0.0), (0.0, 3.0), (6.0, 3.0), (6.0, 6.0)];
        let points = [0.0, 1.0, 2.0]
            .map(|u| profile.map(|(x, z)| Homogeneous::new(x, u, z + if u == 1.0 { 0.02 } else { 0.0 }, 1.0)));
        let knots = [[vec![0.0; 3], vec![1.0; 3]].concat(), [vec![0.0; 4], vec![1.0; 4]].concat()];
        let spline = Surface { degree: [2, 3], knots, points: points.as_flattened().to_vec() };
        let field = ToleranceField::new([0.1; 2], [1.0, 10.0], Default::default(), 1.0);
        let surface = FaceSurface::new(&spline, false, field);
        let cell = Cell { lo: Uv::ZERO, hi: Uv::ONE };
        let candidate = CandidateFacet::new(&surface, cell);
        // The curve's farthest from its chord: by symmetry on either side of the middle, and none in it.
        assert!(candidate.sag[0] > 0.009 && candidate.sag[1] < 1e-12, "{:?}", candidate.sag);
        assert_eq!(candidate.parameter_to_halve(&surface, cell, 0.1), 1);
    }

    /// Along v a wave over the line from knot 2 to knot 6, on the line at each knot; along u an arc that sags by 0.01.
    #[test]
    fn a_wave_with_its_quarters_on_the_chord_is_cut_across() {
        let wave = |k: usize| (k as f64, if k.is_multiple_of(2) { 4.0 } else { -4.0 });
        let row = |u: f64| {
            let lift = if u == 1.0 { 0.02 } else { 0.0 };
            (0..8).map(wave).map(move |(x, z)| Homogeneous::new(x, u, z + lift, 1.0))
        };
        let points = [0.0, 1.0, 2.0].into_iter().flat_map(row).collect();
        let knots = [[vec![0.0; 3], vec![1.0; 3]].concat(), (0..11).map(|k| k as f64 - 1.0).collect()];
        let spline = Surface { degree: [2, 2], knots, points };
        let field = ToleranceField::new([0.1; 2], [1.0, 10.0], Default::default(), 1.0);
        let surface = FaceSurface::new(&spline, false, field);
        let cell = Cell { lo: Uv::new(0.0, 2.0), hi: Uv::new(1.0, 6.0) };
        let candidate = CandidateFacet::new(&surface, cell);
        assert!(candidate.sag[0] > 0.009 && candidate.sag[1] < 1e-12, "{:?}", candidate.sag);
        assert_eq!(candidate.parameter_to_halve(&surface, cell, 0.1), 1);
    }
}

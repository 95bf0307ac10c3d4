//! A face's surface laid out for quick evaluation, with what meshing needs of it: tolerance, normals, creases, poles.

use super::proof_steps::ProofSteps;
use super::second_derivatives::SecondDerivativeBounds;
use super::settings::ToleranceField;
use crate::math::{Point, Uv, Vector};
use crate::nurbs::{BezierPatch, FundamentalForms, SecondDerivatives, Surface};

/// Share of the domain, and of the surface's size or what rounds a point on it if that is more, within which a place is a pole; borders end
/// there up to their rounding.
const POLE: f64 = 1e-9;

/// Sine of the angle between tangents from which a knot is a crease, and from which it is one that nothing may lie across: shallower
/// ones, as between arcs that were fitted together, took twice the facets on a connecting rod.
const BENT: f64 = 1e-3;
const SHARP: f64 = 0.05;
/// Share of the domain within which a place is on a crease.
pub(super) const CREASE: f64 = 1e-7;

/// Rounding margin of a proof, as a share of the surface's size: some thousand roundings of a coordinate.
const SIZE_MARGIN: f64 = 1e-12;
/// Rounding margin in ulps of the largest coordinate, which governs far from the origin: without it a ball of 1 mm at 10¹¹ mm strayed from
/// its facets by ten times the bound.
const PLACE_MARGIN_ULPS: f64 = 16.0;
/// Largest tolerance of a surface that closes on itself, in shares of its size; a ball is a third as large in radius as its box is across.
const CLOSED_TOLERANCE: f64 = 0.05;
/// Ratio of the lengths of both derivatives below which the shorter is nothing but rounding.
const NO_DERIVATIVE: f64 = 1e-10;
/// Share of the domain by which a normal is looked for beside a crease that runs into a pole.
const BESIDE_CREASE: f64 = 1e-9;
/// Share of the way to the domain's centre at which the curvature of a pole is taken.
const BESIDE_POLE: f64 = 1e-3;
/// Share of a weight within which those of an affine image of its parameters are equal.
const EQUAL_WEIGHTS: f64 = 1e-14;
/// Share of the shorter knot interval at which tangents on both sides of a knot are compared, and at how many places along it.
const CREASE_STEP: f64 = 1e-6;
const CREASE_PLACES: usize = 9;
/// Where in its share of the knot such a place lies: not in the middle, where symmetric surfaces have no jump.
const OFF_SYMMETRY: f64 = 0.37;

/// A face's surface with its Bézier patches laid out for quick evaluation.
pub(super) struct FaceSurface<'a> {
    pub(super) spline: &'a Surface,
    /// Its tolerance from place to place.
    pub(super) field: ToleranceField,
    /// Whether the outward normal is `-(Su × Sv)`.
    flip: bool,
    /// Whether the surface is an affine image of its parameters, so that any facet lies in it.
    pub(super) affine: bool,
    patches: Vec<BezierPatch>,
    /// How much it bends, patch by patch.
    pub(super) curving: SecondDerivativeBounds,
    /// Distinct knots in u and v, ascending, both ends of the domain included.
    pub(super) breaks: [Vec<f64>; 2],
    /// Parameters with a crease or corner of the surface, in u and v.
    pub(super) creases: [Vec<f64>; 2],
    /// Those at which nothing may lie across.
    pub(super) sharp: [Vec<f64>; 2],
    /// Diagonal of the box around the control points, mm of the part.
    pub(super) size: f64,
    /// What covers the rounding of points on it in a proof, mm.
    pub(super) rounding: f64,
    /// Whether sides of the domain are single points: those at both ends of u, and of v.
    poles: [[bool; 2]; 2],
    /// Whether both ends of u, of v are one curve in space.
    pub(super) closed: [bool; 2],
    /// How far the face's edges lie from the surface, mm, where the file was measured.
    pub(super) gap: Option<f64>,
    /// Farthest that a pole's side strays from a point, mm; 0 without poles.
    pub(super) pole_size: f64,
    /// What the proofs on it have taken.
    pub(super) steps: ProofSteps,
}

impl<'a> FaceSurface<'a> {
    /// Lays out a face's surface; `flip` where the face looks against Su × Sv. The tolerance is lowered on small surfaces closed in both
    /// directions, of which it would leave nothing. Gap unknown and steps unlimited, for the caller to set.
    pub(super) fn new(surface: &'a Surface, flip: bool, field: ToleranceField) -> Self {
        let breaks = [0, 1].map(|d| surface.breakpoints(d));
        let sharper = |least: f64| [0, 1].map(|d| crease_knots(surface, d, &breaks, least));
        let creases = sharper(BENT);
        // Most surfaces have no creases at all, and need not be looked at twice.
        let sharp = if creases.iter().all(|c| c.is_empty()) { creases.clone() } else { sharper(SHARP) };
        let patches = surface.bezier_patches();
        let bounds = surface.bounds();
        let size = bounds.diagonal();
        let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
        let curving = SecondDerivativeBounds::new(surface, &patches, &breaks);
        let rounding = (SIZE_MARGIN * size).max(PLACE_MARGIN_ULPS * f64::EPSILON * farthest);
        let least = (POLE * size).max(rounding);
        let poles = [0, 1].map(|d| [0, 1].map(|end| side_size(surface, d, end) <= least));
        let pole_size = if poles.iter().flatten().any(|&p| p) { least } else { 0.0 };
        let affine = is_affine(surface, rounding);
        // A ball or ring within its tolerance would be a point: all its triangles had two corners in one place.
        // Within what rounds them points are one.
        let most = (CLOSED_TOLERANCE * size).max(rounding);
        let closed = [0, 1].map(|d| is_closed(surface, d, least));
        let ends = |d: usize| poles[d] == [true; 2] || closed[d];
        // Closed in both directions, or from pole to pole: only then can a large tolerance leave nothing of the
        // surface.
        let small = field.loosest() > most && (poles.contains(&[true; 2]) || ends(0) && ends(1));
        let field = if small { field.at_most(most) } else { field };
        Self {
            spline: surface,
            field,
            flip,
            affine,
            patches,
            curving,
            breaks,
            creases,
            sharp,
            size,
            rounding,
            poles,
            closed,
            gap: None,
            pole_size,
            steps: ProofSteps::new(u64::MAX),
        }
    }

    /// Returns the parameter that is constant along the pole on which `uv` lies, 0 for u or 1 for v; `None` off the poles.
    pub(super) fn pole(&self, uv: Uv) -> Option<usize> {
        // Most surfaces have none, and each facet asks for all of its corners.
        if self.pole_size == 0.0 {
            return None;
        }
        let domain = self.spline.domain();
        let near = |d: usize, end: usize| {
            let [a, b] = domain[d];
            (uv[d] - domain[d][end]).abs() <= POLE * (b - a)
        };
        (0..2).find(|&d| (0..2).any(|end| self.poles[d][end] && near(d, end)))
    }

    /// Returns the size of the surface's domain in u and v.
    pub(super) fn extent(&self) -> Uv {
        let [[u0, u1], [v0, v1]] = self.spline.domain();
        Uv::new(u1 - u0, v1 - v0)
    }

    /// Returns the index of the knot interval that holds parameter `x` of u (0) or v (1); beyond the domain the first or last, on a knot
    /// the one that begins there.
    pub(super) fn interval(&self, direction: usize, x: f64) -> usize {
        let b = &self.breaks[direction];
        b[1..b.len() - 1].partition_point(|&k| k <= x)
    }

    /// Returns the first and last knot interval of direction `d` that `[x, y]` meets; one in which only `y` itself would lie does not
    /// count.
    pub(super) fn range(&self, d: usize, x: f64, y: f64) -> [usize; 2] {
        let (a, mut b) = (self.interval(d, x), self.interval(d, y));
        // An interval that is met in its first parameter alone belongs to the one before.
        if b > a && self.breaks[d][b] >= y {
            b -= 1;
        }
        [a, b]
    }

    /// Returns the Bézier patch of the `a`-th knot interval in u and the `b`-th in v.
    pub(super) fn patch(&self, a: usize, b: usize) -> &BezierPatch {
        &self.patches[a * (self.breaks[1].len() - 1) + b]
    }

    /// Returns the point of the surface, in the part's coordinates; `uv` must lie in the domain.
    pub(super) fn point(&self, uv: Uv) -> Point {
        let patch = self.patch(self.interval(0, uv.x), self.interval(1, uv.y));
        patch.homogeneous_point(patch_uv(patch, uv)).project()
    }

    /// Returns the points at ascending `u` and `v`, the first index that of `u`; the same bits as [`FaceSurface::point`].
    pub(super) fn lattice(&self, u: [f64; 3], v: [f64; 3]) -> [[Point; 3]; 3] {
        let (a, b) = (self.interval(0, u[0]), self.interval(1, v[0]));
        // Corners of a cell mostly lie on one patch; where they do, nine evaluations share their basis functions.
        let one = a == self.interval(0, u[2]) && b == self.interval(1, v[2]);
        if !one {
            return u.map(|x| v.map(|y| self.point(Uv::new(x, y))));
        }
        let patch = self.patch(a, b);
        let [x, y, z] = [0, 1, 2].map(|i| patch_uv(patch, Uv::new(u[i], v[i])));
        patch.homogeneous_lattice([x.x, y.x, z.x], [x.y, y.y, z.y]).map(|row| row.map(|c| c.project()))
    }

    /// Returns the position and derivatives, up to the second, at parameters inside the domain.
    pub(super) fn second_derivatives(&self, uv: Uv) -> SecondDerivatives {
        let patch = self.patch(self.interval(0, uv.x), self.interval(1, uv.y));
        patch.second_derivatives(patch_uv(patch, uv))
    }

    /// Returns the fundamental forms at parameters inside the domain; `None` at poles and cusps.
    fn forms(&self, uv: Uv) -> Option<FundamentalForms> {
        FundamentalForms::new(&self.second_derivatives(uv))
    }

    /// Returns the outward unit normal, at a pole its limit; `None` where there is none.
    pub(super) fn normal(&self, uv: Uv) -> Option<Vector> {
        // Where the control points of a pole were rounded, be it by a centre far away, the two derivatives there span any plane.
        let normal = if self.pole(uv).is_some() { self.spline.limit_normal(uv) } else { self.spline.normal(uv) };
        normal.map(|n| if self.flip { -n } else { n })
    }

    /// Whether the surface has creases.
    pub(super) fn is_creased(&self) -> bool {
        self.creases.iter().any(|c| !c.is_empty())
    }

    /// Whether one of the surface's creases is sharp.
    pub(super) fn is_sharp(&self) -> bool {
        self.sharp.iter().any(|c| !c.is_empty())
    }

    /// Returns the crease in u, and that in v, on which `uv` lies; `None` where it lies on none.
    pub(super) fn on_creases(&self, uv: Uv) -> [Option<f64>; 2] {
        let near = CREASE * self.extent();
        [0, 1].map(|d| self.creases[d].iter().copied().find(|c| (c - uv[d]).abs() <= near[d]))
    }

    /// Returns the outward unit normal, on a crease that of the side on which `inside` lies; `None` where there is none.
    pub(super) fn normal_towards(&self, uv: Uv, inside: Uv) -> Option<Vector> {
        let on = self.on_creases(uv);
        if on == [None; 2] {
            return self.normal(uv);
        }
        let [a, b] = [0, 1].map(|d| match on[d] {
            // The patch on the facet's own side of the crease has the normal that the facet must show.
            Some(crease) => self.interval(d, crease) - usize::from(inside[d] < crease),
            None => self.interval(d, uv[d]),
        });
        let patch = self.patch(a, b);
        let d = patch.second_derivatives(patch_uv(patch, uv).clamp(Uv::ZERO, Uv::ONE));
        let (lu, lv) = (d.du.length(), d.dv.length());
        if lu.min(lv) <= NO_DERIVATIVE * lu.max(lv) {
            // At a pole rounding is all that is left of one derivative: the limit there, a little beside the crease.
            let beside =
                |d: usize| on[d].map_or(uv[d], |c| c + (BESIDE_CREASE * self.extent()[d]).copysign(inside[d] - c));
            return self.normal(Uv::new(beside(0), beside(1)));
        }
        let n = d.du.cross(d.dv).try_normalize();
        n.map(|n| if self.flip { -n } else { n }).or_else(|| self.normal(uv))
    }

    /// Whether facets that face outward run clockwise in the parameter plane.
    pub(super) fn is_flipped(&self) -> bool {
        self.flip
    }

    /// Returns the tolerance at `uv`, mm of the part, by the curvature there; at a pole by that just beside it.
    pub(super) fn tolerance(&self, uv: Uv) -> f64 {
        self.tolerance_in(&self.field, uv)
    }

    /// As [`FaceSurface::tolerance`], of another field than the surface's own.
    pub(super) fn tolerance_in(&self, field: &ToleranceField, uv: Uv) -> f64 {
        // With one tolerance everywhere no curvature is computed, which would cost second derivatives.
        if self.affine || field.tightest() == field.loosest() {
            return field.loosest();
        }
        let [[u0, u1], [v0, v1]] = self.spline.domain();
        let forms = self.forms(uv).or_else(|| {
            // Curvature at a pole is that just beside it.
            let center = Uv::new(0.5 * (u0 + u1), 0.5 * (v0 + v1));
            self.forms(uv.lerp(center, BESIDE_POLE))
        });
        field.tolerance_at(forms.map_or(f64::INFINITY, |f| f.largest_curvature()))
    }
}

/// Returns the largest distance, in the surface's lengths, of a control point from the first one on the side at the start (`end` 0) or end
/// (1) of direction `d`: next to nothing at a pole.
fn side_size(s: &Surface, d: usize, end: usize) -> f64 {
    let counts = s.counts();
    let fixed = if end == 0 { 0 } else { counts[d] - 1 };
    let at = |k: usize| {
        let (i, j) = if d == 0 { (fixed, k) } else { (k, fixed) };
        s.points[i * counts[1] + j].project()
    };
    (1..counts[1 - d]).map(|k| (at(k) - at(0)).length()).fold(0.0, f64::max)
}

/// Whether the control points at both ends of direction `d` lie within `least` of each other.
fn is_closed(s: &Surface, d: usize, least: f64) -> bool {
    let counts = s.counts();
    let at = |i: usize, j: usize| s.points[i * counts[1] + j].project();
    let last = counts[d] - 1;
    // Control points suffice: ends with one net are one curve.
    let pair = |k: usize| if d == 0 { [at(0, k), at(last, k)] } else { [at(k, 0), at(k, last)] };
    (0..counts[1 - d]).map(pair).all(|[a, b]| (a - b).length() <= least)
}

/// Returns the parameters of a patch, 0 to 1 over its domain, for those of its surface.
pub(super) fn patch_uv(patch: &BezierPatch, uv: Uv) -> Uv {
    let [[u0, u1], [v0, v1]] = patch.domain;
    Uv::new((uv.x - u0) / (u1 - u0), (uv.y - v0) / (v1 - v0))
}

/// Whether the surface is an affine map of its parameters: all control points lie on one affine image of their Greville abscissas, with
/// equal weights, within `rounding`, mm.
fn is_affine(s: &Surface, rounding: f64) -> bool {
    let [nu, nv] = s.counts();
    // A spline whose control points lie on an affine map at their Greville abscissas is that map.
    let greville =
        |d: usize, i: usize| s.knots[d][i + 1..=i + s.degree[d]].iter().sum::<f64>() / s.degree[d] as f64;
    let (g0, g1) = ([greville(0, 0), greville(1, 0)], [greville(0, nu - 1), greville(1, nv - 1)]);
    let w = s.points[0].w;
    let at = |i: usize, j: usize| s.points[i * nv + j].project();
    let (o, x, y) = (at(0, 0), at(nu - 1, 0) - at(0, 0), at(0, nv - 1) - at(0, 0));
    (0..nu).all(|i| {
        (0..nv).all(|j| {
            let a = (greville(0, i) - g0[0]) / (g1[0] - g0[0]);
            let b = (greville(1, j) - g0[1]) / (g1[1] - g0[1]);
            let off = (at(i, j) - (o + x * a + y * b)).length();
            off <= rounding && (s.points[i * nv + j].w - w).abs() <= EQUAL_WEIGHTS * w
        })
    })
}

/// Returns the inner knots of direction `d`, of a multiplicity no less than the degree, where the sine of the angle between the tangents on
/// both sides exceeds `least` at one of a few places across.
fn crease_knots(s: &Surface, d: usize, breaks: &[Vec<f64>; 2], least: f64) -> Vec<f64> {
    let b = &breaks[d];
    let knots = &s.knots[d];
    let inner = b[1..b.len() - 1].iter().enumerate();
    inner
        // Below the degree's multiplicity the surface has one tangent across the knot.
        .filter(|(_, k)| knots.iter().filter(|x| x == k).count() >= s.degree[d])
        // Close to the knot, but far enough that parameters differ by more than their rounding.
        .filter(|&(i, &k)| {
            let step = CREASE_STEP * (b[i + 2] - k).min(k - b[i]);
            let across = &breaks[1 - d];
            let (lo, hi) = (across[0], across[across.len() - 1]);
            (0..CREASE_PLACES).any(|j| {
                let w = lo + (hi - lo) * (j as f64 + OFF_SYMMETRY) / CREASE_PLACES as f64;
                let tangent = |x: f64| {
                    let der = s.derivatives(if d == 0 { Uv::new(x, w) } else { Uv::new(w, x) });
                    if d == 0 { der.du } else { der.dv }
                };
                match (tangent(k - step).try_normalize(), tangent(k + step).try_normalize()) {
                    (Some(a), Some(c)) => a.cross(c).length() > least || a.dot(c) < 0.0,
                    _ => false,
                }
            })
        })
        .map(|(_, &k)| k)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::sweep;
    use std::f64::consts::{FRAC_PI_2, TAU};

    /// What rounds a coordinate of 10⁶ mm is ten times what a plane of 10 mm at the origin may be off, and at 10⁹ mm a pole as well.
    #[test]
    fn planes_and_poles_are_known_far_from_the_origin() {
        let field = || ToleranceField::new([0.1; 2], [1.0, 10.0], Default::default(), 1.0);
        for far in [0.0, 1e6, 1e9] {
            let frame = Frame::from_axis(Point::splat(far), Vector::new(0.3, 0.5, 0.8), None);
            let plane = sweep::plane(&frame, [[0.0, 10.0 / 3.0], [0.7, 7.9]]);
            assert!(FaceSurface::new(&plane, false, field()).affine, "{far}");
            let ball = sweep::sphere(&frame, 5.0, [0.0, TAU], [-FRAC_PI_2, FRAC_PI_2]);
            let ball = FaceSurface::new(&ball, false, field());
            assert!(!ball.affine && ball.poles.contains(&[true; 2]), "{far}");
        }
    }
}

//! Sag and normal error by dense sampling: evaluates splines by their definition and measures distances its own way, so
//! that it can judge the bound. Which facets are sampled where all would take too long is decided in `sample_budget.rs`.

use crate::math::{Point, Uv, Vector};
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::nurbs::{Derivatives, Surface};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::cell::Cell;

/// What sampling found on one facet.
#[derive(Clone, Debug, Default)]
pub(super) struct Sampled {
    /// Largest distance found, mm.
    pub(super) sag: f64,
    /// Mean distance of the facet's points to the spline, mm.
    pub(super) mean: f64,
    /// Angles between the bilinear normal and the spline's, radians.
    pub(super) normal_errors: Vec<f32>,
    /// How often the spline was evaluated for it.
    pub(super) evaluations: u64,
}

/// A spline that counts how often it is evaluated.
struct CountedSurface<'s> {
    spline: &'s Surface,
    evaluations: Cell<u64>,
}

impl<'s> CountedSurface<'s> {
    fn new(spline: &'s Surface) -> Self {
        Self { spline, evaluations: Cell::new(0) }
    }

    fn point(&self, at: Uv) -> Point {
        self.evaluations.set(self.evaluations.get() + 1);
        self.spline.evaluate(at)
    }

    fn derivatives(&self, at: Uv) -> Derivatives {
        self.evaluations.set(self.evaluations.get() + 1);
        self.spline.derivatives(at)
    }
}

/// Where a triangle's points are measured, with their shares of its mean: D. A. Dunavant, *High degree efficient symmetrical Gaussian
/// quadrature rules for the triangle*, IJNME 21 (1985), degree 4, and three places more for the largest distance alone. A plain mean of
/// points that are thicker in the middle was 15 % too high on strips of a cylinder.
const POINTS: [(f64, [f64; 3]); 9] = {
    const A: f64 = 0.445948490915965;
    const B: f64 = 0.091576213509771;
    const WA: f64 = 0.223381589678011;
    const WB: f64 = 0.109951743655322;
    [
        (WA, [1.0 - 2.0 * A, A, A]),
        (WA, [A, 1.0 - 2.0 * A, A]),
        (WA, [A, A, 1.0 - 2.0 * A]),
        (WB, [1.0 - 2.0 * B, B, B]),
        (WB, [B, 1.0 - 2.0 * B, B]),
        (WB, [B, B, 1.0 - 2.0 * B]),
        (0.0, [0.34, 0.33, 0.33]),
        (0.0, [0.5, 0.5, 0.0]),
        (0.0, [0.0, 0.5, 0.5]),
    ]
};

/// Surface samples a side of a facet.
const GRID: usize = 8;
/// Share of the distance found so far below which a piece of the surface is small enough: a start for [`project`], no more.
const SMALL_PIECE: f64 = 0.05;
/// Steps of one projection, and the share of a distance below which nothing is gained.
const MAX_STEPS: usize = 12;
const STILL: f64 = 1e-9;
/// Determinant of the first fundamental form, in shares of the product of its diagonal, at which it cannot be solved for a step.
const SINGULAR: f64 = 1e-14;

/// Samples every facet, in parallel; facets of ready meshes give zeros. Vertices need their `uv`.
pub(super) fn sample_mesh(mesh: &FacetMesh, model: &Model) -> Vec<Sampled> {
    let facets: Vec<usize> = (0..mesh.facets.len()).collect();
    sample_facets(mesh, model, &facets)
}

/// Samples the facets of these indices, in their order; lengths are mm of the scene.
pub(super) fn sample_facets(mesh: &FacetMesh, model: &Model, facets: &[usize]) -> Vec<Sampled> {
    let faces: Vec<_> = model.placed_faces().collect();
    facets
        .par_iter()
        .map(|&f| {
            let placed = &faces[mesh.facets[f].face.index()];
            let Some(face) = placed.face else { return Sampled::default() };
            let scale = placed.placement.scale;
            let corners = mesh.corners(f).map(|p| placed.placement.local_point(p));
            let sign = if face.reversed { -1.0 } else { 1.0 };
            // The normals of a reversed face are turned back: errors are measured against Su × Sv.
            let normals = mesh.facets[f]
                .vertices
                .map(|v| sign * placed.placement.local_direction(mesh.vertices[v as usize].normal));
            let mut s = sample_facet(&CountedSurface::new(&face.surface), mesh, f, corners, normals);
            s.sag *= scale;
            s.mean *= scale;
            s
        })
        .collect()
}

/// A point of a facet and a near point of the surface.
struct Foot {
    x: Point,
    uv: Uv,
    away: f64,
    /// Its share in the mean of the facet, mm².
    weight: f64,
    /// The facet's interpolated normal.
    normal: Vector,
}

/// Returns the sag and normal errors of facet `f`, in the surface's lengths. `p` are its corners in the part's coordinates, `n` their
/// normals on the side of Su × Sv.
fn sample_facet(
    surface: &CountedSurface<'_>,
    mesh: &FacetMesh,
    f: usize,
    p: [Point; 4],
    n: [Vector; 4],
) -> Sampled {
    let uv = mesh.facets[f].vertices.map(|v| mesh.vertices[v as usize].uv);
    let triangles: &[[usize; 3]] =
        if mesh.facets[f].is_triangle() { &[[0, 1, 2]] } else { &[[0, 1, 2], [0, 2, 3]] };
    let flat: SmallVec<[TriangleFrame; 2]> =
        triangles.iter().map(|t| TriangleFrame::new(t.map(|k| p[k]))).collect();
    let mut out = Sampled::default();
    // From the surface to the facet…
    for (k, t) in triangles.iter().enumerate() {
        for i in 0..=GRID {
            // The first side of the second triangle is the diagonal, which the first has looked at.
            for j in k..=GRID - i {
                let b = [(GRID - i - j) as f64, i as f64, j as f64].map(|x| x / GRID as f64);
                let at = surface.point(uv[t[0]] * b[0] + uv[t[1]] * b[1] + uv[t[2]] * b[2]);
                let mut away = flat[k].distance(at);
                // What is no farther from its own triangle than another place was decides nothing.
                if away > out.sag {
                    away = flat.iter().map(|t| t.distance(at)).fold(away, f64::min);
                    out.sag = out.sag.max(away);
                }
            }
        }
    }
    // Corners lie on the surface, but not where the file's own edges do not; the proof counts that gap too.
    for (&x, &at) in p.iter().zip(&uv) {
        if (surface.point(at) - x).length() > out.sag {
            out.sag = out.sag.max(nearest_from(surface, x, at).1);
        }
    }
    // …and from the facet to the surface, at the points of a quadrature, so that the mean is one by area.
    let mut feet: SmallVec<[Foot; 2 * POINTS.len()]> = SmallVec::new();
    for (k, t) in triangles.iter().enumerate() {
        for (weight, b) in POINTS {
            let x = p[t[0]] * b[0] + p[t[1]] * b[1] + p[t[2]] * b[2];
            // Parameters linear on the triangle start the search; the foot is what counts.
            let (at, away) = nearest_from(surface, x, uv[t[0]] * b[0] + uv[t[1]] * b[1] + uv[t[2]] * b[2]);
            feet.push(Foot {
                x,
                uv: at,
                away,
                weight: flat[k].doubled_area() * weight,
                normal: interpolated_normal(triangles.len() == 1, t, b, n),
            });
        }
    }
    let pieces: SmallVec<[[Uv; 3]; 2]> = triangles.iter().map(|t| t.map(|k| uv[k])).collect();
    out.sag = farthest_foot(surface, &mut feet, &pieces, out.sag);
    let area: f64 = flat.iter().map(TriangleFrame::doubled_area).sum();
    out.mean = feet.iter().map(|f| f.weight * f.away).sum::<f64>() / area;
    for foot in &feet {
        if let (Some(a), Some(e)) = (foot.normal.try_normalize(), surface.spline.normal(foot.uv)) {
            // The arctangent keeps its digits at small angles, where a cosine has none.
            out.normal_errors.push(a.cross(e).length().atan2(a.dot(e)) as f32);
        }
    }
    out.evaluations = surface.evaluations.get();
    out
}

/// Returns the largest distance of the feet, or `least` where none is farther; feet beyond it are looked for again over the triangles
/// `pieces` of parameters and moved where that is nearer.
fn farthest_foot(surface: &CountedSurface<'_>, feet: &mut [Foot], pieces: &[[Uv; 3]], least: f64) -> f64 {
    // Only the farthest can raise the largest distance: it alone is looked for again, as long as that brings it nearer.
    while let Some(foot) = feet.iter_mut().max_by(|a, b| a.away.total_cmp(&b.away)) {
        // Two ends of one distance differ by rounding, and no search tells which is right.
        if foot.away <= least * (1.0 + STILL) {
            return least.max(foot.away);
        }
        // A single start may end beside the nearest point: uneven weights bend the parameters.
        let (other, nearer) = nearest_from(surface, foot.x, search_pieces(surface, foot.x, pieces));
        if nearer >= foot.away * (1.0 - STILL) {
            return foot.away;
        }
        (foot.uv, foot.away) = (other, nearer);
    }
    least
}

/// Returns the normal, not of unit length, at barycentric `b` of triangle `t` (corner numbers) of a facet: bilinear in the quad's own
/// parameters, linear on a facet that is a single triangle.
fn interpolated_normal(single: bool, t: &[usize; 3], b: [f64; 3], n: [Vector; 4]) -> Vector {
    if single {
        return n[0] * b[0] + n[1] * b[1] + n[2] * b[2];
    }
    let (u, v) = if t[1] == 1 { (b[1] + b[2], b[2]) } else { (b[1], b[1] + b[2]) };
    n[0] * ((1.0 - u) * (1.0 - v)) + n[1] * (u * (1.0 - v)) + n[2] * (u * v) + n[3] * ((1.0 - u) * v)
}

/// Pieces that are followed at a time, and how often they are cut into four.
const FOLLOWED: usize = 8;
const LEVELS: usize = 40;

/// Returns the parameters of a near point on the part of the surface over the triangles `over`: quarters are followed whose flat triangles
/// lie nearest to `x`. So none is lost where weights crowd most of the parameters into one place and a step of any length leaps over the
/// surface.
fn search_pieces(surface: &CountedSurface<'_>, x: Point, over: &[[Uv; 3]]) -> Uv {
    let at = |u: Uv| (u, surface.point(u));
    let off = |p: &[(Uv, Point); 3]| TriangleFrame::new(p.map(|q| q.1)).distance(x);
    let mut best = (f64::INFINITY, over[0][0]);
    let mut pieces: Vec<[(Uv, Point); 3]> = over.iter().map(|uv| uv.map(at)).collect();
    // As many levels as halve the domain down to the spacing of numbers, unless the pieces are small before.
    for _ in 0..LEVELS {
        let mut parts = Vec::with_capacity(4 * pieces.len());
        for [a, b, c] in pieces {
            let [d, e, f] = [(a, b), (b, c), (c, a)].map(|(p, q)| at(0.5 * (p.0 + q.0)));
            for (u, p) in [a, b, c, d, e, f] {
                let away = (p - x).length();
                if away < best.0 {
                    best = (away, u);
                }
            }
            let four = [[a, d, f], [d, b, e], [f, e, c], [d, e, f]];
            parts.extend(four.into_iter().map(|p| (off(&p), p)));
        }
        if parts.len() > FOLLOWED {
            parts.select_nth_unstable_by(FOLLOWED - 1, |p, q| p.0.total_cmp(&q.0));
            parts.truncate(FOLLOWED);
        }
        let small = |[a, b, c]: &[(Uv, Point); 3]| {
            (a.1 - b.1).length().max((b.1 - c.1).length()).max((c.1 - a.1).length()) <= SMALL_PIECE * best.0
        };
        pieces = parts.into_iter().map(|p| p.1).filter(|p| !small(p)).collect();
        if pieces.is_empty() {
            break;
        }
    }
    best.1
}

/// Returns the parameters of a near, mostly the nearest, point of the whole surface.
pub(super) fn nearest_parameters(surface: &Surface, x: Point) -> Uv {
    let [[u0, u1], [v0, v1]] = surface.domain();
    let [a, b, c, d] = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)].map(|(u, v)| Uv::new(u, v));
    // Both halves of the domain, since a path of nearest triangles may run into a dead end in one.
    let surface = CountedSurface::new(surface);
    let search = |half| nearest_from(&surface, x, search_pieces(&surface, x, &[half]));
    let [first, second] = [[a, b, c], [a, c, d]].map(search);
    if second.1 < first.1 { second.0 } else { first.0 }
}

/// Returns the parameters of a near point of the surface by damped Gauss–Newton from `start`, which is clamped to the domain first; never
/// farther away than it.
pub(super) fn project(surface: &Surface, x: Point, start: Uv) -> Uv {
    nearest_from(&CountedSurface::new(surface), x, start).0
}

/// Returns what [`project`] does, and the distance there.
fn nearest_from(surface: &CountedSurface<'_>, x: Point, start: Uv) -> (Uv, f64) {
    let clamp = |u: Uv| surface.spline.clamp(u);
    let mut best = clamp(start);
    let mut d = surface.derivatives(best);
    let mut away = (d.point - x).length();
    for _ in 0..MAX_STEPS {
        let e = x - d.point;
        let (a, b, c) = (d.du.dot(d.du), d.du.dot(d.dv), d.dv.dot(d.dv));
        let det = a * c - b * b;
        // At a pole or cusp one derivative is nothing, and steps along it would be anywhere.
        if det <= SINGULAR * a * c {
            break;
        }
        let (r, s) = (e.dot(d.du), e.dot(d.dv));
        let step = Uv::new(c * r - b * s, a * s - b * r) / det;
        // What the step would take off the square of the distance were the surface flat; to try it for less costs more than it gains.
        if r * step.x + s * step.y <= 2.0 * STILL * away * away {
            break;
        }
        let full = clamp(best + step);
        let there = surface.derivatives(full);
        let mut gain = away - (there.point - x).length();
        if gain > 0.0 {
            (best, d) = (full, there);
        } else {
            // A full step may overshoot where the surface bends; one that comes nearer is enough.
            let tries = [0.5, 0.25, 0.1].map(|f| clamp(best + step * f));
            let Some(next) = tries.into_iter().find(|&u| (surface.point(u) - x).length() < away) else {
                break;
            };
            (best, d) = (next, surface.derivatives(next));
            gain = away - (d.point - x).length();
        }
        away -= gain;
        if gain <= STILL * away {
            break;
        }
    }
    (best, away)
}

/// A triangle, which may be degenerate, in its own plane: x along its longest side, y along its height. What is perpendicular to the
/// longest side is small, so that no digits are lost on needles: by products of lengths, a point over a needle of 500 m that was 0.1 µm
/// thick seemed to be 0.7 m away.
struct TriangleFrame {
    origin: Point,
    /// Unit vector along the longest side, which starts at the origin; zero where all corners are in one place.
    along: Vector,
    base: f64,
    /// Unit vector along the height; `None` where the triangle is a line.
    up: Option<Vector>,
    /// The third corner.
    top: Uv,
}

impl TriangleFrame {
    /// Makes the frame of a triangle; its corners may lie in a line or in one place.
    fn new(t: [Point; 3]) -> Self {
        let length = |k: usize| (t[(k + 1) % 3] - t[k]).length_squared();
        let longest = if length(0) >= length(1).max(length(2)) {
            0
        } else if length(1) >= length(2) {
            1
        } else {
            2
        };
        let [a, b, c] = [0, 1, 2].map(|k| t[(k + longest) % 3]);
        let along = (b - a).normalize_or_zero();
        let top = c - a;
        let across = top - along * top.dot(along);
        let height = across.length();
        let up = (height > 0.0).then(|| across / height);
        Self { origin: a, along, base: (b - a).length(), up, top: Uv::new(top.dot(along), height) }
    }

    /// Returns twice its area, but no less than the least number: shares of areas are to have a sum.
    fn doubled_area(&self) -> f64 {
        (self.base * self.top.y).max(f64::MIN_POSITIVE)
    }

    /// Returns the distance of a point.
    fn distance(&self, p: Point) -> f64 {
        let q = p - self.origin;
        let x = q.dot(self.along);
        let off = q - self.along * x;
        let Some(up) = self.up else {
            return (Uv::new(x - x.clamp(0.0, self.base), off.length())).length();
        };
        let at = Uv::new(x, off.dot(up));
        let above = (off - up * at.y).length();
        let corners = [Uv::ZERO, Uv::new(self.base, 0.0), self.top];
        let side = |k: usize| [corners[k], corners[(k + 1) % 3]];
        let is_inside = (0..3).all(|k| (side(k)[1] - side(k)[0]).perp_dot(at - side(k)[0]) >= 0.0);
        if is_inside {
            return above;
        }
        let to_side = |[m, n]: [Uv; 2]| {
            let d = n - m;
            (at - m - d * ((at - m).dot(d) / d.length_squared()).clamp(0.0, 1.0)).length_squared()
        };
        let beside = (0..3).map(|k| to_side(side(k))).fold(f64::INFINITY, f64::min);
        (beside + above * above).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_to_needles_keep_their_digits() {
        // Needles of 500 m and of all widths down to a nanometre, far from the origin; a point 0.01 mm above a place inside.
        let origin = Point::new(1e5, -2e5, 3e5);
        let x = Vector::new(1.0, 2.0, 2.0) / 3.0;
        let y = Vector::new(2.0, 1.0, -2.0) / 3.0;
        let z = x.cross(y);
        for width in [1e3, 1.0, 1e-3, 1e-4, 1e-6] {
            let t = [origin, origin + x * 5e5, origin + x * 2e5 + y * width];
            for share in [0.1, 0.5, 0.9] {
                let p = t[0] * (0.4 * share) + t[1] * (0.6 * share) + t[2] * (1.0 - share) + z * 0.01;
                let found = TriangleFrame::new(t).distance(p);
                // Coordinates of 5e5 mm are rounded by 1e-10 mm.
                assert!((found - 0.01).abs() < 1e-8, "{width} {share}: {found}");
            }
        }
    }
}

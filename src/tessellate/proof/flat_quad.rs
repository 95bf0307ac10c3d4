//! The proof of a cell as one quad: the net of its piece of the surface against a flat quad.
//!
//! Two triangles that share a diagonal are nearly flat where a cell is small. Let Q be the flat quad on which the four corners of the
//! cell project along n, the normal to both diagonals; the corners stand a height h above or below Q in turn, so the traced triangles
//! T lie within h of it. With d the distance of the piece P from Q, and e that of the curves over the cell's four sides from
//! their chords:
//!
//! * P to T: at most δ = d + h. The distance to the convex Q is convex, so d is bounded by the hulls of the nets over all patches that the
//!   cell meets; their distances are halved as a scalar function while that helps.
//! * T to P: T is a graph over Q with slopes of at most tan θ. Where the projection of P along n covers that of a point x of T, the
//!   piece has a point p above or below x; p is within δ of a point of T, so it is within δ/cos θ of x. Where it does not, the curves
//!   around P do not wind around x in projection; drawn straight onto their chords they do, so one has crossed x on the way, and a point of
//!   that curve is within e/cos θ of x.
//!
//! The curve over the diagonal plays no part, where the proof of each triangle by itself must hold it to the traced diagonal: on a surface
//! that is uneven or twisted in its own plane that alone cuts cells. And one net takes the place of the nets of two triangles.

use super::flat_triangle::distance_to_chord;
use super::prover::Prover;
use crate::math::{Point, Uv, Vector, squared_distance_to_segment};
use crate::tessellate::face_surface::patch_uv;
use crate::tessellate::settings::Acceptance;

/// Knot rectangles up to which a cell is looked at as one quad.
const MAX_PATCHES: usize = 16;
/// Halvings for one cell.
const MAX_HALVINGS: u32 = 24;
/// Least cosine between the quad and its triangles, so that little is lost.
const FLATTEST: f64 = 0.9;
/// Least sine between sides that meet: a corner that is nearly straight or folded has no normal to speak of.
const SHARPEST: f64 = 1e-6;

/// A convex flat quad that measures distances, and what its corners have lost against the true ones.
struct FlatQuad {
    corners: [Point; 4],
    normal: Vector,
    /// Across each side into the quad.
    inward: [Vector; 4],
    /// How far the true corners stand above or below it, mm.
    height: f64,
    /// Least cosine between it and the triangles on the true corners.
    cosine: f64,
}

impl FlatQuad {
    /// Returns the flat quad nearest to the corners `c`, given in order around it; the traced diagonal starts at corner `first`. `None`
    /// unless it is convex and its triangles nearly flat.
    fn new(c: &[Point; 4], first: usize) -> Option<Self> {
        let normal = (c[2] - c[0]).cross(c[3] - c[1]).try_normalize()?;
        // A plane across both diagonals has the corners equally far above and below it, in turn.
        let height = 0.5 * (c[1] - c[0]).dot(normal);
        let corners = [0, 1, 2, 3].map(|k| c[k] + normal * if k % 2 == 0 { height } else { -height });
        let side = |k: usize| corners[(k + 1) % 4] - corners[k];
        let inward = [0, 1, 2, 3].map(|k| normal.cross(side(k)));
        let convex = (0..4).all(|k| {
            let next = side((k + 1) % 4);
            inward[k].dot(next) > SHARPEST * inward[k].length() * next.length()
        });
        let at = |k: usize| c[(k + first) % 4];
        let cosines = [[0, 1, 2], [0, 2, 3]].map(|[i, j, k]| {
            // The traced triangles are steeper than the quad where corners stand above it: distances across it are
            // longer by the inverse.
            let n = (at(j) - at(i)).cross(at(k) - at(i));
            n.dot(normal) / n.length()
        });
        let cosine = cosines[0].min(cosines[1]);
        (convex && cosine >= FLATTEST).then_some(Self { corners, normal, inward, height: height.abs(), cosine })
    }

    /// Returns the distance of a point to the nearest point of the quad, its inside included.
    fn distance(&self, p: Point) -> f64 {
        let c = &self.corners;
        // Over the inside the distance is that of the plane; beside it, that of the nearest side.
        if (0..4).all(|k| self.inward[k].dot(p - c[k]) >= 0.0) {
            return (p - c[0]).dot(self.normal).abs();
        }
        let sides = (0..4).map(|k| squared_distance_to_segment(p, c[k], c[(k + 1) % 4]));
        sides.fold(f64::INFINITY, f64::min).sqrt()
    }
}

impl Prover<'_, '_> {
    /// Returns a bound, mm, of the distance between the surface over the cell from `lo` to `hi` and its two triangles, both ways, where it
    /// is within `limit`; `None` where none is found, and always on planes, for [`Acceptance::Sampled`] and beyond [`MAX_PATCHES`].
    ///
    /// The corners lie on the surface, counter-clockwise from `lo`; the traced diagonal starts at corner `first`.
    pub(in crate::tessellate) fn quad_bound(
        &mut self,
        [lo, hi]: [Uv; 2],
        corners: &[Point; 4],
        first: usize,
        limit: f64,
    ) -> Option<f64> {
        let surface = self.surface;
        let (a, b) = (surface.range(0, lo.x, hi.x), surface.range(1, lo.y, hi.y));
        // A plane has nothing to gain, and samples prove nothing.
        if surface.affine || self.acceptance == Acceptance::Sampled {
            return None;
        }
        let bent = surface.curving.linear_deviation(a, b, hi - lo).map(|x| x + self.margin);
        // Where second derivatives settle it no net is made.
        if let Some(bound) = bent.filter(|&x| x <= limit) {
            return Some(bound);
        }
        if (a[1] - a[0] + 1) * (b[1] - b[0] + 1) > MAX_PATCHES {
            return None;
        }
        let origin = corners[first];
        let c = corners.map(|x| x - origin);
        let quad = FlatQuad::new(&c, first)?;
        // What is left of the limit once heights and slopes have taken theirs.
        let sides = limit * quad.cosine - self.margin;
        let flat = sides - quad.height;
        if flat <= 0.0 {
            return None;
        }
        let (mut away, mut aside, mut left) = (0f64, 0f64, MAX_HALVINGS);
        for i in a[0]..=a[1] {
            for j in b[0]..=b[1] {
                let patch = surface.patch(i, j);
                let [p, q] = patch.degree;
                let [[u0, u1], [v0, v1]] = patch.domain;
                let from = patch_uv(patch, lo.max(Uv::new(u0, v0)));
                let to = patch_uv(patch, hi.min(Uv::new(u1, v1)));
                let net = self.deviation.restrict(patch, from, to, origin);
                let distances = net.iter().map(|c| (quad.distance(c.project()), c.w));
                away = away.max(self.patch_scalar.bound(distances, [p, q], flat, &mut left)?);
                // The rows of the net over the cell's own sides.
                let last = p * (q + 1);
                let rows: [(bool, usize, usize, usize, [usize; 2]); 4] = [
                    (j == b[0], 0, q + 1, p, [0, 1]),
                    (i == a[1], last, 1, q, [1, 2]),
                    (j == b[1], q, q + 1, p, [3, 2]),
                    (i == a[0], 0, 1, q, [0, 3]),
                    // Inner rows are no boundary: each patch gives those of its rows that lie on the cell's sides.
                ];
                for (outer, start, step, n, ends) in rows {
                    if outer {
                        let chord = ends.map(|k| c[k]);
                        let row = (0..=n).map(|k| &net[start + k * step]);
                        let row = row.map(|x| (distance_to_chord(x.project(), &chord), x.w));
                        aside = aside.max(self.scalar.bound::<2>(row, n, sides)?);
                    }
                }
            }
        }
        // By the two parts of the argument above: the surface to the quad and its height, or a side's curve to its
        // chord, over the cosine.
        Some(((away + quad.height).max(aside) + self.margin) / quad.cosine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Homogeneous};
    use crate::nurbs::{Surface, conic, sweep};
    use crate::tessellate::face_surface::FaceSurface;
    use crate::tessellate::settings::ToleranceField;
    use proptest::prelude::*;

    fn cell([lo, hi]: [Uv; 2]) -> [Uv; 4] {
        [lo, Uv::new(hi.x, lo.y), hi, Uv::new(lo.x, hi.y)]
    }

    fn bound(s: &Surface, box_: [Uv; 2], first: usize, limit: f64) -> Option<f64> {
        let surface =
            FaceSurface::new(s, false, ToleranceField::new([0.1; 2], [1.0, 10.0], Default::default(), 1.0));
        let mut prover = Prover::new(&surface, Acceptance::Proved);
        prover.quad_bound(box_, &cell(box_).map(|x| s.evaluate(x)), first, limit)
    }

    #[test]
    fn a_strip_of_a_cylinder_has_its_closed_form_sag() {
        let s = sweep::cylinder(&Frame::IDENTITY, 10.0, [0.0, 3.0], [0.0, 40.0]);
        // Across the knot at 1.5 and within one patch.
        for (from, to) in [(0.3, 0.9), (1.2, 1.9f64)] {
            let [a, b] = [from, to].map(|phi| conic::parameter_of_angle([0.0, 3.0], phi));
            let sag = 10.0 * (1.0 - (0.5 * (to - from)).cos());
            let cell = [Uv::new(a, 0.0), Uv::new(b, 40.0)];
            assert!(bound(&s, cell, 0, 0.999 * sag).is_none());
            let found = bound(&s, cell, 0, 1.05 * sag).unwrap();
            assert!(sag <= found && found <= 1.05 * sag, "{found} {sag}");
        }
    }

    #[test]
    fn the_parameters_along_a_plane_do_not_matter() {
        // Twisted in its own plane: the curve over the diagonal strays 125 mm from it, the triangles lie in the surface.
        let points = [(-500.0, 0.0), (-1.0, 1000.0), (500.0, 0.0), (1.0, 1000.0)];
        let points = points.map(|(x, y)| Homogeneous::new(x, y, 0.0, 1.0)).to_vec();
        let knots = [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]];
        let s = Surface { degree: [1, 1], knots, points };
        assert!(bound(&s, [Uv::ZERO, Uv::ONE], 0, 1e-6).is_some_and(|x| x <= 1e-6));
    }

    /// Distance of a point to a triangle: to its plane over its inside, by barycentric coordinates, else to the nearest of its sides.
    fn off(p: Point, [a, b, c]: [Point; 3]) -> f64 {
        let side = |x: Point, y: Point| {
            let d = y - x;
            let t = ((p - x).dot(d) / d.dot(d).max(1e-300)).clamp(0.0, 1.0);
            (x + d * t - p).length()
        };
        let sides = side(a, b).min(side(b, c)).min(side(c, a));
        let (e, f, g) = (b - a, c - a, p - a);
        let (ee, ef, ff, ge, gf) = (e.dot(e), e.dot(f), f.dot(f), g.dot(e), g.dot(f));
        let det = ee * ff - ef * ef;
        let (s, t) = ((ff * ge - ef * gf) / det, (ee * gf - ef * ge) / det);
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 { sides.min((g - e * s - f * t).length()) } else { sides }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]
        #[test]
        fn bounds_are_never_below_what_is_sampled(
            heights in prop::collection::vec(-1.0..1.0f64, 25),
            weights in prop::collection::vec(0.3..3.0f64, 25),
            degree in 1..4usize,
            from in (0.0..1.2f64, 0.0..1.2f64),
            size in (0.05..0.8f64, 0.05..0.8f64),
            rough in -3.0..0.0f64,
            first in 0..2usize,
        ) {
            let knots: Vec<f64> = match degree {
                1 => vec![0.0, 0.0, 0.5, 1.0, 1.5, 2.0, 2.0],
                2 => vec![0.0, 0.0, 0.0, 0.7, 1.2, 2.0, 2.0, 2.0],
                _ => vec![0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 2.0],
            };
            let points = (0..25).map(|k| {
                let (x, y) = ((k / 5) as f64, (k % 5) as f64);
                let z = 10f64.powf(rough) * heights[k];
                let w = if heights[0] > 0.0 { weights[k] } else { 1.0 };
                (Point::new(x + 0.2 * heights[24 - k], y + 0.2 * heights[(k + 7) % 25], z) * w).extend(w)
            }).collect();
            let s = Surface { degree: [degree; 2], knots: [knots.clone(), knots], points };
            let lo = Uv::new(from.0, from.1);
            let hi = lo + Uv::new(size.0, size.1);
            let corner = cell([lo, hi]).map(|x| s.evaluate(x));
            let at = |k: usize| corner[(k + first) % 4];
            let traced = [[at(0), at(1), at(2)], [at(0), at(2), at(3)]];
            let n = 24;
            let grid: Vec<Point> = (0..=n * n + 2 * n).map(|k| {
                let share = Uv::new((k / (n + 1)) as f64, (k % (n + 1)) as f64) / n as f64;
                s.evaluate(lo + share * (hi - lo))
            }).collect();
            let sampled = grid.iter().map(|&p| off(p, traced[0]).min(off(p, traced[1]))).fold(0.0, f64::max);
            // Neighbours on the surface are no farther apart than this: as much is lost by looking at the grid alone.
            let apart = (0..n * (n + 1)).map(|k| (grid[k + n + 1] - grid[k]).length()).fold(0.0, f64::max)
                + (0..grid.len() - 1).filter(|k| k % (n + 1) < n).map(|k| (grid[k + 1] - grid[k]).length()).fold(0.0, f64::max);
            for limit in [1.02 * sampled, 1.5 * sampled, 4.0 * sampled, 0.3] {
                let Some(found) = bound(&s, [lo, hi], first, limit) else { continue };
                prop_assert!(found <= limit);
                prop_assert!(sampled <= found + 1e-9, "{sampled} {found}");
                for t in traced {
                    for i in 0..=10 {
                        for j in 0..=10 - i {
                            let (u, v) = (i as f64 / 10.0, j as f64 / 10.0);
                            let x = t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v;
                            let near = grid.iter().map(|&p| (p - x).length()).fold(f64::INFINITY, f64::min);
                            prop_assert!(near <= found + apart, "{near} {found} {apart}");
                        }
                    }
                }
            }
        }
    }
}

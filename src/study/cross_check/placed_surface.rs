//! The surface of a placed face with foot points, border and sag band: the geometry that causes are found with.

use super::border::{Border, SAMPLES, border_curves};
use crate::math::{Point, Ray, Uv, Vector};
use crate::model::PlacedFace;
use crate::nurbs::Surface;
use std::sync::OnceLock;

/// Foot points whose distances differ by less, relative, are equally near; also the rounding of a foot point, as a share of the size.
const EQUALLY_NEAR: f64 = 1e-9;
/// Slant of the line to a foot point against the normal beyond which the foot is held back by the end of the domain.
const HELD_SLANT: f64 = 1e-6;
/// The Hessian counts as convex when its determinant is more than this share of the product of its diagonal; what is added to the
/// diagonal where it is not.
const CONVEX: f64 = 1e-6;
/// Added to a diagonal that may be zero, so that nothing is divided by it, mm² per parameter².
const VANISHING: f64 = 1e-300;
/// Shortest damped step of Newton, as a share of the whole one.
const SHORTEST_STEP: f64 = 1e-3;
/// Newton ends when a step is shorter, as a share of the size: 450 units in the last place.
const CONVERGED: f64 = 1e-13;
/// Curvature term of the way through the band, against the straight one, below which the root is taken by its first term: exact to
/// this, where the closed form would cancel.
const STRAIGHT: f64 = 1e-6;

/// A placed face with a geometry of its own, apart from the intersectors: its surface, and its border in space.
pub(super) struct PlacedSurface {
    pub(super) surface: Surface,
    /// −1 where the outward normal is `-(Su × Sv)`.
    sign: f64,
    size: f64,
    /// Largest distance between an edge in space and its uv curve, or between the ends of edges that follow each other, mm.
    pub(super) gap: f64,
    borders: Vec<Border>,
    /// Samples over the domain, made when a foot is first held back by its end: of most faces none is.
    seeds: OnceLock<Vec<(Uv, Point)>>,
}

/// The point of a surface nearest to a given one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    pub(super) uv: Uv,
    pub(super) point: Point,
    pub(super) normal: Vector,
    /// Distance, negative inside.
    pub(super) offset: f64,
    /// Curvature of the surface along the ray's tangential direction, 1/mm; positive towards the normal.
    curvature: f64,
    /// Whether the foot is held back by the end of the domain.
    held: bool,
}

/// The stretch of a ray that stays within a band about a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct BandInterval {
    /// Range of `t`.
    pub(super) range: [f64; 2],
    /// The side on which the ray leaves the band, before and after; 0 where the ray itself ends inside.
    pub(super) sides: [i8; 2],
    /// Whether it comes near the face's border: within the band and twice the gap.
    pub(super) border: bool,
    /// Whether both ends were found within the budget of steps.
    pub(super) complete: bool,
}

/// Steps in which a ray is followed through the band; longer ones from the half on.
const STEPS: usize = 1000;
/// Steps towards where a ray passes a border: each leaves the share cos² of the way, of the angle between ray and border.
const APPROACHES: usize = 32;

impl PlacedSurface {
    /// Makes the surface of a placed face in scene coordinates (mm), with its border; `None` for a ready mesh.
    pub(super) fn new(placed: &PlacedFace<'_>) -> Option<Self> {
        let face = placed.face?;
        let surface = face.surface.transformed(|p| placed.placement.point(p));
        // A face that is reversed within a mirrored placement looks outwards again.
        let flips = [face.reversed, placed.placement.is_mirrored()].iter().filter(|&&f| f).count();
        let size = surface.bounds().diagonal();
        let borders = border_curves(face, &surface, size).into_iter().map(|c| Border::new(c, &surface)).collect();
        let sign = if flips == 1 { -1.0 } else { 1.0 };
        // A joint without an edge that is not one point is a gap between edges that the file left; facets go across it as they may.
        let joints = face.loops.iter().flat_map(|l| &l.uses).filter(|u| u.edge.is_none());
        let across = joints.map(|u| surface.evaluate(u.start()).distance(surface.evaluate(u.end())));
        let gap = across.fold(face.gap * placed.placement.scale, f64::max);
        Some(Self { surface, sign, size, gap, borders, seeds: OnceLock::new() })
    }

    /// Returns places evenly over the surface's domain.
    fn seeds(&self) -> &[(Uv, Point)] {
        let [[u0, u1], [v0, v1]] = self.surface.domain();
        let at = |i: usize, a: f64, b: f64| a + (b - a) * i as f64 / SAMPLES as f64;
        let parameters =
            (0..=SAMPLES).flat_map(|i| (0..=SAMPLES).map(move |j| Uv::new(at(i, u0, u1), at(j, v0, v1))));
        self.seeds.get_or_init(|| parameters.map(|uv| (uv, self.surface.evaluate(uv))).collect())
    }

    /// Returns the parameters of the samples nearest to `p`, the nearest first; there are more than `N`.
    pub(super) fn nearest_seeds<const N: usize>(&self, p: Point) -> [Uv; N] {
        let mut seeds: Vec<_> = self.seeds().iter().map(|(uv, q)| (q.distance_squared(p), *uv)).collect();
        seeds.select_nth_unstable_by(N - 1, |a, b| a.0.total_cmp(&b.0));
        seeds[..N].sort_by(|a, b| a.0.total_cmp(&b.0));
        std::array::from_fn(|k| seeds[k].1)
    }

    /// Returns the diagonal of the box about the control points, mm.
    pub(super) fn size(&self) -> f64 {
        self.size
    }

    /// Returns the point of the surface nearest to `p`, with its parameters, the signed distance of `p` and the curvature along
    /// `direction`. It is searched from a guess in parameters and, where that ends at the end of the domain, from the four nearest
    /// samples too. Trims are not heeded.
    pub(super) fn foot(&self, p: Point, guess: Uv, direction: Vector) -> Foot {
        let near = self.project(p, guess);
        let mut best = self.describe(p, near, direction);
        if best.held {
            // The guess ran into a side of the domain: on a closed surface the foot may lie beyond the seam.
            // From the four nearest of some three hundred samples.
            for uv in self.nearest_seeds::<4>(p) {
                let other = self.describe(p, self.project(p, uv), direction);
                // Nearest alone counts: a foot that nothing holds may lie on the next turn of a screw.
                let (far, near) = (other.offset.abs(), best.offset.abs());
                if far < near * (1.0 - EQUALLY_NEAR)
                    || (best.held && !other.held && far <= near * (1.0 + EQUALLY_NEAR))
                {
                    best = other;
                }
            }
        }
        best
    }

    /// Returns the face's outward normal at parameters `uv`; zero where it has none.
    pub(super) fn normal(&self, uv: Uv) -> Vector {
        self.surface.normal(uv).map_or(Vector::ZERO, |n| n * self.sign)
    }

    /// Returns the surface at parameters `uv` as a foot of `p`, and how it bends along `direction`; at a pole as a sphere of its size
    /// would.
    fn describe(&self, p: Point, uv: Uv, direction: Vector) -> Foot {
        let d = self.surface.second_derivatives(uv);
        let normal = self.normal(uv);
        let away = p - d.point;
        let height = away.dot(normal);
        let offset = if height < 0.0 { -away.length() } else { away.length() };
        let held = (away - normal * height).length() > HELD_SLANT * away.length() + EQUALLY_NEAR * self.size;
        // The ray's way along the surface, as parameters, by the first fundamental form.
        let tangential = direction - normal * direction.dot(normal);
        let (e, f, g) = (d.du.length_squared(), d.du.dot(d.dv), d.dv.length_squared());
        let det = e * g - f * f;
        let (bu, bv) = (tangential.dot(d.du), tangential.dot(d.dv));
        let (a, b) = ((g * bu - f * bv) / det, (e * bv - f * bu) / det);
        let second = d.duu * (a * a) + d.duv * (2.0 * a * b) + d.dvv * (b * b);
        let curvature = second.dot(normal);
        // At a pole the form cannot be inverted; a sphere of the surface's size is near enough for a step.
        let curvature = if curvature.is_finite() { curvature } else { 1.0 / self.size };
        Foot { uv, point: d.point, normal, offset, curvature, held }
    }

    /// Finds a local minimum of the distance from `p` inside the domain: Newton with an active set of the domain's sides.
    fn project(&self, p: Point, start: Uv) -> Uv {
        let [[u0, u1], [v0, v1]] = self.surface.domain();
        let mut uv = self.surface.clamp(start);
        for _ in 0..40 {
            let d = self.surface.second_derivatives(uv);
            let r = d.point - p;
            let g = [r.dot(d.du), r.dot(d.dv)];
            // Where the nearest place would lie beyond a side of the domain, its parameter is held.
            let fixed = [
                (uv.x <= u0 && g[0] > 0.0) || (uv.x >= u1 && g[0] < 0.0),
                (uv.y <= v0 && g[1] > 0.0) || (uv.y >= v1 && g[1] < 0.0),
            ];
            let (e, f, k) = (d.du.length_squared(), d.du.dot(d.dv), d.dv.length_squared());
            let (mut a, mut b, mut c) = (e + r.dot(d.duu), f + r.dot(d.duv), k + r.dot(d.dvv));
            // Far from the foot the Hessian may point uphill; Gauss–Newton's part of it never does.
            if !(a > 0.0 && c > 0.0 && a * c - b * b > CONVEX * a * c) {
                (a, b, c) = (e * (1.0 + CONVEX) + VANISHING, f, k * (1.0 + CONVEX) + VANISHING);
            }
            let det = a * c - b * b;
            let step = match fixed {
                [true, true] => break,
                [true, false] => Uv::new(0.0, -g[1] / c),
                [false, true] => Uv::new(-g[0] / a, 0.0),
                _ => Uv::new(-(c * g[0] - b * g[1]) / det, -(a * g[1] - b * g[0]) / det),
            };
            if !step.is_finite() {
                break;
            }
            let mut scale = 1.0;
            let mut next = self.surface.clamp(uv + step);
            while self.surface.evaluate(next).distance_squared(p) > r.length_squared() && scale > SHORTEST_STEP {
                scale *= 0.5;
                next = self.surface.clamp(uv + step * scale);
            }
            let moved = (next - uv).abs();
            uv = next;
            if moved.x * e.sqrt() + moved.y * k.sqrt() < CONVERGED * self.size {
                break;
            }
        }
        uv
    }

    /// Returns a distance, mm, from a point of the surface to its border, the nearest only where that is beyond `enough`; infinite for a
    /// closed face and where none comes near.
    fn border_distance(&self, p: Point, enough: f64) -> f64 {
        let mut best = f64::INFINITY;
        for border in self.borders.iter().filter(|b| b.reaches(p, enough)) {
            best = best.min(border.distance(&self.surface, p, enough));
        }
        best
    }

    /// Whether a hit at `t` lies beyond the end of the surface, within `band`, mm, of how it would go on, and the ray passes the face's
    /// border within the band and twice the gap. Where faces gape the side on which a ray passes their edge decides, and the hit strays
    /// from the edge by the gap over the sine of the incidence.
    pub(super) fn is_beyond_border(&self, ray: &Ray, t: f64, guess: Uv, band: f64) -> bool {
        let hit = ray.point_at(t);
        let mut foot = self.foot(hit, guess, ray.direction);
        if !foot.held || (hit - foot.point).dot(foot.normal).abs() > band {
            return false;
        }
        let mut nearest = hit;
        for _ in 0..APPROACHES {
            nearest += ray.direction * (foot.point - nearest).dot(ray.direction);
            foot = self.foot(nearest, foot.uv, ray.direction);
        }
        let enough = band + 2.0 * self.gap;
        self.border_distance(nearest, enough) <= enough
    }

    /// Walks along the ray from `t` in both directions for as long as it stays within `band`, mm, of the surface; `None` where it is not
    /// within it at `t`. `guess` are parameters near there.
    pub(super) fn stretch(&self, ray: &Ray, t: f64, guess: Uv, band: f64) -> Option<BandInterval> {
        let start = self.foot(ray.point_at(t), guess, ray.direction);
        if start.offset.abs() > band {
            return None;
        }
        let mut found = BandInterval { range: [t, t], sides: [0, 0], border: false, complete: true };
        for (end, sign) in [(0, -1.0), (1, 1.0)] {
            let mut foot = start;
            let mut at = t;
            let mut steps = 0;
            loop {
                if self.border_distance(foot.point, band + 2.0 * self.gap) <= band + 2.0 * self.gap {
                    found.border = true;
                }
                // Beyond the band the side is known; a foot that is held has left the face.
                if foot.offset.abs() > band || foot.held {
                    found.sides[end] = if foot.offset < 0.0 { -1 } else { 1 };
                    break;
                }
                let limit = if end == 0 { ray.t_min } else { ray.t_max };
                if at == limit {
                    break;
                }
                steps += 1;
                if steps > STEPS {
                    found.complete = false;
                    break;
                }
                // Steps of two bands cannot jump over a border unseen; a ray that lies almost in the sheet gets longer ones.
                let longest = band * if steps < STEPS / 2 { 2.0 } else { 2.0 + (steps - STEPS / 2) as f64 };
                let mut step = self.step_length(&foot, ray, band).min(longest);
                let (before, last) = (at, foot);
                // On the hollow side of the surface the foot runs ahead of the ray; where it jumps no step is short enough.
                for _ in 0..4 {
                    at = before + sign * step;
                    at = if end == 0 { at.max(limit) } else { at.min(limit) };
                    foot = self.foot(ray.point_at(at), last.uv, ray.direction);
                    if foot.point.distance(last.point) <= longest {
                        break;
                    }
                    step *= 0.7;
                }
            }
            found.range[end] = at;
        }
        Some(found)
    }

    /// Returns a length along the ray, mm, over which the offset changes by at most about half the band.
    fn step_length(&self, foot: &Foot, ray: &Ray, band: f64) -> f64 {
        let (g, k) = (foot.normal.dot(ray.direction).abs(), foot.curvature.abs());
        let by_offset =
            if k * band < STRAIGHT * g * g { 0.5 * band / g } else { ((g * g + k * band).sqrt() - g) / k };
        by_offset.clamp(0.05 * band, (0.02 * self.size).max(band))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::model::{EdgeId, EdgeUse, Face, TrimLoop};
    use crate::nurbs::{UvCurve, sweep};
    use std::f64::consts::PI;

    fn sphere(radius: f64) -> PlacedSurface {
        let surface = sweep::sphere(&Frame::IDENTITY, radius, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]);
        whole(&Face::whole(surface))
    }

    fn whole(face: &Face) -> PlacedSurface {
        let placed = PlacedFace {
            id: crate::math::FaceId(0),
            instance: 0,
            part: crate::model::PartId(0),
            solid: 0,
            shell: None,
            face: Some(face),
            tessellated: None,
            placement: &Frame::IDENTITY,
        };
        PlacedSurface::new(&placed).unwrap()
    }

    #[test]
    fn feet_on_a_sphere_also_across_seam_and_pole() {
        let s = sphere(10.0);
        assert!(s.borders.is_empty(), "a whole sphere has no border");
        let guess = Uv::new(0.01, 0.3);
        for p in [Point::new(12.0, -0.5, 3.0), Point::new(0.1, 0.0, 9.0), Point::new(-3.0, -8.0, -7.0)] {
            let foot = s.foot(p, guess, Vector::X);
            assert!((foot.point - p.normalize() * 10.0).length() < 1e-9, "{p}: {foot:?}");
            assert!((foot.offset - (p.length() - 10.0)).abs() < 1e-11);
        }
    }

    #[test]
    fn the_nearest_foot_counts_though_an_end_holds_it() {
        // A strip that turns back over itself, 1 mm higher, and reaches farther there.
        let row = |x: f64, z: f64| [0.0, 5.0].map(|y| crate::math::Homogeneous::new(x, y, z, 1.0));
        let points = [row(0.0, 0.0), row(10.0, 0.0), row(10.0, 1.0), row(-5.0, 1.0)].concat();
        let knots = [vec![0.0, 0.0, 1.0, 2.0, 3.0, 3.0], vec![0.0, 0.0, 1.0, 1.0]];
        let face = Face::whole(Surface { degree: [1, 1], knots, points });
        let s = whole(&face);
        let foot = s.foot(Point::new(-0.03, 2.5, 0.04), Uv::new(0.01, 0.5), Vector::X);
        assert!((foot.offset.abs() - 0.05).abs() < 1e-12 && foot.held, "{foot:?}");
    }

    #[test]
    fn stretches_of_a_ray_through_and_past_a_sphere() {
        let s = sphere(10.0);
        let band = 0.1;
        // Past the sphere at a clearance of 0.05: the stretch is the chord of the sphere of radius 10.1.
        let past = Ray::new(Point::new(-20.0, 0.0, 10.05), Vector::X);
        let found = s.stretch(&past, 20.0, Uv::new(0.5, 1.5), band).unwrap();
        let half = (10.1f64.powi(2) - 10.05f64.powi(2)).sqrt();
        assert!(found.range[0] <= 20.0 - half && found.range[1] >= 20.0 + half);
        assert!(found.range[0] > 20.0 - 3.0 * half && found.range[1] < 20.0 + 3.0 * half);
        assert_eq!((found.sides, found.border, found.complete), ([1, 1], false, true));
        let into = Ray::new(Point::new(-20.0, 0.0, 3.0), Vector::X);
        let t = 20.0 - (100f64 - 9.0).sqrt();
        assert_eq!(s.stretch(&into, t, Uv::new(PI, 0.3), band).unwrap().sides, [1, -1]);
        assert!(s.stretch(&into, t - 1.0, Uv::new(PI, 0.3), band).is_none());
    }

    #[test]
    fn a_hit_beyond_the_border_is_told_by_how_the_ray_passes_it() {
        let surface = sweep::plane(&Frame::IDENTITY, [[0.0, 10.0], [0.0, 10.0]]);
        let s = whole(&Face { gap: 0.1, ..Face::whole(surface) });
        // Through (10.5, 5, 0), half a millimetre beyond the side at x = 10, at slopes of 1:8 and 1:1 to the plane: the ray passes the
        // side at 0.5 · sin = 0.062 and 0.35. Band and twice the gap are 0.3.
        for (rise, beyond) in [(0.125, true), (1.0, false)] {
            let direction = Vector::new(1.0, 0.0, rise).normalize();
            let ray = Ray::new(Point::new(10.5, 5.0, 0.0) - direction * 20.0, direction);
            assert_eq!(s.is_beyond_border(&ray, 20.0, Uv::new(0.9, 0.5), 0.1), beyond, "{rise}");
            // Nor is it known for a hit 0.2 off the plane.
            let above = Ray { origin: ray.origin + Vector::Z * 0.2, ..ray };
            assert!(!s.is_beyond_border(&above, 20.0, Uv::new(0.9, 0.5), 0.1));
        }
    }

    #[test]
    fn no_step_along_the_hollow_side_jumps_over_a_border() {
        let surface = sweep::cylinder(&Frame::IDENTITY, 1.0, [0.0, 2.0 * PI], [-10.0, 10.0]);
        // The ray passes 0.03 inside of the surface, where feet are 3 % farther apart than their points.
        let (band, start) = (0.05, 1.0f64);
        let (sin, cos) = start.sin_cos();
        let ray = Ray::new(Point::new(0.97 * cos, 0.97 * sin, 0.0), Vector::new(-sin, cos, 0.0));
        for k in 0..300 {
            let end = start + 0.03 + 5e-4 * f64::from(k);
            let corners = [[0.3, -0.5], [end, -0.5], [end, 0.5], [0.3, 0.5]].map(Uv::from);
            let side = |k: usize| EdgeUse {
                edge: Some(EdgeId(k as u32)),
                reversed: false,
                uv: UvCurve::line(corners[k], corners[(k + 1) % 4], [0.0, 1.0]),
            };
            let uses = (0..4).map(side).collect();
            let face = Face { loops: vec![TrimLoop { uses }], ..Face::whole(surface.clone()) };
            let forward = ray.with_range(-1.0, 1.0);
            let stretch = whole(&face).stretch(&forward, 0.0, Uv::new(start, 0.0), band).expect("in the band");
            assert!(stretch.border, "end {end}");
        }
    }
}

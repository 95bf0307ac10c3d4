//! The spline as it was given, in numbers of 32 digits: for decisions that `f64` leaves open.
//!
//! De Boor's algorithm on the surface's own knots and control points, so that neither the extraction of Bézier patches nor their
//! halving has rounded anything. The ray is met where two components of `(S − o) × d` vanish, which no rounding of a frame
//! across it blurs.
//!
//! An evaluation takes some microseconds: only roots whose place `f64` leaves open are settled here.

use super::double_double::DoubleDouble;
use super::net::{Net, V4};
use crate::math::simd::{self, Instructions, Kernel};
use crate::math::{Frame, Homogeneous, Uv, Vector};
use crate::nurbs::{BezierPatch, Surface, find_span};
use smallvec::SmallVec;

/// Newton steps from a root of `f64`, which has digits to begin with.
const PRECISE_STEPS: usize = 12;
/// Newton's method has converged at a step of this size, as a share of a patch: the next is below 32 digits.
const LAST_PRECISE_STEP: f64 = 1e-20;

/// What the reference computes in.
type Number = DoubleDouble;
type Point4 = [Number; 4];
type Point3 = [Number; 3];

/// A root of 32 digits.
#[derive(Clone, Copy, Debug)]
pub(super) struct SettledRoot {
    /// Distance along the ray, mm.
    pub(super) t: f64,
    /// As shares of the patch's rectangle.
    pub(super) local: [f64; 2],
    /// On the surface, rounded.
    pub(super) uv: Uv,
}

/// The surface as it is seen along a ray: two components across it that no rounding of a frame blurs.
pub(super) struct SeenAlong {
    /// The coordinates that the components belong to: all but the direction's largest.
    pub(super) axes: [usize; 2],
    pub(super) value: [DoubleDouble; 2],
    /// By the two parameters, as shares of the patch.
    pub(super) derivatives: [[DoubleDouble; 2]; 2],
}

/// A patch of a placed surface.
#[derive(Clone, Copy)]
pub(super) struct ReferencePatch<'a> {
    pub(super) surface: &'a Surface,
    pub(super) placement: &'a Frame,
    /// The knot rectangle.
    pub(super) domain: [[f64; 2]; 2],
}

/// A root to be settled, for [`simd::dispatch`].
struct Settling<'a> {
    patch: ReferencePatch<'a>,
    ray: [Vector; 2],
    start: [f64; 2],
}

impl Kernel for Settling<'_> {
    type Output = Option<SettledRoot>;

    #[inline(always)]
    fn run<I: Instructions>(self) -> Self::Output {
        self.patch.newton(self.ray, self.start)
    }
}

/// The axis of the largest coordinate of a direction, and the two others.
#[inline(always)]
fn main_axis(direction: Vector) -> (usize, [usize; 2]) {
    let main = direction.abs().max_position();
    (main, [(main + 1) % 3, (main + 2) % 3])
}

/// A net to be seen along a ray, for [`simd::dispatch`].
struct NetAlong<'a> {
    patch: ReferencePatch<'a>,
    ray: [Vector; 2],
    frame: [Vector; 2],
    rect: [[f64; 2]; 2],
}

impl Kernel for NetAlong<'_> {
    type Output = Net;

    #[inline(always)]
    fn run<I: Instructions>(self) -> Net {
        let Self { patch, ray: [o, d], frame, rect } = self;
        let ends = [0, 1].map(|k: usize| rect[k].map(|x| patch.width(k) * x.into() + patch.domain[k][0].into()));
        let (main, axes) = main_axis(d);
        let origin: Point3 = patch.placement.origin.to_array().map(Number::from);
        let seen = |point: Point4| -> V4 {
            let placed = patch.place_vector(&[point[0], point[1], point[2]]);
            let r: Point3 = std::array::from_fn(|k| placed[k] + (origin[k] - o[k].into()) * point[3]);
            let across = axes.map(|k| r[k] - r[main] * d[k].into() / d[main].into());
            let component = |n: Vector| (across[0] * n[axes[0]].into() + across[1] * n[axes[1]].into()).to_f64();
            let along = r[0] * d.x.into() + r[1] * d.y.into() + r[2] * d.z.into();
            [component(frame[0]), component(frame[1]), along.to_f64(), point[3].to_f64()]
        };
        bezier_points(patch.surface, patch.domain, ends).into_iter().map(seen).collect()
    }
}

/// Tangents to be found, for [`simd::dispatch`].
struct TangentsAt<'a> {
    patch: ReferencePatch<'a>,
    uv: Uv,
}

impl Kernel for TangentsAt<'_> {
    type Output = [Vector; 2];

    #[inline(always)]
    fn run<I: Instructions>(self) -> Self::Output {
        let (_, du, dv) = self.patch.derivatives([self.uv.x.into(), self.uv.y.into()]);
        let [u, v] = [0, 1].map(|d| self.patch.width(d));
        [rounded(du.map(|x| x * u)), rounded(dv.map(|x| x * v))]
    }
}

impl ReferencePatch<'_> {
    /// Finds the root of a ray (origin, direction; in the world) from the patch's local parameters `start`; `None` when Newton's method
    /// does not converge. The root may be another one, or lie beyond the patch, on the continued polynomial.
    pub(super) fn settle(self, ray: [Vector; 2], start: [f64; 2]) -> Option<SettledRoot> {
        simd::dispatch(Settling { patch: self, ray, start })
    }

    /// Derivatives in the world by u and v, as shares of the patch: how far the surface would run over it at this speed, mm.
    pub(super) fn tangents(self, uv: Uv) -> [Vector; 2] {
        simd::dispatch(TangentsAt { patch: self, uv })
    }

    /// Sees the surface along a ray (origin, direction; in the world), at local parameters of the patch.
    ///
    /// For a direction n across the ray, `n·(S − o)` is the sum of n's components at the axes times these.
    #[inline(always)]
    pub(super) fn seen_along(&self, [o, d]: [Vector; 2], local: [DoubleDouble; 2]) -> SeenAlong {
        let (main, axes) = main_axis(d);
        let widths = [0, 1].map(|k| self.width(k));
        let (p, du, dv) = self.derivatives([0, 1].map(|k| widths[k] * local[k] + self.domain[k][0].into()));
        let r: Point3 = std::array::from_fn(|k| p[k] - o[k].into());
        let across =
            |x: &Point3, scale: Number| axes.map(|k| (x[k] - x[main] * d[k].into() / d[main].into()) * scale);
        let derivatives = [across(&du, widths[0]), across(&dv, widths[1])];
        SeenAlong { axes, value: across(&r, 1.0.into()), derivatives }
    }

    /// The control net of a rectangle of the patch, in its local parameters, as `frame` sees it along a ray (origin,
    /// direction): two coordinates across, one along, and the weight. Each is rounded once, when all that cancels has cancelled.
    pub(super) fn net_along(self, ray: [Vector; 2], frame: [Vector; 2], rect: [[f64; 2]; 2]) -> Net {
        simd::dispatch(NetAlong { patch: self, ray, frame, rect })
    }

    /// Length of the patch's knot span in parameter `d`.
    #[inline(always)]
    fn width(&self, d: usize) -> Number {
        Number::from(self.domain[d][1]) - self.domain[d][0].into()
    }

    /// What [`Self::settle`] does, inlined into its kernel.
    #[inline(always)]
    fn newton(&self, [o, d]: [Vector; 2], start: [f64; 2]) -> Option<SettledRoot> {
        // Two planes that hold the ray, each from the largest component of the direction and one of the others: with a small
        // one in its place their normals would be nearly parallel.
        let (main, others) = main_axis(d);
        let widths = [0, 1].map(|k| self.width(k));
        let mut uv = [0, 1].map(|k| widths[k] * start[k].into() + self.domain[k][0].into());
        for _ in 0..PRECISE_STEPS {
            let (p, du, dv) = self.derivatives(uv);
            let r: Point3 = std::array::from_fn(|k| p[k] - o[k].into());
            let beside = |x: &Point3, k: usize| x[k] * d[main].into() - x[main] * d[k].into();
            let f = others.map(|k| beside(&r, k));
            let (a, b) = (others.map(|k| beside(&du, k)), others.map(|k| beside(&dv, k)));
            let determinant = a[0] * b[1] - b[0] * a[1];
            if !(determinant.to_f64().abs() > 0.0) {
                return None;
            }
            let step = [(b[1] * f[0] - b[0] * f[1]) / determinant, (a[0] * f[1] - a[1] * f[0]) / determinant];
            let size = [0, 1].map(|k| (step[k] / widths[k]).to_f64().abs());
            uv = [uv[0] - step[0], uv[1] - step[1]];
            // A step as long as the patch leads away from the root that `f64` has found.
            if !(size[0].max(size[1]) < 1.0) {
                return None;
            }
            if size[0].max(size[1]) < LAST_PRECISE_STEP {
                // Of the point after the step, in first order: the second is the square of [`LAST_PRECISE_STEP`].
                let t = (r[main] - du[main] * step[0] - dv[main] * step[1]) / d[main].into();
                let local = [0, 1].map(|k| ((uv[k] - self.domain[k][0].into()) / widths[k]).to_f64());
                return Some(SettledRoot { t: t.to_f64(), local, uv: Uv::new(uv[0].to_f64(), uv[1].to_f64()) });
            }
        }
        None
    }

    /// The point in the world at surface parameters, and the derivatives by these, in the patch's own span also beyond it.
    #[inline(always)]
    fn derivatives(&self, [u, v]: [Number; 2]) -> (Point3, Point3, Point3) {
        let s = self.surface;
        // By the middle of the patch: parameters of a root on its border, or beyond by rounding, belong to the
        // patch they came from.
        let spans =
            [0, 1].map(|d| find_span(&s.knots[d], s.degree[d], 0.5 * (self.domain[d][0] + self.domain[d][1])));
        let [p, q] = s.degree;
        let columns = s.counts()[1];
        // Each row of the net in v, then the rows' values and derivatives in u.
        let mut values: SmallVec<[Point4; 8]> = SmallVec::new();
        let mut slopes: SmallVec<[Point4; 8]> = SmallVec::new();
        for i in spans[0] - p..=spans[0] {
            let row = &s.points[i * columns + spans[1] - q..=i * columns + spans[1]];
            let row = row.iter().map(|x| x.to_array().map(Number::from)).collect();
            let [value, slope] = de_boor(&s.knots[1], q, spans[1], row, v);
            values.push(value);
            slopes.push(slope);
        }
        let [s0, su] = de_boor(&s.knots[0], p, spans[0], values, u);
        let [sv, _] = de_boor(&s.knots[0], p, spans[0], slopes, u);
        let point: Point3 = std::array::from_fn(|k| s0[k] / s0[3]);
        let slope = |x: &Point4| -> Point3 { std::array::from_fn(|k| (x[k] - point[k] * x[3]) / s0[3]) };
        let origin: Point3 = self.placement.origin.to_array().map(Number::from);
        let placed = self.place_vector(&point);
        (
            std::array::from_fn(|k| placed[k] + origin[k]),
            self.place_vector(&slope(&su)),
            self.place_vector(&slope(&sv)),
        )
    }

    /// Turns and scales a difference of points of the part into the world.
    #[inline(always)]
    fn place_vector(&self, x: &Point3) -> Point3 {
        let f = self.placement;
        std::array::from_fn(|k| {
            let sum = x[0] * f.x[k].into() + x[1] * f.y[k].into() + x[2] * f.z[k].into();
            sum * f.scale.into()
        })
    }
}

/// Homogeneous value and derivative at `t` of the polynomial that a spline is in one span; `points` are its `degree + 1` control points.
#[inline(always)]
fn de_boor(knots: &[f64], degree: usize, span: usize, mut points: SmallVec<[Point4; 8]>, t: Number) -> [Point4; 2] {
    let mut slope = [Number::ZERO; 4];
    for r in 1..=degree {
        // Before the last step two points are left, whose difference is the derivative.
        if r == degree {
            let width = Number::from(knots[span + 1]) - knots[span].into();
            let scale = Number::from(degree as f64) / width;
            slope = std::array::from_fn(|c| (points[degree][c] - points[degree - 1][c]) * scale);
        }
        for j in (r..=degree).rev() {
            let low = knots[span - degree + j];
            let high = knots[span + 1 + j - r];
            let share = (t - low.into()) / (Number::from(high) - low.into());
            let rest = Number::from(1.0) - share;
            let before = points[j - 1];
            points[j] = std::array::from_fn(|c| before[c] * rest + points[j][c] * share);
        }
    }
    [points[degree], slope]
}

/// The nearest vector in `f64`.
#[inline(always)]
fn rounded(x: Point3) -> Vector {
    Vector::from_array(x.map(Number::to_f64))
}

/// Overwrites the control points of a Bézier patch of `surface`, over the same domain, with those from 32 digits, each coordinate
/// rounded once: knot spans of 1e-9 beside weights of 1e6 leave no digit of what `f64` extracts.
pub(super) fn extract(surface: &Surface, patch: &mut BezierPatch) {
    let ends = patch.domain.map(|ends| ends.map(Number::from));
    let points = bezier_points(surface, patch.domain, ends);
    for (rounded, point) in patch.points.iter_mut().zip(points) {
        *rounded = Homogeneous::from_array(point.map(Number::to_f64));
    }
}

/// Bézier control points, v fastest, over the rectangle `ends` of the surface's domain, of the polynomial in the knot rectangle
/// `domain`.
#[inline(always)]
fn bezier_points(surface: &Surface, domain: [[f64; 2]; 2], ends: [[Number; 2]; 2]) -> Vec<Point4> {
    let [p, q] = surface.degree;
    let columns = surface.counts()[1];
    let spans =
        [0, 1].map(|d| find_span(&surface.knots[d], surface.degree[d], 0.5 * (domain[d][0] + domain[d][1])));
    let rows: Vec<Vec<Point4>> = (spans[0] - p..=spans[0])
        .map(|i| {
            let row = &surface.points[i * columns + spans[1] - q..=i * columns + spans[1]];
            let row: SmallVec<[Point4; 8]> = row.iter().map(|x| x.to_array().map(Number::from)).collect();
            (0..=q).map(|k| blossom(&surface.knots[1], spans[1], row.clone(), ends[1], k)).collect()
        })
        .collect();
    let mut points = vec![[Number::ZERO; 4]; (p + 1) * (q + 1)];
    for j in 0..=q {
        let column: SmallVec<[Point4; 8]> = rows.iter().map(|row| row[j]).collect();
        for i in 0..=p {
            points[i * (q + 1) + j] = blossom(&surface.knots[0], spans[0], column.clone(), ends[0], i);
        }
    }
    points
}

/// The blossom of a span's control points, `seconds` times at the second of two parameters and else at the first: a Bézier point over the
/// range between them.
#[inline(always)]
fn blossom(
    knots: &[f64],
    span: usize,
    mut points: SmallVec<[Point4; 8]>,
    [first, second]: [Number; 2],
    seconds: usize,
) -> Point4 {
    let degree = points.len() - 1;
    for r in 1..=degree {
        let t = if r <= seconds { second } else { first };
        for j in (r..=degree).rev() {
            let low = Number::from(knots[span - degree + j]);
            let high = Number::from(knots[span + 1 + j - r]);
            // Both shares from differences of knots, so that neither loses digits where the other is nearly all.
            let width = high - low;
            let (share, rest) = ((t - low) / width, (high - t) / width);
            let before = points[j - 1];
            points[j] = std::array::from_fn(|c| before[c] * rest + points[j][c] * share);
        }
    }
    points[degree]
}

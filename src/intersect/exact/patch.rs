//! Bézier patches about centres of their own, and the lines that divide a surface into them.

use super::net::{self, Jet, V4};
use super::tolerances::{PARALLEL, SAME_POINT};
use crate::math::{Point, Uv, Vector};
use crate::model::{Face, PlacedFace};
use crate::nurbs::BezierPatch;

/// Ulps by which a patch's control points are off, of its size: extraction, shift and placement round each less than ten times.
const NET_ROUNDING: f64 = 16.0;

/// A file's ninth decimal counts up to a millionth of the face: [`SAME_POINT`] times this.
const LARGEST_DECIMAL: f64 = 1e3;
/// Ulps of the largest coordinate by which control points of one place differ: each is rounded by half of one, and weighted by three.
const PLACED_ULPS: f64 = 8.0;

/// Break lines of a surface's patches.
#[derive(Debug)]
pub(super) struct PatchGrid {
    /// Distinct knots of the domain, between which patches lie.
    pub(super) breaks: [Vec<f64>; 2],
    /// Whether the surface closes on itself in u and in v.
    pub(super) closed: [bool; 2],
    /// Whether the side at the low and at the high end of u, and of v, is a single point.
    pub(super) poles: [[bool; 2]; 2],
}

/// A rational Bézier patch in world orientation.
#[derive(Debug)]
pub(super) struct Patch {
    /// Index into [`Geometry::faces`].
    pub(super) face: u32,
    pub(super) degree: [u8; 2],
    /// Index in [`Geometry::nets`] of the first of its control points, which are about `center`, with weight 1 in the middle of the patch.
    pub(super) net: u32,
    /// Error of the control points, and of derivatives got from them, mm.
    pub(super) rounding: f64,
    /// In the world.
    pub(super) center: Point,
    /// The rectangle of the surface's domain.
    pub(super) domain: [[f64; 2]; 2],
    /// Whether `f64` leaves too few digits of its places: [`is_ill_scaled`].
    pub(super) ill_scaled: bool,
}

impl PatchGrid {
    /// Finds the breaks of a face's surface, and by five points of each side where sides coincide or come to one point.
    pub(super) fn new(face: &Face) -> Self {
        let s = &face.surface;
        let breaks = [0, 1].map(|d| s.breakpoints(d));
        let domain = s.domain();
        // As near as a file's nine digits put points of one place, a nanometre on a metre, or its ninth decimal; and as `f64` rounds them
        // far from the origin.
        let bounds = s.bounds();
        let (size, farthest) = (bounds.diagonal(), bounds.min.abs().max(bounds.max.abs()).max_element());
        let decimals = (LARGEST_DECIMAL * size).min(1.0);
        let tolerance = SAME_POINT * (decimals + size) + PLACED_ULPS * f64::EPSILON * farthest;
        // Five points along the side at the low or high end of a parameter.
        let side = |d: usize, end: usize| -> [Point; 5] {
            std::array::from_fn(|k| {
                let along = domain[1 - d][0] + (domain[1 - d][1] - domain[1 - d][0]) * k as f64 / 4.0;
                let x = domain[d][end];
                s.evaluate(if d == 0 { Uv::new(x, along) } else { Uv::new(along, x) })
            })
        };
        let same = |a: &Point, b: &Point| a.distance(*b) <= tolerance;
        // Corresponding points of opposite sides: equal corners alone would take a folded strip for a tube.
        let closed = [0, 1].map(|d| side(d, 0).iter().zip(&side(d, 1)).all(|(a, b)| same(a, b)));
        let poles = [0, 1].map(|d| [0, 1].map(|end| side(d, end).iter().all(|p| same(p, &side(d, end)[0]))));
        Self { breaks, closed, poles }
    }

    /// Number of patches.
    pub(super) fn patch_count(&self) -> usize {
        self.breaks.iter().map(|b| b.len() - 1).product()
    }
}

impl Patch {
    /// Places a patch of the part in the world, and adds its net to `nets`: about its own centre, of weight 1 in the middle. `face` indexes
    /// [`Geometry::faces`].
    pub(super) fn new(patch: &BezierPatch, face: u32, placed: &PlacedFace<'_>, nets: &mut Vec<V4>) -> Self {
        let middle = patch.local_jet(Uv::splat(0.5))[0];
        // Shifting to the patch's own centre before placing keeps the shape exact far from the origin.
        let center = middle.project();
        let first = nets.len();
        nets.extend(patch.points.iter().map(|p| {
            let w = p.w / middle.w;
            // Rounded once, so that neighbours still share their border when 1e6 mm are taken off both.
            let shifted = Vector::new(
                f64::mul_add(-center.x, p.w, p.x),
                f64::mul_add(-center.y, p.w, p.y),
                f64::mul_add(-center.z, p.w, p.z),
            );
            let a = placed.placement.vector(shifted / middle.w);
            [a.x, a.y, a.z, w]
        }));
        let size = nets[first..]
            .iter()
            .map(|p: &V4| p[0].abs().max(p[1].abs()).max(p[2].abs()) / p[3])
            .fold(0.0, f64::max);
        Self {
            face,
            degree: patch.degree.map(|d| d as u8),
            rounding: NET_ROUNDING * f64::EPSILON * size,
            net: first as u32,
            center: placed.placement.point(center),
            domain: patch.domain,
            ill_scaled: is_ill_scaled(patch),
        }
    }

    /// Largest coordinate of its control points about its centre, mm.
    pub(super) fn size(&self) -> f64 {
        self.rounding / (NET_ROUNDING * f64::EPSILON)
    }

    /// Turns surface parameters into local ones, in the unit square over the patch and beyond it elsewhere.
    pub(super) fn local(&self, uv: Uv) -> [f64; 2] {
        let [[u0, u1], [v0, v1]] = self.domain;
        [(uv.x - u0) / (u1 - u0), (uv.y - v0) / (v1 - v0)]
    }

    /// Turns derivatives by local parameters into those by the surface's.
    pub(super) fn surface_tangents(&self, [du, dv]: [Vector; 2]) -> [Vector; 2] {
        let [[u0, u1], [v0, v1]] = self.domain;
        [du / (u1 - u0), dv / (v1 - v0)]
    }

    /// Turns local parameters into surface parameters.
    pub(super) fn uv(&self, [u, v]: [f64; 2]) -> Uv {
        let [[u0, u1], [v0, v1]] = self.domain;
        Uv::new(u0 + (u1 - u0) * u, v0 + (v1 - v0) * v)
    }

    /// Number of its control points.
    #[inline(always)]
    pub(super) fn net_len(&self) -> usize {
        net::len(self.degree)
    }
}

/// Whether `f64` leaves too few digits of places on a patch: a knot span that is next to nothing beside its parameters, or weights
/// that differ by powers of ten.
pub(super) fn is_ill_scaled(patch: &BezierPatch) -> bool {
    let short = patch.domain.iter().any(|[a, b]| f64::EPSILON * a.abs().max(b.abs()) > LARGEST_ULP * (b - a));
    let weights = patch.points.iter().fold([f64::INFINITY, 0.0f64], |[lo, hi], p| [lo.min(p.w), hi.max(p.w)]);
    short || weights[1] > LARGEST_WEIGHT_RATIO * weights[0]
}

/// The first fundamental form of these derivatives: E, F, G.
#[inline(always)]
pub(super) fn metric([su, sv]: [Vector; 2]) -> [f64; 3] {
    [su.length_squared(), su.dot(sv), sv.length_squared()]
}

/// Divides a homogeneous jet: the position about the centre, mm, and the first derivatives by u and v.
#[inline(always)]
pub(super) fn project(jet: &Jet) -> (Vector, Vector, Vector) {
    let inv = 1.0 / jet.s[3];
    let xyz = |a: &V4| Vector::new(a[0], a[1], a[2]);
    let p = xyz(&jet.s) * inv;
    (p, (xyz(&jet.su) - p * jet.su[3]) * inv, (xyz(&jet.sv) - p * jet.sv[3]) * inv)
}

/// A derivative shorter than so many times the rounding of the net's points is not trusted: 1e-9 mm from the pole of a sphere
/// of radius 50 the normal was off by 1e-5 rad otherwise.
pub(super) const TRUSTED: f64 = 1e6;
/// Square of the least sine between two derivatives that give a normal: seven digits of it are right.
pub(super) const LEAST_SINE_SQUARED: f64 = 1e-18;
/// Ulps of a parameter that are a larger share of a patch's rectangle than this leave too few digits of places in it: of 10 mm a
/// picometre.
const LARGEST_ULP: f64 = 1e-10;
/// Weights of one patch that differ by more than this make it run at speeds so different that places in its slow part lose as many
/// digits.
const LARGEST_WEIGHT_RATIO: f64 = 1e4;
/// Shares of the way to the middle of the net at which the limit of the normal is taken at a singular point: the least is right
/// to about 1e-6 rad; nets that are flatter there need more.
const LIMIT_STEPS: [f64; 3] = [1e-6, 1e-4, 1e-2];

/// Unit normal along `Su × Sv` at local parameters; at a singular point the limit from the middle of the net.
///
/// `rounding` is the error of the net's points, mm.
pub(super) fn normal(net: &[V4], degree: [u8; 2], [u, v]: [f64; 2], jet: &Jet, rounding: f64) -> Vector {
    regular_normal(jet, rounding).unwrap_or_else(|| limit_normal(net, degree, [u, v], rounding))
}

/// Unit normal along `Su × Sv`; `None` where the rounding of the derivatives leaves too little of it.
#[inline(always)]
pub(super) fn regular_normal(jet: &Jet, rounding: f64) -> Option<Vector> {
    let (_, du, dv) = project(jet);
    cross_normal(du, dv, TRUSTED * rounding)
}

/// The unit vector along `du × dv`; `None` where one of them is not longer than `shortest`, mm per parameter, or both are parallel.
#[inline(always)]
pub(super) fn cross_normal(du: Vector, dv: Vector, shortest: f64) -> Option<Vector> {
    let n = du.cross(dv);
    let trusted = du.length_squared().min(dv.length_squared()) > shortest * shortest;
    let clear = n.length_squared() > LEAST_SINE_SQUARED * du.length_squared() * dv.length_squared();
    (trusted && clear).then(|| n.normalize())
}

/// The unit normal along `Su × Sv` near a singular point: at the first of [`LIMIT_STEPS`] towards the middle of the net, or else its low
/// corner, whose derivatives can be trusted, else at the last; z for a net that has none. `u` and `v` are local; `rounding` is the error of
/// the net's points, mm.
pub(super) fn limit_normal(net: &[V4], degree: [u8; 2], [u, v]: [f64; 2], rounding: f64) -> Vector {
    let shortest = TRUSTED * rounding;
    let trusted = |du: Vector, dv: Vector| du.length_squared().min(dv.length_squared()) > shortest * shortest;
    // Where a derivative vanishes the normal is the limit, taken as near as derivatives can be trusted.
    let normal_toward = |target: f64, step: f64| {
        let moved = [u, v].map(|x| x + step * (target - x));
        let (_, du, dv) = project(&net::evaluate(net, degree, moved[0], moved[1]));
        let n = du.cross(dv);
        let clear = n.length() > PARALLEL * du.length() * dv.length();
        (clear.then(|| n.normalize()), trusted(du, dv))
    };
    // A cusp along a middle line is not left by going towards the middle.
    let targets = [0.5, 0.0];
    for (target, step) in targets.into_iter().flat_map(|target| LIMIT_STEPS.map(|step| (target, step))) {
        if let (Some(normal), true) = normal_toward(target, step) {
            return normal;
        }
    }
    // The farthest, whatever its derivatives; a net that is a point or a line has no normal, and any does.
    let farthest = LIMIT_STEPS[LIMIT_STEPS.len() - 1];
    targets.into_iter().find_map(|target| normal_toward(target, farthest).0).unwrap_or(Vector::Z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cusp_along_a_middle_line_has_the_normal_of_the_surface_beside_it() {
        // A cubic with its cusp in the middle, extruded along z: (0,0), (1,1), (0,1), (1,0) come to a point at (1/2, 3/4) along y.
        let profile = [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]];
        let net: Vec<V4> = profile.iter().flat_map(|&[x, y]| [[x, y, 0.0, 1.0], [x, y, 1.0, 1.0]]).collect();
        for v in [0.0, 0.3, 0.5] {
            let normal = limit_normal(&net, [3, 1], [0.5, v], 1e-16);
            assert!((normal.x.abs() - 1.0).abs() < 1e-3, "{v}: {normal}");
        }
    }
}

//! Leaves: pieces of patches so flat that a ray usually meets each at most once, provably.
//!
//! A leaf stores its net about its own centre, boxes around the homogeneous derivatives over its domain enlarged by
//! [`EXTENSION`], an axis-parallel and an oriented box. Patches are halved until the derivative boxes, preconditioned by the
//! inverse of their middles, deviate from the identity by less than `Settings::flatness` when seen along the normal.

use super::net::{self, Net, Slopes, V4};
use super::patch::{Patch, PatchGrid};
use super::tolerances::{EXTENSION, NEWTON_STEP, PARALLEL, REACH, ROUND, contact_distance};
use crate::math::{Aabb, Vector};

/// Rounding operations of the extraction, and of the shift to the leaf's centre, that a control point has behind it beside its
/// halvings.
const EXTRACTIONS: f64 = 4.0;
/// Half ulps of a leaf's place by which its rounded centre makes neighbours drift apart, far from the origin.
const PLACED_ROUNDING: f64 = 8.0;
/// Roots count beyond a trimmed border as far as this many deciding distances: on grazed faces they stray by the inverse of the sine.
const BEYOND_OF_DECIDING: f64 = 32.0;
/// The part of a patch that is all of it, in the patch's local parameters.
pub(super) const WHOLE_PATCH: [[f64; 2]; 2] = [[0.0, 1.0]; 2];
/// A Jacobian whose determinant is a smaller part of the product of its row sums says nothing of which halving helps.
const NEARLY_SINGULAR: f64 = 1e-9;

/// A piece of a patch.
#[derive(Clone, Debug)]
pub(super) struct Leaf {
    /// Centre in the world.
    pub(super) center: Vector,
    /// Axes of the oriented box: tangent, tangent, normal.
    pub(super) axes: [Vector; 3],
    /// The oriented box about the centre, along `axes`.
    pub(super) box_low: Vector,
    pub(super) box_high: Vector,
    /// Largest coordinate of a control point about the centre.
    pub(super) radius: f64,
    /// Bound of the error of the control points, mm.
    pub(super) slop: f64,
    /// The rectangle in which roots count, local units: wider than the unit square on sides that are the border of a surface
    /// along which a trim may run.
    pub(super) reach: [[f64; 2]; 2],
    /// Index of its first control point in [`Geometry::nets`].
    pub(super) net: u32,
    /// Indices into [`Geometry::patches`] and [`Geometry::faces`].
    pub(super) patch: u32,
    pub(super) face: u32,
    pub(super) degree: [u8; 2],
    /// Whether no trim passes: every root counts.
    pub(super) whole: bool,
    /// Whether its patch has a pole of the surface.
    pub(super) has_pole: bool,
    /// Distance across a ray below which a box of the patch touches it, mm: [`contact_distance`]. Here, since a clipping that read it of
    /// the patch waited for memory.
    pub(super) contact: f64,
    /// The rectangle of the patch's local domain.
    pub(super) rect: [[f64; 2]; 2],
}

/// Where a leaf's control points stand, for prefetching them ahead of their use.
#[derive(Clone, Copy, Debug)]
pub(super) struct NetPlace {
    /// Index of the first in [`Geometry::nets`].
    pub(super) first: u32,
    /// How many there are.
    pub(super) points: u16,
}

impl NetPlace {
    pub(super) fn new(leaf: &Leaf) -> Self {
        Self { first: leaf.net, points: net::len(leaf.degree) as u16 }
    }
}

impl Leaf {
    /// Its control points among all of [`Geometry::nets`], about its centre.
    pub(super) fn net<'a>(&self, nets: &'a [V4]) -> &'a [V4] {
        &nets[self.net as usize..self.net as usize + net::len(self.degree)]
    }

    /// Maps the leaf's parameters, 0 to 1 in each direction, to its patch's, likewise 0 to 1; the inverse of [`Self::leaf_parameters`].
    #[inline]
    pub(super) fn patch_parameters(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [[u0, u1], [v0, v1]] = self.rect;
        [u0 + (u1 - u0) * u, v0 + (v1 - v0) * v]
    }

    /// Turns local parameters of the patch into those of the leaf, outside the unit square where they lie beside it.
    pub(super) fn leaf_parameters(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [[u0, u1], [v0, v1]] = self.rect;
        [(u - u0) / (u1 - u0), (v - v0) / (v1 - v0)]
    }
}

/// The first three of four numbers: of a homogeneous point not yet divided by its weight.
pub(super) fn xyz(a: &V4) -> Vector {
    Vector::new(a[0], a[1], a[2])
}

/// A leaf with what goes elsewhere: the axis-parallel box in the world, derivative boxes over the enlarged domain, and the net about its
/// centre.
pub(super) struct Described {
    pub(super) leaf: Leaf,
    pub(super) bounds: Aabb,
    pub(super) slopes: Slopes,
    pub(super) net: Net,
}

/// Describes `piece`, the part of a patch's net over `rect` of its local parameters, as a leaf in the world; `depth` counts the
/// roundings behind it. The caller fills in `net`, `patch`, `face`, `whole` and `has_pole`.
pub(super) fn describe(patch: &Patch, piece: &[V4], rect: [[f64; 2]; 2], depth: u32) -> Described {
    let degree = patch.degree;
    // A whole patch has its centre there and weight 1 but for rounding: its leaf has the same net, which then stands in memory once.
    let middle = if rect == WHOLE_PATCH { [0.0, 0.0, 0.0, 1.0] } else { net::evaluate(piece, degree, 0.5, 0.5).s };
    let center = patch.center + xyz(&middle) / middle[3];
    // The offset as the rounded centre has it, so that the net and the centre agree.
    let offset = center - patch.center;
    // Weight 1 in the middle, so that derivatives of the homogeneous net are about millimetres, as its bounds are.
    let centred: Net = piece
        .iter()
        .map(|p| {
            let a = (xyz(p) - offset * p[3]) / middle[3];
            [a.x, a.y, a.z, p[3] / middle[3]]
        })
        .collect();
    // A little more than the leaf is described: a root just beyond its border is then still proved to be the only one, whichever of two
    // neighbours finds it.
    let mut enlarged = centred.clone();
    for d in 0..2 {
        net::restrict(&mut enlarged, degree, d, [-EXTENSION, 1.0 + EXTENSION]);
    }
    let mut slopes = net::slopes(&enlarged, degree);
    for four in [&mut slopes.u, &mut slopes.v, &mut slopes.ru, &mut slopes.rv] {
        // Back to the leaf's own parameters.
        four.iter_mut().for_each(|x| *x /= 1.0 + 2.0 * EXTENSION);
    }
    let axes = box_axes(xyz(&slopes.u), xyz(&slopes.v));
    let at = |p: &V4| xyz(p) / p[3];
    let size = |net: &[V4]| net.iter().map(|p| at(p).abs().max_element()).fold(0.0, f64::max);
    let radius = size(&centred);
    // Each halving and the extraction before it err by at most one rounding a step and degree, relative to the patch.
    let steps = (degree[0] as f64 + degree[1] as f64 + EXTRACTIONS) * (depth as f64 + EXTRACTIONS);
    // The centre itself is rounded where it is placed: far from the origin neighbours drift apart by that much.
    let placed = PLACED_ROUNDING * ROUND * center.abs().max_element();
    let slop = steps * ROUND * (size(piece) + offset.abs().max_element() + radius) + placed;
    let (mut lo, mut hi) = (Vector::INFINITY, Vector::NEG_INFINITY);
    let (mut box_low, mut box_high) = (lo, hi);
    for p in &centred {
        let p = at(p);
        (lo, hi) = (lo.min(p), hi.max(p));
        let along = Vector::new(p.dot(axes[0]), p.dot(axes[1]), p.dot(axes[2]));
        (box_low, box_high) = (box_low.min(along), box_high.max(along));
    }
    // Adding the centre rounds the corners once more.
    let pad = slop + PLACED_ROUNDING * ROUND * (center.abs().max_element() + radius);
    let leaf = Leaf {
        center,
        axes,
        box_low: box_low - pad,
        box_high: box_high + pad,
        radius,
        slop,
        reach: REACH,
        net: 0,
        patch: 0,
        face: 0,
        degree,
        whole: false,
        has_pole: false,
        contact: contact_distance(patch.size()),
        rect,
    };
    let bounds = Aabb { min: center + lo - pad, max: center + hi + pad };
    Described { leaf, bounds, slopes, net: centred }
}

/// Which sides, low and high in u and in v, of the leaf over `rect` lie on the border of its surface. The two ends of a surface that closes
/// on itself are no border, nor is a pole, beyond which the surface comes back.
pub(super) fn border_sides(grid: &PatchGrid, patch: &Patch, rect: [[f64; 2]; 2]) -> [[bool; 2]; 2] {
    [0, 1].map(|d: usize| {
        let ends = [grid.breaks[d][0], grid.breaks[d][grid.breaks[d].len() - 1]];
        [0, 1].map(|end| {
            let ends_here = rect[d][end] == end as f64 && patch.domain[d][end] == ends[end];
            ends_here && !grid.closed[d] && !grid.poles[d][end]
        })
    })
}

/// Widens the reach and boxes of a leaf on sides where `border` says that the surface ends, so that roots up to
/// [`BEYOND_OF_DECIDING`] times `deciding_distance`, mm, beyond count: the side of the shared edge decides there, not the end of the
/// surface. Elsewhere another leaf begins.
pub(super) fn widen(described: &mut Described, border: [[bool; 2]; 2], deciding_distance: f64) {
    let Described { leaf, bounds, slopes, .. } = described;
    // No farther than half of the extension: beyond the extension the derivative boxes prove nothing.
    let far = BEYOND_OF_DECIDING * deciding_distance;
    for (d, slope) in [&slopes.u, &slopes.v].into_iter().enumerate() {
        let beyond = (far / xyz(slope).length().max(f64::MIN_POSITIVE)).clamp(NEWTON_STEP, 0.5 * EXTENSION);
        if border[d][0] {
            leaf.reach[d][0] = -beyond;
        }
        if border[d][1] {
            leaf.reach[d][1] = 1.0 + beyond;
        }
    }
    // The hierarchy must lead rays to what counts beyond the border.
    if border.iter().flatten().any(|&b| b) {
        bounds.min -= far;
        bounds.max += far;
        leaf.box_low -= far;
        leaf.box_high += far;
    }
}

/// Unit axes of an oriented box: along the longer derivative, across it, and the normal last; any frame that fits where there is none.
fn box_axes(su: Vector, sv: Vector) -> [Vector; 3] {
    let longer = if sv.length() > su.length() { sv } else { su };
    let x = longer.try_normalize().unwrap_or(Vector::X);
    // At a pole one derivative vanishes; any normal to the other serves, since the box needs a frame and not the
    // surface's normal.
    let n = su.cross(sv);
    let z = if n.length() > PARALLEL * su.length() * sv.length() { n.try_normalize() } else { None }
        .unwrap_or_else(|| x.any_orthonormal_vector());
    [x, z.cross(x), z]
}

/// The middle Jacobian in the tangent plane: ∂x/∂u, ∂x/∂v, ∂y/∂u, ∂y/∂v.
fn tangent_jacobian(leaf: &Leaf, slopes: &Slopes) -> [f64; 4] {
    let p = |a: &V4, e: Vector| xyz(a).dot(e);
    let [x, y, _] = leaf.axes;
    [p(&slopes.u, x), p(&slopes.v, x), p(&slopes.u, y), p(&slopes.v, y)]
}

/// How far derivatives of radii `a` stray along `e`; that of the weight counts times the leaf's radius.
fn spread_along(a: &V4, e: Vector, radius: f64) -> f64 {
    a[0] * e.x.abs() + a[1] * e.y.abs() + a[2] * e.z.abs() + a[3] * radius
}

/// Largest row sum of `|J⁻¹| R` for a ray along the normal, with `R` the radii of the derivative boxes; infinite where the middle Jacobian
/// `J` is singular.
pub(super) fn deviation(leaf: &Leaf, slopes: &Slopes) -> f64 {
    let [a, b, c, d] = tangent_jacobian(leaf, slopes);
    let det = a * d - b * c;
    if !(det.abs() > 0.0) {
        return f64::INFINITY;
    }
    let r = |e: Vector| spread_along(&slopes.ru, e, leaf.radius) + spread_along(&slopes.rv, e, leaf.radius);
    let rx = r(leaf.axes[0]);
    let ry = r(leaf.axes[1]);
    ((d.abs() * rx + b.abs() * ry) / det.abs()).max((c.abs() * rx + a.abs() * ry) / det.abs())
}

/// The direction, 0 for u and 1 for v, whose halving leaves the smaller deviation, predicted from second differences; ties go by the
/// parity of `depth`.
pub(super) fn flattening_direction(leaf: &Leaf, slopes: &Slopes, net: &[V4], depth: u32) -> usize {
    let [p, q] = leaf.degree.map(usize::from);
    let m = q + 1;
    // Bounds of the second derivatives: the first ones stray by half of these over the leaf.
    let (mut uu, mut uv, mut vv) = ([0f64; 4], [0f64; 4], [0f64; 4]);
    let fp = p as f64;
    let fq = q as f64;
    for i in 0..=p {
        for j in 0..=q {
            let at = |a: usize, b: usize| &net[a * m + b];
            for c in 0..4 {
                if i + 2 <= p {
                    let x = fp * (fp - 1.0) * (at(i + 2, j)[c] - 2.0 * at(i + 1, j)[c] + at(i, j)[c]);
                    uu[c] = uu[c].max(x.abs());
                }
                if j + 2 <= q {
                    let x = fq * (fq - 1.0) * (at(i, j + 2)[c] - 2.0 * at(i, j + 1)[c] + at(i, j)[c]);
                    vv[c] = vv[c].max(x.abs());
                }
                if i < p && j < q {
                    let x = fp * fq * (at(i + 1, j + 1)[c] - at(i + 1, j)[c] - at(i, j + 1)[c] + at(i, j)[c]);
                    uv[c] = uv[c].max(x.abs());
                }
            }
        }
    }
    let [a, b, c, d] = tangent_jacobian(leaf, slopes);
    let det = a * d - b * c;
    // Ties alternate, or a leaf of equal sides would be cut into strips.
    let alternate = depth as usize % 2;
    // Near a pole the inverse says nothing: the direction that bends more is halved.
    if !(det.abs() > NEARLY_SINGULAR * (a.abs() + b.abs()) * (c.abs() + d.abs())) {
        let square = |x: &V4| x.iter().map(|c| c * c).sum::<f64>();
        let nu = square(&uu);
        let nv = square(&vv);
        return if nu == nv { alternate } else { usize::from(nu < nv) };
    }
    let inverse = [[d / det, -b / det], [-c / det, a / det]];
    let g = |x: &V4, row: usize| {
        inverse[row][0].abs() * spread_along(x, leaf.axes[0], leaf.radius)
            + inverse[row][1].abs() * spread_along(x, leaf.axes[1], leaf.radius)
    };
    // Halving u quarters Suu, halves Suv, and doubles u's row of the inverse. Su strays by Suu + Suv and Sv by Suv
    // + Svv, so the two halves of Suv make one.
    let after_u = 2.0 * (g(&uu, 0) / 4.0 + g(&uv, 0) + g(&vv, 0)) + g(&uu, 1) / 4.0 + g(&uv, 1) + g(&vv, 1);
    let after_v = 2.0 * (g(&vv, 1) / 4.0 + g(&uv, 1) + g(&uu, 1)) + g(&vv, 0) / 4.0 + g(&uv, 0) + g(&uu, 0);
    if after_u == after_v { alternate } else { usize::from(after_u > after_v) }
}

//! What the one-step test reads of a leaf, packed into three cache lines; and what names a hit on it, in one.

use super::geometry::Geometry;
use super::leaf::Leaf;
use super::net::{self, Jet, Slopes, V4};
use super::tolerances::{COORDINATE_ROUNDING, REACH, ROUND};
use crate::math::{FaceId, Uv, Vector};

/// A leaf as the one-step test sees it.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Linearization {
    /// By coordinate (x, y, z, weight): middles of the boxes around ∂/∂u and ∂/∂v, the point in the middle, and the sum of the
    /// radii of both boxes. Side by side, so that one pass projects all of them.
    rows: [V4; 4],
    /// Centre in the world.
    pub(super) center: Vector,
    /// The part of [`super::structure::Exact::noise`] that does not depend on the ray, mm.
    pub(super) still_noise: f64,
    /// Half of the rectangle in which roots count, rounded up.
    pub(super) half: [f32; 2],
    /// Index of its first control point in [`Geometry::nets`].
    pub(super) net: u32,
    pub(super) degree: [u8; 2],
    /// Whether no trim passes: every root counts.
    pub(super) whole: bool,
    /// Whether roots count beyond the unit square.
    pub(super) widened: bool,
    /// Whether every root is settled by the surface as given.
    pub(super) ill_scaled: bool,
}

/// The data that identify a hit on a leaf.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct HitLabel {
    /// The rectangle of the surface's domain: low corner and extent.
    low: Uv,
    extent: Uv,
    /// Error of the control points, and of derivatives got from them, mm.
    pub(super) rounding: f64,
    /// −1 where the outward normal is `-(Su × Sv)`.
    pub(super) sign: f64,
    pub(super) face: FaceId,
    pub(super) patch: u32,
    /// Whether places and normals are taken from the surface as given.
    pub(super) ill_scaled: bool,
}

impl Linearization {
    /// Packs a leaf, the boxes around its derivatives and the homogeneous point in its middle, all about its centre.
    pub(super) fn new(leaf: &Leaf, slopes: &Slopes, middle: &V4, ill_scaled: bool) -> Self {
        // Rounded up: in single precision it must not end before the leaf does.
        let half = leaf.reach.map(|[lo, hi]| ((0.5 - lo).max(hi - 0.5) as f32).next_up());
        Self {
            rows: std::array::from_fn(|c| [slopes.u[c], slopes.v[c], middle[c], slopes.ru[c] + slopes.rv[c]]),
            center: leaf.center,
            still_noise: COORDINATE_ROUNDING * ROUND * leaf.radius + leaf.slop,
            half,
            net: leaf.net,
            degree: leaf.degree,
            whole: leaf.whole,
            widened: leaf.reach != REACH,
            ill_scaled,
        }
    }

    /// As [`Leaf::net`].
    #[inline(always)]
    pub(super) fn net<'a>(&self, nets: &'a [V4]) -> &'a [V4] {
        &nets[self.net as usize..self.net as usize + net::len(self.degree)]
    }

    /// Derivatives by u and by v, then the value, in the middle of the leaf, seen by `n·A − k·W`.
    #[inline(always)]
    pub(super) fn projected(&self, n: Vector, k: f64) -> [f64; 3] {
        let [x, y, z, w] = &self.rows;
        let all: V4 = std::array::from_fn(|i| n.x * x[i] + n.y * y[i] + n.z * z[i] - k * w[i]);
        [all[0], all[1], all[2]]
    }

    /// Largest amount by which the derivatives that [`Self::projected`] gives for `n` and `k` may differ from those in the middle, anywhere
    /// on the leaf's enlarged domain: the sum of both parameters' bounds.
    #[inline(always)]
    pub(super) fn derivative_spread(&self, n: Vector, k: f64) -> f64 {
        let [x, y, z, w] = &self.rows;
        n.x.abs() * x[3] + n.y.abs() * y[3] + n.z.abs() * z[3] + k.abs() * w[3]
    }
}

/// The value of a jet, then its derivatives by u and by v, seen by `n·A − k·W`.
#[inline(always)]
pub(super) fn projected_jet(jet: &Jet, n: Vector, k: f64) -> [f64; 3] {
    let value = |a: &V4| n.x * a[0] + n.y * a[1] + n.z * a[2] - k * a[3];
    [value(&jet.s), value(&jet.su), value(&jet.sv)]
}

impl HitLabel {
    /// Gathers for the hits on a leaf the numbers of its face and patch, its rectangle of the domain, and the sign and rounding of normals.
    pub(super) fn new(leaf: &Leaf, geometry: &Geometry) -> Self {
        let patch = &geometry.patches[leaf.patch as usize];
        let face = &geometry.faces[leaf.face as usize];
        let [u, v] = leaf.rect;
        let (low, high) = (patch.uv([u[0], v[0]]), patch.uv([u[1], v[1]]));
        Self {
            low,
            extent: high - low,
            rounding: patch.rounding,
            sign: face.sign,
            face: face.id,
            patch: leaf.patch,
            ill_scaled: patch.ill_scaled,
        }
    }

    /// Turns local parameters of the leaf into surface parameters.
    #[inline(always)]
    pub(super) fn uv(&self, [u, v]: [f64; 2]) -> Uv {
        self.low + self.extent * Uv::new(u, v)
    }
}

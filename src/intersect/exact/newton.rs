//! Newton's method from a seed on one face: the last step of polishing, and by itself the plain iterative tracer.

use super::patch::{self, project};
use super::structure::Exact;
use super::tolerances::TANGENT;
use super::trim::Region;
use crate::math::{FaceId, Ray, Uv, Vector, orthonormal_pair};

/// After a step this short, as a share of a patch, the point is moved along and not evaluated again. The normal stays that of the
/// place before the step, always on the side that Newton's method comes from: with 3e-10 the angular momentum of a ray in a mirror
/// ball drifted by 2.6e-7 in 20,000 bounces.
pub(super) const LAST_STEP: f64 = 1e-14;
/// Steps stall within this share of the patch of the ray where rounding or a singular point leaves no more: so near is on the ray.
pub(super) const STALLED: f64 = 1e-11;
/// Ulps of the largest coordinate that a point's place across the ray is off.
pub(super) const ROUNDING: f64 = 8.0;

/// Share of the bound of rounding across the ray within which a point needs no further step: most are rounded by less.
pub(super) const SETTLED: f64 = 0.25;

/// A point of a face on a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Distance along the ray, mm; may be negative.
    pub t: f64,
    /// Parameters on the face's surface.
    pub uv: Uv,
    /// Outward unit normal.
    pub normal: Vector,
    /// Distance from the ray, mm.
    pub residual: f64,
    /// Whether it lies inside the face's trims.
    pub inside: bool,
    /// Index of the patch, as [`Hit::primitive`](crate::intersect::Hit::primitive).
    pub patch: u32,
}

impl Exact {
    /// Follows Newton's method on a face from surface parameters to the ray, from patch to patch; `None` when it has not
    /// come within 1e-11 of its patch and 1e-9 mm (or the rounding of the origin) after `steps`.
    ///
    /// Nothing is proved: the point found is on the spline and on the ray, and may be any of their common points, before the range of the
    /// ray or outside the trims too. `None` also where the face is not traced, `uv` is not finite or the Jacobian becomes singular.
    pub fn converge(&self, ray: &Ray, face: FaceId, uv: Uv, steps: u32) -> Option<SurfacePoint> {
        let record = &self.geometry.faces[*self.geometry.by_id.get(&face)? as usize];
        let grid = &self.geometry.grids[record.grid as usize];
        // Two equations in two unknowns: the distances of the surface point from the ray along two directions across it.
        let (n1, n2) = orthonormal_pair(ray.direction);
        let bounds = [0, 1].map(|d| [grid.breaks[d][0], grid.breaks[d][grid.breaks[d].len() - 1]]);
        let mut uv = Uv::new(uv.x.clamp(bounds[0][0], bounds[0][1]), uv.y.clamp(bounds[1][0], bounds[1][1]));
        // Clamping keeps NaN, and a NaN would find no patch.
        if !uv.is_finite() {
            return None;
        }
        let mut index = self.geometry.patch_at(record, uv);
        let mut last = f64::INFINITY;
        for step in 0..=steps {
            let patch = &self.geometry.patches[index as usize];
            let local = patch.local(uv);
            let jet = self.geometry.jet(patch, local);
            let (p, du, dv) = project(&jet);
            // About the patch's centre: far from the origin only the shift is rounded, not the whole evaluation.
            let oc = ray.origin - patch.center;
            let off = p - oc;
            let (f1, f2) = (n1.dot(off), n2.dot(off));
            let across = f1.hypot(f2);
            // Relative to the patch: a nanometre is most of a ball of a micrometre.
            let near = TANGENT.min(STALLED * patch.size());
            let rounding = ROUNDING * f64::EPSILON * (oc.abs().max_element() + p.abs().max_element());
            let (a, b, c, d) = (n1.dot(du), n1.dot(dv), n2.dot(du), n2.dot(dv));
            let inv = 1.0 / (a * d - b * c);
            let (xu, xv) = ((d * f1 - b * f2) * inv, (a * f2 - c * f1) * inv);
            let next = patch.uv([local[0] - xu, local[1] - xv]);
            let fits = |d: usize| next[d] >= bounds[d][0] && next[d] <= bounds[d][1];
            // The point is moved along, and one evaluation of about four saved.
            let moves = xu.abs().max(xv.abs()) < LAST_STEP && fits(0) && fits(1);
            // At borders and where steps mean little the distance decides: stop when steps no longer help.
            let stalled = across < near && across >= 0.5 * last;
            let settled = across <= SETTLED * rounding || stalled;
            if moves || settled || step == steps {
                let (uv, off) = if moves { (next, off - du * xu - dv * xv) } else { (uv, off) };
                // After the step in first order: what is left of the second is the square of [`LAST_STEP`].
                let residual = n1.dot(off).hypot(n2.dot(off));
                if residual > near + rounding {
                    return None;
                }
                let net = self.geometry.net(patch);
                let normal = record.sign * patch::normal(net, patch.degree, local, &jet, patch.rounding);
                let t = ray.direction.dot(off);
                let trim = &self.geometry.trims[record.trim as usize];
                let inside = match trim.cell_at(uv) {
                    Region::Border => trim.is_inside(uv),
                    decided => decided == Region::Inside,
                };
                return Some(SurfacePoint { t, uv, normal, residual, inside, patch: index });
            }
            last = across;
            // A singular Jacobian gives no direction to go on in.
            if !(xu.is_finite() && xv.is_finite()) {
                return None;
            }
            uv = next;
            for k in 0..2 {
                let [first, last] = bounds[k];
                if uv[k] < first || uv[k] > last {
                    let period = last - first;
                    // Across the seam of a closed surface the walk goes on; else it stops at the border.
                    uv[k] = if grid.closed[k] && uv[k] > first - period && uv[k] < last + period {
                        if uv[k] < first { uv[k] + period } else { uv[k] - period }
                    } else {
                        uv[k].clamp(first, last)
                    };
                }
            }
            index = self.geometry.patch_at(record, uv);
        }
        None
    }

    /// Distance from a point of the world to the point of a face's surface at given parameters, mm; `None` where the face is not traced.
    pub fn distance_at(&self, face: FaceId, uv: Uv, point: crate::math::Point) -> Option<f64> {
        let record = &self.geometry.faces[*self.geometry.by_id.get(&face)? as usize];
        let patch = &self.geometry.patches[self.geometry.patch_at(record, uv) as usize];
        let jet = self.geometry.jet(patch, patch.local(uv));
        Some((point - patch.center - project(&jet).0).length())
    }

    /// Largest coordinate, mm, about its own centre, of the patch of a face that holds the parameters; `None` where [`Self::patch_at`] is.
    pub(in crate::intersect) fn patch_size(&self, face: FaceId, uv: Uv) -> Option<f64> {
        Some(self.geometry.patches[self.patch_at(face, uv)? as usize].size())
    }

    /// The patch of a face that holds the parameters, the outermost one where they lie beyond the domain; `None` where the face has no
    /// surface that is traced, or they are not finite.
    pub(in crate::intersect) fn patch_at(&self, face: FaceId, uv: Uv) -> Option<u32> {
        let record = &self.geometry.faces[*self.geometry.by_id.get(&face)? as usize];
        uv.is_finite().then(|| self.geometry.patch_at(record, uv))
    }

    /// Whether the parameters lie within a patch, its upper ends excluded, so that [`Self::patch_at`] finds no other.
    #[inline(always)]
    pub(in crate::intersect) fn patch_holds(&self, patch: u32, uv: Uv) -> bool {
        let [u, v] = self.geometry.patches[patch as usize].domain;
        (uv.x >= u[0]) & (uv.x < u[1]) & (uv.y >= v[0]) & (uv.y < v[1])
    }

    /// Whether a face is traced: `false` for ready meshes, for surfaces that are not finite or have weights that are not positive, and for
    /// numbers beyond the model's.
    pub fn traces(&self, face: FaceId) -> bool {
        self.geometry.by_id.contains_key(&face)
    }

    /// The closed shell that a face belongs to, by instance and shell; `None` for faces of open shells and ready meshes.
    pub fn solid_of(&self, face: FaceId) -> Option<[u32; 2]> {
        self.geometry.faces[*self.geometry.by_id.get(&face)? as usize].solid
    }

    /// Outward unit normal of a face in the world at surface parameters, its limit at poles; `None` where the face is not traced.
    pub fn normal_at(&self, face: FaceId, uv: Uv) -> Option<Vector> {
        let record = &self.geometry.faces[*self.geometry.by_id.get(&face)? as usize];
        let patch = &self.geometry.patches[self.geometry.patch_at(record, uv) as usize];
        let local = patch.local(uv);
        let (net, jet) = (self.geometry.net(patch), self.geometry.jet(patch, local));
        Some(record.sign * patch::normal(net, patch.degree, local, &jet, patch.rounding))
    }
}

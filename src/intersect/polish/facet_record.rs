//! What polishing reads of a facet again and again, in half a cache line.

use super::limits::{BEND_OF_SAGS, HIDDEN_BENDS, no_sag};
use crate::intersect::exact::Exact;
use crate::math::{FaceId, Ray, Uv};
use crate::mesh::FacetMesh;
use rustc_hash::FxHashMap;

/// A ray whose sine to the facet that it leaves is above so many of the facet's bends is decided by the facet's own normal: twice what a
/// root may hide below.
const CLEAR_BENDS: f64 = 2.0 * HIDDEN_BENDS;
/// The least sine for which that holds: a hundred times what `f32` rounds.
const LEAST_CLEAR_SINE: f64 = 1e-5;
/// In [`FacetRecord::patch`]: its face has no surface that is traced.
const NO_PATCH: u32 = u32::MAX;
/// In [`FacetRecord::solid`]: its face is part of no closed shell.
const NO_SOLID: u32 = u32::MAX;

/// One facet with the face, patch and closed shell that it is of.
#[derive(Clone, Copy, Debug)]
pub(super) struct FacetRecord {
    normal: [f32; 3],
    /// Rays that leave it at a larger sine leave the spline to the same side, and their next root hides from no facet.
    least_sine: f32,
    /// Distance from the spline, mm.
    pub(super) sag: f32,
    patch: u32,
    solid: u32,
    pub(super) face: FaceId,
}

impl FacetRecord {
    /// Makes the records of all facets of `mesh`, in their order; where no sag was proved it is `sag`, mm.
    pub(super) fn of_mesh(mesh: &FacetMesh, exact: &Exact, sag: f64) -> Vec<Self> {
        let mut solids: FxHashMap<[u32; 2], u32> = FxHashMap::default();
        let mut solid_of = |face| {
            let next = solids.len() as u32;
            exact.solid_of(face).map_or(NO_SOLID, |solid| *solids.entry(solid).or_insert(next))
        };
        (0..mesh.facets.len())
            .map(|f| {
                let facet = &mesh.facets[f];
                let [a, b, c, d] = mesh.corners(f);
                let length = a.distance(b).max(b.distance(c)).max(c.distance(d)).max(d.distance(a));
                // A facet without area gets a normal of zero, and with it a sine that never decides.
                let normal = (b - a).cross(c - a).normalize_or_zero();
                let sag = mesh.sag.get(f).copied().filter(|s| s.is_finite()).unwrap_or(sag).max(no_sag(length));
                // Of a long strip on a cylinder the normals turn across it, however long it is.
                let turned = facet.vertices.map(|v| mesh.vertices[v as usize].normal.distance(normal));
                let bend = turned.into_iter().fold(BEND_OF_SAGS * sag / length, f64::max);
                let least_sine = (CLEAR_BENDS * bend).max(LEAST_CLEAR_SINE);
                let corners = facet.vertices.map(|v| mesh.vertices[v as usize].uv);
                let middle = 0.25 * corners.iter().sum::<Uv>();
                let patch = exact.patch_at(facet.face, middle).unwrap_or(NO_PATCH);
                Self {
                    normal: normal.as_vec3().to_array(),
                    least_sine: least_sine as f32,
                    sag: sag as f32,
                    patch,
                    solid: solid_of(facet.face),
                    face: facet.face,
                }
            })
            .collect()
    }

    /// The sine of a ray's angle to the facet, negative for rays that go in; `None` at or below the facet's
    /// `least_sine`, where the spline may be met from the other side.
    #[inline(always)]
    pub(super) fn decisive_sine(&self, ray: &Ray) -> Option<f32> {
        let ([x, y, z], d) = (self.normal, ray.direction.as_vec3());
        let sine = x * d.x + y * d.y + z * d.z;
        (sine.abs() > self.least_sine).then_some(sine)
    }

    /// The patch of `exact` that a place of the facet, in the surface's parameters, lies on; `None` where there is none.
    #[inline(always)]
    pub(super) fn patch(&self, exact: &Exact, uv: Uv) -> Option<u32> {
        if self.patch == NO_PATCH {
            return None;
        }
        if exact.patch_holds(self.patch, uv) { Some(self.patch) } else { exact.patch_at(self.face, uv) }
    }

    /// Whether its face is part of a closed shell.
    #[inline(always)]
    pub(super) fn is_of_solid(&self) -> bool {
        self.solid != NO_SOLID
    }

    /// Whether both are of one closed shell, or each of none.
    #[inline(always)]
    pub(super) fn shares_solid(&self, other: &Self) -> bool {
        self.solid == other.solid
    }
}

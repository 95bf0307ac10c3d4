//! The triangles of facets, for hierarchies that know nothing else.

use super::facet::is_usable;
use super::facet_hit::FacetHit;
use crate::math::Point;
use crate::mesh::FacetMesh;

/// A triangle of a facet: twice the facet, and one more where it is the second, of the corners 0, 2 and 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TriangleCode(u32);

impl TriangleCode {
    /// Lists the triangles of all facets in their order; leaves out facets with a corner that is not finite or beyond 1e12 mm.
    pub(crate) fn enumerate(mesh: &FacetMesh) -> Vec<Self> {
        (0..mesh.facets.len())
            .filter(|&f| mesh.corners(f).iter().all(|&p| is_usable(p)))
            .flat_map(|f| {
                let first = (f as u32) << 1;
                let second = (!mesh.facets[f].is_triangle()).then_some(Self(first | 1));
                std::iter::once(Self(first)).chain(second)
            })
            .collect()
    }

    /// The second triangle of the same facet.
    #[cfg(feature = "contenders")]
    pub(crate) fn second(self) -> Self {
        Self(self.0 | 1)
    }

    pub(crate) fn facet(self) -> u32 {
        self.0 >> 1
    }

    pub(crate) fn is_second(self) -> bool {
        self.0 & 1 == 1
    }

    /// Positions of its corners, mm; `mesh` is the one it was enumerated from.
    pub(crate) fn corners(self, mesh: &FacetMesh) -> [Point; 3] {
        let [a, b, c, d] = mesh.corners(self.facet() as usize);
        if self.is_second() { [a, c, d] } else { [a, b, c] }
    }

    /// Makes a hit on it at the distance `t`, mm, from the weights of its second and third corner.
    pub(crate) fn hit(self, t: f64, [b1, b2]: [f64; 2]) -> FacetHit {
        FacetHit { t, facet: self.facet(), second: self.is_second(), b: [1.0 - b1 - b2, b1, b2] }
    }
}

//! Hits on facets, and which of them is the nearest.

use std::hint::select_unpredictable;

/// A hit on a facet: which, where on it, and how far along the ray, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FacetHit {
    pub(crate) t: f64,
    pub(crate) facet: u32,
    /// Whether the triangle (0, 2, 3) was hit, not (0, 1, 2).
    pub(crate) second: bool,
    /// Weights of that triangle's corners; their sum is one.
    pub(crate) b: [f64; 3],
}

/// Stands in place of a facet where there is none.
const NO_FACET: u32 = u32::MAX;

/// The nearest hit so far, with its edge functions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    /// Its distance, mm, or without a hit the end of the ray's range.
    pub(crate) t: f64,
    /// [`NO_FACET`] without a hit; what follows then means nothing.
    facet: u32,
    second: bool,
    edges: [f64; 3],
}

/// A hit with its edge functions, which are its corner weights but for their sum.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeHit {
    pub(crate) t: f64,
    pub(crate) facet: u32,
    /// Whether the triangle (0, 2, 3) was hit, not (0, 1, 2).
    pub(crate) second: bool,
    /// Opposite to each corner, of one sign.
    pub(crate) edges: [f64; 3],
}

impl Nearest {
    /// Starts without a hit; hits beyond `t_max`, mm, will not be kept.
    #[inline(always)]
    pub(crate) fn up_to(t_max: f64) -> Self {
        Self { t: t_max, facet: NO_FACET, second: false, edges: [0.0; 3] }
    }

    /// Returns the nearest hit offered, with its corner weights; `None` where there was none up to `t_max`.
    #[inline(always)]
    pub(crate) fn hit(&self) -> Option<FacetHit> {
        let Self { t, facet, second, edges } = *self;
        // Divided here once, not at each hit that a nearer one supersedes.
        let det = edges[0] + edges[1] + edges[2];
        (facet != NO_FACET).then_some(FacetHit { t, facet, second, b: edges.map(|e| e / det) })
    }

    /// Whether the nearest hit so far is on this facet.
    #[inline(always)]
    pub(crate) fn is_on(&self, facet: u32) -> bool {
        self.facet == facet
    }

    /// Keeps a hit where it `is_nearer` than the one kept so far. No branch depends on it.
    #[inline(always)]
    pub(crate) fn keep_if(&mut self, is_nearer: bool, hit: EdgeHit) {
        self.t = select_unpredictable(is_nearer, hit.t, self.t);
        self.facet = select_unpredictable(is_nearer, hit.facet, self.facet);
        self.second = select_unpredictable(is_nearer, hit.second, self.second);
        for (kept, edge) in self.edges.iter_mut().zip(hit.edges) {
            *kept = select_unpredictable(is_nearer, edge, *kept);
        }
    }

    /// Keeps `hit` if it is nearer than the one kept so far: of equal ones that on the facet of lowest index, there the first triangle's.
    #[inline(always)]
    pub(crate) fn offer(&mut self, hit: EdgeHit) {
        // Without a hit so far no facet has a lower index.
        if hit.t < self.t || (hit.t == self.t && (hit.facet, hit.second) < (self.facet, self.second)) {
            self.keep_if(true, hit);
        }
    }
}

//! Hits on facets, and which of them is the nearest.

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

/// The nearest hit so far; `t` is its distance, mm, or without a hit the end of the ray's range.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub(crate) t: f64,
    hit: Option<EdgeHit>,
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
    pub(crate) fn up_to(t_max: f64) -> Self {
        Self { t: t_max, hit: None }
    }

    /// Returns the nearest hit offered, with its corner weights; `None` where there was none up to `t_max`.
    pub(crate) fn hit(&self) -> Option<FacetHit> {
        let EdgeHit { t, facet, second, edges } = self.hit?;
        // Divided here once, not at each hit that a nearer one supersedes.
        let det = edges[0] + edges[1] + edges[2];
        Some(FacetHit { t, facet, second, b: edges.map(|e| e / det) })
    }

    /// The facet of the nearest hit so far.
    #[inline(always)]
    pub(crate) fn facet(&self) -> Option<u32> {
        self.hit.map(|hit| hit.facet)
    }

    /// Keeps a hit that is known to be nearer than the one kept so far.
    #[inline(always)]
    pub(crate) fn keep_nearer(&mut self, hit: EdgeHit) {
        *self = Self { t: hit.t, hit: Some(hit) };
    }

    /// Keeps `hit` if it is nearer than the one kept so far: of equal ones that on the facet of lowest index, there the first triangle's.
    #[inline(always)]
    pub(crate) fn offer(&mut self, hit: EdgeHit) {
        let nearer = match self.hit {
            None => hit.t <= self.t,
            Some(old) => hit.t < old.t || (hit.t == old.t && (hit.facet, hit.second) < (old.facet, old.second)),
        };
        if nearer {
            self.keep_nearer(hit);
        }
    }
}

//! Hits on facets, and which of them is the nearest.

/// A hit on a facet: which, where on it, and how far along the ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FacetHit {
    pub(crate) t: f64,
    pub(crate) facet: u32,
    /// Whether the triangle (0, 2, 3) was hit, not (0, 1, 2).
    pub(crate) second: bool,
    /// Weights of that triangle's corners.
    pub(crate) b: [f64; 3],
}

/// The nearest hit so far; starts as "nothing before `t_max`".
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub(crate) t: f64,
    hit: Option<EdgeHit>,
}

/// A hit with its edge functions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeHit {
    pub(crate) t: f64,
    pub(crate) facet: u32,
    /// Whether the triangle (0, 2, 3) was hit, not (0, 1, 2).
    pub(crate) second: bool,
    pub(crate) edges: [f64; 3],
}

impl Nearest {
    pub(crate) fn up_to(t_max: f64) -> Self {
        Self { t: t_max, hit: None }
    }

    pub(crate) fn hit(&self) -> Option<FacetHit> {
        let EdgeHit { t, facet, second, edges } = self.hit?;
        // Divided here once, not at each hit that a nearer one supersedes.
        let det = edges[0] + edges[1] + edges[2];
        Some(FacetHit { t, facet, second, b: edges.map(|e| e / det) })
    }

    /// Keeps the nearer hit, of equal ones that on the facet of lowest index, there the first triangle's.
    #[inline(always)]
    pub(crate) fn offer(&mut self, hit: EdgeHit) {
        let nearer = match self.hit {
            None => hit.t <= self.t,
            Some(old) => hit.t < old.t || (hit.t == old.t && (hit.facet, hit.second) < (old.facet, old.second)),
        };
        if nearer {
            *self = Self { t: hit.t, hit: Some(hit) };
        }
    }
}

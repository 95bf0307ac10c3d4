//! What stands behind the geometric errors of a run, in words: its facets, light that it lost, or both.

use crate::simulate::Results;
use crate::study::geometric_error::GeometricError;

/// Origin of the geometric errors of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GeometricCause {
    /// Facets that differ from the surface, or nothing.
    Facets,
    /// Facets, and light that was lost.
    FacetsAndLoss,
    /// Lost light alone: on the spline, or on facets that are the surface itself.
    Loss,
}

impl GeometricCause {
    /// Returns that of a run; `geometric` is what its facets change, absent on the spline.
    pub(super) fn new(results: &Results, geometric: Option<&GeometricError>) -> Self {
        if results.power.lost <= 0.0 {
            Self::Facets
        } else if geometric.is_some_and(|error| error.rays > 0) {
            Self::FacetsAndLoss
        } else {
            Self::Loss
        }
    }

    /// Returns what an error is from.
    pub(super) fn in_words(self) -> &'static str {
        match self {
            Self::Facets => "the facets",
            Self::FacetsAndLoss => "facets and lost light",
            Self::Loss => "lost light",
        }
    }

    /// Returns what limits a figure whose geometric error is the larger one.
    pub(super) fn limit(self) -> &'static str {
        match self {
            Self::Facets => "facets",
            Self::FacetsAndLoss => "facets or lost light",
            Self::Loss => "lost light",
        }
    }

    /// Returns the head of a column of such errors.
    pub(super) fn column(self) -> &'static str {
        match self {
            Self::Facets => "± facets (1σ)",
            Self::FacetsAndLoss => "± facets and loss (1σ)",
            Self::Loss => "± lost light (1σ)",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::octree::{self, Octree};
    use crate::mesh::FacetMesh;
    use crate::model::Model;
    use crate::simulate::{RunSettings, Scene, simulate};
    use std::path::Path;

    /// On the spline, and on facets that are the surface, an error that no ray brings is that of lost light.
    #[test]
    fn lost_light_is_not_blamed_on_facets() {
        let scene = Scene::parse("[run]\nrays = 100\n[[source]]\n", "s.toml", Path::new(".")).unwrap();
        let bound = scene.bind(&Model::default()).unwrap();
        let mesh = FacetMesh::default();
        let nothing = Octree::build(&mesh, &octree::Settings::default());
        let mut results = simulate(&bound, &nothing, &RunSettings::from(&scene.run), &|_| true);
        let compared = GeometricError { rays: 100, ..GeometricError::default() };
        let flat = GeometricError::default();
        let causes = |results: &Results| {
            [None, Some(&flat), Some(&compared)].map(|geometric| GeometricCause::new(results, geometric).in_words())
        };
        assert_eq!(causes(&results), ["the facets"; 3]);
        results.power.lost = 0.95;
        assert_eq!(causes(&results), ["lost light", "lost light", "facets and lost light"]);
    }
}

//! The facets of one face, found by the line that passes them.

use crate::math::{Aabb, Ray};
use crate::mesh::FacetMesh;
use std::sync::OnceLock;

/// Facets that are passed over together: of 10⁵ some thousand groups are looked at a line, and a few of their facets.
const GROUP: usize = 64;

/// Facets that follow one another in the mesh, and so lie beside each other.
struct Group {
    /// Of their corners.
    bounds: Aabb,
    /// Largest of their sags, mm.
    sag: f64,
}

/// The facets of a face.
#[derive(Default)]
pub(super) struct FaceFacets {
    facets: Vec<u32>,
    /// Every [`GROUP`] of them, made when first asked for: most faces never are.
    groups: OnceLock<Vec<Group>>,
}

impl FaceFacets {
    /// Adds a facet; all are added before the first query.
    pub(super) fn push(&mut self, facet: u32) {
        self.facets.push(facet);
    }

    /// Returns the facets, in the order of the mesh.
    pub(super) fn facets(&self) -> &[u32] {
        &self.facets
    }

    /// Returns the largest sag, mm, of the facets that a ray's line passes within their own sag and `margin`; of all when it passes none,
    /// as beside a border or over a hole. `sag` returns that of a facet, always the same.
    pub(super) fn largest_sag(&self, mesh: &FacetMesh, ray: &Ray, margin: f64, sag: impl Fn(u32) -> f64) -> f64 {
        let line = ray.with_range(f64::NEG_INFINITY, f64::INFINITY);
        let is_passed = |bounds: Aabb, sag: f64| bounds.grown(sag + margin).clip(&line).is_some();
        let corners = |facet: u32| Aabb::from_points(mesh.corners(facet as usize));
        let group = |facets: &[u32]| Group {
            bounds: facets.iter().map(|&i| corners(i)).fold(Aabb::EMPTY, Aabb::union),
            sag: facets.iter().map(|&i| sag(i)).fold(0.0, f64::max),
        };
        let groups = self.groups.get_or_init(|| self.facets.chunks(GROUP).map(group).collect());
        let passed = groups.iter().zip(self.facets.chunks(GROUP)).filter(|(g, _)| is_passed(g.bounds, g.sag));
        let sags =
            passed.flat_map(|(_, facets)| facets).filter(|&&i| is_passed(corners(i), sag(i))).map(|&i| sag(i));
        sags.reduce(f64::max).unwrap_or_else(|| groups.iter().map(|g| g.sag).fold(0.0, f64::max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Point, Vector};
    use crate::nurbs::sweep;
    use crate::study::{Random, sample_models};
    use std::f64::consts::PI;

    /// Groups change nothing: each line has the largest sag of the facets that it passes, of all where it passes none.
    #[test]
    fn a_line_has_the_largest_sag_of_the_facets_that_it_passes() {
        let ball = sweep::sphere(&Frame::IDENTITY, 5.0, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]);
        let mesh = sample_models::grid_mesh(&sample_models::model("ball", [ball]), 24);
        let mut face = FaceFacets::default();
        (0..mesh.facets.len() as u32).for_each(|i| face.push(i));
        // Sags of all sizes, so that a wrong facet shows.
        let sag = |i: u32| 1e-4 * f64::from(i * 7919 % 1000);
        let (bounds, mut random, mut missed) = (mesh.bounds(), Random::new(3, 0), 0);
        for _ in 0..500 {
            let inside = Vector::new(random.unit(), random.unit(), random.unit());
            let ray = Ray::new(bounds.min + 1.2 * inside * bounds.size(), random.direction());
            let line = ray.with_range(f64::NEG_INFINITY, f64::INFINITY);
            let passes = |i: &u32| {
                let corners: [Point; 4] = mesh.corners(*i as usize);
                Aabb::from_points(corners).grown(sag(*i) + 0.01).clip(&line).is_some()
            };
            let passed = face.facets().iter().filter(|i| passes(i)).map(|&i| sag(i)).reduce(f64::max);
            missed += usize::from(passed.is_none());
            let all = face.facets().iter().map(|&i| sag(i)).fold(0.0, f64::max);
            assert_eq!(face.largest_sag(&mesh, &ray, 0.01, sag), passed.unwrap_or(all));
        }
        assert!((10..400).contains(&missed), "{missed} of 500");
    }
}

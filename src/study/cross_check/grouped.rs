//! Differences between facets and spline in a model whose parts that are placed often have coordinates of their own: each is explained
//! where the first hit is, in that part's.

use super::classify::{Classifier, LaterHit};
use super::verdict::Cause;
use crate::intersect::Hit;
use crate::math::Ray;
use crate::mesh::FacetMesh;
use crate::model::{Instancing, Model};

/// One classifier for each group.
pub(super) struct Classifiers<'a> {
    groups: Vec<Classifier<'a>>,
    instancing: Option<&'a Instancing>,
}

/// A question in the coordinates of one group.
struct GroupQuestion<'c, 'a> {
    classifier: &'c Classifier<'a>,
    ray: Ray,
    hits: [Option<Hit>; 2],
}

impl<'a> Classifiers<'a> {
    /// Makes a classifier for each group's model and mesh; there is one group, and no `instancing`, for a model in one piece. `fallback`
    /// is that of [`Classifier::new`].
    pub(super) fn new(
        groups: &[(&'a Model, &'a FacetMesh)],
        instancing: Option<&'a Instancing>,
        fallback: f64,
    ) -> Self {
        let classifier = |&(model, mesh): &(&'a Model, &'a FacetMesh)| Classifier::new(model, mesh, fallback);
        Self { groups: groups.iter().map(classifier).collect(), instancing }
    }

    /// Returns why facets and spline differ, as [`Classifier::compare`], for hits in scene coordinates. Of hits in two placements the
    /// earlier is explained where it is; the later may lie as near as its own sag.
    pub(super) fn compare(&self, ray: &Ray, facet: Option<&Hit>, exact: Option<&Hit>) -> Option<Cause> {
        if let (Some(f), Some(e)) = (facet, exact)
            && self.placement_of(f) != self.placement_of(e)
        {
            let facet_first = f.t < e.t;
            let (first, later) = if facet_first { ([Some(f), None], e) } else { ([None, Some(e)], f) };
            let GroupQuestion { classifier, ray: local_ray, hits: [facet, exact] } = self.in_group(ray, first);
            let gap = facet.or(exact).map_or(0.0, |hit| classifier.gap(hit.face));
            let elsewhere = self.later_hit(ray, later, gap);
            return Some(classifier.explain(&local_ray, facet.as_ref(), exact.as_ref(), elsewhere));
        }
        let GroupQuestion { classifier, ray, hits: [facet, exact] } = self.in_group(ray, [facet, exact]);
        classifier.compare(&ray, facet.as_ref(), exact.as_ref())
    }

    /// Returns a hit in scene coordinates as the later one of two; `gap`, mm, is that of the earlier one's face.
    fn later_hit(&self, ray: &Ray, hit: &Hit, gap: f64) -> Option<LaterHit> {
        let GroupQuestion { classifier, ray, hits: [hit, _] } = self.in_group(ray, [Some(hit), None]);
        hit.map(|hit| LaterHit { t: hit.t, band: classifier.band(hit.face, &ray, gap) })
    }

    /// Compares octree and BVH as [`Classifier::same_facets`], for hits in scene coordinates; hits in two placements are a defect.
    pub(super) fn same_facets(&self, ray: &Ray, a: Option<&Hit>, b: Option<&Hit>) -> Result<bool, ()> {
        if let (Some(a), Some(b)) = (a, b)
            && self.placement_of(a) != self.placement_of(b)
        {
            return Err(());
        }
        let GroupQuestion { classifier, ray, hits: [a, b] } = self.in_group(ray, [a, b]);
        classifier.same_facets(&ray, a.as_ref(), b.as_ref())
    }

    /// Returns the index of the placement that was hit; `None` for the first group and a model in one piece.
    fn placement_of(&self, hit: &Hit) -> Option<usize> {
        self.instancing.and_then(|i| i.locate(hit.face).0)
    }

    /// Moves hits of one placement, and their ray, into the coordinates of its group; the first group's are the scene's.
    fn in_group(&self, ray: &Ray, hits: [Option<&Hit>; 2]) -> GroupQuestion<'_, 'a> {
        let place = hits.into_iter().flatten().next().and_then(|hit| self.placement_of(hit));
        let numbered = |hit: &Hit| Hit { face: self.instancing.map_or(hit.face, |i| i.locate(hit.face).1), ..*hit };
        let hits = hits.map(|hit| hit.map(numbered));
        let Some(place) = place.and_then(|k| Some(&self.instancing?.placements[k])) else {
            return GroupQuestion { classifier: &self.groups[0], ray: *ray, hits };
        };
        let frame = &place.frame;
        let turned = |hit: Hit| Hit {
            normal: frame.local_direction(hit.normal),
            geometric_normal: frame.local_direction(hit.geometric_normal),
            ..hit
        };
        GroupQuestion {
            classifier: &self.groups[place.group as usize],
            ray: place.local_ray(ray),
            hits: hits.map(|hit| hit.map(turned)),
        }
    }
}

//! The cross-check: the same rays through octree, BVH and exact spline, and a cause for every difference.
//!
//! Octree and BVH hold the same facets, so any difference between them is a defect of one. Facets and spline may differ,
//! but only inside the band that the facets' sag allows. Each difference is put to geometric tests that use neither
//! intersector: the ray is walked along the spline for as long as it stays within the band, and what happens there names
//! the cause ([`Cause`]). A ray that crosses the whole band away from any border must be seen by both: if it is not, the
//! difference is *unexplained*, a defect.
//!
//! Guarantee: every ray is checked, none is sampled, and counts do not depend on the number of threads.
//! The band is the largest proved sag of those facets of the face that the ray passes within their own sag.
//! Known weakness: a facet without a proved sag counts with [`Settings::fallback_band_mm`].

mod border;
mod classify;
mod face_facets;
mod fold;
mod grouped;
mod measure;
mod placed_surface;
mod verdict;

pub use measure::{TimedIntersector, measure};
pub use verdict::{
    Cause, Certainties, CrossCheck, Defect, Disagreement, Explained, FacetsAgainstExact, FacetsDiffer,
    PerIntersector, SceneSize,
};

use super::rays::RaySource;
use super::timing::Clock;
use super::{Progress, Quantiles};
use crate::intersect::{Certainty, Cost, Hit, Intersector};
use crate::math::Ray;
use crate::mesh::FacetMesh;
use crate::model::{Instancing, Model};
use grouped::Classifiers;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// The intersectors of a model some of whose parts are placed often and have coordinates of their own.
#[derive(Clone)]
pub struct GroupedIntersectors<'a> {
    /// The model of each group, with the facets that were made of it.
    pub groups: Vec<(&'a Model, &'a FacetMesh)>,
    /// Where the groups stand; `None` for a model in one piece.
    pub instancing: Option<&'a Instancing>,
    /// All facets in octrees.
    pub octree: &'a dyn Intersector,
    /// The same facets in BVHs.
    pub bvh: &'a dyn Intersector,
    /// The splines.
    pub exact: &'a dyn Intersector,
}

/// The intersectors under check.
#[derive(Clone, Copy)]
pub struct Intersectors<'a> {
    /// The model the facets were made of.
    pub model: &'a Model,
    /// The facets.
    pub mesh: &'a FacetMesh,
    /// Facets in the octree.
    pub octree: &'a dyn Intersector,
    /// The same facets in a BVH.
    pub bvh: &'a dyn Intersector,
    /// The spline.
    pub exact: &'a dyn Intersector,
}

/// Settings of the cross-check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Sag assumed for facets without a proved one, mm: the tolerance requested of the mesher.
    pub fallback_band_mm: f64,
    /// Most disagreeing rays to keep for writing out and drawing; all are counted.
    pub keep: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { fallback_band_mm: 0.2, keep: 1_000_000 }
    }
}

/// Rays checked by one task: with their answers they stay below a megabyte, and a check takes no longer than in larger tasks.
const CHUNK: u64 = 2048;

/// Asks octree, BVH and spline about every ray and classifies every difference. Runs on the current rayon pool; timings, build times and
/// sizes are left empty.
pub fn cross_check(
    intersectors: &Intersectors<'_>,
    rays: &(impl RaySource + ?Sized),
    settings: &Settings,
    progress: &(dyn Fn(Progress) + Sync),
) -> CrossCheck {
    let Intersectors { model, mesh, octree, bvh, exact } = *intersectors;
    let whole = GroupedIntersectors { groups: vec![(model, mesh)], instancing: None, octree, bvh, exact };
    cross_check_groups(&whole, rays, settings, progress)
}

/// Asks octrees, BVHs and splines of a model in groups about every ray and classifies every difference; rays and hits are in scene
/// coordinates. Runs on the current rayon pool; timings, build times and sizes are left empty.
pub fn cross_check_groups(
    intersectors: &GroupedIntersectors<'_>,
    rays: &(impl RaySource + ?Sized),
    settings: &Settings,
    progress: &(dyn Fn(Progress) + Sync),
) -> CrossCheck {
    let classifier = Classifiers::new(&intersectors.groups, intersectors.instancing, settings.fallback_band_mm);
    let clock = Clock::new(progress);
    let (count, done) = (rays.len(), AtomicU64::new(0));
    let chunks = count.div_ceil(CHUNK);
    let tallies: Vec<Tally> = (0..chunks)
        .into_par_iter()
        .map(|c| {
            let range = c * CHUNK..((c + 1) * CHUNK).min(count);
            let length = range.end - range.start;
            let tally = Tally::of_rays(intersectors, &classifier, range.start, &rays.rays(range));
            // Tasks end in any order: what is reported is how many are done.
            let so_far = done.fetch_add(length, Ordering::Relaxed) + length;
            clock.report("checking rays", so_far as f64 / count as f64);
            tally
        })
        .collect();
    let (mut all, mut t_errors, mut normal_errors) = <(Tally, Quantiles, Quantiles)>::default();
    // In the order of the rays: what is kept as an example does not hang on threads.
    for tally in tallies {
        for &[distance, angle] in &tally.errors {
            t_errors.add(distance);
            normal_errors.add(angle);
        }
        all.absorb(tally, settings.keep);
    }
    let mut check = all.check;
    check.rays = count;
    let facets = intersectors.groups.iter().map(|(_, mesh)| mesh.facets.len()).sum();
    check.scene = SceneSize { facets, patches: intersectors.exact.footprint().primitives };
    check.facets_vs_exact.t_error_mm = t_errors.summary();
    check.facets_vs_exact.normal_error_deg = normal_errors.summary();
    check.disagreements = all.kept;
    check
}

/// Returns the angle between unit vectors, degrees, accurate for small angles too.
pub(super) fn angle_deg(a: crate::math::Vector, b: crate::math::Vector) -> f64 {
    // By the cross product too: the arc cosine loses half of the digits of small angles.
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// What the rays of a task have shown.
#[derive(Default)]
struct Tally {
    check: CrossCheck,
    /// Distances along the ray, mm, and angles of normals, degrees. Listed, as a histogram of each would take eight times as much.
    errors: Vec<[f64; 2]>,
    kept: Vec<Disagreement>,
}

impl Tally {
    /// Asks all three about some rays, of which `first` is the number of the first, and tallies the answers.
    fn of_rays(
        intersectors: &GroupedIntersectors<'_>,
        classifier: &Classifiers<'_>,
        first: u64,
        rays: &[Ray],
    ) -> Self {
        let ask = |intersector: &dyn Intersector| {
            let mut hits = vec![None; rays.len()];
            intersector.intersect_batch(rays, &mut hits, &mut Cost::default());
            hits
        };
        let (octree, bvh, exact) = (ask(intersectors.octree), ask(intersectors.bvh), ask(intersectors.exact));
        let mut tally = Self::default();
        for (i, ray) in rays.iter().enumerate() {
            tally.add(classifier, first + i as u64, ray, [octree[i], bvh[i], exact[i]]);
        }
        tally
    }

    /// Counts a ray with the answers of all three, and keeps it where they differ by more than the sag.
    fn add(&mut self, classifier: &Classifiers<'_>, index: u64, ray: &Ray, [octree, bvh, exact]: [Option<Hit>; 3]) {
        self.check.hits += u64::from(octree.is_some());
        let facets_differ = match classifier.same_facets(ray, octree.as_ref(), bvh.as_ref()) {
            Ok(tie) => {
                self.check.octree_vs_bvh.ties += u64::from(tie);
                false
            }
            Err(()) => {
                self.check.octree_vs_bvh.disagree += 1;
                true
            }
        };
        if let Some(e) = exact {
            match e.certainty {
                Certainty::Certified => self.check.exact.certified += 1,
                Certainty::Tangent => self.check.exact.tangent += 1,
                // Of a ready mesh, about which the spline says nothing.
                Certainty::Facet => {}
                _ => self.check.exact.uncertified += 1,
            }
        }
        let cause = classifier.compare(ray, octree.as_ref(), exact.as_ref());
        self.count_cause(cause, octree, exact);
        // A hit that only one has is kept whatever its cause, because it changes where the light goes.
        let flipped = octree.is_some() != exact.is_some();
        if facets_differ || flipped || cause.is_some_and(|c| c != Cause::WithinSag) {
            self.kept.push(Disagreement { index, ray: *ray, octree, bvh, exact, cause, facets_differ });
        }
    }

    /// Counts how facets and spline differ, and the cause; adds to the errors where both hit the same face within the sag.
    fn count_cause(&mut self, cause: Option<Cause>, octree: Option<Hit>, exact: Option<Hit>) {
        let found = &mut self.check.facets_vs_exact;
        match (octree, exact) {
            (Some(f), Some(e)) if f.face == e.face => {
                if matches!(cause, None | Some(Cause::WithinSag)) {
                    self.errors.push([(f.t - e.t).abs(), angle_deg(f.normal, e.normal)]);
                }
            }
            (Some(_), Some(_)) => found.other_face += 1,
            (None, None) => {}
            _ => found.hit_miss += 1,
        }
        let explained = &mut found.explained;
        let counter = match cause {
            None => return,
            Some(Cause::WithinSag) => &mut explained.within_sag,
            Some(Cause::Silhouette) => &mut explained.silhouette,
            Some(Cause::TrimEdge) => &mut explained.trim_edge,
            Some(Cause::Coincident) => &mut explained.coincident,
            Some(Cause::Tangent) => &mut explained.tangent,
            Some(Cause::Unproved) => &mut explained.unproved,
            Some(Cause::Unmeshed) => &mut explained.unmeshed,
            Some(Cause::NoSurface) => &mut explained.no_surface,
            Some(Cause::Unexplained(_)) => &mut found.unexplained,
        };
        *counter += 1;
    }

    /// Adds another tally, but its errors; of its kept rays as many as leave `keep` at most in all.
    fn absorb(&mut self, other: Self, keep: usize) {
        let (a, b) = (&mut self.check, &other.check);
        a.hits += b.hits;
        a.octree_vs_bvh.disagree += b.octree_vs_bvh.disagree;
        a.octree_vs_bvh.ties += b.octree_vs_bvh.ties;
        a.exact.certified += b.exact.certified;
        a.exact.tangent += b.exact.tangent;
        a.exact.uncertified += b.exact.uncertified;
        let (x, y) = (&mut a.facets_vs_exact, &b.facets_vs_exact);
        x.hit_miss += y.hit_miss;
        x.other_face += y.other_face;
        x.unexplained += y.unexplained;
        let (p, q) = (&mut x.explained, &y.explained);
        p.within_sag += q.within_sag;
        p.silhouette += q.silhouette;
        p.trim_edge += q.trim_edge;
        p.coincident += q.coincident;
        p.tangent += q.tangent;
        p.unproved += q.unproved;
        p.unmeshed += q.unmeshed;
        p.no_surface += q.no_surface;
        let room = keep.saturating_sub(self.kept.len());
        self.kept.extend(other.kept.into_iter().take(room));
    }
}

//! Polishing of many hits: all rays are traced on the facets at once, and Newton's method takes its steps eight at a time.
//!
//! What is plain is decided here: a start on the same side of facets and spline ([`super::start`]), a root near its facet hit, inside the
//! trims and crossed the same way, and an answer that the closed shells do not contradict. Where that root is the point that the ray
//! leaves, or lies before its range, the facets behind it are queried. All other rays are traced on the spline, together.

use super::clear_start::ClearStart;
use super::facet_naming::Probes;
use super::facet_record::FacetRecord;
use super::limits::{LEAST_WINDOW_SINE, OWN_POINT, WINDOW_OF_SAGS, least_window};
use super::start::Side;
use super::{Polished, is_own};
use crate::intersect::exact::{Seed, SurfacePoint};
use crate::intersect::{Certainty, Cost, Hit, prefetch};
use crate::math::Ray;
use std::cell::RefCell;
use std::sync::PoisonError;

/// Rays that are traced together: their memory stays in a cache of the second level.
const BATCH: usize = 512;
/// Rays ahead of which what is known of a facet is prefetched.
const AHEAD: usize = 8;
/// Facets whose roots lie behind a ray that it passes in the batch: more than one is rare.
const MOST_BEHIND: usize = 3;
/// Steps of Newton's method after which a search that goes from patch to patch is given up.
const MOST_STEPS: u32 = 8;

/// A ray of the batch that is to be traced on the facets.
#[derive(Clone, Copy)]
struct Pending {
    /// Its index in the batch.
    place: u32,
    /// To which side it leaves its surface, if any.
    side: Option<Side>,
}

/// Memory of a batch.
#[derive(Default)]
struct Workspace {
    /// The rays as they are traced on the facets, and the ray of the batch that each comes from.
    queries: Vec<Ray>,
    pending: Vec<Pending>,
    /// Of each query.
    facet_hits: Vec<Option<Hit>>,
    /// Of the facet hits that lie on a patch, and the point that each leads to.
    seeds: Vec<Seed>,
    points: Vec<Option<SurfacePoint>>,
    /// The rays that passed a facet, from where on they are traced again.
    again: Vec<(Pending, Ray)>,
    /// The rays in doubt, by their index in the batch.
    doubtful: Vec<u32>,
    /// The rays that are traced on the spline, and their hits.
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    probes: Probes,
}

thread_local! {
    static WORKSPACE: RefCell<Workspace> = RefCell::default();
}

/// What becomes of a ray in a batch.
enum Decision {
    Answer(Option<Hit>),
    /// The root of this facet hit is not ahead: the facets behind it are queried again.
    Behind,
    /// In doubt: [`Polished::trace_spline`] decides.
    Doubt,
}

impl Polished<'_> {
    /// Answers many rays: overwrites `hits`, which is as long as `rays`, and counts each ray once.
    pub(super) fn polish_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        let clear = self.clear_starts.read().unwrap_or_else(PoisonError::into_inner);
        // Taken, not borrowed: a call that came back here on this thread would find an empty workspace, not a
        // panic.
        let mut space = WORKSPACE.take();
        for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            self.sort_starts(rays, &clear, &mut space);
            for _ in 0..MOST_BEHIND {
                if space.queries.is_empty() {
                    break;
                }
                self.trace_facets(&mut space, cost);
                self.decide_all(rays, hits, &mut space, cost);
            }
            let Workspace { pending, doubtful, rays: open, hits: found, probes, .. } = &mut space;
            doubtful.extend(pending.iter().map(|ray| ray.place));
            open.clear();
            open.extend(doubtful.iter().map(|&place| rays[place as usize]));
            self.trace_spline(open, found, cost);
            self.name_facets(open, found, probes, cost);
            for (&place, hit) in doubtful.iter().zip(found.iter()) {
                hits[place as usize] = *hit;
            }
        }
        WORKSPACE.set(space);
    }

    /// Sorts a batch: fills `space.queries` and `space.pending` with the rays to be traced on the facets, their ranges widened by the
    /// slack, and `space.doubtful` with all others.
    fn sort_starts(&self, rays: &[Ray], clear: &[ClearStart], space: &mut Workspace) {
        space.queries.clear();
        space.pending.clear();
        space.doubtful.clear();
        for (i, ray) in rays.iter().enumerate() {
            // Of a ray that leaves no facet the first: a branch on whether it does would be guessed wrong.
            let ahead = rays.get(i + AHEAD).map_or(0, |ray| ray.departure.map_or(0, |from| from.primitive));
            prefetch(&self.records, ahead as usize);
            self.slabs.fetch(ahead);
            if let Some(start) = self.start(ray, clear) {
                // A facet may lie before the range and its root in it: they are up to a sag apart across the facet,
                // and more along a flat ray.
                let [back, ahead] = start.slack;
                space.queries.push(ray.with_range(ray.t_min - back, ray.t_max + ahead));
                space.pending.push(Pending { place: i as u32, side: start.side });
            } else {
                space.doubtful.push(i as u32);
            }
        }
    }

    /// Finds the facet hits of `space.queries`, seeds from them, and the roots that these converge to; rays are not counted.
    fn trace_facets(&self, space: &mut Workspace, cost: &mut Cost) {
        let Workspace { queries, facet_hits, seeds, points, .. } = space;
        facet_hits.clear();
        facet_hits.resize(queries.len(), None);
        let mut own = Cost::default();
        self.facets.intersect_batch(queries, facet_hits, &mut own);
        // A ray counts once, where it is answered, and not each time that facets are queried.
        *cost += Cost { rays: 0, ..own };
        seeds.clear();
        for (k, hit) in facet_hits.iter().enumerate() {
            let ahead = facet_hits.get(k + AHEAD).map_or(0, |hit| hit.map_or(0, |hit| hit.primitive));
            prefetch(&self.records, ahead as usize);
            self.slabs.fetch(ahead);
            if let Some(hit) = hit
                && let Some(patch) = self.records[hit.primitive as usize].patch(self.exact, hit.uv)
            {
                seeds.push(Seed { ray: k as u32, patch, uv: hit.uv });
            }
        }
        points.clear();
        points.resize(seeds.len(), None);
        self.exact.converge_batch(queries, seeds, points);
        // Most of the others have their root beside the patch, on the next one.
        for (seed, point) in seeds.iter().zip(points.iter_mut()).filter(|(_, point)| point.is_none()) {
            let facet = facet_hits[seed.ray as usize].map_or(0, |hit| hit.primitive);
            let face = self.records[facet as usize].face;
            *point = self.exact.converge(&queries[seed.ray as usize], face, seed.uv, MOST_STEPS);
        }
    }

    /// Decides about all rays that were traced, and writes the `hits` of those that are plain. Those to be traced again, from behind the
    /// facet they passed, are left in `space.queries` and `space.pending`; those in doubt are added to `space.doubtful`.
    fn decide_all(&self, rays: &[Ray], hits: &mut [Option<Hit>], space: &mut Workspace, cost: &mut Cost) {
        let Workspace { queries, pending, facet_hits, seeds, points, again, doubtful, .. } = space;
        again.clear();
        let mut found = seeds.iter().zip(points.iter()).peekable();
        for (k, (&pending_ray, facet_hit)) in pending.iter().zip(facet_hits.iter()).enumerate() {
            let point = found.next_if(|(seed, _)| seed.ray == k as u32).and_then(|(_, point)| point.as_ref());
            let place = pending_ray.place as usize;
            match (self.decide(&rays[place], pending_ray.side, facet_hit.as_ref(), point), facet_hit) {
                (Decision::Answer(answer), _) => {
                    cost.rays += 1;
                    hits[place] = answer;
                }
                (Decision::Behind, Some(passed)) => {
                    // Just past the facet, or it would be found again.
                    again.push((pending_ray, queries[k].with_range(passed.t.next_up(), queries[k].t_max)));
                }
                _ => doubtful.push(pending_ray.place),
            }
        }
        queries.clear();
        pending.clear();
        for (pending_ray, ray) in again.drain(..) {
            queries.push(ray);
            pending.push(pending_ray);
        }
    }

    /// Decides about a ray, which leaves its surface to this `side`, from its facet hit, `None` for a miss, and the root that Newton's
    /// method found from there, `None` where it did not converge.
    #[inline(always)]
    fn decide(
        &self,
        ray: &Ray,
        side: Option<Side>,
        facet_hit: Option<&Hit>,
        point: Option<&SurfacePoint>,
    ) -> Decision {
        let left = ray.departure.map(|from| &self.records[from.primitive as usize]);
        let inward = side == Some(Side::Inward);
        let Some(facet_hit) = facet_hit else {
            // What goes into a closed solid comes out of it.
            let comes_out = inward && ray.t_max == f64::INFINITY && left.is_some_and(FacetRecord::is_of_solid);
            return if comes_out { Decision::Doubt } else { Decision::Answer(None) };
        };
        let Some(point) = point else { return Decision::Doubt };
        let record = &self.records[facet_hit.primitive as usize];
        let facing = facet_hit.geometric_normal.dot(ray.direction);
        let rising = point.normal.dot(ray.direction);
        let sag = f64::from(record.sag);
        let window = (WINDOW_OF_SAGS * sag / facing.abs().max(LEAST_WINDOW_SINE)).max(least_window(sag));
        let is_near = point.inside && (point.t - facet_hit.t).abs() <= window;
        let is_own = point.t.abs() <= OWN_POINT
            && ray
                .departure
                .is_some_and(|from| from.face == facet_hit.face && is_own(self.exact, &from, ray, point));
        // Crossed the other way, it is the other one of two roots close by.
        if !is_near || !(is_own || rising * facing > 0.0) {
            return Decision::Doubt;
        }
        if is_own || point.t < ray.t_min || point.t > ray.t_max {
            return Decision::Behind;
        }
        let out = rising > 0.0;
        // A ray enters and leaves a closed solid in turn. An answer out of turn may be a facet that hides another
        // beside an edge.
        let is_doubtful = record.is_of_solid()
            && match left {
                None => out,
                Some(left) if left.shares_solid(record) => inward != out,
                Some(_) => inward || out,
            };
        // And so may one between another face and that one's facets, or behind both: the facet was met before the other's, and its root
        // may come after.
        let way = [ray.point_at(facet_hit.t), ray.point_at(point.t)];
        // Nearly all roots are so near to their facet hit that nothing else needs to be tested.
        let is_covered = (point.t - facet_hit.t).abs() <= self.slabs.reach()
            || self.is_covered(facet_hit.primitive, point.uv, way[1]);
        if is_doubtful || !is_covered || self.slabs.meet(self.mesh, facet_hit.primitive, way) {
            return Decision::Doubt;
        }
        Decision::Answer(Some(Hit {
            t: point.t,
            normal: point.normal,
            geometric_normal: point.normal,
            uv: point.uv,
            certainty: Certainty::Polished,
            ..*facet_hit
        }))
    }
}

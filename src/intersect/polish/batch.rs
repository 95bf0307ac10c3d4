//! Polishing of many hits: facets are asked about all rays at once, and Newton's method takes its steps eight at a time.
//!
//! What is plain is decided here: a ray that leaves its facet clearly, a root near its facet hit, inside the trims and crossed the same
//! way, and an answer that the closed shells do not contradict. Where that root is the point that the ray leaves, or lies before its
//! range, the facets are asked about what is behind it. Every other ray, some in a hundred, is asked alone.

use super::clear_start::ClearStart;
use super::curved_cells::LOOK_BACK_OF_FLAT;
use super::facet_record::FacetRecord;
use super::limits::{LEAST_SLACK_SINE, LEAST_WINDOW_SINE, OWN_POINT, SHORT_OF_SAGS, WINDOW_OF_SAGS, least_window};
use super::{Polished, is_own};
use crate::intersect::exact::{Seed, SurfacePoint};
use crate::intersect::{Certainty, Cost, Hit, prefetch};
use crate::math::Ray;
use std::cell::RefCell;
use std::sync::PoisonError;

/// Rays that are asked together: their memory stays in a cache of the second level.
const BATCH: usize = 512;
/// Rays ahead of which what is known of a facet is asked for.
const AHEAD: usize = 8;
/// Facets whose roots lie behind a ray that it passes in the batch: more than one is rare.
const MOST_BEHIND: usize = 3;

/// Memory of a batch.
#[derive(Default)]
struct Workspace {
    /// What the facets are asked, and the index of the ray that it comes from.
    asked: Vec<Ray>,
    places: Vec<u32>,
    /// Of each asked ray.
    facet_hits: Vec<Option<Hit>>,
    /// Of the facet hits that lie on a patch, and the point that each leads to.
    seeds: Vec<Seed>,
    points: Vec<Option<SurfacePoint>>,
    /// The rays that passed a facet, from where on they ask again.
    again: Vec<(u32, Ray)>,
}

thread_local! {
    static WORKSPACE: RefCell<Workspace> = RefCell::default();
}

/// What becomes of a ray in a batch.
enum Decision {
    Answer(Option<Hit>),
    /// The root of this facet hit is not ahead: the facets are asked again behind it.
    Behind,
    /// In doubt: [`Polished::intersect_alone`] decides.
    Alone,
}

impl Polished<'_> {
    /// Answers many rays: overwrites `hits`, which is as long as `rays`, and counts each ray once.
    pub(super) fn polish_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        let clear = self.clear_starts.read().unwrap_or_else(PoisonError::into_inner);
        // Taken, not borrowed: a call that came back here on this thread would find an empty workspace, not a
        // panic.
        let mut space = WORKSPACE.take();
        for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            self.start(rays, &clear, hits, &mut space, cost);
            for _ in 0..MOST_BEHIND {
                if space.asked.is_empty() {
                    break;
                }
                self.ask_facets(&mut space, cost);
                self.decide_all(rays, hits, &mut space, cost);
            }
            for &place in &space.places {
                hits[place as usize] = self.intersect_alone(&rays[place as usize], cost);
            }
        }
        WORKSPACE.set(space);
    }

    /// Sorts a batch: fills `space.asked` and `space.places` with the rays that the facets are asked about, their ranges widened by the
    /// slack, and answers all others at once, each alone.
    fn start(
        &self,
        rays: &[Ray],
        clear: &[ClearStart],
        hits: &mut [Option<Hit>],
        space: &mut Workspace,
        cost: &mut Cost,
    ) {
        space.asked.clear();
        space.places.clear();
        for (i, ray) in rays.iter().enumerate() {
            if let Some(ahead) = rays.get(i + AHEAD).and_then(|r| r.departure) {
                prefetch(&self.records, ahead.primitive as usize);
            }
            if let Some([back, ahead]) = self.slack(ray, clear) {
                // A facet may lie before the range and its root in it: they are up to a sag apart across the facet,
                // and more along a flat ray.
                space.asked.push(ray.with_range(ray.t_min - back, ray.t_max + ahead));
                space.places.push(i as u32);
            } else {
                hits[i] = self.intersect_alone(ray, cost);
            }
        }
    }

    /// Finds the facet hits of `space.asked`, seeds from them, and the roots that these converge to; rays are not counted.
    fn ask_facets(&self, space: &mut Workspace, cost: &mut Cost) {
        let Workspace { asked, facet_hits, seeds, points, .. } = space;
        facet_hits.clear();
        facet_hits.resize(asked.len(), None);
        let mut own = Cost::default();
        self.facets.intersect_batch(asked, facet_hits, &mut own);
        // A ray counts once, where it is answered, and not each time that facets are asked.
        *cost += Cost { rays: 0, ..own };
        seeds.clear();
        for (k, hit) in facet_hits.iter().enumerate() {
            if let Some(Some(ahead)) = facet_hits.get(k + AHEAD) {
                prefetch(&self.records, ahead.primitive as usize);
            }
            if let Some(hit) = hit
                && let Some(patch) = self.records[hit.primitive as usize].patch(self.exact, hit.uv)
            {
                seeds.push(Seed { ray: k as u32, patch, uv: hit.uv });
            }
        }
        points.clear();
        points.resize(seeds.len(), None);
        self.exact.converge_batch(asked, seeds, points);
    }

    /// Decides about all rays that were asked and writes their `hits`; those that ask again, from behind the facet they passed, are left in
    /// `space.asked` and `space.places`.
    fn decide_all(&self, rays: &[Ray], hits: &mut [Option<Hit>], space: &mut Workspace, cost: &mut Cost) {
        let Workspace { asked, places, facet_hits, seeds, points, again } = space;
        again.clear();
        let mut found = seeds.iter().zip(points.iter()).peekable();
        for (k, (&place, facet_hit)) in places.iter().zip(facet_hits.iter()).enumerate() {
            let point = found.next_if(|(seed, _)| seed.ray == k as u32).and_then(|(_, point)| point.as_ref());
            let ray = &rays[place as usize];
            match (self.decide(ray, facet_hit.as_ref(), point), facet_hit) {
                (Decision::Answer(answer), _) => {
                    cost.rays += 1;
                    hits[place as usize] = answer;
                }
                (Decision::Behind, Some(passed)) => {
                    // Just past the facet, or it would be found again.
                    again.push((place, asked[k].with_range(passed.t.next_up(), asked[k].t_max)));
                }
                _ => hits[place as usize] = self.intersect_alone(ray, cost),
            }
        }
        asked.clear();
        places.clear();
        for (place, ray) in again.drain(..) {
            asked.push(ray);
            places.push(place);
        }
    }

    /// How far before and behind its range a ray looks for facets, mm: `None` for one that must be asked alone, as it leaves its facet
    /// flat, names no facet of its face or is short.
    #[inline(always)]
    fn slack(&self, ray: &Ray, clear: &[ClearStart]) -> Option<[f64; 2]> {
        let slack = 2.0 * self.sag;
        let Some(from) = &ray.departure else {
            // Where nothing can lie behind the start no look back is needed, and the ray stays one that light
            // buffers know.
            let is_clear = ray.t_min == 0.0 && clear.iter().any(|start| start.holds(ray));
            if is_clear {
                return Some([0.0, slack]);
            }
            let is_near = self.curved.may_be_near(ray.point_at(ray.t_min));
            return Some([if is_near { slack } else { LOOK_BACK_OF_FLAT }, slack]);
        };
        // A departure from the spline alone names no facet, and one that names another face's tells nothing of the
        // side that is left.
        let record = self.records.get(from.primitive as usize).filter(|r| r.face == from.face)?;
        let sine = f64::from(record.decisive_sine(ray)?.abs()).max(LEAST_SLACK_SINE);
        (ray.t_max - ray.t_min > SHORT_OF_SAGS * self.sag).then(|| [slack / sine; 2])
    }

    /// Decides about a ray from its facet hit, `None` for a miss, and the root that Newton's method found from there, `None` where it did
    /// not converge.
    #[inline(always)]
    fn decide(&self, ray: &Ray, facet_hit: Option<&Hit>, point: Option<&SurfacePoint>) -> Decision {
        let left = ray.departure.map(|from| &self.records[from.primitive as usize]);
        let inward = left.and_then(|record| record.decisive_sine(ray)).is_some_and(|sine| sine < 0.0);
        let Some(facet_hit) = facet_hit else {
            // What goes into a closed solid comes out of it.
            let comes_out = inward && ray.t_max == f64::INFINITY && left.is_some_and(FacetRecord::is_of_solid);
            return if comes_out { Decision::Alone } else { Decision::Answer(None) };
        };
        let Some(point) = point else { return Decision::Alone };
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
            return Decision::Alone;
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
        if is_doubtful {
            return Decision::Alone;
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

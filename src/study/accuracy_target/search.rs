//! The search for the cheapest tolerances and normals that meet an accuracy target.

use super::light::JobLight;
use super::solution::{JobWork, Solution};
use super::survey::{Survey, tolerance_factor};
use super::trial_rays::{DirectionErrors, ReferenceRays};
use super::{AccuracyResult, AccuracyTarget, AngleError, Trial};
use crate::intersect::{Cost, Intersector, NormalMode};
use crate::math::FaceId;
use crate::model::Model;
use crate::study::Progress;
use crate::study::mesh_source::{FacetTree, MeshSource, with_intersectors};
use crate::study::rays::{RaySource, Uniform};
use crate::study::timing::Clock;
use crate::study::tolerance_plan::TolerancePlan;
use std::time::Instant;

/// The coarse end of what users ask for, mm.
const COARSEST: f64 = 0.2;
/// Of a small model the coarse tolerance is its diagonal over this.
const SMALL_MODEL: f64 = 500.0;
/// The coarse tolerance is never finer than this, mm: a model of a micrometre.
const FINEST_COARSE: f64 = 1e-6;
/// Finest local tolerance of a plan over the coarse one: facets go with its inverse, and ten thousand times as many are given up.
const FINEST: f64 = 1e-4;
/// Coarsest local tolerance of a plan over the coarse one.
const COARSEST_FACTOR: f64 = 4.0;

/// Rays that look at the model first, and that facets are tuned on.
const PILOTS: u64 = 65_536;
/// The target is aimed at with this much to spare, since the 99th percentile of fresh rays differs by some percent.
const MARGIN: f64 = 0.9;
/// Meshes made for one kind of normals.
const ATTEMPTS: usize = 6;
/// All meshes of a search together may have so many times the facets that one may: a few attempts at the finest.
const LARGEST_MESHES: f64 = 3.0;

/// Finds the cheapest tolerances and normals that reach an accuracy, for random rays through the model; the best found where none reaches
/// it. Makes several meshes for each kind of normals, on the current rayon pool, and ends after a counted amount of work.
///
/// # Errors
/// When the angle is not above 0 and below 90 degrees.
pub fn meet_target(
    model: &Model,
    mesh_source: &dyn MeshSource,
    target: &AccuracyTarget,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<AccuracyResult, AngleError> {
    // Of the surfaces, not of facets: there are none yet.
    let bounds = model.surface_bounds();
    let uniform = |_: &dyn Intersector, seed: u64, count: u64| {
        let source = Uniform::new(&bounds, seed, count);
        source.rays(0..source.len())
    };
    // Of a bare model it is not known which faces are glass.
    let light = JobLight { rays: &uniform, index_ratio: &|_, _| None };
    meet_target_for_light(model, mesh_source, target, light, progress)
}

/// Finds the cheapest tolerances and normals that reach an accuracy for the caller's light, such as that of a scene, whose rays are made
/// for several seeds. The best found where none reaches it; runs on the current rayon pool, and ends after a counted amount of work.
///
/// # Errors
/// When the angle is not above 0 and below 90 degrees.
pub fn meet_target_for_light(
    model: &Model,
    mesh_source: &dyn MeshSource,
    target: &AccuracyTarget,
    light: JobLight<'_>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<AccuracyResult, AngleError> {
    target.check_angle()?;
    let start = Instant::now();
    let clock = Clock::new(progress);
    // The spline's hits are the truth, and show which faces matter and how sharply they bend.
    clock.report("pilot rays", 0.0);
    let rays = (light.rays)(mesh_source.exact(), target.seed, PILOTS);
    let pilots = ReferenceRays::new(mesh_source, rays, light);
    let survey = Survey::new(model, &pilots.rays, &pilots.truth);
    let coarse = coarse_tolerance(model);
    let search = Search {
        mesh_source,
        target,
        light,
        pilots,
        survey,
        coarse,
        fresh: 0.into(),
        made: 0.0.into(),
        gave_up: false.into(),
    };
    let candidates = search.candidates();
    let mut trials: Vec<Trial> = Vec::new();
    let mut best: Option<Solution> = None;
    for (k, candidate) in candidates.iter().enumerate() {
        // A kind that is dearer by its own forecast than what another came to is not worth the wait.
        let beaten = best.as_ref().is_some_and(|b| b.is_kept(target) && candidate.work > 0.8 * b.work.total());
        if beaten {
            continue;
        }
        let stage = format!("{} normals", candidate.normals);
        clock.report(&stage, 0.2 + 0.8 * k as f64 / candidates.len() as f64);
        // What cannot be meshed in reasonable time is tried, coarser, only while nothing else reaches the target.
        let is_open = best.as_ref().is_none_or(|b| !b.is_kept(target));
        let Some(found) = search.reach(candidate, is_open, &mut trials) else { continue };
        let better = |b: &Solution| match (found.is_kept(target), b.is_kept(target)) {
            (true, true) => found.work.total() < b.work.total(),
            (false, false) => found.errs_less(b),
            (is_kept, _) => is_kept,
        };
        if best.as_ref().is_none_or(better) {
            best = Some(found);
        }
    }
    clock.report("done", 1.0);
    let found = best.unwrap_or_else(|| search.nothing_tried());
    let kept = found.is_kept(target);
    let [low, high] = found.plan.tolerance_mm();
    let answer = found.answer_sentence(target, search.gave_up.get());
    Ok(AccuracyResult {
        asked_deg: target.angle_deg,
        reached_deg: found.reached,
        largest_deg: found.largest,
        kept,
        normals: found.normals,
        tolerance_mm: [low, high],
        facets: found.facets,
        seconds_prepare: found.prepare,
        seconds_trace: found.trace,
        plan: found.plan,
        trials,
        checked: found.checked,
        flips: found.flips,
        seconds: start.elapsed().as_secs_f64(),
        answer,
    })
}

/// Returns the coarse end of what users ask for, mm: 0.2, or 1/500 of the diagonal of a small model.
fn coarse_tolerance(model: &Model) -> f64 {
    let bounds = model.surface_bounds();
    (bounds.diagonal() / SMALL_MODEL).clamp(FINEST_COARSE, COARSEST)
}

/// A kind of normals with the tolerances that should do.
struct Candidate {
    normals: NormalMode,
    plan: TolerancePlan,
    /// Order of the error in the sag.
    order: f64,
    /// Facets and counted work that are expected.
    facets: f64,
    work: f64,
}

/// Results of some rays on the facets of a plan.
struct Measured<E> {
    /// The face of each facet.
    made: Vec<FaceId>,
    /// Seconds of meshing and building.
    prepare: f64,
    errors: E,
}

/// Data with which all candidates are judged.
struct Search<'a> {
    mesh_source: &'a dyn MeshSource,
    target: &'a AccuracyTarget,
    light: JobLight<'a>,
    pilots: ReferenceRays,
    survey: Survey,
    /// Tolerance of facets that only find the face, mm.
    coarse: f64,
    /// Sets of fresh rays used so far: none is used twice for the same candidate.
    fresh: std::cell::Cell<u64>,
    /// Facets made so far, but those that pilots looked at: these are coarse.
    made: std::cell::Cell<f64>,
    /// Whether facets were too many to be tried.
    gave_up: std::cell::Cell<bool>,
}

impl Search<'_> {
    /// Meshes by a plan, and has `judge` find how far off such facets send light: it is given them, and how far apart two faces may lie
    /// that touch, mm.
    fn measure<E>(
        &self,
        plan: &TolerancePlan,
        normals: NormalMode,
        judge: impl FnOnce(&dyn Intersector, f64) -> E,
    ) -> Measured<E> {
        let meshed = self.mesh_source.mesh_plan(plan);
        let start = Instant::now();
        with_intersectors(self.mesh_source, &meshed.mesh, &[FacetTree::Octree], &[normals], |trees| {
            let build = start.elapsed().as_secs_f64();
            let made = meshed.mesh.facets.iter().map(|f| f.face).collect();
            // Facets of two bodies that touch stray from their spline to either side.
            let errors = judge(trees[0].2, 2.0 * plan.loosest_mm());
            Measured { made, prepare: meshed.seconds + build, errors }
        })
    }

    /// Returns how far off facets send fresh rays of the job: those that it meets on the spline, and those that it meets on these facets,
    /// which graze where the spline's do not.
    fn judge(&self, facets: &dyn Intersector, apart_mm: f64) -> [DirectionErrors; 2] {
        [self.mesh_source.exact(), facets].map(|traced_on| {
            self.fresh.set(self.fresh.get() + 1);
            // Another seed for each set: facets tuned to one set of rays must not be judged by it.
            let seed = self.target.seed ^ self.fresh.get().wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let rays = (self.light.rays)(traced_on, seed, self.target.check_rays);
            let fresh = ReferenceRays::new(self.mesh_source, rays, self.light);
            fresh.compare(facets, apart_mm, &self.survey)
        })
    }

    /// Returns the candidates of all kinds of normals, with tolerances by place and with one for all places.
    fn candidates(&self) -> Vec<Candidate> {
        let kinds = &self.target.kinds;
        let local = kinds.iter().map(|&normals| self.candidate(normals, true));
        // Where few rays meet the sharp places, they may err: one tolerance for all then costs less than holding every face to the angle.
        // On the two reflectors 0.3° cost twice the cheapest combination without it.
        let even = kinds.iter().filter(|n| **n != NormalMode::Exact).map(|&normals| self.candidate(normals, false));
        let mut candidates: Vec<Candidate> = local.chain(even).collect();
        // The one that promises to be cheapest first: what it comes to may rule out the others.
        candidates.sort_by(|a, b| a.work.total_cmp(&b.work));
        candidates
    }

    /// Makes the plan for these normals by the formulas, with one tolerance for all places unless `local`; meshes it, or a coarser one, and
    /// corrects it once by what pilots on those facets measure; forecasts the facets and the work of the job.
    fn candidate(&self, normals: NormalMode, local: bool) -> Candidate {
        let order = if normals == NormalMode::Flat || normals == NormalMode::Nearest { 0.5 } else { 1.0 };
        let epsilon = (MARGIN * self.target.angle_deg).to_radians();
        let range = [FINEST * self.coarse, COARSEST_FACTOR * self.coarse];
        let mut plan = match normals {
            // On the true normals no tolerance is needed for the angle: facets only find the face.
            NormalMode::Exact => TolerancePlan::uniform(self.coarse),
            _ if local => self.survey.plan(epsilon, order == 0.5, range),
            _ => TolerancePlan::even(0.25 * self.coarse, range),
        };
        // The pilot's facets: the plan itself where it is coarse, else as much coarser as keeps the pilot quick.
        // The plan's least tolerance must not hide how much coarser that is: flat facets of 0.001° took a minute, bilinear ones of 1e-6°
        // had 580,000 facets on a ball.
        let coarser = (0.25 * self.coarse / plan.unbounded_mm()).max(1.0);
        let mut pilot = plan.clone();
        pilot.scale(coarser);
        let m =
            self.measure(&pilot, normals, |facets, apart_mm| self.pilots.compare(facets, apart_mm, &self.survey));
        let mut facets = m.made.len() as f64;
        // The pilots measured the coarser plan: their errors are judged against what that one should give.
        if normals != NormalMode::Exact {
            let expected = self.target.angle_deg * MARGIN * coarser.powf(order);
            plan = pilot.clone();
            self.survey.adapt(&mut plan, &m.errors.errors, expected, order);
            plan.scale(1.0 / coarser);
            facets = self.survey.expected_facets(&plan, &pilot, &m.made);
        }
        let work = JobWork::new(facets, self.target.job_rays, normals, m.errors.cost).total();
        Candidate { normals, plan, order, facets, work }
    }

    /// Returns the most facets that the next mesh may have: those of one mesh, or what is left of those of the whole search; may be
    /// negative.
    fn affordable(&self) -> f64 {
        let most = self.target.most_facets;
        most.min(LARGEST_MESHES * most - self.made.get())
    }

    /// Meshes, traces fresh rays, and corrects the plan until the target is reached without waste, [`ATTEMPTS`] are made, or the next would
    /// have too many facets; adds each to `trials` and returns the best. A plan of too many from the start is made coarser where `is_open`
    /// says that nothing better is there, else `None`; also where the search has used up its facets.
    fn reach(&self, candidate: &Candidate, is_open: bool, trials: &mut Vec<Trial>) -> Option<Solution> {
        let (mut plan, normals) = (candidate.plan.clone(), candidate.normals);
        let affordable = self.affordable();
        let excess = candidate.facets / affordable.max(1.0);
        if excess > 1.0 {
            self.gave_up.set(true);
            if !is_open || affordable < 1.0 {
                return None;
            }
            // Facets go with the inverse of the tolerance, and none is below the finest.
            plan.scale(excess * (plan.finest_mm / plan.unbounded_mm()).max(1.0));
        }
        let mut best: Option<Solution> = None;
        for attempt in 0..ATTEMPTS {
            let measured = self.measure(&plan, normals, |facets, apart_mm| self.judge(facets, apart_mm));
            let facets = measured.made.len();
            self.made.set(self.made.get() + facets as f64);
            let found = self.solution(plan.clone(), normals, &measured);
            let reached = found.reached;
            trials.push(Trial {
                normals: normals.name().into(),
                tolerance_mm: plan.tolerance_mm(),
                facets,
                reached_deg: reached,
                seconds: found.seconds(),
            });
            let good = found.is_accepted(self.target);
            // Reached far too well at a cost that counts: coarser facets are worth another try, twice.
            let far_within = reached.is_some_and(|reached| reached < 0.6 * self.target.angle_deg);
            let wasteful = far_within && attempt < 2 && found.work.prepare > 0.2 * found.work.total();
            let was_good = best.as_ref().is_some_and(|b| b.is_accepted(self.target));
            let better = |b: &Solution| match (good, was_good) {
                (true, true) => found.work.total() < b.work.total(),
                (a, b_good) => a && !b_good || a == b_good && found.errs_less(b),
            };
            if best.as_ref().is_none_or(better) {
                best = Some(found);
            }
            // A plan that fell short after one that did not ends the search: the target lies between.
            if normals == NormalMode::Exact || good && !wasteful || !good && was_good {
                break;
            }
            // Without an angle there is nothing to go by.
            let Some(reached) = reached else { break };
            // Along the law of the error in the sag.
            let growth = tolerance_factor(reached, MARGIN * self.target.angle_deg, candidate.order);
            if facets as f64 / growth > self.affordable() {
                self.gave_up.set(true);
                break;
            }
            plan.scale(growth);
        }
        best
    }

    /// Returns what facets of a plan came to on both sets of fresh rays.
    fn solution(
        &self,
        plan: TolerancePlan,
        normals: NormalMode,
        measured: &Measured<[DirectionErrors; 2]>,
    ) -> Solution {
        let sets = &measured.errors;
        // Both sets of rays must reach the target.
        let worst = |of: fn(&DirectionErrors) -> Option<f64>| sets.iter().filter_map(of).max_by(f64::total_cmp);
        let (cost, seconds) = sets.iter().fold((Cost::default(), 0.0), |(mut cost, seconds), set| {
            cost += set.cost;
            (cost, seconds + set.seconds)
        });
        let facets = measured.made.len();
        Solution {
            normals,
            plan,
            facets,
            prepare: measured.prepare,
            trace: seconds / cost.rays.max(1) as f64 * self.target.job_rays,
            work: JobWork::new(facets as f64, self.target.job_rays, normals, cost),
            reached: worst(DirectionErrors::percentile),
            largest: worst(DirectionErrors::largest),
            checked: sets.iter().map(|set| set.errors.len() as u64).sum(),
            flat: sets.iter().map(|set| set.flat).sum(),
            flips: sets.iter().map(|set| set.flips).sum(),
        }
    }

    /// Returns what stands for a result when no candidate was measured: nothing known, no facets.
    fn nothing_tried(&self) -> Solution {
        Solution {
            normals: NormalMode::Exact,
            plan: TolerancePlan::uniform(self.coarse),
            facets: 0,
            prepare: 0.0,
            trace: 0.0,
            work: JobWork::default(),
            reached: None,
            largest: None,
            checked: 0,
            flat: 0,
            flips: 0,
        }
    }
}

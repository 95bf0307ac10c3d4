//! Accuracy asked for as an angle: the tolerance and the kind of normals that reach it most cheaply, checked.
//!
//! A facet of sag s on a surface of curvature κ met at incidence i misdirects the mirrored ray by up to 2·s·κ·tan i with
//! bilinear normals and 2·acos(1 − s·κ) with flat ones. Pilot rays on the spline give the distribution of κ and i; the
//! tolerance is the one at which 99 % of them stay within what is asked. Fresh rays then judge it against the spline,
//! and it is tightened until they agree.

use super::errors::Errors;
use super::rays::{RaySource, Uniform};
use super::timing::Clock;
use super::workshop::{Tree, Workshop, answer, normals_name, with_all};
use super::{Progress, Quantiles, Timing};
use crate::intersect::{Hit, Intersector, NormalMode};
use crate::math::{Aabb, Ray};
use crate::model::Model;
use serde::Serialize;
use std::time::Instant;

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ask {
    /// Direction error that 99 % of the mirrored rays must keep, degrees.
    pub degrees: f64,
    /// Rays that the job will trace: a long job pays for finer facets or faster normals differently than a short one.
    pub job_rays: f64,
    /// Fresh rays of the final check.
    pub check_rays: u64,
    /// Of all rays here.
    pub seed: u64,
}

impl Ask {
    /// The defaults for an angle: a job of a million rays, checked on 100,000.
    pub fn degrees(degrees: f64) -> Self {
        Self { degrees, job_rays: 1e6, check_rays: 100_000, seed: 1 }
    }
}

/// What to do.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Aim {
    /// Asked, degrees.
    pub asked_deg: f64,
    /// Reached on fresh rays (p99), degrees.
    pub reached_deg: f64,
    /// Whether that is within what was asked.
    pub kept: bool,
    /// Tolerance to mesh with, mm.
    pub tolerance_mm: f64,
    /// Kind of normals to trace with.
    #[serde(serialize_with = "by_name")]
    pub normals: NormalMode,
    /// Every combination that was tried on fresh rays: normals, tolerance, reached p99.
    pub tries: Vec<Try>,
    /// Rays of the check that hit.
    pub checked: u64,
    /// Seconds spent on finding out.
    pub seconds: f64,
    /// One sentence.
    pub answer: String,
}

/// One combination tried.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Try {
    /// Kind of normals.
    pub normals: String,
    /// mm.
    pub tolerance_mm: f64,
    /// p99, degrees.
    pub reached_deg: f64,
    /// Predicted seconds for the whole job.
    pub predicted_seconds: f64,
}

fn by_name<S: serde::Serializer>(n: &NormalMode, s: S) -> Result<S::Ok, S::Error> {
    s.serialize_str(normals_name(*n))
}

/// Rays that look at the model first.
const PILOTS: u64 = 8192;
/// What is asked is aimed at with this much to spare, since fresh rays differ from pilots.
const MARGIN: f64 = 0.9;
/// Tightenings before the next kind of normals is tried.
const ATTEMPTS: usize = 5;

/// A kind of normals with its predicted tolerance and cost.
struct Candidate {
    normals: NormalMode,
    tolerance: f64,
    /// Order of the error in the sag.
    order: f64,
    /// Seconds of a traced ray.
    per_ray: f64,
    predicted: f64,
}

/// Seconds of meshing and building at the pilot tolerance.
struct Pilot {
    tolerance: f64,
    prepare: f64,
}

impl Pilot {
    /// Facets, and with them meshing and building, go with 1/tolerance; tracing grows by about a tenth per halving.
    fn seconds(&self, tolerance: f64, per_ray: f64, rays: f64) -> f64 {
        let finer = (self.tolerance / tolerance).max(0.1);
        self.prepare * finer + per_ray * rays * (1.0 + 0.1 * finer.log2().max(0.0))
    }
}

/// Finds the cheapest way to an accuracy. Runs on the current rayon pool.
pub fn aim(model: &Model, workshop: &dyn Workshop, ask: &Ask, progress: &(dyn Fn(Progress) + Sync)) -> Aim {
    let start = Instant::now();
    let clock = Clock::new(progress);
    clock.at("pilot rays", 0.0);
    let (pilot, mut candidates, bounds) = candidates(model, workshop, ask);
    candidates.sort_by(|a, b| a.predicted.total_cmp(&b.predicted));
    let fresh = Uniform::new(&bounds, ask.seed ^ 0xf5e5, ask.check_rays);
    let rays = fresh.rays(0..fresh.len());
    let truth = hits(workshop, &rays);
    let mut tries = Vec::new();
    let mut best: Option<(f64, f64, NormalMode, u64)> = None;
    'search: for (i, c) in candidates.iter().enumerate() {
        let mut tolerance = c.tolerance;
        for attempt in 0..ATTEMPTS {
            let share = (i * ATTEMPTS + attempt) as f64 / (candidates.len() * ATTEMPTS) as f64;
            clock.at(
                &format!("checking {} normals at {tolerance:.4} mm", normals_name(c.normals)),
                0.2 + 0.8 * share,
            );
            let predicted = pilot.seconds(tolerance, c.per_ray, ask.job_rays);
            // A tightening may have made the next candidate the cheaper one.
            if candidates.get(i + 1).is_some_and(|next| attempt > 0 && predicted > 1.5 * next.predicted) {
                break;
            }
            let (reached, checked) = judge(workshop, tolerance, c.normals, &rays, &truth);
            let normals = normals_name(c.normals).into();
            tries.push(Try {
                normals,
                tolerance_mm: tolerance,
                reached_deg: reached,
                predicted_seconds: predicted,
            });
            if best.is_none_or(|b| reached < b.0) {
                best = Some((reached, tolerance, c.normals, checked));
            }
            if reached <= ask.degrees {
                best = Some((reached, tolerance, c.normals, checked));
                break 'search;
            }
            let tighter = (MARGIN * ask.degrees / reached).powf(1.0 / c.order).clamp(0.02, 0.7);
            tolerance *= tighter;
        }
    }
    clock.at("done", 1.0);
    let (reached, tolerance, normals, checked) =
        best.unwrap_or((f64::INFINITY, pilot.tolerance, NormalMode::Exact, 0));
    let kept = reached <= ask.degrees;
    let answer = format!(
        "Asked {}°, reached {reached:.3e}° (p99 of {checked} fresh rays) with {tolerance:.4} mm and {} normals{}.",
        ask.degrees,
        normals_name(normals),
        if kept { "" } else { ": not reached" }
    );
    let seconds = start.elapsed().as_secs_f64();
    Aim {
        asked_deg: ask.degrees,
        reached_deg: reached,
        kept,
        tolerance_mm: tolerance,
        normals,
        tries,
        checked,
        seconds,
        answer,
    }
}

fn hits(workshop: &dyn Workshop, rays: &[Ray]) -> Vec<Option<Hit>> {
    let mut hits = vec![None; rays.len()];
    answer(workshop.exact(), rays, rayon::current_num_threads(), &mut hits);
    hits
}

/// p99 of the direction error on these rays, and how many of them hit.
fn judge(
    workshop: &dyn Workshop,
    tolerance: f64,
    normals: NormalMode,
    rays: &[Ray],
    truth: &[Option<Hit>],
) -> (f64, u64) {
    let meshed = workshop.mesh([tolerance; 2]);
    let mut found = vec![None; rays.len()];
    with_all(workshop, &meshed.mesh, &[Tree::Octree], &[normals], |trees| {
        answer(trees[0].2, rays, rayon::current_num_threads(), &mut found);
    });
    let errors = Errors::of(rays, &found, truth);
    (errors.reflected.at(0.99), errors.reflected.count())
}

/// Tolerances from the pilots' curvatures and incidences, costs from a trial of each kind of normals on coarse facets.
fn candidates(model: &Model, workshop: &dyn Workshop, ask: &Ask) -> (Pilot, Vec<Candidate>, Aabb) {
    let bounds = Aabb::around(
        model
            .placed_faces()
            .filter_map(|p| p.face.map(|f| (p, f.surface.bounds().corners())))
            .flat_map(|(p, corners)| corners.map(|c| p.placement.point(c))),
    );
    // 0.2 mm, the coarse end of what users ask for, or 1/500 of a small model.
    let coarse = (bounds.diagonal() / 500.0).clamp(1e-6, 0.2);
    let start = Instant::now();
    let meshed = workshop.mesh([coarse; 2]);
    let mesh_seconds = start.elapsed().as_secs_f64();
    let bounds = if meshed.mesh.facets.is_empty() { bounds } else { meshed.mesh.bounds() };
    let source = Uniform::new(&bounds, ask.seed, PILOTS);
    let rays = source.rays(0..source.len());
    let truth = hits(workshop, &rays);
    let (bend, tilt) = pilots(model, &rays, &truth);
    let epsilon = (MARGIN * ask.degrees).to_radians();
    const KINDS: [NormalMode; 4] = [NormalMode::Flat, NormalMode::Bilinear, NormalMode::Cubic, NormalMode::Exact];
    let (build_seconds, mut all) = with_all(workshop, &meshed.mesh, &[Tree::Octree], &KINDS, |trees| {
        let candidate = |(_, normals, tree): &(Tree, NormalMode, &dyn Intersector)| {
            let mut found = vec![None; rays.len()];
            let seconds: Vec<f64> = (0..3)
                .map(|_| {
                    let start = Instant::now();
                    answer(*tree, &rays, rayon::current_num_threads(), &mut found);
                    start.elapsed().as_secs_f64()
                })
                .collect();
            let measured = Errors::of(&rays, &found, &truth).reflected.at(0.99).to_radians();
            let per_ray = Timing::of(seconds).median / rays.len() as f64;
            let (tolerance, order) = predict(*normals, coarse, epsilon, measured, (&bend, &tilt));
            Candidate { normals: *normals, tolerance, order, per_ray, predicted: 0.0 }
        };
        let seconds = trees.first().map_or(0.0, |t| t.2.footprint().build_seconds);
        (seconds, trees.iter().map(candidate).collect::<Vec<_>>())
    });
    let pilot = Pilot { tolerance: coarse, prepare: mesh_seconds + build_seconds };
    for c in &mut all {
        c.predicted = pilot.seconds(c.tolerance, c.per_ray, ask.job_rays);
    }
    (pilot, all, bounds)
}

/// The tolerance at which 99 % of the pilots stay within `epsilon` radians, and the order of the error in the sag.
fn predict(
    normals: NormalMode,
    coarse: f64,
    epsilon: f64,
    measured: f64,
    (bend, tilt): (&Quantiles, &Quantiles),
) -> (f64, f64) {
    let (formula, order) = match normals {
        NormalMode::Flat => (epsilon * epsilon / (8.0 * bend.at(0.99).max(1e-300)), 0.5),
        NormalMode::Bilinear => (epsilon / tilt.at(0.99).max(1e-300), 1.0),
        // The error of cubic normals has no simple bound; its order is that of bilinear ones or better.
        NormalMode::Cubic => (coarse * (epsilon / measured.max(1e-300)), 1.0),
        _ => (coarse, 1.0),
    };
    // The formulas take every hit to lie as far off as the sag allows; what the pilots measured says how far they do.
    let scaled = coarse * (epsilon / measured.max(1e-300)).powf(1.0 / order);
    let coarsest = if normals == NormalMode::Exact { coarse } else { 8.0 * coarse };
    (formula.max(scaled).clamp(1e-3 * coarse, coarsest), order)
}

/// Distributions of the curvature κ, and of 2·κ·tan i, over the pilots' hits.
fn pilots(model: &Model, rays: &[Ray], truth: &[Option<Hit>]) -> (Quantiles, Quantiles) {
    let placed: Vec<_> = model.placed_faces().collect();
    let (mut bend, mut tilt) = (Quantiles::default(), Quantiles::default());
    for (ray, hit) in rays.iter().zip(truth) {
        let Some(h) = hit else { continue };
        let Some((face, frame)) = placed.get(h.face.index()).and_then(|p| p.face.map(|f| (f, p.placement))) else {
            continue;
        };
        let d = face.surface.second_derivatives(h.uv);
        let n = d.du.cross(d.dv).normalize_or_zero();
        let (e, f, g) = (d.du.length_squared(), d.du.dot(d.dv), d.dv.length_squared());
        let (l, m, k) = (d.duu.dot(n), d.duv.dot(n), d.dvv.dot(n));
        let det = e * g - f * f;
        let (mean, gauss) = (0.5 * (e * k - 2.0 * f * m + g * l) / det, (l * k - m * m) / det);
        let kappa = (mean.abs() + (mean * mean - gauss).max(0.0).sqrt()) / frame.scale;
        if !kappa.is_finite() {
            continue;
        }
        let cos = h.normal.dot(ray.direction).abs().clamp(1e-3, 1.0);
        bend.add(kappa);
        tilt.add(2.0 * kappa * (1.0 - cos * cos).sqrt() / cos);
    }
    (bend, tilt)
}

//! The seed paper's table 2: how the normal between the corners is got, its error and its time.

use super::errors::Errors;
use super::rays::{RaySource, Uniform};
use super::timing::Clock;
use super::workshop::{Meshed, Tree, Workshop, answer, with_all};
use super::{Progress, Rounds};
use crate::intersect::{Hit, NormalMode};
use crate::math::Ray;
use serde::Serialize;
use std::sync::Mutex;

/// What is compared and how long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Facets wanted; the paper has 20,000. The tolerance is chosen to come close.
    pub facets: usize,
    /// Rays of each repetition, all of which hit the spline.
    pub rays: u64,
    /// Repetitions, averaged by minimum and median; the paper has 100.
    pub repetitions: usize,
    /// Of the rays.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { facets: 20_000, rays: 20_000, repetitions: 100, seed: 1 }
    }
}

/// One way to get normals on one model.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    /// Name of the model; "paper" for the published figures.
    pub model: String,
    /// Facets of the model.
    pub facets: Option<usize>,
    /// `nearest`, `bilinear`, `cubic`, `exact`.
    pub algorithm: String,
    /// Mean Euclidean distance of the unit normals from the spline's at the exact hit of the same ray.
    pub normal_error_mean: f64,
    /// 99 % of the distances are smaller.
    pub normal_error_p99: Option<f64>,
    /// The largest such distance: that of a ray which meets the face elsewhere on facets, where there is one.
    pub normal_error_max: Option<f64>,
    /// Seconds of the fastest repetition.
    pub seconds_min: Option<f64>,
    /// Seconds of the middle repetition (of a single run, in the paper).
    pub seconds_median: f64,
}

/// The study.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Interpolation {
    /// Our rows, then the paper's.
    pub rows: Vec<Row>,
    /// One sentence.
    pub answer: String,
}

/// The paper's rows: algorithm, mean error, seconds.
const PAPER: [(&str, f64, f64); 3] = [("nearest", 0.015, 5.2), ("bilinear", 0.008, 6.8), ("cubic", 0.005, 12.4)];

const ALGORITHMS: [NormalMode; 4] =
    [NormalMode::Nearest, NormalMode::Bilinear, NormalMode::Cubic, NormalMode::Exact];

/// Compares the ways on each model, on one thread.
pub fn interpolation(
    models: &[(&str, &dyn Workshop)],
    settings: &Settings,
    progress: &(dyn Fn(Progress) + Sync),
) -> Interpolation {
    let clock = Clock::new(progress);
    let mut rows = Vec::new();
    for (i, (name, workshop)) in models.iter().enumerate() {
        clock.at(name, i as f64 / models.len() as f64);
        rows.extend(one(name, *workshop, settings));
    }
    let answer = sentence(&rows);
    rows.extend(PAPER.map(|(algorithm, error, seconds)| Row {
        model: "paper".into(),
        facets: Some(20_000),
        algorithm: algorithm.into(),
        normal_error_mean: error,
        seconds_median: seconds,
        ..Row::default()
    }));
    clock.at("done", 1.0);
    Interpolation { rows, answer }
}

/// A mesh of about the wanted number of facets: their number goes with 1/tolerance.
pub(super) fn mesh_of(workshop: &dyn Workshop, facets: usize) -> Meshed {
    let mut tolerance = 0.1;
    let mut meshed = workshop.mesh([tolerance; 2]);
    for _ in 0..6 {
        let ratio = meshed.mesh.facets.len() as f64 / facets.max(1) as f64;
        if (0.8..1.25).contains(&ratio) || meshed.mesh.facets.is_empty() {
            break;
        }
        tolerance = (tolerance * ratio.clamp(0.02, 50.0)).clamp(1e-6, 1e6);
        meshed = workshop.mesh([tolerance; 2]);
    }
    meshed
}

fn one(name: &str, workshop: &dyn Workshop, settings: &Settings) -> Vec<Row> {
    let meshed = mesh_of(workshop, settings.facets);
    let (rays, truth) = hitting(workshop, &meshed, settings);
    let hits = ALGORITHMS.map(|_| Mutex::new(vec![None; rays.len()]));
    let timings = with_all(workshop, &meshed.mesh, &[Tree::Octree], &ALGORITHMS, |trees| {
        let mut rounds = Rounds::default();
        for ((_, _, tree), hits) in trees.iter().zip(&hits) {
            let rays = &rays;
            rounds.add("", move || {
                if let Ok(mut hits) = hits.lock() {
                    answer(*tree, rays, 1, &mut hits);
                }
            });
        }
        rounds.run(settings.repetitions)
    });
    let row = |((algorithm, hits), (_, timing)): ((NormalMode, &Mutex<Vec<Option<Hit>>>), _)| {
        let timing: super::Timing = timing;
        let hits = hits.lock().map(|h| h.clone()).unwrap_or_default();
        let errors = Errors::of(&rays, &hits, &truth);
        Row {
            model: name.into(),
            facets: Some(meshed.mesh.facets.len()),
            algorithm: algorithm.name().into(),
            normal_error_mean: errors.normal.mean(),
            normal_error_p99: Some(errors.normal.at(0.99)),
            normal_error_max: Some(errors.normal.max()),
            seconds_min: Some(timing.min),
            seconds_median: timing.median,
        }
    };
    ALGORITHMS.into_iter().zip(&hits).zip(timings).map(row).collect()
}

/// Rays that hit the spline, with their exact hits; fewer than wanted when the model is hard to hit.
fn hitting(workshop: &dyn Workshop, meshed: &Meshed, settings: &Settings) -> (Vec<Ray>, Vec<Option<Hit>>) {
    let (mut rays, mut truth) = (Vec::new(), Vec::new());
    let source = Uniform::new(&meshed.mesh.bounds(), settings.seed, 20 * settings.rays);
    let mut begin = 0;
    while begin < source.len() && (rays.len() as u64) < settings.rays {
        let end = (begin + settings.rays).min(source.len());
        let tried = source.rays(begin..end);
        let mut hits = vec![None; tried.len()];
        answer(workshop.exact(), &tried, rayon::current_num_threads(), &mut hits);
        let good = tried.into_iter().zip(hits).filter(|(_, h)| h.is_some());
        for (ray, hit) in good.take(settings.rays as usize - rays.len()) {
            rays.push(ray);
            truth.push(hit);
        }
        begin = end;
    }
    (rays, truth)
}

/// How the errors stand to each other, model by model.
fn sentence(rows: &[Row]) -> String {
    let mut parts = Vec::new();
    for four in rows.chunks(ALGORITHMS.len()) {
        let three = |error: &dyn Fn(&Row) -> f64| {
            ["nearest", "bilinear", "cubic"]
                .map(|name| four.iter().find(|r| r.algorithm == name).map_or(f64::NAN, error))
        };
        let [n, b, c] = three(&|r| r.normal_error_mean);
        let [n99, b99, c99] = three(&|r| r.normal_error_p99.unwrap_or(f64::NAN));
        let model = four.first().map_or("", |r| &r.model);
        let ratios = format!("nearest : bilinear : cubic = {:.1} : 1 : {:.3}", n / b, c / b);
        parts.push(if c < b && b < n && c99 < b99 && b99 < n99 {
            format!("{model}: {ratios} (p99 {:.1} : 1 : {:.3})", n99 / b99, c99 / b99)
        } else {
            // Corner normals are the spline's own, so only curvature that changes within a facet (creases, needles,
            // poles) or an error that is rounding already can turn the order round.
            let why =
                if b < 1e-9 { "flat faces, all errors are rounding" } else { "curvature changes within a facet" };
            format!("{model}: {ratios}, not in the expected order ({why})")
        });
    }
    parts.join("; ") + " (the paper: 1.9 : 1 : 0.625)."
}

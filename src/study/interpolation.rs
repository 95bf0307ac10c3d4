//! Table 2 of the seed paper (Dong, Xue, Zhao): how the normal between the corners is computed, its error and its time.

use super::hit_errors::HitErrors;
use super::mesh_source::{FacetTree, MeasuredMesh, MeshSource, answer, with_intersectors};
use super::rays::{RaySource, Uniform};
use super::timing::Clock;
use super::{Progress, Rounds};
use crate::intersect::{Hit, NormalMode};
use crate::math::Ray;
use serde::{Deserialize, Serialize};
use std::sync::Mutex;

/// The search for a number of facets stays within these tolerances, mm: from a nanometre to a kilometre.
const TOLERANCES_MM: [f64; 2] = [1e-6, 1e6];
/// Share of the work on a model that its facets and rays take; the rest is rounds of rays.
const PREPARATION: f64 = 0.1;
/// Mean error of bilinear normals below which a face is flat: far above rounding (1e-16), far below any curved facet.
const FLAT: f64 = 1e-9;

/// Settings: what is compared and for how long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Facets wanted; the paper has 20,000. The tolerance is chosen to come close.
    pub facets: usize,
    /// Rays of each repetition, all of which hit the spline.
    pub rays: u64,
    /// Repetitions, averaged by minimum and median; the paper has 100.
    pub repetitions: usize,
    /// Seed of the rays.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { facets: 20_000, rays: 20_000, repetitions: 100, seed: 1 }
    }
}

/// One way to get normals on one model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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

/// The rows of the study, and its answer.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Interpolation {
    /// Our rows, then the paper's.
    pub rows: Vec<Row>,
    /// The answer in one sentence.
    pub answer: String,
}

/// The paper's rows: algorithm, mean error, seconds.
const PAPER: [(&str, f64, f64); 3] = [("nearest", 0.015, 5.2), ("bilinear", 0.008, 6.8), ("cubic", 0.005, 12.4)];

/// Those of the paper, and the true normals.
const ALGORITHMS: [NormalMode; 4] =
    [NormalMode::Nearest, NormalMode::Bilinear, NormalMode::Cubic, NormalMode::Exact];

/// Compares nearest, bilinear, cubic and exact normals on each named model, timing them on one thread; appends the paper's rows.
pub fn interpolation(
    models: &[(&str, &dyn MeshSource)],
    settings: &Settings,
    progress: &(dyn Fn(Progress) + Sync),
) -> Interpolation {
    let clock = Clock::new(progress);
    let mut rows = Vec::new();
    for (i, (name, mesh_source)) in models.iter().enumerate() {
        let tell = |share: f64| clock.report(name, (i as f64 + share) / models.len() as f64);
        rows.extend(rows_of_model(name, *mesh_source, settings, &tell));
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
    clock.report("done", 1.0);
    Interpolation { rows, answer }
}

/// Makes a mesh of about `facets` facets, within a quarter where six meshes suffice: their number goes with 1/tolerance.
pub(super) fn mesh_of(mesh_source: &dyn MeshSource, facets: usize) -> MeasuredMesh {
    // Any start will do: each step corrects the tolerance by how far the number was off.
    let mut tolerance = 0.1;
    let mut meshed = mesh_source.mesh([tolerance; 2]);
    for _ in 0..6 {
        let ratio = meshed.mesh.facets.len() as f64 / facets.max(1) as f64;
        // Within a quarter: the errors change by as much as the tolerance does.
        if (0.8..1.25).contains(&ratio) || meshed.mesh.facets.is_empty() {
            break;
        }
        // Held back, for far from the goal the law does not hold.
        tolerance = (tolerance * ratio.clamp(0.02, 50.0)).clamp(TOLERANCES_MM[0], TOLERANCES_MM[1]);
        meshed = mesh_source.mesh([tolerance; 2]);
    }
    meshed
}

/// Measures errors and times of all kinds of normals on one model, on facets of about the wanted number; a row for each. Calls `tell` with
/// the share done.
fn rows_of_model(name: &str, mesh_source: &dyn MeshSource, settings: &Settings, tell: &dyn Fn(f64)) -> Vec<Row> {
    tell(0.0);
    let meshed = mesh_of(mesh_source, settings.facets);
    let (rays, truth) = rays_that_hit(mesh_source, &meshed, settings);
    tell(PREPARATION);
    let hits = ALGORITHMS.map(|_| Mutex::new(vec![None; rays.len()]));
    let timings = with_intersectors(mesh_source, &meshed.mesh, &[FacetTree::Octree], &ALGORITHMS, |trees| {
        let mut rounds = Rounds::default();
        for ((_, _, tree), hits) in trees.iter().zip(&hits) {
            let rays = &rays;
            rounds.add("", move || {
                if let Ok(mut hits) = hits.lock() {
                    answer(*tree, rays, 1, &mut hits);
                }
            });
        }
        rounds.run_telling(settings.repetitions, |share| tell(PREPARATION + (1.0 - PREPARATION) * share))
    });
    let row = |((algorithm, hits), (_, timing)): ((NormalMode, &Mutex<Vec<Option<Hit>>>), _)| {
        let timing: super::Timing = timing;
        // A panic in another thread would have ended the study; the hits are whole.
        let hits = hits.lock().unwrap_or_else(|e| e.into_inner()).clone();
        let errors = HitErrors::between(&rays, &hits, &truth);
        Row {
            model: name.into(),
            facets: Some(meshed.mesh.facets.len()),
            algorithm: algorithm.name().into(),
            normal_error_mean: errors.normal.mean(),
            normal_error_p99: Some(errors.normal.quantile(0.99)),
            normal_error_max: Some(errors.normal.max()),
            seconds_min: Some(timing.min),
            seconds_median: timing.median,
        }
    };
    ALGORITHMS.into_iter().zip(&hits).zip(timings).map(row).collect()
}

/// Returns `settings.rays` rays that hit the spline, with their exact hits; fewer where fewer than one in twenty hits.
fn rays_that_hit(
    mesh_source: &dyn MeshSource,
    meshed: &MeasuredMesh,
    settings: &Settings,
) -> (Vec<Ray>, Vec<Option<Hit>>) {
    let (mut rays, mut truth) = (Vec::new(), Vec::new());
    // Twenty times as many are tried: a model that fewer than a twentieth meet gives fewer rays.
    let source = Uniform::new(&meshed.mesh.bounds(), settings.seed, 20 * settings.rays);
    let mut begin = 0;
    while begin < source.len() && (rays.len() as u64) < settings.rays {
        let end = (begin + settings.rays).min(source.len());
        let tried = source.rays(begin..end);
        let mut hits = vec![None; tried.len()];
        answer(mesh_source.exact(), &tried, rayon::current_num_threads(), &mut hits);
        let good = tried.into_iter().zip(hits).filter(|(_, h)| h.is_some());
        // No more than wanted: every model is judged by as many.
        for (ray, hit) in good.take(settings.rays as usize - rays.len()) {
            rays.push(ray);
            truth.push(hit);
        }
        begin = end;
    }
    (rays, truth)
}

/// How the kinds of normals stand to each other on one model; the errors as means.
#[derive(Clone, Debug, PartialEq)]
pub struct Ratios {
    /// Error of nearest normals over that of bilinear ones.
    pub nearest_to_bilinear: f64,
    /// Error of bilinear normals over that of cubic ones.
    pub bilinear_to_cubic: f64,
    /// Both ratios for the 99th percentiles of the errors, where they are known.
    pub at_p99: Option<[f64; 2]>,
    /// Time with cubic normals over that with bilinear ones.
    pub cubic_time: f64,
    /// Why the errors do not fall from nearest over bilinear to cubic, where they do not.
    pub why_not: Option<&'static str>,
}

impl Ratios {
    /// Works out the ratios from the rows of one model; `None` when a kind is missing.
    pub fn from_rows(rows: &[Row]) -> Option<Self> {
        let row = |name: &str| rows.iter().find(|r| r.algorithm == name);
        let (nearest, bilinear, cubic) = (row("nearest")?, row("bilinear")?, row("cubic")?);
        let [n, b, c] = [nearest, bilinear, cubic].map(|r| r.normal_error_mean);
        let at_p99 = match [nearest, bilinear, cubic].map(|r| r.normal_error_p99) {
            [Some(n), Some(b), Some(c)] => Some([n / b, b / c]),
            _ => None,
        };
        let falls = |[x, y]: [f64; 2]| x > 1.0 && y > 1.0;
        let mean_falls = falls([n / b, b / c]);
        // Rays that meet the face elsewhere on facets err whatever the normals: so do those polished to the spline.
        // Half of the error stays with the true normals: the places are to blame, not the normals.
        let elsewhere = row("exact").is_some_and(|e| e.normal_error_mean > 0.5 * c);
        let why_not = match (mean_falls, at_p99.is_none_or(falls)) {
            (true, true) => None,
            _ if b < FLAT => Some("the faces are flat: all errors are rounding"),
            (false, true) if elsewhere => {
                Some("a few rays meet the face elsewhere on facets and make the mean; the 99th percentile falls")
            }
            (false, true) => Some("a few rays make the mean; the 99th percentile falls"),
            (true, false) => Some(
                "the mean falls; at creases and needles, where curvature jumps within a facet, no rule is better",
            ),
            (false, false) => {
                Some("curvature jumps within many facets (creases, needles), which the corners do not show")
            }
        };
        let (nearest_to_bilinear, bilinear_to_cubic) = (n / b, b / c);
        let cubic_time = cubic.seconds_median / bilinear.seconds_median;
        Some(Self { nearest_to_bilinear, bilinear_to_cubic, at_p99, cubic_time, why_not })
    }
}

/// Writes by how much bilinear and cubic normals are nearer to the true ones, over all models, and what they cost; says so without any.
fn sentence(rows: &[Row]) -> String {
    let models: Vec<(&str, Ratios)> = rows
        .chunk_by(|a, b| a.model == b.model)
        .filter_map(|of| Some((of[0].model.as_str(), Ratios::from_rows(of)?)))
        .collect();
    let range = |value: &dyn Fn(&Ratios) -> f64| {
        let (low, high) =
            (models.iter()).fold((f64::INFINITY, 0f64), |(a, b), m| (a.min(value(&m.1)), b.max(value(&m.1))));
        let digits = |x: f64| if x < 9.95 { format!("{x:.1}") } else { format!("{x:.0}") };
        let (low, high) = (digits(low), digits(high));
        if low == high { low } else { format!("{low} to {high}") }
    };
    let odd: Vec<String> =
        models.iter().filter_map(|(name, r)| Some(format!("on {name} {}", r.why_not?))).collect();
    let order = match (odd.len(), models.len()) {
        (_, 0) => return "Nothing was measured.".into(),
        (0, 1) => "so in the mean and in the 99th percentile".into(),
        (0, n) => format!("so on all {n} models, in the mean and in the 99th percentile"),
        (k, n) => format!("so on {} of {n} models ({})", n - k, odd.join("; ")),
    };
    format!(
        "Between the corners of a facet, bilinear interpolation brings the surface normal **{} times** nearer to the true one than the \
         normal of the nearest corner does, and the cubic patch **{} times** nearer still, for {} times the time of bilinear; {order}. \
         The seed paper reports 1.9 times, 1.6 times and 1.8 times the time.",
        range(&|r| r.nearest_to_bilinear),
        range(&|r| r.bilinear_to_cubic),
        range(&|r| r.cubic_time)
    )
}

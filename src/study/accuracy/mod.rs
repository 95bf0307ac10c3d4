//! What accuracy costs: tolerance × kind of normal × intersector, each against the exact hits of the same rays.
//!
//! Theory for a mirror of radius R met at incidence i by a facet of sag s: flat normals err by up to 2·acos(1 − s/R), order
//! ½ in s; bilinear ones by 2·s·tan i/R, order 1. In facet length that is order 1 and 2.

mod sweep;

pub use sweep::accuracy;

use super::hit_errors::slope;
use super::mesh_source::FacetTree;
use crate::intersect::NormalMode;
use crate::text::{count_of, figures};
use serde::Serialize;

/// Direction errors below this are rounding, degrees: 8e6 units in the last place of a radian.
const ROUNDING_DEG: f64 = 1e-7;

/// Settings: what is swept and for how long.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Tolerances `[min, max]`, mm, coarse first.
    pub tolerances: Vec<[f64; 2]>,
    /// Kinds of normals.
    pub normals: Vec<NormalMode>,
    /// Structures over the facets.
    pub trees: Vec<FacetTree>,
    /// Rays: both the timed and the judged ones.
    pub rays: u64,
    /// Timed rounds, beside one that is not timed.
    pub rounds: usize,
    /// Numbers of threads; 1 or that of the current rayon pool.
    pub threads: Vec<usize>,
    /// Seed of the rays.
    pub seed: u64,
    /// Seconds of work that the caller does after the sweep, for the time left.
    pub seconds_after: f64,
}

impl Default for Settings {
    fn default() -> Self {
        // Halved each time, so that slopes over them are read off even steps of the logarithm.
        let uniform = [1.6, 0.8, 0.4, 0.2, 0.1, 0.05, 0.025, 0.0125].map(|t| [t, t]);
        let all = rayon::current_num_threads();
        Self {
            tolerances: uniform.into_iter().chain([[0.05, 0.2]]).collect(),
            normals: NormalMode::ALL.to_vec(),
            trees: vec![FacetTree::Octree, FacetTree::CwBvh],
            rays: 50_000,
            rounds: 3,
            threads: if all == 1 { vec![1] } else { vec![1, all] },
            seed: 1,
            seconds_after: 0.0,
        }
    }
}

/// One combination, measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    /// Name of the model.
    pub model: String,
    /// Uniform tolerance, or the lower end of the adaptive one; `None` for the spline.
    pub tolerance_mm: Option<f64>,
    /// Whether the tolerance was a range.
    pub adaptive: bool,
    /// Kind of normals.
    pub normals: String,
    /// `octree`, `cwbvh` or `exact`.
    pub intersector: String,
    /// Threads that traced.
    pub threads: usize,
    /// Facets (patches for the spline).
    pub facets: usize,
    /// Bytes of mesh and structure.
    pub bytes: usize,
    /// Mean distance of the facets from the spline, sampled, mm; `None` for the spline.
    pub sag_mean_mm: Option<f64>,
    /// Largest distance of the facets from the spline, sampled, mm; `None` for the spline.
    pub sag_max_mm: Option<f64>,
    /// Seconds of making the facets; `None` for the spline.
    pub seconds_tessellate: Option<f64>,
    /// Seconds of building the structure.
    pub seconds_build: f64,
    /// Seconds of the fastest round for all rays.
    pub seconds_trace_min: f64,
    /// Seconds of the middle round for all rays.
    pub seconds_trace_median: f64,
    /// Seconds that 90 % of the rounds stayed below, for all rays.
    pub seconds_trace_p90: f64,
    /// Rays traced.
    pub rays: u64,
    /// Median distance between hit and exact hit, mm.
    pub hit_error_mm_p50: f64,
    /// 99th percentile of the distance between hit and exact hit, mm.
    pub hit_error_mm_p99: f64,
    /// Median error of the mirrored ray's direction, degrees.
    pub direction_error_deg_p50: f64,
    /// Root mean square of that error, degrees; grazing rays dominate it.
    pub direction_error_deg_rms: f64,
    /// 99th percentile of that error, degrees.
    pub direction_error_deg_p99: f64,
    /// Largest such error, degrees.
    pub direction_error_deg_max: f64,
    /// Root mean square error of the direction of the ray refracted into n = 1.5, degrees.
    pub refracted_error_deg_rms: f64,
    /// 99th percentile of that error, degrees.
    pub refracted_error_deg_p99: f64,
    /// Rays that hit only one of the two, or another face.
    pub flips: u64,
}

impl Row {
    /// Returns the seconds from the model to the answers of this row's rays: meshing, building and the median trace.
    pub fn seconds(&self) -> f64 {
        self.seconds_prepare() + self.seconds_trace_median
    }

    /// Returns the seconds before the first ray; the spline has no facets to make.
    fn seconds_prepare(&self) -> f64 {
        self.seconds_tessellate.unwrap_or(0.0) + self.seconds_build
    }
}

/// How errors fall with the sag and with the facets' length, beside theory.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slope {
    /// Kind of normals.
    pub normals: String,
    /// Exponent of the median direction error over the mean sag.
    pub in_sag: f64,
    /// Exponent over the facets' length, taken as facets^(−½).
    pub in_length: f64,
    /// What theory says for smooth surfaces, where it says something.
    pub theory_in_sag: Option<f64>,
    /// Tolerances that entered.
    pub points: usize,
}

/// The rows of the study, and what follows from them.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Accuracy {
    /// Every combination.
    pub rows: Vec<Row>,
    /// How the error falls, for each kind of normals.
    pub slopes: Vec<Slope>,
    /// Indices of rows that no other row beats in both error (p99) and time, by falling error.
    pub front: Vec<usize>,
    /// The answer in one sentence.
    pub answer: String,
}

/// Fits, for each kind of normals, the median error against sag and facet length over the uniform tolerances of the first tree; kinds with
/// fewer than two usable tolerances are left out. The error goes with tan i, whose mean square over isotropic rays has no limit, so an rms
/// follows the few most grazing rays instead of the facets. Where more than half of the hits are on planes, the 99th percentile stands in.
fn slopes(rows: &[Row]) -> Vec<Slope> {
    let mut names: Vec<&str> = Vec::new();
    for r in rows.iter().filter(|r| r.tolerance_mm.is_some()) {
        if !names.contains(&r.normals.as_str()) {
            names.push(&r.normals);
        }
    }
    let of = |name: &str| {
        let first = rows.iter().find(|r| r.normals == name && r.tolerance_mm.is_some())?;
        let own = |r: &&Row| {
            r.normals == name && r.intersector == first.intersector && r.threads == first.threads && !r.adaptive
        };
        // One tree and one number of threads: the errors of all are the same, and would count twice.
        let all: Vec<&Row> = rows.iter().filter(own).filter(|r| r.tolerance_mm.is_some()).collect();
        // Below 1e-7° an error is rounding and follows no power law.
        let planes = all.iter().any(|r| r.direction_error_deg_p50 <= ROUNDING_DEG);
        let error = |r: &Row| if planes { r.direction_error_deg_p99 } else { r.direction_error_deg_p50 };
        let used: Vec<&Row> = all.into_iter().filter(|r| error(r) > ROUNDING_DEG).collect();
        let sag: Vec<_> = used.iter().filter_map(|r| Some([r.sag_mean_mm?, error(r)])).collect();
        let length: Vec<_> = used.iter().map(|r| [1.0 / (r.facets as f64).sqrt(), error(r)]).collect();
        let theory_in_sag = match name {
            "flat" | "nearest" => Some(0.5),
            "bilinear" => Some(1.0),
            _ => None,
        };
        Some(Slope {
            normals: name.into(),
            in_sag: slope(&sag)?,
            in_length: slope(&length)?,
            theory_in_sag,
            points: used.len(),
        })
    };
    names.into_iter().filter_map(of).collect()
}

/// Returns the indices of the rows with the most threads that no other of them beats in both time and p99 error, by falling error.
fn front(rows: &[Row]) -> Vec<usize> {
    // Fewer threads are slower throughout: their rows would only hide behind the others.
    let threads = rows.iter().map(|r| r.threads).max().unwrap_or(1);
    let mut order: Vec<usize> = (0..rows.len()).filter(|&i| rows[i].threads == threads).collect();
    let key = |i: usize| (rows[i].seconds(), rows[i].direction_error_deg_p99);
    // By time; of equal times the smaller error first, so that the larger one never enters.
    order.sort_by(|&a, &b| key(a).0.total_cmp(&key(b).0).then(key(a).1.total_cmp(&key(b).1)));
    let mut best = f64::INFINITY;
    order.retain(|&i| {
        let keep = key(i).1 < best;
        best = best.min(key(i).1);
        keep
    });
    order
}

/// Rays of the job that [`sentence`] speaks of: with the few of the sweep alone, making facets would weigh more than in any real run.
const JOB: f64 = 1e6;

impl Row {
    /// Returns the seconds from the model to the answers of a job of a million rays, tracing in proportion to the rays.
    pub fn seconds_of_job(&self) -> f64 {
        self.seconds_prepare() + self.seconds_trace_median * JOB / self.rays.max(1) as f64
    }
}

/// Writes "For 0.05° take …": what is cheapest for a million rays, the spline or the facets with a p99 direction error within `target`
/// degrees, and what the other costs; or that no facets keep it.
pub fn sentence(rows: &[Row], target: f64) -> String {
    let threads = rows.iter().map(|r| r.threads).max().unwrap_or(1);
    let timed =
        |facets: bool| rows.iter().filter(move |r| r.threads == threads && r.tolerance_mm.is_some() == facets);
    let good = timed(true).filter(|r| r.direction_error_deg_p99 <= target);
    let cheapest = good.min_by(|a, b| a.seconds_of_job().total_cmp(&b.seconds_of_job()));
    let cost = |r: &Row| format!("**{:.2} s**", r.seconds_of_job());
    let job = format!("for a million rays on {}", count_of(threads as u64, "thread"));
    let spline = timed(false).next();
    let Some((facets, tolerance)) = cheapest.and_then(|r| Some((r, r.tolerance_mm?))) else {
        let spline = spline.map_or(String::new(), |e| format!("; the exact spline costs {} {job}", cost(e)));
        return format!("No swept combination of facets reaches {target}°{spline}.");
    };
    let from = if facets.adaptive { "tolerances from " } else { "" };
    let settings = format!("{from}{tolerance} mm with {} normals in the {}", facets.normals, facets.intersector);
    // The spline has no direction error, so that it is the better one where it costs no more.
    let choice = match spline {
        Some(e) if e.seconds_of_job() <= facets.seconds_of_job() => {
            format!("the exact spline: {} {job}; the cheapest facets, {settings}, cost {}", cost(e), cost(facets))
        }
        Some(e) => format!("{settings}: {} {job}; the exact spline costs {}", cost(facets), cost(e)),
        None => format!("{settings}: {} {job}", cost(facets)),
    };
    let reached = match facets.direction_error_deg_p99 {
        rounding if rounding <= ROUNDING_DEG => "exact but for rounding".to_owned(),
        error => format!("{}° reached", figures(error, 3)),
    };
    format!(
        "For {target}° take {choice}. On the facets 99 % of the mirrored rays keep that direction error ({reached}). Times are \
         those of {}, tracing taken in proportion.",
        count_of(facets.rays, "ray")
    )
}

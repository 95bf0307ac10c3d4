//! A receiver's error split in two: geometric (the same rays on facets and on the spline) and statistical.
//!
//! Random numbers are keyed by ray and bounce, so a run on facets and one on the spline follow the same paths until the
//! facets turn them away: the difference of the two maps is the facets' doing, and most of the noise cancels. What the noise
//! would be comes from the spread over the run's replicates.

use super::Progress;
use super::geometric_error::trace_replicates;
use super::mesh_source::{FacetTree, MeshSource, with_intersectors};
use super::timing::Countdown;
use crate::intersect::{Intersector, NormalMode};
use crate::math::error_of_sum;
use crate::simulate::{BoundScene, ReceiverResult, RunSettings, simulate};
use serde::Serialize;
use std::time::Instant;

/// Times are never taken as shorter, s: the resolution of the clock, so that no pace is infinite.
const LEAST_SECONDS: f64 = 1e-9;

/// One receiver under one combination.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    /// Name of the scene.
    pub scene: String,
    /// Name of the receiver.
    pub receiver: String,
    /// Uniform tolerance, mm.
    pub tolerance_mm: f64,
    /// Kind of normals.
    pub normals: String,
    /// Rays from the sources.
    pub rays: u64,
    /// Seconds to trace, on facets.
    pub seconds_trace: f64,
    /// Seconds to trace, on the spline.
    pub seconds_trace_exact: f64,
    /// Power on the receiver.
    pub power: f64,
    /// What facets change of it, relative.
    pub power_geometric: f64,
    /// Its standard error, relative.
    pub power_statistical: f64,
    /// Root mean square of the cells' differences over that of the cells.
    pub map_geometric: f64,
    /// Root mean square of the cells' standard errors over that of the cells.
    pub map_statistical: f64,
    /// Relative change of the spot's rms size along both sides.
    pub spot_geometric: [f64; 2],
    /// `geometry`, `statistics` or `balanced`: what to spend on next.
    pub limited_by: String,
}

/// What facets change of a receiver's power, from the same rays on both.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PowerComparison {
    /// Name of the receiver.
    pub name: String,
    /// Power on facets.
    pub power_facets: f64,
    /// Power on the spline.
    pub power_exact: f64,
    /// The first less the second.
    pub difference: f64,
    /// Standard error of the difference: most of the noise is common to both and cancels.
    pub difference_error: f64,
    /// Standard error of the power itself, for comparison.
    pub power_error: f64,
}

/// Traces the same rays on facets and on the spline and compares the power of every receiver, with the error of the difference from
/// replicate to replicate.
pub fn compare_power(
    bound: &BoundScene,
    facets: &dyn Intersector,
    exact: &dyn Intersector,
    settings: &RunSettings,
) -> Vec<PowerComparison> {
    let [on_facets, on_spline] = [facets, exact].map(|i| trace_replicates(bound, i, settings));
    let (found, truth) = (&on_facets.results, &on_spline.results);
    (found.receivers.iter().zip(&truth.receivers).enumerate())
        .map(|(k, (f, e))| {
            let differences = on_facets
                .replicates
                .iter()
                .zip(&on_spline.replicates)
                // Counts are exact integers: their differences are too.
                .map(|(a, b)| a[k].power as f64 - b[k].power as f64);
            let differences: Vec<f64> = differences.map(|d| d * truth.quantum).collect();
            PowerComparison {
                name: f.name.clone(),
                power_facets: f.power,
                power_exact: e.power,
                difference: differences.iter().sum(),
                difference_error: error_of_sum(&differences),
                power_error: e.power_error,
            }
        })
        .collect()
}

/// What to trace on, and the seconds that this will take.
#[derive(Clone, Copy, Debug)]
pub(super) struct Combination {
    /// Tolerance of the facets, mm.
    pub(super) tolerance: f64,
    /// Kind of normals at the hits.
    pub(super) normals: NormalMode,
    /// Meshing, building and tracing.
    pub(super) seconds: f64,
}

/// Traces a scene on the spline once and on facets for every combination, and returns a row for each receiver and combination. Combinations
/// of one tolerance must stand together; `begun` is when the whole study began, for the forecast.
pub(super) fn receivers(
    name: &str,
    bound: &BoundScene,
    mesh_source: &dyn MeshSource,
    (combinations, seconds_spline): (&[Combination], f64),
    settings: &RunSettings,
    (begun, progress): (Instant, &(dyn Fn(Progress) + Sync)),
) -> Vec<Row> {
    let mut countdown = Countdown::since(begun, progress);
    let seconds = |of: &[Combination]| -> f64 { of.iter().map(|c| c.seconds).sum() };
    countdown.stage("receivers on the spline", Some(seconds_spline + seconds(combinations)));
    // Once: the truth does not change with the tolerance.
    let truth = simulate(bound, mesh_source.exact(), settings, &|_| true);
    let start = Instant::now();
    let (mut rows, mut done) = (Vec::new(), 0);
    for of_one in combinations.chunk_by(|a, b| a.tolerance == b.tolerance) {
        let tolerance = of_one[0].tolerance;
        // What was expected, corrected by how long the combinations so far took against it; a quarter of the whole counts as done just
        // as expected, for the first few alone led to forecasts a third too long.
        let kept = 0.25 * seconds(combinations);
        let spent = if done == 0 { 0.0 } else { start.elapsed().as_secs_f64() };
        let pace = (spent + kept) / (seconds(&combinations[..done]) + kept).max(LEAST_SECONDS);
        let ahead = pace * seconds(&combinations[done..]);
        countdown.stage(&format!("receivers at {tolerance} mm"), Some(ahead));
        done += of_one.len();
        // One mesh serves all kinds of normals.
        let meshed = mesh_source.mesh([tolerance; 2]);
        let normals: Vec<NormalMode> = of_one.iter().map(|c| c.normals).collect();
        let found = with_intersectors(mesh_source, &meshed.mesh, &[FacetTree::Octree], &normals, |trees| {
            let run = |tree: &(FacetTree, NormalMode, &dyn Intersector)| {
                countdown.tick();
                simulate(bound, tree.2, settings, &|_| true)
            };
            trees.iter().map(run).collect::<Vec<_>>()
        });
        for (found, normals) in found.iter().zip(&normals) {
            for (f, e) in found.receivers.iter().zip(&truth.receivers) {
                rows.push(Row {
                    scene: name.into(),
                    tolerance_mm: tolerance,
                    normals: normals.name().into(),
                    rays: found.rays,
                    seconds_trace: found.seconds.trace,
                    seconds_trace_exact: truth.seconds.trace,
                    ..split_errors(f, e)
                });
            }
        }
    }
    countdown.stage("done", Some(0.0));
    rows
}

/// Works out what facets change of a receiver beside what rays leave open, and which of the two limits it; names, rays and times stay
/// empty.
fn split_errors(found: &ReceiverResult, truth: &ReceiverResult) -> Row {
    let norm = |x: &mut dyn Iterator<Item = f64>| x.map(|v| v * v).sum::<f64>().sqrt();
    let scale = norm(&mut truth.cells.iter().copied()).max(f64::MIN_POSITIVE);
    let geometric = norm(&mut found.cells.iter().zip(&truth.cells).map(|(a, b)| a - b)) / scale;
    let statistical = norm(&mut truth.errors.iter().copied()) / scale;
    // A spot of no width has no share of it to lose.
    let relative = |a: f64, b: f64| if b == 0.0 { a.abs() } else { (a / b - 1.0).abs() };
    // Within a factor of two neither is worth mending alone.
    let limited_by = if geometric > 2.0 * statistical {
        "geometry"
    } else if statistical > 2.0 * geometric {
        "statistics"
    } else {
        "balanced"
    };
    Row {
        receiver: found.name.clone(),
        power: found.power,
        power_geometric: relative(found.power, truth.power),
        power_statistical: truth.power_error / truth.power.max(f64::MIN_POSITIVE),
        map_geometric: geometric,
        map_statistical: statistical,
        spot_geometric: [0, 1].map(|a| relative(found.rms[a], truth.rms[a])),
        limited_by: limited_by.into(),
        ..Row::default()
    }
}

//! A receiver's error split in two: geometric (the same rays on facets and on the spline) and statistical.
//!
//! Random numbers are keyed by ray and bounce, so a run on facets and one on the spline follow the same paths until the
//! facets turn them away: the difference of the two maps is the facets' doing, and most of the noise cancels. What the noise
//! would be comes from the spread over the run's replicates.

use super::Progress;
use super::geometric_error::{ReceiverError, compare, trace_replicates};
use super::mesh_source::{FacetTree, MeshSource, with_intersectors};
use super::timing::Countdown;
use crate::intersect::{Intersector, NormalMode};
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
    /// Unit of `power`: `W` or `lm`.
    pub unit: String,
    /// What facets change of it, relative; `None` where the receiver is dark on the spline, as for the next three.
    pub power_geometric: Option<f64>,
    /// Its standard error, relative.
    pub power_statistical: Option<f64>,
    /// Root mean square of the cells' differences over that of the cells.
    pub map_geometric: Option<f64>,
    /// Root mean square of the cells' standard errors over that of the cells.
    pub map_statistical: Option<f64>,
    /// Relative change of the spot's rms size along both sides; `None` along one of which it has no size on the spline.
    pub spot_geometric: [Option<f64>; 2],
    /// `geometry`, `statistics` or `balanced`: what to spend on next; `dark` where there is nothing to compare with.
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
/// replicate to replicate and from rays too rare to be among these.
pub fn compare_power(
    bound: &BoundScene,
    facets: &dyn Intersector,
    exact: &dyn Intersector,
    settings: &RunSettings,
) -> Vec<PowerComparison> {
    let [on_facets, on_spline] = [facets, exact].map(|i| trace_replicates(bound, i, settings));
    let truth = &on_spline.results;
    let error = compare(bound, [&on_facets, &on_spline]).with_unseen_rays(truth.power.emitted);
    let comparison = |(r, e): (&ReceiverError, &ReceiverResult)| PowerComparison {
        name: e.name.clone(),
        power_facets: r.power.facets,
        power_exact: r.power.spline,
        difference: r.power.facets - r.power.spline,
        difference_error: r.power.error,
        power_error: e.power_error,
    };
    error.receivers.iter().zip(&truth.receivers).map(comparison).collect()
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
        // as expected, because the first few alone led to forecasts a third too long.
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
                    unit: bound.scene.run.unit.symbol().into(),
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
    // Of darkness, and of a spot without width, there is no share to lose.
    let share = |x: f64, of: f64| (of > 0.0).then(|| x / of);
    let scale = norm(&mut truth.cells.iter().copied());
    let geometric = share(norm(&mut found.cells.iter().zip(&truth.cells).map(|(a, b)| a - b)), scale);
    let statistical = share(norm(&mut truth.errors.iter().copied()), scale);
    let relative = |a: f64, b: f64| share((a - b).abs(), b);
    // Within a factor of two neither is worth mending alone.
    let limited_by = match geometric.zip(statistical) {
        None => "dark",
        Some((geometric, statistical)) if geometric > 2.0 * statistical => "geometry",
        Some((geometric, statistical)) if statistical > 2.0 * geometric => "statistics",
        Some(_) => "balanced",
    };
    Row {
        receiver: found.name.clone(),
        power: found.power,
        power_geometric: relative(found.power, truth.power),
        power_statistical: share(truth.power_error, truth.power),
        map_geometric: geometric,
        map_statistical: statistical,
        spot_geometric: [0, 1].map(|a| relative(found.rms[a], truth.rms[a]).filter(|_| !truth.is_cyclic(a))),
        limited_by: limited_by.into(),
        ..Row::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::octree::{self, Octree};
    use crate::mesh::FacetMesh;
    use crate::model::Model;
    use crate::simulate::Scene;
    use std::path::Path;

    /// A receiver that only facets light has no figures on the spline to be a share of; a point of light has no width.
    #[test]
    fn errors_of_nothing_are_no_numbers() {
        let text = "[run]\nrays = 2000\n[[source]]\nkind = 'collimated'\ndirection = [0, 0, -1]\n\
            [[receiver]]\nname = 'lit'\nat = [0, 0, -1]\nsize = [2, 2]\ncells = [2, 2]\n\
            [[receiver]]\nname = 'dark'\nat = [0, 0, 1]\nsize = [2, 2]\ncells = [2, 2]\n";
        let scene = Scene::parse(text, "dark.toml", Path::new(".")).unwrap();
        let bound = scene.bind(&Model::default()).unwrap();
        let mesh = FacetMesh::default();
        let nothing = Octree::build(&mesh, &octree::Settings::default());
        let results = simulate(&bound, &nothing, &RunSettings::from(&scene.run), &|_| true);
        let [lit, dark] = &results.receivers[..] else { panic!("two receivers") };
        assert!(lit.power == 1.0 && dark.power == 0.0);
        let row = serde_json::to_value(split_errors(lit, dark)).unwrap();
        for key in ["power_geometric", "power_statistical", "map_geometric", "map_statistical"] {
            assert!(row[key].is_null(), "{key}: {}", row[key]);
        }
        assert_eq!(row["limited_by"], "dark");
        // The beam meets one point: its rms size is none.
        let row = serde_json::to_value(split_errors(dark, lit)).unwrap();
        assert_eq!(row["power_geometric"], 1.0);
        assert!(
            row["spot_geometric"][0].is_null() && row["spot_geometric"][1].is_null(),
            "{}",
            row["spot_geometric"]
        );
    }
}

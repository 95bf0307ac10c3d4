//! The accuracy study of a scene: the sweep over its model, then what facets do to its light.

use super::Progress;
use super::accuracy::{self, Accuracy};
use super::mesh_source::{FacetTree, MeshSource, with_intersectors};
use super::receivers::{self, Combination};
use crate::intersect::{Intersector, NormalMode};
use crate::simulate::{BoundScene, RunSettings, simulate};
use std::time::Instant;

/// Times are never taken as shorter, s: the resolution of the clock, so that no ratio is infinite.
const LEAST_SECONDS: f64 = 1e-9;

/// Kinds of normals for which the receivers are evaluated.
const KINDS: [NormalMode; 4] = [NormalMode::Flat, NormalMode::Bilinear, NormalMode::Cubic, NormalMode::Exact];

/// Sweeps a model, then traces its light on facets of every uniform tolerance of the sweep and on the spline; without a uniform tolerance
/// there are no rows of light. `mesh_source` makes the sweep's meshes, with their sag measured; `plain` those of the light, which need
/// none.
pub fn scene_accuracy(
    name: &str,
    [mesh_source, plain]: [&dyn MeshSource; 2],
    (bound, run): (&BoundScene, &RunSettings),
    settings: &accuracy::Settings,
    progress: &(dyn Fn(Progress) + Sync),
) -> (Accuracy, Vec<receivers::Row>) {
    let begun = Instant::now();
    let uniform: Vec<f64> = settings.tolerances.iter().filter(|t| t[0] == t[1]).map(|t| t[0]).collect();
    let Some(&middle) = uniform.get(uniform.len() / 2) else {
        return (accuracy::accuracy(name, mesh_source, settings, progress), Vec::new());
    };
    let pilot = Pilot::time(plain, bound, run, middle);
    let seconds_after =
        pilot.spline + uniform.iter().flat_map(|&t| pilot.expected_seconds(t, |_| None)).sum::<f64>();
    let settings = accuracy::Settings { seconds_after, ..settings.clone() };
    let study = accuracy::accuracy(name, mesh_source, &settings, progress);
    let threads = study.rows.iter().map(|r| r.threads).max().unwrap_or(1);
    let swept_row = |tolerance: f64, normals: NormalMode| {
        let mut rows = study.rows.iter().filter(|r| r.threads == threads && !r.adaptive);
        let octree = FacetTree::Octree.name();
        rows.find(|r| r.tolerance_mm == Some(tolerance) && r.intersector == octree && r.normals == normals.name())
    };
    // The sweep's rays are not the scene's, but finer facets slow both alike.
    let slower = |tolerance: f64, normals: NormalMode| {
        let [now, then] = [tolerance, middle].map(|t| swept_row(t, normals).map(|r| r.seconds_trace_median));
        Some(now? / then?.max(LEAST_SECONDS))
    };
    let mut combinations = Vec::new();
    for &t in &uniform {
        let seconds = pilot.expected_seconds(t, |normals| slower(t, normals));
        combinations.extend(KINDS.into_iter().zip(seconds).map(|(n, seconds)| Combination {
            tolerance: t,
            normals: n,
            seconds,
        }));
    }
    let rows = receivers::receivers(name, bound, plain, (&combinations, pilot.spline), run, (begun, progress));
    (study, rows)
}

/// Seconds of the whole run of light, from a part of its rays.
struct Pilot {
    /// The tolerance that it was timed at, mm.
    middle: f64,
    /// Seconds of the run on the spline.
    spline: f64,
    /// Seconds of meshing and building at the middle tolerance.
    prepare: f64,
    /// Seconds of tracing there, for each of [`KINDS`].
    traced: [f64; 4],
}

impl Pilot {
    /// Times a twentieth and a quarter of the run on the spline and, at the tolerance `middle`, mm, on an octree of facets with each of
    /// [`KINDS`], and extrapolates each to all rays; meshing and building is timed once, as it is. Traces 1.75 times the rays of a run.
    fn time(mesh_source: &dyn MeshSource, bound: &BoundScene, run: &RunSettings, middle: f64) -> Self {
        let timed = |intersector: &dyn Intersector, rays: u64| {
            let few = RunSettings { rays, path_samples: 0, ..run.clone() };
            let start = Instant::now();
            simulate(bound, intersector, &few, &|_| true);
            start.elapsed().as_secs_f64()
        };
        // Two numbers of rays, because a run costs something before its first: a tenth of the rays alone gave a third too much. The first
        // run also warms threads and caches.
        let (few, more) = (run.rays.div_ceil(20), run.rays.div_ceil(4));
        let seconds = |intersector: &dyn Intersector| {
            timed(intersector, few);
            let (a, b) = (timed(intersector, few), timed(intersector, more));
            b + (b - a).max(0.0) * (run.rays - more) as f64 / (more - few).max(1) as f64
        };
        let spline = seconds(mesh_source.exact());
        let start = Instant::now();
        let meshed = mesh_source.mesh([middle; 2]);
        with_intersectors(mesh_source, &meshed.mesh, &[FacetTree::Octree], &KINDS, |trees| {
            let prepare = start.elapsed().as_secs_f64();
            let mut traced = [0.0; 4];
            traced.iter_mut().zip(trees).for_each(|(slot, tree)| *slot = seconds(tree.2));
            Self { middle, spline, prepare, traced }
        })
    }

    /// Forecasts the seconds for each of [`KINDS`] at a tolerance, mm: tracing there, and an equal share of making facets, which goes with
    /// 1/tolerance; `slower` returns the factor from the tracing time at the middle one to that there, where it was measured.
    fn expected_seconds(&self, tolerance: f64, slower: impl Fn(NormalMode) -> Option<f64>) -> [f64; 4] {
        // Facets go with 1/tolerance, tracing grows by about a tenth per halving.
        let finer = self.middle / tolerance;
        let usual = (1.0 + 0.1 * finer.log2()).max(0.5);
        let mut seconds = self.traced;
        for (s, normals) in seconds.iter_mut().zip(KINDS) {
            *s = *s * slower(normals).unwrap_or(usual) + self.prepare * finer / KINDS.len() as f64;
        }
        seconds
    }
}

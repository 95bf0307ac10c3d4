//! The accuracy study of a scene: the sweep over its model, then what facets do to its light.

use super::Progress;
use super::accuracy::{self, Accuracy};
use super::receivers::{self, Expected};
use super::workshop::{Tree, Workshop, with_all};
use crate::intersect::{Intersector, NormalMode};
use crate::simulate::{BoundScene, RunSettings, simulate};
use std::time::Instant;

/// Kinds of normals that the receivers are asked about.
const KINDS: [NormalMode; 4] = [NormalMode::Flat, NormalMode::Bilinear, NormalMode::Cubic, NormalMode::Exact];

/// Sweeps a model, then traces its light on facets of every uniform tolerance of the sweep and on the spline. `workshop` makes
/// the sweep's meshes, with their sag measured; `plain` those of the light, which need none.
pub fn accuracy_of_scene(
    name: &str,
    [workshop, plain]: [&dyn Workshop; 2],
    (bound, run): (&BoundScene, &RunSettings),
    settings: &accuracy::Settings,
    progress: &(dyn Fn(Progress) + Sync),
) -> (Accuracy, Vec<receivers::Row>) {
    let begun = Instant::now();
    let uniform: Vec<f64> = settings.tolerances.iter().filter(|t| t[0] == t[1]).map(|t| t[0]).collect();
    let seconds_after = pilot(plain, bound, run, &uniform);
    let settings = accuracy::Settings { seconds_after, ..settings.clone() };
    let study = accuracy::accuracy(name, workshop, &settings, progress);
    let threads = study.rows.iter().map(|r| r.threads).max().unwrap_or(1);
    let of = |tolerance: Option<f64>, tree: &str, normals: NormalMode| {
        let mut rows = study.rows.iter().filter(|r| r.threads == threads && !r.adaptive);
        let name = normals.name();
        rows.find(|r| r.tolerance_mm == tolerance && r.intersector == tree && r.normals == name)
    };
    // The sweep's rays are not the scene's, but facets and spline stand to each other alike on both.
    let spline = of(None, "exact", NormalMode::Exact).map_or(1.0, |r| r.seconds_trace_median.max(1e-9));
    let expected = |tolerance: f64, normals: NormalMode| {
        let row = of(Some(tolerance), Tree::Octree.name(), normals);
        row.map_or(Expected { prepare: 0.0, of_spline: 1.0 }, |r| Expected {
            prepare: r.seconds_build + r.seconds_tessellate.unwrap_or(0.0) / KINDS.len() as f64,
            of_spline: r.seconds_trace_median / spline,
        })
    };
    let combinations: Vec<_> = uniform.iter().flat_map(|&t| KINDS.map(|n| (t, n, expected(t, n)))).collect();
    let rows = receivers::receivers(name, bound, plain, &combinations, run, (begun, progress));
    (study, rows)
}

/// Seconds that the light will take, from a tenth of its rays on the spline and on facets of the middle tolerance.
fn pilot(workshop: &dyn Workshop, bound: &BoundScene, run: &RunSettings, tolerances: &[f64]) -> f64 {
    let Some(&middle) = tolerances.get(tolerances.len() / 2) else { return 0.0 };
    let few = RunSettings { rays: run.rays.div_ceil(10), path_samples: 0, ..run.clone() };
    let more = run.rays as f64 / few.rays.max(1) as f64;
    let seconds = |who: &dyn Intersector| simulate(bound, who, &few, &|_| true).seconds.trace * more;
    // Once untimed: threads and caches are cold.
    seconds(workshop.exact());
    let spline = seconds(workshop.exact());
    let start = Instant::now();
    let meshed = workshop.mesh([middle; 2]);
    let (prepare, traced) = with_all(workshop, &meshed.mesh, &[Tree::Octree], &KINDS, |trees| {
        let prepare = start.elapsed().as_secs_f64();
        (prepare, trees.iter().map(|t| seconds(t.2)).sum::<f64>())
    });
    spline + (prepare + traced) * tolerances.len() as f64
}

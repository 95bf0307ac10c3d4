//! The accuracy study of a scene: the sweep over its model, then what facets do to its light.

use super::accuracy::{self, Accuracy};
use super::workshop::Workshop;
use super::{Progress, receivers};
use crate::intersect::NormalMode;
use crate::simulate::{BoundScene, RunSettings, simulate};
use std::time::Instant;

/// Kinds of normals that the receivers are asked about.
const KINDS: [NormalMode; 4] = [NormalMode::Flat, NormalMode::Bilinear, NormalMode::Cubic, NormalMode::Exact];

/// Sweeps a model, then traces its light on facets of every uniform tolerance of the sweep and on the spline.
pub fn accuracy_of_scene(
    name: &str,
    workshop: &dyn Workshop,
    (bound, run): (&BoundScene, &RunSettings),
    settings: &accuracy::Settings,
    progress: &(dyn Fn(Progress) + Sync),
) -> (Accuracy, Vec<receivers::Row>) {
    let begun = Instant::now();
    let uniform = settings.tolerances.iter().filter(|t| t[0] == t[1]);
    let combinations: Vec<(f64, NormalMode)> = uniform.flat_map(|t| KINDS.map(|n| (t[0], n))).collect();
    // A tenth of the rays on the spline tells what the runs on facets will take, within the factor that a forecast may miss.
    let few = RunSettings { rays: run.rays.div_ceil(10), path_samples: 0, ..run.clone() };
    let pilot = simulate(bound, workshop.exact(), &few, &|_| true);
    let each = pilot.seconds.trace * run.rays as f64 / few.rays.max(1) as f64;
    let settings = accuracy::Settings { seconds_after: each * (combinations.len() + 1) as f64, ..settings.clone() };
    let study = accuracy::accuracy(name, workshop, &settings, progress);
    let rows = receivers::receivers(name, bound, workshop, &combinations, run, (begun, progress));
    (study, rows)
}

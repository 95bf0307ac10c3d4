//! What each effect costs: the smallest kernel a scene calls for, each other effect added alone, and everything together.

use super::timing::Clock;
use super::{Progress, Rounds, Timing};
use crate::intersect::Intersector;
use crate::optics::{Effect, Effects};
use crate::simulate::{BoundScene, KernelChoice, Results, RunSettings, kernel_name, simulate};
use serde::Serialize;
use std::sync::Mutex;

/// One choice of effects on one scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    /// Name of the scene.
    pub scene: String,
    /// `pruned`, `with` one effect more, or `full`.
    pub choice: String,
    /// The effect that the scene does not call for and the kernel could do all the same, where it is a single one.
    pub added: Option<&'static str>,
    /// Name of the kernel. Choices that need the same kernel share its times: they are the same code.
    pub kernel: String,
    /// Effects that the kernel was requested to support.
    pub effects: Vec<&'static str>,
    /// Rays from the sources.
    pub rays: u64,
    /// Seconds of the fastest run.
    pub seconds_trace_min: f64,
    /// Seconds of the middle run.
    pub seconds_trace_median: f64,
    /// Seconds that 90 % of the runs stayed below.
    pub seconds_trace_p90: f64,
    /// Million rays from the sources a second, of the middle run.
    pub mrays_per_s_median: f64,
    /// Time over that of the pruned kernel.
    pub ratio_to_pruned: f64,
    /// Whether the digest of all tallies equals that of the pruned run.
    pub identical: bool,
}

/// Times the kernel pruned for a scene, those with one further effect each, and the full one, in alternating rounds, and compares their
/// results with the pruned kernel's, bit by bit. Rows come in this order; choices that end at one kernel share its times. Calls `progress`
/// after each round.
pub fn effects(
    name: &str,
    (bound, settings): (&BoundScene, &RunSettings),
    intersector: &dyn Intersector,
    rounds: usize,
    progress: &(dyn Fn(Progress) + Sync),
) -> Vec<Row> {
    let clock = Clock::new(progress);
    let needed = Effects::required_by(bound);
    let with = |kernel| RunSettings { kernel, ..settings.clone() };
    let mut choices = vec![("pruned", None, KernelChoice::Pruned)];
    let others = Effect::ALL.into_iter().filter(|e| !needed.contains(*e));
    choices.extend(others.map(|e| ("with", Some(e), KernelChoice::With([e].into()))));
    choices.push(("full", None, KernelChoice::Full));
    let mut kernels: Vec<(&'static str, RunSettings, Mutex<Option<Results>>)> = Vec::new();
    for (_, _, kernel) in &choices {
        let run = with(*kernel);
        let called = kernel_name(bound, &run);
        // Several choices may call for one kernel: it is timed once.
        if kernels.iter().all(|(known, ..)| *known != called) {
            kernels.push((called, run, Mutex::new(None)));
        }
    }
    let mut race = Rounds::default();
    for (called, run, slot) in &kernels {
        // Results are kept beside the clock: a run for the digest alone would double the study.
        race.add(*called, move || {
            let result = simulate(bound, intersector, run, &|_| true);
            if let Ok(mut slot) = slot.lock() {
                *slot = Some(result);
            }
        });
    }
    let timings = race.run_telling(rounds, |share| clock.report(name, share));
    let ran = |run: &RunSettings| -> Option<(Timing, &'static str, u64, String)> {
        let called = kernel_name(bound, run);
        let k = kernels.iter().position(|(known, ..)| *known == called)?;
        let result = kernels[k].2.lock().ok()?;
        let result = result.as_ref()?;
        Some((timings[k].1, called, result.rays, result.digest.clone()))
    };
    let Some((base, _, _, digest)) = ran(&with(KernelChoice::Pruned)) else { return Vec::new() };
    let row = |(choice, added, kernel): &(&str, Option<Effect>, KernelChoice)| {
        let (t, called, rays, own) = ran(&with(*kernel))?;
        let able = match kernel {
            // The requested effects, which may be fewer than the kernel supports.
            KernelChoice::Full => Effects::ALL,
            _ => added.map_or(needed, |e| needed.with_effect(e)),
        };
        Some(Row {
            scene: name.into(),
            choice: (*choice).into(),
            added: added.map(Effect::name),
            kernel: called.into(),
            effects: able.iter().map(Effect::name).collect(),
            rays,
            seconds_trace_min: t.min,
            seconds_trace_median: t.median,
            seconds_trace_p90: t.p90,
            mrays_per_s_median: rays as f64 / t.median / 1e6,
            ratio_to_pruned: t.median / base.median,
            identical: own == digest,
        })
    };
    choices.iter().filter_map(row).collect()
}

/// Writes one sentence: what the effects that the scene does not call for would cost; empty for fewer than two rows.
pub fn answer(rows: &[Row]) -> String {
    let [pruned, .., full] = rows else { return String::new() };
    format!(
        "Leaving out the effects that the scene {} does not need makes the trace **{:.2} times** as fast (the kernel '{}' against the \
         kernel '{}', which could trace every effect); the results are {}.",
        pruned.scene,
        full.ratio_to_pruned,
        pruned.kernel,
        full.kernel,
        if rows.iter().all(|r| r.identical) { "the same, bit by bit" } else { "NOT the same" }
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::octree::{self, Octree};
    use crate::mesh::FacetMesh;
    use crate::model::Model;
    use crate::simulate::Scene;
    use std::path::Path;

    /// A round takes as long as all kernels together, minutes on a large scene.
    #[test]
    fn each_round_is_told() {
        let scene = Scene::parse("[run]\nrays = 100\n[[source]]\n", "s.toml", Path::new(".")).unwrap();
        let bound = scene.bind(&Model::default()).unwrap();
        let mesh = FacetMesh::default();
        let nothing = Octree::build(&mesh, &octree::Settings::default());
        let told = Mutex::new(Vec::new());
        let tell = |progress: Progress| told.lock().unwrap().push((progress.stage, progress.done));
        let rows = effects("dark", (&bound, &RunSettings::from(&scene.run)), &nothing, 3, &tell);
        assert!(rows.len() >= 2 && rows.iter().all(|row| row.identical), "{rows:?}");
        // One round more than those that are timed.
        let shares = [0.25, 0.5, 0.75, 1.0].map(|share| ("dark".to_owned(), share));
        assert_eq!(told.into_inner().unwrap(), shares);
    }
}

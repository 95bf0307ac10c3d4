//! What unneeded effects cost: the smallest kernel a scene calls for against the one that can do everything.

use super::Rounds;
use crate::intersect::Intersector;
use crate::simulate::{BoundScene, KernelChoice, RunSettings, simulate};
use serde::Serialize;
use std::sync::Mutex;

/// One kernel on one scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    /// Name of the scene.
    pub scene: String,
    /// `pruned` or `full`.
    pub choice: String,
    /// Name of the kernel that ran.
    pub kernel: String,
    /// Effects simulated.
    pub effects: Vec<String>,
    /// Rays from the sources.
    pub rays: u64,
    /// Fastest run.
    pub seconds_trace_min: f64,
    /// Middle run.
    pub seconds_trace_median: f64,
    /// 90 % of the runs were faster.
    pub seconds_trace_p90: f64,
    /// Million rays from the sources a second, of the middle run.
    pub mrays_per_s_median: f64,
    /// Whether the digest of all tallies equals that of the pruned run.
    pub identical: bool,
}

/// Times both kernels in alternating rounds and compares their results bit by bit.
pub fn effects(
    name: &str,
    bound: &BoundScene,
    who: &dyn Intersector,
    settings: &RunSettings,
    rounds: usize,
) -> Vec<Row> {
    let choices = [("pruned", KernelChoice::Pruned), ("full", KernelChoice::Full)];
    let results = [Mutex::new(None), Mutex::new(None)];
    let mut race = Rounds::default();
    for ((label, kernel), slot) in choices.into_iter().zip(&results) {
        let settings = RunSettings { kernel, ..settings.clone() };
        race.add(label, move || {
            let result = simulate(bound, who, &settings, &|_| true);
            if let Ok(mut slot) = slot.lock() {
                *slot = Some(result);
            }
        });
    }
    let timings = race.run(rounds);
    let results: Vec<_> = results.into_iter().filter_map(|r| r.into_inner().ok().flatten()).collect();
    let reference = results.first().map(|r| r.digest.clone());
    let row = |((label, t), r): ((String, super::Timing), &crate::simulate::Results)| Row {
        scene: name.into(),
        choice: label,
        kernel: r.effects.kernel.into(),
        effects: r.effects.simulated.iter().map(|e| format!("{:?}", e.effect)).collect(),
        rays: r.rays,
        seconds_trace_min: t.min,
        seconds_trace_median: t.median,
        seconds_trace_p90: t.p90,
        mrays_per_s_median: r.rays as f64 / t.median / 1e6,
        identical: reference.as_ref() == Some(&r.digest),
    };
    timings.into_iter().zip(&results).map(row).collect()
}

/// One sentence: what the effects that the scene does not call for would cost.
pub fn answer(rows: &[Row]) -> String {
    match rows {
        [pruned, full, ..] => format!(
            "Leaving out the effects that the scene {} does not need makes the trace **{:.2} times** as fast (the kernel '{}' against the \
             kernel '{}', which could trace every effect); the results are {}.",
            pruned.scene,
            full.seconds_trace_median / pruned.seconds_trace_median,
            pruned.kernel,
            full.kernel,
            if full.identical { "the same, bit by bit" } else { "NOT the same" }
        ),
        _ => String::new(),
    }
}

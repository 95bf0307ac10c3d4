//! Proofs and prices of leaving effects out.

use super::bind::BoundScene;
use super::effects;
use super::results::Results;
use super::run::{KernelChoice, Progress, RunSettings, simulate};
use crate::intersect::Intersector;
use crate::optics::{Effect, Effects};
use serde::Serialize;

/// Whether the pruned and the full kernel gave the same bits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// Every tally is the same, bit by bit.
    pub identical: bool,
    /// The pruned kernel.
    pub pruned: &'static str,
    /// The full kernel.
    pub full: &'static str,
    /// Seconds of the pruned kernel.
    pub seconds_pruned: f64,
    /// Seconds of the full kernel.
    pub seconds_full: f64,
    /// Tallies that differ, at most 20.
    pub differing: Vec<String>,
}

/// Runs a scene with the pruned and with the full kernel and compares every tally.
pub fn verify_pruning(
    bound: &BoundScene,
    intersector: &dyn Intersector,
    settings: &RunSettings,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> (Results, Verification) {
    let with = |kernel| simulate(bound, intersector, &RunSettings { kernel, ..settings.clone() }, progress);
    let (pruned, full) = (with(KernelChoice::Pruned), with(KernelChoice::Full));
    let differing = compare(bound, &pruned, &full);
    let verification = Verification {
        identical: pruned.tallies == full.tallies && pruned.digest == full.digest,
        pruned: pruned.effects.kernel,
        full: full.effects.kernel,
        seconds_pruned: pruned.seconds.trace,
        seconds_full: full.seconds.trace,
        differing,
    };
    (pruned, verification)
}

fn compare(bound: &BoundScene, a: &Results, b: &Results) -> Vec<String> {
    let (a, b) = (&a.tallies, &b.tallies);
    let mut found = Vec::new();
    let names = ["emitted", "received", "absorbed", "escaped", "cut off", "lost"];
    found.extend(
        names.iter().zip(a.ends.iter().zip(&b.ends)).filter(|(_, (x, y))| x != y).map(|(n, _)| n.to_string()),
    );
    for (r, (x, y)) in bound.receivers.iter().zip(a.cells.iter().zip(&b.cells)) {
        let cells = (0..x.len()).filter(|&i| x[i] != y[i]);
        found.extend(cells.take(5).map(|i| format!("receiver '{}', cell {i}", r.name)));
    }
    let faces = (0..a.faces.len()).filter(|&i| a.faces[i] != b.faces[i]);
    found.extend(faces.take(5).map(|i| format!("absorbed on face {i}")));
    if a.counts != b.counts {
        found.push(format!("counts: {:?} and {:?}", a.counts, b.counts));
    }
    found.truncate(20);
    found
}

/// What a set of effects costs on a scene, whether it needs them or not.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectCost {
    /// The effects that the kernel could do beyond what the scene calls for.
    pub effects: Vec<Effect>,
    /// Name of the kernel.
    pub kernel: &'static str,
    /// Median seconds of tracing.
    pub seconds_trace_median: f64,
    /// Million rays per second, median.
    pub mrays_per_s_median: f64,
    /// Whether every tally is that of the pruned kernel, bit by bit.
    pub identical: bool,
}

/// Times the pruned kernel, then each effect added alone, then all: `repeats` runs of each, in turns so that a machine that slows
/// down slows down all of them.
pub fn effect_costs(
    bound: &BoundScene,
    intersector: &dyn Intersector,
    settings: &RunSettings,
    repeats: usize,
) -> Vec<EffectCost> {
    let needed = effects::required(bound).effects;
    let mut added: Vec<Effects> = vec![Effects::NONE];
    added.extend(Effect::ALL.into_iter().filter(|e| !needed.contains(*e)).map(|e| Effects::from([e])));
    added.push(Effects::ALL - needed);
    let mut seconds = vec![Vec::new(); added.len()];
    let mut last: Vec<Option<Results>> = vec![None; added.len()];
    for _ in 0..repeats.max(1) {
        for (i, &effects) in added.iter().enumerate() {
            let kernel = if effects.is_empty() { KernelChoice::Pruned } else { KernelChoice::With(effects) };
            let results = simulate(bound, intersector, &RunSettings { kernel, ..settings.clone() }, &|_| true);
            seconds[i].push(results.seconds.trace);
            last[i] = Some(results);
        }
    }
    let pruned = last[0].as_ref().map(|r| r.digest.clone());
    let rows = added.iter().zip(seconds).zip(&last);
    rows.filter_map(|((effects, mut seconds), last)| {
        let last = last.as_ref()?;
        seconds.sort_by(f64::total_cmp);
        let median = seconds[seconds.len() / 2];
        Some(EffectCost {
            effects: effects.iter().collect(),
            kernel: last.effects.kernel,
            seconds_trace_median: median,
            mrays_per_s_median: last.rays as f64 / median / 1e6,
            identical: Some(&last.digest) == pruned.as_ref(),
        })
    })
    .collect()
}

//! The proof that leaving effects out changes nothing.

use super::bind::BoundScene;
use super::hooks::Progress;
use super::results::Results;
use super::run::{prepare, simulate};
use super::settings::{KernelChoice, RunSettings};
use crate::intersect::Intersector;
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

/// Runs a scene with the pruned and with the full kernel and compares every sum; returns the results of the pruned one. `progress` hears of
/// both runs, and must end neither.
pub fn verify_pruning(
    bound: &BoundScene,
    intersector: &dyn Intersector,
    settings: &RunSettings,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> (Results, Verification) {
    // Prepared first, so that both runs find the intersector in the same state and their times compare.
    prepare(bound, intersector, settings);
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

/// Names the ends, cells of receivers, absorbed powers of faces and counts that differ between two runs, twenty at most; where it is
/// none of these, that others differ.
fn compare(bound: &BoundScene, a: &Results, b: &Results) -> Vec<String> {
    let (a, b) = (&a.tallies, &b.tallies);
    let mut found = Vec::new();
    let names = ["emitted", "received", "absorbed", "escaped", "cut off", "lost"];
    found.extend(
        names.iter().zip(a.ends.iter().zip(&b.ends)).filter(|(_, (x, y))| x != y).map(|(n, _)| n.to_string()),
    );
    for (r, (x, y)) in bound.receivers.iter().zip(a.cells.iter().zip(&b.cells)) {
        let cells = (0..x.len()).filter(|&i| x[i] != y[i]);
        // A few of each kind: one fault mostly shows in many cells.
        found.extend(cells.take(5).map(|i| format!("receiver '{}', cell {i}", r.name)));
    }
    let faces = (0..a.faces.len()).filter(|&i| a.faces[i] != b.faces[i]);
    found.extend(faces.take(5).map(|i| format!("absorbed on face {i}")));
    if a.counts != b.counts {
        found.push(format!("counts: {:?} and {:?}", a.counts, b.counts));
    }
    if found.is_empty() && a != b {
        found.push("sums beside these: of media, moments, channels, sequences or paths".into());
    }
    found.truncate(20);
    found
}

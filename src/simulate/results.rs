//! What a simulation found out, in the units of the scene; it serialises to the `trace --json` object.

use super::bind::BoundScene;
use super::digest::digest;
use super::dispatch::kernel_kind;
use super::effects::{EffectReason, RequiredEffects};
use super::face_results::FaceResults;
use super::hooks::TracedRun;
use super::outcome::{Counts, LostRay, PathVertex};
use super::plan::Plan;
use super::power_scale::{HALF_QUANTUM, PowerScale};
use super::receiver::Receiver;
use super::receiver_results::{ReceiverResult, unseen_light_notes};
use super::seconds::Seconds;
use super::sequence_results::{ReceiverSequences, cut_sequences_note};
use super::settings::RunSettings;
use super::tallies::Tallies;
use super::tally::Sum;
use crate::intersect::Cost;
use serde::Serialize;

/// Rates are reported in millions.
const MILLION: f64 = 1e6;

/// Results of a simulation.
///
/// Powers are in the unit of the sources (watts or lumens).
#[derive(Clone, Debug, Serialize)]
pub struct Results {
    /// Rays that left the sources.
    pub rays: u64,
    /// Replicates of the run, whose spread the statistical errors are.
    pub replicates: u32,
    /// Power of a ray, as it leaves, of the source whose rays carry most.
    pub heaviest_ray: f64,
    /// Seconds of each stage; all but `trace` are filled in by the caller that read and built the scene.
    pub seconds: Seconds,
    /// Nearest-hit queries of all rays.
    pub segments: u64,
    /// Million rays from the sources per second of `trace`.
    pub mrays_per_s: f64,
    /// Million segments per second of `trace`.
    pub msegments_per_s: f64,
    /// Threads used; of a merged run those of the part that had most.
    pub threads: usize,
    /// What was simulated and what not.
    pub effects: EffectsUsed,
    /// What a reader must know: bodies that are open, light beyond the wavelengths of a table.
    pub notes: Vec<String>,
    /// Where the power went.
    pub power: Power,
    /// Standard errors of [`Results::power`] from the spread of the rays; 0 for what was emitted, which is known.
    pub power_errors: Power,
    /// Paths that were lost.
    pub lost_rays: u64,
    /// Paths that a limit cut off.
    pub cut_off_rays: u64,
    /// Paths cut off because they went round by total reflection without end; counted in `cut_off_rays` too.
    pub caught_rays: u64,
    /// As [`Counts::corrected_normals`].
    pub corrected_normals: u64,
    /// Power absorbed by each instance on its faces, and in each medium.
    pub absorbed: Vec<Absorbed>,
    /// The receivers in the order of the scene.
    pub receivers: Vec<ReceiverResult>,
    /// For each receiver the ways that light took to it; empty where the scene does not ask for them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sequences: Vec<ReceiverSequences>,
    /// Power that faces absorbed and transmitted, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub faces: Option<FaceResults>,
    /// Whether the run is divided into replicates of a fixed size, so that further ones may follow; it decides which ray bears which
    /// number.
    #[serde(skip)]
    pub grows: bool,
    /// Lost rays of the lowest index, at most 1000.
    #[serde(skip)]
    pub ledger: Vec<LostRay>,
    /// Recorded paths, vertex by vertex.
    #[serde(skip)]
    pub paths: Vec<PathVertex>,
    /// Work of the intersector.
    #[serde(skip)]
    pub cost: Cost,
    /// The raw sums, to be merged with those of other shards.
    #[serde(skip)]
    pub tallies: Tallies,
    /// Power of a quantum, in the unit of the sources.
    #[serde(skip)]
    pub quantum: f64,
    /// Hash of the sums and counts that make the figures; runs with the same sums have the same. Lost rays and paths have no part in it.
    pub digest: String,
}

/// What was simulated and what not, each with the reason.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectsUsed {
    /// The effects that were simulated.
    pub simulated: Vec<EffectReason>,
    /// The effects that were not simulated.
    pub not_simulated: Vec<EffectReason>,
    /// The kernel that was picked.
    pub kernel: &'static str,
}

/// Where the power went. `emitted` is the sum of the others to the last quantum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Power {
    /// Emitted by all sources.
    pub emitted: f64,
    /// Ended on receivers that end light, or in a far field.
    pub received: f64,
    /// Absorbed in faces and media.
    pub absorbed: f64,
    /// Escaped out of the scene, past every receiver.
    pub escaped: f64,
    /// Left on paths that a limit cut off.
    pub cut_off: f64,
    /// Left on paths that were lost.
    pub lost: f64,
}

impl Power {
    /// Names the six ends in the order of the tallies.
    fn from_ends([emitted, received, absorbed, escaped, cut_off, lost]: [f64; 6]) -> Self {
        Self { emitted, received, absorbed, escaped, cut_off, lost }
    }

    /// Returns what does not add up, as a share of what was emitted; not a number where nothing was.
    pub fn imbalance(&self) -> f64 {
        let sum = self.received + self.absorbed + self.escaped + self.cut_off + self.lost;
        (self.emitted - sum).abs() / self.emitted
    }
}

/// Power absorbed by one instance or medium.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Absorbed {
    /// Instance, or the instance that holds the medium.
    pub name: String,
    /// `faces` or the name of the medium.
    pub r#in: String,
    /// Power.
    pub power: f64,
    /// Its standard error.
    pub error: f64,
    /// Its place in [`Tallies::model_sums`].
    #[serde(skip)]
    pub index: usize,
}

impl Results {
    /// Makes the results of a run, or of the part of it that was traced: powers are scaled to what all sources emit. Stages other than
    /// `trace` have 0 seconds.
    pub fn new(bound: &BoundScene, settings: &RunSettings, traced: TracedRun) -> Self {
        let plan = Plan::new(bound, settings);
        let required = RequiredEffects::new(bound);
        let TracedRun { partial, cost, threads } = traced;
        let trace = partial.seconds;
        let mut tallies = partial.tallies;
        let quantum = scaled_quantum(&plan, &tallies.ends[0]);
        let Counts { rays, segments, corrected_normals, lost, cut_off, caught, .. } = tallies.counts;
        let mut notes = notes_of_run(bound, &plan, &partial.done, &tallies);
        let scale = PowerScale { quantum, replicates: partial.done.len() as u32, rays };
        let receiver = |(i, r): (usize, &Receiver)| {
            ReceiverResult::new(r, i, &tallies, (&scale, plan.heaviest_ray()), bound.scene.run.unit)
        };
        let receivers: Vec<ReceiverResult> = bound.receivers.iter().enumerate().map(receiver).collect();
        notes.extend(unseen_light_notes(&receivers));
        let power = tallies.ends.each_ref().map(|s| scale.power(s));
        let errors = tallies.ends.each_ref().map(|s| scale.error(s));
        let digest = digest(&tallies);
        Self {
            rays,
            replicates: tallies.replicates,
            heaviest_ray: plan.heaviest_ray() * quantum,
            seconds: Seconds { trace, ..Seconds::default() },
            segments,
            mrays_per_s: rays as f64 / trace / MILLION,
            msegments_per_s: segments as f64 / trace / MILLION,
            threads,
            effects: EffectsUsed {
                simulated: required.simulated.clone(),
                not_simulated: required.not_simulated.clone(),
                kernel: kernel_kind(bound, settings).name(),
            },
            notes,
            power: Power::from_ends(power),
            power_errors: Power { emitted: 0.0, ..Power::from_ends(errors) },
            lost_rays: lost,
            cut_off_rays: cut_off,
            caught_rays: caught,
            corrected_normals,
            absorbed: absorbed_by(bound, &tallies, &scale),
            receivers,
            sequences: sequences(bound, &tallies, &scale),
            faces: bound.counts_faces().then(|| FaceResults::new(bound, &tallies, &scale)),
            grows: plan.grows(),
            ledger: std::mem::take(&mut tallies.ledger),
            paths: std::mem::take(&mut tallies.paths).into_vertices(),
            cost,
            tallies,
            quantum,
            digest,
        }
    }

    /// Returns what rounding to whole quanta may change of a power that every ray adds to: the same share of all light, however many rays
    /// are traced.
    pub(crate) fn rounding(&self) -> f64 {
        HALF_QUANTUM * self.rays as f64 * self.quantum
    }
}

/// Returns the power of a quantum with which the sums of a run, or of a part of it, stand for the light of all sources; `emitted` is what
/// left these.
fn scaled_quantum(plan: &Plan, emitted: &Sum) -> f64 {
    // A run that was stopped early, or is one shard of many, answers for the rays it traced.
    let traced = emitted.total as f64 * plan.quantum;
    if traced > 0.0 && plan.grows() {
        // From the sums alone, so that it does not matter which of its parts gave the size of the run.
        plan.emitted / emitted.total as f64
    } else if traced > 0.0 {
        plan.quantum * plan.emitted / traced
    } else {
        plan.quantum
    }
}

/// Returns the notes of a run whose replicates `done` were traced.
fn notes_of_run(bound: &BoundScene, plan: &Plan, done: &[u32], tallies: &Tallies) -> Vec<String> {
    let counts = &tallies.counts;
    // In this order notes are read: what the scene says of itself, what the run found, what the errors are worth.
    let scene = bound.notes.iter().cloned();
    let bodies = bound.overlap_note(counts).into_iter().chain(bound.repair_notes(counts));
    let found = bodies
        .chain(bound.flush_sources_note(counts, plan, done))
        .chain(bound.lost_note(counts.lost, &tallies.ledger))
        .chain(bound.scarce_sources_note(plan))
        .chain(bound.heavy_rays_note(plan, done))
        .chain(bound.short_lists_note(plan, done))
        .chain(bound.rounded_sources_note(plan))
        .chain(bound.uncounted_light_notes(&tallies.receivers))
        .chain(cut_sequences_note(&tallies.sequences))
        .chain(few_replicates(tallies.replicates));
    scene.chain(found).collect()
}

/// Returns a table of sequences for each receiver; none where the scene does not ask for them.
fn sequences(bound: &BoundScene, tallies: &Tallies, scale: &PowerScale) -> Vec<ReceiverSequences> {
    let receivers = if bound.scene.run.sequences > 0 { bound.receivers.len() } else { 0 };
    (0..receivers as u32).map(|r| ReceiverSequences::new(bound, tallies, r, scale)).collect()
}

/// Student's t for 95 % with 1 to 10 degrees of freedom.
const STUDENT: [f64; 10] = [12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23];

/// Returns a sentence on what errors from 1 to 11 replicates mean; `None` for others. Of 200 runs with two, 151 lay within two errors.
fn few_replicates(replicates: u32) -> Option<String> {
    if replicates == 1 {
        return Some(
            "one replicate alone has no spread to work out errors from: 100 % of every power and half of every \
             receiver are stated; trace more rays"
                .into(),
        );
    }
    let t = STUDENT.get(replicates.checked_sub(2)? as usize)?;
    Some(format!(
        "errors are worked out from {replicates} replicates alone, so that the truth lies within {t} of them in 95 % of runs, not within 2"
    ))
}

/// Returns the power that the faces of each instance, then the medium of each body, have taken, with its statistical error. Those that took
/// none are left out; [`Absorbed::index`] counts them too.
fn absorbed_by(bound: &BoundScene, tallies: &Tallies, scale: &PowerScale) -> Vec<Absorbed> {
    let faces = bound.instances.iter().map(|name| (name.as_str(), "faces"));
    // Media and faces apart: who tunes an absorption needs the one, who chooses a paint the
    // other.
    let bulk = bound.bodies.iter().map(|b| (b.name.as_str(), b.medium.as_str()));
    let result = |(index, ((name, r#in), s)): (usize, ((&str, &str), &Sum))| Absorbed {
        name: name.into(),
        r#in: r#in.into(),
        power: scale.power(s),
        error: scale.error(s),
        index,
    };
    let places = faces.chain(bulk).zip(tallies.model_sums()).enumerate();
    places.filter(|(_, (_, s))| s.total > 0).map(result).collect()
}

//! A run taken apart into its replicates: what each of them brought to every receiver and every cell.

use crate::intersect::Intersector;
use crate::simulate::{BoundScene, Hooks, Moments, ReplicateTally, Results, RunSettings, replicates, trace};
use std::sync::Mutex;

/// Cells of a receiver up to which each replicate's are kept apart: 128 MB of sums, and a tenth of a second for all replicates.
pub(in crate::study) const MOST_CELLS: usize = 1 << 22;

/// Quanta that a replicate left in a face, took into its body through it, and out.
pub(super) type FaceQuanta = [u64; 3];

/// What a replicate brought to the faces that it reached, by rising face.
type FaceSums = Vec<(u32, FaceQuanta)>;

/// What one replicate brought to one receiver: quanta, and their moments in half sides.
#[derive(Clone, Debug, Default)]
pub(in crate::study) struct ReplicateSums {
    pub(in crate::study) power: u128,
    pub(in crate::study) first: [f64; 2],
    pub(in crate::study) second: [f64; 2],
    /// The cells that it reached, rising, with their quanta: of power, then of each further channel.
    pub(in crate::study) layers: Vec<Vec<(u32, u64)>>,
    /// Quanta of each further channel.
    pub(in crate::study) channels: Vec<u128>,
}

/// Results of a run with what each replicate brought: `replicates[replicate][receiver]`.
pub(in crate::study) struct ReplicatedRun {
    pub(in crate::study) results: Results,
    pub(in crate::study) replicates: Vec<Vec<ReplicateSums>>,
    /// What each replicate brought to the faces that it reached, where the scene asks for that.
    pub(super) faces: Vec<FaceSums>,
    /// What each replicate brought to bodies and media, as places of [`Tallies::model_sums`](crate::simulate::Tallies::model_sums), rising,
    /// with quanta.
    pub(super) model_quanta: Vec<Vec<(u32, u64)>>,
    /// What of each replicate was received, absorbed, escaped and was cut off, quanta.
    pub(super) ends: Vec<[u64; 4]>,
}

/// What one replicate brought to the receivers, to the faces, and to bodies and media.
#[derive(Clone, Debug, Default)]
struct Brought {
    receivers: Vec<ReplicateSums>,
    faces: FaceSums,
    model_quanta: Vec<(u32, u64)>,
    ends: [u64; 4],
}

/// Cells of a receiver that are kept apart.
#[derive(Clone, Copy)]
struct KeptCells {
    /// Cells of one layer.
    cells: usize,
    /// Further channels.
    channels: usize,
    /// Power and further channels; none of grids that are too large, or power alone.
    layers: usize,
}

impl KeptCells {
    /// Keeps power and channels apart, power alone where all together are more than [`MOST_CELLS`], or nothing where power alone is.
    fn new(cells: usize, channels: usize) -> Self {
        let fits = |layers: usize| cells * layers <= MOST_CELLS;
        // Power alone where all channels together are too many.
        let layers = if fits(1 + channels) { 1 + channels } else { usize::from(fits(1)) };
        Self { cells, channels, layers }
    }

    /// Returns what a finished replicate brought to receiver `k`, whose cells these are.
    fn sums(&self, k: usize, tally: &ReplicateTally) -> ReplicateSums {
        let moments = tally.moments(k);
        let first = moments.first.map(|sum| sum as f64 / Moments::GRAIN);
        let second = moments.second.map(|sum| sum as f64 / Moments::GRAIN);
        let mut layers = vec![Vec::new(); self.layers];
        let mut channels = vec![0; self.channels];
        for (cell, quanta) in tally.cells(k) {
            let layer = cell / self.cells;
            if layer > 0 {
                channels[layer - 1] += quanta;
            }
            if let Some(reached) = layers.get_mut(layer) {
                reached.push(((cell % self.cells) as u32, word_of_quanta(quanta)));
            }
        }
        layers.iter_mut().for_each(|reached| reached.sort_unstable());
        ReplicateSums { power: tally.power(k), first, second, layers, channels }
    }
}

impl Brought {
    /// Takes from a finished replicate what it brought. Of cells and faces those alone that it reached: to go through all of them after
    /// each replicate took longer than to trace a pilot.
    fn new(bound: &BoundScene, kept: &[KeptCells], tally: &ReplicateTally) -> Self {
        Self {
            receivers: kept.iter().enumerate().map(|(k, kept)| kept.sums(k, tally)).collect(),
            faces: tally.face_quanta().into_iter().map(|(f, quanta)| (f, quanta.map(word_of_quanta))).collect(),
            model_quanta: tally
                .model_quanta(bound)
                .into_iter()
                .map(|(k, quanta)| (k, word_of_quanta(quanta)))
                .collect(),
            ends: tally.end_quanta(),
        }
    }
}

/// Returns quanta as a word, the largest for more: no comparison of so few rays distinguishes that from more.
fn word_of_quanta(quanta: u128) -> u64 {
    u64::try_from(quanta).unwrap_or(u64::MAX)
}

impl ReplicatedRun {
    /// Drops the cells of its results, which take 56 bytes each: comparisons read those of the replicates.
    pub(super) fn without_cells(mut self) -> Self {
        self.results.tallies.cells = Vec::new();
        for receiver in &mut self.results.receivers {
            (receiver.cells, receiver.errors, receiver.ray_cells) = Default::default();
            receiver.channels.iter_mut().for_each(|c| (c.cells, c.errors) = Default::default());
        }
        self
    }
}

/// Traces a run and keeps what each replicate brought; replicates that were not traced stay empty.
pub(in crate::study) fn trace_replicates(
    bound: &BoundScene,
    intersector: &dyn Intersector,
    settings: &RunSettings,
) -> ReplicatedRun {
    let count = replicates(bound, settings) as usize;
    let kept = bound.receivers.iter().map(|r| KeptCells::new(r.cell_count(), r.channels.count()));
    let kept: Vec<KeptCells> = kept.collect();
    let by_replicate = Mutex::new(vec![Brought::default(); count]);
    let replicate = |replicate: u32, tally: &ReplicateTally| {
        let brought = Brought::new(bound, &kept, tally);
        // A panic elsewhere ends the run anyway; what is there so far is whole.
        by_replicate.lock().unwrap_or_else(|e| e.into_inner())[replicate as usize] = brought;
    };
    let hooks = Hooks { replicate: Some(&replicate), ..Hooks::with_progress(&|_| true) };
    let results = Results::new(bound, settings, trace(bound, intersector, settings, None, &hooks));
    let by_replicate = by_replicate.into_inner().unwrap_or_else(|e| e.into_inner());
    let mut run = ReplicatedRun {
        results,
        replicates: Vec::new(),
        faces: Vec::new(),
        model_quanta: Vec::new(),
        ends: Vec::new(),
    };
    for brought in by_replicate {
        run.replicates.push(brought.receivers);
        run.faces.push(brought.faces);
        run.model_quanta.push(brought.model_quanta);
        run.ends.push(brought.ends);
    }
    run
}

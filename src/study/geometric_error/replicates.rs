//! A run taken apart into its replicates: what each of them brought to every receiver and every cell.

use super::faces::{FaceSums, FaceTotals};
use crate::intersect::Intersector;
use crate::simulate::{BoundScene, Hooks, Moments, PartialRun, Results, RunSettings, Sum, replicates, trace};
use std::sync::Mutex;

/// Cells of a receiver up to which each replicate's are kept apart: 128 MB of sums, and a tenth of a second for all replicates.
pub(in crate::study) const MOST_CELLS: usize = 1 << 22;

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
    /// What each replicate brought to bodies and media, as places of [`Tallies::of_model`](crate::simulate::Tallies::of_model), rising, with
    /// quanta.
    pub(super) of_model: Vec<Vec<(u32, u64)>>,
}

/// What one replicate brought to the receivers, to the faces, and to bodies and media.
#[derive(Clone, Debug, Default)]
struct Brought {
    receivers: Vec<ReplicateSums>,
    faces: FaceSums,
    of_model: Vec<(u32, u64)>,
}

/// The sums of a run after some of its replicates.
#[derive(Default)]
struct Totals {
    done: Vec<u32>,
    power: Vec<u128>,
    moments: Vec<Moments>,
    cells: Vec<Vec<u128>>,
    channels: Vec<Vec<u128>>,
    faces: FaceTotals,
    model: Vec<u128>,
}

/// Cells of a receiver that are kept apart.
#[derive(Clone, Copy)]
struct KeptCells {
    /// Cells of one layer.
    cells: usize,
    /// Power and further channels; none of grids that are too large, or power alone.
    layers: usize,
}

impl KeptCells {
    /// Keeps power and channels apart, power alone where all together are more than [`MOST_CELLS`], or nothing where power alone is.
    fn new(cells: usize, channels: usize) -> Self {
        let fits = |layers: usize| cells * layers <= MOST_CELLS;
        // Power alone where all channels together are too many.
        let layers = if fits(1 + channels) { 1 + channels } else { usize::from(fits(1)) };
        Self { cells, layers }
    }
}

impl Totals {
    /// Takes over the sums of a portion and returns the number of the one replicate that is new in it, with what it brought; `None` where
    /// none is new.
    fn advance(&mut self, portion: &PartialRun, kept: &[KeptCells]) -> Option<(u32, Brought)> {
        // Portions are handed over one replicate at a time; the one that is not yet known is new.
        let new = *portion.done.iter().find(|r| self.done.binary_search(r).is_err())?;
        let tallies = &portion.tallies;
        self.power.resize(tallies.receivers.len(), 0);
        self.moments.resize(tallies.receivers.len(), Moments::default());
        self.cells.resize_with(tallies.receivers.len(), Vec::new);
        self.channels.resize_with(tallies.receivers.len(), Vec::new);
        let sums = (0..tallies.receivers.len()).map(|k| {
            let (power, moments) = (tallies.receivers[k].total, tallies.moments[k]);
            // Exact until the last step: sums of whole numbers.
            let first = [0, 1].map(|a| (moments.first[a] - self.moments[k].first[a]) as f64 / Moments::GRAIN);
            let second = [0, 1].map(|a| (moments.second[a] - self.moments[k].second[a]) as f64 / Moments::GRAIN);
            let KeptCells { cells, layers } = kept[k];
            let before = &mut self.cells[k];
            before.resize(cells * layers, 0);
            let mut reached = vec![Vec::new(); layers];
            for (i, (before, now)) in before.iter_mut().zip(&tallies.cells[k]).enumerate() {
                if *before != now.total {
                    // More than a word holds is told from as much by no comparison of so few rays.
                    let quanta = u64::try_from(now.total - *before).unwrap_or(u64::MAX);
                    reached[i / cells].push(((i % cells) as u32, quanta));
                    *before = now.total;
                }
            }
            let before = &mut self.channels[k];
            before.resize(tallies.channels[k].len(), 0);
            let channel = |(before, now): (&mut u128, &Sum)| now.total - std::mem::replace(before, now.total);
            let channels = before.iter_mut().zip(&tallies.channels[k]).map(channel).collect();
            let brought = ReplicateSums { power: power - self.power[k], first, second, layers: reached, channels };
            self.power[k] = power;
            self.moments[k] = moments;
            brought
        });
        let receivers = sums.collect();
        let mut of_model = Vec::new();
        self.model.resize(tallies.of_model().count(), 0);
        for (i, (before, now)) in self.model.iter_mut().zip(tallies.of_model()).enumerate() {
            if *before != now.total {
                of_model.push((i as u32, (now.total - *before) as u64));
                *before = now.total;
            }
        }
        self.done.clone_from(&portion.done);
        Some((new, Brought { receivers, faces: self.faces.advance(portion), of_model }))
    }
}

/// Traces a run and keeps what each replicate brought, by asking for the sums after each; replicates that were not traced stay empty.
pub(in crate::study) fn trace_replicates(
    bound: &BoundScene,
    intersector: &dyn Intersector,
    settings: &RunSettings,
) -> ReplicatedRun {
    let count = replicates(bound, settings) as usize;
    let kept = bound.receivers.iter().map(|r| KeptCells::new(r.cell_count(), r.channels.count()));
    let kept: Vec<KeptCells> = kept.collect();
    let state = Mutex::new((Totals::default(), vec![Brought::default(); count]));
    let finished = |portion: &PartialRun| {
        // A panic elsewhere ends the run anyway; the sums so far are whole.
        let mut state = state.lock().unwrap_or_else(|e| e.into_inner());
        let (totals, by_replicate) = &mut *state;
        if let Some((new, brought)) = totals.advance(portion, &kept) {
            by_replicate[new as usize] = brought;
        }
    };
    let hooks = Hooks { finished: Some(&finished), ..Hooks::with_progress(&|_| true) };
    let results = Results::new(bound, settings, trace(bound, intersector, settings, None, &hooks));
    let (_, by_replicate) = state.into_inner().unwrap_or_else(|e| e.into_inner());
    let mut run = ReplicatedRun { results, replicates: Vec::new(), faces: Vec::new(), of_model: Vec::new() };
    for brought in by_replicate {
        run.replicates.push(brought.receivers);
        run.faces.push(brought.faces);
        run.of_model.push(brought.of_model);
    }
    run
}

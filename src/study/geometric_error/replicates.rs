//! A run taken apart into its replicates: what each of them brought to every receiver and every cell.

use crate::intersect::Intersector;
use crate::simulate::{BoundScene, Hooks, Moments, PartialRun, Results, RunSettings, replicates, trace};
use std::sync::Mutex;

/// Cells of a receiver up to which each replicate's are kept apart: 128 MB of sums, and a tenth of a second for all replicates.
pub(in crate::study) const MOST_CELLS: usize = 1 << 22;

/// What one replicate brought to one receiver: quanta, and their moments in half sides.
#[derive(Clone, Debug, Default)]
pub(in crate::study) struct ReplicateSums {
    pub(in crate::study) power: u128,
    pub(in crate::study) first: [f64; 2],
    pub(in crate::study) second: [f64; 2],
    /// The cells that it reached, rising, with their quanta.
    pub(in crate::study) cells: Vec<(u32, u64)>,
}

/// Results of a run with what each replicate brought: `replicates[replicate][receiver]`.
pub(in crate::study) struct ReplicatedRun {
    pub(in crate::study) results: Results,
    pub(in crate::study) replicates: Vec<Vec<ReplicateSums>>,
}

/// The sums of a run after some of its replicates.
#[derive(Default)]
struct Totals {
    done: Vec<u32>,
    power: Vec<u128>,
    moments: Vec<Moments>,
    cells: Vec<Vec<u128>>,
}

impl Totals {
    /// Takes over the sums of a portion and gives what the one replicate that is new brought to each receiver.
    fn advance(&mut self, portion: &PartialRun, cells: &[usize]) -> Option<(u32, Vec<ReplicateSums>)> {
        let new = *portion.done.iter().find(|r| self.done.binary_search(r).is_err())?;
        let tallies = &portion.tallies;
        self.power.resize(tallies.receivers.len(), 0);
        self.moments.resize(tallies.receivers.len(), Moments::default());
        self.cells.resize_with(tallies.receivers.len(), Vec::new);
        let sums = (0..tallies.receivers.len()).map(|k| {
            let (power, moments) = (tallies.receivers[k].total, tallies.moments[k]);
            // Exact until the last step: sums of whole numbers.
            let first = [0, 1].map(|a| (moments.first[a] - self.moments[k].first[a]) as f64 / Moments::GRAIN);
            let second = [0, 1].map(|a| (moments.second[a] - self.moments[k].second[a]) as f64 / Moments::GRAIN);
            let before = &mut self.cells[k];
            before.resize(cells[k], 0);
            let mut reached = Vec::new();
            for (i, (before, now)) in (0u32..).zip(before.iter_mut().zip(&tallies.cells[k])) {
                if *before != now.total {
                    reached.push((i, (now.total - *before) as u64));
                    *before = now.total;
                }
            }
            let brought = ReplicateSums { power: power - self.power[k], first, second, cells: reached };
            self.power[k] = power;
            self.moments[k] = moments;
            brought
        });
        let sums = sums.collect();
        self.done.clone_from(&portion.done);
        Some((new, sums))
    }
}

/// Traces a run and keeps what each replicate brought.
pub(in crate::study) fn trace_replicates(
    bound: &BoundScene,
    intersector: &dyn Intersector,
    settings: &RunSettings,
) -> ReplicatedRun {
    let count = replicates(bound, settings) as usize;
    let counted = |cells: usize| if cells <= MOST_CELLS { cells } else { 0 };
    let cells: Vec<usize> = bound.receivers.iter().map(|r| counted(r.cell_count())).collect();
    let state = Mutex::new((Totals::default(), vec![Vec::new(); count]));
    let finished = |portion: &PartialRun| {
        let mut state = state.lock().unwrap_or_else(|e| e.into_inner());
        let (totals, by_replicate) = &mut *state;
        if let Some((new, sums)) = totals.advance(portion, &cells) {
            by_replicate[new as usize] = sums;
        }
    };
    let hooks = Hooks { finished: Some(&finished), ..Hooks::with_progress(&|_| true) };
    let results = Results::new(bound, settings, trace(bound, intersector, settings, None, &hooks));
    let (_, replicates) = state.into_inner().unwrap_or_else(|e| e.into_inner());
    ReplicatedRun { results, replicates }
}

//! Which rays a run traces: how many of each source, in which replicate, of what power, and which of them are recorded.

use super::bind::BoundScene;
use super::settings::RunSettings;
use super::tally::QUANTA;

/// Where one ray in so many and one more is recorded, or fewer, they are traced once more: that costs less than a kernel that records.
const FEW: u64 = 63;

/// How far a ray that escapes is drawn, mm.
const DRAWN_LENGTH: f64 = 100.0;

/// Fewest rays of a replicate, so that a small run still has an error to state.
const FEWEST_RAYS: u64 = 16;

/// Most rays of a replicate, 2^21 or some more, whose quanta a word of 64 bits can hold.
const MOST_RAYS_LOG2: u32 = 21;

/// The rays of one source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SourceShare {
    pub(super) first: u64,
    pub(super) rays: u64,
    pub(crate) quanta: f64,
}

impl SourceShare {
    /// The rays of one of `n` replicates.
    pub(crate) fn range(&self, replicate: u32, n: u32) -> [u64; 2] {
        let at = |k: u32| self.first + (u128::from(self.rays) * u128::from(k) / u128::from(n)) as u64;
        [at(replicate), at(replicate + 1)]
    }
}

/// How the rays of a run are divided among sources and replicates.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) shares: Vec<SourceShare>,
    pub(crate) replicates: u32,
    pub(crate) rays: u64,
    /// Power of a quantum, in the unit of the sources.
    pub(crate) quantum: f64,
    pub(crate) emitted: f64,
    /// Every 2ᵏ-th ray is recorded; none when absent.
    record_mask: Option<u64>,
    /// Every 2ᵏ-th ray is kept where all are recorded.
    sample_mask: Option<u64>,
    /// How far an escaping ray is drawn, mm.
    pub(crate) drawn_length: f64,
}

impl Plan {
    pub(crate) fn new(bound: &BoundScene, settings: &RunSettings) -> Self {
        let emitted: f64 = bound.emitters.iter().map(|e| e.power).sum();
        // Rounded sums, not rounded shares: three equal sources share a million rays without losing one.
        let mut share = 0.0;
        let mut given = 0;
        let counts: Vec<u64> = bound
            .emitters
            .iter()
            .map(|e| {
                share += e.power / emitted;
                let upto = (settings.rays as f64 * share).round() as u64;
                let own = upto.saturating_sub(given);
                given = upto;
                e.rays.unwrap_or(own).max(1)
            })
            .collect();
        let rays: u64 = counts.iter().sum();
        let mut first = 0;
        let shares = bound
            .emitters
            .iter()
            .zip(&counts)
            .map(|(e, &n)| {
                // Each source emits exactly its power: its rays weigh a little more or less than the average one.
                let quanta = (QUANTA * (e.power / emitted) * (rays as f64 / n as f64)).round().max(1.0);
                let share = SourceShare { first, rays: n, quanta };
                first += n;
                share
            })
            .collect();
        let replicates = settings.replicates.clamp(2, (rays / FEWEST_RAYS).clamp(2, 1 << 16) as u32);
        let replicates = replicates.max((rays >> MOST_RAYS_LOG2) as u32);
        let record_mask =
            (settings.path_samples > 0).then(|| (rays / settings.path_samples.min(rays)).next_power_of_two() - 1);
        let quantum = emitted / (rays as f64 * QUANTA);
        Self {
            shares,
            replicates,
            rays,
            quantum,
            emitted,
            record_mask,
            sample_mask: record_mask,
            drawn_length: DRAWN_LENGTH,
        }
    }

    #[inline]
    pub(crate) fn records(&self, ray: u64) -> bool {
        self.record_mask.is_some_and(|m| ray & m == 0)
    }

    /// Has every ray recorded.
    pub(super) fn record_all(&mut self) {
        self.record_mask = Some(0);
    }

    /// Whether any ray is recorded.
    pub(crate) fn records_any(&self) -> bool {
        self.record_mask.is_some()
    }

    /// The plan of the same run that records what this one was to record, where that is few rays; this one then records none.
    pub(super) fn recording(&mut self) -> Option<Self> {
        let few = self.record_mask.is_some_and(|m| m >= FEW);
        few.then(|| {
            let recording = self.clone();
            self.record_mask = None;
            recording
        })
    }

    /// The rays of a replicate that are recorded.
    pub(super) fn recorded(&self, replicate: u32) -> impl Iterator<Item = u64> {
        let recorded_of = move |share: &SourceShare, step: u64| {
            let [from, to] = share.range(replicate, self.replicates);
            (from.next_multiple_of(step)..to).step_by(step as usize)
        };
        let step = self.record_mask.map(|m| m + 1);
        step.into_iter().flat_map(move |step| self.shares.iter().flat_map(move |share| recorded_of(share, step)))
    }

    /// Whether the path of a ray belongs to the sample that is kept.
    pub(crate) fn samples(&self, ray: u64) -> bool {
        self.sample_mask.is_some_and(|m| ray & m == 0)
    }

    /// The source and the replicate of a ray; `None` when the run has no such ray.
    pub(crate) fn locate(&self, ray: u64) -> Option<(usize, u32)> {
        let source = self.shares.iter().position(|s| (s.first..s.first + s.rays).contains(&ray))?;
        let share = &self.shares[source];
        let guess = u128::from(ray - share.first) * u128::from(self.replicates) / u128::from(share.rays);
        let holds = |r: &u32| {
            let [from, to] = share.range(*r, self.replicates);
            (from..to).contains(&ray)
        };
        // Rounding puts the replicate next to the guess.
        let near = (guess as u32).saturating_sub(1)..=(guess as u32).saturating_add(1).min(self.replicates - 1);
        near.into_iter().find(holds).map(|r| (source, r))
    }
}

//! Which rays a run traces: how many of each source, in which replicate, of what power, and which of them are recorded.

use super::bind::BoundScene;
use super::emitter::Emitter;
use super::scene::MOST_RAYS;
use super::settings::RunSettings;
use super::source_share::{SourceShare, weight_among};
use super::tally::QUANTA;

/// Record mask from which on recorded rays are traced a second time: to trace one in 64 or fewer again costs less than to trace every ray
/// with a kernel that records.
const FEW: u64 = 63;

/// Fewest rays of a replicate, so that a small run still has an error to state.
const FEWEST_RAYS: u64 = 16;

/// Most rays of a replicate, 2^21 or some more, whose quanta a word of 64 bits can hold.
const MOST_RAYS_LOG2: u32 = 21;

/// Most quanta of one ray: whole numbers up to 2⁵³ are exact.
const HEAVIEST_RAY: f64 = (1u64 << 53) as f64;

/// Quanta of a ray from which on the rounding of its power is negligible: 5e-10 of it.
const FINE_RAY: f64 = (1u64 << 30) as f64;

/// Most quanta of a replicate, half of what its words of 63 bits hold.
const FULLEST_REPLICATE: f64 = (1u64 << 62) as f64;

/// Bound of the squares of replicates' quanta, 2¹³¹: sums of the squares of moments, a quarter of a quantum each at most, stay below 2¹²⁷.
const SUM_OF_SQUARES: f64 = (1u128 << 127) as f64 * 16.0;

/// Rays of a replicate of a run that can grow: round numbers of rays are whole numbers of replicates, and what a replicate costs
/// beside its rays is below a per cent.
pub const GROWING_REPLICATE: u64 = 5_000;

/// Fewest replicates of a fixed size for which a run is divided into them by default.
const FEWEST_GROWING: u64 = 128;

/// Most sources of a run that is divided into replicates of a fixed size by default: 50 rays each in one of these.
const MOST_SOURCES: usize = 100;

/// How the rays of a run are divided among sources and replicates.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// The rays of each source, in the order of the scene.
    pub(crate) shares: Vec<SourceShare>,
    /// Rays of each replicate of a run that can grow; `None` for one that cannot.
    replicate_rays: Option<u64>,
    /// The first replicate that is asked for.
    pub(crate) first_replicate: u32,
    /// Past the last replicate that is asked for; their number where the first is 0.
    pub(crate) replicates: u32,
    /// Rays of the whole run, of all sources.
    pub(crate) rays: u64,
    /// Power of a quantum, in the unit of the sources.
    pub(crate) quantum: f64,
    /// Quanta of an average ray: [`QUANTA`], or a smaller power of two where sums would not hold as many.
    pub(crate) average_ray: f64,
    /// Power of all sources, in their unit.
    pub(crate) emitted: f64,
    /// Every 2ᵏ-th ray is recorded; none when absent.
    record_mask: Option<u64>,
    /// Every 2ᵏ-th ray is kept where all are recorded.
    sample_mask: Option<u64>,
    /// How far an escaping ray is drawn, mm.
    pub(crate) drawn_length: f64,
}

impl Plan {
    /// Divides the rays of a run among sources, by power, and replicates. Each source has one ray at least, so that the rays of a run may
    /// be more than the settings ask for.
    pub(crate) fn new(bound: &BoundScene, settings: &RunSettings) -> Self {
        let emitted: f64 = bound.emitters.iter().map(|e| e.power).sum();
        let grows = can_grow(bound) && (settings.grows || grows_unasked(settings, bound.emitters.len()));
        let asked = settings.rays.clamp(1, MOST_RAYS);
        // A run that can grow is divided replicate by replicate, source by source within each; any other source by source.
        let counts = rays_of_sources(bound, if grows { GROWING_REPLICATE } else { asked }, emitted);
        let divided: u64 = counts.iter().sum();
        // Each source emits exactly its power: its rays weigh a little more or less than the average one.
        let weight = |(e, &n): (&Emitter, &u64)| (n, (e.power / emitted) * (divided as f64 / n as f64));
        let weights: Vec<(u64, f64)> = bound.emitters.iter().zip(&counts).map(weight).collect();
        // Errors come from the spread of replicates, each of which needs rays enough to be a sample of the whole.
        let replicates = if grows {
            asked.div_ceil(GROWING_REPLICATE) as u32
        } else {
            // At least two, for an error; at most as many as leave each some rays; and enough for the words that
            // count quanta.
            let replicates = settings.replicates.clamp(2, (divided / FEWEST_RAYS).clamp(2, 1 << 16) as u32);
            replicates.max((divided >> MOST_RAYS_LOG2) as u32)
        };
        // What the rays of a source are divided into: one replicate of a run that can grow, else all.
        let parts = if grows { 1 } else { replicates };
        let average_ray = average_quanta(&weights, parts);
        let mut first = 0;
        let share = |(source, &(rays, weight)): (usize, &(u64, f64))| {
            let share = SourceShare::new(source, [first, rays], average_ray * weight, parts);
            first += rays;
            share
        };
        let shares: Vec<SourceShare> = weights.iter().enumerate().map(share).collect();
        let divided_quanta: f64 = shares.iter().map(|share| share.all_quanta(parts)).sum();
        let quantum = emitted / (divided_quanta * f64::from(replicates / parts));
        let first_replicate = if grows { settings.first_ray.div_ceil(GROWING_REPLICATE) as u32 } else { 0 };
        let rays = if grows { divided * u64::from(replicates) } else { divided };
        // A power of two, so that whether a ray is recorded is one `and` of its index.
        let record_mask =
            (settings.path_samples > 0).then(|| (rays / settings.path_samples.min(rays)).next_power_of_two() - 1);
        Self {
            shares,
            replicate_rays: grows.then_some(divided),
            first_replicate,
            replicates,
            rays,
            quantum,
            average_ray,
            emitted,
            record_mask,
            sample_mask: record_mask,
            drawn_length: bound.drawn_length(),
        }
    }

    /// Quanta of a ray of the source whose rays weigh most.
    pub(crate) fn heaviest_ray(&self) -> f64 {
        self.shares.iter().flat_map(|share| share.quanta).fold(0.0, f64::max)
    }

    /// Returns the power that all rays of a source have, of which each is a whole number of quanta, in the unit of the sources.
    pub(crate) fn counted_power(&self, source: usize) -> f64 {
        let parts = if self.grows() { 1 } else { self.replicates };
        self.shares[source].all_quanta(parts) * f64::from(self.replicates / parts) * self.quantum
    }

    /// Whether it is divided into replicates of a fixed size, so that further ones may follow.
    pub(crate) fn grows(&self) -> bool {
        self.replicate_rays.is_some()
    }

    /// Returns the numbers in the run of a source's rays in a replicate: the first, and past the last; equal where it has none.
    pub(crate) fn range(&self, source: usize, replicate: u32) -> [u64; 2] {
        let share = &self.shares[source];
        match self.replicate_rays {
            Some(size) => {
                let first = size * u64::from(replicate) + share.first;
                [first, first + share.rays]
            }
            None => {
                // Without a rest: where a part ends, the next begins.
                [replicate, replicate + 1].map(|part| share.first_in(part, self.replicates))
            }
        }
    }

    /// Returns `[k, n]`: a replicate takes the k-th of n interleaved lattices of places in a ray list. How many replicates a run that grows
    /// will have is not known: each has a lattice of its own there, `[0, 1]`.
    pub(crate) fn lattice(&self, replicate: u32) -> [u32; 2] {
        if self.grows() { [0, 1] } else { [replicate, self.replicates] }
    }

    /// Returns the quanta of each ray of a source in a replicate that has so many of its rays.
    #[inline]
    pub(crate) fn quanta(&self, source: usize, rays: u64) -> f64 {
        let share = &self.shares[source];
        share.quanta[usize::from(rays > share.fewest)]
    }

    /// Goes through the rays of a replicate, each as its source and its number in the run.
    pub(super) fn rays_of_replicate(&self, replicate: u32) -> impl Iterator<Item = (usize, u64)> {
        (0..self.shares.len()).flat_map(move |source| {
            let [from, to] = self.range(source, replicate);
            (from..to).map(move |ray| (source, ray))
        })
    }

    /// Returns the number of rays of a source in the whole run.
    pub(crate) fn rays_of_source(&self, source: usize) -> u64 {
        let rays = self.shares[source].rays;
        if self.grows() { rays * u64::from(self.replicates) } else { rays }
    }

    /// Returns the number of rays of a source in these replicates.
    pub(crate) fn rays_in(&self, source: usize, replicates: &[u32]) -> u64 {
        let rays = |&replicate: &u32| {
            let [from, to] = self.range(source, replicate);
            to - from
        };
        replicates.iter().map(rays).sum()
    }

    /// Whether the path of a ray is recorded as it is traced.
    #[inline]
    pub(crate) fn records(&self, ray: u64) -> bool {
        self.record_mask.is_some_and(|m| ray & m == 0)
    }

    /// Has every ray recorded; the sample that is kept stays the same.
    pub(super) fn record_all(&mut self) {
        self.record_mask = Some(0);
    }

    /// Whether any ray is recorded.
    pub(crate) fn records_any(&self) -> bool {
        self.record_mask.is_some()
    }

    /// Returns a plan of the same run that records what this one was to record, and has this one record none, where that is one ray in 64
    /// or fewer; else returns `None` and changes nothing.
    pub(super) fn take_recording_plan(&mut self) -> Option<Self> {
        let few = self.record_mask.is_some_and(|m| m >= FEW);
        few.then(|| {
            let recording = self.clone();
            self.record_mask = None;
            recording
        })
    }

    /// Returns the rays of a replicate that are recorded, source by source: the number in the run of the first, how far apart they are, and
    /// how many; none where nothing is recorded.
    pub(super) fn recorded_rays(&self, replicate: u32) -> impl Iterator<Item = [u64; 3]> {
        let recorded_of = move |source: usize, step: u64| {
            let [from, to] = self.range(source, replicate);
            let first = from.next_multiple_of(step);
            (first < to).then(|| [first, step, (to - first).div_ceil(step)])
        };
        let step = self.record_mask.map(|m| m + 1);
        step.into_iter()
            .flat_map(move |step| (0..self.shares.len()).filter_map(move |source| recorded_of(source, step)))
    }

    /// Whether the path of a ray belongs to the sample that is kept; the same as [`Self::records`] but where all are recorded.
    pub(crate) fn samples(&self, ray: u64) -> bool {
        self.sample_mask.is_some_and(|m| ray & m == 0)
    }

    /// Returns the source whose share has the ray of this number, in the run or in a replicate of one that can grow.
    fn source_of(&self, number: u64) -> Option<usize> {
        // By halves: there may be thousands.
        let source = self.shares.partition_point(|s| s.first <= number).checked_sub(1)?;
        let share = &self.shares[source];
        (number < share.first + share.rays).then_some(source)
    }

    /// Returns the source and the replicate of a ray, by its number; `None` when the run has no such ray.
    pub(crate) fn locate(&self, ray: u64) -> Option<(usize, u32)> {
        // Ranges of sources and replicates follow each other, so that a ray's number determines both.
        if let Some(size) = self.replicate_rays {
            let replicate = u32::try_from(ray / size).ok().filter(|r| *r < self.replicates)?;
            return Some((self.source_of(ray % size)?, replicate));
        }
        let source = self.source_of(ray)?;
        Some((source, self.shares[source].part_of(ray, self.replicates)))
    }
}

/// Whether the run of a scene can grow: not where a source has a number of rays of its own.
pub(crate) fn can_grow(bound: &BoundScene) -> bool {
    bound.emitters.iter().all(|e| e.rays.is_none())
}

/// Whether a run is large and round enough to be divided into replicates of a fixed size by default, and its sources few
/// enough: each has a ray in every replicate, which of thousands would be several times the rays that were asked for.
fn grows_unasked(settings: &RunSettings, sources: usize) -> bool {
    let usual = settings.replicates == RunSettings::default().replicates;
    usual
        && sources <= MOST_SOURCES
        && settings.rays >= FEWEST_GROWING * GROWING_REPLICATE
        && settings.rays.is_multiple_of(GROWING_REPLICATE)
}

/// Returns the quanta of an average ray: [`QUANTA`], halved until the heaviest ray is a whole number that is exact and no sum of a
/// replicate, or of the squares of so many, overflows; doubled, as far as these allow, until the lightest ray is fine. `weights` are the
/// rays of each source and what one of them weighs against the average; they are divided into so many parts, one where they are those of
/// each replicate.
fn average_quanta(weights: &[(u64, f64)], parts: u32) -> f64 {
    let in_smallest = |&(rays, weight): &(u64, f64)| weight * weight_among(rays / u64::from(parts), rays, parts);
    let heaviest = weights.iter().map(in_smallest).fold(0.0, f64::max);
    let replicates = f64::from(parts);
    // A source of few rays may have them all in one replicate.
    let fullest: f64 = weights.iter().map(|(rays, weight)| (*rays as f64 / replicates).ceil() * weight).sum();
    let fits = |average: f64| {
        let replicate = average * fullest;
        // How many replicates a run that grows will have is not known; its own are small.
        let squares = if parts > 1 { replicates * replicate * replicate } else { 0.0 };
        average * heaviest <= HEAVIEST_RAY && replicate <= FULLEST_REPLICATE && squares < SUM_OF_SQUARES
    };
    let mut average = QUANTA;
    // A power of two: the share of every ray keeps its digits.
    while !fits(average) && average > 1.0 {
        average *= 0.5;
    }
    let lightest = weights.iter().map(|(_, weight)| *weight).fold(f64::INFINITY, f64::min);
    // Of one part the squares are not known.
    while parts > 1 && lightest * average < FINE_RAY && fits(2.0 * average) {
        average *= 2.0;
    }
    average
}

/// Shares out so many rays among the sources by their power, at least one to each; a source with a number of its own has that.
fn rays_of_sources(bound: &BoundScene, rays: u64, emitted: f64) -> Vec<u64> {
    // Rounded sums, not rounded shares: three equal sources share a million rays without losing one.
    let mut share = 0.0;
    let mut given = 0;
    let mut counts = Vec::with_capacity(bound.emitters.len());
    for e in &bound.emitters {
        share += e.power / emitted;
        let upto = (rays as f64 * share).round() as u64;
        // A source has one ray at least, or its light would be missing altogether.
        counts.push(e.rays.unwrap_or(upto.saturating_sub(given)).max(1));
        given = upto;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_ray_is_located_in_the_range_that_has_it_however_few_its_source_has() {
        for replicates in [2, 3, 16, 62, 128] {
            for rays in 1..=2 * u64::from(replicates) + 1 {
                let share =
                    |source: u64| SourceShare::new(source as usize, [source * rays, rays], QUANTA, replicates);
                let plan = Plan {
                    shares: vec![share(0), share(1)],
                    replicate_rays: None,
                    first_replicate: 0,
                    replicates,
                    rays: 2 * rays,
                    quantum: 1.0,
                    average_ray: QUANTA,
                    emitted: 1.0,
                    record_mask: None,
                    sample_mask: None,
                    drawn_length: 0.0,
                };
                let mut located = 0;
                for replicate in 0..replicates {
                    // Each has the same quanta of a source, but for rounding, where it has any ray of it.
                    let [from, to] = plan.range(0, replicate);
                    let quanta = (to - from) as f64 * plan.quanta(0, to - from);
                    let mean = rays as f64 / f64::from(replicates) * QUANTA;
                    assert!(
                        mean < QUANTA || (quanta / mean - 1.0).abs() < 1e-12,
                        "{rays} in {replicates}: {quanta}"
                    );
                    for (source, ray) in plan.rays_of_replicate(replicate) {
                        assert_eq!(
                            plan.locate(ray),
                            Some((source, replicate)),
                            "ray {ray} of {rays} in {replicates}"
                        );
                        located += 1;
                    }
                }
                assert_eq!((located, plan.locate(2 * rays)), (2 * rays, None));
            }
        }
    }

    /// 200 sources of 102 rays in 128 replicates: 159 or so in each, where all in the same places would leave some without any.
    #[test]
    fn few_rays_of_many_sources_fill_all_replicates() {
        let (parts, rays) = (128, 102);
        let shares: Vec<_> =
            (0..200).map(|k| SourceShare::new(k, [rays * k as u64, rays], QUANTA, parts)).collect();
        let in_part =
            |part| shares.iter().map(|s| s.first_in(part + 1, parts) - s.first_in(part, parts)).sum::<u64>();
        assert!(
            (0..parts).all(|part| (157..=162).contains(&in_part(part))),
            "{:?}",
            (0..parts).map(in_part).collect::<Vec<_>>()
        );
    }

    #[test]
    fn the_heaviest_ray_and_the_squares_of_large_runs_fit_their_words() {
        // The usual run, and the largest whose sums hold 2⁴⁰ quanta a ray.
        for rays in [1_000_000, 1 << 29] {
            assert_eq!(average_quanta(&[(rays, 1.0)], ((rays >> MOST_RAYS_LOG2) as u32).max(128)), QUANTA);
        }
        // One ray with half the power beside 8·10⁷ others: 2⁶⁵ quanta of 2⁴⁰ a mean ray.
        let (n, lone) = (8e7, 0.5 * (8e7 + 1.0));
        let average = average_quanta(&[(1, lone), (8e7 as u64, 0.5 * (n + 1.0) / n)], 128);
        assert!(average * lone <= 2f64.powi(53) && 2.0 * average * lone > 2f64.powi(53));
        // The rays of one source weigh 10⁻¹³ of the others': as many quanta as the heavy ones leave room for, which weigh a little over 2
        // in a replicate of 156.
        let average = average_quanta(&[(20_000, 2.0), (20_000, 2e-13)], 128);
        assert_eq!(average, 2f64.powi(51));
        // 2³¹ rays in 2¹⁰ replicates at the rim of a receiver: each has Σ w·x = 2²¹ rays, cut to a quarter quantum; squared, times 2¹⁰.
        let average = average_quanta(&[(1 << 31, 1.0)], 1 << 10);
        let squares = 2f64.powi(10) * (2f64.powi(21) * average / 4.0).powi(2);
        assert!(squares < 2f64.powi(127) && average > 2f64.powi(37));
    }
}

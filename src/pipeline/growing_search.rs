//! Runs of growing length, each from its first ray, until one is long enough: where the search begins, and what keeps its runs.

use super::monitor::Monitor;
use super::prepared_scene::{PreparedScene, TraceRequest};
use crate::simulate::{GROWING_REPLICATE, PartialRun, Results};

/// The most rays, where the settings do not say.
const MOST_SEARCHED_RAYS: u64 = 10_000_000_000;
/// Standard deviations of an error's own error that [`growth_margin`] leaves room for: of 25 searches one traces once more.
const MARGIN_SIGMAS: f64 = 2.0;
/// Largest such margin: with few replicates one more run costs less than unneeded rays.
const MOST_MARGIN: f64 = 2.0;
/// Least and greatest growth of the rays: fewer would be a run for little, more would trust a poor first error too much.
const GROWTH_RANGE: [f64; 2] = [2.0, 64.0];

/// From so many replicates on a run is divided into those of one that grows, where its rays fill them.
const LONG_RUN_REPLICATES: u64 = 128;

/// Saves a run while it is traced, so that what is done of it outlives its process.
pub trait RunKeeper {
    /// Calls `trace` once for the run that `prepared` describes, with a request that holds what is done of it already
    /// ([`TraceRequest::from`]) and what to call as the rest is traced ([`TraceRequest::finished`]).
    fn keep(&self, prepared: &PreparedScene, trace: &mut dyn FnMut(TraceRequest<'_>));
}

/// A keeper that saves nothing and starts every run anew.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unkept;

impl RunKeeper for Unkept {
    fn keep(&self, _prepared: &PreparedScene, trace: &mut dyn FnMut(TraceRequest<'_>)) {
        trace(TraceRequest::default());
    }
}

/// A search for the number of rays that an error or a verdict needs.
#[derive(Clone, Copy)]
pub struct GrowingSearch<'a> {
    /// Rays of the first run, where it goes on from an earlier search; `None` for the number that a search begins with.
    pub resume_rays: Option<u64>,
    /// Saves its runs.
    pub keeper: &'a dyn RunKeeper,
}

impl Default for GrowingSearch<'_> {
    /// From the beginning; nothing is kept.
    fn default() -> Self {
        Self { resume_rays: None, keeper: &Unkept }
    }
}

impl GrowingSearch<'_> {
    /// Returns the number of rays of the first run: that of the run at which an earlier search stopped, else `usual`, at most `most`.
    pub(super) fn first_rays(&self, usual: u64, most: u64) -> u64 {
        self.resume_rays.unwrap_or(usual.min(most))
    }

    /// Traces what the keeper does not have yet of the run that `prepared` asks for, with an intersector built for it, and returns the sums
    /// and the results of all of it; fewer rays where the monitor ends it early.
    pub(super) fn trace(&self, prepared: &PreparedScene, monitor: &dyn Monitor) -> (PartialRun, Results) {
        let settings = prepared.run_settings();
        prepared.with_intersector(monitor, |intersector, _| {
            let run = |request: TraceRequest<'_>| prepared.run(intersector, &settings, request, monitor);
            let mut traced = None;
            self.keeper.keep(prepared, &mut |request| traced = Some(run(request)));
            let traced = traced.unwrap_or_else(|| run(TraceRequest::default()));
            let partial = traced.partial.clone();
            (partial, Results::new(&prepared.bound, &settings, traced))
        })
    }
}

/// Returns the most rays that a run of a search may have.
pub(super) fn most_rays(prepared: &PreparedScene) -> u64 {
    prepared.job.tracing.rays().unwrap_or(MOST_SEARCHED_RAYS)
}

/// Returns the factor by which to exceed the number of rays that an error asks for: an error found from so many replicates has an error
/// itself.
///
/// The square of a standard error, with which the rays go, is spread by √(2 / (n − 1)) of itself when it is found from n replicates. The
/// run that is asked for finds its error in the same way, from as many replicates at least: the spread of the ratio of both is at most √2
/// times that, and the margin covers [`MARGIN_SIGMAS`] of it, up to [`MOST_MARGIN`]. A third for 128 replicates, 3 % for the 20,000 of a
/// run of 10⁸ rays.
pub(super) fn growth_margin(replicates: u32) -> f64 {
    // From one replicate no error is found; as of two, where it is asked for.
    (1.0 + MARGIN_SIGMAS * 2.0 / f64::from(replicates.max(2) - 1).sqrt()).min(MOST_MARGIN)
}

/// Returns the number of rays of the run after one of `rays`: `growth` times as many, kept within [`GROWTH_RANGE`], of many in whole
/// replicates of a run that grows, or they would be divided otherwise among sources; at most `most`.
pub(super) fn next_rays(rays: u64, growth: f64, most: u64) -> u64 {
    let [least, greatest] = GROWTH_RANGE;
    let next = (rays as f64 * growth.clamp(least, greatest)) as u64;
    let next = if next < LONG_RUN_REPLICATES * GROWING_REPLICATE {
        next
    } else {
        next.next_multiple_of(GROWING_REPLICATE)
    };
    next.min(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ratio of two variances, each of as many normal values, stays below the margin 95.6 to 97.6 times in a hundred: between the
    /// quantiles 0.95 and 0.9773 of Fisher's F, from SciPy.
    #[test]
    fn the_margin_covers_the_error_of_the_error() {
        for (replicates, quantiles) in [(128, [1.340, 1.429]), (1000, [1.110, 1.135]), (20_000, [1.0235, 1.0287])] {
            let margin = growth_margin(replicates);
            assert!(quantiles[0] < margin && margin < quantiles[1], "{replicates}: {margin}");
        }
        assert_eq!([17, 16, 2, 1].map(growth_margin), [2.0; 4]);
    }

    #[test]
    fn runs_grow_at_least_twofold_and_at_most_64_fold() {
        let next = |growth: f64| next_rays(1_000, growth, 50_000);
        assert_eq!([1.1, 2.0, 4.4, 50.0, 1e9].map(next), [2_000, 2_000, 4_400, 50_000, 50_000]);
        assert_eq!(next_rays(1_000, 1e9, MOST_SEARCHED_RAYS), 64_000);
        // 907,109,336 of a source a billion times as strong as the next: with another division than before, none were left for that.
        assert_eq!(next_rays(204_800_000, 4.429_244, MOST_SEARCHED_RAYS), 907_110_000);
    }
}

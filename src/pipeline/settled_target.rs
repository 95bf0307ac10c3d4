//! As many rays as the verdicts of a scene's regulations need until no row is unsure.
//!
//! Runs of growing length are traced, each from its beginning, as for [`ErrorTarget`](super::ErrorTarget). While they grow, the errors of
//! the rays alone are looked at: more rays take nothing from those of the facets, which the last run measures.

use super::growing_search::{GrowingSearch, growth_margin, most_rays, next_rays};
use super::monitor::Monitor;
use super::prepared_scene::PreparedScene;
use super::verdicts::verdict;
use crate::regulation::{RowVerdict, Verdict};
use crate::simulate::{PartialRun, Results};

/// Rays of the first run.
const FIRST_RAYS: u64 = 200_000;

/// Traces runs of growing length, each from its first ray, until no row of a verdict is unsure by the errors of the rays, the most rays are
/// traced, or the monitor asks to stop: then not all is traced. Sets `prepared.rays`; returns the sums and the number of rays.
pub fn trace_until_settled(
    prepared: &mut PreparedScene,
    search: GrowingSearch<'_>,
    monitor: &dyn Monitor,
) -> (PartialRun, u64) {
    let most = most_rays(prepared);
    let mut rays = search.first_rays(FIRST_RAYS, most);
    loop {
        prepared.rays = Some(rays);
        let (partial, results) = search.trace(prepared, monitor);
        let wanted = rays_wanted(prepared, &results);
        // Settled, stopped or at the most: either way this is the run.
        let Some(&most_wanted) = wanted.iter().max().filter(|_| partial.is_whole() && rays < most) else {
            return (partial, rays);
        };
        rays = next_rays(rays, growth_margin(results.replicates) * most_wanted as f64 / rays as f64, most);
        monitor.unsettled(wanted.len(), rays);
    }
}

/// Returns for each unsure row the rays that would settle it; empty where all rows are sure, but for those that reach beyond the far field,
/// which no rays settle. A row at its very limit asks for no number: then twice as many are tried.
fn rays_wanted(prepared: &PreparedScene, results: &Results) -> Vec<u64> {
    let all = prepared.job.scene.regulations.iter();
    // One that cannot be judged asks for no rays; the last run says why.
    let verdicts = all.filter_map(|wanted| verdict(wanted, prepared, results, |_| None).ok());
    let is_unsure = |row: &RowVerdict| row.verdict == Some(Verdict::Unsure) && row.unseen == 0;
    let rays = |row: &RowVerdict| row.settles.map_or(results.rays.saturating_mul(2), |s| s.rays);
    verdicts.flat_map(|v| v.assessment.rows).filter(is_unsure).map(|row| rays(&row)).collect()
}

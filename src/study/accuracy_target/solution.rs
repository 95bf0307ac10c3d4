//! What a kind of normals came to on fresh rays, and the sentence that says it.

use super::AccuracyTarget;
use crate::intersect::{Cost, NormalMode};
use crate::study::counted_work::{CUBIC_HIT, FACET, FACET_HIT, MOVED_HIT, SPLINE_HIT, longer_on};
use crate::study::tolerance_plan::TolerancePlan;
use crate::text::{figures, grouped};

/// An error is accepted with this much to spare, so that other rays than the judge's find it kept too.
const ACCEPTED: f64 = 0.96;
/// Share of the rays that the 99th percentile leaves out.
const BEYOND_PERCENTILE: f64 = 0.01;
/// Rays beyond the percentile from which on it hardly changes with other rays: ten of each of two sets.
const FEW_BEYOND: f64 = 20.0;

/// Facets of which a hit takes the counted work.
const COUNTED_FACETS: f64 = 4096.0;

/// Counted work of a job, ns.
#[derive(Clone, Copy, Default)]
pub(super) struct JobWork {
    /// Of making the facets.
    pub(super) prepare: f64,
    /// Of its rays.
    pub(super) trace: f64,
}

impl JobWork {
    /// Returns that of so many rays on so many facets; `cost` is that of some rays with these normals.
    pub(super) fn new(facets: f64, rays: f64, normals: NormalMode, cost: Cost) -> Self {
        let hit = match normals {
            NormalMode::Exact => MOVED_HIT,
            NormalMode::Cubic => CUBIC_HIT,
            NormalMode::Flat | NormalMode::Nearest | NormalMode::Bilinear => FACET_HIT,
        };
        let asked = cost.doubtful as f64 / cost.rays.max(1) as f64;
        // Fewer facets than one are none to walk through.
        let on_facets = hit * longer_on(facets.max(1.0) / COUNTED_FACETS).max(0.0);
        Self { prepare: facets * FACET, trace: rays * (on_facets + asked * SPLINE_HIT) }
    }

    /// Returns that of the whole job.
    pub(super) fn total(self) -> f64 {
        self.prepare + self.trace
    }
}

/// Outcome for a kind of normals.
pub(super) struct Solution {
    pub(super) normals: NormalMode,
    pub(super) plan: TolerancePlan,
    pub(super) facets: usize,
    /// Seconds of meshing and building, and of the job's rays, as measured.
    pub(super) prepare: f64,
    pub(super) trace: f64,
    /// Counted work of both, by which solutions are compared.
    pub(super) work: JobWork,
    /// The 99th percentile and the largest error, degrees; `None` where no ray met the same face on facets and spline.
    pub(super) reached: Option<f64>,
    pub(super) largest: Option<f64>,
    /// Rays that hit curved faces and have an angle, those that hit flat ones, and those that have no angle as they met another face.
    pub(super) checked: u64,
    pub(super) flat: u64,
    pub(super) flips: u64,
}

impl Solution {
    /// Whether the 99th percentile is within `limit_deg`; also where no ray met anything, so that none can err.
    fn is_within(&self, limit_deg: f64) -> bool {
        self.reached.map_or(self.flips == 0, |reached| reached <= limit_deg)
    }

    /// Whether the 99th percentile is within the target.
    pub(super) fn is_kept(&self, target: &AccuracyTarget) -> bool {
        self.is_within(target.angle_deg)
    }

    /// Whether it is with enough to spare for other rays than these.
    pub(super) fn is_accepted(&self, target: &AccuracyTarget) -> bool {
        self.is_within(ACCEPTED * target.angle_deg)
    }

    /// Whether it errs less than another; what is not known is the worst.
    pub(super) fn errs_less(&self, other: &Self) -> bool {
        let known = |s: &Self| s.reached.unwrap_or(f64::INFINITY);
        known(self) < known(other)
    }

    /// Returns the measured seconds of the whole job.
    pub(super) fn seconds(&self) -> f64 {
        self.prepare + self.trace
    }

    /// Returns the share of rays that no angle stands for, in words; empty where the percentile leaves out as many.
    fn without_angle(&self) -> String {
        let share = self.flips as f64 / (self.flips + self.flat + self.checked).max(1) as f64;
        if share <= BEYOND_PERCENTILE {
            return String::new();
        }
        format!("; {} % more meet another face or none", figures(100.0 * share, 3))
    }

    /// Returns that so few rays leave their 99th percentile to chance, where they do.
    fn with_few_rays(&self) -> &'static str {
        if self.checked as f64 * BEYOND_PERCENTILE < FEW_BEYOND { ", too few to be sure of it" } else { "" }
    }

    /// Returns the target, what was reached and by which facets and normals, as one sentence; `gave_up` where finer facets were too
    /// many to be tried.
    pub(super) fn answer_sentence(&self, target: &AccuracyTarget, gave_up: bool) -> String {
        let [low, high] = self.plan.tolerance_mm();
        let [low, high] = [low, high].map(|mm| figures(mm, 4));
        let range = if low == high { format!("{low} mm") } else { format!("{low} to {high} mm") };
        let reached = match self.reached.zip(self.largest) {
            Some(_) if self.checked == 0 => {
                format!("reached 0° (fresh rays met flat faces alone{})", self.without_angle())
            }
            Some((reached, largest)) => format!(
                "reached {}° (99th percentile of {} hits on curved faces, the larger of those of fresh rays traced on the facets and of others on the \
                 spline{}; the largest {}°{})",
                figures(reached, 3),
                grouped(self.checked),
                self.with_few_rays(),
                figures(largest, 3),
                self.without_angle()
            ),
            None => "what is reached is not known (no fresh ray met the same face on facets and spline)".to_owned(),
        };
        let shortfall = match (self.is_kept(target), gave_up) {
            (true, _) => "",
            (false, true) => ": not reached, and finer facets are more than a search may make",
            (false, false) => ": not reached",
        };
        format!(
            "Asked {}°, {reached} with {} normals on {} facets within {range}{shortfall}.",
            target.angle_deg,
            self.normals,
            grouped(self.facets as u64)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentile_of_few_rays_is_told_as_unsure() {
        let answer = |checked| {
            let solution = Solution {
                normals: NormalMode::Bilinear,
                plan: TolerancePlan::uniform(0.1),
                facets: 100,
                prepare: 0.0,
                trace: 0.0,
                work: JobWork::default(),
                reached: Some(0.5),
                largest: Some(0.75),
                checked,
                flat: 0,
                flips: 0,
            };
            solution.answer_sentence(&AccuracyTarget::for_angle_deg(1.0), false)
        };
        let of_both = "hits on curved faces, the larger of those of fresh rays traced on the facets and of others on the spline";
        assert!(answer(24).contains(&format!("of 24 {of_both}, too few to be sure of it; the largest 0.75°)")));
        assert!(answer(2000).contains(&format!("of 2000 {of_both}; the largest 0.75°)")));
    }
}

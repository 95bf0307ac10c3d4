//! What a kind of normals came to on fresh rays, and the sentence that says it.

use super::AccuracyTarget;
use crate::intersect::NormalMode;
use crate::study::tolerance_plan::TolerancePlan;
use crate::text::figures;

/// An error is accepted with this much to spare, so that other rays than the judge's find it kept too.
const ACCEPTED: f64 = 0.96;
/// Share of the rays that the 99th percentile leaves out.
const BEYOND_PERCENTILE: f64 = 0.01;
/// Rays beyond the percentile from which on it hardly changes with other rays: ten of each of two sets.
const FEW_BEYOND: f64 = 20.0;

/// What a kind of normals came to.
pub(super) struct Solution {
    pub(super) normals: NormalMode,
    pub(super) plan: TolerancePlan,
    pub(super) facets: usize,
    /// Seconds of meshing and building, and of the job's rays.
    pub(super) prepare: f64,
    pub(super) trace: f64,
    /// The 99th percentile and the largest error, degrees; `None` where no ray met the same face on facets and spline.
    pub(super) reached: Option<f64>,
    pub(super) largest: Option<f64>,
    /// Rays that have an angle, and those that have none as they met another face.
    pub(super) checked: u64,
    pub(super) flips: u64,
}

impl Solution {
    /// Whether the 99th percentile is within `limit_deg`; also where no ray met anything, so that none can err.
    fn is_within(&self, limit_deg: f64) -> bool {
        self.reached.map_or(self.flips == 0, |reached| reached <= limit_deg)
    }

    /// Whether the 99th percentile is within what is asked.
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

    /// Returns the seconds of the whole job.
    pub(super) fn seconds(&self) -> f64 {
        self.prepare + self.trace
    }

    /// Returns the share of rays that no angle stands for, in words; empty where the percentile leaves out as many.
    fn without_angle(&self) -> String {
        let share = self.flips as f64 / (self.flips + self.checked).max(1) as f64;
        if share <= BEYOND_PERCENTILE {
            return String::new();
        }
        format!("; {} % more meet another face or none", figures(100.0 * share, 3))
    }

    /// Returns that so few rays leave their 99th percentile to chance, where they do.
    fn with_few_rays(&self) -> &'static str {
        if self.checked as f64 * BEYOND_PERCENTILE < FEW_BEYOND { ", too few to be sure of it" } else { "" }
    }

    /// Returns what was asked, what was reached and by which facets and normals, as one sentence; `gave_up` where finer facets were too
    /// many to be tried.
    pub(super) fn answer_sentence(&self, target: &AccuracyTarget, gave_up: bool) -> String {
        let [low, high] = self.plan.tolerance_mm();
        let range = if low == high {
            format!("{} mm", figures(low, 3))
        } else {
            format!("{} to {} mm", figures(low, 3), figures(high, 3))
        };
        let reached = match self.reached.zip(self.largest) {
            Some((reached, largest)) => format!(
                "reached {}° (99th percentile of {} fresh rays on facets and on the spline, the worse of both{}, at most {}°{})",
                figures(reached, 3),
                self.checked,
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
            target.angle_deg, self.normals, self.facets
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
                reached: Some(0.5),
                largest: Some(0.75),
                checked,
                flips: 0,
            };
            solution.answer_sentence(&AccuracyTarget::for_angle_deg(1.0), false)
        };
        assert!(
            answer(24).contains("of 24 fresh rays on facets and on the spline, the worse of both, too few to be sure of it, at most 0.75°")
        );
        assert!(
            answer(2000)
                .contains("of 2000 fresh rays on facets and on the spline, the worse of both, at most 0.75°")
        );
    }
}

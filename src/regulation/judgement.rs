//! When a reading is enough for a verdict, and what would make it so.

use super::map::Reading;
use super::requirement::{Comparison, Photometer, Requirement};

/// What a row, or a lamp, comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Met, by more than three combined standard errors.
    Pass,
    /// Not met, by more than three combined standard errors.
    Fail,
    /// Nearer to the limit than the errors let one tell, or outside the far field.
    Unsure,
}

impl Verdict {
    /// Rises from pass to fail.
    pub(super) fn severity(self) -> u8 {
        match self {
            Self::Pass => 0,
            Self::Unsure => 1,
            Self::Fail => 2,
        }
    }

    /// The verdict of requirements that must all be met: fail if one fails, else unsure if one is; pass without any.
    pub(super) fn all(verdicts: impl IntoIterator<Item = Self>) -> Self {
        // One failure decides; doubt counts only where nothing fails.
        verdicts.into_iter().fold(Self::Pass, |sum, v| match (sum, v) {
            (Self::Fail, _) | (_, Self::Fail) => Self::Fail,
            (Self::Unsure, _) | (_, Self::Unsure) => Self::Unsure,
            _ => Self::Pass,
        })
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Unsure => "unsure",
        })
    }
}

/// What would settle a row that is unsure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settles {
    /// Rays in all that bring the statistical error down far enough.
    pub rays: u64,
    /// Tolerance of the facets, mm, where the geometric error must come down too.
    pub tolerance_mm: Option<f64>,
}

/// Combined standard errors between a value and its limit that make a verdict.
const SIGMAS: f64 = 3.0;

/// Probability beyond three standard errors on one side.
const ONE_SIDED: f64 = 1.35e-3;

/// A requirement with its verdict and the reading that decided it.
pub(super) struct Judgement {
    pub(super) verdict: Verdict,
    pub(super) decisive: Option<Decisive>,
    /// Directions outside the far field.
    pub(super) unseen: usize,
}

/// The reading that decides: the worst of those that must all hold, the best of those of which one is enough.
pub(super) struct Decisive {
    pub(super) reading: Reading,
    pub(super) direction: [f64; 2],
    /// How far the reading is on the good side of its limit, cd.
    margin: f64,
    /// Standard errors that the margin must have.
    sigmas: f64,
}

impl Decisive {
    /// Returns with how many rays in all, never fewer than `traced`, and on facets of which tolerance this margin would be enough.
    ///
    /// `tolerance_mm` is the run's own, `None` where it traced no facets; the answer's is `None` where facets need not be finer. `None` where
    /// 10¹⁵ rays or more would be needed.
    pub(super) fn what_settles(&self, traced: u64, tolerance_mm: Option<f64>) -> Option<Settles> {
        /// Runs beyond this are no advice.
        const MOST_RAYS: f64 = 1e15;
        // At most so large may the whole error be.
        let wanted = self.margin.abs() / self.sigmas;
        // On its very limit a reading stays unsure with any error.
        if wanted == 0.0 {
            return None;
        }
        let Reading { statistical, geometric, .. } = self.reading;
        // Where the facets leave no room, both errors get half of the square.
        let finer = geometric > 0.5f64.sqrt() * wanted;
        // Otherwise the geometric error stays as it is, and the statistical one gets what it leaves of the square.
        let room = if finer { wanted * 0.5f64.sqrt() } else { (wanted * wanted - geometric * geometric).sqrt() };
        // Statistical errors fall with the root of the rays; fewer rays than traced are no advice.
        let rays = (traced as f64 * (statistical / room).powi(2)).max(traced as f64).ceil();
        let tolerance_mm = tolerance_mm.filter(|_| finer).map(|t| t * room / geometric);
        (rays.is_finite() && rays < MOST_RAYS).then_some(Settles { rays: rays as u64, tolerance_mm })
    }
}

impl Judgement {
    /// Reads all comparisons of a requirement and judges it: pass or fail only beyond the errors of the readings, else unsure, also where
    /// there are no comparisons.
    pub(super) fn of_requirement(photometer: &Photometer, requirement: &Requirement) -> Self {
        // Of many comparisons one may be lucky: what one alone may decide is asked for at a confidence divided by their number. For a
        // normal error P(Z > z) ≤ exp(−z²/2)/2, so that z = √(2 ln(n / 2p)) is enough.
        let count = (requirement.comparisons.len().max(1) * requirement.choices) as f64;
        let many = if count > 1.0 { (2.0 * (count / (2.0 * ONE_SIDED)).ln()).sqrt().max(SIGMAS) } else { SIGMAS };
        // Luck helps where one reading is enough: to pass where any will do, to fail where all must hold.
        let (to_pass, to_fail) = if requirement.choices > 1 {
            // What all are compared with is the luckiest of many, which may help either way.
            (many, many)
        } else if requirement.any {
            (many, SIGMAS)
        } else {
            (SIGMAS, many)
        };

        let mut passing = 0;
        let mut failing = 0;
        let mut decisive: Option<Decisive> = None;
        for comparison in &requirement.comparisons {
            let (reading, margin) = read_margin(photometer, comparison);
            let error = reading.error();
            // A limit that is just reached is met, where there is no error.
            passing += usize::from(margin >= to_pass * error && margin >= 0.0);
            failing += usize::from(-margin >= to_fail * error && margin < 0.0);
            // The best of those of which any is enough, the worst of those that must all hold.
            let decides = |d: &Decisive| (margin > d.margin) == requirement.any && margin != d.margin;
            if decisive.as_ref().is_none_or(decides) {
                let sigmas = if margin >= 0.0 { to_pass } else { to_fail };
                decisive = Some(Decisive { reading, direction: comparison.direction, margin, sigmas });
            }
        }
        let all = requirement.comparisons.len();
        // A direction outside the far field may hide anything: only what one reading alone decides is still known.
        let complete = requirement.unseen == 0 && all > 0;
        let (alone, together) = if requirement.any {
            ((passing > 0).then_some(Verdict::Pass), (failing == all && complete).then_some(Verdict::Fail))
        } else {
            ((failing > 0).then_some(Verdict::Fail), (passing == all && complete).then_some(Verdict::Pass))
        };
        let verdict = alone.or(together).unwrap_or(Verdict::Unsure);
        Self { verdict, decisive, unseen: requirement.unseen }
    }
}

/// The reading of a comparison, and by how much it keeps its limit, cd; negative where it does not.
fn read_margin(photometer: &Photometer, comparison: &Comparison) -> (Reading, f64) {
    let reading = photometer.map.read(&comparison.measurement);
    let margin =
        if comparison.at_least { reading.value - comparison.limit } else { comparison.limit - reading.value };
    (reading, margin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_settles_a_reading_on_its_very_limit() {
        let on_limit = |statistical: f64, geometric: f64| {
            let reading = Reading { value: 1.0, statistical, geometric };
            Decisive { reading, direction: [0.0, 0.0], margin: 0.0, sigmas: 3.0 }.what_settles(1000, Some(0.1))
        };
        // Without a statistical error, zero by zero must not become the rays already traced and facets of 0 mm.
        for (statistical, geometric) in [(0.0, 0.1), (0.1, 0.0), (0.1, 0.1)] {
            assert_eq!(on_limit(statistical, geometric), None);
        }
    }
}

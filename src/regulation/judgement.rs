//! When a reading is enough for a verdict, and what would make it so.

use super::few_rays::{Noise, SIGMAS};
use super::map::Reading;
use super::photometer::Photometer;
use super::requirement::{Comparison, Requirement};
use crate::math::error_of_maximum;

/// Verdict on a row or a lamp, from the best to the worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Met, by more than three combined standard errors; of few rays, by as much as their number may be off at the same confidence.
    Pass,
    /// Too near to the limit for the errors, or outside the far field.
    Unsure,
    /// Not met, by more than three combined standard errors.
    Fail,
}

impl Verdict {
    /// The verdict of requirements that must all be met: fail if one fails, else unsure if one is; pass without any.
    pub(super) fn worst(verdicts: impl IntoIterator<Item = Self>) -> Self {
        verdicts.into_iter().max().unwrap_or(Self::Pass)
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
    /// Share of the facets' tolerance that they may have left, where the geometric error must come down too.
    pub tolerance_share: Option<f64>,
    /// That tolerance, mm, where the run's own is known.
    pub tolerance_mm: Option<f64>,
}

/// Probability beyond three standard errors on one side.
const ONE_SIDED: f64 = 1.35e-3;

/// A requirement with its verdict and the reading that decided it.
pub(super) struct Judgement {
    pub(super) verdict: Verdict,
    pub(super) decisive: Option<Decisive>,
    /// Directions outside the far field.
    pub(super) unseen: usize,
}

/// The reading that decides: the worst of those that must all hold, or the least sure where one is in doubt, the best of those of which one
/// is enough.
#[derive(Clone, Copy)]
pub(super) struct Decisive {
    /// With errors of which [`SIGMAS`] reach as far as the reading may be off: those of the luckiest, where it was chosen from many.
    pub(super) reading: Reading,
    pub(super) direction: [f64; 2],
    /// Margin of the reading on the passing side of its limit, cd.
    margin: f64,
    /// Standard errors of the reading by itself that the margin must have.
    sigmas: f64,
    /// The margin over what it must be: sure from 1 on, or from −1 down.
    surety: f64,
    noise: Noise,
}

/// Bisections of the search for enough rays: 50 doublings over 2¹⁶ leave 0.05 % of them.
const BISECTIONS: usize = 16;

impl Decisive {
    /// Whether the error of the cells alone leaves the verdict open: a reading exactly on its limit stays unsure with any.
    pub(super) fn cells_leave_open(&self) -> bool {
        self.margin.abs() <= SIGMAS * self.reading.cells
    }

    /// Returns with how many rays in all, never fewer than `traced`, and on facets of which tolerance this margin would be enough.
    ///
    /// `tolerance_mm` is the run's own, `None` where it is not known. `None` where `traced` is 0, that is not known, where 10¹⁵ rays or
    /// more would be needed, and where it is not known what facets change.
    pub(super) fn what_settles(&self, traced: u64, tolerance_mm: Option<f64>) -> Option<Settles> {
        /// Runs beyond this are no advice.
        const MOST_RAYS: f64 = 1e15;
        const MOST_DOUBLINGS: f64 = 50.0;
        // From an unknown number of rays nothing follows.
        if traced == 0 || self.cells_leave_open() {
            return None;
        }
        // The largest error of both kinds that settles it, beside that of the cells.
        let wanted = ((self.margin / SIGMAS).powi(2) - self.reading.cells.powi(2)).sqrt();
        let geometric = self.reading.geometric?;
        // Where the facets leave no room, both errors get half of the square.
        let finer = geometric > 0.5f64.sqrt() * wanted;
        // Otherwise the geometric error stays as it is, and the statistical one gets what it leaves of the square.
        let room = if finer { wanted * 0.5f64.sqrt() } else { (wanted * wanted - geometric * geometric).sqrt() };
        // What few rays leave open falls faster than the root of their number: looked for, not worked out. Fewer than traced are no advice.
        let enough = |doublings: f64| self.noise.reach(self.sigmas, doublings.exp2()) <= SIGMAS * room;
        let [mut too_few, mut doublings] = [0.0, if enough(0.0) { 0.0 } else { MOST_DOUBLINGS }];
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (too_few + doublings);
            if enough(middle) {
                doublings = middle;
            } else {
                too_few = middle;
            }
        }
        let rays = (traced as f64 * doublings.exp2()).ceil();
        let tolerance_share = finer.then_some(room / geometric);
        let tolerance_mm = tolerance_mm.zip(tolerance_share).map(|(traced, share)| traced * share);
        (rays.is_finite() && rays < MOST_RAYS).then_some(Settles {
            rays: rays as u64,
            tolerance_share,
            tolerance_mm,
        })
    }
}

impl Judgement {
    /// Returns how far the reading that decides is on the passing side of its limit, over what makes it sure; least of all where none was
    /// read.
    fn surety(&self) -> f64 {
        self.decisive.map_or(f64::NEG_INFINITY, |decisive| decisive.surety)
    }

    /// Returns the judgement that speaks for all: of the worst verdict, and the least sure of those; `None` of none.
    pub(super) fn worst(judged: &[Self]) -> Option<&Self> {
        judged.iter().max_by(|a, b| a.verdict.cmp(&b.verdict).then(b.surety().total_cmp(&a.surety())))
    }

    /// Returns what settles all that are unsure, from so many rays traced and the run's tolerance, mm, where it is known; `None` where one
    /// has nothing that settles it, as outside of the far field, and where none is unsure.
    pub(super) fn what_settles_all(judged: &[Self], traced: u64, tolerance_mm: Option<f64>) -> Option<Settles> {
        let unsure = judged.iter().filter(|j| j.verdict == Verdict::Unsure);
        let settles = unsure.map(|j| {
            // Outside the field no number of rays helps.
            let decisive = j.decisive.filter(|_| j.unseen == 0);
            decisive.and_then(|decisive| decisive.what_settles(traced, tolerance_mm))
        });
        let finer = |a: Option<f64>, b: Option<f64>| [a, b].into_iter().flatten().reduce(f64::min);
        settles.reduce(|a, b| {
            let (a, b) = (a?, b?);
            Some(Settles {
                rays: a.rays.max(b.rays),
                tolerance_share: finer(a.tolerance_share, b.tolerance_share),
                tolerance_mm: finer(a.tolerance_mm, b.tolerance_mm),
            })
        })?
    }

    /// Reads all comparisons of a requirement and judges it: pass or fail only beyond the errors of the readings, else unsure, also where
    /// there are no comparisons.
    pub(super) fn of_requirement(photometer: &Photometer, requirement: &Requirement) -> Self {
        // Luck helps where one reading is enough: to pass where any will do, to fail where all must hold. A reading that all are compared
        // with is the luckiest of many, which may help either way, and a turn of the lamp that was looked for helps it to pass.
        let Requirement { choices, any, .. } = *requirement;
        let count = requirement.comparisons.len().max(1);
        let looks = |alone: bool| if alone || choices > 1 { count * choices } else { 1 };
        let (to_pass, to_fail) =
            (sigmas_of_luckiest(looks(any) * photometer.turns), sigmas_of_luckiest(looks(!any)));

        let mut passing = 0;
        let mut failing = 0;
        let mut decisive: Option<Decisive> = None;
        let mut doubtful: Option<Decisive> = None;
        let mut read = Vec::with_capacity(requirement.comparisons.len());
        for comparison in &requirement.comparisons {
            let (mut reading, margin) = read_margin(photometer, comparison);
            let sigmas = if margin >= 0.0 { to_pass } else { to_fail };
            // The truth would be on the other side of the limit: more light than was read below it, less above.
            let sign = if reading.value < comparison.limit { 1.0 } else { -1.0 };
            let mut noise = photometer.map.noise(&comparison.weights, sign, margin, sigmas);
            noise.other += comparison.by_aim[1].powi(2);
            // An unknown error of the facets may exceed any margin.
            let geometric = reading.geometric.unwrap_or(f64::INFINITY);
            let cells = comparison.weights.unresolved.hypot(comparison.by_cells[1]);
            let reach = noise.reach(sigmas, 1.0).hypot(sigmas * geometric).hypot(sigmas * cells);
            let enough = margin.abs() >= reach;
            // A limit that is just reached is met, where there is no error.
            passing += usize::from(enough && margin >= 0.0);
            failing += usize::from(enough && margin < 0.0);
            // For few rays the spread is less than three errors of a count.
            read.push([reading.value, reading.statistical.max(noise.reach(SIGMAS, 1.0) / SIGMAS)]);
            let luck = sigmas / SIGMAS;
            reading.statistical = reading.statistical.max(noise.reach(sigmas, 1.0) / SIGMAS);
            reading.geometric = reading.geometric.map(|geometric| luck * geometric);
            reading.cells = luck * reading.cells.max(cells);
            let this = Decisive {
                reading,
                direction: comparison.direction,
                margin,
                sigmas,
                surety: margin / reach,
                noise,
            };
            // The best of those of which any is enough, the worst of those that must all hold.
            let decides = |d: &Decisive| (margin > d.margin) == any && margin != d.margin;
            if decisive.as_ref().is_none_or(decides) {
                decisive = Some(this);
            }
            // What the row waits for: of those in doubt again the best, or the least sure of all that must hold.
            let waits = |d: &Decisive| if any { margin > d.margin } else { this.surety < d.surety };
            if !enough && doubtful.as_ref().is_none_or(waits) {
                doubtful = Some(this);
            }
        }
        let all = requirement.comparisons.len();
        // A direction outside the far field may hide anything: only what one reading alone decides is still known.
        let complete = requirement.unseen == 0 && all > 0;
        let (alone, together) = if any {
            ((passing > 0).then_some(Verdict::Pass), (failing == all && complete).then_some(Verdict::Fail))
        } else {
            ((failing > 0).then_some(Verdict::Fail), (passing == all && complete).then_some(Verdict::Pass))
        };
        let verdict = alone.or(together).unwrap_or(Verdict::Unsure);
        let mut decisive = doubtful.filter(|_| verdict == Verdict::Unsure).or(decisive);
        // The brightest of many readings is too bright by their noise, which its own error does not hold.
        if let Some(Decisive { reading, .. }) =
            decisive.as_mut().filter(|_| any && requirement.comparisons.iter().all(|c| c.at_least))
        {
            reading.statistical = reading.statistical.max(error_of_maximum(read.into_iter()));
        }
        Self { verdict, decisive, unseen: requirement.unseen }
    }
}

/// Returns the standard errors by which the luckiest of so many readings is beyond its limit as seldom as a single one beyond [`SIGMAS`].
fn sigmas_of_luckiest(readings: usize) -> f64 {
    // Asked for at a confidence divided by their number: for a normal error P(Z > z) ≤ exp(−z²/2)/2, so that z = √(2 ln(n / 2p)) is enough.
    let bound = (2.0 * (readings as f64 / (2.0 * ONE_SIDED)).ln()).sqrt();
    if readings > 1 { bound.max(SIGMAS) } else { SIGMAS }
}

/// Returns the reading of a comparison, its errors with what the aim adds to them, and by how much it keeps its limit, cd; negative where
/// it does not.
fn read_margin(photometer: &Photometer, comparison: &Comparison) -> (Reading, f64) {
    let mut reading = photometer.map.read(&comparison.weights);
    reading.statistical = reading.statistical.hypot(comparison.by_aim[0]);
    reading.cells = reading.cells.hypot(comparison.by_cells[0]);
    let margin =
        if comparison.at_least { reading.value - comparison.limit } else { comparison.limit - reading.value };
    (reading, margin)
}

#[cfg(test)]
mod tests {
    use super::super::assessment::Assumptions;
    use super::super::table::Regulation;
    use super::super::test_lamps::map;
    use super::super::verdict::assess;
    use super::*;

    const NONE: Noise =
        Noise { ray_cd: 0.0, hidden: 0.0, hidden_ray_cd: 0.0, counted: 0.0, other: 0.0, replicates: 128 };

    #[test]
    fn nothing_settles_a_reading_on_its_very_limit() {
        let on_limit = |statistical: f64, geometric: f64| {
            let reading = Reading { value: 1.0, statistical, geometric: Some(geometric), cells: 0.0 };
            let noise = Noise { other: statistical * statistical, ..NONE };
            Decisive { reading, direction: [0.0, 0.0], margin: 0.0, sigmas: 3.0, surety: 0.0, noise }
                .what_settles(1000, Some(0.1))
        };
        // Without a statistical error, zero by zero must not become the rays already traced and facets of 0 mm.
        for (statistical, geometric) in [(0.0, 0.1), (0.1, 0.0), (0.1, 0.1)] {
            assert_eq!(on_limit(statistical, geometric), None);
        }
    }

    /// Margins of 1 and 0.5 cd with errors of 1 cd at 3 standard errors: 9 and 36 times the rays, so that both take 36 times.
    #[test]
    fn all_that_is_unsure_must_be_settled() {
        let judged = |margin: f64, unseen: usize, verdict: Verdict| {
            let reading = Reading { value: 1.0, statistical: 1.0, geometric: Some(0.0), cells: 0.0 };
            let noise = Noise { other: 1.0, ..NONE };
            let surety = margin / 3.0;
            let decisive = Decisive { reading, direction: [margin, 0.0], margin, sigmas: 3.0, surety, noise };
            Judgement { verdict, decisive: Some(decisive), unseen }
        };
        let unsure =
            [judged(0.5, 0, Verdict::Unsure), judged(1.0, 0, Verdict::Unsure), judged(9.0, 0, Verdict::Pass)];
        let rays = Judgement::what_settles_all(&unsure, 1000, None).unwrap().rays as f64;
        assert!((rays / 36_000.0 - 1.0).abs() < 2e-3, "{rays}");
        assert_eq!(Judgement::worst(&unsure).unwrap().decisive.unwrap().margin, 0.5);
        // Of an unknown number of rays nothing follows, and none settles what lies beyond the field.
        assert_eq!(Judgement::what_settles_all(&unsure, 0, None), None);
        let beyond = [judged(0.5, 0, Verdict::Unsure), judged(1.0, 1, Verdict::Unsure)];
        assert_eq!(Judgement::what_settles_all(&beyond, 1000, None), None);
    }

    /// A geometric error of three times the margin's third leaves no room: it must come down to 1/√2 of that, known tolerance or not.
    #[test]
    fn facets_are_asked_to_be_finer_where_their_tolerance_is_not_known() {
        let reading = Reading { value: 1.0, statistical: 0.1, geometric: Some(1.0), cells: 0.0 };
        let unsure = Decisive {
            reading,
            direction: [0.0; 2],
            margin: 1.0,
            sigmas: 3.0,
            surety: 0.0,
            noise: Noise { other: 0.01, ..NONE },
        };
        for (tolerance_mm, finer_mm) in [(None, None), (Some(0.3), Some(0.1 * 0.5f64.sqrt()))] {
            let settles = unsure.what_settles(1000, tolerance_mm).unwrap();
            assert!((settles.tolerance_share.unwrap() - 0.5f64.sqrt() / 3.0).abs() < 1e-12);
            assert_eq!(settles.tolerance_mm.map(|t| (1e9 * t).round()), finer_mm.map(|t| (1e9 * t).round()));
        }
    }

    /// Errors fall with the root of the rays, what may hide in darkness with their number.
    #[test]
    fn what_settles_follows_from_what_few_rays_leave_open() {
        let rays = |noise: Noise| {
            let reading = Reading { value: 1.0, statistical: 1.0, geometric: Some(0.0), cells: 0.0 };
            Decisive { reading, direction: [0.0, 0.0], margin: 1.0, sigmas: 3.0, surety: 0.0, noise }
                .what_settles(1000, None)
                .map(|settles| settles.rays as f64 / 1000.0)
        };
        let spread = Noise { counted: 4.0, ..NONE };
        assert!((rays(spread).unwrap() / 36.0 - 1.0).abs() < 2e-3);
        let dark = Noise { ray_cd: 4.0, counted: 0.0, ..spread };
        assert!((rays(dark).unwrap() / 27.0 - 1.0).abs() < 0.01, "{:?}", rays(dark));
    }

    /// The brightest of the many readings of a zone must lie farther above its limit than three errors of one: what leaves it unsure is an
    /// error of the reading all the same.
    #[test]
    fn a_reading_chosen_from_many_has_the_error_of_the_luckiest() {
        let mut regulation = Regulation::find("UN R112 B passing").unwrap();
        regulation.function.rows.retain(|row| row.id == "Zone III");
        let limit = regulation.function.rows[0].max.unwrap();
        let assumptions = Assumptions { as_placed: true, ..Assumptions::default() };
        let judged = |cd: f64| {
            let lamp = map(|_, _| cd, 0.1, 0.01);
            let row = assess(&lamp, &regulation, &assumptions).unwrap().rows.remove(0);
            let reading = row.reading.unwrap();
            (row.verdict.unwrap(), (limit - reading.value) / reading.known_error().hypot(reading.cells))
        };
        let all: Vec<(Verdict, f64)> = (0..200).map(|k| judged(0.01 * f64::from(k) * limit)).collect();
        for (verdict, errors) in &all {
            assert!(*verdict != Verdict::Unsure || errors.abs() < SIGMAS, "unsure at {errors} errors");
        }
        for wanted in [Verdict::Pass, Verdict::Unsure, Verdict::Fail] {
            assert!(all.iter().any(|(verdict, _)| *verdict == wanted));
        }
    }
}

//! The figure of a run that facets get most wrong, against the standard error that the whole run will have.

use super::figures::figure_in_words;
use super::geometric_error::{EndErrors, FaceError, GeometricError, ReceiverError};
use crate::math::FaceId;
use crate::simulate::scene::Sampling;
use crate::simulate::{BoundScene, Power, RunSettings};

/// Standard errors of sums over a scrambled net fall with the number of rays to this power: 0.52 to 0.68 for power, positions and
/// widths on the three scenes of the fixtures from 2¹⁴ to 2²⁰ rays.
const NET_ORDER: f64 = 0.6;
/// The same of independent random numbers, and of cells, each of which few rays reach.
const RANDOM_ORDER: f64 = 0.5;
/// Errors below this share of a figure are negligible.
const NEGLIGIBLE: f64 = 1e-6;
/// Ratio up to which two figures are as wrong as one another.
const AS_WRONG: f64 = 1.01;
/// The largest multiple of a standard error that is reported: beyond it that error counts as none.
const LARGEST_RATIO: f64 = 1e9;

/// The figure that facets get most wrong.
#[derive(Clone, Debug, Default)]
pub(super) struct Worst {
    /// Geometric over allowed error.
    pub(super) ratio: f64,
    /// Geometric error as a share of the figure, `None` where that is 0, and its name.
    pub(super) share: Option<f64>,
    pub(super) figure: String,
    /// Whether the rays alone err by less than is anybody's concern, so that the ratio is no multiple of their error.
    is_certain: bool,
}

/// Finds the figure whose geometric error is largest against the statistical one that a run of `scale` times the pilot's rays will have,
/// among them those of the faces that the scene lists; a ratio of 0 and no name where facets change nothing. `ends` are the pilot's
/// statistical errors of the powers by where light ended.
pub(super) fn worst_figure(
    bound: &BoundScene,
    (error, ends): (&GeometricError, &Power),
    settings: &RunSettings,
    scale: f64,
) -> Worst {
    let order = if settings.sampling == Sampling::Sobol { NET_ORDER } else { RANDOM_ORDER };
    let [sums, cells] = [scale.powf(-order), scale.powf(-RANDOM_ORDER)];
    let mut worst = Worst::default();
    for r in &error.receivers {
        each_figure(r, [sums, cells], &mut |figure, geometric, allowed, value| {
            worst.weigh([&r.name, figure], geometric, allowed, value);
        });
    }
    for a in &error.absorbed {
        let figure = format!("absorbed in {}", a.r#in);
        worst.weigh([&a.name, &figure], a.power.geometric(), a.statistical * sums, a.power.spline);
    }
    for f in listed_faces(bound, error) {
        let name = format!("face {} of {}", f.face, bound.instance_of(FaceId(f.face)));
        let powers = [("absorbed", f.absorbed), ("entered", f.entered), ("left", f.left)];
        for ((figure, power), statistical) in powers.into_iter().zip(f.statistical) {
            worst.weigh([&name, figure], power.geometric(), statistical * sums, power.spline);
        }
    }
    let mut all_light = Worst::default();
    all_light.weigh_ends(&error.power, ends, sums);
    // What a receiver or body has as much of is named by these.
    if all_light.ratio > AS_WRONG * worst.ratio { all_light } else { worst }
}

/// Returns the faces that the scene will list: those that absorb and let out most on the spline.
fn listed_faces<'e>(bound: &BoundScene, error: &'e GeometricError) -> Vec<&'e FaceError> {
    let mut faces: Vec<&FaceError> = error.faces.iter().collect();
    // Stable: faces of equal power stay in the order of the model, as in the results.
    faces.sort_by(|a, b| b.listed_power().total_cmp(&a.listed_power()));
    faces.truncate(bound.listed_faces());
    faces
}

/// Calls `weigh` with every figure of a receiver: its name, its geometric error, the statistical one of the whole run, its value. `sums`
/// and `cells` are the factors from the pilot's statistical errors, of sums and of cells, to those of the whole run.
fn each_figure(r: &ReceiverError, [sums, cells]: [f64; 2], weigh: &mut dyn FnMut(&str, f64, f64, f64)) {
    let s = &r.statistical;
    weigh("power", r.power.geometric(), s.power * sums, r.power.spline);
    for c in &r.channels {
        weigh(&c.name, c.total.geometric(), c.statistical * sums, c.total.spline);
    }
    // Without a unit there are no cells: absorbed power alone is counted.
    if r.unit.is_empty() {
        return;
    }
    let size = r.rms[0].spline.hypot(r.rms[1].spline);
    for (axis, name) in ["1", "2"].into_iter().enumerate() {
        let (rms, centroid) = (&r.rms[axis], &r.centroid[axis]);
        weigh(&format!("rms_{name}"), rms.geometric(), s.rms[axis] * sums, rms.spline);
        // A position has no size of its own: what is negligible goes by that of the light.
        weigh(&format!("centroid_{name}"), centroid.geometric(), s.centroid[axis] * sums, size);
    }
    // One cell of the whole run, whose error falls with its own rays.
    weigh("max", r.peak.geometric(), s.peak * cells, r.peak.spline);
    weigh("cells", r.map.geometric.hypot(r.map.noise), s.map * cells, 1.0);
}

impl Worst {
    /// Takes the powers by where light ended, but for what a limit cut off, which is no figure of the true surfaces; `sums` is the factor
    /// from the statistical errors of the pilot to those of the whole run.
    fn weigh_ends(&mut self, errors: &EndErrors, statistical: &Power, sums: f64) {
        let powers = [
            ("received", errors.received, statistical.received),
            ("absorbed", errors.absorbed, statistical.absorbed),
            ("escaped", errors.escaped, statistical.escaped),
        ];
        for (figure, power, statistical) in powers {
            self.weigh(["all light", figure], power.geometric(), statistical * sums, power.spline);
        }
    }

    /// Takes a figure of `of`, with its geometric error, the statistical one of the whole run (`allowed`) and its value, in place of the
    /// worst so far if it is worse.
    fn weigh(&mut self, [of, figure]: [&str; 2], geometric: f64, allowed: f64, value: f64) {
        // What facets do not change, or not by a number, is no worst.
        if geometric.is_nan() || geometric <= 0.0 {
            return;
        }
        // No figure is asked for beyond a millionth of itself; of one that is 0 without an error no multiple is a number to be read.
        let negligible = NEGLIGIBLE * value.abs();
        let ratio = (geometric / allowed.max(negligible)).min(LARGEST_RATIO);
        if ratio > self.ratio {
            let share = (value != 0.0).then(|| geometric / value.abs());
            *self = Self { ratio, share, figure: format!("{of}: {figure}"), is_certain: allowed <= negligible };
        }
    }

    /// Writes which figure facets change most, by which share of it and of its standard error; "not at all" where they change none.
    pub(super) fn in_words(&self) -> String {
        if self.figure.is_empty() {
            return "not at all".into();
        }
        let by = self.share.map_or_else(|| "where it is 0".into(), |s| format!("by {} %", two_digits(100.0 * s)));
        let figure = figure_in_words(&self.figure);
        if self.is_certain {
            return format!("{figure} {by}, where the pilot's rays give no standard error");
        }
        format!("{figure} {by}, {} times its standard error", two_digits(self.ratio))
    }
}

/// Writes a number with two significant digits: more are noise, as the pilot has a few thousand rays.
fn two_digits(value: f64) -> String {
    if value <= 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let unit = 10f64.powf(value.log10().floor() - 1.0);
    let decimals = (-unit.log10()).round().max(0.0) as usize;
    format!("{:.decimals$}", (value / unit).round() * unit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::geometric_error::Paired;

    #[test]
    fn two_digits_are_told() {
        let told = [477.48, 12.3, 4.04, 0.519, 0.0123, 99.7].map(two_digits);
        assert_eq!(told, ["480", "12", "4.0", "0.52", "0.012", "100"]);
    }

    #[test]
    fn light_that_no_receiver_counts_is_weighed() {
        let power = |facets: f64, spline: f64| Paired { facets, spline, error: 0.0 };
        let errors = EndErrors { received: power(0.6, 0.6), escaped: power(0.39, 0.4), ..Default::default() };
        let statistical = Power { received: 1e-3, escaped: 4e-3, ..Default::default() };
        let mut worst = Worst::default();
        worst.weigh_ends(&errors, &statistical, 0.5);
        // 0.01 of 0.4, and of half of 0.004.
        assert_eq!(worst.in_words(), "all light: escaped by 2.5 %, 5.0 times its standard error");
    }

    #[test]
    fn a_figure_of_zero_without_error_has_no_endless_multiple() {
        let mut worst = Worst::default();
        worst.weigh(["lamp", "absorbed"], 0.0, 0.0, 0.0);
        assert_eq!(worst.in_words(), "not at all");
        worst.weigh(["lamp", "absorbed"], 1e-4, 0.0, 0.0);
        assert_eq!(worst.in_words(), "lamp: absorbed where it is 0, where the pilot's rays give no standard error");
        assert_eq!(worst.ratio, LARGEST_RATIO);
        let mut worst = Worst::default();
        worst.weigh(["lamp", "rms_1"], 0.2, 0.05, 2.0);
        assert_eq!(worst.in_words(), "lamp: rms 1 by 10 %, 4.0 times its standard error");
    }
}

//! The figures that a run prints for each receiver, each with both its errors.
//!
//! Where no ray arrived the rays have no spread, which is not an error of 0: what one ray adds is stated instead. Three times that
//! is the limit of 95 % of what may be there (the rule of three: of n rays none arrives with probability e⁻³ where 3/n of them should).

use super::geometric_error::{GeometricError, Paired, ReceiverError};
use crate::math::{error_beside_unseen_ray, error_of_maximum};
use crate::optics::{MAX_EFFICACY, observer_peaks};
use crate::simulate::{ChannelResult, ReceiverResult, Results};
use serde::Serialize;

/// Dominant cause of the error of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Limit {
    /// The number of rays.
    Statistics,
    /// The facets.
    Geometry,
}

/// A figure with both its errors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// The value found.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Standard error from the number of rays.
    pub statistical: f64,
    /// Error from the facets and from light that was lost, one standard error; of lost light alone on the spline, absent where not
    /// measured.
    pub geometric: Option<f64>,
    /// Which of the two is larger.
    pub limited_by: Limit,
}

impl Figure {
    /// Makes a figure, and says which of its errors is the larger; statistics where the geometric one is not known.
    pub(crate) fn new(value: f64, unit: &str, statistical: f64, geometric: Option<f64>) -> Self {
        let limited_by =
            // Without a measured geometric error the number of rays is all there is to blame.
            if geometric.is_some_and(|g| g > statistical) { Limit::Geometry } else { Limit::Statistics };
        Self { value, unit: unit.into(), statistical, geometric, limited_by }
    }

    /// Returns both errors together; the statistical one alone where the facets were not judged.
    pub fn combined(&self) -> f64 {
        self.geometric.map_or(self.statistical, |geometric| self.statistical.hypot(geometric))
    }
}

/// The figures of one receiver.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReceiverFigures {
    /// Power counted.
    pub power: Figure,
    /// The largest cell; absent, as all that follow, where only power is counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<Figure>,
    /// Root mean square distance from the centre along the first axis; absent, as all places, where [`ReceiverResult::has_place`] says so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_1: Option<Figure>,
    /// Root mean square distance from the centre along the second axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_2: Option<Figure>,
    /// Mean position along the first axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centroid_1: Option<Figure>,
    /// Mean position along the second axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centroid_2: Option<Figure>,
    /// Sums of the further channels.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub channels: Vec<ChannelFigure>,
}

/// The sum of a further channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelFigure {
    /// Name of the channel.
    pub name: String,
    /// Its sum over the receiver.
    #[serde(flatten)]
    pub figure: Figure,
}

impl ReceiverFigures {
    /// Goes through all of them with their names, as in `results.json`; those that are absent are left out.
    pub fn named(&self) -> impl Iterator<Item = (&str, &Figure)> {
        let places = [
            ("max", &self.max),
            ("rms_1", &self.rms_1),
            ("rms_2", &self.rms_2),
            ("centroid_1", &self.centroid_1),
            ("centroid_2", &self.centroid_2),
        ];
        std::iter::once(("power", &self.power))
            .chain(places.into_iter().filter_map(|(n, f)| Some((n, f.as_ref()?))))
            .chain(self.channels.iter().map(|c| (c.name.as_str(), &c.figure)))
    }
}

/// Writes the name of a figure for people, `mean position 1` for `centroid_1`; what stands before it, as in `focus: rms_1`, stays.
pub fn figure_in_words(name: &str) -> String {
    let (receiver, figure) = name.split_at(name.rfind(": ").map_or(0, |colon| colon + 2));
    let axis = |known: &str| figure.strip_prefix(known).filter(|axis| matches!(*axis, "1" | "2"));
    match (axis("rms_"), axis("centroid_")) {
        (Some(axis), _) => format!("{receiver}rms {axis}"),
        (_, Some(axis)) => format!("{receiver}mean position {axis}"),
        _ => name.into(),
    }
}

/// What a run was traced on, as the errors of its figures depend on it.
#[derive(Clone, Copy, Debug)]
pub enum TracedGeometry<'a> {
    /// On the surfaces themselves.
    Spline,
    /// On facets, whose errors were measured.
    Facets(&'a GeometricError),
    /// On facets that were not compared with the spline.
    Unmeasured,
}

/// Returns the figures of every receiver of a run; `unit` is that of powers, `W` or `lm`.
pub fn figures(results: &Results, geometry: TracedGeometry<'_>, unit: &str) -> Vec<ReceiverFigures> {
    let receivers = results.receivers.iter().enumerate();
    receivers.map(|(k, r)| Errors::new(results, geometry, k).figures(r, unit)).collect()
}

/// Returns the standard error of each cell, in `r.unit`; where no light arrived, what one ray would add to the cell. Empty without cells.
pub fn cell_errors(r: &ReceiverResult) -> Vec<f64> {
    let stated = |k: usize| if r.cells[k] > 0.0 { r.errors[k] } else { r.ray_cells[k] };
    (0..r.cells.len()).map(stated).collect()
}

/// Returns the error of cells relative to their light, both weighted by that light: Σ cσ / Σ c² over the cells with light. `None` without
/// light. Dark cells add nothing, because their error is what one ray would bring, and of many such it would be all there is.
pub fn light_weighted_error(cells: &[f64], errors: &[f64]) -> Option<f64> {
    let lit = || cells.iter().zip(errors).filter(|(light, _)| **light > 0.0);
    let weight: f64 = lit().map(|(light, _)| light * light).sum();
    (weight > 0.0).then(|| lit().map(|(light, error)| light * error).sum::<f64>() / weight)
}

/// Returns the standard error of each cell of a channel, as [`cell_errors`], in the channel's unit. A ray's lumens or CIE values are
/// those of the mean ray on the receiver.
pub fn channel_cell_errors(r: &ReceiverResult, c: &ChannelResult) -> Vec<f64> {
    let worth = channel_worth(r, c);
    let stated = |k: usize| if c.cells[k] > 0.0 { c.errors[k] } else { worth * r.ray_cells[k] };
    (0..c.cells.len()).map(stated).collect()
}

fn largest_of(cells: &[f64]) -> f64 {
    cells.iter().copied().fold(0.0, f64::max)
}

/// Returns what a channel counts of a watt on the receiver on average: lumens or CIE values, on a dark receiver the most that light of any
/// wavelength has; 1 for a bin, which counts power.
pub(crate) fn channel_worth(r: &ReceiverResult, c: &ChannelResult) -> f64 {
    let [x, y, z] = observer_peaks().map(|peak| MAX_EFFICACY * peak);
    let most = match c.name.as_str() {
        "X" => x,
        "Y" | "lm" => y,
        "Z" => z,
        _ => return 1.0,
    };
    // Where no light arrived nothing is known of its colour.
    if r.power > 0.0 { c.total / r.power } else { most }
}

/// Seconds that the next halving of either error would cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Halving {
    /// Four times the rays, of which this run has traced the first: a net needs fewer.
    pub statistical_seconds: f64,
    /// A run at half the tolerance; absent where the facets were not judged or are the surface itself.
    pub geometric_seconds: Option<f64>,
    /// A run on the spline, which has no such error.
    pub spline_seconds: Option<f64>,
}

/// Tracing on facets takes about a tenth longer for each halving of the tolerance.
const SLOWER_A_HALVING: f64 = 1.1;

/// Estimates what the next halving of either error would cost, from the seconds of the run and of the rays that judged its facets; those
/// for facets are absent where these were not judged.
pub fn halving(results: &Results, geometric: Option<&GeometricError>) -> Halving {
    let s = &results.seconds;
    let judged = geometric.filter(|e| e.rays > 0);
    Halving {
        // Four times the rays halve the error of independent ones; this run has traced a quarter of them.
        statistical_seconds: 3.0 * s.trace,
        // Facets go with the inverse of the tolerance.
        geometric_seconds: judged.map(|_| 2.0 * (s.tessellate + s.build) + SLOWER_A_HALVING * s.trace),
        spline_seconds: judged.map(|e| e.seconds[1] * results.rays as f64 / e.rays as f64),
    }
}

/// Times the mean of the cells around it from which on a cell is a spot of its own.
const STANDS_OUT: f64 = 4.0;

/// What is known of the geometric errors of one receiver.
struct Errors<'a> {
    geometry: TracedGeometry<'a>,
    measured: Option<&'a ReceiverError>,
    /// Light that was lost: it might have fallen on any receiver, so it is an error of every one, on the spline too.
    lost_power: f64,
    lost_share: f64,
    /// See [`GeometricError::unseen_power`].
    unseen_power: f64,
    /// Rays that compared facets and spline, as a share of those of the run.
    compared: f64,
}

impl<'a> Errors<'a> {
    /// Gathers what is known of the geometric errors of receiver `receiver`.
    fn new(results: &Results, geometry: TracedGeometry<'a>, receiver: usize) -> Self {
        let measured = match geometry {
            TracedGeometry::Facets(error) => error.receivers.get(receiver),
            _ => None,
        };
        let lost_power = results.power.lost;
        let unseen_power = match geometry {
            TracedGeometry::Facets(error) => error.unseen_power(results.power.emitted),
            _ => 0.0,
        };
        let compared = match geometry {
            TracedGeometry::Facets(error) if error.rays > 0 => error.rays as f64 / results.rays.max(1) as f64,
            _ => f64::INFINITY,
        };
        Self {
            geometry,
            measured,
            compared,
            lost_power,
            lost_share: lost_power / results.power.emitted.max(f64::MIN_POSITIVE),
            unseen_power,
        }
    }

    /// Returns the geometric error of a figure: `of_facets` and `lost`, what lost rays might add to it, in quadrature; `lost` alone on the
    /// spline, `None` where the facets were not judged. Where no ray that compared facets and spline came to the receiver, `unmet` stands
    /// in place of `of_facets`.
    fn geometric(&self, lost: f64, unmet: f64, of_facets: impl Fn(&ReceiverError) -> f64) -> Option<f64> {
        let of_facets = |m: &ReceiverError| if self.is_unmet() { unmet } else { of_facets(m) };
        match self.geometry {
            TracedGeometry::Spline => Some(lost),
            TracedGeometry::Facets(_) => self.measured.map(|m| of_facets(m).hypot(lost)),
            TracedGeometry::Unmeasured => None,
        }
    }

    /// Makes the figures of a receiver, each with both its errors; for absorbed power only that and channels.
    fn figures(&self, r: &ReceiverResult, unit: &str) -> ReceiverFigures {
        let power = self.geometric(self.lost_power, self.unseen_power, |m| m.power.geometric_or(self.unseen_power));
        let is_dark = r.power <= 0.0;
        let power = Figure::new(r.power, unit, error_beside_unseen_ray(r.power, r.power_error, r.ray_power), power);
        let channels = self.channels(r, unit);
        // Absorbed power has neither cells nor places.
        if r.kind == "absorbed" {
            return ReceiverFigures {
                power,
                channels,
                max: None,
                rms_1: None,
                rms_2: None,
                centroid_1: None,
                centroid_2: None,
            };
        }
        // The brightest place was measured over squares of cells: what facets change of it is taken as a share.
        let [cells, errors] = r.cells_with_even_poles();
        let brightest = (0..cells.len()).max_by(|&a, &b| cells[a].total_cmp(&cells[b]));
        // Of a dark receiver too: lost light spread over all of it.
        let whole = if self.lost_power > 0.0 { r.whole_lit_measure() } else { 0.0 };
        let lost = (self.lost_share * r.max).hypot(if whole > 0.0 { self.lost_power / whole } else { 0.0 });
        let max = self.geometric(lost, self.unmet_maximum(r), |m| {
            let square = if m.peak.facets > 0.0 { r.max / m.peak.facets } else { 1.0 } * m.peak.geometric();
            // The run may have its brightest cell elsewhere than the few rays that compared had theirs, where facets change nothing.
            let geometric = r.with_joined_cells(&m.cells);
            let cell = brightest.and_then(|k| geometric.get(k)).copied();
            let unmet = brightest.map_or(0.0, |k| self.unmet_peak(&cells, r, k, m.peak_cells));
            cell.map_or(square, |cell| square.max(cell)).max(unmet)
        });
        // Of a map too large to compare nothing is known.
        let max = max.filter(|_| self.measured.is_none_or(ReceiverError::has_cells));
        let length = if matches!(r.kind, "plane" | "disc") { "mm" } else { "deg" };
        let size = (0..2).filter(|&axis| r.has_place(axis)).map(|axis| r.rms[axis]).fold(0.0, f64::hypot);
        // Light that was lost might have fallen anywhere on the receiver: so far, `off`, from where the other has its mean, or its width.
        let lost_share = self.lost_power / (r.power + self.lost_power).max(f64::MIN_POSITIVE);
        let lost = |axis: usize, off: f64| lost_share * (r.half[axis] / 3f64.sqrt()).hypot(off);
        let place =
            |axis: usize, [values, errors]: [[f64; 2]; 2], off: f64, paired: fn(&ReceiverError) -> &[Paired; 2]| {
                let geometric = self.geometric(lost(axis, off), size, |m| paired(m)[axis].geometric());
                r.has_place(axis).then(|| Figure::new(values[axis], length, errors[axis], geometric))
            };
        let rms = |axis: usize| place(axis, [r.rms, r.rms_error], r.rms[axis], |m| &m.rms);
        let centroid = |axis: usize| {
            place(axis, [r.centroid, r.centroid_error], r.centroid[axis] - r.middle[axis], |m| &m.centroid)
        };
        let largest = if is_dark {
            largest_of(&r.ray_cells)
        } else {
            error_of_maximum(cells.iter().zip(errors.iter()).map(|(&cell, &error)| [cell, error]))
        };
        ReceiverFigures {
            power,
            max: Some(Figure::new(r.max, r.unit, largest, max)),
            rms_1: rms(0),
            rms_2: rms(1),
            centroid_1: centroid(0),
            centroid_2: centroid(1),
            channels,
        }
    }

    /// Whether no ray that compared facets and spline came to the receiver: of light that did come, nothing but its power is known.
    fn is_unmet(&self) -> bool {
        self.compared.is_finite() && self.measured.is_some_and(|m| m.power.facets == 0.0 && m.power.spline == 0.0)
    }

    /// The geometric error of the largest cell of a receiver that no comparing ray came to: all of it, of a dark one what an unseen ray
    /// brings.
    fn unmet_maximum(&self, r: &ReceiverResult) -> f64 {
        let of_ray = largest_of(&r.ray_cells) / r.ray_power.max(f64::MIN_POSITIVE);
        if r.max > 0.0 { r.max } else { self.unseen_power * of_ray }
    }

    /// Returns what may be wrong of the value of the cell `brightest` that stands far above the square of `side` cells around it: such a
    /// spot is judged by as many of the comparing rays as came to it alone, and by fewer than one not at all.
    fn unmet_peak(&self, cells: &[f64], r: &ReceiverResult, brightest: usize, side: usize) -> f64 {
        let [nx, ny] = r.grid;
        let around = |at: usize, n: usize| at.saturating_sub(side / 2)..(at + side.div_ceil(2)).min(n);
        let [columns, rows] = [around(brightest % nx, nx), around(brightest / nx, ny)];
        let count = columns.len() * rows.len();
        let light: f64 = rows.map(|y| cells[y * nx..][columns.clone()].iter().sum::<f64>()).sum();
        let value = cells[brightest];
        if value * count as f64 <= STANDS_OUT * light {
            return 0.0;
        }
        let rays = self.compared * value / r.ray_cells[brightest].max(f64::MIN_POSITIVE);
        value / rays.max(1.0)
    }

    /// Makes the figures of a receiver's channels; `unit` is that of powers, which bins are given in.
    fn channels(&self, r: &ReceiverResult, unit: &str) -> Vec<ChannelFigure> {
        let of_channel = |(k, c): (usize, &ChannelResult)| {
            let of_facets = |m: &ReceiverError| m.channels.get(k).map_or(0.0, |c| c.total.geometric());
            let unmet = if c.total > 0.0 { c.total } else { channel_worth(r, c) * self.unseen_power };
            let geometric = self.geometric(self.lost_share * c.total, unmet, of_facets);
            let unit = c.total_unit(unit);
            let statistical = if c.total > 0.0 { c.error } else { channel_worth(r, c) * r.ray_power };
            ChannelFigure { name: c.name.clone(), figure: Figure::new(c.total, unit, statistical, geometric) }
        };
        r.channels.iter().enumerate().map(of_channel).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brighter_cells_count_for_more_and_dark_ones_for_nothing() {
        let cells = [3.0, 1.0, 0.0, f64::NAN];
        // Where no ray arrived, what one would bring; by hand (3 · 0.3 + 1 · 0.3) / (3² + 1²).
        let found = light_weighted_error(&cells, &[0.3, 0.3, 5.0, 5.0]).unwrap();
        assert!((found - 0.12).abs() < 1e-15, "{found}");
        assert_eq!(light_weighted_error(&[0.0; 4], &[5.0; 4]), None);
    }

    #[test]
    fn figures_have_names_for_people() {
        assert_eq!(figure_in_words("rms_1"), "rms 1");
        assert_eq!(figure_in_words("focus: centroid_2"), "focus: mean position 2");
        // Receivers and channels keep the names that the scene gave them.
        assert_eq!(figure_in_words("rms_1: max"), "rms_1: max");
        assert_eq!(figure_in_words("rms_red"), "rms_red");
    }
}

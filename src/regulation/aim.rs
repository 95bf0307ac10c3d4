//! Where the beam is aimed before it is measured: the cut-off goes to the place that the regulation names.

use super::map::{IntensityMap, Sensor};
use super::table::CutOff;

/// How the map was turned before it was measured: a direction of the table is read `h_deg`, `v_deg` farther right and up.
#[derive(Clone, Debug, PartialEq)]
pub struct Aim {
    /// Degrees to the right.
    pub h_deg: f64,
    /// Degrees up.
    pub v_deg: f64,
    /// The gradient G of the cut-off where its scan is steepest; absent where none was looked for or the map does not hold the scan.
    pub gradient: Option<f64>,
    /// How the two were found, for people.
    pub how: String,
}

/// Step of the scans, degrees (UN R149, Annex 5, §2.3.1).
const STEP_DEG: f64 = 0.05;

/// Distance over which the gradient G = log₁₀ E(b) − log₁₀ E(b + 0.1°) is taken, degrees (§2.3.1).
const GRADIENT_DEG: f64 = 0.1;

/// Least gradient of a cut-off that the vertical scan may go by (§2.2.2) and of an elbow (§2.3.2).
const LEAST_GRADIENT: f64 = 0.13;
const LEAST_ELBOW_GRADIENT: f64 = 0.08;

/// Vertical scans look this far from the horizon, degrees: farther than a lamp is ever mounted askew.
const SCAN_V_DEG: f64 = 3.0;

/// The horizontal scan: 0.2° down, 5° to both sides (§2.3.2, a).
const ELBOW_V_DEG: f64 = -0.2;
const SCAN_H_DEG: f64 = 5.0;

/// Light that a photometer cannot tell from darkness, as a share of the brightest on the scan: without it the gradient would be
/// steepest where the last ray of a simulation fell, not at the edge of the light.
const DARK_SHARE: f64 = 0.01;

impl Aim {
    /// Turns nothing; `how` says why, for people.
    pub(super) fn unchanged(how: &str) -> Self {
        Self { h_deg: 0.0, v_deg: 0.0, gradient: None, how: how.to_owned() }
    }

    /// Finds the aim that brings the cut-off of a passing beam to its line, then its elbow to line A. The lamp stays as placed where the
    /// map does not hold the scan or has no cut-off on it, and sideways where it has no elbow.
    pub(super) fn by_cut_off(map: &IntensityMap, rule: CutOff) -> Self {
        // First up and down, then sideways: the scan for the elbow lies below the cut-off that was found.
        let Some(edge) = steepest_edge(map, |b| [rule.scan_h_deg, b], [-SCAN_V_DEG, SCAN_V_DEG], 1.0) else {
            return Self::unchanged("as placed: the far field does not hold the scan for the cut-off");
        };
        // What has no edge cannot be aimed by it; to turn the lamp by noise would be worse.
        if edge.gradient < LEAST_GRADIENT {
            let how = format!(
                "as placed: the steepest place at {}° is G = {:.3}, no cut-off (G of {LEAST_GRADIENT} and more)",
                rule.scan_h_deg, edge.gradient
            );
            return Self { gradient: Some(edge.gradient), ..Self::unchanged(&how) };
        }
        let gradient = Some(edge.gradient);
        let v_deg = edge.position - rule.line_v_deg;
        let vertical = format!(
            "cut-off found at {:.2}° on H = {}° (G = {:.2}) and read as {}°",
            edge.position, rule.scan_h_deg, edge.gradient, rule.line_v_deg
        );
        // To the right of the elbow the light reaches higher: the scan goes from light to dark towards the left.
        let scan = |h: f64| [h, ELBOW_V_DEG + v_deg];
        match steepest_edge(map, scan, [-SCAN_H_DEG, SCAN_H_DEG], -1.0) {
            Some(elbow) if elbow.gradient >= LEAST_ELBOW_GRADIENT => {
                let how =
                    format!("{vertical}; elbow found at {:.2}° and read as {}°", elbow.position, rule.elbow_h_deg);
                Self { h_deg: elbow.position - rule.elbow_h_deg, v_deg, gradient, how }
            }
            _ => {
                let how = format!("{vertical}; no elbow on 0.2° down, sideways as placed");
                Self { h_deg: 0.0, v_deg, gradient, how }
            }
        }
    }

    /// The same aim with every direction read `h_deg` farther right and `v_deg` farther up, as a regulation allows where a row fails.
    pub(super) fn realigned(&self, h_deg: f64, v_deg: f64) -> Self {
        let how = format!("{}; realigned by {h_deg}° and {v_deg}°", self.how);
        Self { h_deg: self.h_deg + h_deg, v_deg: self.v_deg + v_deg, gradient: self.gradient, how }
    }
}

/// The steepest place of a scan: its angle, degrees, and the gradient G there.
struct Edge {
    position: f64,
    gradient: f64,
}

/// Finds the steepest fall of log₁₀ E along a scan over `range`, degrees, towards larger angles for a `sign` of 1, smaller ones for −1.
/// `direction` gives H and V of an angle. `None` where the map does not hold two steps of the scan.
fn steepest_edge(
    map: &IntensityMap,
    direction: impl Fn(f64) -> [f64; 2],
    range: [f64; 2],
    sign: f64,
) -> Option<Edge> {
    // Half an opening to each side of the scanned point, as fine as the map allows: a wider one would blunt the edge.
    let sensor = Sensor { half_deg: 0.5 * map.coarsest_deg().max(STEP_DEG), round: false };
    let steps = ((range[1] - range[0]) / STEP_DEG).round() as usize;
    let positions = (0..=steps).map(|k| range[0] + STEP_DEG * k as f64);
    let readings: Vec<(f64, f64)> = positions
        .filter_map(|b| {
            // Places outside the far field are left out; fewer than two steps make no edge.
            let [h, v] = direction(b);
            Some((b, map.read(&map.measure(sensor, h, v)?).value))
        })
        .collect();
    let brightest = readings.iter().map(|r| r.1).fold(0.0, f64::max);
    let dark = DARK_SHARE * brightest;
    // The dark share bounds the logarithm, which has no end at zero. A scan that meets no light at all is flat.
    let level = |value: f64| if dark > 0.0 { (value.max(0.0) + dark).log10() } else { 0.0 };
    let span = (GRADIENT_DEG / STEP_DEG).round() as usize;
    let gradients = readings.windows(span + 1).map(|w| {
        let (first, last) = (w[0], w[span]);
        // The gradient belongs to the middle of its distance.
        (0.5 * (first.0 + last.0), sign * (level(first.1) - level(last.1)))
    });
    // Neighbours of the steepest place share in it: its centre is the mean of those within a step, weighed by their gradient.
    let gradients: Vec<(f64, f64)> = gradients.collect();
    let best = gradients.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let near = gradients.iter().filter(|g| (g.0 - best.0).abs() < 2.5 * STEP_DEG && g.1 > 0.5 * best.1);
    let (weight, sum) = near.fold((0.0, 0.0), |(w, s), g| (w + g.1, s + g.1 * g.0));
    let position = if weight > 0.0 { sum / weight } else { best.0 };
    Some(Edge { position, gradient: best.1 })
}

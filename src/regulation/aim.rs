//! Where the beam is aimed before it is measured: the cut-off goes to the place that the regulation names.

use super::few_rays::SIGMAS;
use super::map::{IntensityMap, Measurement, Sensor};
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
    /// Other aims that the errors of the map leave open, to the right and up, degrees: a row fails if it fails by all of them.
    pub rivals: Vec<[f64; 2]>,
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

/// Share of an edge's gradient from which on a place beside it counts to its middle: half of it, as for the width of a peak.
const SHARE_OF_EDGE: f64 = 0.5;

/// Places nearer than this to an edge are part of it, degrees.
const SAME_EDGE_DEG: f64 = 2.5 * STEP_DEG;

/// Most places that are looked at in an edge's stead: where noise leaves more open, these are enough to make rows unsure.
const MOST_RIVALS: usize = 12;

impl Aim {
    /// Turns nothing; `how` says why, for people.
    pub(super) fn unchanged(how: &str) -> Self {
        Self { h_deg: 0.0, v_deg: 0.0, gradient: None, how: how.to_owned(), rivals: Vec::new() }
    }

    /// Finds the aim that brings the cut-off of a passing beam to its line, then its elbow to line A. The lamp stays as placed where the
    /// map does not hold the scan or has no cut-off on it, and sideways where it has no elbow.
    pub(super) fn by_cut_off(map: &IntensityMap, rule: CutOff) -> Self {
        // First up and down, then sideways: the scan for the elbow lies below the cut-off that was found.
        let scan = Scan { range: [-SCAN_V_DEG, SCAN_V_DEG], sign: 1.0, least: LEAST_GRADIENT };
        let Some(edge) = scan.steepest_edge(map, |b| [rule.scan_h_deg, b]) else {
            return Self::unchanged("as placed: the far field does not hold the scan for the cut-off");
        };
        // Where another place may be the cut-off, the lamp is aimed by that too.
        let mut rivals: Vec<[f64; 2]> = Vec::new();
        for place in &edge.rivals {
            let v_deg = place - rule.line_v_deg;
            let elbow = find_elbow(map, v_deg);
            rivals.push([elbow.filter(Edge::is_found).map_or(0.0, |e| e.position - rule.elbow_h_deg), v_deg]);
        }
        let doubt = |edge: &Edge, what: &str| match edge.rivals.as_slice() {
            [] => String::new(),
            places => {
                let all = places.iter().chain([&edge.position]);
                let [low, high] =
                    all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(*p), high.max(*p)]);
                format!("; the errors of the map leave the {what} open from {low:.2}° to {high:.2}°")
            }
        };
        // What has no edge cannot be aimed by it; to turn the lamp by noise would be worse.
        if !edge.is_found() {
            let how = format!(
                "as placed: the steepest place at {}° is G = {:.3}, no cut-off (G of {LEAST_GRADIENT} and more){}",
                rule.scan_h_deg,
                edge.gradient,
                doubt(&edge, "cut-off")
            );
            return Self { gradient: Some(edge.gradient), rivals, ..Self::unchanged(&how) };
        }
        if edge.may_be_none {
            rivals.push([0.0, 0.0]);
        }
        let (gradient, v_deg) = (Some(edge.gradient), edge.position - rule.line_v_deg);
        let vertical = format!(
            "cut-off found at {:.2}° on H = {}° (G = {:.2}) and read as {}°{}",
            edge.position,
            rule.scan_h_deg,
            edge.gradient,
            rule.line_v_deg,
            doubt(&edge, "cut-off")
        );
        let elbow = find_elbow(map, v_deg);
        let h_deg = elbow.as_ref().filter(|e| e.is_found()).map_or(0.0, |e| e.position - rule.elbow_h_deg);
        for place in elbow.iter().flat_map(|e| &e.rivals) {
            rivals.push([place - rule.elbow_h_deg, v_deg]);
        }
        let how = match &elbow {
            Some(elbow) if elbow.is_found() => {
                if elbow.may_be_none {
                    rivals.push([0.0, v_deg]);
                }
                // Its place is as sure as the errors of the map leave the middle of the edge.
                let reach = SIGMAS * elbow.position_error;
                rivals.extend([-reach, reach].map(|d| [h_deg + d, v_deg]).into_iter().filter(|_| reach > 0.0));
                format!(
                    "{vertical}; elbow found at {:.2}° and read as {}°{}",
                    elbow.position,
                    rule.elbow_h_deg,
                    doubt(elbow, "elbow")
                )
            }
            Some(elbow) => {
                format!("{vertical}; no elbow at V = {ELBOW_V_DEG}°, sideways as placed{}", doubt(elbow, "elbow"))
            }
            None => format!("{vertical}; no elbow at V = {ELBOW_V_DEG}°, sideways as placed"),
        };
        let reach = SIGMAS * edge.position_error;
        rivals.extend([-reach, reach].map(|d| [h_deg, v_deg + d]).into_iter().filter(|_| reach > 0.0));
        Self { h_deg, v_deg, gradient, how, rivals }
    }

    /// The same aim with every direction read `h_deg` farther right and `v_deg` farther up, as a regulation allows where a row fails.
    pub(super) fn realigned(&self, h_deg: f64, v_deg: f64) -> Self {
        let how = format!("{}; realigned by {h_deg}° and {v_deg}°", self.how);
        let rivals = self.rivals.iter().map(|[h, v]| [h + h_deg, v + v_deg]).collect();
        Self { h_deg: self.h_deg + h_deg, v_deg: self.v_deg + v_deg, gradient: self.gradient, how, rivals }
    }

    /// Returns the aims that the errors of the map leave open besides this one, without rivals of their own.
    pub(super) fn open_aims(&self) -> impl Iterator<Item = Self> {
        let aim = |&[h_deg, v_deg]: &[f64; 2]| Self { h_deg, v_deg, rivals: Vec::new(), ..self.clone() };
        self.rivals.iter().map(aim)
    }
}

/// Looks for the elbow below a cut-off that is read `v_deg` farther up than it stands; `None` where the map does not hold the scan.
fn find_elbow(map: &IntensityMap, v_deg: f64) -> Option<Edge> {
    // To the right of the elbow the light reaches higher: the scan goes from light to dark towards the left.
    let scan = Scan { range: [-SCAN_H_DEG, SCAN_H_DEG], sign: -1.0, least: LEAST_ELBOW_GRADIENT };
    scan.steepest_edge(map, |h| [h, ELBOW_V_DEG + v_deg])
}

/// The steepest place of a scan.
struct Edge {
    /// Its angle, degrees.
    position: f64,
    /// Standard error of that from the noise of the map, degrees.
    position_error: f64,
    /// The gradient G there.
    gradient: f64,
    /// The least gradient of an edge of this kind.
    least: f64,
    /// Whether its gradient may be below that but for noise.
    may_be_none: bool,
    /// Other places, degrees, that the errors of the map leave open: as steep within [`SIGMAS`], and an edge.
    rivals: Vec<f64>,
}

impl Edge {
    /// Whether it is steep enough to be one.
    fn is_found(&self) -> bool {
        self.gradient >= self.least
    }
}

/// A way along which an edge is looked for.
struct Scan {
    /// Angles, degrees.
    range: [f64; 2],
    /// 1 where light falls towards larger angles, −1 towards smaller ones.
    sign: f64,
    /// Least gradient of an edge.
    least: f64,
}

/// A place of a scan with its gradient.
struct Slope {
    angle: f64,
    gradient: f64,
    /// What the gradient adds up, to first order in the light of the cells: for its error and that of differences.
    linear: Measurement,
}

impl Scan {
    /// Finds the steepest fall of log₁₀ E along the scan; `direction` gives H and V of an angle. `None` where the map does not hold two
    /// steps of it.
    fn steepest_edge(&self, map: &IntensityMap, direction: impl Fn(f64) -> [f64; 2]) -> Option<Edge> {
        let slopes = self.slopes(map, direction);
        let best = slopes.iter().max_by(|a, b| a.gradient.total_cmp(&b.gradient))?;
        let is_same = |s: &&Slope| (s.angle - best.angle).abs() < SAME_EDGE_DEG;
        // Neighbours of the steepest place share in it: its centre is the mean of those within a step, weighed by their gradient.
        let near: Vec<&Slope> =
            slopes.iter().filter(is_same).filter(|s| s.gradient > SHARE_OF_EDGE * best.gradient).collect();
        let weight: f64 = near.iter().map(|s| s.gradient).sum();
        let mean = near.iter().map(|s| s.gradient * s.angle).sum::<f64>() / weight;
        let position = if weight > 0.0 { mean } else { best.angle };
        // Of a weighed mean, to first order.
        let moved = near.iter().fold(Measurement::default(), |sum, s| {
            sum.plus((s.angle - position) / weight.max(f64::MIN_POSITIVE), &s.linear)
        });
        let error = |m: &Measurement| map.read(m).known_error();
        let reach = |s: &Slope| SIGMAS * error(&s.linear);
        // Places that may be steeper, and an edge, but for noise; the steepest first, each with all around it.
        let mut open: Vec<&Slope> = (slopes.iter().filter(|s| !is_same(s)))
            .filter(|s| s.gradient + reach(s) >= self.least)
            .filter(|s| {
                let difference = Measurement::default().plus(1.0, &best.linear).plus(-1.0, &s.linear);
                best.gradient - s.gradient < SIGMAS * error(&difference)
            })
            .collect();
        open.sort_by(|a, b| b.gradient.total_cmp(&a.gradient));
        let mut rivals: Vec<f64> = Vec::new();
        for place in open {
            if rivals.len() < MOST_RIVALS && rivals.iter().all(|r| (r - place.angle).abs() >= SAME_EDGE_DEG) {
                rivals.push(place.angle);
            }
        }
        // Of what is no edge as it stands, but may be one.
        if best.gradient < self.least && best.gradient + reach(best) >= self.least {
            rivals.push(position);
        }
        Some(Edge {
            position,
            position_error: error(&moved),
            gradient: best.gradient,
            least: self.least,
            may_be_none: best.gradient - reach(best) < self.least,
            rivals,
        })
    }

    /// Returns the gradients at all places of the scan that the map holds, by angle.
    fn slopes(&self, map: &IntensityMap, direction: impl Fn(f64) -> [f64; 2]) -> Vec<Slope> {
        // Half an opening to each side of the scanned point, as fine as the map allows: a wider one would blunt the edge.
        let sensor = Sensor { half_deg: 0.5 * map.coarsest_deg().max(STEP_DEG), round: false };
        let steps = ((self.range[1] - self.range[0]) / STEP_DEG).round() as usize;
        let angles = (0..=steps).map(|k| self.range[0] + STEP_DEG * k as f64);
        let readings: Vec<(f64, Measurement, f64)> = angles
            .filter_map(|angle| {
                // Places outside the far field are left out; fewer than two steps make no edge.
                let [h, v] = direction(angle);
                let measurement = map.measure(sensor, h, v)?;
                let value = map.read(&measurement).value;
                Some((angle, measurement, value))
            })
            .collect();
        let brightest = readings.iter().map(|r| r.2).fold(0.0, f64::max);
        // The dark share bounds the logarithm, which has no end at zero. A scan that meets no light at all is flat.
        let dark = DARK_SHARE * brightest;
        let lit = |value: f64| if dark > 0.0 { value.max(0.0) + dark } else { 1.0 };
        let span = (GRADIENT_DEG / STEP_DEG).round() as usize;
        let slope = |w: &[(f64, Measurement, f64)]| {
            let ((a, first, e), (b, last, f)) = (&w[0], &w[span]);
            // d log₁₀ E = dE / (E ln 10).
            let share = |value: f64| self.sign / (lit(value) * std::f64::consts::LN_10);
            Slope {
                // The gradient belongs to the middle of its distance.
                angle: 0.5 * (a + b),
                gradient: self.sign * (lit(*e).log10() - lit(*f).log10()),
                linear: Measurement::default().plus(share(*e), first).plus(-share(*f), last),
            }
        };
        readings.windows(span + 1).map(slope).collect()
    }
}

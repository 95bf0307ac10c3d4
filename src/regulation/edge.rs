//! Where light falls off most along a scan: the cut-off of a beam, and its elbow.

use super::few_rays::SIGMAS;
use super::map::IntensityMap;
use super::opening::CellWeights;

/// Step of the scans, degrees (UN R149, Annex 5, §2.3.1).
const STEP_DEG: f64 = 0.05;

/// Distance over which the gradient G = log₁₀ E(b) − log₁₀ E(b + 0.1°) is taken, degrees (§2.3.1).
const GRADIENT_DEG: f64 = 0.1;
/// [`GRADIENT_DEG`] in steps of the scan.
const STEPS_OF_GRADIENT: usize = (GRADIENT_DEG / STEP_DEG).round() as usize;

/// Half the opening that scans are made with, degrees: a detector of 30 mm at 25 m, however wide the cells are.
pub(super) const SCAN_HALF_DEG: f64 = 0.0344;

/// Light that a photometer cannot distinguish from darkness, as a share of the brightest on the scan: without it the gradient would be
/// steepest where the last ray of a simulation fell, not at the edge of the light.
const DARK_SHARE: f64 = 0.01;

/// Share of an edge's gradient from which on a place beside it counts to its middle: half of it, as for the width of a peak.
const SHARE_OF_EDGE: f64 = 0.5;

/// Places nearer than this to an edge are part of it, degrees: as wide as an edge of light is that passes for a cut-off. Their weight falls
/// towards there, so that no place moves the middle by coming in or leaving.
const SAME_EDGE_DEG: f64 = 0.25;

/// Rounds of the search for an edge's middle, each of which brings it at least as near again.
const ROUNDS: usize = 12;

/// The middle of an edge is moved by its places' noise, and its window with it, which adds to that: at most so many times.
const MOST_FEEDBACK: f64 = 5.0;

/// An edge is seen in the cell that it lies in: at most half its width off.
const MOST_BLUR: f64 = 0.5;

/// Open places nearer than this to each other are looked at as one, degrees.
const SAME_PLACE_DEG: f64 = 2.0 * STEP_DEG;

/// An edge is the border of a bright and a dark area: for half a degree light does not fall again on its one side, nor rise on its
/// other, so that their means differ by no less than the light right beside it.
const AREA_DEG: f64 = 0.5;
/// [`AREA_DEG`] in steps of the scan.
const STEPS_OF_AREA: usize = (AREA_DEG / STEP_DEG).round() as usize;

/// The steepest place of a scan.
pub(super) struct Edge {
    /// Its angle, degrees.
    pub(super) position: f64,
    /// Standard error of that by both errors of the map, degrees; that of facets where it is known.
    pub(super) position_error: f64,
    /// The gradient G there.
    pub(super) gradient: f64,
    /// The least gradient of an edge of this kind.
    least: f64,
    /// Whether its gradient may be below that but for noise.
    pub(super) may_be_none: bool,
    /// Other places, degrees, that the errors of the map leave open: as steep within [`SIGMAS`], and an edge. No open place is farther from
    /// all of these than [`SAME_PLACE_DEG`].
    pub(super) rivals: Vec<f64>,
}

impl Edge {
    /// Whether it is steep enough to be one.
    pub(super) fn is_found(&self) -> bool {
        self.gradient >= self.least
    }
}

/// Returns how far, across it, an edge of this gradient may lie from where cells of this width let it be seen, at [`SIGMAS`], degrees.
/// Light of such a gradient falls by 10^(G · width / 0.1°) over a cell, and the cells do not resolve where within: half the square of that
/// exponent, in widths, was not passed by beams of closed form in cells of 0.025° to 0.149°.
pub(super) fn blur_by_cells(gradient: f64, cell_deg: f64) -> f64 {
    let decades = gradient * cell_deg / GRADIENT_DEG;
    cell_deg * (0.5 * decades * decades).min(MOST_BLUR)
}

/// A way along which an edge is looked for.
pub(super) struct Scan {
    /// Angles, degrees.
    pub(super) range: [f64; 2],
    /// 1 where light falls towards larger angles, −1 towards smaller ones.
    pub(super) sign: f64,
    /// Half the opening across and up, degrees.
    pub(super) half_deg: [f64; 2],
    /// Least gradient of an edge.
    pub(super) least: f64,
}

/// A place of a scan with its gradient.
struct Slope {
    angle: f64,
    gradient: f64,
    /// A gradient that is reached next to it, and by how much that may be smaller, at [`SIGMAS`].
    reached: [f64; 2],
    /// Gradients that it cannot pass, each with how much greater that may be at [`SIGMAS`]: its own, and that between the areas beside it.
    bounds: [[f64; 2]; 2],
    /// What the gradient adds up, to first order in the light of the cells: for the error of the edge's middle.
    linear: CellWeights,
}

impl Slope {
    /// The gradient that is surely reached next to it.
    fn sure(&self) -> f64 {
        self.reached[0] - self.reached[1]
    }

    /// Whether its gradient may be as great as that, which may itself be smaller by `less`.
    fn may_reach(&self, [gradient, less]: [f64; 2]) -> bool {
        self.bounds.iter().all(|[most, more]| most + more.hypot(less) >= gradient)
    }
}

/// A reading: its value and standard error, cd.
type Light = [f64; 2];

impl Scan {
    /// Finds the steepest fall of log₁₀ E along the scan, of those that are sure; `direction` gives H and V of an angle. `None` where
    /// the map does not hold two steps of it.
    pub(super) fn steepest_edge(&self, map: &IntensityMap, direction: impl Fn(f64) -> [f64; 2]) -> Option<Edge> {
        let slopes = self.slopes(map, direction);
        let sure = slopes.iter().max_by(|a, b| a.sure().total_cmp(&b.sure()))?;
        let beside = slopes.iter().filter(|s| (s.angle - sure.angle).abs() < SAME_EDGE_DEG);
        let best = beside.max_by(|a, b| a.gradient.total_cmp(&b.gradient))?;
        let (position, moved) = middle_of_edge(&slopes, best);
        // Places that may be steeper, and an edge, but for noise.
        let open = (slopes.iter().filter(|s| (s.angle - position).abs() >= SAME_EDGE_DEG))
            .filter(|s| s.may_reach([self.least, 0.0]) && s.may_reach(sure.reached));
        let mut rivals: Vec<f64> = Vec::new();
        for place in open.map(|s| s.angle) {
            if rivals.last().is_none_or(|last| place - last > SAME_PLACE_DEG) {
                rivals.push(place);
            }
        }
        // Of what is no edge as it stands, but may be one.
        if best.gradient < self.least && best.may_reach([self.least, 0.0]) {
            rivals.push(position);
        }
        Some(Edge {
            position,
            position_error: map.read(&moved).known_error(),
            gradient: best.gradient,
            least: self.least,
            may_be_none: sure.sure() < self.least,
            rivals,
        })
    }

    /// Returns the gradients at all places of the scan that the map holds, by angle.
    fn slopes(&self, map: &IntensityMap, direction: impl Fn(f64) -> [f64; 2]) -> Vec<Slope> {
        let steps = ((self.range[1] - self.range[0]) / STEP_DEG).round() as usize;
        let angles = (0..=steps).map(|k| self.range[0] + STEP_DEG * k as f64);
        // Places outside the far field are left out; fewer than two steps make no edge.
        let places: Vec<Place> = angles
            .filter_map(|angle| {
                let weights = map.measure_slit(self.half_deg, direction(angle))?;
                let light = map.read_with_dark(&weights);
                Some(Place { angle, weights, light })
            })
            .collect();
        let brightest = places.iter().map(|place| place.light[0]).fold(0.0, f64::max);
        let decades = Decades { dark: DARK_SHARE * brightest };
        (0..places.len().saturating_sub(STEPS_OF_GRADIENT)).map(|k| self.slope(map, &places, &decades, k)).collect()
    }

    /// Returns the gradient from the `low`-th place to the one that [`GRADIENT_DEG`] is taken to.
    fn slope(&self, map: &IntensityMap, places: &[Place], decades: &Decades, low: usize) -> Slope {
        let (high, last) = (low + STEPS_OF_GRADIENT, places.len() - 1);
        let fall = |[below, above]: [Light; 2]| {
            decades.fall(if self.sign > 0.0 { [below, above] } else { [above, below] })
        };
        let [steepness, _, more] = fall([places[low].light, places[high].light]);
        let below = &places[low.saturating_sub(STEPS_OF_AREA)..=low];
        let above = &places[high..=(high + STEPS_OF_AREA).min(last)];
        let [most, _, most_more] = fall([mean_light(map, below), mean_light(map, above)]);
        // Over several steps light falls as steeply in one of them at least as on the mean of all.
        let wider = 0..=low.min(last - high).min(STEPS_OF_AREA / 2 - 1);
        let reached = wider.map(|beyond| {
            let steps = (STEPS_OF_GRADIENT + 2 * beyond) as f64 / STEPS_OF_GRADIENT as f64;
            let [gradient, less, _] = fall([places[low - beyond].light, places[high + beyond].light]);
            [gradient / steps, less / steps]
        });
        let surest = reached.max_by(|a, b| (a[0] - a[1]).total_cmp(&(b[0] - b[1])));
        // d log₁₀ E = dE / (E ln 10).
        let share = |light: Light| self.sign / (decades.above_dark(light[0]) * std::f64::consts::LN_10);
        let (first, last) = (&places[low], &places[high]);
        let linear =
            CellWeights::default().plus(share(first.light), &first.weights).plus(-share(last.light), &last.weights);
        Slope {
            // The gradient belongs to the middle of its distance.
            angle: 0.5 * (first.angle + last.angle),
            gradient: steepness,
            reached: surest.unwrap_or([steepness, f64::INFINITY]),
            bounds: [[steepness, more], [most, most_more]],
            linear,
        }
    }
}

/// A place of a scan, what the opening adds up there, and the light that it reads.
struct Place {
    angle: f64,
    weights: CellWeights,
    light: Light,
}

/// Returns the mean reading at places, cd, and its standard error, in which cells that several of them share count once.
fn mean_light(map: &IntensityMap, places: &[Place]) -> Light {
    let share = 1.0 / places.len() as f64;
    map.read_with_dark(&places.iter().fold(CellWeights::default(), |sum, place| sum.plus(share, &place.weights)))
}

/// Logarithms of light above a darkness, cd: it bounds the logarithm, which has no end at zero. A scan that meets no light at all is flat.
struct Decades {
    dark: f64,
}

impl Decades {
    /// Light above the darkness, whose logarithm is taken.
    fn above_dark(&self, value: f64) -> f64 {
        if self.dark > 0.0 { value.max(0.0) + self.dark } else { 1.0 }
    }

    /// The fall of log₁₀ E from a bright to a faint light, and how much less and more it may be at [`SIGMAS`].
    fn fall(&self, [bright, faint]: [Light; 2]) -> [f64; 3] {
        let up = |[value, error]: Light| (self.above_dark(value + SIGMAS * error) / self.above_dark(value)).log10();
        let down =
            |[value, error]: Light| (self.above_dark(value) / self.above_dark(value - SIGMAS * error)).log10();
        let decades = (self.above_dark(bright[0]) / self.above_dark(faint[0])).log10();
        [decades, down(bright).hypot(up(faint)), up(bright).hypot(down(faint))]
    }
}

/// Returns the middle of the edge around its steepest place, degrees, and what that adds up, to first order: the mean of the places,
/// weighed by what they have above half the steepest gradient and by how near they are.
fn middle_of_edge(slopes: &[Slope], best: &Slope) -> (f64, CellWeights) {
    let steep = |s: &Slope| (s.gradient - SHARE_OF_EDGE * best.gradient).max(0.0);
    let near = |s: &Slope, middle: f64| (1.0 - ((s.angle - middle) / SAME_EDGE_DEG).powi(2)).max(0.0);
    let mut middle = best.angle;
    let mut weight = 0.0;
    for _ in 0..ROUNDS {
        weight = slopes.iter().map(|s| steep(s) * near(s, middle)).sum();
        // A flat scan has no middle but where it was taken.
        if best.gradient <= 0.0 || weight <= 0.0 {
            return (best.angle, CellWeights::default());
        }
        middle = slopes.iter().map(|s| steep(s) * near(s, middle) * s.angle).sum::<f64>() / weight;
    }
    let mut moved = CellWeights::default();
    let mut follows = 0.0;
    for s in slopes.iter().filter(|s| steep(s) * near(s, middle) > 0.0) {
        let lever = (s.angle - middle) / weight;
        moved = moved.plus(lever * near(s, middle), &s.linear);
        moved = moved.plus(-lever * near(s, middle) * SHARE_OF_EDGE, &best.linear);
        follows += steep(s) * 2.0 * lever * (s.angle - middle) / SAME_EDGE_DEG.powi(2);
    }
    let feedback = 1.0 / (1.0 - follows).max(1.0 / MOST_FEEDBACK);
    (middle, CellWeights::default().plus(feedback, &moved))
}

//! Where the beam is aimed before it is measured: the cut-off goes to the place that the regulation names.

use super::edge::{Edge, SCAN_HALF_DEG, Scan, blur_by_cells};
use super::few_rays::SIGMAS;
use super::map::IntensityMap;
use super::table::CutOff;

/// How the map was turned before it was measured: a direction of the table is read `h_deg`, `v_deg` farther right and up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aim {
    /// Degrees to the right.
    pub h_deg: f64,
    /// Degrees up.
    pub v_deg: f64,
    /// The gradient G of the cut-off where its scan is steepest; absent where none was looked for or the map does not hold the scan.
    pub gradient: Option<f64>,
    /// How the two were found, for people.
    pub how: String,
    /// Other aims that the errors of the map leave open, to the right and up, degrees: a row is sure where it is so by all of them.
    pub rivals: Vec<[f64; 2]>,
    /// How far the errors of the map may have moved the aim: where each of its independent causes brings it at three standard errors to
    /// either side, degrees to the right and up. What a row reads there is an error of its reading.
    pub moved: Vec<[[f64; 2]; 2]>,
    /// The same by the width of the map's cells, within which the position of the fall-off is unknown.
    pub blurred: Vec<[[f64; 2]; 2]>,
}

/// Least gradient of an elbow, per 0.1° (UN R149 00, Annex 5, §2.3.2).
const LEAST_ELBOW_GRADIENT: f64 = 0.08;

/// Vertical scans look this far from the horizon, degrees: farther than a lamp is ever mounted askew.
const SCAN_V_DEG: f64 = 3.0;

/// Half the width of the opening of the vertical scan, degrees: the cut-off is level within 0.2° from 1.5° to 3.5° left (there, §2.2.3),
/// and a wider opening measures its height with less noise.
const LEVEL_HALF_DEG: f64 = 0.5;

/// V of the horizontal scan, degrees (there, §2.3.2, a).
const ELBOW_V_DEG: f64 = -0.2;
/// The horizontal scan goes this far to both sides, degrees.
const SCAN_H_DEG: f64 = 5.0;

/// A shoulder that a level scan meets is as sharp across as the cut-off, and by so much flatter along the scan: at most by the inverse sine
/// of 10°, where 15° are usual.
const MOST_SLANT: f64 = 5.76;

/// Most aims by which rows are judged. Where more are open nearly all of the map is noise: those used are spaced to stay within the limit.
const MOST_RIVALS: usize = 150;

/// Smaller turns count as the same aim, degrees: they move a reading on the steepest cut-off, of G = 1, by 1 %.
const LEAST_TURN_DEG: f64 = 5e-4;

/// Scans for elbows that lie nearer to each other than this are one, degrees: the width of their opening.
const SAME_SCAN_DEG: f64 = 2.0 * SCAN_HALF_DEG;

impl Aim {
    /// Turns nothing; `how` says why, for people.
    pub(super) fn unchanged(how: &str) -> Self {
        Self { how: how.to_owned(), ..Self::default() }
    }

    /// Finds the aim that brings the cut-off of a passing beam to its line, then its elbow to line A. The lamp stays as placed where the
    /// map does not hold the scan or has no cut-off on it, and sideways where it has no elbow.
    pub(super) fn by_cut_off(map: &IntensityMap, rule: CutOff) -> Self {
        // First up and down, then sideways: the scan for the elbow lies below the cut-off that was found.
        let scan = Scan {
            range: [-SCAN_V_DEG, SCAN_V_DEG],
            sign: 1.0,
            half_deg: [LEVEL_HALF_DEG, SCAN_HALF_DEG],
            least: rule.least_gradient,
        };
        let Some(edge) = scan.steepest_edge(map, |b| [rule.scan_h_deg, b]) else {
            return Self::unchanged("as placed: the far field does not hold the scan for the cut-off");
        };
        // Where another place may be the cut-off, the lamp is aimed by that too, and then by every elbow that it may have.
        let mut open: Vec<[f64; 2]> = Vec::new();
        for place in &edge.rivals {
            open.extend(Sideways::below(map, rule, place - rule.line_v_deg, edge.gradient).aims());
        }
        let gradient = Some(edge.gradient);
        // What has no edge cannot be aimed by it; to turn the lamp by noise would be worse.
        if !edge.is_found() {
            let how = format!(
                "as placed: the steepest place at {} is G = {:.3}, no cut-off (G of {} and more){}",
                angle_text(rule.scan_h_deg),
                edge.gradient,
                rule.least_gradient,
                doubt(&edge, "cut-off")
            );
            return Self { gradient, rivals: thinned(open), ..Self::unchanged(&how) };
        }
        if edge.may_be_none {
            open.push([0.0, 0.0]);
        }
        let v_deg = edge.position - rule.line_v_deg;
        let below = |v_deg: f64| Sideways::below(map, rule, v_deg, edge.gradient);
        let sideways = below(v_deg);
        open.extend(sideways.others.iter().map(|h| [*h, v_deg]));
        // Its place is as sure as noise leaves the middle of the edge.
        let mut moved = Vec::from_iter(sideways.moved.map(|ends| ends.map(|h| [h, v_deg])));
        let reach = SIGMAS * edge.position_error;
        if reach > LEAST_TURN_DEG {
            let ends = [v_deg - reach, v_deg + reach].map(below);
            moved.push([0, 1].map(|k| [ends[k].h_deg, ends[k].v_deg]));
            // Other elbows are the same, but where the scan for them goes elsewhere.
            if reach > SAME_SCAN_DEG {
                open.extend(ends.iter().flat_map(|end| end.others.iter().map(|h| [*h, end.v_deg])));
            }
        }
        let mut blurred = Vec::from_iter(sideways.blurred.map(|ends| ends.map(|h| [h, v_deg])));
        let blur = blur_by_cells(edge.gradient, map.coarsest_deg());
        if blur > LEAST_TURN_DEG {
            blurred.push([v_deg - blur, v_deg + blur].map(|v_deg| [below(v_deg).h_deg, v_deg]));
        }
        let how = format!(
            "cut-off found at {} on H = {} (G = {:.2}) and aimed to {}{}; {}",
            angle_text(edge.position),
            angle_text(rule.scan_h_deg),
            edge.gradient,
            angle_text(rule.line_v_deg),
            doubt(&edge, "cut-off"),
            sideways.how
        );
        Self { h_deg: sideways.h_deg, v_deg, gradient, how, rivals: thinned(open), moved, blurred }
    }

    /// The same aim, what it leaves open turned with it, with every direction read `h_deg` farther right and `v_deg` farther up, as a
    /// regulation allows where a row fails.
    pub(super) fn realigned(&self, h_deg: f64, v_deg: f64) -> Self {
        let how = format!("{}; realigned by {} and {}", self.how, angle_text(h_deg), angle_text(v_deg));
        let turned = |[h, v]: [f64; 2]| [h + h_deg, v + v_deg];
        Self {
            h_deg: self.h_deg + h_deg,
            v_deg: self.v_deg + v_deg,
            gradient: self.gradient,
            how,
            rivals: self.rivals.iter().copied().map(turned).collect(),
            moved: self.moved.iter().map(|ends| ends.map(turned)).collect(),
            blurred: self.blurred.iter().map(|ends| ends.map(turned)).collect(),
        }
    }

    /// Returns the aims that the errors of the map leave open besides this one, without rivals and errors of their own.
    pub(super) fn open_aims(&self) -> impl Iterator<Item = Self> {
        self.rivals.iter().copied().map(Self::turned_by)
    }

    /// Turns that far to the right and up, degrees, and no farther.
    pub(super) fn turned_by([h_deg, v_deg]: [f64; 2]) -> Self {
        Self { h_deg, v_deg, ..Self::default() }
    }
}

/// What the errors of the map leave open of an edge, for people; empty where they leave nothing.
fn doubt(edge: &Edge, what: &str) -> String {
    if edge.rivals.is_empty() {
        return String::new();
    }
    let all = edge.rivals.iter().chain([&edge.position]);
    let [low, high] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(*p), high.max(*p)]);
    format!("; the errors of the map leave the {what} open from {} to {}", angle_text(low), angle_text(high))
}

/// Writes an angle for people, to a hundredth of a degree: `−0.58°`, with a minus sign, as all numbers of the report.
fn angle_text(angle_deg: f64) -> String {
    let hundredths = (100.0 * angle_deg).round();
    // Zero has no sign.
    format!("{}°", hundredths / 100.0 + 0.0).replace('-', "−")
}

/// Returns at most [`MOST_RIVALS`] of the aims, spread over all of them.
fn thinned(aims: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let every = aims.len().div_ceil(MOST_RIVALS).max(1);
    aims.into_iter().step_by(every).collect()
}

/// How a lamp may be turned sideways for one cut-off.
struct Sideways {
    /// By the elbow found, or as placed.
    h_deg: f64,
    v_deg: f64,
    /// Others that the errors of the map leave open.
    others: Vec<f64>,
    /// Where noise may have moved the elbow to, at three standard errors to either side.
    moved: Option<[f64; 2]>,
    /// The same by the width of the cells.
    blurred: Option<[f64; 2]>,
    /// For people.
    how: String,
}

impl Sideways {
    /// Looks for the elbow below a cut-off of this gradient that is read `v_deg` farther up than it stands.
    fn below(map: &IntensityMap, rule: CutOff, v_deg: f64, gradient: f64) -> Self {
        let as_placed = |others, how| Self { h_deg: 0.0, v_deg, others, moved: None, blurred: None, how };
        let Some(elbow_h_deg) = rule.elbow_h_deg else {
            return as_placed(Vec::new(), "sideways as placed".into());
        };
        // To the right of the elbow the light reaches higher: the scan goes from light to dark towards the left.
        let scan = Scan {
            range: [-SCAN_H_DEG, SCAN_H_DEG],
            sign: -1.0,
            half_deg: [SCAN_HALF_DEG; 2],
            least: LEAST_ELBOW_GRADIENT,
        };
        let none = format!("no elbow at V = {}, sideways as placed", angle_text(ELBOW_V_DEG));
        let Some(elbow) = scan.steepest_edge(map, |h| [h, ELBOW_V_DEG + v_deg]) else {
            return as_placed(Vec::new(), none);
        };
        let mut others: Vec<f64> = elbow.rivals.iter().map(|place| place - elbow_h_deg).collect();
        if !elbow.is_found() {
            return as_placed(others, none + &doubt(&elbow, "elbow"));
        }
        if elbow.may_be_none {
            others.push(0.0);
        }
        let h_deg = elbow.position - elbow_h_deg;
        let reach = SIGMAS * elbow.position_error;
        let moved = (reach > LEAST_TURN_DEG).then_some([h_deg - reach, h_deg + reach]);
        let across = elbow.gradient.max(gradient);
        let slant = (across / elbow.gradient).min(MOST_SLANT);
        let blur = slant * blur_by_cells(across, map.coarsest_deg());
        let blurred = (blur > LEAST_TURN_DEG).then_some([h_deg - blur, h_deg + blur]);
        let doubt = doubt(&elbow, "elbow");
        let how = format!(
            "elbow found at {} and aimed to {}{doubt}",
            angle_text(elbow.position),
            angle_text(elbow_h_deg)
        );
        Self { h_deg, v_deg, others, moved, blurred, how }
    }

    /// All aims, that of the elbow found first.
    fn aims(&self) -> impl Iterator<Item = [f64; 2]> {
        [self.h_deg].into_iter().chain(self.others.iter().copied()).map(|h| [h, self.v_deg])
    }
}

#[cfg(test)]
mod tests {
    use super::super::table::Regulation;
    use super::super::test_lamps::{map, map_of_means, normal, passing, uniform};
    use super::*;

    fn rule() -> CutOff {
        Regulation::find("UN R112 B passing").unwrap().function.cut_off.unwrap()
    }

    #[test]
    fn angles_of_an_aim_have_minus_signs_and_words_their_hyphens() {
        assert_eq!([-0.5812, -2.5, 0.004, -0.004, 1.0].map(angle_text), ["−0.58°", "−2.5°", "0°", "0°", "1°"]);
        let aim = Aim::by_cut_off(&map_of_means(passing(0.3, -0.21), 0.05), rule()).realigned(-0.25, 0.0);
        assert!(aim.how.starts_with("cut-off found at −"), "{}", aim.how);
        assert!(aim.how.ends_with("; realigned by −0.25° and 0°"), "{}", aim.how);
        let has_hyphen = |text: &str| text.as_bytes().windows(2).any(|w| w[0] == b'-' && w[1].is_ascii_digit());
        assert!(!has_hyphen(&aim.how), "{}", aim.how);
    }

    /// Cells of 0.149° are the widest that UN R112 allows, those of 0.025° half as wide as the edge is soft.
    #[test]
    fn the_aim_hardly_hangs_on_the_width_of_the_cells() {
        for place in [[0.3, -0.21], [-0.62, 0.17], [0.05, 0.44]] {
            let beam = passing(place[0], place[1]);
            let aim = |cell: f64| Aim::by_cut_off(&map_of_means(&beam, cell), rule());
            let fine = aim(0.025);
            for (cell, most) in [(0.1, 0.01), (0.148, 0.02)] {
                let coarse = aim(cell);
                assert!((coarse.v_deg - fine.v_deg).abs() < most, "{cell}: {coarse:?} for {fine:?}");
                // The shoulder rises by 15°: what moves the scan up moves the elbow by four times that.
                assert!((coarse.h_deg - fine.h_deg).abs() < 6.0 * most, "{cell}: {coarse:?} for {fine:?}");
            }
        }
    }

    /// Without noise, the aim by cells of any width reaches that by cells of 0.02° within what the width leaves open.
    #[test]
    fn what_cells_leave_open_reaches_the_true_aim() {
        for (k, cell) in [0.05, 0.0625, 0.1, 0.125, 0.148].into_iter().cycle().take(15).enumerate() {
            let beam = passing(0.137 * k as f64 - 0.9, 0.5 - 0.071 * k as f64);
            let [coarse, fine] = [cell, 0.02].map(|cell| Aim::by_cut_off(&map_of_means(&beam, cell), rule()));
            let reach = |axis: usize| -> f64 {
                let widths = coarse.blurred.iter().map(|[from, to]| 0.5 * (from[axis] - to[axis]));
                widths.map(|width| width * width).sum::<f64>().sqrt()
            };
            let off = [(coarse.h_deg - fine.h_deg).abs(), (coarse.v_deg - fine.v_deg).abs()];
            // The finer cells are not endlessly fine.
            assert!((0..2).all(|axis| off[axis] <= reach(axis) + 5e-3), "{cell}: {coarse:?} for {fine:?}");
            assert!(reach(1) < 0.6 * cell && reach(0) < 5.0 * cell, "{cell}: {coarse:?}");
        }
    }

    /// Rays of 3, 30 and 300 cd in a cell: three errors of the aim that is found, or another that is open, reach that of the beam itself.
    #[test]
    fn the_errors_of_an_aim_reach_the_true_one() {
        let mut uniform = uniform(20_261_124);
        for k in 0..30 {
            let ray = [3.0, 30.0, 300.0][k % 3];
            let mut noise = |value: f64| {
                let error = (ray * value).sqrt();
                [(value + error * normal(&mut uniform)).max(0.0), error]
            };
            let beam = passing(0.1 * (k / 3) as f64 - 0.5, 0.3 - 0.06 * (k / 3) as f64);
            let truth = Aim::by_cut_off(&map(&beam, 1e-6, 0.0), rule());
            let found = Aim::by_cut_off(&map(&beam, 0.0, 0.0).with_noise(&mut noise), rule());
            let off = |[h, v]: [f64; 2]| [(h - truth.h_deg).abs(), (v - truth.v_deg).abs()];
            let reach = |axis: usize| -> f64 {
                found.moved.iter().map(|[from, to]| 0.5 * (from[axis] - to[axis]).abs()).sum()
            };
            let [h, v] = off([found.h_deg, found.v_deg]);
            let is_within = h <= reach(0) && v <= reach(1);
            // Open places are checked a tenth of a degree apart, each for all that is as near to it.
            let is_rival = found.rivals.iter().map(|rival| off(*rival)).any(|[h, v]| h < 0.25 && v < 0.15);
            assert!(is_within || is_rival, "{ray}: {found:?} for {truth:?}");
        }
    }

    /// At 5 cd a ray the dark side has forty rays in a cell: its places are taken for elbows as seldom as three errors are passed, by
    /// 1.35 of a thousand; of 800 in ten lamps, so that five or more have a probability below 1 %.
    #[test]
    fn noise_of_the_dark_is_no_elbow() {
        let mut uniform = uniform(20_261_125);
        let mut noise = |value: f64| {
            let error = (5.0 * value).sqrt();
            [(value + error * normal(&mut uniform)).max(0.0), error]
        };
        let in_the_dark = (0..10).map(|_| {
            let found = Aim::by_cut_off(&map(passing(0.2, 0.1), 0.0, 0.0).with_noise(&mut noise), rule());
            found.rivals.iter().filter(|[h, _]| *h < found.h_deg - 1.0).count()
        });
        assert!(in_the_dark.sum::<usize>() < 5);
    }
}

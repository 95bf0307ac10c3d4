//! The tables of regulations: what is asked, in which direction, and where the figure comes from.

use serde::Deserialize;
use serde_json::Value;

/// A file of tables and the name under which its functions are asked for.
const FILES: [(&str, &str); 6] = [
    ("UN R112", include_str!("tables/un_r112_r149-00_asymmetric.json")),
    ("UN R149-01", include_str!("tables/un_r149-01.json")),
    ("UN R113", include_str!("tables/un_r113_r149-00_symmetric.json")),
    ("UN R148-01", include_str!("tables/un_r148_signalling.json")),
    ("FMVSS 108", include_str!("tables/us_fmvss108_headlamps.json")),
    ("FMVSS 108", include_str!("tables/us_fmvss108_signals.json")),
];

/// Which side of the road a beam is made for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Traffic {
    /// Right-hand traffic, as the tables are written.
    #[default]
    Right,
    /// Left-hand traffic: the tables mirrored.
    Left,
}

impl Traffic {
    /// `right` or `left`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Left => "left",
        }
    }
}

/// A lamp function of a regulation: its rows and how they are measured.
///
/// ```
/// use lampyris::regulation::Regulation;
/// let beam = Regulation::find("UN R112 B passing")?;
/// assert!(beam.function.rows.iter().any(|row| row.id == "75R" && row.min.is_some()));
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug)]
pub struct Regulation {
    /// The name it is asked for by, such as `UN R149-01 C passing`.
    pub id: String,
    /// Title of the tables.
    pub title: String,
    /// The rows.
    pub function: Function,
    /// What the file says of measuring and aiming.
    pub(super) rules: Rules,
}

/// The rows of a lamp function.
#[derive(Clone, Debug, Deserialize)]
pub struct Function {
    id: String,
    /// What the function is called.
    pub name: String,
    /// How points and groups go together (FMVSS 108).
    point_rule: Option<String>,
    /// What is asked.
    pub rows: Vec<Row>,
}

impl Function {
    /// The share of its own minimum that each point of a group must reach although the group is judged by its sum, 0 for none; `None` where
    /// each point stands for itself.
    pub(super) fn point_floor(&self) -> Option<f64> {
        // FMVSS 108 has two ways: each point at least 60 % of its figure, or any share of it when its group's sum
        // is met.
        match self.point_rule.as_deref() {
            Some("floor-60") => Some(0.6),
            Some("group-alternative") => Some(0.0),
            _ => None,
        }
    }
}

/// One requirement.
#[derive(Clone, Debug, Deserialize)]
pub struct Row {
    /// What it is: `point`, `line`, `zone`, `sum`, `relative`, `imax`, `distribution_point`, `group_sum` or `note`.
    pub kind: String,
    /// Its name in the table.
    pub id: String,
    /// Direction, degrees to the right.
    pub h: Option<f64>,
    /// Direction, degrees up.
    pub v: Option<f64>,
    /// Ends of a line, degrees.
    pub(super) h0: Option<f64>,
    pub(super) v0: Option<f64>,
    pub(super) h1: Option<f64>,
    pub(super) v1: Option<f64>,
    /// Corners of a zone, degrees.
    pub polygon: Option<Vec<[f64; 2]>>,
    /// Directions of a sum, degrees.
    pub(super) points: Option<Vec<[f64; 2]>>,
    /// Least intensity, candela.
    pub min: Option<f64>,
    /// Greatest intensity, candela.
    pub max: Option<f64>,
    /// Of a relative row: `min` or `max`, the factor, and the row that it is a multiple of, or `imax`.
    pub(super) bound: Option<String>,
    pub(super) factor: Option<f64>,
    pub(super) of: Option<String>,
    /// Rows of one group are weighed together.
    pub(super) group: Option<u32>,
    /// The condition under which the row holds.
    pub when: Option<String>,
    /// A remark on the row.
    pub note: Option<String>,
    /// Where the figure comes from.
    pub source: String,
    /// `two` where a second source was compared, `one` otherwise.
    pub evidence: String,
}

impl Row {
    /// Adds a remark behind what there is.
    pub(super) fn add_note(&mut self, remark: &str) {
        self.note = Some(self.note.take().map_or_else(|| remark.to_owned(), |note| format!("{note}; {remark}")));
    }
}

/// How a file says that its rows are measured.
#[derive(Clone, Debug, Default)]
pub(super) struct Rules {
    /// Half the opening of the photometer, degrees.
    pub(super) sensor_half_deg: f64,
    pub(super) sensor_round: bool,
    /// A row is met when it is met within this angle of its direction.
    pub(super) tolerance_deg: f64,
    /// The cut-off is brought to its place before measuring.
    pub(super) cut_off: Option<CutOff>,
}

/// How a beam with a cut-off is aimed.
#[derive(Clone, Copy, Debug)]
pub(super) struct CutOff {
    /// The vertical scan, degrees to the left.
    pub(super) scan_h_deg: f64,
    /// Where its sharpest place goes.
    pub(super) line_v_deg: f64,
    /// The line that the elbow is brought to.
    pub(super) elbow_h_deg: f64,
    /// How far the lamp may be turned from there where a row fails.
    pub(super) realignment: Realignment,
}

/// How far a lamp may be turned where a row fails.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(super) struct Realignment {
    pub(super) left_deg: f64,
    pub(super) right_deg: f64,
    /// Up and down.
    pub(super) vertical_deg: f64,
}

/// Half the smallest opening that R148 allows, 10 minutes of arc, degrees.
const SIGNAL_SENSOR_DEG: f64 = 10.0 / 60.0 / 2.0;

/// Half the opening where a file names none: that of R112 and R149, 65 mm at 25 m.
const SENSOR_65MM_DEG: f64 = 0.0745;

impl Regulation {
    /// All functions there are tables of, file by file.
    pub fn all() -> Vec<Self> {
        FILES.iter().flat_map(|(prefix, text)| read_table(prefix, text)).collect()
    }

    /// Finds a function by its name; upper and lower case, spaces and dashes do not matter, and a name that fits the beginning of others
    /// means the first of them (`FMVSS 108 stop` is one lighted section).
    ///
    /// # Errors
    /// When there is none; the message names those that come nearest.
    pub fn find(id: &str) -> Result<Self, String> {
        let plain = |s: &str| -> String {
            // Spaces and dashes are written in many ways.
            s.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
        };
        let wanted = plain(id);
        let all = Self::all();
        let exact = all.iter().find(|r| plain(&r.id) == wanted);
        let begins = || all.iter().find(|r| !wanted.is_empty() && plain(&r.id).starts_with(&wanted));
        if let Some(found) = exact.or_else(begins) {
            return Ok(found.clone());
        }
        // Five letters name a family: `unr11`, `fmvss`.
        let family = |r: &&Self| plain(&r.id).chars().take(5).eq(wanted.chars().take(5));
        let mut near: Vec<&str> = all.iter().filter(family).map(|r| r.id.as_str()).take(12).collect();
        if near.is_empty() {
            near = vec!["UN R112 B passing", "UN R149-01 C passing", "UN R148-01 stop-S1", "FMVSS 108 LB2V"];
        }
        Err(format!("no regulation is called '{id}'; there are {} … (`assess --list` shows all)", near.join(", ")))
    }

    /// Says, in a sentence for people, how far the rows were compared with a second source.
    pub fn checked(&self) -> String {
        let two = self.function.rows.iter().filter(|r| r.evidence == "two").count();
        format!(
            "{two} of {} rows were compared with a second source, the others have one; compare with the text in force before relying on them",
            self.function.rows.len()
        )
    }
}

/// A table as it stands in its file.
#[derive(Deserialize)]
struct File {
    title: String,
    #[serde(default)]
    measurement: Value,
    #[serde(default)]
    aim: Value,
    point_tolerance_deg: Option<f64>,
    driving_tolerance_deg: Option<f64>,
    functions: Vec<Function>,
}

/// Returns how far a lamp may be turned, degrees, by a table's `aim`: after the 01 series for the prefix `UN R149-01`, else after R112
/// and the 00 series of R149.
///
/// # Panics
/// When the table states none.
fn realignment(prefix: &str, aim: &Value) -> Realignment {
    // UN R149 widened the turn to the left with its 01 series; both files state both.
    let series = if prefix == "UN R149-01" { "r149_01" } else { "r112_and_r149_00" };
    Realignment::deserialize(&aim["realign_if_failed"][series])
        .unwrap_or_else(|e| panic!("table of {prefix}: realign_if_failed, {series}: {e}"))
}

/// Reads the regulations of a table of the program, one a lamp function, each called by `prefix` and the function's name.
///
/// # Panics
/// When the text is no table.
fn read_table(prefix: &str, text: &str) -> Vec<Regulation> {
    // The tables are part of the program: a test reads each of them.
    let file: File = serde_json::from_str(text).unwrap_or_else(|e| panic!("table of {prefix}: {e}"));
    let number = |v: &Value, path: &str| v.pointer(path).and_then(Value::as_f64);
    file.functions
        .into_iter()
        .map(|function| {
            let driving = function.id.starts_with("driving");
            let sensor =
                // Two names for the same figure stand in the tables.
                number(&file.measurement, "/receiver_half_deg").or(number(&file.measurement, "/sensor_half_deg"));
            let signal = prefix == "UN R148-01" || file.title.contains("signal lamps");
            let reaim = number(&file.measurement, "/reaim_deg").or(number(&file.measurement, "/tolerance_deg"));
            let tolerance = file.point_tolerance_deg.or(file.driving_tolerance_deg.filter(|_| driving)).or(reaim);
            let scan = number(&file.aim, "/instrumental_vertical/scan_h_deg");
            let cut_off = scan.filter(|_| function.id.starts_with("passing")).map(|scan_h_deg| CutOff {
                scan_h_deg,
                // What UN R112 and R149 have in common for those files that do not repeat it.
                line_v_deg: number(&file.aim, "/vertical/line_b_deg").unwrap_or(-0.57),
                elbow_h_deg: number(&file.aim, "/horizontal_visual/line_a_deg").unwrap_or(0.5),
                realignment: realignment(prefix, &file.aim),
            });
            let id = match function.id.split_once('-') {
                // People say `C passing`, the tables `passing-C`.
                Some((beam @ ("passing" | "driving"), class)) => format!("{prefix} {class} {beam}"),
                _ => format!("{prefix} {}", function.id),
            };
            let rules = Rules {
                sensor_half_deg: sensor.unwrap_or(if signal { SIGNAL_SENSOR_DEG } else { SENSOR_65MM_DEG }),
                sensor_round: prefix == "FMVSS 108",
                // Where the text grants no tolerance, a row holds in its very direction.
                tolerance_deg: tolerance.unwrap_or(0.0),
                cut_off,
            };
            Regulation { id, title: file.title.clone(), function, rules }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_table_is_read_and_every_row_says_where_it_comes_from() {
        let all = Regulation::all();
        let rows: usize = all.iter().map(|r| r.function.rows.len()).sum();
        assert_eq!(rows, 1868);
        for row in all.iter().flat_map(|r| &r.function.rows) {
            assert!(!row.source.is_empty() && ["one", "two"].contains(&row.evidence.as_str()), "{}", row.id);
            let asks = row.min.is_some() || row.max.is_some() || row.factor.is_some() || row.kind == "note";
            assert!(asks, "{} asks nothing", row.id);
        }
        let mut ids: Vec<&str> = all.iter().map(|r| r.id.as_str()).collect();
        ids.sort_unstable();
        let count = ids.len();
        ids.dedup();
        assert_eq!(ids.len(), count, "a name stands twice");
    }

    #[test]
    fn names_are_found_as_people_write_them() {
        for (asked, found) in [
            ("UN R149-01 C passing", "UN R149-01 C passing"),
            ("un r112 b passing", "UN R112 B passing"),
            ("FMVSS 108 stop", "FMVSS 108 stop-1"),
            ("fmvss108 LB2V", "FMVSS 108 LB2V"),
            ("UN R148-01 stop-S1", "UN R148-01 stop-S1"),
        ] {
            assert_eq!(Regulation::find(asked).unwrap().id, found);
        }
        let error = Regulation::find("UN R112 X passing").unwrap_err();
        assert!(error.contains("UN R112 B passing"), "{error}");
        assert!(Regulation::find("").is_err());
    }

    #[test]
    fn each_regulation_measures_in_its_own_way() {
        let rules = |id: &str| Regulation::find(id).unwrap().rules;
        let passing = rules("UN R112 B passing");
        assert_eq!((passing.sensor_half_deg, passing.sensor_round, passing.tolerance_deg), (0.0745, false, 0.0));
        assert_eq!(passing.cut_off.unwrap().line_v_deg, -0.57);
        assert!(rules("UN R112 B driving").cut_off.is_none());
        assert_eq!(rules("UN R149-01 B driving").tolerance_deg, 0.25);
        let federal = rules("FMVSS 108 UB2");
        assert_eq!((federal.sensor_round, federal.tolerance_deg), (true, 0.25));
    }
}

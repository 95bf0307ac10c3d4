//! The tables of regulations: what is required, in which direction, and the source of the figure.

use super::row::{Row, with_key};
use serde::{Deserialize, Deserializer};
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
/// # Ok::<(), lampyris::regulation::Error>(())
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
    /// Name of the function.
    pub name: String,
    /// How points and groups go together (FMVSS 108).
    #[serde(default, deserialize_with = "point_rule")]
    point_rule: PointRule,
    /// The cut-off that is brought to its place before measuring; `None` for what is measured as placed.
    pub(super) cut_off: Option<CutOff>,
    /// The requirements.
    pub rows: Vec<Row>,
}

impl Function {
    /// The share of its own minimum that each point of a group must reach beside the group's sum; `None` where all of it is required.
    pub(super) fn point_floor(&self) -> Option<f64> {
        (self.point_rule == PointRule::Floor60).then_some(0.6)
    }

    /// Whether the sum of its group may stand for a point's own minimum.
    pub(super) fn has_group_alternative(&self) -> bool {
        self.point_rule == PointRule::GroupAlternative
    }
}

/// How the points of a function and the groups that they are summed in go together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum PointRule {
    /// Each point stands for itself.
    #[default]
    Points,
    /// Every group's sum is met, and every point reaches 60 % of its own minimum.
    #[serde(rename = "floor-60")]
    Floor60,
    /// Each point's minimum is met, or the sum of its group is.
    GroupAlternative,
}

fn point_rule<'de, D: Deserializer<'de>>(value: D) -> Result<PointRule, D::Error> {
    with_key("point_rule", PointRule::deserialize(value))
}

/// How a file says that its rows are measured.
#[derive(Clone, Debug, Default)]
pub(super) struct Rules {
    /// Half the opening of the photometer, degrees.
    pub(super) sensor_half_deg: f64,
    pub(super) sensor_round: bool,
    /// Half the widest opening that coarse cells may be read with, where it is wider than the usual one.
    pub(super) sensor_widest_half_deg: Option<f64>,
    /// A point is met when it is met within this angle of its direction, degrees; a relative row's point too.
    pub(super) tolerance_deg: f64,
}

/// How a beam with a cut-off is aimed.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CutOff {
    /// H of the vertical scan, degrees: negative to the left.
    pub(super) scan_h_deg: f64,
    /// V that its steepest place is brought to, degrees.
    pub(super) line_v_deg: f64,
    /// H that the elbow is brought to (line A), degrees; `None` for beams without an elbow, which stay sideways as placed.
    pub(super) elbow_h_deg: Option<f64>,
    /// Least gradient G, per 0.1°, of what passes for a cut-off.
    pub(super) least_gradient: f64,
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

impl Regulation {
    /// All functions there are tables of, file by file.
    pub fn all() -> Vec<Self> {
        // The tables are part of the program, and a test reads each of them.
        let read = |(prefix, text): &(&str, &str)| {
            read_table(prefix, text).unwrap_or_else(|e| panic!("table of {prefix}: {e}"))
        };
        FILES.iter().flat_map(read).collect()
    }

    /// Says, in a sentence for people, how far the rows were compared with a second source.
    pub fn checked(&self) -> String {
        let two = self.function.rows.iter().filter(|r| r.evidence == "two").count();
        format!(
            "{two} of {} rows were compared with a second source, the others rest on one; compare with the text in force before relying on them",
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
    point_tolerance_deg: Option<f64>,
    driving_tolerance_deg: Option<f64>,
    functions: Vec<Value>,
}

impl Function {
    /// Reads a function and checks its rows.
    ///
    /// # Errors
    /// When a word is not known or a row lacks something; the message names function, row and key.
    fn read(mut value: Value) -> Result<Self, String> {
        let name = |value: &Value| value["id"].as_str().unwrap_or("without id").to_owned();
        let id = name(&value);
        let rows = value["rows"].take();
        let rows = rows.as_array().ok_or_else(|| format!("function {id}: rows: not a list"))?;
        let read =
            |row: &Value| Row::deserialize(row).map_err(|e| format!("function {id}, row {}: {e}", name(row)));
        let rows = rows.iter().map(read).collect::<Result<Vec<_>, _>>()?;
        rows.iter().try_for_each(|row| row.check(&rows)).map_err(|e| format!("function {id}, {e}"))?;
        value["rows"] = Value::Array(Vec::new());
        let function = Self::deserialize(value).map_err(|e| format!("function {id}: {e}"))?;
        Ok(Self { rows, ..function })
    }
}

/// Reads the regulations of a table of the program, one a lamp function, each called by `prefix` and the function's name.
///
/// # Errors
/// When the text is no table; the message names function, row and key.
fn read_table(prefix: &str, text: &str) -> Result<Vec<Regulation>, String> {
    let file: File = serde_json::from_str(text).map_err(|e| e.to_string())?;
    let number = |v: &Value, path: &str| v.pointer(path).and_then(Value::as_f64);
    file.functions
        .into_iter()
        .map(|function| {
            let function = Function::read(function)?;
            let driving = function.id.starts_with("driving");
            let sensor = number(&file.measurement, "/sensor_half_deg");
            let tolerance = (file.point_tolerance_deg.or(file.driving_tolerance_deg.filter(|_| driving)))
                .or(number(&file.measurement, "/tolerance_deg"));
            let id = match function.id.split_once('-') {
                // People say `C passing`, the tables `passing-C`.
                Some((beam @ ("passing" | "driving"), class)) => format!("{prefix} {class} {beam}"),
                _ => format!("{prefix} {}", function.id),
            };
            let rules = Rules {
                sensor_half_deg: sensor.ok_or("measurement: sensor_half_deg: no number")?,
                sensor_round: file.measurement["sensor_round"] == true,
                sensor_widest_half_deg: number(&file.measurement, "/sensor_widest_half_deg"),
                // Where the text grants no tolerance, a row holds in its very direction.
                tolerance_deg: tolerance.unwrap_or(0.0),
            };
            Ok(Regulation { id, title: file.title.clone(), function, rules })
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
        }
        let mut ids: Vec<&str> = all.iter().map(|r| r.id.as_str()).collect();
        ids.sort_unstable();
        let count = ids.len();
        ids.dedup();
        assert_eq!(ids.len(), count, "a name stands twice");
    }

    /// A mistyped word or a forgotten key would take a requirement away or turn it round.
    #[test]
    fn a_table_with_an_unknown_word_or_without_a_key_is_refused() {
        let read = |row: &str, rule: &str| {
            let rest = r#""id": "A", "source": "s", "evidence": "one""#;
            let function = format!(r#"{{"id": "stop", "name": "Stop", {rule} "rows": [{{{row}, {rest}}}]}}"#);
            let measurement = r#""measurement": {"sensor_half_deg": 0.1}"#;
            read_table("TEST", &format!(r#"{{"title": "T", {measurement}, "functions": [{function}]}}"#))
        };
        let point = r#""kind": "point", "h": 0, "v": 0, "min": 1"#;
        assert!(read(point, "").is_ok() && read(point, r#""point_rule": "floor-60","#).is_ok());
        let relative = r#""kind": "relative", "h": 0, "v": 0, "factor": 0.5, "of""#;
        for (row, rule, words) in [
            (
                point,
                r#""point_rule": "floor60","#,
                ["function stop: point_rule: unknown variant `floor60`", "`floor-60`"],
            ),
            (
                r#""kind": "ponit""#,
                "",
                ["function stop, row A: kind: unknown variant `ponit`", "`distribution_point`"],
            ),
            (
                &format!(r#"{relative}: "imax", "bound": "mim""#),
                "",
                ["row A: bound: unknown variant `mim`", "`min`"],
            ),
            (&format!(r#"{relative}: "B", "bound": "min""#), "", ["row A: Relative needs", "id of a point"]),
            (r#""kind": "point", "h": 0, "min": 1"#, "", ["row A: Point needs h, v", "min or max"]),
            (r#""kind": "line", "h0": 0, "v0": 0, "h1": 0, "max": 1"#, "", ["row A: Line needs", "v1"]),
            (r#""kind": "zone", "max": 1"#, "", ["row A: Zone needs", "polygon"]),
            (r#""kind": "sum", "points": [[0, 0]], "max": 1"#, "", ["row A: Sum needs", "no max"]),
            (r#""kind": "note", "max": 1"#, "", ["row A: Note needs", "nothing"]),
        ] {
            let refusal = read(row, rule).unwrap_err();
            assert!(words.iter().all(|w| refusal.contains(w)), "{refusal}");
        }
    }

    #[test]
    fn a_key_that_no_rule_reads_is_refused() {
        let row =
            r#"{"kind": "imax", "id": "M", "max": 300, "spot_radius_deg": 0.5, "source": "", "evidence": "one"}"#;
        assert_eq!(serde_json::from_str::<Row>(row).unwrap().spot_radius_deg, Some(0.5));
        let misspelt = row.replace("spot_radius_deg", "spot_radius");
        assert!(serde_json::from_str::<Row>(&misspelt).unwrap_err().to_string().contains("`spot_radius`"));
    }

    #[test]
    fn each_regulation_measures_in_its_own_way() {
        let rules = |id: &str| Regulation::find(id).unwrap().rules;
        let passing = rules("UN R112 B passing");
        assert_eq!((passing.sensor_half_deg, passing.sensor_round, passing.tolerance_deg), (0.0745, false, 0.0));
        let cut_off = |id: &str| Regulation::find(id).unwrap().function.cut_off;
        assert_eq!(cut_off("UN R112 B passing").unwrap().line_v_deg, -0.57);
        assert!(cut_off("UN R112 B driving").is_none());
        assert_eq!(rules("UN R149-01 B driving").tolerance_deg, 0.25);
        let federal = rules("FMVSS 108 UB2");
        assert_eq!((federal.sensor_round, federal.tolerance_deg), (true, 0.25));
        // Signal lamps: from 10' to 1° after UN R148, 10' where FMVSS 108 names none.
        let [signal, stop] = ["UN R148-01 stop-S1", "FMVSS 108 stop-1"].map(rules);
        assert_eq!([signal.sensor_half_deg, stop.sensor_half_deg], [10.0 / 60.0 / 2.0; 2]);
        assert_eq!([signal.sensor_widest_half_deg, stop.sensor_widest_half_deg], [Some(0.5), None]);
        assert_eq!([signal.sensor_round, stop.sensor_round], [false, true]);
    }
}

//! `lampyris assess`: a far field judged by the tables of a lamp regulation.

use crate::cli::console::{Console, print};
use crate::cli::output::json::json_text;
use crate::cli::output::terminal_tables::blank_table;
use crate::cli::work::output_place::folder_of;
use crate::cli::{completion::Completion, failure::Failure};
use crate::regulation::{Assessment, Assumptions, IntensityMap, Regulation, RowVerdict, Traffic, Verdict, assess};
use crate::report::figures;
use comfy_table::CellAlignment;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What is asked.
pub(crate) struct AssessCommand<'a> {
    pub(crate) result: Option<&'a Path>,
    pub(crate) regulation: Option<&'a str>,
    pub(crate) receiver: Option<&'a str>,
    pub(crate) left_hand: bool,
    pub(crate) as_placed: bool,
}

/// Significant digits of intensities: more than any photometer has.
const DIGITS: usize = 5;

/// Prints what there are tables of.
pub(crate) fn list(console: &Console) -> Result<Completion, Failure> {
    let all = Regulation::all();
    if console.json {
        let rows = all.iter().map(
            |r| json!({"id": r.id, "name": r.function.name, "rows": r.function.rows.len(), "checked": r.checked()}),
        );
        print(&json_text(&rows.collect::<Vec<_>>())?)?;
    } else {
        let width = all.iter().map(|r| r.id.len()).fold(0, usize::max);
        print(&all.iter().map(|r| format!("{:<width$}  {}\n", r.id, r.function.name)).collect::<String>())?;
    }
    Ok(Completion::Complete)
}

pub(crate) fn run(command: &AssessCommand, console: &Console) -> Result<Completion, Failure> {
    let name = command.regulation.ok_or_else(|| Failure::arguments("no --regulation is given"))?;
    let regulation = Regulation::find(name).map_err(Failure::arguments)?;
    let given = command.result.ok_or_else(|| Failure::arguments("no result is given"))?;
    let run = ResultsFile::read(given)?;
    let receiver = run.far_field(command.receiver)?;
    let map = run.intensities(receiver)?;
    let assumptions = Assumptions {
        traffic: if command.left_hand { Traffic::Left } else { Traffic::Right },
        as_placed: command.as_placed,
        rays: run.rays()?,
        tolerance_mm: run.tolerance_mm(),
    };
    let assessment = assess(&map, &regulation, &assumptions).map_err(|e| {
        Failure::arguments(e).with_help("set `cells`, `h_deg` and `v_deg` of the far field and trace again")
    })?;
    let document = json_document(&assessment);
    if console.json {
        print(&json_text(&document)?)?;
    } else {
        print(&summary(&assessment, console))?;
    }
    Ok(Completion::Complete)
}

/// The results of a run and where they lie.
struct ResultsFile {
    folder: PathBuf,
    path: PathBuf,
    results: Value,
}

impl ResultsFile {
    fn read(given: &Path) -> Result<Self, Failure> {
        let path = if given.is_dir() { given.join("results.json") } else { given.to_owned() };
        let help = "give the folder that `lampyris trace` wrote, or its results.json";
        let failure = |what: String| Failure::input(format!("{}: {what}", path.display())).with_help(help);
        let text = std::fs::read_to_string(&path).map_err(|e| failure(format!("cannot read: {e}")))?;
        let results: Value =
            serde_json::from_str(&text).map_err(|e| failure(format!("not the results of a run: {e}")))?;
        let folder = folder_of(&path);
        Ok(Self { folder, path, results })
    }

    /// The far field over H and V, of this name where there are several.
    fn far_field(&self, name: Option<&str>) -> Result<&Value, Failure> {
        let fits = |r: &&Value| r["kind"] == "far_field" && r["angles"] == "A" && r["unit"] == "cd";
        let named = |r: &&Value| name.is_none_or(|n| r["name"] == n);
        let mut found = self.results["receivers"].as_array().into_iter().flatten().filter(fits).filter(named);
        let failure = |what: &str| {
            let help = "a verdict needs a receiver of kind \"far_field\" with angles \"A\" in a run that counts lm";
            Failure::arguments(format!("{}: {what}", self.path.display())).with_help(help)
        };
        match (found.next(), found.next()) {
            (Some(one), None) => Ok(one),
            (None, _) => Err(failure("no far field in candela over H and V")),
            (Some(a), Some(b)) => Err(failure(&format!(
                "several far fields: choose one by --receiver {} or {}",
                a["name"], b["name"]
            ))),
        }
    }

    /// How many rays were traced, on which the errors' prediction for more rays rests.
    fn rays(&self) -> Result<u64, Failure> {
        let rays = self.results["rays"].as_u64();
        rays.ok_or_else(|| Failure::input(format!("{}: no number of rays", self.path.display())))
    }

    fn intensities(&self, receiver: &Value) -> Result<IntensityMap, Failure> {
        let files = receiver["files"].as_array().into_iter().flatten();
        let csv = files.filter_map(Value::as_str).find(|f| f.ends_with(".csv"));
        let csv = csv.ok_or_else(|| {
            Failure::input(format!("{}: no CSV file of {}", self.path.display(), receiver["name"]))
        })?;
        let path = self.folder.join(csv);
        let failure = |what: String| Failure::input(format!("{}: {what}", path.display()));
        let text = std::fs::read_to_string(&path).map_err(|e| failure(format!("cannot read: {e}")))?;
        let (rays, emitted) = (self.results["rays"].as_f64(), self.results["power"]["emitted"].as_f64());
        let ray_flux = rays.zip(emitted).filter(|(rays, _)| *rays > 0.0).map(|(rays, emitted)| emitted / rays);
        IntensityMap::from_csv(&text, ray_flux).map_err(failure)
    }

    /// The upper end of the tolerance that the run chose or was given, where it traced facets.
    fn tolerance_mm(&self) -> Option<f64> {
        let tolerance = &self.results["chosen"]["tolerance_mm"];
        tolerance.as_f64().or_else(|| tolerance["max"].as_f64()).or_else(|| tolerance[1].as_f64())
    }
}

fn json_document(a: &Assessment) -> Value {
    let rows = a.rows.iter().map(|r| {
        let settles = r.settles.map(|s| json!({"rays": s.rays, "tolerance_mm": s.tolerance_mm}));
        json!({
            "id": r.row.id, "kind": r.row.kind,
            "h_deg": r.direction.map(|d| d[0]), "v_deg": r.direction.map(|d| d[1]),
            "min": r.row.min, "max": r.row.max,
            "value": r.reading.map(|x| x.value),
            "statistical": r.reading.map(|x| x.statistical),
            "geometric": r.reading.map(|x| x.geometric),
            "verdict": r.verdict.map(|v| v.to_string()),
            "settles": settles, "when": r.row.when, "note": r.row.note,
            "source": r.row.source, "evidence": r.row.evidence,
        })
    });
    json!({
        "regulation": a.regulation.id, "title": a.regulation.title, "checked": a.regulation.checked(),
        "aim": {"h_deg": a.aim.h_deg, "v_deg": a.aim.v_deg, "how": a.aim.how},
        "sensor_deg": a.sensor_deg, "rows": rows.collect::<Vec<_>>(), "verdict": a.verdict.to_string(),
    })
}

fn summary(a: &Assessment, console: &Console) -> String {
    let mut text = format!("{}  {}\n", console.bold(&a.regulation.id), a.regulation.function.name);
    text += &format!("  aim     {}\n", a.aim.how);
    text += &format!("  sensor  {:.3}° from side to side\n", a.sensor_deg);
    text += &format!("  tables  {}\n", a.regulation.checked());
    let mut table = blank_table(console.width());
    table.set_header(["", "direction", "asked [cd]", "read [cd]", "± stat.", "± geom.", "verdict", "settled by"]);
    for row in &a.rows {
        table.add_row(cells(row));
    }
    for column in 2..=5 {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let count = |v: Verdict| a.rows.iter().filter(|r| r.verdict == Some(v)).count();
    let counts = [Verdict::Pass, Verdict::Fail, Verdict::Unsure].map(count);
    let unjudged = a.rows.len() - counts.iter().sum::<usize>();
    text += &format!("{table}\n  {} pass, {} fail, {} unsure", counts[0], counts[1], counts[2]);
    text += &if unjudged > 0 { format!(", {unjudged} not judged (notes and conditions)") } else { String::new() };
    text + &format!("; the whole: {}\n", console.bold(&a.verdict.to_string()))
}

fn cells(row: &RowVerdict) -> [String; 8] {
    let number = |x: f64| figures(x, DIGITS);
    let asked = match (row.row.min, row.row.max) {
        (Some(min), Some(max)) => format!("{} … {}", number(min), number(max)),
        (Some(min), None) => format!("≥ {}", number(min)),
        (None, Some(max)) => format!("≤ {}", number(max)),
        (None, None) => row
            .row
            .when
            .clone()
            .unwrap_or_else(|| if row.row.kind == "relative" { "relative".into() } else { "–".into() }),
    };
    let side = |x: f64, positive: char, negative: char| match x {
        x if x > 0.0 => format!("{}{positive}", figures(x, 3)),
        x if x < 0.0 => format!("{}{negative}", figures(-x, 3)),
        _ => "0".to_owned(),
    };
    let direction = row.direction.map(|[h, v]| format!("{} {}", side(h, 'R', 'L'), side(v, 'U', 'D')));
    let read = |value: fn(crate::regulation::Reading) -> f64| {
        row.reading.map_or("–".to_owned(), |r| figures(value(r), DIGITS))
    };
    let settles = row.settles.map(|s| {
        let rays = format!("{:.1e} rays", s.rays as f64);
        s.tolerance_mm.map_or(rays.clone(), |t| format!("{rays}, {} mm", figures(t, 2)))
    });
    // What a note or a condition has not is an empty cell.
    let cell = |text: Option<String>| text.map_or(String::new(), |t| t);
    [
        row.row.id.clone(),
        cell(direction),
        asked,
        read(|r| r.value),
        read(|r| r.statistical),
        read(|r| r.geometric),
        row.verdict.map_or("not judged".to_owned(), |v| v.to_string()),
        cell(settles),
    ]
}

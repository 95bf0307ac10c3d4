//! Studies as reports: from the rows of `study … --json` alone, so that a kept `study.json` can be drawn again years later.

mod accuracy;
mod effects;
mod others;
mod receivers;
mod rows;
mod stability;

use super::{Cell, Provenance, Report, Section, Table};
use serde_json::Value;

/// Makes the report of a study document as `lampyris study … --json` prints it. What is missing in it, or of an unknown study, is left out.
pub fn study_report(document: &Value, provenance: Provenance) -> Report {
    // Whatever is missing in the document is an empty list: a kept file of an older program is drawn as far as it
    // goes.
    let list = |key: &str| -> Vec<&Value> { document[key].as_array().into_iter().flatten().collect() };
    let (rows, lit) = (list("rows"), list("receivers"));
    let kind = rows::text(document, "study");
    let (title, mut sections) = match kind {
        "accuracy" => accuracy::report(&rows),
        "interpolation" => others::interpolation(&rows),
        "complexity" => others::complexity(&rows),
        "stability" => stability::report(&rows),
        "bvh" => others::bvh(&rows),
        "effects" => effects::report(&rows),
        _ => (format!("Study {kind}"), Vec::new()),
    };
    let answer = rows::text(document, "answer").to_owned();
    if !lit.is_empty() {
        sections.push(receivers::section(&lit));
    }
    sections.push(Section::new("All rows").with_block(all_rows_table(kind, &rows)));
    Report { title, answer, sections, provenance }
}

/// Returns title and unit of a key, by the suffixes that keys carry; no unit for a key that has none.
fn heading(key: &str) -> (String, &'static str) {
    let units = [
        ("_mm_p50", "mm", " median"),
        ("_mm_p99", "mm", " p99"),
        ("_deg_rms", "°", " rms"),
        ("_deg_p50", "°", " median"),
        ("_deg_p99", "°", " p99"),
        ("_deg_max", "°", " max"),
        ("_mm", "mm", ""),
        ("_deg", "°", ""),
    ];
    // The longer suffixes first, of which the short ones are the end.
    for (suffix, unit, kept) in units {
        if let Some(stem) = key.strip_suffix(suffix) {
            return (format!("{}{kept}", stem.replace('_', " ")), unit);
        }
    }
    let unit = match key {
        k if k.starts_with("seconds") || k.ends_with("seconds") => "s",
        k if k.starts_with("mrays_per_s") => "Mrays/s",
        "bytes" | "bytes_per_facet" => "B",
        _ => "",
    };
    let title = key.replace("mrays_per_s", "rate").replace('_', " ");
    (title, unit)
}

/// Makes a table of all rows with a column for each key, in the order in which keys first appear; missing values are empty. Titles and
/// units follow from the keys. `kind` names the table and its file, `{kind}-rows.csv`.
fn all_rows_table(kind: &str, rows: &[&Value]) -> Table {
    let mut keys: Vec<&str> = Vec::new();
    for key in rows.iter().filter_map(|r| r.as_object()).flat_map(|o| o.keys()) {
        if !keys.contains(&key.as_str()) {
            // In the order of first appearance, which is that of the struct.
            keys.push(key);
        }
    }
    let headings: Vec<(String, &str)> = keys.iter().map(|k| heading(k)).collect();
    let columns: Vec<(&str, &str)> = headings.iter().map(|(t, u)| (t.as_str(), *u)).collect();
    let mut table = Table::new(&format!("{kind}-rows"), "Every measurement", &columns);
    for row in rows {
        table.row(keys.iter().map(|k| match &row[*k] {
            Value::Null => Cell::Empty,
            Value::Bool(b) => Cell::from(if *b { "yes" } else { "no" }),
            Value::String(s) => Cell::from(s.as_str()),
            // Whole numbers as such: a count with a decimal point looks measured.
            Value::Number(n) => n.as_u64().map_or_else(|| n.as_f64().into(), Cell::from),
            Value::Array(list) => {
                let words: Vec<String> =
                    list.iter().map(|v| v.as_str().map_or_else(|| v.to_string(), str::to_owned)).collect();
                Cell::from(words.join(" "))
            }
            other => Cell::from(other.to_string()),
        }));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn table(document: &Value) -> Report {
        study_report(document, Provenance::default())
    }

    #[test]
    fn rows_of_any_study_become_a_table_with_units() {
        let rows = json!([{"case": "edge", "seconds_min": 0.5, "sag_max_mm": null, "flips": 3}, {"case": "b", "extra": true}]);
        let report = table(&json!({"study": "unheard of", "rows": rows}));
        let csv = match &report.sections[0].blocks[0] {
            crate::report::Block::Table(t) => t.to_csv(),
            _ => panic!("no table"),
        };
        assert_eq!(csv, "case,seconds min (s),sag max (mm),flips,extra\nedge,0.5,,3,\nb,,,,yes\n");
    }

    #[test]
    fn verdicts_are_added_up_by_case_and_by_intersector() {
        let row = |case: &str, intersector: &str, counts: [u64; 3]| {
            json!({"case": case, "variant": "home", "intersector": intersector, "rays": counts.iter().sum::<u64>(),
                "right": counts[0], "flagged": counts[1], "wrong": counts[2]})
        };
        let rows = json!([
            row("pole", "octree", [5, 0, 0]),
            row("pole", "octree", [4, 0, 1]),
            row("pole", "exact", [7, 3, 0]),
            row("cusp", "octree", [2, 0, 0]),
        ]);
        let report = table(&json!({"study": "stability", "rows": rows}));
        let csv: Vec<String> = (report.sections[0].blocks.iter())
            .filter_map(|b| if let crate::report::Block::Table(t) = b { Some(t.to_csv()) } else { None })
            .collect();
        assert_eq!(csv[0], "intersector,rays,right,flagged,wrong\noctree,12,11,0,1\nexact,10,7,3,0\n");
        assert_eq!(csv[1], "case,rays a variant,octree,exact\npole,5,9/0/1,7/3/0\ncusp,2,2/0/0,0/0/0\n");
    }

    #[test]
    fn documents_that_are_damaged_still_give_a_page() {
        for kind in ["accuracy", "interpolation", "complexity", "stability", "bvh", "effects"] {
            for rows in [json!(null), json!([]), json!([null, 3, {"model": 7, "normals": "flat"}])] {
                assert!(!table(&json!({"study": kind, "rows": rows})).title.is_empty());
            }
        }
    }
}

//! `[[regulation]]` and `trace --until-settled`: what the regulations of a scene say of its run.

use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::cli::output::verdict::summary;
use crate::pipeline::{PreparedScene, SceneResults};
use crate::simulate::Scene;
use crate::text::count_of;
use serde_json::Value;

/// Says every verdict of the run on stderr.
///
/// # Errors
/// When a far field cannot be judged.
pub(super) fn say_verdicts(run: &SceneResults, prepared: &PreparedScene, console: &Console) -> Result<(), Failure> {
    for verdict in run.verdicts(prepared).map_err(|e| Failure::running(e.to_string()))? {
        console.say(summary(&verdict.assessment, console.width(), |text| console.bold(text)));
    }
    Ok(())
}

/// Says in Markdown how many rows of the verdicts in a document of results stay unsure, and why; `None` where none is.
pub(super) fn unsettled_sentence(document: &Value) -> Option<String> {
    let verdicts = document["regulations"].as_array().into_iter().flatten();
    let rows = verdicts.flat_map(|v| v["rows"].as_array()).flatten().filter(|row| row["verdict"] == "unsure");
    let (beyond, within): (Vec<&Value>, Vec<&Value>) = rows.partition(|row| row["unseen"] != 0);
    let mut reasons = Vec::new();
    if !within.is_empty() {
        // On the true surfaces, where lost light alone is such an error, there is nothing to take away.
        let is_on_spline = document["tolerance_mm"].is_null();
        let facets = if is_on_spline || within.iter().all(|row| row["geometric"] == 0.0) {
            ""
        } else {
            ", or by the facets, whose errors --intersector exact takes away"
        };
        reasons.push(format!(
            "{} unsure at the most rays{facets}; the column 'settled by' says what would do",
            count_of(within.len() as u64, "row")
        ));
    }
    if !beyond.is_empty() {
        let rows = count_of(beyond.len() as u64, "row");
        reasons
            .push(format!("{rows} beyond the far field, which wider `h_deg` and `v_deg` settle, and no rays do"));
    }
    (!reasons.is_empty()).then(|| format!("**Not settled**: {}.", reasons.join("; ")))
}

/// Checks that more rays can settle the verdicts of a scene.
///
/// # Errors
/// When the scene names no regulation, or its sources have their own numbers of rays.
pub(super) fn check_settling(scene: &Scene) -> Result<(), Failure> {
    if scene.regulations.is_empty() {
        let failure = Failure::arguments("--until-settled: the scene names no regulation");
        return Err(failure.with_help("add a [[regulation]] with its `id`"));
    }
    // Rays of its own do not grow with the run.
    if scene.sources.iter().any(|s| s.rays.is_some()) {
        let failure = Failure::arguments("--until-settled: a source with `rays` of its own does not grow");
        return Err(failure.with_help("take `rays` out of the [[source]]s"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_was_done_already_is_no_advice() {
        let said = |geometric: f64, tolerance_mm: Option<[f64; 2]>| {
            let row = json!({"verdict": "unsure", "unseen": 0, "geometric": geometric});
            unsettled_sentence(&json!({"regulations": [{"rows": [row]}], "tolerance_mm": tolerance_mm})).unwrap()
        };
        let facets = Some([0.05, 0.2]);
        assert!(said(0.1, facets).contains("--intersector exact"));
        for done in [said(0.0, facets), said(0.1, None)] {
            assert!(done.contains("1 row unsure") && !done.contains("--intersector"), "{done}");
        }
    }
}

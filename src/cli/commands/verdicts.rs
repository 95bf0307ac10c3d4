//! `[[regulation]]` and `trace --until-settled`: what the regulations of a scene say of its run.

use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::cli::output::verdict::summary;
use crate::pipeline::{PreparedScene, SceneResults};
use crate::simulate::Scene;
use serde_json::Value;

/// What is said where --until-settled did not settle every row.
pub(super) const UNSETTLED: &str = "**Not settled**: rows stay unsure, by the facets or at the most rays; the column 'settled by' says what \
    would do, and --intersector exact takes the errors of the facets away.";

/// Says every verdict of the run on stderr.
///
/// # Errors
/// When a far field cannot be judged.
pub(super) fn say_verdicts(run: &SceneResults, prepared: &PreparedScene, console: &Console) -> Result<(), Failure> {
    for verdict in run.verdicts(prepared).map_err(Failure::running)? {
        console.say(summary(&verdict.assessment, console.width(), |text| console.bold(text)));
    }
    Ok(())
}

/// Whether a row of any verdict in a document of results is unsure; false without regulations.
pub(super) fn are_unsettled(document: &Value) -> bool {
    let verdicts = document["regulations"].as_array().into_iter().flatten();
    let mut rows = verdicts.flat_map(|v| v["rows"].as_array()).flatten();
    rows.any(|row| row["verdict"] == "unsure")
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

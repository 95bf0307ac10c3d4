//! `lampyris trace --rays A..B`: what a range of the rays of a run that grows can be asked for.

use crate::cli::arguments::command::TraceOptions;
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::pipeline::{PreparedScene, RayRange};
use crate::simulate::{GROWING_REPLICATE, grows};
use crate::text::grouped;

/// Refuses, with a range of rays, what is written of whole runs alone.
pub(super) fn refuse_options(extra: &TraceOptions) -> Result<(), Failure> {
    let given = [
        ("--paths", extra.paths.is_some()),
        ("--ends", extra.ends.is_some()),
        ("--verify-pruning", extra.verify_pruning),
        ("--until-error", extra.until_error.is_some()),
        ("--until-settled", extra.until_settled),
    ];
    let Some((option, _)) = given.iter().find(|(_, is_given)| *is_given) else { return Ok(()) };
    let failure = Failure::arguments(format!("--rays A..B does not take {option}: it traces a part of a run"));
    Err(failure.with_help("give the number of rays of a whole run, or leave the option out"))
}

/// Checks that the run can grow, where a range of its rays was asked for.
///
/// # Errors
/// When it cannot, or the range does not begin and end with a replicate.
pub(super) fn check_growing(prepared: &PreparedScene, console: &Console) -> Result<(), Failure> {
    let Some(RayRange { first: Some(first), end }) = prepared.job.tracing.ray_range else { return Ok(()) };
    if !grows(&prepared.bound, &prepared.run_settings()) {
        let failure = Failure::arguments("--rays A..B: a source of this scene has `rays` of its own");
        return Err(failure.with_help("leave the `rays` of sources out: their power shares out the rays"));
    }
    if !(first.is_multiple_of(GROWING_REPLICATE) && end.is_multiple_of(GROWING_REPLICATE)) {
        let message = format!("--rays {first}..{end}: both must be multiples of {GROWING_REPLICATE}");
        return Err(Failure::arguments(message).with_help("rays are traced in replicates of that many"));
    }
    if console.verbose > 0 {
        console.say(format_args!("rays {} to {} of a run that grows", grouped(first), grouped(end)));
    }
    Ok(())
}

//! `--accuracy 0.05deg`: a direction error asked for in place of a tolerance.

use super::Failure;
use super::context::Context;
use super::options::{self, Meshing, NormalKind, Tracing};
use crate::intersect::NormalMode;
use crate::model::Model;
use crate::study::aim::{Ask, aim};

/// The options with tolerance and normals put in that reach what was asked; unchanged when nothing was asked.
pub(super) fn meshing(
    asked: Option<&str>,
    meshing: &Meshing,
    tracing: &Tracing,
    model: &Model,
    context: &Context,
) -> Result<(Meshing, Tracing), Failure> {
    let (mut meshing, mut tracing) = (meshing.clone(), tracing.clone());
    let Some(text) = asked else { return Ok((meshing, tracing)) };
    let degrees = options::accuracy(text).map_err(|e| Failure::arguments(format!("--accuracy {text}: {e}")))?;
    let mut ask = Ask::degrees(degrees);
    if let Some(rays) = tracing.rays {
        ask.job_rays = rays as f64;
    }
    ask.seed = tracing.seed.unwrap_or(ask.seed);
    let bar = context.bar("aiming", "%", 100);
    let found = aim(model, &crate::study::Product::new(model), &ask, &|p| {
        bar.set_position((100.0 * p.done) as u64);
    });
    bar.finish_and_clear();
    context.say(&found.answer);
    meshing.tolerance = Some([found.tolerance_mm; 2]);
    if tracing.normals.is_none() {
        tracing.normals = Some(match found.normals {
            NormalMode::Flat => NormalKind::Flat,
            NormalMode::Nearest => NormalKind::Nearest,
            NormalMode::Bilinear => NormalKind::Bilinear,
            NormalMode::Cubic => NormalKind::Cubic,
            NormalMode::Exact => NormalKind::Exact,
        });
    }
    Ok((meshing, tracing))
}

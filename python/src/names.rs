//! Words and numbers that several functions take.

use crate::errors::{SceneError, of_pipeline};
use lampyris::intersect::NormalMode;
use pyo3::prelude::*;

/// The kind of normals of this name, in any case.
pub(crate) fn normal_mode(name: &str) -> PyResult<NormalMode> {
    lampyris::pipeline::normal_mode(name).map_err(of_pipeline)
}

/// Refuses what is no range of tolerances.
pub(crate) fn require_tolerance(low: f64, high: f64) -> PyResult<()> {
    if low >= lampyris::tessellate::LEAST_TOLERANCE_MM && low <= high && high.is_finite() {
        return Ok(());
    }
    Err(SceneError::new_err(format!(
        "tolerance ({low:?}, {high:?}): it must be two lengths in mm from 1e-7 on, the tighter one first, as in (0.05, 0.2)"
    )))
}

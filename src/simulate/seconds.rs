//! Times of the stages of a run.

use serde::Serialize;

/// Seconds of each stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// Reading the models.
    pub read: f64,
    /// Making facets.
    pub tessellate: f64,
    /// Building the intersector.
    pub build: f64,
    /// Tracing; of a merged run that of all parts together.
    pub trace: f64,
    /// Asking some of its rays again of BVH and spline, and comparing facets with the spline.
    pub check: f64,
    /// Times of the parts of a merged run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub merged: Option<MergedSeconds>,
}

/// Times of the parts of a merged run, from the start of each process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MergedSeconds {
    /// Parts.
    pub parts: u32,
    /// Machines that traced them, by name.
    pub machines: u32,
    /// Seconds of all threads of all parts; `null` where a system did not report them.
    pub cpu: Option<f64>,
    /// Seconds of the slowest part.
    pub slowest: f64,
    /// Threads of the part that had most; `null` where none is known.
    pub threads: Option<u32>,
}

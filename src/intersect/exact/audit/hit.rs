//! A hit of the audit.

use crate::math::{FaceId, Uv};

/// A crossing found by clipping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuditHit {
    /// Distance along the ray, mm.
    pub t: f64,
    /// The placed face.
    pub face: FaceId,
    /// Parameters on its surface.
    pub uv: Uv,
    /// Whether it was found by a box of parameters that could not be made small: a tangency or a singular point.
    pub doubtful: bool,
}

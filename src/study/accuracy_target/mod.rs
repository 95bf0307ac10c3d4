//! Accuracy asked for as an angle: the local tolerances and the kind of normals that reach it most cheaply, checked.
//!
//! A facet of sag s on a surface of radius R met at incidence i misdirects the mirrored ray by up to 2·(s/R)·tan i with interpolated
//! normals and 2·acos(1 − s/R) with flat ones. Pilot rays on the spline give radius and incidence on every face, and with them a
//! tolerance in proportion to the radius, sag ≤ ε·R/(2 tan i). The same rays on such facets then show how far each face is from the
//! target, for facets do not err as much as the formula allows. Fresh rays judge the result against the spline.
//!
//! Every kind of normals that could be the cheapest is made to reach the target. Which is cheapest follows from counted work, never from
//! a clock, so that every machine takes the same facets; the seconds of the answer are measured. It names the largest error beside the
//! 99th percentile, and rays that no angle stands for. Known weakness: other rays (more grazing ones) err more.

mod direction_error;
mod light;
mod search;
mod solution;
mod survey;
mod trial_rays;

pub use super::tolerance_plan::{RelativeTolerance, TolerancePlan};
pub use light::{JobLight, RayGenerator};
pub use search::{meet_target, meet_target_for_light};

use crate::intersect::NormalMode;
use serde::Serialize;

/// Facets that a mesh of a search may have, by default: each takes 15 µs on one core of a server.
const MOST_FACETS: f64 = 6e6;

/// The accuracy to reach.
#[derive(Clone, Debug, PartialEq)]
pub struct AccuracyTarget {
    /// Direction error that 99 % of the hits on curved faces must keep, of the mirrored light and, where a face is known to let light
    /// through, of the refracted; degrees.
    pub angle_deg: f64,
    /// Rays that the job will trace: a long job pays for finer facets or faster normals differently than a short one; 0 when only
    /// the facets are wanted.
    pub job_rays: f64,
    /// Fresh rays of the final check, as many on the spline as on the facets.
    pub check_rays: u64,
    /// Kinds of normals that may be taken.
    pub kinds: Vec<NormalMode>,
    /// Facets that a mesh may have; all meshes of a search together may have three times as many. What is found until then is the answer.
    pub most_facets: f64,
    /// Seed of all rays here.
    pub seed: u64,
}

/// An angle that no accuracy can be aimed at.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{angle_deg}: an angle above 0 and below 90 degrees is needed, as 0.05")]
pub struct AngleError {
    angle_deg: f64,
}

impl AccuracyTarget {
    /// Refuses an angle that nothing can be aimed at.
    ///
    /// # Errors
    /// When it is not above 0 and below 90 degrees; the message says so.
    pub fn check_angle(&self) -> Result<(), AngleError> {
        if self.angle_deg > 0.0 && self.angle_deg < 90.0 {
            return Ok(());
        }
        Err(AngleError { angle_deg: self.angle_deg })
    }

    /// Returns the defaults for an angle: a job of a million rays, checked on 100,000, and meshes that take a minute and a half of one
    /// core.
    pub fn for_angle_deg(angle_deg: f64) -> Self {
        let kinds = vec![NormalMode::Flat, NormalMode::Bilinear, NormalMode::Cubic, NormalMode::Exact];
        Self { angle_deg, job_rays: 1e6, check_rays: 100_000, kinds, most_facets: MOST_FACETS, seed: 1 }
    }
}

/// Outcome of the search: the settings chosen and the error they reached.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AccuracyResult {
    /// Error that was asked for, degrees.
    pub asked_deg: f64,
    /// Reached on curved faces by fresh rays (p99, the worse of those traced on facets and on the spline), degrees; 0 where flat ones alone
    /// were met, `None` where no face was the same on both.
    pub reached_deg: Option<f64>,
    /// The largest error of these rays, degrees; `None` as above.
    pub largest_deg: Option<f64>,
    /// Whether the 99th percentile is within the target; also where no ray of the check hit anything.
    pub kept: bool,
    /// Kind of normals to trace with.
    #[serde(serialize_with = "by_name")]
    pub normals: NormalMode,
    /// Least and largest local tolerance, mm.
    pub tolerance_mm: [f64; 2],
    /// Tolerances to mesh with.
    pub plan: TolerancePlan,
    /// Facets that this makes.
    pub facets: usize,
    /// Seconds of meshing and building, measured.
    pub seconds_prepare: f64,
    /// Seconds of the job's trace, from the time of the check's rays.
    pub seconds_trace: f64,
    /// Every combination that was measured on fresh rays.
    #[serde(rename = "tries")]
    pub trials: Vec<Trial>,
    /// Rays of the check that hit curved faces.
    pub checked: u64,
    /// Rays of the check that hit on one of facets and spline only, or different faces: no angle stands for them.
    pub flips: u64,
    /// Seconds spent on finding out.
    pub seconds: f64,
    /// The answer in one sentence.
    pub answer: String,
}

/// One combination measured on fresh rays.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// Kind of normals.
    pub normals: String,
    /// Least and largest local tolerance, mm.
    pub tolerance_mm: [f64; 2],
    /// Facets made.
    pub facets: usize,
    /// 99th percentile of the direction error, degrees; `None` where no ray met the same face on facets and spline.
    pub reached_deg: Option<f64>,
    /// Seconds for the whole job, measured.
    pub seconds: f64,
}

/// Writes normals by their name.
fn by_name<S: serde::Serializer>(n: &NormalMode, s: S) -> Result<S::Ok, S::Error> {
    s.serialize_str(n.name())
}

//! The settings of a trace beside the scene.

use crate::errors::{SceneError, of_pipeline};
use crate::names::{normal_mode, require_tolerance};
use lampyris::pipeline::{MeshingSettings, RayRange, TracingSettings};
use lampyris::simulate::MOST_RAYS;
use pyo3::prelude::*;

/// What is asked beside the scene; the Python side gives every key.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Settings {
    tolerance: Option<[f64; 2]>,
    angle_deg: Option<f64>,
    pub(crate) accuracy_deg: Option<f64>,
    part: Vec<(String, [f64; 2])>,
    face: Vec<(String, [f64; 2])>,
    role: Vec<(String, [f64; 2])>,
    rays: Option<(Option<u64>, u64)>,
    seed: Option<u64>,
    threads: Option<usize>,
    intersector: Option<String>,
    normals: Option<String>,
}

impl Settings {
    pub(crate) fn meshing(&self) -> PyResult<MeshingSettings> {
        let ranges =
            self.tolerance.iter().chain([&self.part, &self.face, &self.role].into_iter().flatten().map(|(_, t)| t));
        for [low, high] in ranges {
            require_tolerance(*low, *high)?;
        }
        for (name, angle) in [("angle_deg", self.angle_deg), ("accuracy_deg", self.accuracy_deg)] {
            if let Some(angle) = angle.filter(|a| !(*a > 0.0 && *a < 90.0)) {
                return Err(SceneError::new_err(format!(
                    "{name} = {angle}: it must be above 0 and below 90 degrees"
                )));
            }
        }
        Ok(MeshingSettings {
            tolerance: self.tolerance,
            angle_deg: self.angle_deg,
            part: self.part.clone(),
            face: self.face.clone(),
            role: self.role.clone(),
            plan: None,
        })
    }

    pub(crate) fn tracing(&self) -> PyResult<TracingSettings> {
        if let Some((first, end)) = self.rays
            && !(first.unwrap_or(0)..MOST_RAYS).contains(&end.wrapping_sub(1))
        {
            return Err(SceneError::new_err(format!(
                "rays = {end}: a number of rays is whole, at least 1 and at most 2e13"
            )));
        }
        let intersector = self.intersector.as_ref().map(|name| name.parse().map_err(of_pipeline)).transpose()?;
        Ok(TracingSettings {
            ray_range: self.rays.map(|(first, end)| RayRange { first, end }),
            seed: self.seed,
            threads: self.threads,
            intersector,
            normals: self.normals.as_deref().map(normal_mode).transpose()?,
        })
    }
}

//! Models from STEP files.

use crate::accounts::reading_notes;
use crate::background::interruptible;
use crate::errors::{InputError, SceneError, of_json, of_pipeline, of_step};
use crate::mesh::Mesh;
use crate::names::require_tolerance;
use lampyris::pipeline::{MeshingSettings, mesh_settings};
use lampyris::step::{self, Import};
use lampyris::tessellate::{self, tessellate};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;
use std::sync::Arc;

/// The three-cavity lamp of `lampyris demo`, and its scene.
const LAMP: &[u8] = include_bytes!("../../fixtures/step/lamp_multicavity.stp");
const LAMP_SCENE: &str = include_str!("../../fixtures/scenes/demo.toml");
/// Its name in the scene.
const LAMP_FILE: &str = "../step/lamp_multicavity.stp";

/// Trimmed splines as a STEP file holds them, placed, in mm.
#[pyclass(frozen, module = "lampyris")]
pub(crate) struct Model {
    pub(crate) import: Arc<Import>,
    path: PathBuf,
    unit_mm: Option<f64>,
}

/// Reads a STEP file; every face is accounted for.
#[pyfunction]
#[pyo3(signature = (path, unit_mm = None))]
pub(crate) fn read_step(py: Python<'_>, path: PathBuf, unit_mm: Option<f64>) -> PyResult<Model> {
    if let Some(unit) = unit_mm.filter(|u| !(*u > 0.0 && u.is_finite())) {
        return Err(SceneError::new_err(format!("unit_mm = {unit}: it must be a positive number of mm")));
    }
    let absolute = std::path::absolute(&path).unwrap_or_else(|_| path.clone());
    let settings = step::Settings { length_unit_mm: unit_mm, ..step::Settings::default() };
    let import = interruptible(py, None, None, move |_| step::read(&path, &settings))?.made.map_err(of_step)?;
    Ok(Model { import: Arc::new(import), path: absolute, unit_mm })
}

/// The STEP file and the scene of the built-in lamp.
#[pyfunction]
pub(crate) fn demo_files(py: Python<'_>) -> (Py<PyBytes>, String) {
    (PyBytes::new(py, LAMP).unbind(), LAMP_SCENE.replace(LAMP_FILE, "lamp.stp"))
}

#[pymethods]
impl Model {
    /// Where it was read from.
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    /// Millimetres per length unit, where the file's own was overruled.
    #[getter]
    fn unit_mm(&self) -> Option<f64> {
        self.unit_mm
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.import.model.name
    }

    /// A hash of the bytes that it was read from.
    #[getter]
    fn hash(&self) -> String {
        format!("{:x}", self.import.report.hash)
    }

    /// Names of its parts.
    #[getter]
    fn parts(&self) -> Vec<String> {
        self.import.model.parts.iter().map(|p| p.name.clone()).collect()
    }

    /// What the file holds and what was refused, as JSON.
    fn account_json(&self) -> PyResult<String> {
        serde_json::to_string(&self.import.report).map_err(of_json)
    }

    /// Sentences on what could not be read of the file.
    fn reading_notes(&self) -> Vec<String> {
        reading_notes(std::slice::from_ref(&self.import.report))
    }

    /// Parts, solids and faces, as JSON.
    fn faces_json(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| serde_json::to_string(&self.import.model.account())).map_err(of_json)
    }

    /// Quad facets within a proved tolerance.
    #[pyo3(signature = (tolerance = None, angle_deg = None, part = Vec::new(), face = Vec::new(), measure = false))]
    fn tessellate(
        &self,
        py: Python<'_>,
        tolerance: Option<[f64; 2]>,
        angle_deg: Option<f64>,
        part: Vec<(String, [f64; 2])>,
        face: Vec<(String, [f64; 2])>,
        measure: bool,
    ) -> PyResult<Mesh> {
        if self.import.model.placed_face_count() == 0 {
            return Err(InputError::new_err(format!(
                "{}: the file holds no face that can be traced; account() says what was refused",
                self.path.display()
            )));
        }
        for [low, high] in tolerance.iter().chain(part.iter().chain(&face).map(|(_, t)| t)) {
            require_tolerance(*low, *high)?;
        }
        if let Some(angle) = angle_deg.filter(|a| !(*a > 0.0 && *a < 90.0)) {
            return Err(SceneError::new_err(format!("angle_deg = {angle}: it must be above 0 and below 90")));
        }
        let asked = MeshingSettings { tolerance, angle_deg, part, face, ..MeshingSettings::default() };
        let settings = mesh_settings(&asked, None, &self.import.model).map_err(of_pipeline)?;
        let settings = tessellate::Settings { measure, ..settings };
        let import = self.import.clone();
        let made = interruptible(py, None, None, move |_| tessellate(&import.model, &settings))?.made;
        Mesh::of_model(made, self.import.clone())
    }

    fn __repr__(&self) -> String {
        let faces = self.import.report.faces;
        format!(
            "<lampyris.Model {:?}: {} parts, {} faces, {} refused>",
            self.import.model.name,
            self.import.model.parts.len(),
            faces.found,
            faces.refused
        )
    }
}

impl Model {
    /// Where it was read from, and with what unit.
    pub(crate) fn source(&self) -> (PathBuf, Option<f64>) {
        (self.path.clone(), self.unit_mm)
    }
}

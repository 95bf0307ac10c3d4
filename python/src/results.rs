//! Results as arrays, and their verdicts.

use crate::accounts::model_notes;
use crate::arrays::{columns, flat, rows, shaped};
use crate::errors::{SceneError, of_json, of_pipeline};
use lampyris::formats::{Axis, ColourMap, Grid, Picture};
use lampyris::pipeline::{PreparedScene, SceneResults};
use lampyris::regulation::Regulation;
use lampyris::simulate::scene::{FarFieldType, RegulationUse};
use lampyris::simulate::{ReceiverResult, face_selectors};
use lampyris::study::figures::{cell_errors, channel_cell_errors};
use lampyris::text::figures;
use numpy::PyArrayDyn;
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::Value;
use std::sync::Arc;

/// Share of energy that may be lost without a warning: what `--max-lost` of the command is unless told otherwise.
const MOST_LOST: f64 = 1e-6;

/// What a run counted, with both errors.
#[pyclass(frozen, module = "lampyris")]
pub(crate) struct Results {
    scene: Arc<PreparedScene>,
    found: SceneResults,
}

/// An array of floats.
type Floats<'py> = Bound<'py, PyArrayDyn<f64>>;
/// Values with their statistical errors, or the edges along both axes.
type Pair<'py> = (Floats<'py>, Floats<'py>);
/// Values, and their statistical and geometric errors where these are known.
type Layers<'py> = (Floats<'py>, Floats<'py>, Option<Floats<'py>>);
/// Whole numbers.
type Numbers<'py, T> = Bound<'py, PyArrayDyn<T>>;
/// Vertices of paths: rays, branches, bounces, points, powers.
type Vertices<'py> = (Numbers<'py, u64>, Numbers<'py, u32>, Numbers<'py, u32>, Floats<'py>, Floats<'py>);

impl Results {
    pub(crate) fn new(scene: Arc<PreparedScene>, found: SceneResults) -> Self {
        Self { scene, found }
    }

    fn receiver(&self, receiver: usize) -> PyResult<&ReceiverResult> {
        self.found.results.receivers.get(receiver).ok_or_else(|| {
            PyIndexError::new_err(format!("receiver {receiver}: there are {}", self.found.results.receivers.len()))
        })
    }

    /// Puts beside each face that the document lists what selects it in a rule of a scene.
    fn add_selectors(&self, document: &mut Value) {
        let Some(listed) = &self.found.results.faces else { return };
        let model = &self.scene.job.loaded.model;
        // A selector is the shortest that means one face among all.
        let selectors = face_selectors(model, &model.placed_faces().collect::<Vec<_>>());
        for (k, face) in listed.first.iter().enumerate() {
            document["faces"]["first"][k]["selector"] = selectors[face.face as usize].to_string().into();
        }
    }
}

#[pymethods]
impl Results {
    /// Hash of all tallies: equal if and only if all of them are, bit by bit.
    #[getter]
    fn digest(&self) -> &str {
        &self.found.results.digest
    }

    /// Sentences on what the models of the scene lack.
    fn model_notes(&self) -> Vec<String> {
        model_notes(&self.scene)
    }

    /// A sentence on lost light that is more than a sound scene loses, or on powers that are no numbers; `None` where all is well.
    fn lost_light(&self) -> Option<String> {
        let power = self.found.results.power;
        if !power.emitted.is_finite() {
            return Some(
                "the powers of the sources sum to no finite number: the powers of this run mean nothing".into(),
            );
        }
        // Not a number where there is no light, of which none is lost.
        let share = power.lost / power.emitted;
        (share > MOST_LOST).then(|| {
            format!(
                "{} % of the energy was lost; the notes of the run say where and why",
                figures(100.0 * share, 2)
            )
        })
    }

    /// The document of `results.json`, with the selector of each listed face, and without verdicts where a far field cannot be judged.
    fn document_json(&self, py: Python<'_>) -> PyResult<String> {
        let mut document = self.found.document(&self.scene).map_err(of_json)?;
        self.add_selectors(&mut document);
        // The figures stand without them: whoever asks for the verdicts alone is told why there are none.
        let verdicts = py.detach(|| self.found.verdicts(&self.scene)).unwrap_or_default();
        if !verdicts.is_empty() {
            document["regulations"] = verdicts.iter().map(|v| v.assessment.document()).collect();
        }
        serde_json::to_string(&document).map_err(of_json)
    }

    /// The verdicts of the scene's regulations, in its order, as a list of the objects of `assess`.
    fn verdicts_json(&self, py: Python<'_>) -> PyResult<String> {
        let verdicts = py.detach(|| self.found.verdicts(&self.scene)).map_err(of_pipeline)?;
        let documents: Vec<Value> = verdicts.iter().map(|v| v.assessment.document()).collect();
        serde_json::to_string(&documents).map_err(of_json)
    }

    /// The cells of a receiver, the second axis slow, with both errors: NaN off a disc, the error of one ray where none arrived.
    fn layers<'py>(&self, py: Python<'py>, receiver: usize) -> PyResult<Layers<'py>> {
        let r = self.receiver(receiver)?;
        let shape = [r.grid[1], r.grid[0]];
        let geometric = self.found.geometric_cells(&self.scene, receiver);
        Ok((
            shaped(py, on_receiver(r, r.cells.clone()), &shape)?,
            shaped(py, on_receiver(r, cell_errors(r)), &shape)?,
            geometric
                .filter(|g| g.len() == r.cells.len())
                .map(|g| shaped(py, on_receiver(r, g), &shape))
                .transpose()?,
        ))
    }

    /// The cells of a further channel of a receiver and their statistical errors, as those of the receiver itself.
    fn channel<'py>(&self, py: Python<'py>, receiver: usize, channel: usize) -> PyResult<Pair<'py>> {
        let r = self.receiver(receiver)?;
        let c = r
            .channels
            .get(channel)
            .ok_or_else(|| PyIndexError::new_err(format!("channel {channel}: there are {}", r.channels.len())))?;
        let shape = [r.grid[1], r.grid[0]];
        let (cells, errors) = (on_receiver(r, c.cells.clone()), on_receiver(r, channel_cell_errors(r, c)));
        Ok((shaped(py, cells, &shape)?, shaped(py, errors, &shape)?))
    }

    /// The edges of the cells along both axes: mm of planes, degrees of angles.
    fn edges<'py>(&self, py: Python<'py>, receiver: usize) -> PyResult<Pair<'py>> {
        let r = self.receiver(receiver)?;
        let along = |axis: usize| -> Vec<f64> {
            let (n, low) = (r.grid[axis], r.middle[axis] - r.half[axis]);
            (0..=n).map(|k| low + 2.0 * r.half[axis] * k as f64 / n as f64).collect()
        };
        let (first, second) = (along(0), along(1));
        let lengths = [first.len(), second.len()];
        Ok((shaped(py, first, &lengths[..1])?, shaped(py, second, &lengths[1..])?))
    }

    /// Recorded paths vertex by vertex: ray, branch, bounce, point (n, 3), power.
    fn paths<'py>(&self, py: Python<'py>) -> PyResult<Vertices<'py>> {
        let paths = &self.found.results.paths;
        let n = paths.len();
        Ok((
            shaped(py, paths.iter().map(|v| v.ray).collect(), &[n])?,
            shaped(py, paths.iter().map(|v| v.branch).collect(), &[n])?,
            shaped(py, paths.iter().map(|v| v.bounce).collect(), &[n])?,
            shaped(py, flat(paths.iter().map(|v| v.point)), &[n, 3])?,
            shaped(py, paths.iter().map(|v| v.power).collect(), &[n])?,
        ))
    }
}

/// Numbers of cells, with none off a disc.
fn on_receiver(r: &ReceiverResult, mut cells: Vec<f64>) -> Vec<f64> {
    r.off.iter().for_each(|&k| cells[k] = f64::NAN);
    cells
}

/// Most pixels of a picture: half a gigabyte while it is made.
const MOST_PIXELS: usize = 1 << 27;

/// A map of values (rows from below) as the bytes of a PNG file.
///
/// Raises `ValueError` for a picture of more than 134 million pixels, and for an exponent that is not positive.
#[pyfunction]
#[pyo3(signature = (values, zoom = 1, exponent = 1.0))]
pub(crate) fn value_map(
    py: Python<'_>,
    values: &Bound<'_, PyAny>,
    zoom: u32,
    exponent: f64,
) -> PyResult<Py<PyBytes>> {
    if !(exponent > 0.0 && exponent.is_finite()) {
        return Err(PyValueError::new_err(format!("exponent = {exponent}: it must be a positive number, as 0.5")));
    }
    let width = values.getattr("shape")?.extract::<Vec<usize>>()?.get(1).copied().unwrap_or(1);
    let array = columns(values, "values", width)?;
    let numbers = rows(&array)?.to_vec();
    let pixels = numbers.len().saturating_mul(zoom as usize).saturating_mul(zoom as usize);
    if pixels > MOST_PIXELS {
        return Err(PyValueError::new_err(format!(
            "zoom = {zoom}: the picture would have {pixels} pixels, more than {MOST_PIXELS}; take a smaller one"
        )));
    }
    let axis =
        |label: &str, cells: usize| Axis { label: label.into(), unit: String::new(), range: [0.0, 1.0], cells };
    let grid = Grid {
        name: String::new(),
        quantity: String::new(),
        unit: String::new(),
        axes: [axis("x", width), axis("y", numbers.len() / width.max(1))],
        values: numbers,
        error: None,
        geometric: None,
        layers: Vec::new(),
    };
    let png = Picture::of_grid(&grid, ColourMap::Inferno, zoom, exponent).to_png();
    Ok(PyBytes::new(py, &png.map_err(|e| SceneError::new_err(e.to_string()))?).unbind())
}

/// The lamp regulations that there are tables of: id, name, number of rows, how well checked.
#[pyfunction]
pub(crate) fn regulations() -> Vec<(String, String, usize, String)> {
    let all = Regulation::all().into_iter();
    all.map(|r| (r.id.to_string(), r.function.name.to_string(), r.function.rows.len(), r.checked())).collect()
}

/// What the command says of names that it does not know: how to see all of them there.
const LIST_OF_COMMAND: &str = "(`assess --list` shows all)";

/// A far field over H and V in candela judged by a regulation, as JSON.
#[pyfunction]
#[pyo3(signature = (results, receiver, regulation, left_hand = false, as_placed = false))]
pub(crate) fn assess(
    py: Python<'_>,
    results: &Results,
    receiver: usize,
    regulation: &str,
    left_hand: bool,
    as_placed: bool,
) -> PyResult<String> {
    let r = results.receiver(receiver)?;
    if r.kind != "far_field" || r.unit != "cd" || r.angles != Some(FarFieldType::A) {
        let angles = r.angles.map_or(String::new(), |angles| format!(" with angles {angles:?}"));
        return Err(SceneError::new_err(format!(
            "{}: a verdict needs a far field with angles \"A\" in a run that counts lm, not a {}{angles} in {}",
            r.name, r.kind, r.unit
        )));
    }
    let wanted = RegulationUse { id: regulation.into(), receiver: Some(r.name.clone()), left_hand, as_placed };
    let judged = py.detach(|| results.found.verdict(&results.scene, &wanted)).map_err(|e| {
        let message = e.to_string();
        let reason = message.trim_end_matches(LIST_OF_COMMAND).trim_end_matches([' ', '…']);
        let all = if reason.len() < message.len() { "; lampyris.regulations() has all of them" } else { "" };
        SceneError::new_err(format!("{reason}{all}"))
    })?;
    serde_json::to_string(&judged.assessment.document()).map_err(of_json)
}

//! Errors of the crate as Python exceptions that say what to do.

use lampyris::{formats, pipeline, simulate, step};
use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};

create_exception!(lampyris, SceneError, PyValueError, "A scene or a setting asks for what cannot be.");
create_exception!(lampyris, InputError, PyOSError, "A file cannot be read, or is not what it should be.");
create_exception!(lampyris, Defect, PyRuntimeError, "lampyris itself went wrong: please report it.");

/// The exception of a job that cannot be done, with the line of the scene that is at fault.
pub(crate) fn of_pipeline(e: pipeline::Error) -> PyErr {
    let mut text = e.to_string();
    if let Some(excerpt) = e.excerpt() {
        let before = excerpt.text.get(..excerpt.span.start).unwrap_or("");
        let line = excerpt.text.lines().nth(before.matches('\n').count()).unwrap_or("");
        text += &format!("\n    {}", line.trim());
    }
    match e.kind() {
        pipeline::ErrorKind::Input => InputError::new_err(text),
        _ => SceneError::new_err(text),
    }
}

/// The exception of a scene that is wrong.
pub(crate) fn of_scene(e: simulate::Error) -> PyErr {
    of_pipeline(e.into())
}

/// The exception of a STEP file that cannot be read.
pub(crate) fn of_step(e: step::Error) -> PyErr {
    InputError::new_err(e.to_string())
}

/// The exception of another file.
pub(crate) fn of_format(e: formats::Error) -> PyErr {
    InputError::new_err(e.to_string())
}

/// The exception of a document that could not be written as JSON.
pub(crate) fn of_json(e: serde_json::Error) -> PyErr {
    Defect::new_err(format!("a document cannot be written: {e}; please report it"))
}

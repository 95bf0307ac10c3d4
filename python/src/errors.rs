//! Errors of the crate as Python exceptions that say what to do.

use lampyris::{formats, pipeline, simulate, step};
use pyo3::create_exception;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::io;

create_exception!(lampyris, SceneError, PyValueError, "A scene or a setting asks for what cannot be.");
create_exception!(lampyris, InputError, PyOSError, "A file cannot be read, or is not what it should be.");
create_exception!(lampyris, Defect, PyRuntimeError, "lampyris itself went wrong: please report it.");

/// Settings whose keyword in Python has another name; a message begins with the setting that it is about.
const KEYWORDS: [(&str, &str); 5] = [
    ("until_error", "until"),
    ("accuracy", "accuracy_deg"),
    ("part", "parts"),
    ("face", "faces"),
    ("role", "roles"),
];

/// The exception of a job that cannot be done, with the line of the scene that is at fault.
pub(crate) fn of_pipeline(e: pipeline::Error) -> PyErr {
    let mut text = e.to_string();
    if let Some((setting, keyword)) = KEYWORDS.iter().find(|(setting, _)| e.setting_name() == Some(*setting)) {
        text = text.replacen(*setting, keyword, 1);
    }
    if let Some(excerpt) = e.excerpt() {
        let before = excerpt.text.get(..excerpt.span.start).unwrap_or("");
        let line = excerpt.text.lines().nth(before.matches('\n').count()).unwrap_or("");
        text += &format!("\n    {}", line.trim());
    }
    match e.kind() {
        pipeline::ErrorKind::Input => unreadable(text),
        _ => SceneError::new_err(text),
    }
}

/// The exception of a scene that is wrong.
pub(crate) fn of_scene(e: simulate::Error) -> PyErr {
    of_pipeline(e.into())
}

/// The exception of a STEP file that cannot be read.
pub(crate) fn of_step(e: step::Error) -> PyErr {
    unreadable(e.to_string())
}

/// The exception of another file.
pub(crate) fn of_format(e: formats::Error) -> PyErr {
    unreadable(e.to_string())
}

/// The exception of a file: of one that is not there the one that is a `FileNotFoundError` too.
fn unreadable(text: String) -> PyErr {
    // What the system says is all that errors of scenes keep of it.
    if !text.contains(&io::Error::from_raw_os_error(NO_SUCH_FILE).to_string()) {
        return InputError::new_err(text);
    }
    let missing = |py: Python<'_>| {
        let kind = py.import("lampyris.errors")?.getattr("MissingFileError")?;
        Ok(PyErr::from_value(kind.call1((&text,))?))
    };
    Python::attach(missing).unwrap_or_else(|e: PyErr| e)
}

/// The number that Linux, macOS and Windows have for a file that is not there.
const NO_SUCH_FILE: i32 = 2;

/// The exception of a document that could not be written as JSON.
pub(crate) fn of_json(e: serde_json::Error) -> PyErr {
    Defect::new_err(format!("a document cannot be written: {e}; please report it"))
}

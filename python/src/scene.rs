//! Scenes as text and as plain data, and the files that go with them.

use crate::arrays::{columns, require_finite, rows};
use crate::errors::{SceneError, of_format, of_json, of_scene};
use lampyris::formats::{LightRay, write_rays};
use lampyris::math::Vector;
use lampyris::optics::catalogue;
use lampyris::simulate::Scene;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Checks the text of a scene and gives its tables as JSON, as they were written.
#[pyfunction]
pub(crate) fn scene_to_json(text: &str, name: &str, folder: PathBuf) -> PyResult<String> {
    Scene::parse(text, name, &folder).map_err(of_scene)?;
    let tables: toml::Value = toml::from_str(text).map_err(|e| SceneError::new_err(e.to_string()))?;
    serde_json::to_string(&json_of(tables)?).map_err(of_json)
}

/// The key under which a number that is not finite stands as text: JSON has no word for it, and `caught_after = inf` has a meaning.
const NOT_FINITE: &str = "$float";

/// A value of TOML as JSON.
fn json_of(value: toml::Value) -> PyResult<Value> {
    Ok(match value {
        toml::Value::Float(x) if !x.is_finite() => json!({ NOT_FINITE: x.to_string() }),
        toml::Value::Array(items) => Value::Array(items.into_iter().map(json_of).collect::<PyResult<_>>()?),
        toml::Value::Table(table) => {
            let entries = table.into_iter().map(|(key, value)| Ok((key, json_of(value)?)));
            Value::Object(entries.collect::<PyResult<_>>()?)
        }
        plain => serde_json::to_value(plain).map_err(of_json)?,
    })
}

/// What [`json_of`] made, as TOML.
fn toml_of(value: Value) -> PyResult<toml::Value> {
    let refuse = |e: toml::ser::Error| {
        SceneError::new_err(format!("a scene holds what TOML has no word for: {e}; leave None out"))
    };
    Ok(match value {
        Value::Object(entries) => match entries.get(NOT_FINITE).and_then(Value::as_str) {
            Some(text) => {
                toml::Value::Float(text.parse().map_err(|_| SceneError::new_err(format!("{text} is no number")))?)
            }
            None => {
                let entries = entries.into_iter().map(|(key, value)| Ok((key, toml_of(value)?)));
                toml::Value::Table(entries.collect::<PyResult<_>>()?)
            }
        },
        Value::Array(items) => toml::Value::Array(items.into_iter().map(toml_of).collect::<PyResult<_>>()?),
        plain => toml::Value::try_from(plain).map_err(refuse)?,
    })
}

/// Tables given as JSON, as TOML.
#[pyfunction]
pub(crate) fn toml_from_json(tables: &str) -> PyResult<String> {
    let tables: Value = serde_json::from_str(tables).map_err(|e| SceneError::new_err(e.to_string()))?;
    toml::to_string(&toml_of(tables)?).map_err(|e| SceneError::new_err(e.to_string()))
}

/// The JSON Schema of scenes.
#[pyfunction]
pub(crate) fn scene_schema() -> String {
    Scene::schema().to_string()
}

/// The names of the media that need no table.
#[pyfunction]
pub(crate) fn media() -> Vec<String> {
    catalogue::names().map(str::to_owned).collect()
}

/// Writes rays (n, 7: origin, direction, power) or (n, 8: and wavelength, nm) as the NPZ file that a scene reads.
#[pyfunction]
pub(crate) fn write_ray_file(path: PathBuf, rays: &Bound<'_, PyAny>) -> PyResult<()> {
    let width = rays.getattr("shape").and_then(|s| s.extract::<Vec<usize>>()).ok();
    let width = if width.is_some_and(|s| s.get(1) == Some(&8)) { 8 } else { 7 };
    let array = columns(rays, "rays", width)?;
    let numbers = rows(&array)?;
    require_finite(numbers, width, "rays")?;
    if numbers.is_empty() {
        return Err(PyValueError::new_err("rays: there must be at least one"));
    }
    let ray = |(k, row): (usize, &[f64])| {
        let direction = Vector::new(row[3], row[4], row[5]);
        let refuse = |what: String| Err(PyValueError::new_err(format!("rays[{k}] {what}; leave such rows out")));
        if direction == Vector::ZERO {
            return refuse("has a direction without length".into());
        }
        if row[6] < 0.0 {
            return refuse(format!("has the power {}: it must be zero or more", row[6]));
        }
        if let Some(nm) = row.get(7).filter(|nm| **nm <= 0.0) {
            return refuse(format!("has the wavelength {nm} nm: it must be positive"));
        }
        let origin = Vector::new(row[0], row[1], row[2]);
        Ok(LightRay { origin, direction, power: row[6], wavelength_nm: row.get(7).copied() })
    };
    let rays: Vec<LightRay> = numbers.chunks(width).enumerate().map(ray).collect::<PyResult<_>>()?;
    write_rays(&path, &rays).map_err(of_format)
}

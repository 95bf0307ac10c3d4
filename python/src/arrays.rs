//! NumPy arrays in and out: what is wrong with an array is said before any work.

use crate::errors::Defect;
use lampyris::math::{Point, Uv, Vector};
use numpy::{Element, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use std::ops::RangeInclusive;

/// How far from 1 the length of a direction may be and keep its bits.
const UNIT_ROUNDING: f64 = 1e-15;
/// Lengths whose squares neither overflow nor lose digits.
const SAFE_LENGTHS: RangeInclusive<f64> = 1e-140..=1e140;

/// A float64 array of so many columns as it lies in memory; other numbers are converted by NumPy, which copies.
///
/// # Errors
/// `TypeError` for what is no array of real numbers, `ValueError` for another shape.
pub(crate) fn columns<'py>(
    given: &Bound<'py, PyAny>,
    name: &str,
    width: usize,
) -> PyResult<PyReadonlyArray2<'py, f64>> {
    columns_of(given, name, &[width])
}

/// [`columns`] of an array that may have one of several widths.
pub(crate) fn columns_of<'py>(
    given: &Bound<'py, PyAny>,
    name: &str,
    widths: &[usize],
) -> PyResult<PyReadonlyArray2<'py, f64>> {
    let py = given.py();
    let numpy = py.import("numpy")?;
    let wanted = widths.iter().map(|width| format!("(n, {width})")).collect::<Vec<_>>().join(" or ");
    let array = numpy.call_method1("asarray", (given,)).map_err(|e| {
        PyValueError::new_err(format!("{name}: an array of shape {wanted} is needed: {}", e.value(py)))
    })?;
    if given.hasattr("mask")? && numpy.getattr("ma")?.call_method1("is_masked", (given,))?.is_truthy()? {
        return Err(PyValueError::new_err(format!(
            "{name}: some numbers are masked; leave such rows out with {name}[~numpy.ma.getmaskarray({name}).any(axis=1)]"
        )));
    }
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if !matches!(kind.as_str(), "f" | "i" | "u") {
        let dtype = array.getattr("dtype")?;
        let advice = match kind.as_str() {
            "c" => format!("take {name}.real if the imaginary parts mean nothing"),
            "O" => format!("replace what is no number, as None, and make numpy.asarray({name}, dtype=float) of it"),
            _ => format!("convert it with numpy.asarray({name}, dtype=float)"),
        };
        return Err(PyTypeError::new_err(format!(
            "{name}: an array of float64 with shape {wanted} is needed, not of {dtype}; {advice}"
        )));
    }
    if shape.len() != 2 || !widths.contains(&shape[1]) {
        let advice = match shape[..] {
            [n] if widths.contains(&n) => format!("; a single row is {name}[None, :]"),
            [n, _] if widths.contains(&n) => format!("; rows and columns are exchanged by {name}.T"),
            [.., n] if shape.len() > 2 && widths.contains(&n) => format!("; its rows are {name}.reshape(-1, {n})"),
            _ => String::new(),
        };
        let shape = array.getattr("shape")?;
        return Err(PyValueError::new_err(format!("{name}: the shape must be {wanted}, not {shape}{advice}")));
    }
    // Contiguous and aligned: fields of packed records are read by numpy, which copies them.
    let array = numpy.call_method1("require", (array, numpy.getattr("float64")?, ("C", "A")))?;
    let array = array
        .cast_into::<PyArray2<f64>>()
        .map_err(|_| PyTypeError::new_err(format!("{name}: an array of float64 with shape {wanted} is needed")))?;
    array.try_readonly().map_err(|_| {
        PyValueError::new_err(format!("{name}: the array is being written by another thread; wait, or pass a copy"))
    })
}

/// The rows of a contiguous array.
pub(crate) fn rows<'a>(array: &'a PyReadonlyArray2<'_, f64>) -> PyResult<&'a [f64]> {
    array.as_slice().map_err(|_| Defect::new_err("an array that was made contiguous is not; please report it"))
}

/// A vector as an array of this shape, without a copy.
pub(crate) fn shaped<'py, T: Element>(
    py: Python<'py>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    PyArray1::from_vec(py, values).reshape(shape.to_vec())
}

/// Coordinates of points in a row.
pub(crate) fn flat(points: impl Iterator<Item = Point>) -> Vec<f64> {
    points.flat_map(|p| p.to_array()).collect()
}

/// Coordinates of parameters in a row.
pub(crate) fn flat_uv(points: impl Iterator<Item = Uv>) -> Vec<f64> {
    points.flat_map(|p| p.to_array()).collect()
}

/// The vector at the beginning of a row.
pub(crate) fn vector(row: &[f64]) -> Vector {
    Vector::new(row[0], row[1], row[2])
}

/// The vector at unit length, those of it as they are; `None` where it has none or a number is not finite.
pub(crate) fn unit(given: Vector) -> Option<Vector> {
    let length = given.length();
    if (length - 1.0).abs() <= UNIT_ROUNDING {
        return Some(given);
    }
    if SAFE_LENGTHS.contains(&length) {
        return Some(given / length);
    }
    let largest = given.abs().max_element();
    (given.is_finite() && largest > 0.0).then(|| (given / largest).normalize())
}

/// Whether an array is empty or all of its rows are finite.
///
/// # Errors
/// `ValueError` that names the first row that is not.
pub(crate) fn require_finite(rows: &[f64], width: usize, name: &str) -> PyResult<()> {
    match rows.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(k) => Err(PyValueError::new_err(format!(
            "{name}[{}, {}] is {}: every number must be finite; leave such rows out with {name}[numpy.isfinite({name}).all(axis=1)]",
            k / width,
            k % width,
            rows[k]
        ))),
    }
}

/// Farthest coordinate of points, mm: there doubles are a tenth of a mm apart, and farther out octree and BVH miss what is hit.
pub(crate) const FARTHEST: f64 = 1e15;

/// Number of rows of an array.
pub(crate) fn length(array: &PyReadonlyArray2<'_, f64>) -> usize {
    array.shape()[0]
}

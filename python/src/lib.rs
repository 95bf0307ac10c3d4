//! The extension module of the Python package `lampyris`: the pipeline, the intersectors and the studies of the crate, on NumPy arrays.
//!
//! What is pleasant to use (scenes, results, pictures, Dask) is written in Python on top of it, in `lampyris/`. Guarantee: no input
//! aborts the interpreter; work runs without the GIL on threads of its own, and Ctrl-C ends it.

mod accounts;
mod arrays;
mod background;
mod errors;
mod hits;
mod intersectors;
mod mesh;
mod model;
mod names;
mod part;
mod prepared;
mod results;
mod scene;
mod settings;
mod studies;

use pyo3::prelude::*;

/// The compiled half of `lampyris`.
#[pymodule]
mod _lampyris {
    #[pymodule_export]
    use super::errors::{Defect, InputError, SceneError};
    #[pymodule_export]
    use super::hits::{Hits, restore_hits};
    #[pymodule_export]
    use super::intersectors::Tracer;
    #[pymodule_export]
    use super::mesh::Mesh;
    #[pymodule_export]
    use super::model::{Model, demo_files, read_step};
    #[pymodule_export]
    use super::part::Part;
    #[pymodule_export]
    use super::prepared::Prepared;
    #[pymodule_export]
    use super::results::{Results, assess, regulations, value_map};
    #[pymodule_export]
    use super::scene::{media, scene_schema, scene_to_json, toml_from_json, write_ray_file};
    #[pymodule_export]
    use super::studies::study;
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::background::remember_process();
        super::background::keep_panics_from_terminal();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

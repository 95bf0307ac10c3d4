//! Nearest hits as arrays, written where NumPy then has them.

use crate::arrays::shaped;
use lampyris::Hit;
use lampyris::intersect::{Certainty, Cost};
use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use rayon::prelude::*;

/// Nearest hits, an array each.
#[pyclass(frozen, module = "lampyris")]
pub(crate) struct Hits {
    /// Distance along the ray, mm; infinite for a miss, (n,).
    #[pyo3(get)]
    t: Py<PyArrayDyn<f64>>,
    /// Outward unit normal to shade with, NaN for a miss, (n, 3).
    #[pyo3(get)]
    normal: Py<PyArrayDyn<f64>>,
    /// Outward unit normal of the flat facet, or of the spline, NaN for a miss, (n, 3).
    #[pyo3(get)]
    geometric_normal: Py<PyArrayDyn<f64>>,
    /// Placed face, −1 for a miss, (n,).
    #[pyo3(get)]
    face: Py<PyArrayDyn<i32>>,
    /// Facet, or patch of the spline, −1 for a miss, (n,).
    #[pyo3(get)]
    primitive: Py<PyArrayDyn<i32>>,
    /// Parameters on the face's surface, NaN for a miss, (n, 2).
    #[pyo3(get)]
    uv: Py<PyArrayDyn<f64>>,
    /// How sure it is: 0 a miss, 1 a facet, 2 polished, 3 certified, 4 tangent, 5 not certified, (n,).
    #[pyo3(get)]
    certainty: Py<PyArrayDyn<u8>>,
    /// Nodes visited, over all rays.
    #[pyo3(get)]
    nodes: u64,
    /// Facets or patches tested, over all rays.
    #[pyo3(get)]
    tests: u64,
}

/// The arrays of hits, in the order of their fields.
type Arrays = (
    Py<PyArrayDyn<f64>>,
    Py<PyArrayDyn<f64>>,
    Py<PyArrayDyn<f64>>,
    Py<PyArrayDyn<i32>>,
    Py<PyArrayDyn<i32>>,
    Py<PyArrayDyn<f64>>,
    Py<PyArrayDyn<u8>>,
);

#[pymethods]
impl Hits {
    /// What pickle and copy make another of.
    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (Arrays, u64, u64))> {
        let arrays = (
            self.t.clone_ref(py),
            self.normal.clone_ref(py),
            self.geometric_normal.clone_ref(py),
            self.face.clone_ref(py),
            self.primitive.clone_ref(py),
            self.uv.clone_ref(py),
            self.certainty.clone_ref(py),
        );
        let restore = py.import("lampyris._lampyris")?.getattr("restore_hits")?;
        Ok((restore.unbind(), (arrays, self.nodes, self.tests)))
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.t.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let numpy = py.import("numpy")?;
        let met = numpy.call_method1("count_nonzero", (numpy.call_method1("isfinite", (&self.t,))?,))?;
        Ok(format!("<lampyris.Hits: {met} of {} rays hit>", self.__len__(py)))
    }
}

/// Hits of their arrays.
#[pyfunction]
pub(crate) fn restore_hits(arrays: Arrays, nodes: u64, tests: u64) -> Hits {
    let (t, normal, geometric_normal, face, primitive, uv, certainty) = arrays;
    Hits { t, normal, geometric_normal, face, primitive, uv, certainty, nodes, tests }
}

/// Arrays of hits in the making.
pub(crate) struct HitArrays {
    t: Vec<f64>,
    normal: Vec<f64>,
    geometric_normal: Vec<f64>,
    face: Vec<i32>,
    primitive: Vec<i32>,
    uv: Vec<f64>,
    certainty: Vec<u8>,
}

impl HitArrays {
    /// Pages that the system hands out as zeros when they are first written.
    pub(crate) fn new(n: usize) -> Self {
        Self {
            t: vec![0.0; n],
            normal: vec![0.0; 3 * n],
            geometric_normal: vec![0.0; 3 * n],
            face: vec![0; n],
            primitive: vec![0; n],
            uv: vec![0.0; 2 * n],
            certainty: vec![0; n],
        }
    }

    /// In pieces of so many rays, one after another.
    pub(crate) fn chunks(&mut self, n: usize) -> impl IndexedParallelIterator<Item = HitRows<'_>> {
        self.t
            .par_chunks_mut(n)
            .zip(self.normal.par_chunks_mut(3 * n))
            .zip(self.geometric_normal.par_chunks_mut(3 * n))
            .zip(self.face.par_chunks_mut(n))
            .zip(self.primitive.par_chunks_mut(n))
            .zip(self.uv.par_chunks_mut(2 * n))
            .zip(self.certainty.par_chunks_mut(n))
            .map(|((((((t, normal), geometric_normal), face), primitive), uv), certainty)| HitRows {
                t,
                normal,
                geometric_normal,
                face,
                primitive,
                uv,
                certainty,
            })
    }

    /// As they lie, without a copy.
    pub(crate) fn into_hits(self, py: Python<'_>, n: usize, cost: Cost) -> PyResult<Hits> {
        Ok(Hits {
            t: shaped(py, self.t, &[n])?.unbind(),
            normal: shaped(py, self.normal, &[n, 3])?.unbind(),
            geometric_normal: shaped(py, self.geometric_normal, &[n, 3])?.unbind(),
            face: shaped(py, self.face, &[n])?.unbind(),
            primitive: shaped(py, self.primitive, &[n])?.unbind(),
            uv: shaped(py, self.uv, &[n, 2])?.unbind(),
            certainty: shaped(py, self.certainty, &[n])?.unbind(),
            nodes: cost.nodes,
            tests: cost.tests,
        })
    }
}

/// The rows of the arrays that one task writes.
pub(crate) struct HitRows<'a> {
    pub(crate) t: &'a mut [f64],
    normal: &'a mut [f64],
    geometric_normal: &'a mut [f64],
    face: &'a mut [i32],
    primitive: &'a mut [i32],
    uv: &'a mut [f64],
    certainty: &'a mut [u8],
}

impl HitRows<'_> {
    pub(crate) fn write(&mut self, k: usize, hit: Option<&Hit>) {
        let Some(hit) = hit else {
            self.t[k] = f64::INFINITY;
            self.normal[3 * k..3 * k + 3].fill(f64::NAN);
            self.geometric_normal[3 * k..3 * k + 3].fill(f64::NAN);
            self.face[k] = -1;
            self.primitive[k] = -1;
            self.uv[2 * k..2 * k + 2].fill(f64::NAN);
            return;
        };
        self.t[k] = hit.t;
        self.normal[3 * k..3 * k + 3].copy_from_slice(&hit.normal.to_array());
        self.geometric_normal[3 * k..3 * k + 3].copy_from_slice(&hit.geometric_normal.to_array());
        self.face[k] = hit.face.0 as i32;
        self.primitive[k] = hit.primitive as i32;
        self.uv[2 * k..2 * k + 2].copy_from_slice(&hit.uv.to_array());
        self.certainty[k] = match hit.certainty {
            Certainty::Facet => 1,
            Certainty::Polished => 2,
            Certainty::Certified => 3,
            Certainty::Tangent => 4,
            _ => 5,
        };
    }
}

//! Meshes of quad facets as arrays.

use crate::arrays::{FARTHEST, columns, columns_of, flat, flat_uv, length, require_finite, rows, shaped, vector};
use crate::errors::{SceneError, of_format, of_json};
use crate::model::Model;
use lampyris::FacetMesh;
use lampyris::formats::{Facets, write_facets};
use lampyris::math::{FaceId, Uv, Vector};
use lampyris::mesh::{Facet, MeshVertex};
use lampyris::step::Import;
use lampyris::tessellate::{Report, Tessellation};
use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// Quad facets with the normals of the spline; a triangle is a quad whose last two corners coincide.
#[pyclass(frozen, module = "lampyris")]
pub(crate) struct Mesh {
    pub(crate) mesh: Arc<FacetMesh>,
    report: Option<Box<Report>>,
    /// The model that was tessellated, where it is one that Python has.
    import: Option<Arc<Import>>,
}

impl Mesh {
    pub(crate) fn of_model(made: Tessellation, import: Arc<Import>) -> Self {
        let Tessellation { mesh, report, .. } = made;
        Self { mesh: Arc::new(mesh), report: Some(Box::new(report)), import: Some(import) }
    }

    pub(crate) fn of_scene(mesh: FacetMesh) -> Self {
        Self { mesh: Arc::new(mesh), report: None, import: None }
    }

    /// Refuses to move hits on this mesh to the spline of a model that it does not stand for.
    pub(crate) fn require_model(&self, model: &Model) -> PyResult<()> {
        let faces = model.import.model.placed_face_count();
        let is_other = self.import.as_ref().is_some_and(|import| !Arc::ptr_eq(import, &model.import))
            || self.mesh.facets.iter().any(|facet| facet.face.0 as usize >= faces);
        let message = if !self.mesh.facets.is_empty() && self.mesh.sag.is_empty() {
            "normals exact: a mesh of arrays stands for no spline that hits could be moved to; use another kind of normals"
        } else if is_other {
            "normals exact: the mesh is not of this model; give the one whose tessellate() made it"
        } else {
            return Ok(());
        };
        Err(SceneError::new_err(message))
    }
}

#[pymethods]
impl Mesh {
    /// From points (n, 3) and corners of triangles (m, 3) or quads (m, 4); normals are those of the points (n, 3), and of the flat facets
    /// where none are given or they have no length.
    #[staticmethod]
    #[pyo3(signature = (positions, facets, normals = None))]
    fn from_arrays(
        positions: &Bound<'_, PyAny>,
        facets: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let positions = columns(positions, "positions", 3)?;
        let points = rows(&positions)?;
        require_finite(points, 3, "positions")?;
        if let Some(k) = points.iter().position(|x| x.abs() > FARTHEST) {
            return Err(PyValueError::new_err(format!(
                "positions[{}, {}] is {}: coordinates are mm, and at most {FARTHEST:e}; check the unit of length",
                k / 3,
                k % 3,
                points[k]
            )));
        }
        let count = length(&positions);
        if count > u32::MAX as usize / 4 {
            return Err(PyValueError::new_err("positions: a mesh holds at most a thousand million points"));
        }
        let corners = columns_of(facets, "facets", &[3, 4])?;
        let width = corners.shape()[1];
        let corners = rows(&corners)?;
        if let Some(k) = corners.iter().position(|x| !(*x >= 0.0 && *x < count as f64 && x.fract() == 0.0)) {
            return Err(PyValueError::new_err(format!(
                "facets[{}, {}] is {}: it must be the number of one of the {count} positions",
                k / width,
                k % width,
                corners[k]
            )));
        }
        let given = normals.map(|n| columns(n, "normals", 3)).transpose()?;
        let given = given.as_ref().map(rows).transpose()?;
        if let Some(normals) = given {
            require_finite(normals, 3, "normals")?;
            if normals.len() != points.len() {
                return Err(PyValueError::new_err(format!("normals: there must be {count}, one a position")));
            }
        }
        let mut mesh = FacetMesh { positions: points.chunks(3).map(vector).collect(), ..FacetMesh::default() };
        for (k, facet) in corners.chunks(width).enumerate() {
            let places = [0, 1, 2, 3].map(|i| facet[i.min(width - 1)] as u32);
            let [a, b, c, d] = places.map(|p| mesh.positions[p as usize]);
            let flat = (c - a).cross(d - b) + if c == d { (b - a).cross(c - a) } else { Vector::ZERO };
            let normal_at = |p: u32| {
                let own = given.and_then(|normals| vector(&normals[3 * p as usize..]).try_normalize());
                own.or_else(|| flat.try_normalize())
            };
            let first = mesh.vertices.len() as u32;
            let used = if places[2] == places[3] { 3 } else { 4 };
            for &position in &places[..used] {
                // A facet without area is never hit; its normal does not matter.
                let normal = normal_at(position).unwrap_or(Vector::Z);
                mesh.vertices.push(MeshVertex { position, normal, uv: Uv::ZERO });
            }
            let vertices = [0, 1, 2, 3].map(|i: u32| first + i.min(used as u32 - 1));
            mesh.facets.push(Facet { vertices, face: FaceId(k as u32) });
        }
        Ok(Self { mesh: Arc::new(mesh), report: None, import: None })
    }

    /// Distinct points, mm, (n, 3).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let points = &self.mesh.positions;
        shaped(py, flat(points.iter().copied()), &[points.len(), 3])
    }

    /// The positions of the corners of every facet, (m, 4); of a triangle the last two are the same.
    #[getter]
    fn facets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<u32>>> {
        let corners = (0..self.mesh.facets.len()).flat_map(|f| self.mesh.corner_positions(f)).collect();
        shaped(py, corners, &[self.mesh.facets.len(), 4])
    }

    /// The normals at the corners of every facet, (m, 4, 3).
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let normals = self.vertices().map(|v| v.normal);
        shaped(py, flat(normals), &[self.mesh.facets.len(), 4, 3])
    }

    /// The parameters on the face's surface at the corners of every facet, (m, 4, 2).
    #[getter]
    fn uv<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        shaped(py, flat_uv(self.vertices().map(|v| v.uv)), &[self.mesh.facets.len(), 4, 2])
    }

    /// The placed face of every facet, (m,).
    #[getter]
    fn face<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<u32>>> {
        shaped(py, self.mesh.facets.iter().map(|f| f.face.0).collect(), &[self.mesh.facets.len()])
    }

    /// Proved distance of every facet from the spline, mm, (m,); infinite where there is no proof, empty without a spline.
    #[getter]
    fn sag<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        shaped(py, self.mesh.sag.clone(), &[self.mesh.sag.len()])
    }

    /// Area as traced, mm².
    #[getter]
    fn area(&self) -> f64 {
        self.mesh.area()
    }

    /// Enclosed volume, mm³; meaningful for a closed mesh alone.
    #[getter]
    fn volume(&self) -> f64 {
        self.mesh.volume()
    }

    /// The report of the mesher as JSON; none for a mesh that was given.
    fn report_json(&self) -> PyResult<Option<String>> {
        self.report.as_ref().map(|r| serde_json::to_string(r).map_err(of_json)).transpose()
    }

    /// Writes the facets in the format of the extension: .obj .stl .ply .vtu .glb .data2.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        write_facets(&path, &Facets::plain(&self.mesh, "facets"))
            .map_err(|e| if path.extension().is_none() { SceneError::new_err(e.to_string()) } else { of_format(e) })
    }

    fn __len__(&self) -> usize {
        self.mesh.facets.len()
    }

    fn __repr__(&self) -> String {
        format!("<lampyris.Mesh: {} facets, {} points>", self.mesh.facets.len(), self.mesh.positions.len())
    }
}

impl Mesh {
    fn vertices(&self) -> impl Iterator<Item = &MeshVertex> {
        self.mesh.facets.iter().flat_map(|f| f.vertices).map(|v| &self.mesh.vertices[v as usize])
    }
}

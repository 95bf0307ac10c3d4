//! Meshes of quad facets as arrays.

use crate::arrays::{columns, columns_of, flat, flat_uv, length, require_finite, rows, shaped, unit, vector};
use crate::errors::{SceneError, of_format, of_json};
use crate::model::Model;
use lampyris::FacetMesh;
use lampyris::formats::{Facets, write_facets};
use lampyris::math::{FaceId, Uv, Vector};
use lampyris::mesh::{Facet, MeshVertex};
use lampyris::step::Import;
use lampyris::tessellate::Tessellation;
use numpy::{PyArrayDyn, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;

/// Quad facets with the normals of the spline; a triangle is a quad whose last two corners coincide.
#[pyclass(frozen, module = "lampyris")]
pub(crate) struct Mesh {
    pub(crate) mesh: Arc<FacetMesh>,
    /// The mesher's, as JSON.
    report: Option<String>,
    /// The model that was tessellated, where it is one that Python has.
    import: Option<Arc<Import>>,
}

impl Mesh {
    pub(crate) fn of_model(made: Tessellation, import: Arc<Import>) -> PyResult<Self> {
        let Tessellation { mesh, report, .. } = made;
        let report = Some(serde_json::to_string(&report).map_err(of_json)?);
        Ok(Self { mesh: Arc::new(mesh), report, import: Some(import) })
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
    ///
    /// `corners` (4 m, 5) are normals and parameters of every corner instead, `faces` (m,) the placed faces, those of one together, `sag`
    /// (m,) the proved distances from the spline, and `report` is the mesher's account: what a mesh itself gives.
    #[staticmethod]
    #[pyo3(signature = (positions, facets, normals = None, corners = None, faces = None, sag = None, report = None))]
    fn from_arrays(
        positions: &Bound<'_, PyAny>,
        facets: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        corners: Option<&Bound<'_, PyAny>>,
        faces: Option<Vec<u32>>,
        sag: Option<Vec<f64>>,
        report: Option<String>,
    ) -> PyResult<Self> {
        let positions = columns(positions, "positions", 3)?;
        let points = checked_points(&positions)?;
        let numbers = columns_of(facets, "facets", &[3, 4])?;
        let (count, width) = (length(&positions), numbers.shape()[1]);
        let numbers = rows(&numbers)?;
        require_numbers(numbers, width, count)?;
        let facet_count = numbers.len() / width;
        let table = |given: Option<&Bound<'_, PyAny>>, name: &str, width: usize, rows_needed: usize| {
            let Some(array) = given.map(|given| columns(given, name, width)).transpose()? else { return Ok(None) };
            let values = rows(&array)?.to_vec();
            require_finite(&values, width, name)?;
            if values.len() != width * rows_needed {
                return Err(PyValueError::new_err(format!("{name}: there must be {rows_needed} rows")));
            }
            Ok(Some(values))
        };
        let source = Corners {
            of_points: table(normals, "normals", 3, count)?,
            own: table(corners, "corners", 5, 4 * facet_count)?,
        };
        // `faces` is the argument `face` of the Python side.
        for (name, given) in [("face", faces.as_ref().map(Vec::len)), ("sag", sag.as_ref().map(Vec::len))] {
            if let Some(length) = given.filter(|length| *length != facet_count) {
                return Err(PyValueError::new_err(format!(
                    "{name}: there must be {facet_count}, one a facet, not {length}"
                )));
            }
        }
        let faces = faces.unwrap_or_else(|| (0..facet_count as u32).collect());
        require_together(&faces)?;
        let mut mesh = FacetMesh {
            positions: points.chunks(3).map(vector).collect(),
            sag: sag.unwrap_or_default(),
            ..FacetMesh::default()
        };
        // The last vertex at each position: corners of a face that are alike are one, as the mesher has them.
        let mut last = vec![u32::MAX; mesh.positions.len()];
        let mut first_of_face = 0;
        for (k, (facet, face)) in numbers.chunks(width).zip(faces).enumerate() {
            if mesh.facets.last().is_none_or(|before| before.face != FaceId(face)) {
                first_of_face = mesh.vertices.len();
            }
            let places = [0, 1, 2, 3].map(|i| facet[i.min(width - 1)] as u32);
            let flat = flat_normal(places.map(|p| mesh.positions[p as usize]));
            let vertices = [0, 1, 2, 3].map(|i| {
                let vertex = source.vertex(4 * k + i, places[i], flat);
                let known = &mut last[places[i] as usize];
                let is_known = *known as usize >= first_of_face;
                if !(is_known && mesh.vertices.get(*known as usize).is_some_and(|other| is_same(other, &vertex))) {
                    *known = mesh.vertices.len() as u32;
                    mesh.vertices.push(vertex);
                }
                *known
            });
            mesh.facets.push(Facet { vertices, face: FaceId(face) });
        }
        Ok(Self { mesh: Arc::new(mesh), report, import: None })
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
        // An empty sum is -0 in Rust.
        self.mesh.area() + 0.0
    }

    /// Enclosed volume, mm³; meaningful for a closed mesh alone.
    #[getter]
    fn volume(&self) -> f64 {
        self.mesh.volume() + 0.0
    }

    /// The report of the mesher as JSON; none for a mesh that was given.
    fn report_json(&self) -> Option<&str> {
        self.report.as_deref()
    }

    /// Writes the facets in the format of the extension: .obj .stl .ply .vtu .glb .data2.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        write_facets(&path, &Facets::plain(&self.mesh, "facets")).map_err(of_format)
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

/// Where normals and parameters of corners come from.
struct Corners {
    /// Normals of points.
    of_points: Option<Vec<f64>>,
    /// Normal and parameters of every corner.
    own: Option<Vec<f64>>,
}

impl Corners {
    /// The corner of this number, of a facet with this flat normal.
    fn vertex(&self, corner: usize, position: u32, flat: Option<Vector>) -> MeshVertex {
        let own = self.own.as_ref().map(|own| &own[5 * corner..5 * corner + 5]);
        let given = own.or(self.of_points.as_ref().map(|all| &all[3 * position as usize..]));
        // A facet without area is never hit; its normal does not matter.
        let normal = given.and_then(|row| unit(vector(row))).or(flat).unwrap_or(Vector::Z);
        MeshVertex { position, normal, uv: own.map_or(Uv::ZERO, |row| Uv::new(row[3], row[4])) }
    }
}

/// Whether two vertices at one position have the same normal and parameters, bit by bit.
fn is_same(a: &MeshVertex, b: &MeshVertex) -> bool {
    let bits = |v: &MeshVertex| [v.normal.x, v.normal.y, v.normal.z, v.uv.x, v.uv.y].map(f64::to_bits);
    bits(a) == bits(b)
}

/// The normal of the flat facet; `None` without area.
fn flat_normal([a, b, c, d]: [Vector; 4]) -> Option<Vector> {
    let flat = (c - a).cross(d - b) + if c == d { (b - a).cross(c - a) } else { Vector::ZERO };
    flat.try_normalize()
}

/// Farthest corner of a mesh, mm: octree and BVH leave out facets that reach beyond. Rays may start farther away.
const FARTHEST_CORNER: f64 = 1e12;

/// The coordinates of points that a mesh may have.
///
/// # Errors
/// `ValueError` that names the first that it may not, or their number.
fn checked_points<'a>(positions: &'a PyReadonlyArray2<'_, f64>) -> PyResult<&'a [f64]> {
    let points = rows(positions)?;
    require_finite(points, 3, "positions")?;
    if let Some(k) = points.iter().position(|x| x.abs() > FARTHEST_CORNER) {
        return Err(PyValueError::new_err(format!(
            "positions[{}, {}] is {}: coordinates are mm, and at most {FARTHEST_CORNER:e}; check the unit of length",
            k / 3,
            k % 3,
            points[k]
        )));
    }
    if points.len() / 3 > u32::MAX as usize / 4 {
        return Err(PyValueError::new_err("positions: a mesh holds at most a thousand million points"));
    }
    Ok(points)
}

/// Refuses corners that are no numbers of positions.
fn require_numbers(corners: &[f64], width: usize, count: usize) -> PyResult<()> {
    match corners.iter().position(|x| !(*x >= 0.0 && *x < count as f64 && x.fract() == 0.0)) {
        None => Ok(()),
        Some(k) => Err(PyValueError::new_err(format!(
            "facets[{}, {}] is {}: it must be the number of one of the {count} positions",
            k / width,
            k % width,
            corners[k]
        ))),
    }
}

/// Refuses faces whose facets do not stand together, or whose numbers hits could not tell.
fn require_together(faces: &[u32]) -> PyResult<()> {
    if faces.is_sorted() && faces.last().is_none_or(|face| *face <= i32::MAX as u32) {
        return Ok(());
    }
    let mut seen = HashSet::new();
    for (k, group) in faces.chunk_by(|a, b| a == b).enumerate() {
        if !seen.insert(group[0]) || group[0] > i32::MAX as u32 {
            return Err(PyValueError::new_err(format!(
                "face: group {k} is of face {}: numbers must be below 2147483648, and the facets of a face stand together, as after facets[numpy.argsort(face, kind='stable')]",
                group[0]
            )));
        }
    }
    Ok(())
}

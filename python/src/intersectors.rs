//! Octree, BVH and spline, asked about arrays of rays.

use crate::arrays::{FARTHEST, columns, length, rows, unit, vector};
use crate::background::{interruptible, on_threads, stoppable};
use crate::errors::SceneError;
use crate::hits::{HitArrays, Hits};
use crate::mesh::Mesh;
use crate::model::Model;
use crate::names::normal_mode;
use lampyris::intersect::NormalMode;
use lampyris::intersect::bvh::{self, Bvh};
use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::polish::Polished;
use lampyris::intersect::{Cost, Footprint};
use lampyris::{FacetMesh, Hit, Intersector, Ray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;
use self_cell::self_cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

/// Rays that are turned into the crate's own at a time: they and their hits stay in the second cache.
const CHUNK: usize = 2048;
/// Fewer rays are asked about without a look at signals: they take milliseconds, and a thread that listens some 50 µs.
const UNHEARD_RAYS: usize = 16 * CHUNK;
type Tree<'a> = Box<dyn Intersector + Send + 'a>;

/// What facets are looked up in.
struct Facets {
    mesh: Arc<FacetMesh>,
    /// Of hits that are moved to the spline.
    exact: Option<Arc<Exact>>,
}

self_cell! {
    struct FacetTree {
        owner: Facets,
        #[covariant]
        dependent: Tree,
    }
}

self_cell! {
    /// A tree whose hits are moved to the spline.
    struct PolishedTree {
        owner: FacetTree,
        #[covariant]
        dependent: Tree,
    }
}

/// What answers.
enum Structure {
    Facets(FacetTree),
    Polished(PolishedTree),
    Spline(Arc<Exact>),
}

impl Structure {
    fn intersector(&self) -> &dyn Intersector {
        match self {
            Self::Facets(tree) => &**tree.borrow_dependent(),
            Self::Polished(tree) => &**tree.borrow_dependent(),
            Self::Spline(exact) => &**exact,
        }
    }
}

/// Finds the nearest hits of rays; made by `Octree`, `Bvh` and `Exact`.
#[pyclass(frozen, module = "lampyris")]
pub(crate) struct Tracer {
    structure: Arc<Structure>,
    footprint: Footprint,
    name: &'static str,
}

/// The ray of two rows; `None` where [`fault`] says why.
fn ray(origin: &[f64], direction: &[f64], range: [f64; 2]) -> Option<Ray> {
    let origin = vector(origin);
    let is_near = origin.abs().max_element() <= FARTHEST && !origin.is_nan();
    let direction = unit(vector(direction)).filter(|_| is_near)?;
    Some(Ray::new(origin, direction).with_range(range[0], range[1]))
}

/// Why two rows are no ray, and what to do.
fn fault(k: usize, origin: &[f64], direction: &[f64]) -> String {
    let why = if origin.iter().chain(direction).any(|x| !x.is_finite()) {
        "every number must be finite; leave such rays out"
    } else if direction.iter().all(|x| *x == 0.0) {
        "the direction has no length; leave such rays out"
    } else {
        "it starts more than 1e15 mm away, where doubles tell no points of a model apart; move its origin along the ray"
    };
    format!("ray {k} from {origin:?} along {direction:?} cannot be traced: {why}")
}

/// Asks about all rays, on the current pool, until told to stop; gives the first ray that is none, where there is one.
fn ask(
    intersector: &dyn Intersector,
    rays: [&[f64]; 2],
    range: [f64; 2],
    into: &mut HitArrays,
    stops: &AtomicBool,
) -> (Cost, Option<usize>) {
    let [origins, directions] = rays;
    let bad = AtomicUsize::new(usize::MAX);
    let rows = into.chunks(CHUNK);
    let buffers = || (Vec::with_capacity(CHUNK), vec![None; CHUNK]);
    let cost = rows
        .enumerate()
        .map_init(buffers, |(rays, hits): &mut (Vec<Ray>, Vec<Option<Hit>>), (chunk, mut rows)| {
            if stops.load(Ordering::Relaxed) {
                return Cost::default();
            }
            let first = chunk * CHUNK;
            let count = rows.t.len();
            rays.clear();
            for k in first..first + count {
                match ray(&origins[3 * k..3 * k + 3], &directions[3 * k..3 * k + 3], range) {
                    Some(ray) => rays.push(ray),
                    None => {
                        bad.fetch_min(k, Ordering::Relaxed);
                        return Cost::default();
                    }
                }
            }
            let mut cost = Cost::default();
            hits[..count].fill(None);
            intersector.intersect_batch(rays, &mut hits[..count], &mut cost);
            for (k, hit) in hits[..count].iter().enumerate() {
                rows.write(k, hit.as_ref());
            }
            cost
        })
        .reduce(Cost::default, |mut a, b| {
            a += b;
            a
        });
    let bad = bad.into_inner();
    (cost, (bad != usize::MAX).then_some(bad))
}

#[pymethods]
impl Tracer {
    /// A structure over facets: `octree`, `bvh2` or `cwbvh`; `normals="exact"` moves every hit to the spline of the model.
    #[staticmethod]
    #[pyo3(signature = (mesh, kind, normals = "bilinear", model = None))]
    fn of_mesh(py: Python<'_>, mesh: &Mesh, kind: &str, normals: &str, model: Option<&Model>) -> PyResult<Self> {
        let normals = normal_mode(normals)?;
        let name = match kind {
            "octree" => "octree",
            "bvh2" => "bvh2",
            "cwbvh" => "cwbvh",
            _ => return Err(SceneError::new_err(format!("kind {kind}: use octree, bvh2 or cwbvh"))),
        };
        let model = match (normals, model) {
            (NormalMode::Exact, None) => {
                let message = "normals exact: the spline is needed to move hits to; give model=";
                return Err(SceneError::new_err(message));
            }
            (NormalMode::Exact, Some(model)) => {
                mesh.require_model(model)?;
                Some(model.import.clone())
            }
            _ => None,
        };
        let mesh = mesh.mesh.clone();
        let build = move || {
            let exact = model.map(|import| Arc::new(Exact::build(&import.model, &exact::Settings::default())));
            let on_facets = normals.on_facets();
            let tree = FacetTree::new(Facets { mesh, exact }, |facets| -> Tree<'_> {
                let mesh = &facets.mesh;
                match name {
                    "octree" => Box::new(Octree::build(
                        mesh,
                        &octree::Settings { normals: on_facets, ..Default::default() },
                    )),
                    "bvh2" => {
                        let kind = bvh::Kind::Bvh2;
                        Box::new(Bvh::build(
                            mesh,
                            &bvh::Settings { kind, normals: on_facets, ..Default::default() },
                        ))
                    }
                    _ => Box::new(Bvh::build(mesh, &bvh::Settings { normals: on_facets, ..Default::default() })),
                }
            });
            if tree.borrow_owner().exact.is_none() {
                return Structure::Facets(tree);
            }
            Structure::Polished(PolishedTree::new(tree, |tree| -> Tree<'_> {
                let Facets { mesh, exact } = tree.borrow_owner();
                match exact {
                    Some(exact) => Box::new(Polished::new(&**tree.borrow_dependent(), mesh, exact)),
                    None => unreachable!("checked above"),
                }
            }))
        };
        let structure = interruptible(py, None, None, move |_| build())?.made;
        let footprint = structure.intersector().footprint();
        Ok(Self { structure: Arc::new(structure), footprint, name })
    }

    /// The spline of a model itself, certified.
    #[staticmethod]
    fn from_model(py: Python<'_>, model: &Model) -> PyResult<Self> {
        let import = model.import.clone();
        let build = move |_: &_| Exact::build(&import.model, &exact::Settings::default());
        let exact = interruptible(py, None, None, build)?.made;
        let footprint = exact.footprint();
        Ok(Self { structure: Arc::new(Structure::Spline(Arc::new(exact))), footprint, name: "exact" })
    }

    /// Nearest hits of rays from `origins` (n, 3) along `directions` (n, 3), between `t_min` and `t_max` mm.
    ///
    /// Arrays of float64 that lie in one piece are read where they are, and the answers are the arrays that were written: nothing is
    /// copied. Directions are brought to unit length.
    #[pyo3(signature = (origins, directions, t_min = 0.0, t_max = f64::INFINITY, threads = None))]
    fn intersect(
        &self,
        py: Python<'_>,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        t_min: f64,
        t_max: f64,
        threads: Option<usize>,
    ) -> PyResult<Hits> {
        let (origins, directions) = (columns(origins, "origins", 3)?, columns(directions, "directions", 3)?);
        let n = length(&origins);
        if n != length(&directions) {
            return Err(PyValueError::new_err(format!(
                "origins and directions must have the same number of rows, not {n} and {}; numpy.broadcast_to repeats one row",
                length(&directions)
            )));
        }
        if t_min.is_nan() || t_max.is_nan() || t_min > t_max {
            return Err(PyValueError::new_err(format!("t_min = {t_min} must be at most t_max = {t_max}")));
        }
        if threads == Some(0) {
            return Err(PyValueError::new_err("threads: at least one is needed; leave it out for all"));
        }
        let (from, along) = (rows(&origins)?, rows(&directions)?);
        let intersector = self.structure.intersector();
        let work = |stops: &AtomicBool| {
            let mut arrays = HitArrays::new(n);
            let (cost, bad) = ask(intersector, [from, along], [t_min, t_max], &mut arrays, stops);
            (arrays, cost, bad)
        };
        let (arrays, cost, bad) = if n < UNHEARD_RAYS {
            py.detach(|| on_threads(threads, || work(&AtomicBool::new(false))))
        } else {
            stoppable(py, threads, work)?
        };
        if let Some(k) = bad {
            let row = 3 * k..3 * k + 3;
            return Err(PyValueError::new_err(fault(k, &from[row.clone()], &along[row])));
        }
        arrays.into_hits(py, n, cost)
    }

    /// Seconds of the crate on the same rays, without Python: into the arrays that `intersect` gives, and into hits of its own from rays
    /// that are its own already; and the number of hits. What `intersect` is measured against.
    fn seconds_of_rust_call(
        &self,
        py: Python<'_>,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
    ) -> PyResult<(f64, f64, usize)> {
        let (origins, directions) = (columns(origins, "origins", 3)?, columns(directions, "directions", 3)?);
        let (from, along) = (rows(&origins)?, rows(&directions)?);
        let intersector = self.structure.intersector();
        let (n, range) = (length(&origins), [0.0, f64::INFINITY]);
        Ok(py.detach(|| {
            let start = Instant::now();
            let mut arrays = HitArrays::new(n);
            ask(intersector, [from, along], range, &mut arrays, &AtomicBool::new(false));
            let into_arrays = start.elapsed().as_secs_f64();
            drop(arrays);
            let pairs = from.chunks(3).zip(along.chunks(3));
            let rays: Vec<Ray> = pairs.filter_map(|(o, d)| ray(o, d, range)).collect();
            let start = Instant::now();
            let mut hits: Vec<Option<Hit>> = vec![None; rays.len()];
            rays.par_chunks(CHUNK).zip(hits.par_chunks_mut(CHUNK)).for_each(|(rays, hits)| {
                intersector.intersect_batch(rays, hits, &mut Cost::default());
            });
            (into_arrays, start.elapsed().as_secs_f64(), hits.iter().flatten().count())
        }))
    }

    /// Bytes held, without the mesh or model.
    #[getter]
    fn bytes(&self) -> usize {
        self.footprint.bytes
    }

    /// Facets or patches.
    #[getter]
    fn primitives(&self) -> usize {
        self.footprint.primitives
    }

    /// Seconds that building took.
    #[getter]
    fn build_seconds(&self) -> f64 {
        self.footprint.build_seconds
    }

    /// `octree`, `bvh2`, `cwbvh` or `exact`.
    #[getter]
    fn kind(&self) -> &'static str {
        self.name
    }

    fn __repr__(&self) -> String {
        format!("<lampyris {} over {} primitives>", self.name, self.footprint.primitives)
    }
}

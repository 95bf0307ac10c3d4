//! Where a study gets its meshes and intersectors from, and how it traces many rays on them.

use super::tolerance_plan::TolerancePlan;
use crate::intersect::{Cost, Hit, Intersector, NormalMode};
use crate::math::Ray;
use crate::mesh::FacetMesh;
use rayon::prelude::*;
use serde::Serialize;

/// A mesh and what it took.
#[derive(Clone, Debug)]
pub struct MeasuredMesh {
    /// The facets.
    pub mesh: FacetMesh,
    /// Seconds to make it.
    pub seconds: f64,
    /// Mean distance between facets and spline, sampled, mm.
    pub sag_mean: f64,
    /// Largest distance, sampled, mm.
    pub sag_max: f64,
}

/// Which structure answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum FacetTree {
    /// The octree.
    Octree,
    /// obvhs' 8-wide BVH, cured.
    CwBvh,
}

impl FacetTree {
    /// Returns its name on the command line and in rows.
    pub fn name(self) -> &'static str {
        match self {
            Self::Octree => "octree",
            Self::CwBvh => "cwbvh",
        }
    }
}

/// Makes what a study compares. The product's is [`super::ModelMeshSource`]; tests bring their own to judge the studies.
pub trait MeshSource: Sync {
    /// Makes facets within a tolerance `[min, max]`, mm.
    fn mesh(&self, tolerance: [f64; 2]) -> MeasuredMesh;
    /// Makes facets within the local tolerances of a plan; without a mesher that can do so, within the least of them everywhere.
    fn mesh_plan(&self, plan: &TolerancePlan) -> MeasuredMesh {
        self.mesh([plan.tolerance_mm()[0]; 2])
    }
    /// Builds a structure over facets whose hits carry normals of that kind (`Exact` is [`MeshSource::polish`]'s).
    fn build<'m>(&'m self, mesh: &'m FacetMesh, tree: FacetTree, normals: NormalMode) -> Box<dyn Intersector + 'm>;
    /// Builds a structure over facets with its hits moved to the spline.
    fn polish<'m>(&'m self, facets: &'m dyn Intersector, mesh: &'m FacetMesh) -> Box<dyn Intersector + 'm>;
    /// Returns the certified spline.
    fn exact(&self) -> &dyn Intersector;
}

/// Builds each tree over a mesh with each kind of normals in turn, and calls `then` with all of them; those of exact normals are polished
/// hits on bilinear ones.
pub(super) fn with_intersectors<R>(
    mesh_source: &dyn MeshSource,
    mesh: &FacetMesh,
    trees: &[FacetTree],
    normals: &[NormalMode],
    then: impl FnOnce(&[(FacetTree, NormalMode, &dyn Intersector)]) -> R,
) -> R {
    let pairs: Vec<_> = trees.iter().flat_map(|&t| normals.iter().map(move |&n| (t, n))).collect();
    let facets: Vec<_> = pairs.iter().map(|&(t, n)| mesh_source.build(mesh, t, n.on_facets())).collect();
    let polished: Vec<_> = pairs
        .iter()
        .zip(&facets)
        .map(|(&(_, n), f)| (n == NormalMode::Exact).then(|| mesh_source.polish(&**f, mesh)))
        .collect();
    let all: Vec<_> = pairs
        .iter()
        .zip(facets.iter().zip(&polished))
        .map(|(&(t, n), (f, p))| (t, n, p.as_deref().unwrap_or(&**f)))
        .collect();
    then(&all)
}

/// Rays of one task.
const CHUNK: usize = 4096;

/// Writes the answers to all rays into `hits`, of the same length, and returns the work. On the current rayon pool, or for one thread on
/// this thread; any other number of threads means the pool.
pub(super) fn answer(
    intersector: &dyn Intersector,
    rays: &[Ray],
    threads: usize,
    hits: &mut [Option<Hit>],
) -> Cost {
    if threads == 1 {
        let mut cost = Cost::default();
        // On this thread, for times of one thread must not hold what a pool costs.
        intersector.intersect_batch(rays, hits, &mut cost);
        return cost;
    }
    let one = |(rays, hits): (&[Ray], &mut [Option<Hit>])| {
        let mut cost = Cost::default();
        intersector.intersect_batch(rays, hits, &mut cost);
        cost
    };
    let sum = |mut a: Cost, b: Cost| {
        a += b;
        a
    };
    // Sums of integers: their order does not matter.
    rays.par_chunks(CHUNK).zip(hits.par_chunks_mut(CHUNK)).map(one).reduce(Cost::default, sum)
}

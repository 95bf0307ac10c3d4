//! The adaptive octree: eight boxes while more than T facets meet a box, and only the boxes on the ray's path are visited.
//!
//! Cells are split at their middle while more than [`Settings::threshold`] facets meet them; facets are clipped exactly
//! against the cells they meet. Under a leaf cell facets are packed by the surface-area heuristic into blocks of four
//! quads; cells are merged into nodes of up to sixteen children with the least area of boxes, which are eight-bit, relative to the
//! node, tight to the clipped geometry and rounded outward. Blocks hold corners in 16 bits and only *sort out*, with
//! an error bound, what a ray cannot hit; what remains is decided by the watertight f64 test of `intersect::facet`. Thirty-two rays of
//! a batch are under way at a time; the steps of one kind are done in a row, each ray prefetching while the others compute.
//!
//! Where a run says beforehand which rays it will trace ([`Intersector::prepare_for`]), those of point and collimated sources are answered
//! from a map of what the source sees, and rays that leave facets for which many do are known to be gone by the facet's horizon.
//!
//! Sources: the octree after Revelles, Ureña, Lastra, *An Efficient Parametric Algorithm for Octree Traversal*, WSCG
//! 2000 (cells), and Ylitie, Karras, Laine, HPG 2017 (compressed wide nodes).
//!
//! Guarantee: the hit is the nearest of all facets, of equal ones that on the facet of lowest index; the same bits for a
//! single ray and a batch, for any number of threads at build or query, with AVX-512, AVX2 or neither.
//! Weakness: facets with corners that are not finite or beyond 1e12 mm are left out; building takes longer than Embree's.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod batch_walk;
mod cell;
mod clip;
mod facet_lanes;
mod facet_pair;
mod flatten;
mod horizon;
mod kernels;
mod lanes;
mod light_buffer;
mod mesh_box;
mod node;
mod node_areas;
mod pack;
mod portable;
mod quad_edges;
mod ray;
mod ray_stack;
mod ray_start;
#[cfg(target_arch = "x86_64")]
mod ray_start_avx2;
mod ray_state;
mod settings;
mod statistics;
mod step_queues;
mod steps;
mod stored;
mod subdivision;
mod tree;
mod tree_check;
mod walk;

use super::facet::FacetHit;
use super::normals::DescribeBatch;
use super::{Cost, ExpectedRays, Footprint, Hit, Intersector, normals};
use crate::math::simd::Level;
use crate::math::{Aabb, Ray};
use crate::mesh::FacetMesh;
use crate::mesh::arrays::ArrayReader;
use horizon::Horizons;
use light_buffer::LightBuffer;
pub use settings::{InstructionSet, Settings};
pub use statistics::Statistics;
use std::io::{self, Write};
use std::sync::{OnceLock, PoisonError, RwLock};
use std::time::Instant;
use tree::Tree;
use walk::BATCH;

/// Rays of a batch for which room is made separately.
const SMALL_BATCH: usize = 32;

/// An octree over the facets of a mesh.
///
/// ```
/// use lampyris::intersect::octree::{Octree, Settings};
/// use lampyris::intersect::{Cost, Intersector};
/// use lampyris::math::{FaceId, Point, Ray, Uv, Vector};
/// use lampyris::mesh::{Facet, FacetMesh, MeshVertex};
///
/// let positions = vec![Point::ZERO, Point::X, Point::new(1.0, 1.0, 0.0), Point::Y];
/// let vertices =
///     (0..4).map(|position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO }).collect();
/// let facets = vec![Facet { vertices: [0, 1, 2, 3], face: FaceId(0) }];
/// let mesh = FacetMesh { positions, vertices, facets, sag: vec![] };
/// let tree = Octree::build(&mesh, &Settings::default());
/// let ray = Ray::new(Point::new(0.25, 0.5, 3.0), -Vector::Z);
/// assert_eq!(tree.intersect(&ray, &mut Cost::default()).unwrap().t, 3.0);
/// ```
pub struct Octree<'m> {
    tree: Tree<'m>,
    settings: Settings,
    /// What [`Settings::instruction_set`] allows and the processor has.
    level: Level,
    /// Of the facets that many rays leave; empty until [`Intersector::prepare_for`] finds that they pay.
    horizons: OnceLock<Horizons>,
    /// The same for rays that leave the spline over the facet.
    spline_horizons: OnceLock<Horizons>,
    /// Of the sources whose rays are expected.
    light_buffers: RwLock<Vec<LightBuffer>>,
    statistics: Statistics,
    build_seconds: f64,
}

impl<'m> Octree<'m> {
    /// Builds the tree with the threads of the current rayon pool; the tree does not depend on their number. Facets with corners that are
    /// not finite or beyond 1e12 mm are left out and counted; without facets every ray misses.
    pub fn build(mesh: &'m FacetMesh, settings: &Settings) -> Self {
        let started = Instant::now();
        let mut statistics = Statistics::default();
        let tree = Tree::build(mesh, settings, &mut statistics);
        Self::with_tree(tree, settings, statistics, started)
    }

    /// Writes the tree and its statistics, without mesh, settings or preparation, for [`Self::read_arrays`].
    ///
    /// # Errors
    /// When `to` cannot be written.
    pub(crate) fn write_arrays(&self, to: &mut dyn Write) -> io::Result<()> {
        self.tree.write_arrays(&self.statistics, to)
    }

    /// Reads a tree written by [`Self::write_arrays`]; `mesh` is the one it was built on. Of `settings` only what rays are walked with
    /// counts.
    ///
    /// # Errors
    /// When it cannot be read, or is no tree of this mesh.
    pub(crate) fn read_arrays(
        mesh: &'m FacetMesh,
        settings: &Settings,
        from: &mut ArrayReader,
    ) -> io::Result<Self> {
        let started = Instant::now();
        let (tree, statistics) = Tree::read_arrays(mesh, from)?;
        Ok(Self::with_tree(tree, settings, statistics, started))
    }

    /// Makes an octree of a tree whose building began at `started`, without preparation.
    fn with_tree(mut tree: Tree<'m>, settings: &Settings, statistics: Statistics, started: Instant) -> Self {
        tree.surroundings = tree.surroundings.with_starts_as_far_as(settings.farthest_start);
        Self {
            tree,
            settings: *settings,
            level: settings.instruction_set.level(),
            horizons: OnceLock::new(),
            spline_horizons: OnceLock::new(),
            light_buffers: RwLock::default(),
            statistics,
            build_seconds: started.elapsed().as_secs_f64(),
        }
    }

    /// Copies the tree without what it has worked out about expected rays.
    pub fn without_preparation(&self) -> Self {
        Self {
            tree: self.tree.clone(),
            settings: self.settings,
            level: self.level,
            horizons: OnceLock::new(),
            spline_horizons: OnceLock::new(),
            light_buffers: RwLock::default(),
            statistics: self.statistics.clone(),
            build_seconds: self.build_seconds,
        }
    }

    /// Finds distance (mm) and facet of the nearest hit of each ray, `None` for a miss, without normals: what other ray tracers' kernels
    /// report. Overwrites `found`, which is as long as `rays`.
    pub fn closest(&self, rays: &[Ray], found: &mut [Option<(f64, u32)>], cost: &mut Cost) {
        let mut hits = [None; BATCH];
        let light_buffers = self.light_buffers.read().unwrap_or_else(PoisonError::into_inner);
        for (rays, found) in rays.chunks(BATCH).zip(found.chunks_mut(BATCH)) {
            self.walk(&light_buffers, rays, &mut hits[..rays.len()], cost);
            for (found, hit) in found.iter_mut().zip(&hits) {
                *found = hit.map(|h| (h.t, h.facet));
            }
        }
    }

    /// Shape of the tree, for people.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Returns the boxes of all nodes and blocks, mm in the mesh's coordinates, each with its depth: 1 for the root's children. The root
    /// has none.
    pub fn boxes(&self) -> Vec<(usize, Aabb)> {
        self.tree.boxes()
    }

    /// Bytes of what was worked out about expected rays.
    fn preparation_bytes(&self) -> usize {
        let buffers = self.light_buffers.read().unwrap_or_else(PoisonError::into_inner);
        let horizons = [&self.horizons, &self.spline_horizons];
        horizons.iter().filter_map(|h| h.get()).map(Horizons::bytes).sum::<usize>()
            + buffers.iter().map(LightBuffer::bytes).sum::<usize>()
    }

    /// Finds the nearest hit of each ray, as many at a time as there is `room`, with its normals, and overwrites `hits`.
    // Not made twice: the description of a hit is inlined in it, which a tenth of all tracing hangs on.
    #[inline(never)]
    fn intersect_in(&self, room: &mut [Option<FacetHit>], rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        let light_buffers = self.light_buffers.read().unwrap_or_else(PoisonError::into_inner);
        let size = room.len();
        for (rays, hits) in rays.chunks(size).zip(hits.chunks_mut(size)) {
            let found = &mut room[..rays.len()];
            self.walk(&light_buffers, rays, found, cost);
            let (mesh, mode) = (self.tree.surroundings.mesh, self.settings.normals);
            self.level.run(DescribeBatch { mesh, rays, found, hits, mode });
        }
    }

    /// Finds the nearest hit of each ray with the instructions that were chosen, and overwrites `hits`; `light_buffers`, which may be
    /// empty, answer some of them.
    fn walk(&self, light_buffers: &[LightBuffer], rays: &[Ray], hits: &mut [Option<FacetHit>], cost: &mut Cost) {
        self.level.run(kernels::Walk { tree: &self.tree, light_buffers, rays, hits, cost });
    }
}

impl Intersector for Octree<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        let mut hit = [None];
        self.walk(&[], std::slice::from_ref(ray), &mut hit, cost);
        hit[0].map(|hit| normals::describe(self.tree.surroundings.mesh, ray, &hit, self.settings.normals))
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        // Emptying room for a whole batch takes as long as a few rays, which are often all that come to a part in its place.
        if rays.len() <= SMALL_BATCH {
            self.intersect_in(&mut [None; SMALL_BATCH], rays, hits, cost);
        } else {
            self.intersect_in(&mut [None; BATCH], rays, hits, cost);
        }
    }

    fn prepare_for(&self, expected: &ExpectedRays<'_>) {
        let own = if expected.sag > 0.0 { &self.spline_horizons } else { &self.horizons };
        if own.get().is_none()
            && let Some(horizons) = Horizons::if_worth(expected.rays, &self.tree, expected.sag)
        {
            // Whoever came first has as good ones.
            let _ = own.set(horizons);
        }
        let mut buffers = self.light_buffers.write().unwrap_or_else(PoisonError::into_inner);
        let kept = std::mem::take(&mut *buffers);
        *buffers = light_buffer::draw_expected(&self.tree, expected, kept);
    }

    #[inline]
    fn escapes(&self, ray: &Ray) -> bool {
        let (Some(horizons), Some(from)) = (self.horizons.get(), ray.departure) else { return false };
        horizons.is_free(&self.tree, from.primitive as usize, ray.direction)
    }

    #[inline]
    fn escapes_spline(&self, ray: &Ray, sag: f64) -> bool {
        let (Some(horizons), Some(from)) = (self.spline_horizons.get(), ray.departure) else { return false };
        horizons.holds_for(sag) && horizons.is_free(&self.tree, from.primitive as usize, ray.direction)
    }

    fn footprint(&self) -> Footprint {
        Footprint {
            bytes: self.tree.bytes() + self.preparation_bytes(),
            primitives: self.tree.surroundings.mesh.facets.len(),
            build_seconds: self.build_seconds,
        }
    }
}

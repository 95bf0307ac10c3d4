//! The adaptive octree: eight boxes while more than T facets meet a box, and only the boxes on the ray's path are asked.
//!
//! Cells are split at their middle while more than [`Settings::threshold`] facets meet them; facets are clipped exactly
//! against the cells they meet. Under a leaf cell facets are packed by the surface-area heuristic into blocks of four
//! quads; sparse octants are merged until a node has up to eight children, whose boxes are eight-bit, relative to the
//! node, tight to the clipped geometry and rounded outward. Blocks hold corners in 16 bits and only *sort out*, with
//! an error bound, what a ray cannot hit; what remains is decided by the watertight f64 test of the room. Thirty-two rays of
//! a batch are under way at a time; the steps of one kind are done in a row, each ray prefetching while the others compute.
//!
//! Where a run says beforehand which rays it will ask ([`Intersector::prepare_for`]), those of point and collimated sources are answered
//! from a map of what the source sees, and rays that leave facets for which many do are known to be gone by the facet's horizon.
//!
//! Sources: the octree after Revelles, Ureña, Lastra, *An Efficient Parametric Algorithm for Octree Traversal*, WSCG
//! 2000 (cells), and Ylitie, Karras, Laine, HPG 2017 (compressed wide nodes).
//!
//! Guarantee: the hit is the nearest of all facets, of equal ones that on the facet of lowest index; the same bits for a
//! single ray and a batch, for any number of threads at build or query, with AVX-512, AVX2 or neither.
//! Weakness: facets with corners that are no finite numbers are left out; building takes longer than Embree's.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod build;
mod clip;
mod engine;
mod flatten;
mod horizon;
mod huge;
mod light;
mod node;
mod pack;
mod portable;
mod state;
mod statistics;

use super::facet::{FacetHit, Surroundings};
use super::slopes::Slopes;
use super::{Cost, ExpectedRays, Footprint, Hit, Intersector, NormalMode, normals};
use crate::intersect::prefetch::prefetch;
use crate::math::{Aabb, Point, Ray};
use crate::mesh::FacetMesh;
use horizon::Horizons;
use node::{Block, Node};
use rayon::prelude::*;
pub use statistics::Statistics;
use std::sync::{OnceLock, PoisonError, RwLock};
use std::time::Instant;

/// How the tree is built and walked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// T: a box is split while more facets than this meet it. 128 was fastest on lamps; 8 without `collapse` is the
    /// textbook tree, 64 suits scenes of long thin facets.
    pub threshold: usize,
    /// Depth at which splitting ends, at most 32. Uneven scenes need 20 and more.
    pub max_depth: u32,
    /// Merge sparse octants into full eight-wide nodes.
    pub collapse: bool,
    /// A box is no longer split once its facets have been duplicated this often on the way to it, so that memory stays bounded.
    pub max_duplication: f64,
    /// Instructions to walk with; the hits are the same.
    pub path: Path,
    /// How the normal at a hit is got.
    pub normals: NormalMode,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            threshold: 128,
            max_depth: 24,
            collapse: true,
            max_duplication: 16.0,
            path: Path::Fastest,
            normals: NormalMode::default(),
        }
    }
}

impl Settings {
    /// The octree of textbooks: T = 8, every octant its own child.
    pub fn textbook() -> Self {
        Self { threshold: 8, collapse: false, ..Self::default() }
    }
}

/// Instructions to walk the tree with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Path {
    /// The widest that the processor offers, asked at run time.
    #[default]
    Fastest,
    /// AVX2 where the processor has it, else plain Rust.
    Avx2,
    /// Plain Rust.
    Portable,
}

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
    around: Surroundings<'m>,
    settings: Settings,
    /// Middle of the mesh, about which nodes and blocks are given.
    center: Point,
    frame: state::Frame,
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    root: Option<node::Link>,
    /// Of all facets.
    slopes: Vec<Slopes>,
    /// Of the facets that many rays leave, once a run pays for it.
    horizons: OnceLock<Horizons>,
    /// Of the sources whose rays are expected.
    maps: RwLock<Vec<light::Map>>,
    statistics: Statistics,
    build_seconds: f64,
}

impl<'m> Octree<'m> {
    /// Builds the tree with the threads of the current rayon pool; the tree does not depend on their number.
    pub fn build(mesh: &'m FacetMesh, settings: &Settings) -> Self {
        let started = Instant::now();
        let around = Surroundings::new(mesh);
        let finite = around.bounds;
        let center = if finite.is_empty() { Point::ZERO } else { finite.center() };
        let mut statistics = Statistics::default();
        let cell = build::grow(mesh, center, settings, &mut statistics);
        let flat = cell.map(|cell| flatten::flatten(mesh, center, cell, settings, &mut statistics));
        let (nodes, blocks, root) = match flat {
            Some(flat) => (flat.nodes, flat.blocks, Some(flat.root)),
            None => (Vec::new(), Vec::new(), None),
        };
        let bounds = if finite.is_empty() { Aabb::EMPTY } else { finite.grown(finite.diagonal() * 1e-6) };
        let frame = state::Frame::new(center, &bounds);
        let mut slopes = huge::with_capacity(mesh.facets.len());
        (0..mesh.facets.len()).into_par_iter().map(|f| Slopes::new(mesh.corners(f))).collect_into_vec(&mut slopes);
        let build_seconds = started.elapsed().as_secs_f64();
        let horizons = OnceLock::new();
        Self {
            around,
            settings: *settings,
            center,
            frame,
            nodes,
            blocks,
            root,
            slopes,
            horizons,
            maps: RwLock::default(),
            statistics,
            build_seconds,
        }
    }

    /// The same tree without what it has worked out about expected rays.
    pub fn anew(&self) -> Self {
        Self {
            around: self.around,
            settings: self.settings,
            center: self.center,
            frame: self.frame,
            nodes: self.nodes.clone(),
            blocks: self.blocks.clone(),
            root: self.root,
            slopes: self.slopes.clone(),
            horizons: OnceLock::new(),
            maps: RwLock::default(),
            statistics: self.statistics.clone(),
            build_seconds: self.build_seconds,
        }
    }

    /// Distance and facet of the nearest hit of each ray, without normals: what other ray tracers' kernels report.
    pub fn closest(&self, rays: &[Ray], found: &mut [Option<(f64, u32)>], cost: &mut Cost) {
        let mut hits = [None; BATCH];
        for (rays, found) in rays.chunks(BATCH).zip(found.chunks_mut(BATCH)) {
            self.walk(rays, &mut hits[..rays.len()], cost);
            for (found, hit) in found.iter_mut().zip(&hits) {
                *found = hit.map(|h| (h.t, h.facet));
            }
        }
    }

    /// Shape of the tree, for people.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// The boxes of all nodes and blocks with their depth, for looking at; the root's children have depth 1.
    pub fn boxes(&self) -> Vec<(usize, Aabb)> {
        let mut boxes = Vec::new();
        let mut open: Vec<(node::Link, usize)> = self.root.iter().map(|&root| (root, 1)).collect();
        while let Some((link, depth)) = open.pop() {
            let node::Target::Node(index) = link.target() else { continue };
            let node = &self.nodes[index];
            for slot in (0..8).filter(|k| node.used >> k & 1 == 1) {
                let b = node.child(slot);
                boxes.push((depth, Aabb { min: b.min + self.center, max: b.max + self.center }));
                open.push((node::Link(node.children[slot]), depth + 1));
            }
        }
        boxes
    }

    /// Asks for what the hits after the `i`-th will be described with: without, describing cost 40 % of the time at 200k
    /// facets.
    #[inline(always)]
    fn fetch_description(&self, found: &[Option<FacetHit>], i: usize) {
        let mesh = self.around.mesh;
        let facet = |ahead: usize| found.get(i + ahead).copied().flatten().map(|hit| hit.facet as usize);
        if let Some(facet) = facet(12) {
            prefetch(&mesh.facets, facet);
        }
        if let Some(facet) = facet(6) {
            for v in mesh.facets[facet].vertices {
                prefetch(&mesh.vertices, v as usize);
            }
        }
        if let Some(facet) = facet(3) {
            for p in mesh.corner_positions(facet) {
                prefetch(&mesh.positions, p as usize);
            }
        }
    }

    /// The facet that a ray leaves where it is known not to meet it.
    #[inline(always)]
    fn own_of(&self, ray: &Ray) -> u32 {
        let Some(from) = ray.from else { return u32::MAX };
        match self.slopes.get(from.primitive as usize) {
            Some(slopes) if slopes.leaves(ray.direction) => from.primitive,
            _ => u32::MAX,
        }
    }

    fn walk(&self, rays: &[Ray], hits: &mut [Option<FacetHit>], cost: &mut Cost) {
        #[cfg(target_arch = "x86_64")]
        {
            if self.settings.path == Path::Fastest && avx512::available() {
                return avx512::walk(self, rays, hits, cost);
            }
            if self.settings.path != Path::Portable && avx2::available() {
                return avx2::walk(self, rays, hits, cost);
            }
        }
        engine::walk::<portable::Portable>(self, rays, hits, cost);
    }
}

/// Rays walked before their hits are described: 16 rays that end late cost 2 % of it.
const BATCH: usize = 512;

impl Intersector for Octree<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        let mut hit = [None];
        self.walk(std::slice::from_ref(ray), &mut hit, cost);
        hit[0].map(|hit| normals::describe(self.around.mesh, ray, &hit, self.settings.normals))
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        let mut found = [None; BATCH];
        for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            let found = &mut found[..rays.len()];
            self.walk(rays, found, cost);
            for (i, hit) in hits.iter_mut().enumerate() {
                self.fetch_description(found, i);
                *hit = found[i]
                    .map(|hit| normals::describe_in_batch(self.around.mesh, &rays[i], &hit, self.settings.normals));
            }
        }
    }

    fn prepare_for(&self, expected: &ExpectedRays<'_>) {
        if self.horizons.get().is_none()
            && let Some(horizons) = Horizons::expecting(expected.rays, self)
        {
            // Whoever came first has as good ones.
            let _ = self.horizons.set(horizons);
        }
        let mut maps = self.maps.write().unwrap_or_else(PoisonError::into_inner);
        let there = std::mem::take(&mut *maps);
        *maps = light::find(self, expected, there);
    }

    #[inline]
    fn escapes(&self, ray: &Ray) -> bool {
        let (Some(horizons), Some(from)) = (self.horizons.get(), ray.from) else { return false };
        horizons.clear(self, from.primitive as usize, ray.direction)
    }

    fn footprint(&self) -> Footprint {
        Footprint {
            bytes: size_of_val(&*self.nodes) + size_of_val(&*self.blocks) + size_of_val(&*self.slopes),
            primitives: self.around.mesh.facets.len(),
            build_seconds: self.build_seconds,
        }
    }
}

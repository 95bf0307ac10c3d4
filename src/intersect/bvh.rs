//! Bounding-volume hierarchies of the crate obvhs behind the trait: the baseline the octree is measured against.
//!
//! [`Kind::Bvh2`] and [`Kind::CwBvh`] (Ylitie, Karras, Laine, *Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs*, HPG 2017), built on the triangles of the facets. As shipped they work in f32: a hit is wrong by
//! about 1e-5 mm, one ray in eight aimed at an edge slips through, and some rays miss everything. `cured` mends what
//! can be mended from outside, so that answers are those of the octree:
//! 1. hits come from the f64 test of `intersect::facet`, the nearest one is kept in f64;
//! 2. boxes are taken about the middle of the mesh and padded by more than their rounding and that of node tests;
//! 3. +0.0 is added to directions, for CwBvh orders children wrongly for −0.0;
//! 4. inverse directions near zero are ±1e30 instead of ±1/f32::EPSILON;
//! 5. a tree too deep for the fixed stack of CwBvh is walked as the binary tree;
//! 6. rays start where they enter the mesh, so that f32 origins are good from any distance, and a little earlier,
//!    for the node test of CwBvh discards what ends before t = 1e-4;
//! 7. the mesh is scaled by a power of two to a size of about a hundred, because such absolute limits let rays pass through a mesh
//!    of 1e-4 mm.
//!
//! Boxes that are many times the same are one primitive (`bvh_tree`), cured or not: obvhs would not end over ten thousands of them.
//!
//! Guarantee when cured: bit for bit the hits of the octree. Weakness: slower by what f64 leaves cost.

use super::bvh_tree::{Bounded, EqualBoxes, MemberRanges, Tree, wide_or_binary};
use super::facet::{FacetHit, FacetRay, Nearest, Surroundings};
use super::facet_triangles::TriangleCode;
use super::{Cost, Footprint, Hit, Intersector, NormalMode, normals};
use crate::math::{Aabb, Point, Ray, Vector};
use crate::mesh::FacetMesh;
use glam::{UVec2, Vec3A};
use obvhs::aabb::Aabb as Box32;
use obvhs::bvh2::builder::{build_bvh2, build_bvh2_from_tris};
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray as Ray32, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use obvhs::{BvhBuildParams, traverse};
use std::time::{Duration, Instant};

/// Size of a cured tree in its own units: that of the lamps on which the absolute limits of obvhs were seen to be harmless.
const TREE_SIZE: f64 = 100.0;
/// By how much boxes are grown, in sizes of the mesh: sixteen roundings of f32 at the size of the mesh.
const BOX_ROOM: f64 = 1.0 / (1 << 20) as f64;
/// By how much a cured ray starts earlier, in units of the tree: twenty times the 1e-4 before which CwBvh discards boxes, and four
/// times the room around boxes.
const EARLIER: f64 = 2e-3 + 2.0 * TREE_SIZE * 4.0 * BOX_ROOM;
/// By how much limits in f32 are widened: sixteen roundings, so that ties are seen.
const LIMIT_ROOM: f64 = 1e-6;
/// Inverse of a direction's component that is next to zero: its product with any size is a number in f32, and with the least distance
/// from a padded box larger than any size.
const LARGEST_INVERSE: f32 = 1e30;

/// Which hierarchy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Binary, 48 bytes a node.
    Bvh2,
    /// Eight children in 80 bytes.
    #[default]
    CwBvh,
}

/// Quality of the build, against its time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Quality {
    /// `BvhBuildParams::medium_build`.
    #[default]
    Medium,
    /// `BvhBuildParams::very_slow_build`: large triangles split first, more reinsertion.
    VerySlow,
}

/// Settings of a [`Bvh`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Binary or eight-wide.
    pub kind: Kind,
    /// Build effort.
    pub quality: Quality,
    /// Whether the defects named in the module's notes are mended; otherwise the crate is used as shipped, in f32.
    pub cured: bool,
    /// How the normal at a hit is computed.
    pub normals: NormalMode,
    /// Largest coordinate that starts were rounded at, mm, where that is not the mesh's own: of a part in its own coordinates that
    /// stands far away. 0 otherwise.
    pub farthest_start: f64,
}

impl Default for Settings {
    fn default() -> Self {
        let (kind, quality, normals) = (Kind::CwBvh, Quality::Medium, NormalMode::default());
        Self { kind, quality, cured: true, normals, farthest_start: 0.0 }
    }
}

/// A hierarchy over the facets of a mesh.
///
/// ```
/// use lampyris::intersect::bvh::{Bvh, Settings};
/// use lampyris::intersect::{Cost, Intersector};
/// use lampyris::math::{FaceId, Point, Ray, Uv, Vector};
/// use lampyris::mesh::{Facet, FacetMesh, MeshVertex};
///
/// let positions = vec![Point::ZERO, Point::X, Point::new(1.0, 1.0, 0.0), Point::Y];
/// let vertices = (0..4).map(|position| MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO }).collect();
/// let facets = vec![Facet { vertices: [0, 1, 2, 3], face: FaceId(0) }];
/// let mesh = FacetMesh { positions, vertices, facets, sag: vec![] };
/// let bvh = Bvh::build(&mesh, &Settings { cured: true, ..Settings::default() });
/// let ray = Ray::new(Point::new(0.25, 0.5, 3.0), -Vector::Z);
/// assert_eq!(bvh.intersect(&ray, &mut Cost::default()).unwrap().t, 3.0);
/// ```
pub struct Bvh<'m> {
    surroundings: Surroundings<'m>,
    normals: NormalMode,
    tree: Tree,
    leaves: Leaves,
    /// The triangles of all leaf primitives.
    codes: Vec<TriangleCode>,
    /// Which of them are those of a leaf primitive.
    members: MemberRanges,
    /// Middle of the mesh, mm, about which a cured tree is built.
    center: Point,
    /// Around the mesh, grown by the room around boxes, mm.
    bounds: Aabb,
    /// Units of the tree in a millimetre: a power of two, so that scaling does not round; 1 as shipped.
    scale: f64,
    build_seconds: f64,
}

/// The primitives of the leaves, in the tree's order.
enum Leaves {
    Shipped(Vec<RtTriangle>),
    Cured(Vec<[Point; 4]>),
}

impl<'m> Bvh<'m> {
    /// Builds the hierarchy; facets with corners that are not finite or beyond 1e12 mm are left out.
    pub fn build(mesh: &'m FacetMesh, settings: &Settings) -> Self {
        let started = Instant::now();
        let surroundings = Surroundings::new(mesh).with_starts_as_far_as(settings.farthest_start);
        let bounds = surroundings.bounds;
        let center = if bounds.is_empty() { Point::ZERO } else { bounds.center() };
        let size = if bounds.is_empty() { 0.0 } else { bounds.size().max_element() };
        let scale = if settings.cured { unit_scale(size) } else { 1.0 };
        let codes = TriangleCode::enumerate(mesh);
        let params = match settings.quality {
            Quality::Medium => BvhBuildParams::medium_build(),
            Quality::VerySlow => BvhBuildParams::very_slow_build(),
        };
        let boxes: Vec<Bounded> = if settings.cured {
            let pad = size * BOX_ROOM;
            codes.iter().map(|&c| padded_box(mesh, c, center, pad, scale)).collect()
        } else {
            codes.iter().map(|&c| Bounded(triangle32(mesh, c).aabb())).collect()
        };
        let equal = EqualBoxes::find(&boxes);
        let tree = match &equal {
            None => build_tree(mesh, settings, params, &codes, &boxes),
            // The parts of a triangle that is split hold no other one.
            Some(equal) => {
                let params = BvhBuildParams { pre_split: false, ..params };
                build_tree(mesh, settings, params, &equal.first_of_each(&codes), &equal.first_of_each(&boxes))
            }
        };
        // Leaves name places in the tree's own order of triangles.
        let (codes, members): (Vec<TriangleCode>, MemberRanges) = match &equal {
            None => (tree.order().iter().map(|&i| codes[i as usize]).collect(), MemberRanges::default()),
            Some(equal) => {
                let (places, members) = equal.in_order(tree.order());
                (places.into_iter().map(|i| codes[i as usize]).collect(), members)
            }
        };
        let leaves = if settings.cured {
            Leaves::Cured(codes.iter().map(|&c| mesh.corners(c.facet() as usize)).collect())
        } else {
            Leaves::Shipped(codes.iter().map(|&c| RtTriangle::from(&triangle32(mesh, c))).collect())
        };
        let bounds = bounds.grown(size * BOX_ROOM);
        let build_seconds = started.elapsed().as_secs_f64();
        let normals = settings.normals;
        Self { surroundings, normals, tree, leaves, codes, members, center, bounds, scale, build_seconds }
    }

    /// Finds the nearest hit, without its normal, and counts the ray; `None` for a miss.
    fn nearest(&self, ray: &Ray, cost: &mut Cost) -> Option<FacetHit> {
        cost.rays += 1;
        match &self.leaves {
            Leaves::Shipped(triangles) => self.nearest_shipped(triangles, ray, cost),
            Leaves::Cured(corners) => self.nearest_cured(corners, ray, cost),
        }
    }

    /// Finds the nearest hit as obvhs does, in single precision and with its own test of triangles. The whole facet that the ray leaves is
    /// passed over. `None` for a miss, and where the ray is not finite in f32.
    fn nearest_shipped(&self, triangles: &[RtTriangle], ray: &Ray, cost: &mut Cost) -> Option<FacetHit> {
        let own = ray.departure.map(|d| d.primitive);
        // Beyond what `f32` holds a range is as good as endless.
        let t_max = if ray.t_max < f64::from(f32::MAX) { ray.t_max as f32 } else { f32::INFINITY };
        let (origin, direction) = (ray.origin.as_vec3a(), ray.direction.as_vec3a());
        if !(origin.is_finite() && direction.is_finite()) {
            return None;
        }
        let ray32 = Ray32::new(origin, direction, ray.t_min as f32, t_max);
        // As shipped there are no departures; the facet that is left is passed over, or each such ray would hit its own start.
        let distance = |ray: &Ray32, id: usize| {
            if own == Some(self.codes[id].facet()) { f32::INFINITY } else { triangles[id].intersect(ray) }
        };
        let (found, t) = self.walk(ray32, cost, |ray, primitive| {
            self.members.of(primitive).map(|id| distance(ray, id)).fold(f32::INFINITY, f32::min)
        });
        // Of the primitive's members, mostly one, that which was hit.
        let found = self.members.of(found?).min_by(|&a, &b| distance(&ray32, a).total_cmp(&distance(&ray32, b)))?;
        // Their weights are those of the second and third corner for edges v0 − v1 and v2 − v0.
        let weights = triangles[found].compute_barycentric(&ray32);
        Some(self.codes[found].hit(f64::from(t), [weights.x, weights.y].map(f64::from)))
    }

    /// Finds the nearest hit with the tree of obvhs and the facet test of the octree; `None` for a miss, and where the ray is not finite.
    fn nearest_cured(&self, corners: &[[Point; 4]], ray: &Ray, cost: &mut Cost) -> Option<FacetHit> {
        // Lifted as for the octree: grazing rays would otherwise be classified differently.
        let ray = &self.surroundings.lifted(ray);
        let facet_ray = FacetRay::new(ray);
        let mut best = Nearest::up_to(ray.t_max);
        let (enter, leave) = self.bounds.clip(ray)?;
        // In units of the tree from here on; `begin` is the distance along the ray at which it starts there.
        let begin = enter - EARLIER / self.scale;
        let origin = ((ray.origin - self.center + ray.direction * begin) * self.scale).as_vec3a();
        // Adding zero turns −0.0 into 0.0: cure 3.
        let direction = ray.direction.as_vec3a() + Vec3A::ZERO;
        if !(origin.is_finite() && direction.is_finite()) {
            return None;
        }
        // In the tree's units and a little farther, so that single precision does not end before the hit.
        let far = |t: f64| {
            let t = ((t - begin) * self.scale * (1.0 + LIMIT_ROOM)) as f32;
            if t.is_finite() { t } else { f32::MAX }
        };
        let mut ray32 = Ray32::new(origin, direction, 0.0, far(leave) + EARLIER as f32);
        // Cure 4, for directions along an axis.
        ray32.inv_direction = Vec3A::from_array(
            direction
                .to_array()
                .map(|d| if d.abs() < 1.0 / LARGEST_INVERSE { LARGEST_INVERSE.copysign(d) } else { 1.0 / d }),
        );
        self.walk(ray32, cost, |_, primitive| {
            let before = best.t;
            for id in self.members.of(primitive) {
                facet_ray.test(
                    self.codes[id].facet(),
                    1 << u32::from(self.codes[id].is_second()),
                    corners[id].each_ref(),
                    &self.surroundings,
                    &mut best,
                );
            }
            // Only a nearer hit may shorten the ray; infinity leaves it as it is.
            if best.t < before { far(best.t) } else { f32::INFINITY }
        });
        best.hit()
    }

    /// Walks the tree with a ray in its units. `leaf` gives the f32 distance at which a leaf primitive is hit, infinity where it is not.
    /// Returns the primitive of the nearest hit and its distance. Counts tests, and nodes of the wide tree alone: obvhs shows no others.
    fn walk(
        &self,
        ray: Ray32,
        cost: &mut Cost,
        mut leaf: impl FnMut(&Ray32, usize) -> f32,
    ) -> (Option<usize>, f32) {
        match &self.tree {
            Tree::Empty => (None, f32::INFINITY),
            Tree::Binary(tree) => {
                let mut hit = RayHit::none();
                tree.ray_traverse(ray, &mut hit, |ray, id| {
                    cost.tests += self.members.of(id).len() as u64;
                    leaf(ray, id)
                });
                ((hit.primitive_id != u32::MAX).then_some(hit.primitive_id as usize), hit.t)
            }
            Tree::Wide(tree) => {
                // As the library's `ray_traverse`, but with nodes counted.
                let mut ray = ray;
                let mut found = None;
                let mut state = tree.new_traversal(ray.direction);
                let mut node;
                traverse!(
                    tree,
                    node,
                    state,
                    {
                        cost.nodes += 1;
                        node.intersect_ray(&ray, state.oct_inv4)
                    },
                    {
                        cost.tests += self.members.of(state.primitive_id as usize).len() as u64;
                        let t = leaf(&ray, state.primitive_id as usize);
                        if t < ray.tmax {
                            found = Some(state.primitive_id as usize);
                            ray.tmax = t;
                        }
                    }
                );
                (found, ray.tmax)
            }
        }
    }
}

impl Intersector for Bvh<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        self.nearest(ray, cost).map(|hit| normals::describe(self.surroundings.mesh, ray, &hit, self.normals))
    }

    fn footprint(&self) -> Footprint {
        let leaves = match &self.leaves {
            Leaves::Shipped(l) => size_of_val(&**l),
            Leaves::Cured(l) => size_of_val(&**l),
        };
        let bytes = self.tree.bytes() + leaves + size_of_val(&*self.codes) + self.members.bytes();
        Footprint { bytes, primitives: self.surroundings.mesh.facets.len(), build_seconds: self.build_seconds }
    }
}

/// Builds the tree over triangles with their boxes; it names them by their places in these lists.
fn build_tree(
    mesh: &FacetMesh,
    settings: &Settings,
    params: BvhBuildParams,
    codes: &[TriangleCode],
    boxes: &[Bounded],
) -> Tree {
    let mut core = Duration::ZERO;
    if codes.is_empty() {
        return Tree::Empty;
    }
    if settings.cured {
        return match settings.kind {
            Kind::Bvh2 => Tree::Binary(build_bvh2(boxes, params, &mut core)),
            Kind::CwBvh => wide_or_binary(boxes, &params),
        };
    }
    let triangles: Vec<Triangle> = codes.iter().map(|&c| triangle32(mesh, c)).collect();
    match settings.kind {
        Kind::Bvh2 => Tree::Binary(build_bvh2_from_tris(&triangles, params, &mut core)),
        Kind::CwBvh => Tree::Wide(build_cwbvh_from_tris(&triangles, params, &mut core)),
    }
}

/// The triangle in f32, in the mesh's own coordinates.
fn triangle32(mesh: &FacetMesh, code: TriangleCode) -> Triangle {
    let [v0, v1, v2] = code.corners(mesh).map(|p| p.as_vec3a());
    Triangle { v0, v1, v2 }
}

/// The box of a triangle relative to `center`, mm, grown by `pad` mm and times `scale`; rounded to the nearest f32, which `pad` must
/// exceed.
fn padded_box(mesh: &FacetMesh, code: TriangleCode, center: Point, pad: f64, scale: f64) -> Bounded {
    let corners = code.corners(mesh).map(|p| p - center);
    let low = corners.into_iter().fold(Vector::INFINITY, Vector::min) - pad;
    let high = corners.into_iter().fold(Vector::NEG_INFINITY, Vector::max) + pad;
    Bounded(Box32 { min: (low * scale).as_vec3a(), max: (high * scale).as_vec3a() })
}

/// The power of two that makes a mesh of this size about [`TREE_SIZE`] large; 1 for one without extent.
fn unit_scale(size: f64) -> f64 {
    if size > 0.0 && size.is_finite() { (TREE_SIZE / size).log2().round().exp2() } else { 1.0 }
}

//! The nearest intersection of a ray with a scene: on facets (octree, BVH) or on the exact spline.
//!
//! All intersectors answer through [`Intersector`]; all of them count what they do to find hits in a [`Cost`].

pub mod bvh;
mod bvh_tree;
#[cfg(feature = "contenders")]
pub mod contenders;
mod corner_normals;
#[cfg(target_arch = "x86_64")]
mod corner_normals_avx2;
mod cubic_patch;
pub mod exact;
mod facet;
mod facet_hit;
mod facet_triangles;
pub mod instanced;
mod line;
mod normals;
pub mod octree;
pub mod polish;
mod prefetch;
mod slopes;
pub mod spline_with_meshes;
mod start_triangle;

use crate::math::{Departure, FaceId, Point, QuadHalf, Ray, Uv, Vector};
pub(crate) use prefetch::prefetch;

/// Finds the nearest hit of a ray.
pub trait Intersector: Sync {
    /// Returns the nearest hit with `t` in `[ray.t_min, ray.t_max]`, `None` for a miss, and adds the work to `cost`.
    ///
    /// Rays and hits are in the coordinates of the model or mesh that it was built on, mm.
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit>;

    /// Answers many rays: overwrites every entry of `hits`, which is as long as `rays`, and adds the work to `cost`. An implementation may
    /// reorder them inside.
    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.intersect(ray, cost);
        }
    }

    /// Announces rays that are to come, so that what helps them all can be prepared. No answer depends on it.
    fn prepare_for(&self, _expected: &ExpectedRays<'_>) {}

    /// Whether a ray that leaves a surface (its [`Ray::departure`] is set, its direction of unit length) is known to meet nothing at any
    /// distance, without a search. `false` means that it is not known, and may become `true` later: an intersector may note the ray and
    /// prepare what helps those after it. Adds nothing to a [`Cost`].
    fn escapes(&self, _ray: &Ray) -> bool {
        false
    }

    /// As [`Self::escapes`], for a ray that starts on the spline: its start, and the surfaces that it might meet, lie up to `sag` mm off
    /// their facets. Known only where that sag was announced ([`ExpectedRays::sag`]).
    fn escapes_spline(&self, _ray: &Ray, _sag: f64) -> bool {
        false
    }

    /// Returns what the structure holds and what it took to build.
    fn footprint(&self) -> Footprint;
}

/// A borrowed intersector passes every call on.
impl<T: Intersector + ?Sized> Intersector for &T {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        (**self).intersect(ray, cost)
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        (**self).intersect_batch(rays, hits, cost);
    }

    fn prepare_for(&self, expected: &ExpectedRays<'_>) {
        (**self).prepare_for(expected);
    }

    fn escapes(&self, ray: &Ray) -> bool {
        (**self).escapes(ray)
    }

    fn escapes_spline(&self, ray: &Ray, sag: f64) -> bool {
        (**self).escapes_spline(ray, sag)
    }

    fn footprint(&self) -> Footprint {
        (**self).footprint()
    }
}

/// Rays that are going to be traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedRays<'a> {
    /// How many, without those that start on a face.
    pub rays: u64,
    /// On how many threads.
    pub threads: usize,
    /// Groups of them that share a starting point or a direction, each with its number of rays.
    pub beams: &'a [(Beam, u64)],
    /// How far off its facet a ray may start, mm: 0 unless hits are moved to the spline.
    pub sag: f64,
}

/// The common geometry of a source's rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Beam {
    /// They start at one point, mm.
    Point(Point),
    /// They start in one plane, in the direction across it.
    Collimated {
        /// A point of the plane; starts may stray from it by rounding.
        origin: Point,
        /// Unit vector along which the rays run, and the normal of the plane.
        direction: Vector,
    },
}

/// The nearest intersection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, mm.
    pub t: f64,
    /// Unit normal to shade with, outward: how it was got is the intersector's [`NormalMode`].
    pub normal: Vector,
    /// Unit normal of the geometry that was hit, outward: of the flat facet, or of the spline.
    pub geometric_normal: Vector,
    /// The placed face.
    pub face: FaceId,
    /// The intersector's primitive: a facet of the mesh, or a patch of the spline model.
    pub primitive: u32,
    /// The triangle of the facet; `None` on the spline.
    pub triangle: Option<QuadHalf>,
    /// Parameters on the face's surface.
    pub uv: Uv,
    /// Its certainty.
    pub certainty: Certainty,
}

impl Hit {
    /// Returns the departure of a ray that leaves from this hit.
    #[inline(always)]
    pub fn departure(&self) -> Departure {
        Departure { face: self.face, primitive: self.primitive, uv: self.uv, triangle: self.triangle }
    }
}

/// Certainty of a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Certainty {
    /// Hit on a facet: exact for the facets, within their sag for the spline.
    Facet,
    /// Moved from a facet to the spline by Newton steps; not proved to be the first hit.
    Polished,
    /// Proved to be the first hit on the spline.
    Certified,
    /// The ray touches the spline within 1e-9 mm; whether it hits is a matter of rounding.
    Tangent,
    /// Found on the spline, but not proved to be the first.
    Uncertified,
}

/// Work done, summed over rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Rays traced.
    pub rays: u64,
    /// Nodes of the structure visited.
    pub nodes: u64,
    /// Facets or patches tested.
    pub tests: u64,
    /// Rays whose answer could not be certified or polished, and fell back.
    pub fallbacks: u64,
    /// Rays that were put to the spline itself, as moving their facet hits to it was in doubt.
    pub doubtful: u64,
}

impl std::ops::AddAssign for Cost {
    fn add_assign(&mut self, o: Self) {
        self.rays += o.rays;
        self.nodes += o.nodes;
        self.tests += o.tests;
        self.fallbacks += o.fallbacks;
        self.doubtful += o.doubtful;
    }
}

/// Size of a structure and the time it took to build.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Bytes held, without the mesh or model itself.
    pub bytes: usize,
    /// Facets or patches.
    pub primitives: usize,
    /// Seconds.
    pub build_seconds: f64,
}

impl std::ops::Add for Footprint {
    type Output = Self;

    /// Returns the footprint of two structures that answer together.
    fn add(self, other: Self) -> Self {
        Self {
            bytes: self.bytes + other.bytes,
            primitives: self.primitives + other.primitives,
            build_seconds: self.build_seconds + other.build_seconds,
        }
    }
}

/// How the normal at a facet hit is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum NormalMode {
    /// Of the flat triangle.
    Flat,
    /// Of the nearest corner.
    Nearest,
    /// Bilinear in the facet's own parameters.
    #[default]
    Bilinear,
    /// From a cubic patch through corners and normals.
    Cubic,
    /// From the spline, by polishing the hit.
    Exact,
}

impl std::fmt::Display for NormalMode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl NormalMode {
    /// Every mode, the coarsest first.
    pub const ALL: [Self; 5] = [Self::Flat, Self::Nearest, Self::Bilinear, Self::Cubic, Self::Exact];

    /// Returns the mode to query facets with: `Bilinear` for `Exact`, as polishing replaces the facet's normal; any other mode itself.
    pub fn on_facets(self) -> Self {
        if self == Self::Exact { Self::Bilinear } else { self }
    }

    /// Returns the name used in files and on the command line, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Nearest => "nearest",
            Self::Bilinear => "bilinear",
            Self::Cubic => "cubic",
            Self::Exact => "exact",
        }
    }
}

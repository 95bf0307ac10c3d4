//! Which rays that leave a facet meet nothing: those within its free cone, or above its horizon.
//!
//! Light leaves a lens, a cover or an open reflector by such rays, one in three to one in five of all, and to find out by walking
//! that nothing is there costs as much as a hit. The rays of a facet mostly leave it within a narrow cone: from the first few of
//! them an axis is taken and how wide the cone around it is that nothing stands in ([`cone`]), which one product of two directions
//! then decides for a ray. Where many rays leave beside their cone, how high anything stands to all sides is found ([`skyline`]).
//!
//! Rays that leave the spline start up to a sag off their facet: for these cones with room for it are found apart ([`cone`], [`sheet`]).
//!
//! Guarantee: conservative; heights up to the reach of a start, a picometre for a lamp, count as nothing.

mod cone;
mod lines;
mod sheet;
mod skyline;

use super::tree::Tree;
use crate::math::{Vector, orthonormal_pair};
use skyline::{Horizon, sector};
use std::f64::consts::FRAC_PI_2;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicI32, AtomicU32, Ordering};

/// Rays of a run for each facet below which no facet is watched.
const LEAST_RAYS_PER_FACET: u64 = 64;
/// Rays that leave a facet before its free cone is found: to find one takes some 3 µs, and it saves a ray that leaves 0.1 µs.
const RAYS_BEFORE_CONE: u32 = 8;
/// Rays that leave a facet beside its cone before its horizon is found: to find one takes some 20 µs.
const RAYS_BESIDE_CONE: u32 = 200;
/// The same where the rays of the run suffice for all facets.
const FEWER_BESIDE_CONE: u32 = 32;
/// A horizon is not found more closely than this share of the least slope of the rays so far, and only in the sectors where they
/// ran: what stands lower or elsewhere is not looked at.
const FLOOR_SHARE: f64 = 0.2;
/// Half the angle of a free cone is not made wider than this multiple of that of the first rays and [`CONE_ROOM`] more.
const CONE_GROWTH: f64 = 2.0;
/// See [`CONE_GROWTH`], radians.
const CONE_ROOM: f64 = 0.5;
/// What is added to the cosine of a free cone for the rounding to f32 of axis, direction and product: sixteen roundings.
const COSINE_ROOM: f32 = 1e-6;
/// Directions are gathered in such steps.
const DIRECTION_STEP: f64 = 1.0 / (1 << 20) as f64;

/// The free cones and horizons of the facets that many rays have left.
pub(super) struct Horizons {
    /// By facet.
    cones: Vec<Cone>,
    facets: Vec<RayRecord>,
    /// Rays beside its cone after which a facet's horizon is found.
    rays_before_search: u32,
    /// How far off their facets starts and what stands there may lie, mm: 0 where rays leave the facets themselves.
    sag: f64,
}

/// A cone within which rays that leave a facet meet nothing, shared by threads.
struct Cone {
    /// At first the normal of the facet, and the cosine one that no ray has. Floats as their bits.
    axis: [AtomicU32; 3],
    cosine: AtomicU32,
}

impl Cone {
    /// A cone that holds no ray yet, about the normal of its facet.
    fn unknown(axis: Vector) -> Self {
        Self { axis: axis.to_array().map(|x| AtomicU32::new((x as f32).to_bits())), cosine: 2f32.to_bits().into() }
    }

    /// Sets the unit axis and the cosine of half the angle, by which other threads then go.
    fn publish(&self, axis: Vector, cosine: f64) {
        for (own, x) in self.axis.iter().zip(axis.to_array()) {
            own.store((x as f32).to_bits(), Ordering::Relaxed);
        }
        // Released after the axis: whoever reads the new cosine reads the new axis too.
        self.cosine.store((cosine as f32 + COSINE_ROOM).to_bits(), Ordering::Release);
    }

    /// The cosine of the angle of a ray of this unit direction to the axis, and that of the cone, which no ray passes before there is one.
    #[inline(always)]
    fn cosines(&self, direction: Vector) -> (f32, f32) {
        let cosine = f32::from_bits(self.cosine.load(Ordering::Acquire));
        // An old axis beside an old cosine, which no ray has, is no harm.
        let [x, y, z] = [0, 1, 2].map(|k| f32::from_bits(self.axis[k].load(Ordering::Relaxed)));
        let d = direction.as_vec3();
        (x * d.x + y * d.y + z * d.z, cosine)
    }
}

/// What is gathered of the rays that leave a facet.
struct RayRecord {
    /// How many did while it had no cone, and between which bounds their directions lie.
    left: AtomicU32,
    low: [AtomicI32; 3],
    high: [AtomicI32; 3],
    /// How many left beside the cone.
    beside: AtomicU32,
    /// The least slope of these rays, as bits of an f32, and the sectors that they lie in, one bit each.
    least: AtomicU32,
    sectors: AtomicU32,
    horizon: OnceLock<Box<Horizon>>,
}

impl RayRecord {
    /// A record of a facet that no ray has left.
    fn new() -> Self {
        Self {
            left: AtomicU32::new(0),
            low: [const { AtomicI32::new(i32::MAX) }; 3],
            high: [const { AtomicI32::new(i32::MIN) }; 3],
            beside: AtomicU32::new(0),
            least: AtomicU32::new(f32::INFINITY.to_bits()),
            sectors: AtomicU32::new(0),
            horizon: OnceLock::new(),
        }
    }

    /// Notes a ray of this unit direction that left the facet beside its cone; after enough of them one thread finds the cone or the
    /// horizon, the others walk on. A ray that goes into the body is not noted.
    #[cold]
    fn note(&self, tree: &Tree, facet: usize, direction: Vector, horizons: &Horizons) {
        let [a, b, c, _] = tree.surroundings.mesh.corners(facet);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let up = normal.dot(direction);
        let slope = up / (direction - normal * up).length();
        // What goes into the body is not free; NaN neither.
        if slope.is_nan() || slope <= 0.0 {
            return;
        }
        // The first few rays lay the cone, and those beside it the horizon.
        if self.left.load(Ordering::Relaxed) <= RAYS_BEFORE_CONE {
            return self.gather(tree, facet, normal, direction, horizons);
        }
        let (x, y) = orthonormal_pair(normal);
        // The bits of positive numbers are in their order.
        self.least.fetch_min((slope as f32).to_bits(), Ordering::Relaxed);
        self.sectors.fetch_or(1 << sector(x.dot(direction) as f32, y.dot(direction) as f32), Ordering::Relaxed);
        // Equal, not above: of all threads one alone counts to this number, and that one searches.
        if self.beside.fetch_add(1, Ordering::Relaxed) == horizons.rays_before_search {
            let least = f64::from(f32::from_bits(self.least.load(Ordering::Relaxed)));
            let sectors = self.sectors.load(Ordering::Relaxed);
            let floor =
                std::array::from_fn(|s| if sectors >> s & 1 == 1 { least * FLOOR_SHARE } else { f64::INFINITY });
            let _ = self.horizon.set(Box::new(skyline::of_facet(tree, facet, &floor)));
        }
    }

    /// Widens the bounds of the directions that the cone is laid around by a ray's, a unit vector, and lays the cone once there are
    /// [`RAYS_BEFORE_CONE`] and one more.
    fn gather(&self, tree: &Tree, facet: usize, normal: Vector, direction: Vector, horizons: &Horizons) {
        let cone = &horizons.cones[facet];
        let direction = direction.to_array();
        for axis in 0..3 {
            let place = (direction[axis] / DIRECTION_STEP) as i32;
            self.low[axis].fetch_min(place, Ordering::Relaxed);
            self.high[axis].fetch_max(place, Ordering::Relaxed);
        }
        // Here too one thread alone counts to the number, and lays the cone.
        if self.left.fetch_add(1, Ordering::Relaxed) != RAYS_BEFORE_CONE {
            return;
        }
        let corner = |of: &[AtomicI32; 3]| {
            Vector::from_array([0, 1, 2].map(|k| f64::from(of[k].load(Ordering::Relaxed)) * DIRECTION_STEP))
        };
        let (low, high) = (corner(&self.low), corner(&self.high));
        let widest = CONE_GROWTH * 0.5 * (high - low).length() + CONE_ROOM;
        // Where rays leave to all sides none is farther than that from the normal.
        let axis = if widest < FRAC_PI_2 { low + high } else { normal };
        if let Some(axis) = axis.try_normalize() {
            let widest = widest.min(FRAC_PI_2);
            match cone::cosine_of_free_cone(tree, facet, axis, widest, horizons.sag) {
                Some(cosine) => cone.publish(axis, cosine),
                // Something stands right ahead: what leaves is met. An axis of zero ends the watch of this facet.
                None => cone.axis.iter().for_each(|x| x.store(0, Ordering::Relaxed)),
            }
        }
    }
}

impl Horizons {
    /// Bytes of cones, records and the horizons that were found so far.
    pub(super) fn bytes(&self) -> usize {
        let found = self.facets.iter().filter(|record| record.horizon.get().is_some()).count();
        size_of_val(&*self.cones) + size_of_val(&*self.facets) + found * size_of::<Horizon>()
    }

    /// Starts without cones and horizons, for a run of `rays` rays; `None` when they are too few for the facets of the tree.
    pub(super) fn if_worth(rays: u64, tree: &Tree, sag: f64) -> Option<Self> {
        let mesh = tree.surroundings.mesh;
        let each = rays / mesh.facets.len().max(1) as u64;
        let rays_before_search =
            if each >= 2 * u64::from(RAYS_BESIDE_CONE) { FEWER_BESIDE_CONE } else { RAYS_BESIDE_CONE };
        let cone = |f: usize| {
            let [a, b, c, _] = mesh.corners(f);
            Cone::unknown((b - a).cross(c - a).normalize_or_zero())
        };
        (each >= LEAST_RAYS_PER_FACET).then(|| Self {
            cones: (0..mesh.facets.len()).map(cone).collect(),
            facets: mesh.facets.iter().map(|_| RayRecord::new()).collect(),
            rays_before_search,
            sag,
        })
    }

    /// Whether they were found with at least so much room, mm.
    #[inline(always)]
    pub(super) fn holds_for(&self, sag: f64) -> bool {
        sag <= self.sag
    }

    /// Whether a ray of this unit direction that leaves this facet is known to meet nothing; `false` says nothing. A ray that is not may be
    /// noted, and now and then a cone or horizon worked out.
    #[inline(always)]
    pub(super) fn is_free(&self, tree: &Tree, facet: usize, direction: Vector) -> bool {
        let Some(cone) = self.cones.get(facet) else { return false };
        let (along, cosine) = cone.cosines(direction);
        // Far from the axis it goes into the body.
        along > cosine || (along > 0.0 && self.is_above_horizon(tree, facet, direction))
    }

    /// As [`Self::is_free`] of a ray beside the cone of the facet, by its horizon; where there is none yet the ray is noted.
    #[inline(never)]
    fn is_above_horizon(&self, tree: &Tree, facet: usize, direction: Vector) -> bool {
        let record = &self.facets[facet];
        match record.horizon.get() {
            Some(horizon) => horizon.is_below(direction),
            // Horizons have no room for a sag: rays from the spline are known to be free by cones alone.
            None if self.sag > 0.0 && record.left.load(Ordering::Relaxed) > RAYS_BEFORE_CONE => false,
            None => {
                record.note(tree, facet, direction, self);
                false
            }
        }
    }
}

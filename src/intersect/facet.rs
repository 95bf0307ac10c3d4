//! One ray against one facet, in f64: the test every facet intersector decides with.
//!
//! Watertight after Woop, Benthin, Wald, *Watertight Ray/Triangle Intersection*, JCGT 2(1), 2013: the corners are
//! sheared so that the ray runs along an axis, and the sign of three edge functions decides. They are computed
//! without fused operations, so that both sides of a shared edge get exactly opposite values; where one is zero its
//! sign is taken in exact arithmetic. The result depends on ray and facet alone, not on the order of queries.
//!
//! A ray that leaves a facet ([`Ray::departure`]) cannot meet the triangle it starts on. Facets that share a vertex with
//! it and have the start on their border are tested from a point moved a millionth of a facet into the starting
//! triangle: so a concave neighbour is met where it is, and a convex one is not, whatever the rounding of the start.
//! A ray that grazes the facet that it leaves starts a little over it ([`Surroundings::lifted`]).
//! A start on the diagonal of a folded quad lies on the triangle that the departure names; where it names none, which triangle that is
//! is a matter of rounding, and with it whether a ray at less than the angle of the fold meets the other at once.
//! Weakness: two coincident sheets of different parts are two facets at the same place, and which of them a ray that leaves one meets at
//! t = 0 is a matter of rounding.

pub(crate) use super::facet_hit::{FacetHit, Nearest};
pub(crate) use super::line::Line;
pub(crate) use super::start_triangle::LONGEST_NUDGE;

use super::slopes::{LEAST_SINE, Slopes};
use super::start_triangle::{LIFT, StartTriangle};
use crate::math::simd::{self, Instructions, Kernel};
use crate::math::{Aabb, Point, QuadHalf, Ray, Vector, distance_to_segment};
use crate::mesh::FacetMesh;
use std::hint::select_unpredictable;

/// How far from where it should be a start may lie, relative to the largest coordinate: see [`Surroundings::new`].
const REACH: f64 = 1.0 / (1u64 << 40) as f64;

/// The mesh and its tolerances, as the facet test needs them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings<'m> {
    pub(crate) mesh: &'m FacetMesh,
    /// A start is taken to lie on a border or plane when it is no farther from it than this, mm.
    pub(crate) reach: f64,
    /// Around all usable positions, mm; empty where there are none.
    pub(crate) bounds: Aabb,
}

/// The largest coordinate that is traced, mm: its cube overflows no `f32` box, and a million kilometres hold any lamp.
const LARGEST: f64 = 1e12;

/// Whether a corner can be traced: each coordinate a number of at most [`LARGEST`] in size.
pub(crate) fn is_usable(p: Point) -> bool {
    p.abs().cmple(Point::splat(LARGEST)).all()
}

/// The box around the usable ones of these points.
struct UsableBounds<'a> {
    points: &'a [Point],
}

impl Kernel for UsableBounds<'_> {
    type Output = Aabb;

    #[inline(always)]
    fn run<I: Instructions>(self) -> Aabb {
        /// Coordinates of eight points, which are compared at once.
        const LANES: usize = 24;
        let (chunks, _) = bytemuck::cast_slice::<Point, f64>(self.points).as_chunks::<LANES>();
        let (mut low, mut high, mut usable) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES], [true; LANES]);
        for chunk in chunks {
            for lane in 0..LANES {
                let x = chunk[lane];
                low[lane] = if x < low[lane] { x } else { low[lane] };
                high[lane] = if x > high[lane] { x } else { high[lane] };
                usable[lane] &= x.abs() <= LARGEST;
            }
        }
        // Nearly always all are; else each is tested.
        let chunked = if usable.contains(&false) { 0 } else { chunks.len() * LANES / 3 };
        let corners = [low, high].map(|lanes| (0..LANES / 3).map(move |k| Point::from_slice(&lanes[3 * k..])));
        let of_chunks = corners.into_iter().flatten().filter(|_| chunked > 0);
        let others = self.points[chunked..].iter().copied().filter(|&p| is_usable(p));
        Aabb::from_points(of_chunks.chain(others))
    }
}

impl<'m> Surroundings<'m> {
    /// Takes the bounds of all usable positions, and 2⁻⁴⁰ of the largest coordinate as the reach, 0 without positions: a start is a
    /// rounded `origin + t·direction`, and this covers rays a thousand times longer than the scene. For a lamp it is a picometre.
    pub(crate) fn new(mesh: &'m FacetMesh) -> Self {
        Self::with_bounds(mesh, simd::dispatch(UsableBounds { points: &mesh.positions }))
    }

    /// As [`Self::new`], where the bounds of all usable positions are known.
    pub(crate) fn with_bounds(mesh: &'m FacetMesh, bounds: Aabb) -> Self {
        let largest = if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element() };
        Self { mesh, reach: largest * REACH, bounds }
    }

    /// Widens the reach for starts whose coordinates are up to `farthest` mm, by a share of which they are rounded; never narrows it.
    pub(crate) fn with_starts_as_far_as(self, farthest: f64) -> Self {
        Self { reach: self.reach.max(farthest * REACH), ..self }
    }

    /// Returns a ray that grazes the facet it leaves with its origin lifted over that facet, and any other ray as it is: what rounding put
    /// on the wrong side would pass under the next facet where it starts nearer to their common edge than it rises. Other rays rise out of
    /// the rounding within [`Self::reach`] of an edge. Direction and range are kept: a hit's `t` counts from the lifted origin.
    pub(crate) fn lifted(&self, ray: &Ray) -> Ray {
        let Some(own) = ray.departure.map(|d| d.primitive as usize).filter(|&f| f < self.mesh.facets.len()) else {
            return *ray;
        };
        let corners = self.mesh.corners(own);
        if Slopes::new(corners).leaves(ray.direction) {
            return *ray;
        }
        let named = ray.departure.and_then(|d| d.triangle);
        let own = StartTriangle::new(&corners, ray.origin, named);
        let up = own.normal.normalize_or_zero() * own.side(ray.direction);
        let height = up.dot(ray.origin - corners[0]);
        let wanted = self.reach * LIFT;
        // What is farther off does not start on the facet.
        if height.abs() > self.reach || height >= wanted {
            return *ray;
        }
        Ray { origin: ray.origin + up * (wanted - height), ..*ray }
    }

    /// Room that a box test must leave around a start so that a moved start stays inside, mm; 0 for a ray that leaves no facet.
    pub(crate) fn slack(&self, ray: &Ray) -> f64 {
        if ray.departure.is_some() { 2.0 * (1.0 + LONGEST_NUDGE) * self.reach } else { 0.0 }
    }
}

/// A ray prepared for facets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacetRay {
    pub(crate) origin: [f64; 3],
    /// Slopes of the ray against its main axis, and the inverse of the direction along it.
    shear: [f64; 3],
    /// The axis that the direction is longest along.
    main_axis: u8,
    pub(crate) t_min: f64,
    direction: Vector,
    /// The facet that the ray leaves, and which triangle of it where that is known.
    from: Option<u32>,
    triangle: Option<QuadHalf>,
}

impl FacetRay {
    /// Prepares a ray: chooses its axes and shear. It need not be finite; one without a direction then hits nothing.
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> Self {
        let d: &[f64; 3] = ray.direction.as_ref();
        let a = ray.direction.abs();
        // The main axis is the longest of the direction: no slope against it is above one, and shearing magnifies
        // nothing.
        let of_yz = select_unpredictable(a.y > a.z, 1, 2);
        let of_xz = select_unpredictable(a.x > a.z, 0, 2);
        let main_axis: u8 = select_unpredictable(a.x > a.y, of_xz, of_yz);
        let [kx, ky, kz] = axes(main_axis);
        let sz = 1.0 / d[kz];
        Self {
            origin: ray.origin.to_array(),
            shear: [d[kx] * sz, d[ky] * sz, sz],
            main_axis,
            t_min: ray.t_min,
            direction: ray.direction,
            from: ray.departure.map(|d| d.primitive),
            triangle: ray.departure.and_then(|d| d.triangle),
        }
    }

    /// Slopes against the main axis, and the inverse of the direction along it.
    pub(crate) fn shear(&self) -> [f64; 3] {
        self.shear
    }

    /// The axis that the direction is longest along.
    pub(crate) fn main_axis(&self) -> u8 {
        self.main_axis
    }

    /// The two lateral axes and the main one.
    #[inline(always)]
    pub(crate) fn axes(&self) -> [usize; 3] {
        axes(self.main_axis)
    }

    /// The ray with its coordinates in the order of its axes, without its departure.
    #[inline(always)]
    pub(crate) fn line(&self) -> Line {
        let [kx, ky, kz] = self.axes();
        let o = self.origin;
        Line { origin: [o[kx], o[ky], o[kz]], shear: self.shear, t_min: self.t_min }
    }

    /// Tests the chosen triangles of a facet (bit 0: the first, bit 1: the second) and offers hits to `best`. Where the ray leaves this
    /// facet or a neighbour, the rules for departures at the head of the file hold. `corners` are those of `facet`, mm.
    #[inline(always)]
    pub(crate) fn test(
        &self,
        facet: u32,
        triangles: u32,
        corners: [&Point; 4],
        around: &Surroundings,
        best: &mut Nearest,
    ) {
        // A ray that leaves nothing needs none of the care below.
        let Some(own) = self.from else { return self.test_plainly(facet, triangles, corners, self.origin, best) };
        let [first, second] = if own == facet {
            self.tests_of_own(&corners.map(|p| *p), around)
        } else {
            match self.tests_of_other(own, facet, corners, around) {
                None => return self.test_plainly(facet, triangles, corners, self.origin, best),
                Some(tests) => tests,
            }
        };
        for (bit, way) in [(1, first), (2, second)] {
            let origin = match way {
                TriangleTest::Plain => self.origin,
                TriangleTest::From(moved) => moved.to_array(),
                TriangleTest::Never => continue,
            };
            self.test_plainly(facet, triangles & bit, corners, origin, best);
        }
    }

    /// Tests the chosen triangles of a facet from `origin`, whatever the ray leaves, and offers hits to `best`.
    #[inline(always)]
    fn test_plainly(&self, facet: u32, triangles: u32, corners: [&Point; 4], origin: [f64; 3], best: &mut Nearest) {
        let [kx, ky, kz] = self.axes();
        // As arrays, since the index of a glam vector is a match.
        let corners: [&[f64; 3]; 4] = corners.map(|p| p.as_ref());
        let mut along = [[0.0; 4]; 3];
        for k in 0..4 {
            along[0][k] = corners[k][kx];
            along[1][k] = corners[k][ky];
            along[2][k] = corners[k][kz];
        }
        let line = Line { origin: [origin[kx], origin[ky], origin[kz]], ..self.line() };
        line.test_quad((facet, triangles), &along, best);
    }

    /// How to test the two triangles of the facet that the ray leaves: of these only the one it does not start on may be met, and only
    /// where the fold between them closes on the ray.
    #[cold]
    fn tests_of_own(&self, corners: &[Point; 4], around: &Surroundings) -> [TriangleTest; 2] {
        let [a, b, c, d] = *corners;
        let (first, second) = ((b - a).cross(c - a), (c - a).cross(d - a));
        // Over both triangles to one side: a ray that rises clear of both planes meets neither.
        let over = |n: Vector, side: f64| side * n.dot(self.direction) > LEAST_SINE * n.length();
        let goes = |side: f64| over(first, side) && (c == d || over(second, side));
        if goes(1.0) || goes(-1.0) {
            return [TriangleTest::Never; 2];
        }
        let start = Point::from_array(self.origin);
        let own = StartTriangle::new(corners, start, self.triangle);
        let apex = corners[if own.second { 1 } else { 3 }];
        // Heights are compared as squares, each times the square of the normal's length: no root is taken and
        // nothing divided.
        let thick = around.reach * around.reach * own.normal.length_squared();
        let side = own.side(self.direction);
        let height = side * own.normal.dot(apex - corners[0]);
        let off_plane = side * own.normal.dot(start - corners[0]);
        // The other triangle can be ahead only where the fold closes on the side that the ray goes to: higher than a start that was
        // lifted, else than what may be rounding.
        let is_lifted = own.is_lifted(off_plane, around.reach);
        let closes = if is_lifted { height > off_plane } else { height > 0.0 && height * height > thick };
        // A start off the plane of its triangle does not lie on the facet, whatever its departure says.
        let other = if !closes || off_plane * off_plane > thick {
            TriangleTest::Never
        } else if own.is_at_diagonal(corners, start, around.reach) {
            TriangleTest::From(own.nudge(start, around.reach))
        } else {
            TriangleTest::Plain
        };
        if own.second { [other, TriangleTest::Never] } else { [TriangleTest::Never, other] }
    }

    /// How to test a facet whose box holds the start within reach; `None` for all others, which are tested plainly.
    #[inline(always)]
    fn tests_of_other(
        &self,
        own: u32,
        facet: u32,
        corners: [&Point; 4],
        around: &Surroundings,
    ) -> Option<[TriangleTest; 2]> {
        let start = Point::from_array(self.origin);
        let corners = &corners.map(|p| *p);
        let [a, b, c, d] = *corners;
        let (low, high) = (a.min(b).min(c).min(d), a.max(b).max(c).max(d));
        let near = start.cmpge(low - around.reach).all() && start.cmple(high + around.reach).all();
        near.then(|| self.tests_of_neighbour(own, facet, corners, around))
    }

    /// How the two triangles of `facet` are tested for a ray that leaves the facet `own` on a border of both.
    #[cold]
    fn tests_of_neighbour(
        &self,
        own: u32,
        facet: u32,
        corners: &[Point; 4],
        around: &Surroundings,
    ) -> [TriangleTest; 2] {
        let mesh = around.mesh;
        // A departure that names no facet of this mesh says nothing of neighbours.
        let Some(_) = mesh.facets.get(own as usize) else { return [TriangleTest::Plain; 2] };
        let ours = mesh.corner_positions(own as usize);
        let theirs = mesh.corner_positions(facet as usize);
        // Without a vertex in common they have no border on which a start could lie.
        if !ours.iter().any(|p| theirs.contains(p)) {
            return [TriangleTest::Plain; 2];
        }
        let start = Point::from_array(self.origin);
        let own = StartTriangle::new(&mesh.corners(own as usize), start, self.triangle);
        let up = own.normal.normalize_or_zero();
        let side = own.side(self.direction);
        let is_lifted = own.is_lifted(side * own.normal.dot(start - own.corner), around.reach);
        // What rises by less lies under the ray, or is flat but for rounding.
        let least_rise = if is_lifted { 0.0 } else { around.reach };
        let way = |triangle: [Point; 3]| {
            let [a, b, c] = triangle;
            let border = distance_to_segment(start, a, b)
                .min(distance_to_segment(start, b, c))
                .min(distance_to_segment(start, c, a));
            if border > around.reach {
                return TriangleTest::Plain;
            }
            // Nothing of it rises over the plane that the ray leaves.
            let rise = triangle.into_iter().map(|p| side * up.dot(p - start)).fold(0.0, f64::max);
            if rise <= least_rise {
                TriangleTest::Never
            } else {
                TriangleTest::From(own.nudge(start, around.reach))
            }
        };
        let [a, b, c, d] = *corners;
        [way([a, b, c]), way([a, c, d])]
    }
}

/// The two axes beside a main one, and it: x, y and z turned on until it is the last.
#[inline(always)]
fn axes(main: u8) -> [usize; 3] {
    static AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];
    AXES[usize::from(main.min(2))]
}

/// How a triangle is tested: from the ray's start, from a moved one, or not at all.
#[derive(Clone, Copy, Debug)]
enum TriangleTest {
    Plain,
    From(Point),
    Never,
}

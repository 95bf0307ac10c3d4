//! One ray against one facet, in f64: the test every facet intersector decides with.
//!
//! Watertight after Woop, Benthin, Wald, *Watertight Ray/Triangle Intersection*, JCGT 2(1), 2013: the corners are
//! sheared so that the ray runs along an axis, and the sign of three edge functions decides. They are computed
//! without fused operations, so that both sides of a shared edge get exactly opposite values; where one is zero its
//! sign is taken in exact arithmetic. The result depends on ray and facet alone, not on who asks in which order.
//!
//! A ray that leaves a facet ([`Ray::from`]) cannot meet the triangle it starts on. Facets that share a vertex with
//! it and have the start on their border are asked from a point moved a millionth of a facet into the starting
//! triangle: so a concave neighbour is met where it is, and a convex one is not, whatever the rounding of the start.
//! Weakness: two coincident sheets of different parts are two facets at the same place, and which of them a ray that
//! leaves one meets at t = 0 is a matter of rounding.

use crate::math::{Aabb, Point, Ray, Vector};
use crate::mesh::FacetMesh;
use robust::{Coord, orient2d};

/// Share of the way to the middle of its triangle by which a start on a border is moved inside.
const NUDGE: f64 = 1.0 / 1048576.0;
/// The most by which it is moved, in units of [`Surroundings::reach`].
const LONGEST_NUDGE: f64 = 1024.0;

/// A hit on a facet: which, where on it, and how far along the ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FacetHit {
    pub(crate) t: f64,
    pub(crate) facet: u32,
    /// Whether the triangle (0, 2, 3) was hit, not (0, 1, 2).
    pub(crate) second: bool,
    /// Weights of that triangle's corners.
    pub(crate) b: [f64; 3],
}

/// The nearest hit so far; starts as "nothing before `t_max`".
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub(crate) t: f64,
    hit: Option<FacetHit>,
}

impl Nearest {
    pub(crate) fn before(t_max: f64) -> Self {
        Self { t: t_max, hit: None }
    }

    pub(crate) fn hit(&self) -> Option<FacetHit> {
        self.hit
    }

    /// Keeps the nearer hit, of equal ones that on the facet of lowest index, there the first triangle's.
    #[inline]
    fn offer(&mut self, hit: FacetHit) {
        let nearer = match self.hit {
            None => hit.t <= self.t,
            Some(old) => hit.t < old.t || (hit.t == old.t && (hit.facet, hit.second) < (old.facet, old.second)),
        };
        if nearer {
            *self = Self { t: hit.t, hit: Some(hit) };
        }
    }
}

/// What the test knows of the mesh as a whole.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings<'m> {
    pub(crate) mesh: &'m FacetMesh,
    /// A start is taken to lie on a border when it is nearer than this, mm.
    pub(crate) reach: f64,
    /// Around all positions that count.
    pub(crate) bounds: Aabb,
}

/// Whether a corner can be traced: a number of at most 1e12 mm, so that nothing overflows in f32 boxes.
pub(crate) fn usable(p: Point) -> bool {
    p.abs().cmple(Point::splat(1e12)).all()
}

impl<'m> Surroundings<'m> {
    /// A start is a rounded `origin + t·direction`; 2⁻⁴⁰ of the largest coordinate covers rays a thousand times
    /// longer than the scene and is a picometre for a lamp.
    pub(crate) fn new(mesh: &'m FacetMesh) -> Self {
        let bounds = Aabb::around(mesh.positions.iter().copied().filter(|&p| usable(p)));
        let largest = if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element() };
        Self { mesh, reach: largest * 2f64.powi(-40), bounds }
    }

    /// Room that a box test must leave around a start so that a moved start stays inside, mm.
    pub(crate) fn slack(&self, ray: &Ray) -> f64 {
        if ray.from.is_some() { 2.0 * (1.0 + LONGEST_NUDGE) * self.reach } else { 0.0 }
    }
}

/// A ray prepared for facets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacetRay {
    origin: [f64; 3],
    /// Slopes of the ray against its main axis, and the inverse of the direction along it.
    shear: [f64; 3],
    /// Axes: two lateral ones, then the main one.
    axes: [u8; 3],
    t_min: f64,
    direction: Vector,
    from: Option<u32>,
}

impl FacetRay {
    pub(crate) fn new(ray: &Ray) -> Self {
        let d = ray.direction.to_array();
        let a = ray.direction.abs();
        let kz = if a.x > a.y {
            if a.x > a.z { 0 } else { 2 }
        } else if a.y > a.z {
            1
        } else {
            2
        };
        let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
        let sz = 1.0 / d[kz];
        Self {
            origin: ray.origin.to_array(),
            shear: [d[kx] * sz, d[ky] * sz, sz],
            axes: [kx as u8, ky as u8, kz as u8],
            t_min: ray.t_min,
            direction: ray.direction,
            from: ray.from.map(|d| d.primitive),
        }
    }

    /// Slopes against the main axis.
    pub(crate) fn slopes(&self) -> [f64; 2] {
        [self.shear[0], self.shear[1]]
    }

    /// The two lateral axes and the main one.
    pub(crate) fn axes(&self) -> [usize; 3] {
        self.axes.map(|a| (a % 3) as usize)
    }

    /// Tests the triangles of a facet (bit 0: the first, bit 1: the second) and keeps the nearest hit.
    #[inline]
    pub(crate) fn test(
        &self,
        facet: u32,
        triangles: u32,
        corners: &[Point; 4],
        around: &Surroundings,
        best: &mut Nearest,
    ) {
        let ways = match self.from {
            None => [Way::Plain; 2],
            Some(own) if own == facet => self.ways_of_own(corners, around),
            Some(own) => self.ways_of_other(own, facet, corners, around),
        };
        let [a, b, c, d] = *corners;
        if triangles & 1 != 0
            && let Some((t, b)) = self.triangle(ways[0], [a, b, c], best.t)
        {
            best.offer(FacetHit { t, facet, second: false, b });
        }
        if triangles & 2 != 0
            && let Some((t, b)) = self.triangle(ways[1], [a, c, d], best.t)
        {
            best.offer(FacetHit { t, facet, second: true, b });
        }
    }

    #[inline(always)]
    fn triangle(&self, way: Way, corners: [Point; 3], t_max: f64) -> Option<(f64, [f64; 3])> {
        let origin = match way {
            Way::Plain => self.origin,
            Way::From(moved) => moved.to_array(),
            Way::Never => return None,
        };
        let [kx, ky, kz] = self.axes();
        let [sx, sy, sz] = self.shear;
        let [a, b, c] = corners.map(|p| {
            let p = p.to_array();
            let z = p[kz] - origin[kz];
            [(p[kx] - origin[kx]) - sx * z, (p[ky] - origin[ky]) - sy * z, z]
        });
        let mut u = c[0] * b[1] - c[1] * b[0];
        let mut v = a[0] * c[1] - a[1] * c[0];
        let mut w = b[0] * a[1] - b[1] * a[0];
        if u == 0.0 || v == 0.0 || w == 0.0 {
            (u, v, w) = exact_edges(a, b, c);
        }
        if u.min(v).min(w) < 0.0 && u.max(v).max(w) > 0.0 {
            return None;
        }
        let det = u + v + w;
        let t = (u * a[2] + v * b[2] + w * c[2]) * sz / det;
        // A NaN (det = 0, or no direction) fails the comparisons.
        (t >= self.t_min && t <= t_max).then(|| (t, [u / det, v / det, w / det]))
    }

    /// The facet that the ray leaves: only its other triangle may be met, and only where the fold between them closes
    /// on the ray.
    fn ways_of_own(&self, corners: &[Point; 4], around: &Surroundings) -> [Way; 2] {
        let start = Point::from_array(self.origin);
        let own = Own::new(corners, start);
        let apex = corners[if own.second { 1 } else { 3 }];
        let thick = around.reach * around.reach * own.normal.length_squared();
        let height = own.normal.dot(apex - corners[0]);
        let off_plane = own.normal.dot(start - corners[0]);
        let closes = height * own.normal.dot(self.direction) > 0.0 && height * height > thick;
        let other = if !closes || off_plane * off_plane > thick {
            Way::Never
        } else if distance_to_segment(start, corners[0], corners[2]) <= around.reach {
            Way::From(own.moved(start, around.reach))
        } else {
            Way::Plain
        };
        if own.second { [other, Way::Never] } else { [Way::Never, other] }
    }

    #[inline]
    fn ways_of_other(&self, own: u32, facet: u32, corners: &[Point; 4], around: &Surroundings) -> [Way; 2] {
        let start = Point::from_array(self.origin);
        let [a, b, c, d] = *corners;
        let (low, high) = (a.min(b).min(c).min(d), a.max(b).max(c).max(d));
        let near = start.cmpge(low - around.reach).all() && start.cmple(high + around.reach).all();
        if near { self.ways_of_neighbour(own, facet, corners, around) } else { [Way::Plain; 2] }
    }

    #[cold]
    fn ways_of_neighbour(&self, own: u32, facet: u32, corners: &[Point; 4], around: &Surroundings) -> [Way; 2] {
        let mesh = around.mesh;
        let Some(_) = mesh.facets.get(own as usize) else { return [Way::Plain; 2] };
        let ours = mesh.corner_positions(own as usize);
        let theirs = mesh.corner_positions(facet as usize);
        if !ours.iter().any(|p| theirs.contains(p)) {
            return [Way::Plain; 2];
        }
        let start = Point::from_array(self.origin);
        let own = Own::new(&mesh.corners(own as usize), start);
        let up = own.normal.normalize_or_zero();
        let side = up.dot(self.direction).signum();
        let way = |triangle: [Point; 3]| {
            let [a, b, c] = triangle;
            let border = distance_to_segment(start, a, b)
                .min(distance_to_segment(start, b, c))
                .min(distance_to_segment(start, c, a));
            if border > around.reach {
                return Way::Plain;
            }
            // Nothing of it rises over the plane that the ray leaves.
            let rise = triangle.into_iter().map(|p| side * up.dot(p - start)).fold(0.0, f64::max);
            if rise <= around.reach { Way::Never } else { Way::From(own.moved(start, around.reach)) }
        };
        let [a, b, c, d] = *corners;
        [way([a, b, c]), way([a, c, d])]
    }
}

/// How a triangle is asked.
#[derive(Clone, Copy, Debug)]
enum Way {
    Plain,
    From(Point),
    Never,
}

/// The triangle of a facet on which a ray starts.
struct Own {
    second: bool,
    /// Twice the area long.
    normal: Vector,
    middle: Point,
}

impl Own {
    fn new(corners: &[Point; 4], start: Point) -> Self {
        let [a, b, c, d] = *corners;
        let second = c != d && (c - a).cross(start - a).dot((c - a).cross(d - b)) > 0.0;
        let [p, q, r] = if second { [a, c, d] } else { [a, b, c] };
        Self { second, normal: (q - p).cross(r - p), middle: (p + q + r) / 3.0 }
    }

    fn moved(&self, start: Point, reach: f64) -> Point {
        start + ((self.middle - start) * NUDGE).clamp_length_max(LONGEST_NUDGE * reach)
    }
}

/// The edge functions with their exact signs.
#[cold]
fn exact_edges(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> (f64, f64, f64) {
    let zero = Coord { x: 0.0, y: 0.0 };
    let edge = |p: [f64; 3], q: [f64; 3]| orient2d(Coord { x: p[0], y: p[1] }, Coord { x: q[0], y: q[1] }, zero);
    (edge(c, b), edge(a, c), edge(b, a))
}

fn distance_to_segment(p: Point, a: Point, b: Point) -> f64 {
    let (ab, ap) = (b - a, p - a);
    let along = ap.dot(ab) / ab.length_squared();
    if along > 0.0 { (ap - ab * along.min(1.0)).length() } else { ap.length() }
}

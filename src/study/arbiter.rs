//! Decides which of two intersectors on the same facets is right where they differ: all facets are tested again with twice the digits.
//!
//! Signs of the edge functions (the volume of the ray and two corners) and distances are computed in pairs of f64, about
//! 106 bits (Dekker, *A Floating-Point Technique for Extending the Available Precision*, 1971), by code that shares
//! nothing with the intersectors.
//!
//! Guarantee: an answer is called false only when it is a miss though a facet is truly met, a hit where no facet is met even
//! within 1e-13 of the lengths involved, or a hit behind a nearer true one.
//! Weakness: only distances are judged, to single precision, not which facet was named. Every facet is tested, so a verdict costs
//! milliseconds on a million of them. At silhouettes, on the border of an open mesh and at the ends of the ray's range both a hit and a
//! miss within that band are true.

use crate::intersect::Hit;
use crate::math::{Point, Ray, Vector};
use crate::mesh::FacetMesh;
use smallvec::SmallVec;
use std::ops::{Add, Mul, Sub};

/// Relative to 1 mm plus the distance: single precision (2⁻²⁴ = 6e-8) behind a grazing angle of 1/1700, with room.
const SAME_DISTANCE: f64 = 1e-4;
/// Crossings this near, relative to 1 mm plus the distance, are of facets that share an edge or corner.
const NEIGHBOURS: f64 = 1e-9;
/// Slack of the test that spares far facets, relative to the facet's reach; a facet too many only costs time.
const CULL_RELATIVE: f64 = 1e-6;
/// The same for the rounding of coordinates, relative to 1 mm plus the distance of the facet.
const CULL_ROUNDING: f64 = 1e-9;
/// Rounding of a distance against the ends of the ray's range, relative: 4500 units in the last place.
const RANGE_ROUNDING: f64 = 1e-12;

/// Distance along a ray from which on a crossing of the facet that it leaves is a hit on its other half, mm: starts are rounded to
/// far less.
const LEAST_OWN_DISTANCE: f64 = 1e-6;
/// What an f64 test may be wrong by, in the lengths involved.
const BAND: f64 = 1e-13;
/// What these pairs of numbers may be wrong by, in the lengths involved: 2⁻⁹⁰.
const PAIR_ROUNDING: f64 = 1.0 / (1u128 << 90) as f64;

/// Which of two differing answers is right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arbitration {
    /// The first alone.
    First,
    /// The second alone.
    Second,
    /// Both or none.
    Undecided,
}

/// Whether two distances, mm, may belong to the same hit: they differ by no more than single precision, with room.
pub fn same_distance(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME_DISTANCE * (1.0 + a.abs())
}

/// Judges two answers to one ray, on all facets of the mesh; `None` is a miss. Undecided where both are right, or both wrong.
pub fn arbitrate(mesh: &FacetMesh, ray: &Ray, first: Option<&Hit>, second: Option<&Hit>) -> Arbitration {
    let mut met = Vec::new();
    // All of them: a tree here could share the fault of the trees that are judged.
    for f in (0..mesh.facets.len()).filter(|&f| passes_near(ray, &mesh.corners(f))) {
        let [a, b, c, d] = mesh.corners(f);
        let other_half = (!mesh.facets[f].is_triangle()).then_some([a, c, d]);
        // The facet that the ray leaves is met where it starts, which is no hit; its other half may be met farther on.
        let own = ray.departure.is_some_and(|departure| departure.primitive as usize == f);
        met.extend(
            std::iter::once([a, b, c])
                .chain(other_half)
                .filter_map(|corners| triangle_crossing(ray, corners))
                .filter(|hit| !own || hit.t > LEAST_OWN_DISTANCE),
        );
    }
    let certain = |hit: &Crossing| hit.inside || (hit.exact && surface_goes_on(&met, hit));
    let nearest = met.iter().filter(|m| certain(m)).map(|m| m.t).reduce(f64::min);
    let holds = |answer: Option<&Hit>| match answer {
        None => nearest.is_none(),
        Some(hit) => {
            met.iter().any(|m| same_distance(m.t, hit.t))
                && nearest.is_none_or(|n| hit.t <= n || same_distance(n, hit.t))
        }
    };
    // Two right answers may differ at a silhouette; two wrong ones decide nothing.
    match (holds(first), holds(second)) {
        (true, false) => Arbitration::First,
        (false, true) => Arbitration::Second,
        _ => Arbitration::Undecided,
    }
}

/// Whether the triangles met where `hit` is surround it: facing the same way, with each edge that the ray passes shared by two of them. At
/// a silhouette, where they face both ways, and on a border the ray may as well pass by.
fn surface_goes_on(met: &[Crossing], hit: &Crossing) -> bool {
    let beside = || met.iter().filter(|m| (m.t - hit.t).abs() <= NEIGHBOURS * (1.0 + hit.t.abs()));
    let same_edge = |[a, b]: [Point; 2], [c, d]: [Point; 2]| (a == c && b == d) || (a == d && b == c);
    let edges = || beside().flat_map(|m| m.edges.iter().copied());
    beside().all(|m| m.front == hit.front)
        && edges().all(|edge| edges().filter(|&other| same_edge(edge, other)).count() == 2)
}

/// Whether the whole line of a ray, both ways, comes near a facet at all.
fn passes_near(ray: &Ray, corners: &[Point; 4]) -> bool {
    let from_corner = corners[0] - ray.origin;
    // The facet's first corner off the line, against the farthest that another corner is from it.
    let aside: Vector = from_corner - ray.direction * from_corner.dot(ray.direction);
    let reach = corners.iter().map(|p| p.distance_squared(corners[0])).fold(0.0, f64::max).sqrt();
    aside.length() <= reach * (1.0 + CULL_RELATIVE) + CULL_ROUNDING * (1.0 + from_corner.length())
}

/// A triangle that the ray meets to within rounding.
struct Crossing {
    /// Distance, mm.
    t: f64,
    /// Whether it is met beyond the band of rounding, within the ray's range.
    inside: bool,
    /// Whether it is met to [`PAIR_ROUNDING`], within the ray's range.
    exact: bool,
    /// The ends of the edges that the ray passes within the band: one on an edge, two at a corner.
    edges: SmallVec<[[Point; 2]; 2]>,
    /// Whether the ray runs against the normal of its corners' order.
    front: bool,
}

/// Returns where the ray meets a triangle within its range; `None` where it misses by more than rounding, or runs within its plane.
fn triangle_crossing(ray: &Ray, corners: [Point; 3]) -> Option<Crossing> {
    let d = ray.direction.to_array().map(DoubleDouble::from);
    let from = ray.origin.to_array();
    let opposite = [[corners[1], corners[2]], [corners[2], corners[0]], [corners[0], corners[1]]];
    let [a, b, c] = corners.map(|p| {
        // Differences of coordinates are exact as two numbers; all that follows starts from them.
        let p = p.to_array();
        std::array::from_fn(|k| DoubleDouble::two_sum(p[k], -from[k]))
    });
    let size = |v: &[DoubleDouble; 3]| v.iter().fold(0.0, |m: f64, x| m.max(x.high.abs()));
    let largest = size(&a).max(size(&b)).max(size(&c));
    let scale = largest * largest * size(&d);
    let volumes = [volume(&d, &c, &b), volume(&d, &a, &c), volume(&d, &b, &a)];
    let one_sided = |band: f64| {
        let beyond = |sign: f64| volumes.iter().any(|v| v.high * sign > band * scale);
        !(beyond(1.0) && beyond(-1.0))
    };
    // The line runs within the plane, or past an edge.
    let det = volumes[0] + volumes[1] + volumes[2];
    if det.high.abs() <= PAIR_ROUNDING * scale || !one_sided(BAND) {
        return None;
    }
    // The weights of the corners are the volumes; the distance is that along the axis on which the direction is longest, where its
    // division loses least.
    let main = (0..3).fold(0, |m, k| if d[k].high.abs() > d[m].high.abs() { k } else { m });
    let along = a[main] * volumes[0] + b[main] * volumes[1] + c[main] * volumes[2];
    let t = along.high / det.high / d[main].high;
    let rounding = RANGE_ROUNDING * t.abs() + f64::MIN_POSITIVE;
    if t < ray.t_min - rounding || t > ray.t_max + rounding {
        return None;
    }
    let in_range = t >= ray.t_min + rounding && t <= ray.t_max - rounding;
    let on_edge = volumes.map(|v| v.high.abs() <= BAND * scale);
    let edges: SmallVec<_> = (0..3).filter(|&k| on_edge[k]).map(|k| opposite[k]).collect();
    let inside = in_range && edges.is_empty() && one_sided(0.0);
    Some(Crossing { t, inside, exact: in_range && one_sided(PAIR_ROUNDING), edges, front: det.high > 0.0 })
}

/// Returns the triple product `u · (v × w)`, six times the volume of their tetrahedron.
fn volume(u: &[DoubleDouble; 3], v: &[DoubleDouble; 3], w: &[DoubleDouble; 3]) -> DoubleDouble {
    let cross = |p: usize, q: usize| v[p] * w[q] - v[q] * w[p];
    u[0] * cross(1, 2) + u[1] * cross(2, 0) + u[2] * cross(0, 1)
}

/// The unevaluated sum of two f64.
#[derive(Clone, Copy, Debug)]
struct DoubleDouble {
    high: f64,
    low: f64,
}

impl DoubleDouble {
    /// Returns the exact sum of two numbers.
    fn two_sum(a: f64, b: f64) -> Self {
        // Knuth's two-sum: what rounding took from the sum is recovered, whichever of the two is larger.
        let high = a + b;
        let back = high - a;
        Self { high, low: (a - (high - back)) + (b - back) }
    }

    /// Returns the exact sum of two numbers of which the second is not larger in size than the first.
    fn quick_two_sum(high: f64, low: f64) -> Self {
        // Dekker's quick two-sum: the first is the larger here.
        let sum = high + low;
        Self { high: sum, low: low - (sum - high) }
    }
}

impl From<f64> for DoubleDouble {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        let (high, low) = (Self::two_sum(self.high, o.high), Self::two_sum(self.low, o.low));
        let first = Self::quick_two_sum(high.high, high.low + low.high);
        Self::quick_two_sum(first.high, first.low + low.low)
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + Self { high: -o.high, low: -o.low }
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        // The product's rounding comes out exactly of a fused multiply-add; the product of the low parts lies below the last bit.
        let high = self.high * o.high;
        let low = self.high.mul_add(o.high, -high) + (self.high * o.low + self.low * o.high);
        Self::quick_two_sum(high, low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::Certainty;
    use crate::math::{FaceId, Uv, Vector};
    use crate::mesh::{Facet, MeshVertex};

    fn sheets() -> FacetMesh {
        let mut mesh = FacetMesh::default();
        for (k, z) in [0.0, -1.0].into_iter().enumerate() {
            mesh.positions
                .extend([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Point::new(x, y, z)));
            let first = 4 * k as u32;
            let vertex = |k: u32| MeshVertex { position: first + k, normal: Vector::Z, uv: Uv::ZERO };
            mesh.vertices.extend([0, 1, 2, 3].map(vertex));
            mesh.facets.push(Facet { vertices: [0, 1, 2, 3].map(|k| first + k), face: FaceId(0) });
        }
        mesh
    }

    fn hit(t: f64) -> Hit {
        let normal = Vector::Z;
        let (face, primitive, uv) = (FaceId(0), 0, Uv::ZERO);
        Hit {
            t,
            normal,
            geometric_normal: normal,
            face,
            primitive,
            triangle: None,
            uv,
            certainty: Certainty::Facet,
        }
    }

    #[test]
    fn the_nearest_true_hit_wins() {
        let mesh = sheets();
        let (upper, lower) = (hit(2.0), hit(3.0));
        let down = Ray::new(Point::new(0.3, 0.4, 2.0), -Vector::Z);
        let beside = Ray::new(Point::new(1.0 + 1e-9, 0.4, 2.0), -Vector::Z);
        assert_eq!(arbitrate(&mesh, &down, Some(&lower), Some(&upper)), Arbitration::Second);
        assert_eq!(arbitrate(&mesh, &down, Some(&upper), None), Arbitration::First);
        assert_eq!(arbitrate(&mesh, &beside, Some(&upper), None), Arbitration::Second);
        assert_eq!(arbitrate(&mesh, &down.with_range(0.0, 1.0), None, Some(&upper)), Arbitration::First);
        assert_eq!(arbitrate(&mesh, &down.with_range(2.5, 9.0), Some(&upper), Some(&lower)), Arbitration::Second);
    }

    #[test]
    fn a_ray_on_an_edge_is_a_hit_and_on_the_border_may_be() {
        let mesh = sheets();
        let diagonal = Ray::new(Point::new(0.25, 0.25, 2.0), -Vector::Z);
        assert_eq!(arbitrate(&mesh, &diagonal, Some(&hit(2.0)), None), Arbitration::First);
        let border = Ray::new(Point::new(1.0 + 1e-15, 0.3, 2.0), -Vector::Z);
        assert_eq!(arbitrate(&mesh, &border, Some(&hit(2.0)), None), Arbitration::Undecided);
        // Both halves of a quad meet at two of its corners, and the border all the same.
        for (x, y) in [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0)] {
            let corner = Ray::new(Point::new(x, y, 2.0), -Vector::Z);
            assert_eq!(
                arbitrate(&mesh, &corner, None, Some(&hit(2.0))),
                Arbitration::Undecided,
                "corner ({x}, {y})"
            );
        }
    }

    #[test]
    fn a_ray_on_a_corner_that_facets_surround_is_a_hit() {
        let mut mesh = FacetMesh::default();
        for k in 0..9u32 {
            mesh.positions.push(Point::new(f64::from(k % 3) - 1.0, f64::from(k / 3) - 1.0, 0.0));
            mesh.vertices.push(MeshVertex { position: k, normal: Vector::Z, uv: Uv::ZERO });
        }
        for k in [0, 1, 3, 4] {
            mesh.facets.push(Facet { vertices: [k, k + 1, k + 4, k + 3], face: FaceId(0) });
        }
        let middle = Ray::new(Point::new(0.0, 0.0, 2.0), -Vector::Z);
        assert_eq!(arbitrate(&mesh, &middle, Some(&hit(2.0)), None), Arbitration::First);
        // With one of the four gone, the corner is on the border.
        mesh.facets.pop();
        assert_eq!(arbitrate(&mesh, &middle, Some(&hit(2.0)), None), Arbitration::Undecided);
    }

    #[test]
    fn a_hit_at_the_end_of_the_range_may_be_a_miss() {
        let mesh = sheets();
        for end in [2.0 - 4.0 * f64::EPSILON, 2.0, 2.0 + 4.0 * f64::EPSILON] {
            let down = Ray::new(Point::new(0.3, 0.4, 2.0), -Vector::Z).with_range(0.0, end);
            assert_eq!(arbitrate(&mesh, &down, Some(&hit(2.0)), None), Arbitration::Undecided, "range to {end}");
        }
    }

    #[test]
    fn products_are_exact_to_twice_the_digits() {
        let tiny = 2f64.powi(-60);
        let x = DoubleDouble::two_sum(1.0, tiny);
        let square = x * x - DoubleDouble::from(1.0);
        assert_eq!(square.high, 2.0 * tiny);
        assert_eq!((DoubleDouble::two_sum(0.1, 1e17) - DoubleDouble::from(1e17)).high, 0.1);
    }
}

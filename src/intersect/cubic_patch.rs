//! The normal of a cubic patch through the corners and normals of a facet, where a ray meets it.
//!
//! The patch is that of Vlachos et al., *Curved PN Triangles*, I3D 2001, and for quads its bicubic relative with the twists that follow
//! from corners and normals.

use super::corner_normals::parameters;
use super::facet::FacetHit;
use crate::math::{Point, Ray, Uv, Vector};
use crate::mesh::{Facet, FacetMesh, MeshVertex};

/// Returns the normal of the cubic patch where the ray meets it, not of unit length; zero where the patch degenerates there.
#[inline(never)]
pub(super) fn cubic_normal(mesh: &FacetMesh, facet: &Facet, ray: &Ray, hit: &FacetHit, flat: Vector) -> Vector {
    let vertices = facet.vertices.map(|v| mesh.vertices[v as usize]);
    let corners = vertices.map(|v| mesh.positions[v.position as usize]);
    if facet.is_triangle() {
        let net = TriangleNet::new(&corners, &vertices);
        normal_on_ray((|p| net.evaluate(p), beyond_triangle), Uv::new(hit.b[1], hit.b[2]), ray, flat)
    } else {
        let net = QuadNet::new(&corners, &vertices);
        normal_on_ray((|p| net.evaluate(p), beyond_square), parameters(hit), ray, flat)
    }
}

/// Control point next to `p` on the edge to `q`: a third of the way, moved into the tangent plane of `p`.
fn tangent_point(p: Point, n: Vector, q: Point) -> Point {
    (p * 2.0 + q - n * (q - p).dot(n)) / 3.0
}

/// A point of a cubic patch with its two derivatives.
struct PatchPoint {
    point: Point,
    du: Vector,
    dv: Vector,
}

/// How far outside its patch a ray may meet it: the neighbour's patch continues there with the same tangent.
const BEYOND: f64 = 0.25;

/// Rays that meet a patch flatter than this, about a degree, keep the normal of their facet hit's place: Newton's method runs away.
const LEAST_SINE: f64 = 0.02;
/// Newton steps from a facet hit to the patch; what two leave is a thousandth of what the patch is off the surface.
const STEPS: usize = 2;
/// The farthest that steps may lead from the facet hit, as a share of the facet.
const FARTHEST: f64 = 0.5;

/// By how much parameters lie outside of the unit square, in the larger of both.
fn beyond_square(p: Uv) -> f64 {
    (p - p.clamp(Uv::ZERO, Uv::ONE)).abs().max_element()
}

/// By how much weights of the second and third corner lie outside of their triangle: as far as the smallest of all three is negative.
fn beyond_triangle(p: Uv) -> f64 {
    -p.min_element().min(1.0 - p.x - p.y).min(0.0)
}

/// Returns the normal, not of unit length, of a patch where a ray meets it near the parameters `start`, found by two Newton steps; `beyond`
/// says how far parameters are outside of it. Where steps lead away, as for rays that graze it, or to a normal against `flat`, that of
/// `start` itself.
fn normal_on_ray(
    (patch, beyond): (impl Fn(Uv) -> PatchPoint, impl Fn(Uv) -> f64),
    start: Uv,
    ray: &Ray,
    flat: Vector,
) -> Vector {
    let mut p = start;
    let mut local = patch(p);
    let normal = local.du.cross(local.dv);
    for _ in 0..STEPS {
        let n = local.du.cross(local.dv);
        let slope = n.dot(ray.direction);
        if slope.abs() < LEAST_SINE * n.length() {
            return normal;
        }
        // Along the ray to the tangent plane, and from there to parameters.
        let to = ray.origin - local.point;
        let step = to - ray.direction * (n.dot(to) / slope);
        let square = n.length_squared();
        let d = Uv::new(step.cross(local.dv).dot(n), local.du.cross(step).dot(n)) / square;
        p += d;
        if !d.is_finite() || beyond(p) > BEYOND || (p - start).abs().max_element() > FARTHEST {
            return normal;
        }
        local = patch(p);
    }
    // A normal against the facet's belongs to a part of the patch that folds over.
    let n = local.du.cross(local.dv);
    if n.dot(flat) > 0.0 { n } else { normal }
}

/// The bicubic patch through corners and normals.
struct QuadNet([[Point; 4]; 4]);

impl QuadNet {
    /// A patch with these corners, mm, and the vertices' normals there.
    fn new(corners: &[Point; 4], vertices: &[MeshVertex; 4]) -> Self {
        // net[i][j]: i along u, j along v; corners 0..3 at (0,0), (3,0), (3,3), (0,3).
        let mut net = [[Point::ZERO; 4]; 4];
        let places = [(0, 0), (3, 0), (3, 3), (0, 3)];
        // The mixed difference of the corners is the mean of the mixed derivative.
        let mixed = corners[0] - corners[1] + corners[2] - corners[3];
        let toward = |i: usize, at: usize| if i == 0 { at } else { 3 - at };
        for (k, (i, j)) in places.into_iter().enumerate() {
            let along_u = [1, 0, 3, 2][k];
            let along_v = [3, 2, 1, 0][k];
            let (own, normal) = (corners[k], vertices[k].normal);
            let (u_point, v_point) =
                (tangent_point(own, normal, corners[along_u]), tangent_point(own, normal, corners[along_v]));
            // Seen from a corner both parameters run into the facet: along one diagonal this turns the sign.
            let mixed = if (i == 0) == (j == 0) { mixed } else { -mixed };
            // n·x_u = 0 all over the surface, so that n·x_uv = −n_v·x_u, and by the other parameter −n_u·x_v. With the mean in place of
            // this a trapezoid of 20 µm × 0.4 µm on a lens of R = 4 mm was 2° off.
            let turn = |corner: usize| vertices[corner].normal - normal;
            let along_normal = -1.5 * (turn(along_v).dot(u_point - own) + turn(along_u).dot(v_point - own));
            let twist = mixed + normal * (along_normal - normal.dot(mixed));
            net[i][j] = own;
            net[toward(i, 1)][j] = u_point;
            net[i][toward(j, 1)] = v_point;
            net[toward(i, 1)][toward(j, 1)] = u_point + v_point - own + twist / 9.0;
        }
        Self(net)
    }

    /// Point and derivatives at facet parameters; beyond the unit square the polynomial goes on.
    fn evaluate(&self, p: Uv) -> PatchPoint {
        let ((bu, du), (bv, dv)) = (bernstein(p.x), bernstein(p.y));
        let mut local = PatchPoint { point: Point::ZERO, du: Vector::ZERO, dv: Vector::ZERO };
        for i in 0..4 {
            let [a, b, c, d] = self.0[i];
            let on = a * bv[0] + b * bv[1] + c * bv[2] + d * bv[3];
            local.point += on * bu[i];
            local.du += on * du[i];
            local.dv += (a * dv[0] + b * dv[1] + c * dv[2] + d * dv[3]) * bu[i];
        }
        local
    }
}

/// Returns the four cubic Bernstein polynomials at `t`, and their derivatives.
fn bernstein(t: f64) -> ([f64; 4], [f64; 4]) {
    let s = 1.0 - t;
    let values = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
    (values, [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t])
}

/// The cubic triangle through corners and normals; its parameters are the weights of the second and the third corner.
struct TriangleNet {
    corners: [Point; 3],
    /// Points on the sides, by the corners they lie next to and run to: 01, 10, 12, 21, 20, 02.
    sides: [Point; 6],
    middle: Point,
}

impl TriangleNet {
    /// A triangle of the first three corners, mm, with the vertices' normals there.
    fn new(corners: &[Point; 4], vertices: &[MeshVertex; 4]) -> Self {
        let point = |i: usize, j: usize| tangent_point(corners[i], vertices[i].normal, corners[j]);
        let sides = [(0, 1), (1, 0), (1, 2), (2, 1), (2, 0), (0, 2)].map(|(i, j)| point(i, j));
        let corners = [corners[0], corners[1], corners[2]];
        // Beyond the mean of the sides by half of its distance from that of the corners, after Vlachos et al.:
        // quadratic surfaces are met exactly.
        let edges = sides.into_iter().sum::<Point>() / 6.0;
        let middle = edges + (edges - corners.into_iter().sum::<Point>() / 3.0) * 0.5;
        Self { corners, sides, middle }
    }

    /// Point and derivatives at the weights of the second and third corner; beyond the triangle the polynomial goes on.
    fn evaluate(&self, p: Uv) -> PatchPoint {
        let [p300, p030, p003] = self.corners;
        let [p210, p120, p021, p012, p102, p201] = self.sides;
        let p111 = self.middle;
        let (u, v, w) = (1.0 - p.x - p.y, p.x, p.y);
        // A third of the partial derivatives of the homogeneous form, which is of degree 3.
        let d_u = p300 * (u * u)
            + p120 * (v * v)
            + p102 * (w * w)
            + (p210 * (u * v) + p201 * (u * w) + p111 * (v * w)) * 2.0;
        let d_v = p210 * (u * u)
            + p030 * (v * v)
            + p012 * (w * w)
            + (p120 * (u * v) + p111 * (u * w) + p021 * (v * w)) * 2.0;
        let d_w = p201 * (u * u)
            + p021 * (v * v)
            + p003 * (w * w)
            + (p111 * (u * v) + p102 * (u * w) + p012 * (v * w)) * 2.0;
        PatchPoint { point: d_u * u + d_v * v + d_w * w, du: (d_v - d_u) * 3.0, dv: (d_w - d_u) * 3.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A thin trapezoid on the unit sphere, where normals are places: a pair of triangles beside a border, or between two rows of cells.
    #[test]
    fn a_trapezoid_has_the_normals_of_its_sphere() {
        let on_sphere = |x: f64, y: f64| Point::new(x, y, (1.0 - x * x - y * y).sqrt());
        let worst = |h: f64| {
            let corners = [[0.0, 0.0], [h, 0.0], [0.75 * h, 0.02 * h], [0.25 * h, 0.02 * h]];
            let corners = corners.map(|[x, y]| on_sphere(0.1 + x, y));
            let net =
                QuadNet::new(&corners, &corners.map(|normal| MeshVertex { position: 0, normal, uv: Uv::ZERO }));
            let places = (0..=10).flat_map(|i| (0..=10).map(move |j| Uv::new(f64::from(i), f64::from(j)) / 10.0));
            let errors = places.map(|p| {
                let PatchPoint { point, du, dv } = net.evaluate(p);
                du.cross(dv).normalize().cross(point.normalize()).length()
            });
            errors.fold(0.0, f64::max)
        };
        let errors = [0.2, 0.1, 0.05].map(worst);
        // Third order: 0.3 and of first order where all corners have the mean twist.
        assert!(errors[2] < 3e-4, "{errors:?}");
        assert!(errors.windows(2).all(|e| e[0] / e[1] > 7.0), "{errors:?}");
    }

    #[test]
    fn a_root_far_beyond_a_triangle_is_not_on_its_patch() {
        // The bowl z = (u² + v²) / 4 over its parameters, in which a ray along z is found in one step.
        let bowl = |p: Uv| PatchPoint {
            point: Point::new(p.x, p.y, 0.25 * p.length_squared()),
            du: Vector::new(1.0, 0.0, 0.5 * p.x),
            dv: Vector::new(0.0, 1.0, 0.5 * p.y),
        };
        let start = Uv::splat(0.45);
        for (root, in_square, in_triangle) in [(0.48, true, true), (0.6, true, true), (0.8, true, false)] {
            let ray = Ray::new(Point::new(root, root, 5.0), -Vector::Z);
            let normal = |p: Uv| Vector::new(-0.5 * p.x, -0.5 * p.y, 1.0);
            let expected = |on: bool| normal(if on { Uv::splat(root) } else { start });
            let square = normal_on_ray((bowl, beyond_square), start, &ray, Vector::Z);
            let triangle = normal_on_ray((bowl, beyond_triangle), start, &ray, Vector::Z);
            assert!((square - expected(in_square)).length() < 1e-12, "{root}: {square}");
            assert!((triangle - expected(in_triangle)).length() < 1e-12, "{root}: {triangle}");
        }
    }
}

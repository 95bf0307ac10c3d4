//! How fast the normals of facet hits converge, on surfaces whose normals are known in closed form.

use crate::support::*;
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Cost, Intersector, NormalMode};
use lampyris::math::{Point, Ray, Vector};
use lampyris::mesh::FacetMesh;

/// A surface with its normal in closed form, meshed by `n` facets along a side.
struct Surface {
    name: &'static str,
    mesh: fn(usize) -> FacetMesh,
    /// A point of the surface, from three random numbers, with its outward normal.
    point: fn([f64; 3]) -> (Point, Vector),
}

fn on_sphere([a, b, _]: [f64; 3]) -> (Point, Vector) {
    let (z, p) = (2.0 * a - 1.0, std::f64::consts::TAU * b);
    let r = (1.0 - z * z).sqrt();
    let n = Vector::new(r * p.cos(), r * p.sin(), z);
    (n, n)
}

/// A wavy field without any symmetry: all third derivatives differ from zero almost everywhere.
fn on_waves([a, b, _]: [f64; 3]) -> (Point, Vector) {
    let (x, y) = (a, b);
    let (p, q) = (2.0 * x + 1.3 * y + 0.4, 1.7 * y - 0.9 * x * y);
    let z = 0.15 * p.sin() + 0.1 * q.cos();
    let dx = 0.3 * p.cos() + 0.09 * y * q.sin();
    let dy = 0.195 * p.cos() - 0.1 * (1.7 - 0.9 * x) * q.sin();
    (Point::new(x, y, z), Vector::new(-dx, -dy, 1.0).normalize())
}

fn sphere_mesh(n: usize) -> FacetMesh {
    let mut mesh = globe(2 * n, n, |v| v);
    for vertex in &mut mesh.vertices {
        vertex.normal = mesh.positions[vertex.position as usize];
    }
    mesh
}

fn waves_mesh(n: usize) -> FacetMesh {
    let mut mesh = FacetMesh::default();
    add_grid(&mut mesh, n, n, 0, |a, b| on_waves([a, b, 0.0]).0);
    for vertex in &mut mesh.vertices {
        let p = mesh.positions[vertex.position as usize];
        vertex.normal = on_waves([p.x, p.y, 0.0]).1;
    }
    mesh
}

const SURFACES: [Surface; 2] = [
    Surface { name: "sphere", mesh: sphere_mesh, point: on_sphere },
    Surface { name: "waves", mesh: waves_mesh, point: on_waves },
];

/// Mean angle between the normals of hits and the true ones where the same rays meet the surface, radians. Rays come from outside,
/// up to 60 degrees off the normal.
fn normal_error(surface: &Surface, n: usize, normals: NormalMode) -> f64 {
    let mesh = (surface.mesh)(n);
    let tree = Octree::build(&mesh, &octree::Settings { normals, ..Default::default() });
    let mut r = Random(4);
    let (mut sum, mut count) = (0.0, 0);
    while count < 4000 {
        let (at, normal) = (surface.point)([0; 3].map(|_: i32| r.within(0.02, 0.98)));
        let d = r.direction();
        if d.dot(normal) > -0.5 {
            continue;
        }
        let hit =
            tree.intersect(&Ray::new(at - d * 0.5, d), &mut Cost::default()).expect("the ray meets the surface");
        assert!((hit.t - 0.5).abs() < 0.05, "{}: {} instead of 0.5", surface.name, hit.t);
        assert!((hit.normal.length() - 1.0).abs() < 1e-12);
        assert!(hit.normal.dot(normal) > 0.5, "inward normal {hit:?}");
        sum += hit.normal.cross(normal).length().asin();
        count += 1;
    }
    sum / f64::from(count)
}

/// Orders over each of four halvings of the facets.
fn orders(surface: &Surface, normals: NormalMode) -> Vec<f64> {
    let errors = [16, 32, 64, 128, 256].map(|n| normal_error(surface, n, normals));
    errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect()
}

/// Halving the facets halves the error of flat and nearest normals and quarters that of bilinear ones. The cubic patch has the true
/// tangent planes at its corners and on its sides errs by h⁴ in height. Inside it takes the twists that its corners' normals tell of; the
/// true ones differ by h³ where the surface has third derivatives (as the waves), and so do heights: h² in the normal, the order of the
/// bilinear rule with a much smaller factor. On coarse facets terms of higher order still weigh, and the order falls to 2 from above. On
/// the sphere, without such derivatives, the order is 3 whatever the facets' shape (trapezoids between two circles of latitude).
#[test]
fn normals_converge_as_theory_says() {
    for surface in &SURFACES {
        let error = |mode: NormalMode| normal_error(surface, 64, mode);
        let gain = error(NormalMode::Bilinear) / error(NormalMode::Cubic);
        println!("{}: cubic {gain:.1} times nearer than bilinear at 64 facets a side", surface.name);
        assert!(gain > 4.0, "{}: cubic normals only {gain} times nearer than bilinear ones", surface.name);
        for (mode, order) in [
            (NormalMode::Flat, 1.0),
            (NormalMode::Nearest, 1.0),
            (NormalMode::Bilinear, 2.0),
            (NormalMode::Cubic, if surface.name == "sphere" { 3.0 } else { 2.0 }),
        ] {
            let reached = orders(surface, mode);
            println!("{} {mode}: orders {reached:.3?}", surface.name);
            let settled = if mode == NormalMode::Cubic { &reached[2..] } else { &reached[..] };
            assert!(settled.iter().all(|o| (o - order).abs() < 0.1), "{} {mode}: orders {reached:?}", surface.name);
            assert!(reached.iter().all(|o| *o > order - 0.1), "{} {mode}: orders {reached:?}", surface.name);
        }
    }
}

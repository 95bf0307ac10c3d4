//! Meshes, rays and a reference for the contract of intersectors.

use lampyris::intersect::{Cost, Intersector};
use lampyris::math::{FaceId, Point, Ray, Uv, Vector};
use lampyris::mesh::{Facet, FacetMesh, MeshVertex};
use std::collections::HashMap;
use std::f64::consts::TAU;

/// Marsaglia's xorshift64: the same rays everywhere.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n - 1)
    }

    pub(crate) fn direction(&mut self) -> Vector {
        let (z, p) = (self.within(-1.0, 1.0), TAU * self.unit());
        let r = (1.0 - z * z).sqrt();
        Vector::new(r * p.cos(), r * p.sin(), z)
    }
}

/// Adds a facet with its own vertices; all normals are that of the diagonals.
pub(crate) fn add_facet(mesh: &mut FacetMesh, positions: [u32; 4], face: u32) {
    let [a, b, c, d] = positions.map(|p| mesh.positions[p as usize]);
    let normal = (c - a).cross(d - b).normalize_or_zero();
    let first = mesh.vertices.len() as u32;
    let uvs = [Uv::ZERO, Uv::X, Uv::ONE, Uv::Y];
    for k in 0..4 {
        mesh.vertices.push(MeshVertex { position: positions[k], normal, uv: uvs[k] });
    }
    let mut vertices = [0, 1, 2, 3].map(|k| first + k);
    if positions[2] == positions[3] {
        vertices[3] = vertices[2];
    }
    mesh.facets.push(Facet { vertices, face: FaceId(face) });
}

/// A grid of quads over a map of the unit square.
pub(crate) fn add_grid(mesh: &mut FacetMesh, nu: usize, nv: usize, face: u32, map: impl Fn(f64, f64) -> Point) {
    let first = mesh.positions.len() as u32;
    for j in 0..=nv {
        for i in 0..=nu {
            mesh.positions.push(map(i as f64 / nu as f64, j as f64 / nv as f64));
        }
    }
    let w = nu as u32 + 1;
    for j in 0..nv as u32 {
        for i in 0..nu as u32 {
            let a = first + j * w + i;
            add_facet(mesh, [a, a + 1, a + 1 + w, a + w], face);
        }
    }
}

/// A closed ball of quads: a cube of `n`×`n` sides blown up, then mapped.
pub(crate) fn ball(n: i64, map: impl Fn(Vector) -> Point) -> FacetMesh {
    let mut mesh = FacetMesh::default();
    let mut known: HashMap<[i64; 3], u32> = HashMap::new();
    for axis in 0..3 {
        for side in [-n, n] {
            let mut at = |i: i64, j: i64| {
                let mut key = [0; 3];
                key[axis] = side;
                key[(axis + 1) % 3] = 2 * i - n;
                key[(axis + 2) % 3] = 2 * j - n;
                *known.entry(key).or_insert_with(|| {
                    let v = Vector::from_array(key.map(|k| k as f64)).normalize();
                    mesh.positions.push(map(v));
                    mesh.positions.len() as u32 - 1
                })
            };
            let mut quads = Vec::new();
            for j in 0..n {
                for i in 0..n {
                    let quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    quads.push(if side > 0 { quad } else { [quad[0], quad[3], quad[2], quad[1]] });
                }
            }
            for quad in quads {
                add_facet(&mut mesh, quad, axis as u32);
            }
        }
    }
    mesh
}

/// A closed sphere of longitudes and latitudes, with triangles at its poles.
pub(crate) fn globe(n: usize, m: usize, map: impl Fn(Vector) -> Point) -> FacetMesh {
    let mut mesh = FacetMesh::default();
    mesh.positions.push(map(-Vector::Z));
    for j in 1..m {
        let t = std::f64::consts::PI * j as f64 / m as f64;
        for i in 0..n {
            let p = TAU * i as f64 / n as f64;
            mesh.positions.push(map(Vector::new(t.sin() * p.cos(), t.sin() * p.sin(), -t.cos())));
        }
    }
    mesh.positions.push(map(Vector::Z));
    let top = mesh.positions.len() as u32 - 1;
    let at = |i: usize, j: usize| (1 + (j - 1) * n + i % n) as u32;
    for i in 0..n {
        add_facet(&mut mesh, [0, at(i + 1, 1), at(i, 1), at(i, 1)], 0);
        add_facet(&mut mesh, [at(i, m - 1), at(i + 1, m - 1), top, top], 0);
        for j in 1..m - 1 {
            add_facet(&mut mesh, [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], 0);
        }
    }
    mesh
}

/// Bent quads anywhere in a box of ±`size`.
pub(crate) fn heap(count: usize, size: f64, facet: f64, seed: u64) -> FacetMesh {
    let mut r = Random(seed);
    let mut mesh = FacetMesh::default();
    for k in 0..count {
        let at = Point::new(r.within(-size, size), r.within(-size, size), r.within(-size, size));
        let (x, y) = (r.direction() * facet, r.direction() * facet);
        let first = mesh.positions.len() as u32;
        let bend = r.direction() * (0.1 * facet);
        mesh.positions.extend([at, at + x, at + x + y + bend, at + y]);
        let last = if k % 7 == 0 { first + 2 } else { first + 3 };
        add_facet(&mut mesh, [first, first + 1, first + 2, last], k as u32);
    }
    mesh
}

/// A reflector, a lens and a wavy cover: `n` facets of a lamp, roughly, with a light source in the middle of its cavity.
pub(crate) fn lamp(n: usize) -> (FacetMesh, Vec<Point>) {
    let mut mesh = FacetMesh::default();
    let mut sources = Vec::new();
    let side = |share: f64| ((n as f64 * share).sqrt() as usize).max(2);
    for c in 0..6u32 {
        let x0 = -375.0 + 150.0 * f64::from(c);
        let f = 22.0 + 2.0 * f64::from(c);
        let k = side(0.05);
        add_grid(&mut mesh, k, k, 4 * c, |a, b| {
            let (x, y) = ((a - 0.5) * 130.0, (b - 0.5) * 130.0);
            let ripple = 0.25 * (a * 60.0).sin() * (b * 44.0).cos();
            Point::new(x0 + x, y, (x * x + y * y) / (4.0 * f) - 120.0 + ripple)
        });
        sources.push(Point::new(x0, 0.0, f - 120.0));
        let k = side(0.027);
        add_grid(&mut mesh, k, k, 4 * c + 1, |a, b| {
            let (x, y) = ((a - 0.5) * 136.0, (b - 0.5) * 136.0);
            let (p, q) = ((a * 24.0).fract() - 0.5, (b * 24.0).fract() - 0.5);
            Point::new(x0 + x, y, 20.0 - (x * x + y * y) / 900.0 + 1.6 * (0.5 - p * p - q * q))
        });
        let k = side(0.01);
        add_grid(&mut mesh, k, k, 4 * c + 2, |a, b| {
            let (x, y) = ((a - 0.5) * 136.0, (b - 0.5) * 136.0);
            Point::new(x0 + x, y, 17.0 - (x * x + y * y) / 900.0)
        });
        let k = side(0.002);
        add_grid(&mut mesh, 2 * k, (k / 2).max(1), 4 * c + 3, |a, b| {
            Point::new(x0 + 4.0 * (TAU * a).cos(), 4.0 * (TAU * a).sin(), -119.0 + 15.0 * b)
        });
        add_grid(&mut mesh, 2, (side(0.003) / 2).max(2), 4 * c + 3, |a, b| {
            Point::new(x0 + 75.0, -100.0 + 200.0 * b, -140.0 + 150.0 * a)
        });
    }
    for (face, drop, flutes) in [(30, 0.0, 0.0), (31, 3.0, 0.8)] {
        let k = side(0.14);
        add_grid(&mut mesh, 2 * k, k / 2, face, |a, b| {
            let (x, y) = ((2.0 * a - 1.0) * 465.0, (2.0 * b - 1.0) * 115.0);
            let flute = flutes * ((a * 300.0).fract() - 0.5).abs();
            Point::new(x, y, 80.0 - drop - (x / 465.0).powi(2) * 60.0 - (y / 115.0).powi(2) * 15.0 - flute)
        });
    }
    let k = side(0.12);
    add_grid(&mut mesh, (k / 4).max(8), k * 4, 32, |a, b| {
        let (p, x) = (TAU * a, -440.0 + 880.0 * b);
        let prism = ((b * 400.0).fract() - 0.5).abs() * 1.2;
        let r = 5.0 + if p.sin() > 0.6 { prism } else { 0.0 };
        Point::new(x, -88.0 + r * p.cos() + 8.0 * (x / 200.0).sin(), 40.0 + r * p.sin())
    });
    for s in [-1.0, 1.0] {
        let k = side(0.005);
        add_grid(&mut mesh, 2 * k, k / 2 + 1, 33, |a, b| {
            Point::new(-460.0 + 920.0 * a, s * (110.0 + 6.0 * (a * 3.1).sin()), -150.0 + 230.0 * b)
        });
    }
    add_grid(&mut mesh, 6, 6, 34, |a, b| Point::new(-460.0 + 920.0 * a, -110.0 + 220.0 * b, -150.0));
    (mesh, sources)
}

/// Distance to the nearest triangle by Möller and Trumbore's formula, over all of them, with a margin: the facets whose
/// weights come within `1e-9` of zero make the answer uncertain, as the second value says.
pub(crate) fn by_hand(mesh: &FacetMesh, ray: &Ray) -> (Option<f64>, bool) {
    let mut nearest: Option<f64> = None;
    let mut doubtful = false;
    for f in 0..mesh.facets.len() {
        let [a, b, c, d] = mesh.corners(f);
        for [p, q, r] in [[a, b, c], [a, c, d]] {
            let (e, g) = (q - p, r - p);
            let h = ray.direction.cross(g);
            let det = e.dot(h);
            if det == 0.0 {
                continue;
            }
            let s = ray.origin - p;
            let u = s.dot(h) / det;
            let k = s.cross(e);
            let (v, t) = (ray.direction.dot(k) / det, g.dot(k) / det);
            let inside = u.min(v).min(1.0 - u - v);
            if inside.abs() < 1e-9 || (t - ray.t_min).abs() < 1e-9 || (t - ray.t_max).abs() < 1e-9 {
                doubtful = true;
            }
            if inside >= 0.0 && t >= ray.t_min && t <= ray.t_max {
                nearest = Some(nearest.map_or(t, |n: f64| n.min(t)));
            }
        }
    }
    (nearest, doubtful)
}

/// Paths from the sources: each ray leaves the hit before it to a random side.
#[allow(dead_code)] // The benches use it.
pub(crate) fn paths(tree: &dyn Intersector, sources: &[Point], count: usize) -> Vec<Ray> {
    let mut r = Random(0x9E37_79B9_7F4A_7C15);
    let mut rays = Vec::with_capacity(count);
    let mut path = 0;
    while rays.len() < count {
        let mut ray = Ray::new(sources[path % sources.len()] + r.direction() * 0.3, r.direction());
        path += 1;
        for _ in 0..3 + r.below(6) {
            rays.push(ray);
            let Some(hit) = tree.intersect(&ray, &mut Cost::default()) else { break };
            let side = if hit.geometric_normal.dot(ray.direction) > 0.0 { -1.0 } else { 1.0 };
            let n = hit.geometric_normal * if r.unit() < 0.6 { side } else { -side };
            let direction = (n + r.direction() * 0.999).normalize();
            let from = hit.departure();
            ray = Ray::new(ray.point_at(hit.t), direction).with_departure(from);
        }
    }
    rays.truncate(count);
    rays
}

/// Every quad cut into `cuts` by `cuts` of the same shape, corners shared within what was one quad.
#[allow(dead_code)] // The benches use it.
pub(crate) fn refined(coarse: &FacetMesh, cuts: usize) -> FacetMesh {
    let mut mesh = FacetMesh::default();
    for (f, facet) in coarse.facets.iter().enumerate() {
        let c = coarse.corners(f);
        let first = mesh.positions.len() as u32;
        for j in 0..=cuts {
            for i in 0..=cuts {
                let (a, b) = (i as f64 / cuts as f64, j as f64 / cuts as f64);
                let near = c[0] * (1.0 - a) + c[1] * a;
                let far = c[3] * (1.0 - a) + c[2] * a;
                let position = mesh.positions.len() as u32;
                let normal = coarse.vertices[facet.vertices[0] as usize].normal;
                mesh.positions.push(near * (1.0 - b) + far * b);
                mesh.vertices.push(MeshVertex { position, normal, uv: Uv::new(a, b) });
            }
        }
        let w = cuts as u32 + 1;
        for j in 0..cuts as u32 {
            for i in 0..cuts as u32 {
                let a = first + j * w + i;
                mesh.facets.push(Facet { vertices: [a, a + 1, a + 1 + w, a + w], face: facet.face });
            }
        }
    }
    mesh
}

/// A pot on the ground of a stadium with rows of seats, thin rings along the rows and long cables across; about `n` facets, with
/// places of light around the pot and over the rows.
pub(crate) fn stadium(n: usize) -> (FacetMesh, Vec<Point>) {
    let mut mesh = FacetMesh::default();
    let share = |part: f64| (n as f64 * part) as usize;
    add_grid(&mut mesh, 1, 1, 0, |a, b| Point::new(2e5 * a - 1e5, 2e5 * b - 1e5, -1.0));
    let seats = share(0.15) / 6;
    for i in 0..seats {
        let row = (i % 40) as f64;
        let p = TAU * (i / 40) as f64 / (seats / 40 + 1) as f64;
        let r = 60_000.0 + 800.0 * row;
        let at = Point::new(r * p.cos(), r * p.sin(), 400.0 * row + 200.0);
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                add_grid(&mut mesh, 1, 1, 1, |a, b| {
                    let mut q = Point::ZERO;
                    q[axis] = side;
                    q[(axis + 1) % 3] = 2.0 * a - 1.0;
                    q[(axis + 2) % 3] = 2.0 * b - 1.0;
                    at + q * Point::new(220.0, 220.0, 200.0)
                });
            }
        }
    }
    for row in 0..40 {
        let r = 59_600.0 + 800.0 * f64::from(row);
        add_grid(&mut mesh, (share(0.05) / 40).max(16), 1, 2, |a, b| {
            Point::new(r * (TAU * a).cos(), r * (TAU * a).sin(), 400.0 * f64::from(row) + 20.0 * b)
        });
    }
    let mut random = Random(88_172_645_463_325_252);
    for _ in 0..share(0.1) / 6 {
        let mut end = |low: f64, high: f64| {
            let p = TAU * random.unit();
            Point::new(9e4 * p.cos(), 9e4 * p.sin(), random.within(low, high))
        };
        let (from, to) = (end(2e4, 3e4), end(5e3, 3e4));
        let (u, v) = (to - from).normalize().any_orthonormal_pair();
        add_grid(&mut mesh, 6, 1, 3, |a, b| {
            from + (to - from) * b + (u * (TAU * a).cos() + v * (TAU * a).sin()) * 8.0
        });
    }
    // A knotted tube as handle and spout, and the body.
    let k = share(0.4) as f64;
    add_grid(&mut mesh, (k * 0.1).sqrt() as usize, (k * 10.0).sqrt() as usize, 4, |a, b| {
        let (p, t) = (TAU * a, TAU * b);
        let out = Vector::new((2.0 * t).cos(), (2.0 * t).sin(), 0.0);
        let middle = out * (100.0 + 40.0 * (3.0 * t).cos()) + Vector::Z * (150.0 + 60.0 * (3.0 * t).sin());
        middle + (out * p.cos() + Vector::Z * p.sin()) * (14.0 + 0.5 * (40.0 * t).sin())
    });
    let k = (share(0.3) as f64).sqrt() as usize;
    add_grid(&mut mesh, k, k, 5, |a, b| {
        let (p, t) = (TAU * a, 0.5 * TAU * b);
        Point::new(60.0 * t.sin() * p.cos(), 60.0 * t.sin() * p.sin(), 140.0 + 60.0 * t.cos())
    });
    let ring = |count: u32, r: f64, z: f64| {
        (0..count).map(move |i| {
            let p = TAU * f64::from(i) / f64::from(count);
            Point::new(r * p.cos(), r * p.sin(), z)
        })
    };
    (mesh, ring(8, 200.0, 260.0).chain(ring(4, 5e4, 18_000.0)).collect())
}

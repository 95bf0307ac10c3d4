//! Intersectors that are slow and obviously right, to judge the judge with.

use lampyris::intersect::{Certainty, Cost, Footprint, Hit, Intersector, NormalMode};
use lampyris::math::{Aabb, FaceId, Point, Ray, Uv, Vector, quadratic_roots};
use lampyris::mesh::FacetMesh;
use lampyris::nurbs::conic;
use std::f64::consts::PI;

/// Every facet of a mesh, one after the other (Möller and Trumbore).
pub(crate) struct Brute<'a>(pub(crate) &'a FacetMesh);

impl Intersector for Brute<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        let mut best: Option<Hit> = None;
        for i in 0..self.0.facets.len() {
            facet_hit(self.0, i, ray, NormalMode::Bilinear, &mut best);
        }
        best
    }
    fn footprint(&self) -> Footprint {
        Footprint { primitives: self.0.facets.len(), ..Footprint::default() }
    }
}

fn facet_hit(mesh: &FacetMesh, i: usize, ray: &Ray, normals: NormalMode, best: &mut Option<Hit>) {
    let facet = &mesh.facets[i];
    let corners = mesh.corners(i);
    let vertex = facet.vertices.map(|v| mesh.vertices[v as usize]);
    let triangles: &[[usize; 3]] = if facet.is_triangle() { &[[0, 1, 2]] } else { &[[0, 1, 2], [0, 2, 3]] };
    for &[a, b, c] in triangles {
        let Some((t, v, w)) = triangle(ray, [corners[a], corners[b], corners[c]]) else { continue };
        if t < ray.t_min || t > best.map_or(ray.t_max, |h| h.t) {
            continue;
        }
        // The point that the ray leaves, on whichever facets share it.
        if ray.departure.is_some() && t < 1e-12 * (1.0 + ray.origin.length()) {
            continue;
        }
        // Weights of the corners in the facet's own parameters (0,0), (1,0), (1,1), (0,1).
        let (x, y) = match (facet.is_triangle(), b) {
            (false, 1) => (v + w, w),
            (false, _) => (v, v + w),
            _ => (0.0, 0.0),
        };
        let weight = if facet.is_triangle() {
            [1.0 - v - w, v, w, 0.0]
        } else {
            [(1.0 - x) * (1.0 - y), x * (1.0 - y), x * y, (1.0 - x) * y]
        };
        let flat = (corners[b] - corners[a]).cross(corners[c] - corners[a]).normalize();
        let blend: Vector = (0..4).map(|k| vertex[k].normal * weight[k]).sum();
        *best = Some(Hit {
            t,
            normal: if normals == NormalMode::Flat { flat } else { blend.normalize() },
            geometric_normal: flat,
            face: facet.face,
            primitive: i as u32,
            triangle: None,
            uv: (0..4).map(|k| vertex[k].uv * weight[k]).sum(),
            certainty: Certainty::Facet,
        });
    }
}

fn triangle(ray: &Ray, [a, b, c]: [Point; 3]) -> Option<(f64, f64, f64)> {
    let (e, f) = (b - a, c - a);
    let p = ray.direction.cross(f);
    let det = e.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = ray.origin - a;
    let v = s.dot(p) / det;
    let q = s.cross(e);
    let w = ray.direction.dot(q) / det;
    // A hair of overlap: leaks of this test are none of the cross-check's business.
    let inside = v >= -1e-12 && w >= -1e-12 && v + w <= 1.0 + 1e-12;
    inside.then(|| (f.dot(q) / det, v, w))
}

/// Spheres in closed form, each the one face of its number; parameters as in `nurbs::sweep::sphere` about z.
pub(crate) struct Balls(pub(crate) Vec<(Point, f64)>);

impl Intersector for Balls {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        let mut best: Option<Hit> = None;
        for (i, &(centre, radius)) in self.0.iter().enumerate() {
            let o = ray.origin - centre;
            let b = o.dot(ray.direction);
            let miss = (o - ray.direction * b).length_squared();
            if miss > radius * radius {
                continue;
            }
            let half = (radius * radius - miss).sqrt();
            for t in [-b - half, -b + half] {
                if t < ray.t_min || t > best.map_or(ray.t_max, |h| h.t) {
                    continue;
                }
                let n = (ray.point_at(t) - centre).normalize();
                best = Some(Hit {
                    t,
                    normal: n,
                    geometric_normal: n,
                    face: FaceId(i as u32),
                    primitive: i as u32,
                    triangle: None,
                    uv: sphere_uv(n),
                    certainty: Certainty::Certified,
                });
            }
        }
        best
    }
    fn footprint(&self) -> Footprint {
        Footprint { primitives: self.0.len(), ..Footprint::default() }
    }
}

fn sphere_uv(n: Vector) -> Uv {
    let longitude = n.y.atan2(n.x).rem_euclid(2.0 * PI);
    let latitude = n.z.clamp(-1.0, 1.0).asin();
    Uv::new(
        conic::parameter_of_angle([0.0, 2.0 * PI], longitude),
        conic::parameter_of_angle([-PI / 2.0, PI / 2.0], latitude),
    )
}

/// Another intersector with its answers changed on the way.
pub(crate) struct Changed<'a, F>(pub(crate) &'a dyn Intersector, pub(crate) F);

impl<F: Fn(&Ray, Option<Hit>) -> Option<Hit> + Sync> Intersector for Changed<'_, F> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        (self.1)(ray, self.0.intersect(ray, cost))
    }
    fn footprint(&self) -> Footprint {
        self.0.footprint()
    }
}

/// The same facets as `Brute`, under a median-split tree of boxes, with normals of a kind.
pub(crate) struct Boxes<'a> {
    mesh: &'a FacetMesh,
    normals: NormalMode,
    nodes: Vec<Node>,
    order: Vec<u32>,
    centres: Vec<Point>,
}

struct Node {
    bounds: Aabb,
    /// First facet and count for a leaf; children for an inner node.
    leaf: Option<(usize, usize)>,
    children: [usize; 2],
}

impl<'a> Boxes<'a> {
    pub(crate) fn new(mesh: &'a FacetMesh, normals: NormalMode) -> Self {
        let mut boxes = Self {
            mesh,
            normals,
            nodes: Vec::new(),
            order: (0..mesh.facets.len() as u32).collect(),
            centres: (0..mesh.facets.len()).map(|f| mesh.corners(f).into_iter().sum()).collect(),
        };
        boxes.build(0, mesh.facets.len());
        boxes
    }

    fn build(&mut self, begin: usize, end: usize) -> usize {
        let bounds = Aabb::from_points(self.order[begin..end].iter().flat_map(|&f| self.mesh.corners(f as usize)));
        let at = self.nodes.len();
        let leaf = (end - begin <= 4).then_some((begin, end - begin));
        self.nodes.push(Node { bounds: bounds.grown(1e-9 * (1.0 + bounds.diagonal())), leaf, children: [0; 2] });
        if leaf.is_none() {
            let size = bounds.size();
            let axis = if size.x >= size.y && size.x >= size.z {
                0
            } else if size.y >= size.z {
                1
            } else {
                2
            };
            let centres = &self.centres;
            let key = |f: &u32| centres[*f as usize][axis];
            self.order[begin..end].select_nth_unstable_by((end - begin) / 2, |a, b| key(a).total_cmp(&key(b)));
            let middle = (begin + end) / 2;
            let children = [self.build(begin, middle), self.build(middle, end)];
            self.nodes[at].children = children;
        }
        at
    }
}

impl Intersector for Boxes<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        let mut best: Option<Hit> = None;
        let mut stack = vec![0];
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at];
            let reach = ray.with_range(ray.t_min, best.map_or(ray.t_max, |h| h.t));
            if node.bounds.clip(&reach).is_none() {
                continue;
            }
            match node.leaf {
                None => stack.extend(node.children),
                Some((begin, count)) => {
                    for &f in &self.order[begin..begin + count] {
                        facet_hit(self.mesh, f as usize, ray, self.normals, &mut best);
                    }
                }
            }
        }
        best
    }
    fn footprint(&self) -> Footprint {
        Footprint { primitives: self.mesh.facets.len(), ..Footprint::default() }
    }
}

/// The bowl z = (x² + y²)/4f over a square of that half width, in closed form; the one face, u = x, v = y.
pub(crate) struct Bowl {
    pub(crate) focus: f64,
    pub(crate) half: f64,
}

impl Intersector for Bowl {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        cost.rays += 1;
        let (o, d, f) = (ray.origin, ray.direction, 4.0 * self.focus);
        let a = d.x * d.x + d.y * d.y;
        let b = 2.0 * (o.x * d.x + o.y * d.y) - f * d.z;
        let c = o.x * o.x + o.y * o.y - f * o.z;
        let (near, far) = quadratic_roots(a, b, c);
        let inside = |t: f64| {
            let p = ray.point_at(t);
            t >= ray.t_min && t <= ray.t_max && p.x.abs() <= self.half && p.y.abs() <= self.half
        };
        let t = [near, far].into_iter().flatten().find(|&t| inside(t))?;
        let p = ray.point_at(t);
        let n = Vector::new(-2.0 * p.x / f, -2.0 * p.y / f, 1.0).normalize();
        let uv = Uv::new(p.x, p.y);
        Some(Hit {
            t,
            normal: n,
            geometric_normal: n,
            face: FaceId(0),
            primitive: 0,
            triangle: None,
            uv,
            certainty: Certainty::Certified,
        })
    }
    fn footprint(&self) -> Footprint {
        Footprint { primitives: 1, ..Footprint::default() }
    }
}

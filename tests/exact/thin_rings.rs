//! Which side of its loops a face lies on, where a ring is narrower than what chords of its circles leave out.

use lampyris::intersect::exact::audit::Audit;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::polish::Polished;
use lampyris::intersect::{Certainty, Cost, Intersector};
use lampyris::math::{FaceId, Frame, Point, Ray, Uv, Vector};
use lampyris::mesh::{Facet, FacetMesh, MeshVertex};
use lampyris::model::{EdgeUse, Face, Model, Part, Shell, TrimLoop};
use lampyris::nurbs::{UvCurve, conic, sweep};
use std::f64::consts::TAU;

/// A circle about (5, 5) in so many edges, which runs clockwise when `reversed`.
fn circle(radius: f64, edges: usize, reversed: bool) -> TrimLoop {
    let center = Frame::translation(Vector::new(5.0, 5.0, 0.0));
    let arc = |k: usize| {
        let [a, b] = [k, k + 1].map(|k| TAU * k as f64 / edges as f64);
        let arc = conic::arc(&center, radius, [a, b]);
        // In the plane z = 0 parameters are coordinates.
        let points = arc.points.iter().map(|p| Vector::new(p.x, p.y, p.w)).collect();
        EdgeUse { edge: None, reversed, uv: UvCurve { degree: arc.degree, knots: arc.knots, points } }
    };
    let mut uses: Vec<EdgeUse> = (0..edges).map(arc).collect();
    if reversed {
        uses.reverse();
    }
    TrimLoop { uses }
}

/// A plane of 10 × 10 mm within these loops.
fn plane(loops: Vec<TrimLoop>) -> Model {
    let surface = sweep::plane(&Frame::IDENTITY, [[0.0, 10.0], [0.0, 10.0]]);
    let face = Face { loops, ..Face::whole(surface) };
    Model::from_part(Part { shells: vec![Shell { faces: vec![face], ..Shell::default() }], ..Part::default() })
}

/// Whether the tracer, certified, and the audit find the plane from above at these places.
fn found(model: &Model, places: &[Uv]) -> Vec<[bool; 2]> {
    let (exact, audit) = (Exact::build(model, &Settings::default()), Audit::new(model));
    let ask = |q: &Uv| {
        let ray = Ray::new(Point::new(q.x, q.y, 3.0), -Vector::Z);
        let answer = exact.first(&ray, &mut Cost::default());
        assert_eq!(answer.certainty, Certainty::Certified, "{q}");
        [answer.hit.is_some(), audit.first(&ray).first.is_some()]
    };
    places.iter().map(ask).collect()
}

#[test]
fn a_ring_narrower_than_the_sag_of_its_arcs_is_not_inside_out() {
    let radius = 4.5;
    for width in [2e-3, 5e-4, 2e-4, 1e-5] {
        for [outer, inner] in [[1, 1], [1, 3], [3, 1], [2, 7], [9, 15]] {
            let ring = plane(vec![circle(radius, outer, false), circle(radius - width, inner, true)]);
            // In the hole, outside, and halfway between the circles.
            let at = |r: f64, angle: f64| Uv::splat(5.0) + r * Uv::from_angle(angle);
            let places = [at(1.0, 0.3), at(4.4, 2.0), at(4.7, 4.0), at(6.5, 0.8), at(radius - 0.5 * width, 1.1)];
            let expected = [false, false, false, false, true].map(|on_ring| [on_ring; 2]);
            assert_eq!(found(&ring, &places), expected, "{width} mm, {outer} and {inner} edges");
        }
    }
}

#[test]
fn a_hole_alone_leaves_the_rest_of_the_domain() {
    let places = [Uv::new(5.0, 5.0), Uv::new(1.0, 9.0)];
    assert_eq!(found(&plane(vec![circle(2.0, 3, true)]), &places), [[false; 2], [true; 2]]);
    assert_eq!(found(&plane(vec![circle(2.0, 3, false)]), &places), [[true; 2], [false; 2]]);
}

/// A facet that stands over the hole of a ring leads to no root; whatever is looked for behind it, it was one ray.
#[test]
fn a_ray_past_a_hole_is_polished_as_one_ray() {
    let mut model = plane(vec![circle(4.0, 4, false), circle(2.0, 4, true)]);
    // Of a solid, so that coming out of it from nowhere is in doubt.
    model.parts[0].shells[0].closed = true;
    let exact = Exact::build(&model, &Settings::default());
    let corners = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]].map(|[x, y]| Uv::new(x, y));
    let positions: Vec<Point> = corners.iter().map(|uv| Point::new(uv.x, uv.y, 0.0)).collect();
    let vertices = (0..4).map(|k| MeshVertex { position: k, normal: Vector::Z, uv: corners[k as usize] }).collect();
    let facets = vec![Facet { vertices: [0, 1, 2, 3], face: FaceId(0) }];
    let mesh = FacetMesh { positions, vertices, facets, sag: vec![0.0] };
    let octree = Octree::build(&mesh, &octree::Settings::default());
    let polished = Polished::new(&octree, &mesh, &exact);
    let asked = |x: f64| {
        let mut cost = Cost::default();
        polished.intersect(&Ray::new(Point::new(x, 5.0, -3.0), Vector::Z), &mut cost);
        cost.rays
    };
    assert_eq!([asked(5.0), asked(8.0)], [1, 1]);
}

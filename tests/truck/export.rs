//! Our surfaces evaluated by truck, our faces meshed by truck: an independent program on the same geometry.

use crate::files::{fixture, read_model};
use lampyris::math::{Frame, Point, Uv, Vector};
use lampyris::model::{Face, Model, Part, Shell};
use lampyris::nurbs::{Surface, sweep};
use lampyris::tessellate::{Settings, tessellate};
use lampyris::truck::modeling::{
    ParametricCurve, ParametricSurface, ParametricSurface3D, Point3, Vector3, Vector4,
};
use lampyris::truck::{Conic, Lens, Reflector, baseline, curve_to_truck, faces_to_truck, surface_to_truck};
use std::f64::consts::PI;

fn p(q: Point3) -> Point {
    Point::new(q.x, q.y, q.z)
}

fn v(q: Vector3) -> Vector {
    Vector::new(q.x, q.y, q.z)
}

/// Position, first and second derivatives and the normal against truck's, relative to their sizes.
fn compare(s: &Surface, samples: usize) {
    let t = surface_to_truck(s).unwrap();
    let [[u0, u1], [v0, v1]] = s.domain();
    let size = s.bounds().diagonal();
    for i in 0..samples {
        for j in 0..samples {
            let at = |k: usize, a: f64, b: f64| a + (b - a) * (k as f64 + 0.37) / samples as f64;
            let (x, y) = (at(i, u0, u1), at(j, v0, v1));
            let d = s.second_derivatives(Uv::new(x, y));
            let near =
                |a: Vector, b: Vector, scale: f64| (a - b).length() <= 1e-11 * (scale + a.length().max(b.length()));
            assert!(near(d.point, p(t.subs(x, y)), size));
            // Derivatives scale with the size over the width of a knot span.
            let width = |k: usize| {
                let knots = &s.knots[k];
                knots.windows(2).map(|w| w[1] - w[0]).filter(|w| *w > 0.0).fold(f64::INFINITY, f64::min)
            };
            let (a, b) = (size / width(0), size / width(1));
            assert!(near(d.du, v(t.uder(x, y)), a) && near(d.dv, v(t.vder(x, y)), b));
            assert!(near(d.duv, v(t.uvder(x, y)), a / width(1)));
            // truck 0.5's second derivatives along one parameter lack the factor degree − 1; with it they are right. It
            // belongs to the homogeneous ones, so the quotient rule is applied here.
            let h = t.non_rationalized();
            let second = |hom: [Vector4; 3], degree: usize| {
                let [p0, p1, p2] = hom.map(|q| (Vector::new(q.x, q.y, q.z), q.w));
                let p2 = (p2.0 * (degree - 1) as f64, p2.1 * (degree - 1) as f64);
                let point = p0.0 / p0.1;
                let first = (p1.0 - point * p1.1) / p0.1;
                (p2.0 - first * (2.0 * p1.1) - point * p2.1) / p0.1
            };
            if s.degree[0] > 1 {
                let duu = second([h.subs(x, y), h.uder(x, y), h.uuder(x, y)], s.degree[0]);
                assert!(near(d.duu, duu, a / width(0)), "{} {duu}", d.duu);
            }
            if s.degree[1] > 1 {
                let dvv = second([h.subs(x, y), h.vder(x, y), h.vvder(x, y)], s.degree[1]);
                assert!(near(d.dvv, dvv, b / width(1)), "{} {dvv}", d.dvv);
            }
            if let Some(n) = s.normal(Uv::new(x, y)) {
                // Away from poles and folds, where rounding leaves the normal its digits.
                if d.du.cross(d.dv).length() > 1e-6 * a * b {
                    assert!((n - v(t.normal(x, y))).length() < 1e-8, "{n} {:?}", t.normal(x, y));
                }
            }
        }
    }
}

#[test]
fn truck_evaluates_our_sweeps_as_we_do() {
    let frame = Frame::from_axis(Point::new(1.0, -2.0, 3.0), Vector::new(0.3, 0.2, 1.0), None);
    compare(&sweep::sphere(&frame, 5.0, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]), 17);
    compare(&sweep::torus(&frame, 9.0, 2.5, [0.3, 5.0], [0.0, 2.0 * PI]), 17);
    compare(&sweep::cone(&frame, 4.0, 0.3, [0.0, 2.0], [-1.0, 7.0]), 11);
    compare(&sweep::plane(&frame, [[-3.0, 5.0], [0.0, 1.0]]), 5);
}

#[test]
fn truck_evaluates_surfaces_of_files_as_we_do() {
    let mut surfaces = 0;
    for name in ["lens_asphere_nurbs.stp", "reflector_freeform_trimmed.stp", "lamp_multicavity_inch.stp"] {
        let model = read_model(&fixture("step").join(name)).expect("fixtures are readable");
        for face in model.placed_faces().filter_map(|f| f.face) {
            compare(&face.surface, 7);
            surfaces += 1;
        }
        for edge in model.parts.iter().flat_map(|p| &p.edges) {
            let t = curve_to_truck(&edge.curve).unwrap();
            let [a, b] = edge.curve.domain();
            for k in 0..=20 {
                let s = a + (b - a) * f64::from(k) / 20.0;
                assert!(
                    (edge.curve.evaluate(s) - p(t.subs(s))).length()
                        < 1e-11 * (1.0 + edge.curve.bounds().diagonal())
                );
            }
        }
    }
    assert!(surfaces > 20, "{surfaces}");
}

fn facets_off(model: &Model, tolerance: f64) -> (f64, usize) {
    let made = baseline::mesh(model, tolerance);
    assert!(made.failed.is_empty(), "{:?}", made.failed);
    let faces: Vec<_> = model.placed_faces().collect();
    for vertex in &made.mesh.vertices {
        let facet = made
            .mesh
            .facets
            .iter()
            .find(|f| f.vertices.iter().any(|&k| std::ptr::eq(&made.mesh.vertices[k as usize], vertex)));
        let Some(face) = facet.and_then(|f| faces[f.face.index()].face) else { continue };
        let on = face.surface.evaluate(vertex.uv);
        assert!(
            (on - made.mesh.positions[vertex.position as usize]).length() < 2e-5,
            "truck's uv leads to truck's point"
        );
    }
    (made.mesh.volume(), made.mesh.facets.len())
}

#[test]
fn the_baseline_mesher_closes_a_lens_and_converges_to_its_volume() {
    let lens = Lens { front: Conic::sphere(50.0), back: Conic::sphere(-50.0), thickness: 5.0, half_aperture: 10.0 };
    let model = lens.model("lens").unwrap().model;
    // Two caps of a sphere and the cylinder between.
    let s = 50.0 - (2500.0f64 - 100.0).sqrt();
    let expected = 2.0 * PI * s * s * (150.0 - s) / 3.0 + PI * 100.0 * (5.0 - 2.0 * s);
    let mut last = f64::INFINITY;
    for tolerance in [0.5, 0.1, 0.02] {
        let (volume, facets) = facets_off(&model, tolerance);
        let error = (volume / expected - 1.0).abs();
        assert!(error < last && error < 0.5 * tolerance, "{tolerance}: {error} with {facets} facets");
        last = error;
    }
}

#[test]
fn a_reflector_keeps_its_side_and_a_mirrored_placement_too() {
    let dish = Reflector { shape: Conic::paraboloid(25.0), half_aperture: 40.0, hole: 5.0 };
    let mut model = dish.model("dish").unwrap().model;
    for _ in 0..2 {
        let made = baseline::mesh(&model, 0.1);
        assert!(made.failed.is_empty() && made.seconds > 0.0);
        let focus = model.instances[0].placement.point(Point::new(0.0, 0.0, 25.0));
        for f in &made.mesh.facets {
            let corner = |k: usize| made.mesh.vertices[f.vertices[k] as usize];
            let at = |k: usize| made.mesh.positions[corner(k).position as usize];
            assert!(corner(0).normal.dot(focus - at(0)) > 0.0, "normals face the focus");
        }
        let z = Frame { z: -Vector::Z, ..Frame::IDENTITY };
        model.instances[0].placement = z;
    }
    let whole = sweep::sphere(&Frame::IDENTITY, 1.0, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]);
    let mut part = model.parts[0].clone();
    part.shells[0].faces[0].surface = whole;
    part.shells[0].faces[0].loops.clear();
    let (faces, refused) = faces_to_truck(&part, &Frame::IDENTITY);
    assert_eq!((faces.len(), refused.len(), refused[0].face), (2, 1, 0));
    assert!(refused[0].reason.contains("without edges"));
}

#[test]
fn the_baseline_mesher_takes_every_face_of_files_seams_cut_open() {
    for (name, faces) in
        [("lens_biconvex_nurbs.stp", 3), ("lens_planoconvex_analytic.stp", 3), ("lamp_multicavity.stp", 62)]
    {
        let model = read_model(&fixture("step").join(name)).expect("fixtures are readable");
        let made = baseline::mesh(&model, 0.1);
        assert!(model.placed_face_count() == faces && made.failed.is_empty(), "{name}: {:?}", made.failed);
        // Two meshers that share nothing, ours ten times finer: truck's chords of 0.1 mm leave less than 1 % of the volume.
        let ours = tessellate(&model, &Settings::uniform(0.01)).mesh.volume();
        assert!((made.mesh.volume() / ours - 1.0).abs() < 0.01, "{name}: {} and {ours}", made.mesh.volume());
    }
}

/// truck takes parameters that span less than 1e-6 for a single value and panics: a refusal with a reason instead.
#[test]
fn a_surface_of_a_tiny_domain_is_refused_and_does_not_panic() {
    let corners = [(0.0, 0.0), (0.0, 1e-7), (1.0, 0.0), (1.0, 1e-7)];
    let points = corners.map(|(x, y)| Point::new(x, y, 0.0).extend(1.0)).to_vec();
    let knots = [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 1e-7, 1e-7]];
    let surface = Surface { degree: [1, 1], knots, points };
    assert!(surface_to_truck(&surface).unwrap_err().contains("truck refuses the surface"));
    let shell = Shell { faces: vec![Face::whole(surface)], ..Shell::default() };
    let model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
    let made = baseline::mesh(&model, 0.1);
    assert_eq!((made.failed.len(), made.mesh.facets.len()), (1, 0));
    assert!(made.failed[0].1.contains("truck refuses the surface"), "{}", made.failed[0].1);
}

//! Faces whose loops only cut holes go on to the border of their surface's domain, which on a closed surface is no border in space.

use lampyris::intersect::exact::{self, Exact};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::{Cost, Intersector};
use lampyris::math::{Frame, Homogeneous, Point, Ray, Uv, Vector};
use lampyris::model::{EdgeUse, Face, Model, Part, Shell, TrimLoop};
use lampyris::nurbs::{ControlPoint, Surface, UvCurve, conic, sweep};
use lampyris::tessellate::{Settings, tessellate};
use std::f64::consts::{PI, TAU};

/// A clockwise loop along the sides of a rectangle.
fn rectangle([[u0, u1], [v0, v1]]: [[f64; 2]; 2]) -> TrimLoop {
    let corners = [[u0, v0], [u0, v1], [u1, v1], [u1, v0]].map(Uv::from);
    let side = |k: usize| UvCurve::line(corners[k], corners[(k + 1) % 4], [0.0, 1.0]);
    TrimLoop { uses: (0..4).map(|k| EdgeUse { edge: None, reversed: false, uv: side(k) }).collect() }
}

/// A clockwise circle.
fn circle(center: Uv, radius: f64) -> TrimLoop {
    let arc = conic::arc(&Frame::IDENTITY, radius, [0.0, TAU]);
    let place = |p: &Homogeneous| ControlPoint::weighted(center + p.position().truncate(), p.w);
    let uv = UvCurve { degree: arc.degree, points: arc.points.iter().map(place).collect(), knots: arc.knots };
    TrimLoop { uses: vec![EdgeUse { edge: None, reversed: true, uv }] }
}

/// Compares area, facets and both intersectors with a closed form: `area` in mm², and rays with whether they hit.
fn compare(surface: Surface, holes: Vec<TrimLoop>, area: f64, rays: impl Iterator<Item = (Ray, bool)>) {
    let face = Face { loops: holes, ..Face::whole(surface) };
    assert!((face.area() / area - 1.0).abs() < 1e-5, "{} for {area}", face.area());
    let inner = face.surface.evaluate(face.inner_parameters());
    let part = Part { shells: vec![Shell { faces: vec![face], ..Shell::default() }], ..Part::default() };
    let model = Model::from_part(part);
    let made = tessellate(&model, &Settings::uniform(0.01));
    assert!(made.report.failed.is_empty());
    // Chords of a tolerance of 0.01 on radii of 2 and 5 mm.
    assert!((made.mesh.area() / area - 1.0).abs() < 4e-3, "{} of facets for {area}", made.mesh.area());
    let near = made.mesh.positions.iter().map(|p| p.distance(inner)).fold(f64::INFINITY, f64::min);
    assert!(near < 10.0, "{inner} is beside the face");
    let exact = Exact::build(&model, &exact::Settings::default());
    let octree = Octree::build(&made.mesh, &octree::Settings::default());
    let (mut hits, mut misses) = (0, 0);
    for (ray, expected) in rays {
        for tracer in [&exact as &dyn Intersector, &octree] {
            assert_eq!(tracer.intersect(&ray, &mut Cost::default()).is_some(), expected, "{ray:?}");
        }
        *(if expected { &mut hits } else { &mut misses }) += 1;
    }
    assert!(hits > 500 && misses > 50, "{hits} hits, {misses} misses");
}

#[test]
fn a_plane_with_a_hole_goes_on_to_its_sides() {
    let plane = sweep::plane(&Frame::IDENTITY, [[-5.0, 5.0]; 2]);
    let center = Uv::new(1.0, -0.5);
    let rays = (0..60 * 60).filter_map(move |k| {
        let p = Uv::new(f64::from(k % 60), f64::from(k / 60)) / 5.9 - 5.08;
        let (rim, side) = (p.distance(center) - 2.0, 5.0 - p.abs().max_element());
        let ray = Ray::new(Point::new(p.x, p.y, 3.0), -Vector::Z);
        (rim.abs() > 0.02 && side.abs() > 1e-6).then_some((ray, rim > 0.0 && side > 0.0))
    });
    compare(plane, vec![circle(center, 2.0)], 100.0 - 4.0 * PI, rays);
}

#[test]
fn two_holes_leave_the_rest_of_a_plane() {
    let plane = sweep::plane(&Frame::IDENTITY, [[-5.0, 5.0]; 2]);
    let centers = [Uv::new(-2.0, 0.0), Uv::new(2.5, 1.0)];
    let rays = (0..50 * 50).filter_map(move |k| {
        let p = Uv::new(f64::from(k % 50), f64::from(k / 50)) / 5.0 - 4.9;
        let rim = centers.map(|c| p.distance(c) - 1.0).into_iter().fold(f64::INFINITY, f64::min);
        (rim.abs() > 0.02).then_some((Ray::new(Point::new(p.x, p.y, 3.0), -Vector::Z), rim > 0.0))
    });
    compare(plane, centers.map(|c| circle(c, 1.0)).to_vec(), 100.0 - 2.0 * PI, rays);
}

/// Rays from the middle of a surface about the z axis outward, with whether they meet it beside a hole whose corners are these points.
fn outward(corners: [Point; 2], radial: bool) -> impl Iterator<Item = (Ray, bool)> {
    let [low, high] = corners;
    let angle = |p: Point| p.y.atan2(p.x).rem_euclid(TAU);
    (0..60 * 40).filter_map(move |k| {
        let (phi, z) = (TAU * (f64::from(k % 60) + 0.37) / 60.0, -4.9 + 9.8 * (f64::from(k / 60) + 0.5) / 40.0);
        let around = (phi - angle(low)).min(angle(high) - phi) * 5.0;
        let margin = around.min(z - low.z).min(high.z - z);
        let ray = if radial {
            Ray::new(Point::new(0.0, 0.0, z), Vector::new(phi.cos(), phi.sin(), 0.0))
        } else {
            let r = (25.0 - z * z).sqrt();
            Ray::new(Point::ZERO, Vector::new(r * phi.cos(), r * phi.sin(), z) / 5.0)
        };
        (margin.abs() > 0.1).then_some((ray, margin < 0.0))
    })
}

/// On cylinders and spheres alike a rectangle has the area radius × angle × height (Archimedes).
fn cut_out(corners: [Point; 2]) -> f64 {
    let [low, high] = corners.map(|p| p.y.atan2(p.x).rem_euclid(TAU));
    5.0 * (high - low) * (corners[1].z - corners[0].z)
}

#[test]
fn a_closed_cylinder_and_a_sphere_keep_all_but_their_holes() {
    let cylinder = sweep::cylinder(&Frame::IDENTITY, 5.0, [0.0, TAU], [-5.0, 5.0]);
    let sphere = sweep::sphere(&Frame::IDENTITY, 5.0, [0.0, TAU], [-PI / 2.0, PI / 2.0]);
    for (surface, range, whole, radial) in [
        (cylinder, [[2.0, 4.5], [-2.0, 3.0]], 2.0 * PI * 5.0 * 10.0, true),
        (sphere, [[1.0, 3.0], [-0.4, 0.7]], 4.0 * PI * 25.0, false),
    ] {
        let corners = [0, 1].map(|k: usize| surface.evaluate(Uv::new(range[0][k], range[1][k])));
        let rays = outward(corners, radial);
        compare(surface, vec![rectangle(range)], whole - cut_out(corners), rays);
    }
}

//! Paths with ends in closed form, on facets, on facets polished to the spline and on the spline: a mirror box, a path and its way back,
//! a plate at grazing incidence, the critical angle.

use crate::support::*;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::octree::{self, Octree};
use lampyris::intersect::polish::Polished;
use lampyris::intersect::{Cost, Hit, Intersector};
use lampyris::math::{Frame, Point, Ray, Vector};
use lampyris::model::Model;
use lampyris::nurbs::{Surface, sweep};
use lampyris::optics::{reflect, refract};
use lampyris::tessellate;

/// Asks for a verdict on facets with their own normals, on polished facets and on the spline.
fn on_every_ground(model: &Model, tolerance: f64, verdict: impl Fn(&str, &dyn Intersector)) {
    let exact = Exact::build(model, &Settings::default());
    let settings =
        tessellate::Settings { tolerance: [tolerance; 2], measure: false, ..tessellate::Settings::default() };
    let mesh = tessellate::tessellate(model, &settings).mesh;
    let facets = Octree::build(&mesh, &octree::Settings::default());
    verdict("facets", &facets);
    verdict("polished", &Polished::new(&facets, &mesh, &exact));
    verdict("spline", &exact);
}

fn hit(ground: &dyn Intersector, ray: &Ray) -> Hit {
    ground.intersect(ray, &mut Cost::default()).unwrap_or_else(|| panic!("lost: {ray:?}"))
}

/// The six faces of a box from the origin to `size`.
fn walls(size: Vector) -> Vec<Surface> {
    (0..6)
        .map(|k| {
            let (axis, high) = (k / 2, k % 2 == 1);
            let [a, b] = if high { [(axis + 1) % 3, (axis + 2) % 3] } else { [(axis + 2) % 3, (axis + 1) % 3] };
            let (x, y) = (Vector::AXES[a], Vector::AXES[b]);
            let origin = if high { Vector::AXES[axis] * size[axis] } else { Point::ZERO };
            sweep::plane(&Frame { origin, x, y, z: x.cross(y), scale: 1.0 }, [[0.0, size[a]], [0.0, size[b]]])
        })
        .collect()
}

/// The end of a path in a mirror box, as far from that of the straight line folded back as rounding allows.
fn mirror_box(bounces: usize) {
    let size = Vector::new(10.0, 7.0, 500.0);
    on_every_ground(&model(walls(size)), 0.05, |name, ground| {
        let start = Ray::new(Point::new(3.1, 2.3, 141.0), Vector::new(0.48, 0.6, 0.64));
        let (mut ray, mut way) = (start, 0.0);
        for _ in 0..bounces {
            let hit = hit(ground, &ray);
            way += hit.t;
            let d = reflect(ray.direction, hit.normal);
            ray = Ray::new(ray.point_at(hit.t), d).with_departure(hit.departure());
        }
        let fold = |x: f64, l: f64| {
            let y = x.rem_euclid(2.0 * l);
            if y > l { 2.0 * l - y } else { y }
        };
        let straight = start.point_at(way);
        let end = Point::new(fold(straight.x, size.x), fold(straight.y, size.y), fold(straight.z, size.z));
        // Each bounce rounds the direction by an ulp or two and the place by one of the box: in the mean half the way is left to go.
        let bound = bounces as f64 * f64::EPSILON * (way + size.z);
        let off = ray.origin.distance(end);
        println!("{name}: {off:e} mm off after {bounces} bounces, {bound:e} allowed");
        assert!(off <= bound, "{name}: {off:e} of {bound:e} mm off after {bounces} bounces");
    });
}

#[test]
fn a_mirror_box_folds_a_straight_path() {
    mirror_box(5_000);
}

#[test]
#[ignore = "half a minute"]
fn a_mirror_box_folds_a_long_straight_path() {
    mirror_box(100_000);
}

#[test]
fn a_path_comes_back_the_way_it_went() {
    const BOUNCES: usize = 60;
    for radius in [1e-3, 50.0, 1e4] {
        on_every_ground(&model([sphere(radius)]), 2e-3 * radius, |name, ground| {
            let mut random = Random(5);
            // A ball turns each ray by the same angle: an error of direction adds up with every bounce, it does not multiply.
            let bound = (BOUNCES * BOUNCES) as f64 * 1e-12 * radius;
            for path in 0..20 {
                let start = Ray::new(random.direction() * (0.9 * radius * random.unit()), random.direction());
                let mut ray = start;
                let mut walls = Vec::new();
                for _ in 0..BOUNCES {
                    let hit = hit(ground, &ray);
                    walls.push((hit, ray));
                    ray = Ray::new(ray.point_at(hit.t), reflect(ray.direction, hit.normal))
                        .with_departure(hit.departure());
                }
                let (last, arrival) = walls[BOUNCES - 1];
                let mut back =
                    Ray::new(arrival.point_at(last.t), -arrival.direction).with_departure(last.departure());
                for k in (0..BOUNCES - 1).rev() {
                    let hit = hit(ground, &back);
                    let (there, arrival) = walls[k];
                    let off = back.point_at(hit.t).distance(arrival.point_at(there.t));
                    assert!(off <= bound, "{name}, radius {radius}, path {path}: {off:e} mm beside at wall {k}");
                    back = Ray::new(back.point_at(hit.t), reflect(back.direction, hit.normal))
                        .with_departure(hit.departure());
                }
                let off = (start.origin - back.origin).cross(back.direction).length();
                assert!(off <= bound, "{name}, radius {radius}, path {path}: {off:e} mm beside its start");
            }
        });
    }
}

#[test]
fn a_plate_at_grazing_incidence_shifts_light_as_the_formula_says() {
    let (thick, index): (f64, f64) = (1.0, 1.5);
    let face = |z: f64, up: bool| {
        let (x, y) = if up { (Vector::X, Vector::Y) } else { (Vector::Y, Vector::X) };
        sweep::plane(&Frame { origin: Point::Z * z, x, y, z: x.cross(y), scale: 1.0 }, [[-100.0, 100.0]; 2])
    };
    let plate = model([face(0.0, true), face(-thick, false)]);
    for angle_deg in [0.0, 30.0, 60.0, 89.0, 89.9, 89.99, 89.999] {
        let angle = f64::to_radians(angle_deg);
        let (sin, cos) = (angle.sin(), (90.0 - angle_deg).to_radians().sin());
        let cos = if angle_deg == 0.0 { 1.0 } else { cos };
        let shift = thick * sin * (1.0 - cos / (index * index - sin * sin).sqrt());
        on_every_ground(&plate, 0.05, |name, ground| {
            let d = Vector::new(sin, 0.0, -cos).normalize();
            let origin = Point::new(0.0, 0.3, 0.0) - d * 50.0;
            let ray = Ray::new(origin, d);
            let entry = hit(ground, &ray);
            let inside = refract(d, entry.normal, 1.0 / index).unwrap();
            let within = Ray::new(ray.point_at(entry.t), inside).with_departure(entry.departure());
            let exit = hit(ground, &within);
            let out = refract(inside, -exit.normal, index).unwrap();
            assert!(out.distance(d) < 1e-9, "{name} at {angle_deg}°: {out} for {d}");
            let found = (within.point_at(exit.t) - origin).cross(d).length();
            // The direction is rounded by an ulp, and a start 50 mm away moves the entry by that over the cosine along the ray, which
            // does not count across it.
            assert!((found - shift).abs() < 1e-10, "{name} at {angle_deg}°: {found} for {shift} mm");
        });
    }
}

#[test]
fn light_in_a_glass_ball_is_caught_from_the_critical_angle_on() {
    // A ray that passes the middle at b meets the surface everywhere at a sine of b/R.
    let (radius, index) = (50.0, 1.5);
    on_every_ground(&model([sphere(radius)]), 0.02, |name, ground| {
        // Facets know a normal to some 1e-5, which is not asked for here.
        if name == "facets" {
            return;
        }
        let mut random = Random(9);
        for k in 0..200 {
            let off = [1e-3, 1e-6, 1e-9][k % 3] * if k % 2 == 0 { 1.0 } else { -1.0 };
            let b = radius / index * (1.0 + off);
            let d = random.direction();
            let across = d.cross(random.direction()).normalize();
            let hit = hit(ground, &Ray::new(across * b, d));
            let caught = refract(d, -hit.normal, index).is_none();
            assert_eq!(caught, off > 0.0, "{name}: {off} beyond the critical angle, {hit:?}");
        }
    });
    // A flat wall: facets know its normal as well as the spline does.
    let wall = model([sweep::plane(&Frame::IDENTITY, [[-50.0, 50.0]; 2])]);
    on_every_ground(&wall, 0.05, |name, ground| {
        for off in [1e-3, 1e-6, 1e-9, 1e-11, -1e-3, -1e-6, -1e-9, -1e-11] {
            let sine = (1.0 + off) / index;
            let d = Vector::new(0.6 * sine, 0.8 * sine, (1.0 - sine * sine).sqrt());
            let hit = hit(ground, &Ray::new(Point::new(-1.0, 2.0, -20.0), d));
            assert_eq!(refract(d, -hit.normal, index).is_none(), off > 0.0, "{name}: {off}");
        }
    });
}

//! The exact intersector against spheres, tori and planes in closed form.

use crate::support::*;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::{Certainty, Cost, Intersector};
use lampyris::math::{Homogeneous, Point, Ray, Uv, Vector};
use lampyris::model::{EdgeUse, Face, Model, Part, Shell, TrimLoop};
use lampyris::nurbs::{Surface, UvCurve};

fn build(m: &lampyris::model::Model) -> Exact {
    Exact::build(m, &Settings::default())
}

#[test]
fn random_rays_on_a_sphere() {
    let exact = build(&model([sphere(50.0)]));
    let mut s = Random(1);
    let mut flagged = 0;
    for _ in 0..30_000 {
        let ray = s.ray(Point::ZERO, Vector::splat(50.0));
        let b = ray.origin.dot(ray.direction);
        let closest = (ray.origin - ray.direction * b).length();
        let answer = exact.first(&ray, &mut Cost::default());
        flagged += u32::from(answer.certainty != Certainty::Certified);
        match answer.hit {
            Some(hit) => {
                assert!(closest <= 50.0 + 1e-9);
                assert!((ray.point_at(hit.t).length() - 50.0).abs() < 1e-12, "residual");
                if closest < 49.9 {
                    assert!((hit.t - (-b - (2500.0 - closest * closest).sqrt())).abs() < 1e-10, "the entry");
                    assert!((hit.normal - ray.point_at(hit.t) / 50.0).length() < 1e-12);
                }
            }
            None => assert!(closest >= 50.0 - 1e-12, "missed at {closest}"),
        }
    }
    assert_eq!(flagged, 0);
}

#[test]
fn grazing_a_sphere_is_decided_or_flagged() {
    let exact = build(&model([sphere(50.0)]));
    let mut s = Random(2);
    for k in 0..=12 {
        for sign in [-1.0, 1.0] {
            let delta = if k == 0 { 0.0 } else { sign * 10f64.powi(-k) };
            for _ in 0..100 {
                let d = s.direction();
                let across = d.cross(s.direction()).normalize();
                let ray = Ray::new(across * (50.0 + delta) - d * 150.0, d);
                let true_offset = ray.origin.cross(ray.direction).length() - 50.0;
                let answer = exact.first(&ray, &mut Cost::default());
                if answer.certainty != Certainty::Certified {
                    assert!(true_offset.abs() <= 2e-9, "flagged {:?} at {true_offset}", answer.certainty);
                    continue;
                }
                if true_offset.abs() > 1e-12 {
                    assert_eq!(answer.hit.is_some(), true_offset < 0.0, "at {true_offset}");
                }
                if let Some(hit) = answer.hit {
                    let b = 50.0 + true_offset;
                    let t = 150.0 - ((50.0 - b) * (50.0 + b)).max(0.0).sqrt();
                    // Nearer to the silhouette the truth itself is rounded by more.
                    assert!((hit.t - t).abs() < 1e-6 || true_offset.abs() <= 1e-12, "{} for {t}", hit.t);
                    assert!((ray.point_at(hit.t).length() - 50.0).abs() < 1e-12);
                }
            }
        }
    }
}

#[test]
fn a_ray_that_leaves_a_sphere_finds_the_other_side() {
    let exact = build(&model([sphere(50.0)]));
    let mut s = Random(3);
    let (mut flagged, n) = (0, 20_000);
    for k in 0..n {
        let ray = s.ray(Point::ZERO, Vector::splat(25.0));
        let first = exact.intersect(&ray, &mut Cost::default()).expect("aimed well inside");
        let from = first.departure();
        let mut o = ray.point_at(first.t);
        let inward = -o.normalize();
        // Every third leaves almost along the surface: a chord of 2e-4 to 6 mm.
        let d = if k % 3 == 0 {
            let across = inward.cross(s.direction()).normalize();
            (across + inward * 10f64.powf(s.within(-6.0, -1.3))).normalize()
        } else {
            let d = s.direction();
            if d.dot(inward) < 0.0 { -d } else { d }
        };
        o += s.direction() * 1e-14;
        let ray = Ray::new(o, d).with_departure(from);
        let chord = -2.0 * o.dot(d);
        let answer = exact.first(&ray, &mut Cost::default());
        if answer.certainty != Certainty::Certified {
            flagged += 1;
            continue;
        }
        let hit = answer.hit.unwrap_or_else(|| panic!("lost a chord of {chord}"));
        assert!((hit.t - chord).abs() < 1e-7, "{} for {chord}", hit.t);
    }
    assert!(flagged < n / 1000, "{flagged} flagged");
}

#[test]
fn a_ray_that_leaves_a_sphere_outward_meets_nothing() {
    let exact = build(&model([sphere(50.0)]));
    let mut s = Random(4);
    for _ in 0..20_000 {
        let ray = s.ray(Point::ZERO, Vector::splat(25.0));
        let first = exact.intersect(&ray, &mut Cost::default()).expect("aimed well inside");
        let from = first.departure();
        let o = ray.point_at(first.t) + s.direction() * 1e-14;
        let mut d = s.direction();
        if d.dot(o) < 0.0 {
            d = -d;
        }
        let hit = exact.intersect(&Ray::new(o, d).with_departure(from), &mut Cost::default());
        assert!(hit.is_none(), "{hit:?} at {}", d.dot(o) / 50.0);
    }
}

#[test]
fn crossings_of_a_torus_satisfy_its_equation_and_are_even() {
    for minor in [15.0, 0.01] {
        let exact = build(&model([torus(50.0, minor)]));
        let mut s = Random(5);
        let f = |p: Point| (p.x.hypot(p.y) - 50.0).hypot(p.z) - minor;
        for _ in 0..4_000 {
            let phi = s.within(-3.0, 3.0);
            let target = 50.0 * Vector::new(phi.cos(), phi.sin(), 0.0) + s.direction() * s.within(0.0, 1.4 * minor);
            let d = s.direction();
            let ray = Ray::new(target - d * 200.0, d);
            let hits = exact.crossings(&ray, &mut Cost::default());
            assert!(hits.len().is_multiple_of(2) && hits.len() <= 4, "{} crossings", hits.len());
            for hit in &hits {
                assert!(f(ray.point_at(hit.t)).abs() < 1e-11);
            }
            // Between crossings the sign of the equation does not change.
            let mut edges: Vec<f64> = hits.iter().map(|h| h.t).collect();
            edges.extend([0.0, 400.0]);
            edges.sort_by(f64::total_cmp);
            for (k, pair) in edges.windows(2).enumerate() {
                let width = pair[1] - pair[0];
                for step in 1..20 {
                    let t = pair[0] + width * step as f64 / 20.0;
                    let inside = f(ray.point_at(t)) < 0.0;
                    assert!(
                        inside == (k % 2 == 1) || f(ray.point_at(t)).abs() < 1e-9,
                        "sheet {k} of {}",
                        edges.len()
                    );
                }
            }
            let first = exact.intersect(&ray, &mut Cost::default());
            assert_eq!(first.map(|h| h.t), hits.first().map(|h| h.t));
        }
    }
}

/// A tilted plane a hundred times as large as the square that its loop leaves, and a strip across all three axes.
#[test]
fn rays_far_from_the_trims_and_beside_a_slanted_strip_test_no_leaf() {
    let x = Vector::new(1.0, 1.0, 1.0).normalize();
    let y = x.any_orthonormal_vector();
    let corner = |u: f64, v: f64| Homogeneous::from((x * u + y * v, 1.0));
    let plane = |u: [f64; 2], v: [f64; 2]| Surface {
        degree: [1, 1],
        knots: [vec![u[0], u[0], u[1], u[1]], vec![v[0], v[0], v[1], v[1]]],
        points: vec![corner(u[0], v[0]), corner(u[0], v[1]), corner(u[1], v[0]), corner(u[1], v[1])],
    };
    let square = [[30.0, 30.0], [40.0, 30.0], [40.0, 40.0], [30.0, 40.0]].map(Uv::from);
    let side = |k: usize| EdgeUse {
        edge: None,
        reversed: false,
        uv: UvCurve::line(square[k], square[(k + 1) % 4], [0.0, 1.0]),
    };
    let trimmed = Face {
        loops: vec![TrimLoop { uses: (0..4).map(side).collect() }],
        ..face(plane([-500.0, 500.0], [-500.0, 500.0]))
    };
    let strip = face(plane([-400.0, -100.0], [0.0, 1.0]));
    let part = Part { shells: vec![Shell { faces: vec![trimmed, strip], ..Shell::default() }], ..Part::default() };
    let exact = Exact::build(&Model::from_part(part), &Settings::default());
    let normal = x.cross(y);
    let mut s = Random(5);
    let mut cost = Cost::default();
    for _ in 0..2000 {
        let [u, v] = [s.within(-450.0, 450.0), s.within(-450.0, 450.0)];
        let ray = Ray::new(x * u + y * v - 50.0 * normal, normal);
        let within = |x: f64, [a, b]: [f64; 2]| x > a && x < b;
        let expected = within(u, [30.0, 40.0]) && within(v, [30.0, 40.0])
            || within(u, [-400.0, -100.0]) && within(v, [0.0, 1.0]);
        let hit = exact.first(&ray, &mut cost).hit;
        assert_eq!(hit.is_some(), expected, "{u} {v}");
        assert!(hit.is_none_or(|h| (h.t - 50.0).abs() < 1e-12));
    }
    // Of the 2000, some 10 aim at the square and at the strip; the whole plane in one leaf would be tested 2000 times.
    assert!(cost.tests < 200, "{} tests", cost.tests);
}

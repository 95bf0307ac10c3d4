//! Truck shapes become models that keep what `model` promises: closed loops in the domain with material on the left, edges on their
//! surfaces, normals outward, areas and volumes as the closed forms say.

use lampyris::math::{Uv, Vector};
use lampyris::model::{EdgeUse, Face, Model, TrimLoop};
use lampyris::truck::{self, Conic, Conversion, Lens, Reflector, modeling};
use modeling::{Point3, Rad, Vector3, Wire, builder};
use std::collections::BTreeMap;
use std::f64::consts::PI;

const FULL: Rad<f64> = Rad(7.0);

fn along(u: &EdgeUse, n: usize) -> Vec<Uv> {
    let [t0, t1] = u.uv.domain();
    let at = |k: usize| t0 + (t1 - t0) * k as f64 / n as f64;
    (0..n).map(|k| u.uv.evaluate(at(if u.reversed { n - k } else { k }))).collect()
}

fn outline(l: &TrimLoop) -> Vec<Uv> {
    l.uses.iter().flat_map(|u| along(u, 40)).collect()
}

fn signed_area(points: &[Uv]) -> f64 {
    (0..points.len()).map(|i| points[i].perp_dot(points[(i + 1) % points.len()])).sum::<f64>() * 0.5
}

/// Everything that `model` promises about a face.
fn check_face(model: &Model, face: &Face) {
    let part = &model.parts[0];
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    assert!(face.gap <= 1e-8, "gap {:e}", face.gap);
    for (i, l) in face.loops.iter().enumerate() {
        for (a, b) in l.uses.iter().zip(l.uses.iter().cycle().skip(1)) {
            assert_eq!(a.end(), b.start(), "loops are closed");
        }
        assert_eq!(
            signed_area(&outline(l)) > 0.0,
            i == 0,
            "the outer loop is counter-clockwise, holes are clockwise"
        );
        for u in &l.uses {
            for p in u.uv.points.iter().map(|p| Uv::new(p.x, p.y) / p.z) {
                assert!(p.x >= u0 && p.x <= u1 && p.y >= v0 && p.y <= v1, "loops stay in the domain");
            }
            let [t0, t1] = u.uv.domain();
            for k in 0..=50 {
                let t = t0 + (t1 - t0) * f64::from(k) / 50.0;
                let on = face.surface.evaluate(u.uv.evaluate(t));
                match u.edge {
                    Some(id) => {
                        let edge = &part.edges[id.0 as usize];
                        assert_eq!(edge.curve.domain(), [t0, t1]);
                        assert!((on - edge.curve.evaluate(t)).length() <= face.gap + 1e-9);
                    }
                    None => assert!((on - face.surface.evaluate(u.start())).length() < 1e-9, "a pole is a point"),
                }
            }
        }
    }
}

/// Area and volume of faces that cover their whole domain, by Gauss–Legendre on each knot rectangle.
fn measures(model: &Model) -> (f64, f64) {
    const NODES: [(f64, f64); 5] = [
        (0.0, 128.0 / 225.0),
        (0.5384693101056831, 0.4786286704993665),
        (-0.5384693101056831, 0.4786286704993665),
        (0.906179845938664, 0.23692688505618908),
        (-0.906179845938664, 0.23692688505618908),
    ];
    let (mut area, mut volume) = (0.0, 0.0);
    for face in model.placed_faces().filter_map(|f| f.face) {
        let pieces = |k: usize| {
            let mut b = face.surface.knots[k].clone();
            b.dedup();
            let fine = |p: &[f64]| {
                (0..8).map(|i| [i, i + 1].map(|j| p[0] + (p[1] - p[0]) * f64::from(j) / 8.0)).collect::<Vec<_>>()
            };
            b.windows(2).flat_map(fine).collect::<Vec<[f64; 2]>>()
        };
        let (us, vs) = (pieces(0), pieces(1));
        let sign = if face.reversed { -1.0 } else { 1.0 };
        for [a, b] in &us {
            for [c, d] in &vs {
                for (x, wx) in NODES {
                    for (y, wy) in NODES {
                        let uv = Uv::new(0.5 * (a + b + x * (b - a)), 0.5 * (c + d + y * (d - c)));
                        let s = face.surface.derivatives(uv);
                        let n = s.du.cross(s.dv) * (0.25 * (b - a) * (d - c) * wx * wy);
                        area += n.length();
                        volume += sign * n.dot(s.point) / 3.0;
                    }
                }
            }
        }
    }
    (area, volume)
}

/// Every edge of a closed shell is used twice, in opposite directions as seen from outside.
fn check_closed(model: &Model) {
    let mut uses: BTreeMap<u32, Vec<bool>> = BTreeMap::new();
    for face in model.placed_faces().filter_map(|f| f.face) {
        for u in face.loops.iter().flat_map(|l| &l.uses) {
            if let Some(id) = u.edge {
                uses.entry(id.0).or_default().push(u.reversed != face.reversed);
            }
        }
    }
    for (id, sides) in uses {
        assert_eq!(sides.len(), 2, "edge {id}");
        assert_ne!(sides[0], sides[1], "edge {id} runs both ways");
    }
}

fn check(made: &Conversion, faces: usize) -> (f64, f64) {
    assert!(made.refused.is_empty(), "{:?}", made.refused);
    assert_eq!(made.model.placed_face_count(), faces);
    made.model.placed_faces().filter_map(|f| f.face).for_each(|f| check_face(&made.model, f));
    measures(&made.model)
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * b.abs()
}

#[test]
fn a_block_and_the_same_block_inside_out() {
    let edge = builder::tsweep(&builder::vertex(Point3::new(1.0, 2.0, 3.0)), Vector3::new(10.0, 0.0, 0.0));
    let face = builder::tsweep(&edge, Vector3::new(0.0, 20.0, 0.0));
    let mut solid = builder::tsweep(&face, Vector3::new(0.0, 0.0, 30.0));
    for _ in 0..2 {
        let made = truck::solid("block", &solid);
        let (_, volume) = check(&made, 6);
        assert!(near(volume, 6000.0), "{volume}");
        check_closed(&made.model);
        solid.not();
    }
}

#[test]
fn a_plano_hyperbolic_lens_has_its_volume_and_area() {
    let lens = Lens {
        front: Conic::FLAT,
        back: Conic { radius: -25.0, conic: -2.25 },
        thickness: 8.0,
        half_aperture: 12.0,
    };
    let made = lens.model("lens").unwrap();
    let (_, volume) = check(&made, 9);
    check_closed(&made.model);
    // 2π ∫ (thickness + sag(h)) h dh by Simpson on 2000 steps.
    let height = |h: f64| (8.0 + lens.back.sag(h).unwrap()) * h;
    let n = 2000;
    let sum: f64 = (0..=n)
        .map(|i| {
            let w = if i == 0 || i == n { 1.0 } else { f64::from(2 + 2 * (i as u32 % 2)) };
            w * height(12.0 * i as f64 / n as f64)
        })
        .sum();
    assert!(near(volume, 2.0 * PI * sum * 12.0 / n as f64 / 3.0), "{volume}");
}

#[test]
fn a_ball_made_of_two_caps_is_a_ball() {
    let lens =
        Lens { front: Conic::sphere(5.0), back: Conic::sphere(-5.0), thickness: 10.0 - 1e-3, half_aperture: 4.9 };
    let (_, volume) = check(&lens.model("ball").unwrap(), 9);
    // Two caps of height s and a cylinder between.
    let s = 5.0 - (25.0f64 - 4.9 * 4.9).sqrt();
    let cap = PI * s * s * (15.0 - s) / 3.0;
    let expected = 2.0 * cap + PI * 4.9 * 4.9 * (10.0 - 1e-3 - 2.0 * s);
    assert!(near(volume, expected), "{volume} {expected}");
}

#[test]
fn reflectors_have_the_areas_of_their_conics() {
    let dish = Reflector { shape: Conic::paraboloid(25.0), half_aperture: 60.0, hole: 0.0 };
    let made = dish.model("dish").unwrap();
    // Area of a paraboloid z = h²/4f up to H: 8πf²/3·((1 + H²/4f²)^(3/2) − 1).
    let below = |h: f64| 8.0 * PI * 625.0 / 3.0 * ((1.0 + h * h / 2500.0).powf(1.5) - 1.0);
    let (area, _) = check(&made, 3);
    assert!(near(area, below(60.0)), "{area}");
    let (area, _) = check(&Reflector { hole: 8.0, ..dish }.model("dish").unwrap(), 3);
    assert!(near(area, below(60.0) - below(8.0)), "{area}");
    for face in made.model.placed_faces().filter_map(|f| f.face) {
        let uv = face.surface.clamp(Uv::new(1.0, 0.7));
        let n = face.surface.normal(uv).unwrap() * if face.reversed { -1.0 } else { 1.0 };
        assert!(n.dot(Vector::new(0.0, 0.0, 25.0) - face.surface.evaluate(uv)) > 0.0, "normals face the focus");
    }
    let ellipsoid = Reflector::ellipsoid(50.0, 30.0, 29.0).unwrap();
    assert!((ellipsoid.focus().unwrap() - 10.0).abs() < 1e-12);
    for f in check_points(&ellipsoid.model("ellipsoid").unwrap().model) {
        let to = |z: f64| (f - Vector::new(0.0, 0.0, z)).length();
        assert!((to(10.0) + to(90.0) - 100.0).abs() < 1e-12, "every path is 2a long");
    }
}

fn check_points(model: &Model) -> Vec<Vector> {
    let faces: Vec<&Face> = model.placed_faces().filter_map(|f| f.face).collect();
    let point = |f: &Face, i: usize, j: usize| {
        let [[u0, u1], [v0, v1]] = f.surface.domain();
        f.surface.evaluate(Uv::new(u0 + (u1 - u0) * i as f64 / 20.0, v0 + (v1 - v0) * j as f64 / 20.0))
    };
    faces.iter().flat_map(|f| (0..=20).flat_map(move |i| (0..=20).map(move |j| point(f, i, j)))).collect()
}

#[test]
fn partial_turns_both_ways() {
    let v = builder::vertex(Point3::new(0.5, 0.0, 0.0));
    let wire = builder::rsweep(&v, Point3::new(0.75, 0.0, 0.0), Vector3::unit_y(), FULL);
    let disk = builder::try_attach_plane(&[wire]).unwrap();
    for angle in [2.0f64, 5.0, -2.0, -5.0, 7.0] {
        let torus = builder::rsweep(&disk, Point3::new(0.0, 0.0, 0.0), Vector3::unit_z(), Rad(angle));
        let made = truck::solid("torus", &torus);
        assert!(made.refused.is_empty(), "{angle}: {:?}", made.refused);
        made.model.placed_faces().filter_map(|f| f.face).for_each(|f| check_face(&made.model, f));
        check_closed(&made.model);
        // The plane ends are trimmed disks, and contribute x·n = 0 to the volume about the axis.
        let mut sides = made.model.clone();
        sides.parts[0].shells[0].faces.retain(|f| !matches!(f.analytic, lampyris::model::Analytic::Plane { .. }));
        let turn = angle.abs().min(2.0 * PI);
        let (area, volume) = measures(&sides);
        assert!(near(area, turn * 0.75 * 2.0 * PI * 0.25), "{angle}: {area}");
        assert!(near(volume, turn * 0.75 * PI * 0.0625), "{angle}: {volume}");
    }
}

#[test]
fn a_void_has_normals_into_itself() {
    let cube = |at: f64, side: f64| {
        let edge = builder::tsweep(&builder::vertex(Point3::new(at, at, at)), Vector3::unit_x() * side);
        let face = builder::tsweep(&edge, Vector3::unit_y() * side);
        builder::tsweep(&face, Vector3::unit_z() * side)
    };
    let (outer, inner) = (cube(0.0, 10.0), cube(3.0, 2.0));
    let shells = vec![inner.boundaries()[0].clone(), outer.boundaries()[0].clone()];
    let (_, volume) = check(&truck::solid("hollow", &modeling::Solid::new(shells)), 12);
    assert!(near(volume, 1000.0 - 8.0), "{volume}");
}

#[test]
fn a_lune_from_pole_to_pole_covers_the_right_side() {
    // A half circle from pole to pole, turned by 300° in truck's sectors of 100°.
    let (south, north) =
        (builder::vertex(Point3::new(0.0, 0.0, -2.0)), builder::vertex(Point3::new(0.0, 0.0, 2.0)));
    let wire = Wire::from(vec![builder::circle_arc(&south, &north, Point3::new(2.0, 0.0, 0.0))]);
    let angle = 300f64.to_radians();
    let shell = builder::rsweep(&wire, Point3::new(0.0, 0.0, 0.0), Vector3::unit_z(), Rad(angle));
    let made = truck::shell("lune", &shell);
    let (area, volume) = check(&made, 3);
    assert!(near(area, angle * 2.0 * 4.0), "{area}");
    assert!(near(volume.abs(), angle * 8.0 * 2.0 / 3.0), "{volume}");
}

#[test]
fn a_placed_and_stretched_lens_stays_exact() {
    let lens = Lens { front: Conic::sphere(50.0), back: Conic::sphere(-50.0), thickness: 5.0, half_aperture: 10.0 };
    let straight = measures(&lens.model("lens").unwrap().model).1;
    let turned = builder::rotated(&lens.solid().unwrap(), Point3::new(3.0, 1.0, 0.0), Vector3::unit_x(), Rad(0.7));
    let scaled = builder::scaled(&turned, Point3::new(0.0, 0.0, 0.0), Vector3::new(2.0, 1.0, -3.0));
    let (_, volume) = check(&truck::solid("lens", &scaled), 9);
    assert!(near(volume, 6.0 * straight), "{volume}");
}

#[test]
fn nonsense_is_refused_with_what_to_do() {
    let thin = Lens { front: Conic::sphere(50.0), back: Conic::sphere(-50.0), thickness: 1.0, half_aperture: 20.0 };
    let e = thin.model("thin").unwrap_err().to_string();
    assert!(e.contains("thickness at the rim") && e.contains("thicker"), "{e}");
    // A paraboloid of R = 50 and a sphere of R = 55: by hand 0.25 mm nearer to each other at h² = 525 than on the axis, and apart at the
    // rim.
    let shell = |thickness| Lens {
        front: Conic::paraboloid(25.0),
        back: Conic::sphere(55.0),
        thickness,
        half_aperture: 40.0,
    };
    let e = shell(0.24).solid().unwrap_err().to_string();
    assert!(e.contains("between axis and rim"), "{e}");
    shell(0.26).solid().unwrap();
    assert!(Reflector::ellipsoid(30.0, 50.0, 10.0).is_err());
    assert!(Reflector { shape: Conic::paraboloid(25.0), half_aperture: 5.0, hole: 6.0 }.shell().is_err());
}

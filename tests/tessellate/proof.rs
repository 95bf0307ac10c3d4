//! The bound against sampling: what it costs in facets, how errors converge, and that nothing proved is ever over.

use crate::support::{config, knots};
use lampyris::math::{Frame, Homogeneous, Point, Uv, Vector};
use lampyris::model::{Edge, EdgeId, EdgeUse, Face, Model, Part, Shell, TrimLoop, VertexId};
use lampyris::nurbs::{Curve, Surface, UvCurve, conic, sweep};
use lampyris::tessellate::{Acceptance, Settings, Tessellation, tessellate};
use proptest::prelude::*;
use std::f64::consts::PI;

fn model(surface: Surface, closed: bool) -> Model {
    let face = Face::whole(surface);
    let shell = Shell { faces: vec![face], closed, ..Shell::default() };
    Model::from_part(Part { shells: vec![shell], ..Part::default() })
}

fn sphere() -> Model {
    model(sweep::sphere(&Frame::IDENTITY, 50.0, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]), true)
}

fn torus() -> Model {
    model(sweep::torus(&Frame::IDENTITY, 40.0, 12.0, [0.0, 2.0 * PI], [0.0, 2.0 * PI]), true)
}

/// A bicubic sheet of 100 × 100 mm with waves of two lengths.
fn freeform() -> Model {
    let n = 20;
    let knots: Vec<f64> = (0..n + 4).map(|i| (i as f64 - 3.0).clamp(0.0, (n - 3) as f64)).collect();
    let points = (0..n * n)
        .map(|k| {
            let (x, y) = ((k / n) as f64 / (n - 1) as f64, (k % n) as f64 / (n - 1) as f64);
            let z = 4.0 * (5.0 * x).sin() * (4.0 * y).cos() + 0.8 * (17.0 * x * y).sin();
            Homogeneous::new(100.0 * x, 100.0 * y, z, 1.0)
        })
        .collect();
    model(Surface { degree: [3, 3], knots: [knots.clone(), knots], points }, false)
}

#[test]
fn the_proof_costs_at_most_a_quarter_more_facets_than_sampling() {
    for (name, model) in [("sphere", sphere()), ("torus", torus()), ("freeform", freeform())] {
        let bound = tessellate(&model, &Settings::uniform(0.05));
        let oracle = tessellate(&model, &Settings { acceptance: Acceptance::Sampled, ..Settings::uniform(0.05) });
        let (b, o) = (bound.report.facets, oracle.report.facets);
        println!("{name}: {b} facets by the bound, {o} by sampling");
        assert_eq!(bound.report.certified, b, "{name}");
        assert!(b as f64 <= 1.25 * o as f64, "{name}: {b} against {o}");
    }
}

/// A sheet that is bent in one corner alone: a budget that holds all facets must be enough, wherever they are.
#[test]
fn the_budget_goes_where_it_is_needed() {
    let n = 36;
    let knots: Vec<f64> = (0..n + 4).map(|i| (i as f64 - 3.0).clamp(0.0, (n - 3) as f64)).collect();
    let points = (0..n * n)
        .map(|k| {
            let (i, j) = (k / n, k % n);
            let bump = if i < 6 && j < 6 { if (i + j) % 2 == 0 { 3.0 } else { -3.0 } } else { 0.0 };
            Homogeneous::new(i as f64, j as f64, bump, 1.0)
        })
        .collect();
    let model = model(Surface { degree: [3, 3], knots: [knots.clone(), knots], points }, false);
    let settings = Settings::uniform(0.002);
    let facets = tessellate(&model, &settings).report.facets;
    let made = tessellate(&model, &Settings { budget: facets + facets / 2, ..settings });
    assert_eq!((made.report.facets, made.report.certified), (facets, facets));
}

/// A bowl z = (x² + y²) / 8192 of 8 × 8 mm, 10¹¹ mm from the origin along each axis, where neighbouring numbers are 1.5e-5 mm apart. Its
/// control points are exact there; what is computed between them is not, and no bound may leave that out.
#[test]
fn far_from_the_origin_bounds_hold_the_rounding_of_places() {
    const FAR: f64 = 1e11;
    let place = |i: usize| (FAR + 4.0 * i as f64, if i == 2 { 0.007_812_5 } else { 0.0 });
    let points = (0..9).map(|k| {
        let ((x, up), (y, more)) = (place(k / 3), place(k % 3));
        Homogeneous::new(x, y, FAR + up + more, 1.0)
    });
    let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let bowl = Surface { degree: [2, 2], knots: [knots.clone(), knots], points: points.collect() };
    // By the angle facets are so small that next to nothing is left of their sag.
    let settings = Settings { angle_deg: Some(0.01), ..Settings::uniform(1e-3) };
    let made = tessellate(&model(bowl, false), &settings);
    assert!(made.report.facets > 1000 && made.report.certified == made.report.facets, "{:?}", made.report);
    for (f, &sag) in made.mesh.sag.iter().enumerate() {
        // The difference of near numbers is exact. The bowl is steep by 1/360 at most, so that it is as far as it is high.
        let corners = made.mesh.corners(f).map(|p| p - Point::splat(FAR));
        let off = corners.map(|p| (p.z - (p.x * p.x + p.y * p.y) / 8192.0).abs()).into_iter().fold(0.0, f64::max);
        assert!(sag >= 0.999 * off, "facet {f} is off by {off:e} mm, by its bound {sag:e}");
    }
}

/// Mean angle between the flat triangles and the exact normals at their corners, radians.
fn flat_error(made: &Tessellation) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (f, facet) in made.mesh.facets.iter().enumerate() {
        let [a, b, c, _] = made.mesh.corners(f);
        if let Some(n) = (b - a).cross(c - a).try_normalize() {
            for v in &facet.vertices[..3] {
                sum += n.angle_between(made.mesh.vertices[*v as usize].normal);
                count += 1.0;
            }
        }
    }
    sum / count
}

#[test]
fn normal_errors_converge_as_theory_says() {
    // Bilinear normals err with the square of the facet's size, flat ones with the size, and ξ is the size squared.
    for (name, model) in [("sphere", sphere()), ("torus", torus()), ("freeform", freeform())] {
        let at = |xi: f64| {
            let made = tessellate(&model, &Settings { measure: true, ..Settings::uniform(xi) });
            (made.report.normal_error_deg.unwrap().p50, flat_error(&made))
        };
        let all: Vec<(f64, f64)> = [0.4, 0.2, 0.1, 0.05, 0.025].map(at).into();
        let slope = |a: f64, b: f64| (a / b).log2() / 4.0;
        let ((b0, f0), (b1, f1)) = (all[0], all[4]);
        println!("{name}: {} {} of {all:?}", slope(b0, b1), slope(f0, f1));
        assert!((slope(b0, b1) - 1.0).abs() < 0.1, "{name}: {}", slope(b0, b1));
        assert!((slope(f0, f1) - 0.5).abs() < 0.05, "{name}: {}", slope(f0, f1));
    }
}

fn surfaces() -> impl Strategy<Value = Surface> {
    let side = || (1usize..=5, proptest::collection::vec((any::<u8>(), any::<u8>()), 0..3));
    (side(), side(), proptest::collection::vec((-1f64..1.0, -1f64..1.0, -1f64..1.0, -2f64..2.0), 400)).prop_map(
        |((p, inner_u), (q, inner_v), noise)| {
            let knots = [knots(p, &inner_u), knots(q, &inner_v)];
            let [n, m] = [knots[0].len() - p - 1, knots[1].len() - q - 1];
            let points = (0..n * m)
                .map(|k| {
                    let (x, y) = ((k / m) as f64 / (n - 1) as f64, (k % m) as f64 / (m - 1) as f64);
                    let (a, b, c, e) = noise[k % noise.len()];
                    let at = Point::new(40.0 * x + 2.0 * a, 30.0 * y + 2.0 * b, 4.0 * c);
                    (at * 10f64.powf(e)).extend(10f64.powf(e))
                })
                .collect();
            Surface { degree: [p, q], knots, points }
        },
    )
}

/// Cuts a round hole into the surface; the edge in space is fitted closely.
fn with_hole(surface: Surface) -> Model {
    let [[u0, u1], [v0, v1]] = surface.domain();
    let arc = conic::arc(&Frame::IDENTITY, 1.0, [0.0, 2.0 * PI]);
    let (center, half) = (Uv::new(0.5 * (u0 + u1), 0.45 * (v0 + v1)), Uv::new(u1 - u0, v1 - v0) * 0.27);
    let uv = UvCurve {
        degree: 2,
        knots: arc.knots.clone(),
        points: arc.points.iter().map(|p| (center * p.w + half * Uv::new(p.x, p.y)).extend(p.w)).collect(),
    };
    let ts: Vec<f64> = (0..=2048).map(|i| 2.0 * PI * i as f64 / 2048.0).collect();
    let place = |t: f64| surface.evaluate(uv.evaluate(t));
    let points: Vec<Point> = ts.iter().map(|&t| place(t)).collect();
    let curve = Curve::polyline(&ts, &points);
    let mut m = model(surface.clone(), false);
    let part = &mut m.parts[0];
    part.vertices = vec![points[0]];
    part.edges = vec![Edge { curve, vertices: [VertexId(0); 2], entity: None }];
    let corners = [Uv::new(u0, v0), Uv::new(u1, v0), Uv::new(u1, v1), Uv::new(u0, v1)];
    let rim = (0..4)
        .map(|k| EdgeUse {
            edge: None,
            reversed: false,
            uv: UvCurve::line(corners[k], corners[(k + 1) % 4], [0.0, 1.0]),
        })
        .collect();
    part.shells[0].faces[0].loops = vec![
        TrimLoop { uses: rim },
        TrimLoop { uses: vec![EdgeUse { edge: Some(EdgeId(0)), reversed: true, uv }] },
    ];
    m
}

proptest! {
    #![proptest_config(config(24))]

    /// Whatever is certified stays within its tolerance under dense sampling, and every face gets facets.
    #[test]
    fn certified_facets_are_never_over(surface in surfaces(), hole in any::<bool>()) {
        let model = if hole { with_hole(surface) } else { model(surface, false) };
        let settings = Settings { measure: true, budget: 1500, ..Settings::uniform(1.0) };
        let made = tessellate(&model, &settings);
        let r = &made.report;
        prop_assert_eq!(r.faces.failed, 0);
        prop_assert!(r.over_tolerance.unwrap() <= r.facets - r.certified, "{} over (to {:?}), {} of {} certified", r.over_tolerance.unwrap(), r.sag_mm.sampled_max, r.certified, r.facets);
        prop_assert!(made.mesh.vertices.iter().all(|v| (v.normal.length() - 1.0).abs() < 1e-9 && v.normal != Vector::ZERO));
    }
}

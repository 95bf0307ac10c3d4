//! Borders that were hard to mesh, built here: nothing over its tolerance, everything proved.

use crate::support::judge;
use crate::support::trimmed::{chain, face};
use lampyris::math::{Frame, Point, Uv};
use lampyris::nurbs::{Surface, conic, sweep};
use lampyris::pipeline::angle_note;
use lampyris::tessellate::{GroupedFacets, Settings, Tessellation, tessellate};
use std::collections::HashSet;

fn measured(tolerance: f64) -> Settings {
    Settings { measure: true, ..Settings::uniform(tolerance) }
}

fn assert_proved(made: &Tessellation) {
    let r = &made.report;
    assert_eq!((r.faces.failed, r.faces.repaired), (0, 0));
    assert_eq!(r.over_tolerance, Some(0), "{:?}", r.sag_mm);
    assert_eq!(r.certified, r.facets, "{:?}", r.not_certified);
}

/// A plane cuts a shallow cone in a curve that is nearly straight in space (sag 0.03) but not in angle and height, where its chord
/// runs 0.28 beside it.
#[test]
fn a_chord_that_strays_in_the_parameter_plane_alone_is_divided() {
    let half = 0.075;
    let turn = [-2.0 * half, 2.0 * half];
    let slope = 0.1;
    let cone = sweep::cone(&Frame::IDENTITY, 100.0, f64::atan(1.0 / slope), turn, [-5.0, 10.0]);
    let at = |angle: f64, r: f64| {
        let v = (0..200).fold([-5.0, 10.0], |[lo, hi], _| {
            let m = 0.5 * (lo + hi);
            let p: Point = cone.evaluate(Uv::new(0.0, m));
            if p.x.hypot(p.y) < r { [m, hi] } else { [lo, m] }
        });
        Uv::new(conic::parameter_of_angle(turn, angle), v[0])
    };
    let plane = |f: f64| {
        let angle = half * (1.0 - 2.0 * f);
        at(angle, 100.0 / angle.cos())
    };
    let rim = |f: f64| at(half * (2.0 * f - 1.0), 96.0);
    let loops = vec![vec![
        chain(64, rim),
        chain(1, |f| rim(1.0).lerp(plane(0.0), f)),
        chain(64, plane),
        chain(1, |f| plane(1.0).lerp(rim(0.0), f)),
    ]];
    let made = tessellate(&face(cone, &loops), &measured(0.1));
    assert_proved(&made);
}

/// An edge that the file has 5 mm beside its face: no division closes that gap, so there must be none for its sake.
#[test]
fn a_gap_of_the_file_is_not_divided() {
    let turn = [0.0, 1.0];
    let wall = sweep::cylinder(&Frame::IDENTITY, 50.0, turn, [0.0, 40.0]);
    let c = [Uv::new(0.0, 0.0), Uv::new(1.0, 0.0), Uv::new(1.0, 40.0), Uv::new(0.0, 40.0)];
    let sides = (0..4).map(|k| chain(16, |f| c[k].lerp(c[(k + 1) % 4], f))).collect();
    let mut model = face(wall, &[sides]);
    for p in &mut model.parts[0].edges[0].curve.points[1..16] {
        p.x += 5.0;
    }
    let made = tessellate(&model, &Settings::uniform(0.1));
    assert_eq!(made.report.faces.failed, 0);
    assert!(made.report.facets < 200, "{}", made.report.facets);
}

/// A cylinder cut aslant: with an angle of 4 degrees no triangle of the strip along the cut may turn farther from the normals at its
/// corners.
#[test]
fn the_angle_holds_along_trims_too() {
    let turn = [0.0, 2.0];
    let wall = sweep::cylinder(&Frame::IDENTITY, 50.0, turn, [0.0, 200.0]);
    let aslant = |f: f64| Uv::new(0.1 + 1.8 * f, 20.0 + 90.0 * f + 15.0 * (9.0 * f).sin());
    let (a, b, c, d) = (aslant(0.0), aslant(1.0), Uv::new(1.9, 180.0), Uv::new(0.1, 180.0));
    let line = |n: usize, a: Uv, b: Uv| chain(n, |f| a.lerp(b, f));
    let loops = vec![vec![chain(256, aslant), line(1, b, c), line(256, c, d), line(1, d, a)]];
    let model = face(wall, &loops);
    let most = 4f64;
    let turned = |angle_deg: Option<f64>| {
        let made = tessellate(&model, &Settings { angle_deg, ..measured(2.0) });
        assert_eq!((made.report.faces.failed, made.report.over_tolerance), (0, Some(0)));
        assert_eq!(made.report.over_angle, angle_deg.map(|_| Vec::new()));
        let angles = (0..made.mesh.facets.len()).flat_map(|f| {
            let (p, v) = (made.mesh.corners(f), made.mesh.facets[f].vertices);
            let cuts = if made.mesh.facets[f].is_triangle() { vec![[0, 1, 2]] } else { vec![[0, 1, 2], [0, 2, 3]] };
            let normal = |k: usize| made.mesh.vertices[v[k] as usize].normal;
            let of = |t: [usize; 3]| {
                let n = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]);
                t.into_iter().map(|k| n.angle_between(normal(k)).to_degrees()).fold(0.0, f64::max)
            };
            cuts.into_iter().map(of).collect::<Vec<_>>()
        });
        angles.fold(0.0, f64::max)
    };
    assert!(turned(None) > 2.0 * most);
    assert!(turned(Some(most)) <= most, "{}", turned(Some(most)));
}

/// The same wall with an acute corner, whose facet cannot follow both trims: where the angle is broken the report says so, to the
/// number found from the mesh.
#[test]
fn facets_beyond_the_angle_are_named() {
    let wall = sweep::cylinder(&Frame::IDENTITY, 50.0, [0.0, 2.0], [0.0, 200.0]);
    let c = [Uv::new(0.1, 20.0), Uv::new(1.9, 20.0), Uv::new(1.9, 21.0)];
    let sides = (0..3).map(|k| chain(256, |f| c[k].lerp(c[(k + 1) % 3], f))).collect();
    let model = face(wall, &[sides]);
    for angle in [0.5, 1.0, 4.0] {
        let settings = Settings { angle_deg: Some(angle), ..measured(2.0) };
        let made = tessellate(&model, &settings);
        let mut found = (0, 0f64);
        for (f, facet) in made.mesh.facets.iter().enumerate() {
            let p = made.mesh.corners(f);
            let cuts = if facet.is_triangle() { vec![[0, 1, 2]] } else { vec![[0, 1, 2], [0, 2, 3]] };
            let of = |t: [usize; 3]| {
                let n = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]);
                // The wall's own normals are radial.
                let radial = |q: Point| Point::new(q.x, q.y, 0.0);
                t.into_iter().map(|k| n.angle_between(radial(p[k])).to_degrees()).fold(0.0, f64::max)
            };
            let worst = cuts.into_iter().map(of).fold(0.0, f64::max);
            if worst > angle * (1.0 + 1e-6) {
                found = (found.0 + 1, found.1.max(worst));
            }
        }
        let said = made.report.over_angle.clone().unwrap();
        let sum = said.iter().fold((0, 0f64), |s, x| (s.0 + x.facets, s.1.max(x.largest_deg)));
        assert!(sum.0 == found.0 && (sum.1 - found.1).abs() < 1e-6, "{angle}: {sum:?} {found:?}");
        // A run has the same in a note.
        let facets = GroupedFacets::from(made);
        assert_eq!(facets.facets_over_angle(&model, &settings), (sum.0 > 0).then_some(sum));
        assert_eq!(angle_note(&facets, &model, &settings).is_some(), sum.0 > 0);
    }
}

/// Over a chord the distance to the arc is a parabola, whose mean is two thirds of its top.
#[test]
fn the_mean_sag_of_strips_is_that_of_a_parabola() {
    let wall = sweep::cylinder(&Frame::IDENTITY, 50.0, [0.0, 1.0], [0.0, 200.0]);
    let c = [Uv::new(0.0, 0.0), Uv::new(1.0, 0.0), Uv::new(1.0, 200.0), Uv::new(0.0, 200.0)];
    let sides = (0..4).map(|k| chain([256, 1][k % 2], |f| c[k].lerp(c[(k + 1) % 4], f))).collect();
    let made = tessellate(&face(wall, &[sides]), &measured(0.1));
    assert_proved(&made);
    let sag = &made.report.sag_mm;
    let share = sag.sampled_mean.unwrap() / sag.sampled_max.unwrap();
    assert!((share - 2.0 / 3.0).abs() < 0.02, "{share}");
}

/// A face between an arc and its chord that are nearer to each other than the tolerance still is a face, with a corner on its arc.
#[test]
fn a_face_between_two_chords_gets_a_facet() {
    let plane = sweep::plane(&Frame::IDENTITY, [[-1.0, 1.0], [2.0, 4.0]]);
    let arc = chain(32, |f| Uv::new(0.5 - f, 3.0 + 0.02 * (1.0 - (2.0 * f - 1.0).powi(2))));
    let (a, b) = (arc[0], arc[32]);
    let made = tessellate(&face(plane, &[vec![chain(1, |f| b.lerp(a, f)), arc]]), &measured(0.1));
    assert_proved(&made);
    assert_eq!(made.report.facets, 1);
    // A triangle of base 1 and height 0.02.
    assert!((made.report.area_mm2 - 0.01).abs() < 1e-12, "{}", made.report.area_mm2);
}

/// A hole that touches the outer loop in one place, where the file has a vertex for each of them, the same or a rounding apart: one corner
/// for both, and the lid in the hole has the same.
#[test]
fn loops_that_touch_in_two_vertices_have_one_corner_there() {
    for apart in [0.0, 1e-13] {
        assert_one_corner_where_loops_touch(apart);
    }
}

fn assert_one_corner_where_loops_touch(apart: f64) {
    let wall = sweep::cylinder(&Frame::IDENTITY, 50.0, [0.0, 1.0], [0.0, 60.0]);
    let touch = Uv::new(0.45, 10.0);
    let c = [Uv::new(0.1, 10.0), touch, Uv::new(0.9, 10.0), Uv::new(0.9, 50.0), Uv::new(0.1, 50.0)];
    let outer = (0..5).map(|k| chain(64, |f| c[k].lerp(c[(k + 1) % 5], f))).collect();
    let ring = |f: f64| {
        let (sin, cos) = (std::f64::consts::TAU * if f == 1.0 { 0.0 } else { f }).sin_cos();
        touch + Uv::new(-0.25 * sin, 9.0 - 9.0 * cos)
    };
    let hole = vec![chain(256, ring)];
    let mut model = face(wall, &[outer, hole]);
    let vertices = &mut model.parts[0].vertices;
    let twice = (1..vertices.len()).find(|&k| vertices[..k].contains(&vertices[k])).unwrap();
    vertices[twice] += apart;
    let faces = &mut model.parts[0].shells[0].faces;
    let mut lid = faces[0].clone();
    let mut around = lid.loops[1].clone();
    around.uses[0].reversed = true;
    lid.loops = vec![around];
    faces.push(lid);
    let made = tessellate(&model, &measured(0.1));
    assert_proved(&made);
    let found = judge::judge(&model, &made, 2e-3).unwrap();
    assert_eq!(found.proved, found.facets);
    let sides = |f: usize| {
        let p = made.mesh.corner_positions(f);
        (0..4).map(move |k| [p[k], p[(k + 1) % 4]]).filter(|s| s[0] != s[1])
    };
    let all: HashSet<[u32; 2]> = (0..made.mesh.facets.len()).flat_map(sides).collect();
    let open = all.iter().filter(|s| !all.contains(&[s[1], s[0]]));
    let rim = open.map(|s| s.map(|p| made.mesh.positions[p as usize]));
    // What is open lies on the outer loop: on one of its four sides.
    let level = |p: &Point| [p.z - 10.0, p.z - 50.0, p.y.atan2(p.x) - 0.1, p.y.atan2(p.x) - 0.9];
    for [a, b] in rim {
        let on = level(&a).iter().zip(level(&b)).any(|(x, y)| x.abs().max(y.abs()) < 1e-2);
        assert!(on, "{a} {b}");
    }
}

/// A crescent thinner than the sag of its chords, whose edges are sampled at different places: their chords cross, and only dividing both
/// further takes them apart.
#[test]
fn a_crescent_between_two_arcs_is_divided_on_both_sides() {
    let plane = sweep::plane(&Frame::IDENTITY, [[-20.0, 20.0]; 2]);
    let arc = |height: f64, bend: f64| {
        move |f: f64| {
            // Through (-8, 0) and (8, 0), as high in the middle; `bend` crowds its parameters to one side.
            let f = f + bend * f * (1.0 - f);
            let x = 16.0 * f - 8.0;
            let r = (64.0 + height * height) / (2.0 * height);
            Uv::new(x, (r * r - x * x).sqrt() - (r - height))
        }
    };
    for (low, high, bend) in [(6.0, 6.02, 0.0), (6.0, 6.02, 0.1), (6.0, 6.1, 0.1)] {
        let (a, b) = (chain(2000, arc(low, bend)), chain(2000, |f| arc(high, 0.0)(1.0 - f)));
        let made = tessellate(&face(plane.clone(), &[vec![b, a]]), &measured(0.2));
        assert_proved(&made);
        // Facets turn none of the plane over and cover what lies between the chords of both arcs, which sag no more than 0.2 each.
        let segment = |h: f64| {
            let r = (64.0 + h * h) / (2.0 * h);
            r * r * (8.0 / r).asin() - 8.0 * (r - h)
        };
        let off = (made.report.area_mm2 - (segment(high) - segment(low))).abs();
        assert!(off < 0.2 * 20.0, "{off}");
    }
}

/// Towards the apex of a cone the tolerance tightens, and chords of the rim that hold where they are do not hold for sectors that reach
/// there. Shorter chords make one sector each; places between rim and apex would make several rings.
#[test]
fn the_rim_of_a_cone_is_divided_for_the_tolerance_of_its_apex() {
    let (r, half_angle, wide) = (400.0, 0.6f64, 2.0);
    let cone = sweep::cone(&Frame::IDENTITY, 0.0, half_angle, [0.0, wide], [0.0, r / half_angle.tan()]);
    let [_, [_, top]] = cone.domain();
    let c = [Uv::new(0.0, top), Uv::new(0.0, 0.0), Uv::new(wide, 0.0), Uv::new(wide, top)];
    let sides = (0..4).map(|k| chain([1, 1, 1, 512][k], |f| c[k].lerp(c[(k + 1) % 4], f))).collect();
    let mut model = face(cone, &[sides]);
    // The side that is a point has no edge, and both that end there the same vertex.
    let part = &mut model.parts[0];
    part.shells[0].faces[0].loops[0].uses[1].edge = None;
    part.edges[2].vertices[0] = part.edges[0].vertices[1];
    let made = tessellate(&model, &Settings { measure: true, ..Settings::default() });
    assert_proved(&made);
    // A chord of sag 0.05, the tight tolerance, spans 2 acos(1 - 0.05 / r).
    let sectors = wide / (2.0 * (1.0 - 0.05 / r).acos());
    assert!((made.report.facets as f64) < 2.0 * sectors, "{} facets, {sectors} sectors", made.report.facets);
}

/// A wall of height h(x), its edge below cut level: straight in space, bent as h in the parameter plane, where chords take in what lies
/// below the cut. A facet may reach there as far as its tolerance.
#[test]
fn facets_keep_to_an_edge_that_is_straight_in_space() {
    let (wide, depth, level) = (4.8, 4.0, -0.7);
    let heights = [1.6, -0.9, 2.4, 0.2];
    let rows = (0..)
        .zip(heights)
        .flat_map(|(i, h)| [h - depth, h].map(|z| Point::new(wide * f64::from(i) / 3.0, 0.0, z).extend(1.0)));
    let knots = [vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]];
    let wall = Surface { degree: [3, 1], knots, points: rows.collect() };
    let top = |u: f64| wall.evaluate(Uv::new(u, 1.0)).z;
    let cut = |u: f64| Uv::new(u, 1.0 - (top(u) - level) / depth);
    let loops = vec![vec![
        chain(64, cut),
        chain(1, |f| cut(1.0).lerp(Uv::ONE, f)),
        chain(64, |f| Uv::new(1.0 - f, 1.0)),
        chain(1, |f| Uv::new(0.0, 1.0).lerp(cut(0.0), f)),
    ]];
    for tolerance in [0.2, 0.1, 0.05, 0.02, 0.01] {
        let made = tessellate(&face(wall.clone(), &loops), &measured(tolerance));
        assert_proved(&made);
        let lowest = made.mesh.positions.iter().map(|p| p.z - level).fold(0.0, f64::min);
        assert!(lowest >= -tolerance, "{lowest} at {tolerance}");
    }
}

/// A round of eight pieces runs out into a line and crosses it by 0.6 µm before it ends, as exporters leave it: at tolerances that need
/// them all, one of its samples lies on the wrong side of the line.
#[test]
fn edges_that_cross_beside_a_cusp_by_next_to_nothing_bound_their_face() {
    let plane = sweep::plane(&Frame::IDENTITY, [[-10.0, 10.0]; 2]);
    let round = |f: f64| {
        let (a, b, c) = (3.0 * (1.0 - f) * (1.0 - f) * f, 3.0 * (1.0 - f) * f * f, f * f * f);
        Uv::new(-0.63 * a - 1.25 * b - 1.88 * c, -0.0025 * a + 0.06 * c)
    };
    let [p, q, r] = [round(1.0), Uv::new(-7.0, 3.0), Uv::new(-7.0, 0.0)];
    let line = |a: Uv, b: Uv| chain(1, move |f| a.lerp(b, f));
    let loops = vec![vec![line(r, Uv::ZERO), chain(8, round), line(p, q), line(q, r)]];
    let corners: Vec<Uv> = (0..=8).map(|k| round(f64::from(k) / 8.0)).chain([q, r]).collect();
    let area: f64 = 0.5 * corners.windows(2).map(|w| w[0].perp_dot(w[1])).sum::<f64>();
    for tolerance in [0.05, 0.0032, 0.003, 0.0026] {
        let made = tessellate(&face(plane.clone(), &loops), &measured(tolerance));
        assert_proved(&made);
        assert_eq!(made.report.nonmanifold_edges, 0);
        // Chords of the round, of length 1.9, lie within the tolerance of it.
        let error = (made.report.area_mm2 - area).abs();
        assert!(error <= 1.9 * tolerance, "{} for {area} at {tolerance}", made.report.area_mm2);
    }
}

//! Creases inside one face: each side has its own normals, and no facet lies across.

use crate::support::trimmed;
use lampyris::math::{Frame, Point, Uv};
use lampyris::model::{Face, Model, Part, Shell};
use lampyris::nurbs::{Surface, sweep};
use lampyris::tessellate::{Settings, Tessellation, tessellate};
use std::f64::consts::PI;

fn model(face: Face) -> Model {
    Model::from_part(Part { shells: vec![Shell { faces: vec![face], ..Shell::default() }], ..Part::default() })
}

/// Two quarter pipes of radius 10 around the lines x = -10 and x = 10 in the plane z = 0, 30 mm long, that meet at u = 1 in a cusp.
fn gutter() -> Surface {
    let w = 0.5f64.sqrt();
    let arc = [[-10.0, 10.0, 1.0], [0.0, 10.0, w], [0.0, 0.0, 1.0], [0.0, 10.0, w], [10.0, 10.0, 1.0]];
    let points =
        arc.iter().flat_map(|&[x, z, w]| [0.0, 30.0].map(|y| (Point::new(x, y, z) * w).extend(w))).collect();
    Surface {
        degree: [2, 1],
        knots: [vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0], vec![0.0, 0.0, 1.0, 1.0]],
        points,
    }
}

/// Largest angle between a facet's triangles and the normals at their corners, degrees, and the largest of u's overlap beyond the crease.
fn turned(made: &Tessellation, crease: f64) -> (f64, f64) {
    let (mut angle, mut across) = (0f64, 0f64);
    for (f, facet) in made.mesh.facets.iter().enumerate() {
        let (p, v) = (made.mesh.corners(f), facet.vertices.map(|v| made.mesh.vertices[v as usize]));
        let u = v.map(|v| v.uv.x - crease);
        let (lo, hi) =
            (u.into_iter().fold(f64::INFINITY, f64::min), u.into_iter().fold(f64::NEG_INFINITY, f64::max));
        across = across.max((-lo).min(hi));
        let cuts: &[[usize; 3]] = if facet.is_triangle() { &[[0, 1, 2]] } else { &[[0, 1, 2], [0, 2, 3]] };
        for t in cuts {
            let n = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]);
            angle = t.iter().map(|&k| n.angle_between(v[k].normal).to_degrees()).fold(angle, f64::max);
        }
    }
    (angle, across)
}

#[test]
fn each_side_of_a_crease_has_its_own_normals() {
    for reversed in [false, true] {
        let made = tessellate(&model(Face { reversed, ..Face::whole(gutter()) }), &Settings::uniform(0.02));
        assert_eq!((made.report.faces.failed, made.report.certified), (0, made.report.facets));
        let (angle, across) = turned(&made, 1.0);
        // A chord of sag s on radius r turns by acos(1 - s / r) from the normals at its ends.
        let most = (1.0 - 0.02 / 10.0f64).acos().to_degrees();
        assert!(angle <= most + 1e-9 && across < 1e-9, "reversed {reversed}: {angle} of {most}, {across}");
        // Seen from the arc's axis the normals are radial, on both sides.
        for v in &made.mesh.vertices {
            let p = made.mesh.positions[v.position as usize];
            let radial = |x: f64| Point::new(p.x - x, 0.0, p.z).normalize().cross(v.normal).length();
            assert!(radial(-10.0).min(radial(10.0)) < 1e-9, "{p:?} {:?}", v.normal);
        }
    }
}

/// A roof of two planes, trimmed by its own rim: two facets and no rounding of the ridge.
#[test]
fn a_roof_keeps_its_ridge() {
    let points = [[-4.0, 0.0], [0.0, 3.0], [4.0, 0.0]];
    let points = points.iter().flat_map(|&[x, z]| [0.0, 10.0].map(|y| Point::new(x, y, z).extend(1.0))).collect();
    let knots = [vec![0.0, 0.0, 1.0, 2.0, 2.0], vec![0.0, 0.0, 1.0, 1.0]];
    let made = tessellate(&model(Face::whole(Surface { degree: [1, 1], knots, points })), &Settings::default());
    assert_eq!((made.report.facets, made.report.certified), (2, 2));
    let (angle, across) = turned(&made, 1.0);
    assert!(angle < 1e-9 && across == 0.0, "{angle} {across}");
    assert_eq!(made.mesh.vertices.len(), 8);
    assert_eq!(made.mesh.positions.len(), 6);
}

/// At the apex of a cone each facet has the normal of its own middle (up to the uneven parameter): all of them lean by the half angle.
#[test]
fn the_apex_of_a_cone_has_a_normal_for_each_facet() {
    let half = 0.4f64;
    let cone = sweep::cone(&Frame::IDENTITY, 10.0 * half.tan(), half, [0.0, 2.0 * PI], [-10.0, 0.0]);
    let made = tessellate(&model(Face::whole(cone)), &Settings::uniform(0.05));
    let apex = Point::new(0.0, 0.0, -10.0);
    let mut found = 0;
    for facet in &made.mesh.facets {
        let v = facet.vertices.map(|v| made.mesh.vertices[v as usize]);
        for tip in v.iter().filter(|v| (made.mesh.positions[v.position as usize] - apex).length() < 1e-9) {
            found += 1;
            assert!((tip.normal.z + half.sin()).abs() < 1e-9, "{:?}", tip.normal);
            let others: Point = v.iter().map(|v| made.mesh.positions[v.position as usize] - apex).sum();
            let angle = tip.normal.truncate().angle_to(others.truncate()).abs();
            assert!(angle < 1e-3, "{angle}");
        }
    }
    assert!(found >= 8, "{found}");
}

/// The same pipes inside an ellipse of parameters, whose edges have a point on the crease or cross it between two: strips along the
/// whole border, and still nothing across the crease.
#[test]
fn strips_do_not_cross_creases() {
    for centre in [1.0, 0.97] {
        let rim = |f: f64| {
            let (sin, cos) = (2.0 * PI * f).sin_cos();
            Uv::new(centre + 0.8 * cos, 0.52 + 0.4 * sin)
        };
        let quarter = |k: usize| trimmed::chain(64, move |f| rim(0.25 * (k as f64 + f) + 0.125));
        let model = trimmed::face(gutter(), &[(0..4).map(quarter).collect()]);
        let made = tessellate(&model, &Settings { measure: true, ..Settings::uniform(0.05) });
        let r = &made.report;
        assert_eq!((r.faces.failed, r.faces.repaired), (0, 0));
        let (angle, across) = turned(&made, 1.0);
        assert!(across < 1e-7, "{centre}: {across}");
        // Between two points the edge lies beside the cusp, and the facets there with it.
        if centre == 1.0 {
            assert_eq!((r.over_tolerance, r.certified), (Some(0), r.facets));
            // The normals on either side differ by 180°.
            assert!(angle < 45.0, "{angle}");
        }
    }
}

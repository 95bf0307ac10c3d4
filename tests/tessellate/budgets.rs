//! Faces that need more cells than they may have.

use crate::support::trimmed::{chain, face};
use lampyris::math::{Frame, Homogeneous, Uv};
use lampyris::model::{Face, Model, Part, Shell};
use lampyris::nurbs::{Surface, sweep};
use lampyris::tessellate::{Repair, Settings, tessellate};
use std::f64::consts::{PI, TAU};

/// The bowl z = (x² + y²) / 100 mm over 100 mm each way, a circle of 90 mm of it.
fn round_bowl() -> Model {
    // Control values of (100 t − 50)² along one direction.
    let square = [2500.0, -2500.0, 2500.0];
    let points = [0, 1, 2].map(|i| {
        [0, 1, 2].map(|j| Homogeneous::new(50.0 * i as f64, 50.0 * j as f64, 0.01 * (square[i] + square[j]), 1.0))
    });
    let knots = [vec![0.0; 3], vec![1.0; 3]].concat();
    let surface = Surface { degree: [2, 2], knots: [knots.clone(), knots], points: points.as_flattened().to_vec() };
    let on_circle = |t: f64| Uv::splat(0.5) + 0.45 * Uv::from_angle(TAU * t);
    face(surface, &[vec![chain(300, |t| on_circle(0.5 * t)), chain(300, |t| on_circle(0.5 + 0.5 * t))]])
}

/// However many cells the face may have: where its facets do not all hold, the report says so.
#[test]
fn a_face_whose_budget_ended_is_named() {
    let model = round_bowl();
    let mut named = [0; 2];
    for budget in (10..400).step_by(10) {
        let made = tessellate(&model, &Settings { budget, ..Settings::uniform(0.1) });
        let report = &made.report;
        let is_whole = report.certified == report.facets;
        let repairs: Vec<Repair> = report.repaired.iter().map(|r| r.how).collect();
        assert_eq!(repairs, if is_whole { vec![] } else { vec![Repair::CoarserCells] }, "{budget}");
        named[usize::from(is_whole)] += 1;
    }
    assert!(named.into_iter().all(|count| count > 0), "{named:?}");
}

/// A ring of 5 m has the cells that the loosest default tolerance takes: halving makes 4.2 times what chords of the full sag would be.
#[test]
fn a_large_torus_is_held_to_the_default_tolerance() {
    let ring = Face::whole(sweep::torus(&Frame::IDENTITY, 2000.0, 500.0, [0.0, TAU], [0.0, TAU]));
    let shell = Shell { faces: vec![ring], closed: true, ..Shell::default() };
    let model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
    let report = tessellate(&model, &Settings { measure: false, ..Settings::uniform(0.2) }).report;
    assert!(
        report.repaired.is_empty() && report.certified == report.facets,
        "{} of {}",
        report.certified,
        report.facets
    );
}

/// However small an angle is asked for: facets get the least that their number allows, and none stands upright where the budget would have
/// ended beside fine ones.
#[test]
fn an_angle_beyond_the_budget_leaves_the_surface_smooth() {
    let model = round_bowl();
    // Of z = r² / 100 within 45 mm.
    let area = PI / (6.0 * 1e-4) * ((1.0 + 4e-4 * 45.0 * 45.0f64).powf(1.5) - 1.0);
    for (angle, budget) in [(0.5, 20_000), (0.02, 20_000), (1e-9, 20_000)] {
        let made = tessellate(
            &model,
            &Settings { angle_deg: Some(angle), budget, measure: true, ..Settings::uniform(0.2) },
        );
        let report = &made.report;
        assert!((report.area_mm2 / area - 1.0).abs() < 2e-3, "{angle}: {} {area}", report.area_mm2);
        assert!(report.facets < 2 * budget && report.repaired.is_empty(), "{angle}: {}", report.facets);
        let steep = &report.over_angle.as_ref().unwrap()[0];
        assert!(steep.largest_deg < 5.0, "{angle}: {}", steep.largest_deg);
    }
}

/// Along a cusp, the curve (s², s³) drawn out, normals turn around within nothing: no cell is small enough for an angle there, and the tolerance holds
/// all the same.
#[test]
fn an_angle_that_no_cell_reaches_costs_no_tolerance() {
    let (scale, length) = (4.0, 20.0);
    // Control values of s² and s³ for s from −1 to 1.5.
    let profile = [[1.0, -1.0], [-2.0 / 3.0, 1.5], [-0.25, -2.25], [2.25, 3.375]];
    let row = |[x, z]: [f64; 2]| [0.0, length].map(|y| Homogeneous::new(scale * x, y, scale * z, 1.0));
    let knots = |degree: usize| [vec![0.0; degree + 1], vec![1.0; degree + 1]].concat();
    let points = profile.map(row).as_flattened().to_vec();
    let surface = Surface { degree: [3, 1], knots: [knots(3), knots(1)], points };
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Uv::from_array);
    let side = |k: usize| chain(200, |t| corners[k].lerp(corners[(k + 1) % 4], t));
    let model = face(surface, &[(0..4).map(side).collect()]);
    let made = tessellate(&model, &Settings { angle_deg: Some(5.0), measure: true, ..Settings::uniform(0.1) });
    let report = &made.report;
    assert!(report.repaired.is_empty(), "{:?}", report.repaired);
    assert!(report.certified == report.facets && report.facets < 5000, "{}", report.facets);
    assert_eq!(report.over_angle.as_ref().map(Vec::len), Some(1));
    // ∫ |s| √(4 + 9 s²) ds, to 0 from each side.
    let half = |s: f64| ((4.0 + 9.0 * s * s).powf(1.5) - 8.0) / 27.0;
    let area = scale * length * (half(1.0) + half(1.5));
    assert!((report.area_mm2 / area - 1.0).abs() < 1e-3, "{} {area}", report.area_mm2);
}

/// The patch z = x y / 100 + x² / 2R over 40 mm each way, with the curvature 1 / R along x, between its four sides.
fn twisted_patch(curvature: f64) -> Model {
    let side = 40.0;
    // Control values of x² are 0, 0 and side².
    let row = |x: f64, square: f64| {
        [0.0, side].map(|y| Homogeneous::new(x, y, 0.01 * x * y + 0.5 * curvature * square, 1.0))
    };
    let points = [row(0.0, 0.0), row(0.5 * side, 0.0), row(side, side * side)].as_flattened().to_vec();
    let knots = [[vec![0.0; 3], vec![1.0; 3]].concat(), vec![0.0, 0.0, 1.0, 1.0]];
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Uv::from_array);
    let chords = |k: usize| if k.is_multiple_of(2) && curvature > 0.0 { 200 } else { 1 };
    let sides = (0..4).map(|k| chain(chords(k), |t| corners[k].lerp(corners[(k + 1) % 4], t))).collect();
    face(Surface { degree: [2, 1], knots, points }, &[sides])
}

/// Along the straight lines of a hyperbolic paraboloid normals turn though nothing sags: by h / c from end to end of h mm, at most, and a
/// facet has the normal of one end, so that squares of the side c a, and no larger, keep the angle a.
#[test]
fn a_twisted_face_keeps_its_angle_along_straight_edges_too() {
    let model = twisted_patch(0.0);
    for angle in [5.0f64, 2.0] {
        let made = tessellate(&model, &Settings { angle_deg: Some(angle), ..Settings::uniform(2.0) });
        let report = &made.report;
        assert_eq!(report.over_angle, Some(vec![]), "{angle}");
        assert!(report.certified == report.facets && report.repaired.is_empty(), "{angle}");
        let squares = (40.0 / (100.0 * angle.to_radians())).powi(2);
        // Where the face is steep normals turn less, by 1 / 1.3; halving makes up to four of one, and a square is two triangles at most.
        let facets = report.facets as f64;
        assert!(facets > 0.3 * squares && facets < 8.0 * squares, "{angle}: {facets} of {squares}");
    }
}

/// A square cut out of it aslant, by 5° from its straight lines: its sides bend so little that for their sag alone a few chords would do,
/// on which facets stood upright beside finer ones.
#[test]
fn no_facet_stands_upright_on_a_slightly_bent_edge_of_a_twisted_face() {
    let whole = twisted_patch(0.0);
    let surface = whole.parts[0].shells[0].faces[0].surface.clone();
    let aslant = 5f64.to_radians();
    let corner = |k: usize| Uv::splat(0.5) + 0.5 * Uv::from_angle(0.5 * PI * (k % 4) as f64 + 0.25 * PI + aslant);
    let sides = (0..4).map(|k| chain(200, |t| corner(k).lerp(corner(k + 1), t))).collect();
    let model = face(surface, &[sides]);
    let angle = 2.0;
    let report = tessellate(&model, &Settings { angle_deg: Some(angle), ..Settings::uniform(2.0) }).report;
    assert!(report.certified == report.facets && report.repaired.is_empty());
    let largest = report.over_angle.unwrap().iter().map(|s| s.largest_deg).fold(0.0, f64::max);
    assert!(largest < 4.0 * angle && report.facets < 5000, "{largest} {}", report.facets);
}

/// A strip that bends along x and twists about y: cut along its straight lines alone, it would have no facet within the angle, however
/// many.
#[test]
fn a_strip_that_bends_and_twists_is_cut_across_too() {
    let model = twisted_patch(0.01);
    let settings = Settings { angle_deg: Some(5.0), ..Settings::uniform(2.0) };
    let report = tessellate(&model, &settings).report;
    let steep: usize = report.over_angle.unwrap().iter().map(|s| s.facets).sum();
    assert!(report.facets > 15 && report.facets < 1000, "{}", report.facets);
    assert!(5 * steep < report.facets, "{steep} of {}", report.facets);
}

/// A flat sheet with one sharp bump, which hides in the sharpest tenth that is left out of what is foretold: the bump is meshed for its
/// angle as far as the budget goes, not for the tolerance alone, for which two facets do. Its steepest slope is 5 · (2/3)² = 2.2, or 66°.
#[test]
fn a_sharp_place_that_nothing_foretells_is_meshed_for_its_angle() {
    const N: usize = 30;
    let knots = [vec![0.0; 3], (0..=N - 3).map(|k| k as f64).collect(), vec![(N - 3) as f64; 3]].concat();
    let height = |i: usize, j: usize| if (i, j) == (15, 15) { 5.0 } else { 0.0 };
    let rows = (0..N).map(|i| (0..N).map(move |j| Homogeneous::new(i as f64, j as f64, height(i, j), 1.0)));
    let surface = Surface { degree: [3, 3], knots: [knots.clone(), knots], points: rows.flatten().collect() };
    let far = (N - 3) as f64;
    let corners = [[0.0, 0.0], [far, 0.0], [far, far], [0.0, far]].map(Uv::from_array);
    let side = |k: usize| chain(100, |t| corners[k].lerp(corners[(k + 1) % 4], t));
    let model = face(surface, &[(0..4).map(side).collect()]);
    let made = |angle_deg| tessellate(&model, &Settings { angle_deg, ..Settings::uniform(2.0) }).report;
    assert_eq!(made(None).facets, 2);
    let report = made(Some(0.2));
    assert!(report.facets > 1000 && report.repaired.is_empty(), "{} {:?}", report.facets, report.repaired);
    assert!(report.over_angle.unwrap()[0].largest_deg < 15.0);
}

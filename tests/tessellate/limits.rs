//! Faces that would cost more than any model may: they are left out by name, and the rest is meshed.

use lampyris::math::{Frame, Point};
use lampyris::model::{Face, Model, Part, Shell};
use lampyris::nurbs::{Surface, sweep};
use lampyris::tessellate::{FailureCause, GroupedFacets, Settings, tessellate};
use std::f64::consts::{FRAC_PI_2, PI};

fn ball(radius: f64) -> Face {
    Face::whole(sweep::sphere(&Frame::IDENTITY, radius, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2]))
}

fn model(faces: Vec<Face>) -> Model {
    Model::from_part(Part { shells: vec![Shell { faces, ..Shell::default() }], ..Part::default() })
}

#[test]
fn a_ball_of_a_million_kilometres_is_left_out_and_the_rest_is_meshed() {
    let made = tessellate(&model(vec![ball(10.0), ball(5e9), ball(20.0)]), &Settings::uniform(0.2));
    assert_eq!(made.report.faces.meshed, 2);
    let [failed] = made.report.failed[..] else { panic!("{:?}", made.report.failed) };
    assert_eq!(failed.face, 1);
    // 4πR² in squares of which each sags by the tolerance: πR / 2ξ of them.
    let FailureCause::TooManyFacets(count) = failed.cause else { panic!("{:?}", failed.cause) };
    let exact = FRAC_PI_2 * 5e9 / 0.2;
    assert!(count > 0.5 * exact && count < exact, "{count} {exact}");
    // At a tolerance that fits its size it is a ball like any other.
    let made = tessellate(&model(vec![ball(5e9)]), &Settings::uniform(1e8));
    assert_eq!((made.report.faces.meshed, made.report.certified), (1, made.report.facets));
}

#[test]
fn of_a_model_that_needs_too_much_the_largest_face_goes_first() {
    let settings = Settings { most_cells: 100_000, ..Settings::uniform(0.01) };
    // Some 235,000, 47,000 and 39,000 cells.
    let made = tessellate(&model(vec![ball(300.0), ball(1500.0), ball(250.0)]), &settings);
    let failed: Vec<u32> = made.report.failed.iter().map(|f| f.face).collect();
    assert_eq!(failed, [1]);
}

/// A patch of degree 25 in both directions whose control points go up and down by 100 mm.
fn wild() -> Surface {
    let n = 26;
    let height = |k: usize| 100.0 * ((k * k * 7919 + k * 104_729) % 201) as f64 / 100.0 - 100.0;
    let points = (0..n * n).map(|k| Point::new((k / n) as f64, (k % n) as f64, height(k)).extend(1.0)).collect();
    let knots = || [vec![0.0; n], vec![1.0; n]].concat();
    Surface { degree: [n - 1; 2], knots: [knots(), knots()], points }
}

#[test]
fn a_wild_patch_ends_with_its_steps_on_any_number_of_threads() {
    let settings = Settings { most_steps: 20_000_000, ..Settings::uniform(0.01) };
    let wild = model(vec![Face::whole(wild()), ball(10.0)]);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| tessellate(&wild, &settings))
    };
    let [one, four] = [on(1), on(4)];
    let [failed] = one.report.failed[..] else { panic!("{:?}", one.report.failed) };
    assert_eq!((failed.face, failed.cause), (0, FailureCause::TooManySteps));
    assert_eq!((one.report.failed, one.mesh.facets.len()), (four.report.failed, four.mesh.facets.len()));
}

/// In a model of two faces a ball of 100 m is no part that anyone meant.
#[test]
fn a_face_may_need_what_follows_the_size_of_its_model() {
    let made = tessellate(&model(vec![ball(1e5), ball(10.0)]), &Settings::uniform(0.2));
    let [failed] = made.report.failed[..] else { panic!("{:?}", made.report.failed) };
    assert!(failed.face == 0 && matches!(failed.cause, FailureCause::TooManyFacets(_)), "{failed:?}");
}

/// The tips that OpenVSP closes wings with: patches of which all corners, or two and two, are the same. Rounding made 19,000 triangles of
/// the first, of 3e-21 mm² together, and the second was counted as missing.
#[test]
fn a_face_that_is_a_point_or_a_line_has_no_facets_and_is_not_missing() {
    let tip = Point::new(4985.8, 0.0, 3340.6);
    let patch = |other: Point| {
        let knots = || vec![0.0, 0.0, 1.0, 1.0];
        let points = [tip, tip, other, other].map(|p| p.extend(1.0)).to_vec();
        Face::whole(Surface { degree: [1; 2], knots: [knots(), knots()], points })
    };
    let wing = model(vec![patch(tip), patch(Point::ZERO), ball(10.0)]);
    let made = tessellate(&wing, &Settings::uniform(1.0));
    let failed: Vec<(u32, FailureCause)> = made.report.failed.iter().map(|f| (f.face, f.cause)).collect();
    assert_eq!(failed, [(0, FailureCause::NoArea), (1, FailureCause::NoArea)]);
    assert_eq!((made.report.faces.meshed, made.report.missing_faces()), (1, 0));
    assert_eq!(GroupedFacets::from(made).faces_without_facets(&wing), 0);
}

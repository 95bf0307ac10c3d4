//! Curved faces of two solids that lie on each other have one and the same facets there, whatever their parametrisations.

use crate::turned::{ball_in_cup, doublet, ring_in_groove, rod_in_hole, rod_in_plate};
use lampyris::math::{FaceId, Point};
use lampyris::model::Model;
use lampyris::tessellate::{Settings, Tessellation, ToleranceOverride, ToleranceScope, tessellate};
use std::f64::consts::PI;

/// The corners of a facet, each once, in an order that does not depend on where it starts.
fn corners(made: &Tessellation, facet: usize) -> Vec<Point> {
    let mut p = made.mesh.corners(facet).to_vec();
    p.dedup();
    p
}

/// Whether two facets have the same corners.
fn same(a: &[Point], b: &[Point]) -> bool {
    a.len() == b.len() && a.iter().all(|p| b.iter().any(|q| (*p - *q).length() < 1e-9))
}

/// Facets of a face.
fn facets_of(made: &Tessellation, face: u32) -> Vec<Vec<Point>> {
    let all = 0..made.mesh.facets.len();
    all.filter(|&f| made.mesh.facets[f].face == FaceId(face)).map(|f| corners(made, f)).collect()
}

/// Checks that each facet of `guest` is one of `carrier`, that nothing is left open and that all is proved.
fn check(name: &str, model: &Model, [carrier, guest]: [u32; 2]) {
    let settings = Settings { glue_mm: 1e-3, measure: true, ..Settings::default() };
    let made = tessellate(model, &settings);
    let r = &made.report;
    assert_eq!((r.open_edges, r.nonmanifold_edges, r.shells.open), (0, 0, 0), "{name}");
    assert_eq!((r.certified, r.over_tolerance), (r.facets, Some(0)), "{name}: {:?}", r.not_certified);
    let [on, of] = [carrier, guest].map(|face| facets_of(&made, face));
    let missing = of.iter().filter(|f| !on.iter().any(|g| same(f, g))).count();
    assert!(!of.is_empty() && missing == 0, "{name}: {missing} of {} facets are the guest's alone", of.len());
    // Apart, hardly a facet is shared: this is not so by chance.
    let apart = tessellate(model, &Settings { glue_mm: 0.0, ..settings });
    let [on, of] = [carrier, guest].map(|face| facets_of(&apart, face));
    let shared = of.iter().filter(|f| on.iter().any(|g| same(f, g))).count();
    assert!(2 * shared < of.len(), "{name}: {shared} of {}", of.len());
}

#[test]
fn a_cemented_doublet_has_one_interface() {
    check("same aperture", &doublet(12.0, 0.7), [2, 3]);
    check("smaller second lens", &doublet(10.0, 0.7), [2, 3]);
}

#[test]
fn a_rod_has_the_facets_of_its_hole() {
    check("rod", &rod_in_hole(0.4), [1, 6]);
}

#[test]
fn a_ball_has_the_facets_of_its_cup() {
    check("ball", &ball_in_cup(1.1), [0, 4]);
}

#[test]
fn a_ring_has_the_facets_of_its_groove() {
    for from in [0.0, 0.9] {
        check("ring", &ring_in_groove(from), [0, 6]);
    }
}

#[test]
fn solids_that_do_not_touch_are_faceted_as_they_were() {
    let mut model = doublet(12.0, 0.7);
    model.instances[1].placement.origin.z += 0.01;
    let glued = tessellate(&model, &Settings { glue_mm: 1e-3, ..Settings::default() });
    assert_eq!(glued.mesh, tessellate(&model, &Settings::default()).mesh);
}

/// Of a rod of radius 2 in a hole of 3 mm, faces that touch in part have the same facets there and others elsewhere.
#[test]
fn faces_that_touch_in_part_have_one_interface_there() {
    for (ends, height) in [([1.0, 7.0], 2.0), ([-5.0, 1.5], 1.5), ([0.5, 2.5], 2.0), ([-5.0, 7.0], 3.0)] {
        for from in [0.0, 0.6] {
            let model = rod_in_plate(ends, from);
            let settings = Settings { glue_mm: 1e-3, measure: true, ..Settings::uniform(0.02) };
            let made = tessellate(&model, &settings);
            let r = &made.report;
            assert_eq!((r.open_edges, r.nonmanifold_edges, r.shells.open), (0, 0, 0), "{ends:?}");
            assert_eq!((r.certified, r.over_tolerance), (r.facets, Some(0)), "{ends:?}: {:?}", r.not_certified);
            let [rod, hole] = [1, 6].map(|face| facets_of(&made, face));
            let area = |p: &Vec<Point>| 0.5 * (p[2] - p[0]).cross(p[p.len() - 1] - p[1]).length();
            let area = |facets: &mut dyn Iterator<Item = &Vec<Point>>| facets.map(area).sum::<f64>();
            let shared = area(&mut rod.iter().filter(|f| hole.iter().any(|g| same(f, g))));
            // The chords of a circle of radius r with sag s are shorter than their arcs by a share of s/3r.
            let wall = 4.0 * PI * height;
            assert!(shared < wall && shared > 0.995 * wall, "{ends:?}: {shared} of {wall} mm²");
            // No other place is filled twice.
            let whole = area(&mut rod.iter());
            let expected = 4.0 * PI * (ends[1] - ends[0]);
            assert!(whole < expected && whole > 0.995 * expected, "{ends:?}: {whole} of {expected} mm²");
        }
    }
}

/// A border that runs inside the other face has chords short enough for the facets on both sides: with those of the short rod as they are
/// the hole came to 4,600 facets.
#[test]
fn a_short_rod_does_not_refine_its_hole() {
    let made = tessellate(&rod_in_plate([0.5, 2.5], 0.6), &Settings { glue_mm: 1e-3, ..Settings::default() });
    assert!(facets_of(&made, 6).len() < 200, "{}", facets_of(&made, 6).len());
}

/// A facet is held to the tolerance of its own face, whatever that of the one that touches it.
#[test]
fn faces_in_contact_keep_the_tolerances_asked_of_them() {
    for finer in [1, 6] {
        let scope = ToleranceScope::Placed(vec![FaceId(finer)]);
        let overrides = vec![ToleranceOverride { scope, tolerance: [0.01; 2], radii: None }];
        let settings = Settings { glue_mm: 1e-3, overrides, ..Settings::uniform(0.05) };
        let made = tessellate(&rod_in_hole(0.4), &settings);
        for (facet, quality) in made.mesh.facets.iter().zip(&made.quality) {
            let asked = if facet.face == FaceId(finer) { 0.01 } else { 0.05 };
            assert!((quality.tolerance / asked - 1.0).abs() < 1e-12, "{finer}: {:?} {quality:?}", facet.face);
            assert!(quality.certified, "{finer}: {:?} {quality:?}", facet.face);
        }
        let [on, of] = [1, 6].map(|face| facets_of(&made, face));
        assert!(of.iter().any(|f| on.iter().any(|g| same(f, g))), "{finer}: nothing is shared");
    }
}

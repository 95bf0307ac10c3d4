//! Facets at poles against sampling that shares nothing with the bound: random rational surfaces with one side drawn together.
//!
//! What is claimed of a certified facet: it and its piece of the spline lie within its tolerance of each other. At a pole the
//! piece is the sector between the parameter lines of the facet's other corners into the pole. Both sides of the claim are sampled.

use crate::support::judge::{Found, judge};
use crate::support::{config, knots, seeded, seeds};
use lampyris::math::{Frame, Homogeneous, Point, Vector};
use lampyris::model::{Face, Model, Part, Shell};
use lampyris::nurbs::{Surface, sweep};
use lampyris::tessellate::{Settings, tessellate};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};

/// A fan of rational surface with the side at the first (or last) parameter of one direction in one point; weights run over four decades.
fn fans() -> impl Strategy<Value = Surface> {
    let side = || (1usize..=5, proptest::collection::vec((any::<u8>(), any::<u8>()), 0..3));
    let noise = proptest::collection::vec((-1f64..1.0, -1f64..1.0, -1f64..1.0, -2f64..2.0), 400);
    // With the opposite side drawn together too in one of four.
    let flags = (any::<bool>(), 0..4).prop_map(|(last, both)| (last, both == 0));
    (side(), side(), noise, 0usize..2, flags, 0.3f64..6.0).prop_map(
        |((p, inner_u), (q, inner_v), noise, across, (last, both), turn)| {
            let degree = [p, q];
            let knots = [knots(p, &inner_u), knots(q, &inner_v)];
            let counts = [0, 1].map(|d| knots[d].len() - degree[d] - 1);
            let points = (0..counts[0] * counts[1])
                .map(|k| {
                    let at = [k / counts[1], k % counts[1]];
                    let [x, y] = [0, 1].map(|d| at[d] as f64 / (counts[d] - 1) as f64);
                    let (out, round) = if across == 0 { (x, y) } else { (y, x) };
                    let out = if last { 1.0 - out } else { out };
                    let tip = both && out == 1.0 && counts[across] > 2;
                    let round = if tip { 0.5 } else { round };
                    let (a, b, c, e) = noise[k % noise.len()];
                    let r = 40.0 * out;
                    let (sin, cos) = (turn * round).sin_cos();
                    let wild = if out == 0.0 || tip { 0.0 } else { 2.0 };
                    let at = Point::new(r * cos + wild * a, r * sin + wild * b, wild * 2.0 * c);
                    let w = 10f64.powf(e);
                    (at * w).extend(w)
                })
                .collect();
            Surface { degree, knots, points }
        },
    )
}

/// What the judge finds of a fan.
fn fan(surface: &Surface, tolerance: f64) -> Result<Found, String> {
    let shell = Shell { faces: vec![Face::whole(surface.clone())], ..Shell::default() };
    let model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
    let made = tessellate(&model, &Settings { budget: 400, ..Settings::uniform(tolerance) });
    judge(&model, &made, 0.0)
}

proptest! {
    #![proptest_config(ProptestConfig { max_shrink_iters: 0, ..config(12) })]

    #[test]
    fn certified_facets_at_a_pole_are_never_over(seed in seeds()) {
        let (surface, fine) = seeded((fans(), any::<bool>()), seed);
        let found = fan(&surface, if fine { 0.3 } else { 1.0 });
        prop_assert!(found.is_ok(), "{}", found.unwrap_err());
    }
}

/// A fan whose sectors all around follow each other and none of which can be joined: looking for the next one came to no end.
#[test]
fn a_ring_of_sectors_that_no_two_can_be_joined_of_comes_to_an_end() {
    let points = [
        [0.0, 0.0, 0.0, 6.252],
        [0.9753, -0.0772, 0.1233, 0.04435],
        [185.3, -5.901, -13.85, 4.615],
        [0.0, 0.0, 0.0, 0.03589],
        [1.338, 1.197, 0.2733, 0.08649],
        [64.57, 58.25, 2.3, 2.121],
        [0.0, 0.0, 0.0, 0.6961],
        [0.575, 4.656, -0.6773, 0.2616],
        [90.59, 547.3, -6.391, 13.21],
        [0.0, 0.0, 0.0, 0.04348],
        [-8.087, 15.57, -2.935, 0.8462],
        [-251.2, 391.6, -40.67, 11.26],
        [0.0, 0.0, 0.0, 25.42],
        [-10.74, 3.269, -0.7858, 0.5891],
        [-4.989, 1.462, -0.4408, 0.1352],
        [0.0, 0.0, 0.0, 72.35],
        [-0.2529, -0.1214, -0.04179, 0.013],
        [-2922.0, -1180.0, -180.0, 77.0],
    ];
    let knots = [[[0.0; 6], [1.0; 6]].concat(), vec![0.0, 0.0, 0.59375, 1.59375, 1.59375]];
    let surface = Surface { degree: [5, 1], knots, points: points.map(Homogeneous::from_array).to_vec() };
    assert!(fan(&surface, 0.3).unwrap().proved > 0);
}

/// Caps of spheres of a kilometre and more as splines, four metres from the origin and aslant, so that every control point is rounded,
/// those of the pole one by one: every vertex normal is that of the sphere, as near as rounded control points allow.
#[test]
fn poles_of_large_spheres_have_their_normals() {
    let axis = Vector::new(0.48, -0.6, 0.64);
    for radius in [1e6, 3e6, 1e7] {
        for aperture in [5.0, 25.0, 100.0] {
            for apex in [Point::new(4000.0, 0.0, 0.0), Point::new(1234.5, -3456.7, 1600.3)] {
                let center = apex - axis * radius;
                let latitudes = [FRAC_PI_2 - (aperture / radius), FRAC_PI_2];
                let frame = Frame::from_axis(center, axis, None);
                let surface = sweep::sphere(&frame, radius, [0.0, TAU], latitudes);
                let shell = Shell { faces: vec![Face::whole(surface)], ..Shell::default() };
                let model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
                let mesh = tessellate(&model, &Settings::default()).mesh;
                // Control points are rounded by some ulps of the radius; a normal is given by two that lie a part of the aperture apart.
                let rounding = 64.0 * f64::EPSILON * radius / aperture;
                let worst = mesh.vertices.iter().map(|v| {
                    let place = mesh.positions[v.position as usize];
                    (v.normal - (place - center).normalize()).length()
                });
                let worst = worst.fold(0.0, f64::max);
                assert!(worst < 1e-9 + rounding, "R {radius:e}, aperture {aperture}: {worst:e} > {rounding:e}");
            }
        }
    }
}

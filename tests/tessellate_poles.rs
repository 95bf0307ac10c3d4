//! Facets at poles against sampling that shares nothing with the bound: random rational surfaces with one side drawn together.
//!
//! What is claimed of a certified facet: it and its piece of the spline lie within its tolerance of each other. At a pole the
//! piece is the sector between the parameter lines of the facet's other corners into the pole. One side of the claim is sampled here:
//! the spline over the sector against the facet.

mod tessellate_support;

use lampyris::math::{Homogeneous, Point, Uv};
use lampyris::model::{Face, Model, Part, Shell};
use lampyris::nurbs::Surface;
use lampyris::tessellate::{Settings, tessellate};
use proptest::prelude::*;
use tessellate_support::judge::to_triangle;
use tessellate_support::{cases, knots};

/// A fan of rational surface with the side at the first (or last) parameter of one direction in one point; weights run over four decades.
fn fans() -> impl Strategy<Value = (Surface, usize, bool)> {
    let side = || (1usize..=5, proptest::collection::vec((any::<u8>(), any::<u8>()), 0..3));
    let noise = proptest::collection::vec((-1f64..1.0, -1f64..1.0, -1f64..1.0, -2f64..2.0), 400);
    (side(), side(), noise, 0usize..2, any::<bool>(), 0.3f64..6.0).prop_map(
        |((p, inner_u), (q, inner_v), noise, across, last, turn)| {
            let degree = [p, q];
            let knots = [knots(p, &inner_u), knots(q, &inner_v)];
            let counts = [0, 1].map(|d| knots[d].len() - degree[d] - 1);
            let points = (0..counts[0] * counts[1])
                .map(|k| {
                    let at = [k / counts[1], k % counts[1]];
                    let [x, y] = [0, 1].map(|d| at[d] as f64 / (counts[d] - 1) as f64);
                    let (out, round) = if across == 0 { (x, y) } else { (y, x) };
                    let out = if last { 1.0 - out } else { out };
                    let (a, b, c, e) = noise[k % noise.len()];
                    let r = 40.0 * out;
                    let (sin, cos) = (turn * round).sin_cos();
                    let wild = if out == 0.0 { 0.0 } else { 2.0 };
                    let at = Point::new(r * cos + wild * a, r * sin + wild * b, wild * 2.0 * c);
                    let w = 10f64.powf(e);
                    (at * w).extend(w)
                })
                .collect();
            (Surface { degree, knots, points }, across, last)
        },
    )
}

/// Largest distance of the spline over each facet's piece to the facet, in tolerances, of certified facets at the pole and of others.
fn worst(surface: &Surface, across: usize, last: bool, tolerance: f64) -> ([f64; 2], [usize; 2], usize) {
    let shell = Shell { faces: vec![Face::whole(surface.clone())], ..Shell::default() };
    let model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
    let made = tessellate(&model, &Settings { budget: 400, ..Settings::uniform(tolerance) });
    let level = surface.domain()[across][usize::from(last)];
    let (mut most, mut count, mut mended) = ([0f64; 2], [0; 2], 0);
    for (f, quality) in made.quality.iter().enumerate() {
        if !quality.certified {
            mended += 1;
            continue;
        }
        let facet = made.mesh.facets[f];
        let v = facet.vertices.map(|v| made.mesh.vertices[v as usize]);
        let xyz = made.mesh.corners(f);
        let cuts: &[[usize; 3]] = if facet.is_triangle() { &[[0, 1, 2]] } else { &[[0, 1, 2], [0, 2, 3]] };
        let at_pole = v.iter().any(|v| (v.uv[across] - level).abs() < 1e-9);
        count[usize::from(at_pole)] += 1;
        for t in cuts {
            let uv = t.map(|k| v[k].uv);
            let polar = [0, 1, 2].map(|k| (uv[k][across] - level).abs() < 1e-9);
            let n = 5;
            for i in 0..=n {
                for j in 0..=n {
                    let (s, r) = (i as f64 / n as f64, j as f64 / n as f64);
                    let x: Uv =
                        if let Some(k) = (0..3).find(|&k| polar[k] && !polar[(k + 1) % 3] && !polar[(k + 2) % 3]) {
                            // The sector: along the base, then along the parameter line into the pole.
                            let base = uv[(k + 1) % 3].lerp(uv[(k + 2) % 3], s);
                            let mut foot = base;
                            foot[across] = level;
                            base.lerp(foot, r)
                        } else if polar.iter().filter(|p| **p).count() > 1 {
                            continue;
                        } else {
                            uv[0].lerp(uv[1], s).lerp(uv[2], r)
                        };
                    let p = surface.evaluate(x);
                    let off = cuts.iter().map(|c| to_triangle(p, c.map(|k| xyz[k]))).fold(f64::INFINITY, f64::min);
                    let slot = &mut most[usize::from(at_pole)];
                    *slot = slot.max(off / quality.tolerance);
                }
            }
        }
    }
    (most, count, mended)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(12), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn certified_facets_at_a_pole_are_never_over((surface, across, last) in fans(), fine in any::<bool>()) {
        let (most, count, unproved) = worst(&surface, across, last, if fine { 0.3 } else { 1.0 });
        if std::env::var("SHOW").is_ok() { println!("{most:?} {count:?} unproved {unproved}"); }
        prop_assert!(most[0] <= 1.0 + 1e-6 && most[1] <= 1.0 + 1e-6, "{most:?} of {count:?}");
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
    let (most, count, _) = worst(&surface, 1, false, 0.3);
    assert!(count[1] > 0 && most[0] <= 1.0 + 1e-6 && most[1] <= 1.0 + 1e-6, "{most:?} of {count:?}");
}

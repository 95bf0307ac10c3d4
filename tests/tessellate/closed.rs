//! Closed shells of two random rational sheets over one rim: watertight to the bit, outward, and of the right volume.

use crate::support::config;
use crate::support::sheets::two_sheets;
use lampyris::math::{Frame, Uv};
use lampyris::model::{Edge, EdgeId, EdgeUse, Face, Model, Part, Shell, TrimLoop, VertexId};
use lampyris::nurbs::{Surface, UvCurve};
use lampyris::tessellate::{Settings, ShellCounts, tessellate};
use proptest::prelude::*;
use std::collections::HashMap;

/// A knot vector from 0 to 1 whose inner knots have any multiplicity up to the degree.
fn knots(degree: usize, inner: &[u8]) -> Vec<f64> {
    let at = |i: usize| (i + 1) as f64 / (inner.len() + 1) as f64;
    let middle = inner.iter().enumerate().flat_map(|(i, m)| std::iter::repeat_n(at(i), 1 + *m as usize % degree));
    let ends = |x: f64| std::iter::repeat_n(x, degree + 1);
    ends(0.0).chain(middle).chain(ends(1.0)).collect()
}

/// Two sheets whose control points and weights agree on the border and nowhere else; the first lies above.
fn sheets() -> impl Strategy<Value = [Surface; 2]> {
    // At least one control point off the rim: without, the sheets would lie on each other.
    let inner = |degree: usize| (Just(degree), proptest::collection::vec(any::<u8>(), usize::from(degree == 1)..3));
    let side = || (1usize..=5).prop_flat_map(inner);
    let noise = proptest::collection::vec((-1f64..1.0, -1f64..1.0, -1f64..1.0, -1f64..1.0), 512);
    (side(), side(), noise).prop_map(|((p, inner_u), (q, inner_v), noise)| {
        let knots = [knots(p, &inner_u), knots(q, &inner_v)];
        two_sheets([p, q], &knots, &noise, 0.5, |at| at)
    })
}

/// The shell of both sheets; each edge is the upper sheet's own border, to the bit that of the lower one.
fn pillow([above, below]: [Surface; 2]) -> Model {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[u, v]| Uv::new(u, v));
    // Isolines along u at v = 0 and 1, along v at u = 0 and 1, each from corner to corner.
    let sides = [(1, 0.0, [0, 1]), (0, 1.0, [1, 2]), (1, 1.0, [3, 2]), (0, 0.0, [0, 3])];
    let edges = sides.map(|(held, at, ends)| Edge {
        curve: above.isoline(held, at),
        vertices: ends.map(|k| VertexId(k as u32)),
        entity: None,
    });
    let uses = |k: usize| EdgeUse {
        edge: Some(EdgeId(k as u32)),
        reversed: k >= 2,
        uv: UvCurve::line(corners[sides[k].2[0]], corners[sides[k].2[1]], [0.0, 1.0]),
    };
    let face = |surface: &Surface, reversed: bool| {
        let rim = TrimLoop { uses: [0, 1, 2, 3].map(uses).into() };
        Face { reversed, loops: vec![rim], ..Face::whole(surface.clone()) }
    };
    let shell = Shell { faces: vec![face(&above, false), face(&below, true)], closed: true, ..Shell::default() };
    Model::from_part(Part {
        vertices: corners.map(|c| above.evaluate(c)).into(),
        edges: edges.into(),
        shells: vec![shell],
        ..Part::default()
    })
}

/// Places and weights of a midpoint rule over every knot span, crowded towards its ends: weights 1e-2 beside 1e2 put most of a surface
/// into the first ten-thousandth of a span.
fn rule(knots: &[f64]) -> Vec<(f64, f64)> {
    const N: usize = 100;
    let spans = knots.windows(2).filter(|k| k[1] > k[0]);
    let within = |k: &[f64]| {
        let (start, length) = (k[0], k[1] - k[0]);
        (0..N).map(move |i| {
            let x = (i as f64 + 0.5) / N as f64;
            let (a, b) = (x.powi(4), (1.0 - x).powi(4));
            let slope = 4.0 * (x * (1.0 - x)).powi(3) / (a + b).powi(2);
            (start + length * a / (a + b), length * slope / N as f64)
        })
    };
    spans.flat_map(within).collect()
}

/// Volume below a sheet: the integral of z over the area seen from above.
fn volume_below(surface: &Surface) -> f64 {
    let [us, vs] = [rule(&surface.knots[0]), rule(&surface.knots[1])];
    let at = |(u, a): &(f64, f64), (v, b): &(f64, f64)| {
        let d = surface.derivatives(Uv::new(*u, *v));
        d.point.z * d.du.cross(d.dv).z * a * b
    };
    us.iter().map(|u| vs.iter().map(|v| at(u, v)).sum::<f64>()).sum()
}

proptest! {
    #![proptest_config(config(32))]

    #[test]
    fn two_sheets_over_one_rim_close(sheets in sheets()) {
        let made = tessellate(&pillow(sheets.clone()), &Settings { measure: true, budget: 2000, ..Settings::uniform(0.3) });
        let r = &made.report;
        prop_assert_eq!(r.faces.failed, 0);
        prop_assert!(r.over_tolerance.unwrap() <= r.facets - r.certified);
        // Every side of a facet is met by exactly one other that runs against it, the very same points at its ends.
        let mut sides: HashMap<[[u64; 3]; 2], i32> = HashMap::new();
        for f in 0..made.mesh.facets.len() {
            let c = made.mesh.corners(f).map(|p| p.to_array().map(|x| (x + 0.0).to_bits()));
            for k in 0..4 {
                let (a, b) = (c[k], c[(k + 1) % 4]);
                if a != b {
                    *sides.entry([a, b]).or_default() += 1;
                }
            }
        }
        for ([a, b], n) in &sides {
            prop_assert_eq!((*n, sides.get(&[*b, *a])), (1, Some(&1)), "from {:?} to {:?}", a.map(f64::from_bits), b.map(f64::from_bits));
        }
        let want = volume_below(&sheets[0]) - volume_below(&sheets[1]);
        let slack = 0.3 * r.area_mm2 + 0.01 * want.abs();
        prop_assert!((r.volume_mm3.unwrap() - want).abs() < slack, "{:?} for {want} +- {slack}", r.volume_mm3);
    }
}

/// A sheet bounds no volume, and is no broken solid.
#[test]
fn a_sheet_is_counted_as_a_sheet() {
    let surface = lampyris::nurbs::sweep::plane(&Frame::IDENTITY, [[0.0, 1.0]; 2]);
    let shells = vec![Shell { faces: vec![Face::whole(surface)], ..Shell::default() }];
    let report = tessellate(&Model::from_part(Part { shells, ..Part::default() }), &Settings::default()).report;
    assert_eq!(report.shells, ShellCounts { sheets: 1, ..ShellCounts::default() });
    assert_eq!(report.volume_mm3, None);
}

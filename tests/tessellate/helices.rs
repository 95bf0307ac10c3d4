//! Faces that run around a cylinder many times.

use crate::support::trimmed::chain;
use lampyris::math::{Frame, Point, Uv, Vector};
use lampyris::model::{Edge, EdgeId, EdgeUse, Face, Model, Part, Shell, TrimLoop, VertexId};
use lampyris::nurbs::{Curve, Surface, UvCurve, sweep};
use lampyris::tessellate::{Settings, tessellate};
use std::f64::consts::TAU;

/// Pieces of an edge for each turn: each is a cubic within 50 nm of the surface.
const PIECES: usize = 24;

/// The edge over a straight line of parameters, as cubics with its places and tangents at the ends of so many `pieces`, over [0, 1].
fn edge_over(surface: &Surface, from: Uv, to: Uv, pieces: usize) -> Curve {
    let step = 1.0 / pieces as f64;
    let ends: Vec<(Point, Vector)> = chain(pieces, |t| from.lerp(to, t))
        .into_iter()
        .map(|uv| {
            let d = surface.derivatives(uv);
            (d.point, ((to - from).x * d.du + (to - from).y * d.dv) * (step / 3.0))
        })
        .collect();
    let mut points = vec![ends[0].0];
    for pair in ends.windows(2) {
        let [(a, out), (b, into)] = [pair[0], pair[1]];
        points.extend([a + out, b - into, b]);
    }
    let inner = (1..pieces).flat_map(|k| [k as f64 * step; 3]);
    let knots = [0.0; 4].into_iter().chain(inner).chain([1.0; 4]).collect();
    Curve { degree: 3, knots, points: points.into_iter().map(|p| p.extend(1.0)).collect() }
}

/// A strip `width` high, mm, that winds around a cylinder.
fn winding_strip(radius: f64, turns: usize, pitch: f64, width: f64) -> Model {
    let (around, rise) = (TAU * turns as f64, pitch * turns as f64);
    let surface = sweep::cylinder(&Frame::IDENTITY, radius, [0.0, around], [-1.0, rise + width + 1.0]);
    let corners = [[0.0, 0.0], [around, rise], [around, rise + width], [0.0, width]].map(Uv::from_array);
    let mut part = Part { vertices: corners.iter().map(|uv| surface.evaluate(*uv)).collect(), ..Part::default() };
    let mut uses = Vec::new();
    for k in 0..4 {
        let (from, to) = (corners[k], corners[(k + 1) % 4]);
        let vertices = [k, (k + 1) % 4].map(|v| VertexId(v as u32));
        let pieces = if from.x == to.x { 1 } else { PIECES * turns };
        part.edges.push(Edge { curve: edge_over(&surface, from, to, pieces), vertices, entity: None });
        let uv = UvCurve::line(from, to, [0.0, 1.0]);
        uses.push(EdgeUse { edge: Some(EdgeId(k as u32)), reversed: false, uv });
    }
    let face = Face { loops: vec![TrimLoop { uses }], ..Face::whole(surface) };
    part.shells = vec![Shell { faces: vec![face], ..Shell::default() }];
    Model::from_part(part)
}

/// The flank of a thread whose edges take more than the 20,000 chords that any edge may have: the last turns had chords from one side of
/// the cylinder to the other, and twice the area.
#[test]
fn a_strip_of_many_turns_is_held_to_its_tolerance_all_along() {
    let (radius, turns, width) = (4.0, 150, 1.4);
    let made = tessellate(&winding_strip(radius, turns, 2.0, width), &Settings::uniform(0.0012));
    let report = &made.report;
    assert!(made.mesh.vertices.len() > 2 * 20_000, "{} are too few to tell", made.mesh.vertices.len());
    assert_eq!((&report.repaired[..], report.certified), (&[][..], report.facets));
    let area = width * TAU * turns as f64 * radius;
    assert!((report.area_mm2 / area - 1.0).abs() < 1e-3, "{} {area}", report.area_mm2);
}

//! Solids of revolution whose faces share their edges, and pairs of them that touch along curved faces.

use lampyris::math::{Frame, Point, Uv, Vector};
use lampyris::model::{Edge, EdgeId, EdgeUse, Face, Instance, Model, Part, PartId, Shell, TrimLoop, VertexId};
use lampyris::nurbs::{Curve, Surface, UvCurve, conic, sweep};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A solid turned about z from a profile in the half-plane x ≥ 0, y = 0, with the material on its left; the seams of its faces lie at
/// the angle `from`.
pub(crate) fn turned(name: &str, profile: &[Curve], from: f64) -> Part {
    let axis = Frame::from_axis(Point::ZERO, Vector::Z, Some(Vector::new(from.cos(), from.sin(), 0.0)));
    let placed = |c: &Curve| {
        let place = |p: &glam::DVec4| axis.vector(p.truncate()).extend(p.w);
        let points = c.points.iter().map(place).collect();
        Curve { degree: c.degree, knots: c.knots.clone(), points }
    };
    let surfaces: Vec<Surface> = profile.iter().map(|c| sweep::revolution(&placed(c), &axis, [0.0, TAU])).collect();
    let n = profile.len();
    let ends = [profile[0].evaluate(profile[0].domain()[0]), profile[n - 1].evaluate(profile[n - 1].domain()[1])];
    let on_axis = |p: Point| p.x.hypot(p.y) < 1e-9;
    let is_ring = (ends[0] - ends[1]).length() < 1e-9 && !on_axis(ends[0]);
    let joints = if is_ring { n } else { n + 1 };
    let mut part = Part { name: name.into(), ..Part::default() };
    // A circle at each joint off the axis, and a vertex on it where the seams meet.
    let mut circles: Vec<Option<EdgeId>> = Vec::new();
    for j in 0..joints {
        let (surface, end) = if j < n { (&surfaces[j], 0) } else { (&surfaces[n - 1], 1) };
        let v = surface.domain()[1][end];
        let p = surface.evaluate(Uv::new(0.0, v));
        part.vertices.push(p);
        circles.push((!on_axis(p)).then(|| {
            let vertices = [VertexId(j as u32); 2];
            part.edges.push(Edge { curve: surface.isoline(1, v), vertices, entity: None });
            EdgeId(part.edges.len() as u32 - 1)
        }));
    }
    let mut faces = Vec::new();
    for (k, surface) in surfaces.iter().enumerate() {
        let (a, b) = (k, (k + 1) % joints);
        let [[u0, u1], [v0, v1]] = surface.domain();
        let vertices = [a, b].map(|j| VertexId(j as u32));
        part.edges.push(Edge { curve: surface.isoline(0, u0), vertices, entity: None });
        let seam = Some(EdgeId(part.edges.len() as u32 - 1));
        let across = |v: f64| UvCurve::line(Uv::new(u0, v), Uv::new(u1, v), [u0, u1]);
        let up = |u: f64| UvCurve::line(Uv::new(u, v0), Uv::new(u, v1), [v0, v1]);
        let uses = vec![
            EdgeUse { edge: circles[a], reversed: false, uv: across(v0) },
            EdgeUse { edge: seam, reversed: false, uv: up(u1) },
            EdgeUse { edge: circles[b], reversed: true, uv: across(v1) },
            EdgeUse { edge: seam, reversed: true, uv: up(u0) },
        ];
        faces.push(Face { loops: vec![TrimLoop { uses }], ..Face::whole(surface.clone()) });
    }
    part.shells = vec![Shell { faces, closed: true, name: name.into(), ..Shell::default() }];
    part
}

/// Parts as they stand.
pub(crate) fn assembly(parts: Vec<Part>) -> Model {
    let instance = |(i, part): (usize, &Part)| Instance {
        name: part.name.clone(),
        path: String::new(),
        part: PartId(i as u32),
        placement: Frame::IDENTITY,
        colour: None,
    };
    Model { instances: parts.iter().enumerate().map(instance).collect(), parts, ..Model::default() }
}

fn at(r: f64, z: f64) -> Point {
    Point::new(r, 0.0, z)
}

/// Lines from each of these places, x and z, to the next.
pub(crate) fn lines(points: &[[f64; 2]]) -> Vec<Curve> {
    points.windows(2).map(|w| Curve::line(at(w[0][0], w[0][1]), at(w[1][0], w[1][1]), [0.0, 1.0])).collect()
}

/// An arc about (x, z) from one angle to another, measured from x towards z.
pub(crate) fn arc([x, z]: [f64; 2], radius: f64, [from, to]: [f64; 2]) -> Curve {
    let frame = Frame::from_axis(at(x, z), -Vector::Y, Some(Vector::X));
    if from < to {
        conic::arc(&frame, radius, [from, to])
    } else {
        conic::arc(&frame, radius, [to, from]).reversed()
    }
}

/// A lens about z: the vertices of its two surfaces, their radii of curvature (positive: the centre lies at larger z), and half its
/// diameter.
pub(crate) fn lens(name: &str, [z0, z1]: [f64; 2], [r0, r1]: [f64; 2], aperture: f64, from: f64) -> Part {
    let range = |r: f64| {
        let (vertex, turn) = if r > 0.0 { (-FRAC_PI_2, 1.0) } else { (FRAC_PI_2, -1.0) };
        [vertex, vertex + turn * (aperture / r.abs()).asin()]
    };
    let [a, b] = [range(r0), range(r1)];
    let front = arc([0.0, z0 + r0], r0.abs(), a);
    let back = arc([0.0, z1 + r1], r1.abs(), [b[1], b[0]]);
    let rim = Curve::line(front.evaluate(front.domain()[1]), back.evaluate(back.domain()[0]), [0.0, 1.0]);
    turned(name, &[front, rim, back], from)
}

/// Two lenses with one surface in common, the second of this aperture.
pub(crate) fn doublet(aperture: f64, from: f64) -> Model {
    let front = lens("crown", [0.0, 8.0], [60.0, -40.0], 12.0, 0.0);
    let back = lens("flint", [8.0, 11.0], [-40.0, -120.0], aperture, from);
    assembly(vec![front, back])
}

/// A rod of radius 5 that stands out of its hole at both ends.
pub(crate) fn rod_in_hole(from: f64) -> Model {
    let rod = lines(&[[0.0, -5.0], [5.0, -5.0], [5.0, 25.0], [0.0, 25.0]]);
    let block = lines(&[[5.0, 0.0], [15.0, 0.0], [15.0, 20.0], [5.0, 20.0], [5.0, 0.0]]);
    assembly(vec![turned("rod", &rod, 0.0), turned("block", &block, from)])
}

/// A rod of radius 2 between these heights in a hole of a plate from z = 0 to 3.
pub(crate) fn rod_in_plate([bottom, top]: [f64; 2], from: f64) -> Model {
    let rod = lines(&[[0.0, bottom], [2.0, bottom], [2.0, top], [0.0, top]]);
    let plate = lines(&[[2.0, 0.0], [6.0, 0.0], [6.0, 3.0], [2.0, 3.0], [2.0, 0.0]]);
    assembly(vec![turned("rod", &rod, 0.0), turned("plate", &plate, from)])
}

/// A ball of radius 10 in a cup that reaches nearly to its equator.
pub(crate) fn ball_in_cup(from: f64) -> Model {
    let rim = -0.3f64;
    let mut cup =
        lines(&[[0.0, -14.0], [14.0, -14.0], [14.0, 10.0 * rim.sin()], [10.0 * rim.cos(), 10.0 * rim.sin()]]);
    cup.push(arc([0.0, 0.0], 10.0, [rim, -FRAC_PI_2]));
    let ball = [arc([0.0, 0.0], 10.0, [-FRAC_PI_2, FRAC_PI_2])];
    assembly(vec![turned("ball", &ball, 0.0), turned("cup", &cup, from)])
}

/// A ring half in its groove.
pub(crate) fn ring_in_groove(from: f64) -> Model {
    let mut groove = lines(&[[18.0, 0.0], [15.0, 0.0], [15.0, -4.0], [25.0, -4.0], [25.0, 0.0], [22.0, 0.0]]);
    groove.push(arc([20.0, 0.0], 2.0, [0.0, -PI]));
    let ring = [arc([20.0, 0.0], 2.0, [-PI, PI])];
    assembly(vec![turned("ring", &ring, 0.0), turned("groove", &groove, from)])
}

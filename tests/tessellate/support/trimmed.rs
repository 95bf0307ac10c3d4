//! Trimmed faces for the tests of meshing.

use lampyris::math::Uv;
use lampyris::model::{Edge, EdgeId, EdgeUse, Face, Model, Part, Shell, TrimLoop, VertexId};
use lampyris::nurbs::{Curve, Surface, UvCurve};

/// A face between chains of points in the parameter plane, one chain an edge; each edge follows the surface from point to point.
pub(crate) fn face(surface: Surface, loops: &[Vec<Vec<Uv>>]) -> Model {
    let mut part = Part::default();
    let mut trims = Vec::new();
    for chains in loops {
        let first = part.vertices.len() as u32;
        let n = chains.len() as u32;
        let mut uses = Vec::new();
        for (k, chain) in (0..n).zip(chains) {
            part.vertices.push(surface.evaluate(chain[0]));
            let m = chain.len() - 1;
            let mut knots = vec![0.0];
            knots.extend((0..=m).map(|i| i as f64 / m as f64));
            knots.push(1.0);
            let points = chain.iter().map(|&uv| surface.evaluate(uv).extend(1.0)).collect();
            let curve = Curve { degree: 1, knots: knots.clone(), points };
            let uv = UvCurve { degree: 1, knots, points: chain.iter().map(|p| p.extend(1.0)).collect() };
            uses.push(EdgeUse { edge: Some(EdgeId(part.edges.len() as u32)), reversed: false, uv });
            let vertices = [VertexId(first + k), VertexId(first + (k + 1) % n)];
            part.edges.push(Edge { curve, vertices, entity: None });
        }
        trims.push(TrimLoop { uses });
    }
    let face = Face { loops: trims, ..Face::whole(surface) };
    part.shells = vec![Shell { faces: vec![face], ..Shell::default() }];
    Model::from_part(part)
}

pub(crate) fn chain(n: usize, at: impl Fn(f64) -> Uv) -> Vec<Uv> {
    (0..=n).map(|i| at(i as f64 / n as f64)).collect()
}

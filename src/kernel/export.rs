//! [`Model`] faces → truck faces, where truck can hold them.

use super::geometry::{curve_to_truck, surface_to_truck, to_truck};
use super::import::Refusal;
use super::truck::{self, Curve as TruckCurve, Surface as TruckSurface};
use crate::math::Frame;
use crate::model::{EdgeId, Face, Part, TrimLoop};

/// A truck face and which face of the part it came from.
#[derive(Clone, Debug)]
pub struct TruckFace {
    /// Index into [`Part::shells`].
    pub shell: usize,
    /// Index into the shell's faces.
    pub face: usize,
    /// The face, sharing edges and vertices with its neighbours.
    pub truck: truck::Face,
}

/// The faces of a part where it is placed, as truck faces that share their edges, and those truck cannot hold.
///
/// Truck has no closed edges, so each is cut in two; poles and seams, which exist in the parameter plane alone, are left out of
/// its wires. A face without edges has no place in truck and is refused.
pub fn faces_to_truck(part: &Part, placement: &Frame) -> (Vec<TruckFace>, Vec<Refusal>) {
    let mut exporter = Exporter::new(part, placement);
    let (mut faces, mut refused) = (Vec::new(), Vec::new());
    for (shell, s) in part.shells.iter().enumerate() {
        for (face, f) in s.faces.iter().enumerate() {
            match exporter.face(f) {
                Ok(truck) => faces.push(TruckFace { shell, face, truck }),
                Err(reason) => refused.push(Refusal { shell, face, reason }),
            }
        }
    }
    (faces, refused)
}

struct Exporter<'a> {
    part: &'a Part,
    placement: &'a Frame,
    vertices: Vec<truck::Vertex>,
    /// The pieces of each edge in its own direction, made when first used.
    edges: Vec<Option<Vec<truck::Edge>>>,
}

impl<'a> Exporter<'a> {
    fn new(part: &'a Part, placement: &'a Frame) -> Self {
        let vertices = part.vertices.iter().map(|p| truck::Vertex::new(to_truck(placement.point(*p)))).collect();
        Self { part, placement, vertices, edges: vec![None; part.edges.len()] }
    }

    fn face(&mut self, f: &Face) -> Result<truck::Face, String> {
        let surface = surface_to_truck(&f.surface.transformed(|p| self.placement.point(p)));
        let mut wires = Vec::new();
        for l in &f.loops {
            wires.extend(self.wires(l)?);
        }
        if wires.is_empty() {
            return Err("a face without edges: truck has no closed surfaces without a boundary".into());
        }
        let surface = TruckSurface::NurbsSurface(surface);
        let face = truck::Face::try_new(wires, surface).map_err(|e| format!("truck refuses its wires: {e}"))?;
        // A mirrored placement turns Su × Sv against the placed normal; the loops follow Su × Sv.
        Ok(if f.reversed != self.placement.is_mirrored() { face.inverse() } else { face })
    }

    /// The chains of edges between the seams of a loop, each closed by itself.
    fn wires(&mut self, l: &TrimLoop) -> Result<Vec<truck::Wire>, String> {
        let mut sides: Vec<truck::Edge> = Vec::new();
        for u in &l.uses {
            let Some(id) = u.edge else { continue };
            let mut pieces = self.edge(id)?;
            if u.reversed {
                pieces.reverse();
                pieces.iter_mut().for_each(|e| {
                    e.invert();
                });
            }
            sides.extend(pieces);
        }
        let mut wires = Vec::new();
        let mut wire = truck::Wire::new();
        for side in sides {
            let ended = wire.back_vertex().is_some_and(|v| v != side.front());
            if ended && wire.is_closed() {
                wires.push(std::mem::take(&mut wire));
            }
            wire.push_back(side);
            if wire.is_closed() && wire.len() > 1 {
                wires.push(std::mem::take(&mut wire));
            }
        }
        if wire.is_empty() { Ok(wires) } else { Err("its edges form no closed wire".into()) }
    }

    fn edge(&mut self, id: EdgeId) -> Result<Vec<truck::Edge>, String> {
        let index = id.0 as usize;
        if let Some(made) = &self.edges[index] {
            return Ok(made.clone());
        }
        let edge = &self.part.edges[index];
        let [front, back] = edge.vertices.map(|v| self.vertices[v.0 as usize].clone());
        let mut curve = edge.curve.clone();
        for p in &mut curve.points {
            *p = crate::nurbs::ControlPoint::weighted(
                self.placement.point(crate::nurbs::ControlPoint::position(*p)),
                p.w,
            );
        }
        let truck_edge = |a: &truck::Vertex, b: &truck::Vertex, c: &crate::nurbs::Curve| {
            truck::Edge::try_new(a, b, TruckCurve::NurbsCurve(curve_to_truck(c)))
                .map_err(|e| format!("an edge: {e}"))
        };
        let made = if front == back {
            let [t0, t1] = curve.domain();
            let t = 0.5 * (t0 + t1);
            let middle = truck::Vertex::new(to_truck(curve.evaluate(t)));
            vec![
                truck_edge(&front, &middle, &curve.restricted(t0, t))?,
                truck_edge(&middle, &back, &curve.restricted(t, t1))?,
            ]
        } else {
            vec![truck_edge(&front, &back, &curve)?]
        };
        self.edges[index] = Some(made.clone());
        Ok(made)
    }
}

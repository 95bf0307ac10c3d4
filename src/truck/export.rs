//! [`Model`] faces → truck faces, where truck can hold them.

use super::geometry::{curve_to_truck, surface_to_truck, to_truck};
use super::import::Refusal;
use super::modeling::{self, Curve as TruckCurve, Surface as TruckSurface};
use crate::math::{Frame, Homogeneous};
use crate::model::{EdgeId, EdgeUse, Face, Part, TrimLoop};
use crate::nurbs::{ControlPoint, Curve};

/// Diagonal of the box around an edge below which it is a point, mm: the rounding of places up to 100 m.
const SHORTEST_EDGE: f64 = 1e-9;

/// Parameters along a seam that differ by less are one: the rounding of parameters up to a million.
const SAME_PARAMETER: f64 = 1e-9;

/// Share of a line below which a stretch of it has no length: thousands of roundings.
const NO_LENGTH: f64 = 1e-12;

/// A truck face and which face of the part it came from.
#[derive(Clone, Debug)]
pub struct TruckFace {
    /// Index into [`Part::shells`].
    pub shell: usize,
    /// Index into the shell's faces.
    pub face: usize,
    /// The face, sharing edges and vertices with its neighbours.
    pub truck: modeling::Face,
}

/// Returns the faces of a part at its place, mm of the scene, as truck faces that share their edges, and those truck cannot hold.
///
/// Truck has no closed edges, so each is cut in two; poles, which exist in the parameter plane alone, are left out of its wires. A
/// face with a seam is cut open along it and has edges of its own, for truck's wires meet no point twice. A face without
/// edges has no place in truck and is refused.
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

/// A part at its place, with what of it is made in truck already.
struct Exporter<'a> {
    part: &'a Part,
    placement: &'a Frame,
    vertices: Vec<modeling::Vertex>,
    /// The pieces of each edge in its own direction, made when first used.
    edges: Vec<Option<Vec<modeling::Edge>>>,
}

impl<'a> Exporter<'a> {
    fn new(part: &'a Part, placement: &'a Frame) -> Self {
        let vertices = part.vertices.iter().map(|p| modeling::Vertex::new(to_truck(placement.point(*p)))).collect();
        Self { part, placement, vertices, edges: vec![None; part.edges.len()] }
    }

    /// Makes a face of truck at the part's place, with edges that its neighbours share where truck takes them; else the reason why it
    /// cannot.
    fn face(&mut self, f: &Face) -> Result<modeling::Face, String> {
        let surface = surface_to_truck(&f.surface.transformed(|p| self.placement.point(p)))?;
        if f.loops.is_empty() {
            return Err("a face without edges: truck has no closed surfaces without a boundary".into());
        }
        let build = |wires: Vec<modeling::Wire>| {
            modeling::Face::try_new(wires, TruckSurface::NurbsSurface(surface.clone()))
                .map_err(|e| format!("truck refuses its wires: {e}"))
        };
        // First with edges that neighbours share; where truck refuses, with edges of the face's own.
        let shared = f.loops.iter().map(|l| self.wire(l)).collect::<Result<Vec<_>, _>>().and_then(build);
        let face =
            shared.or_else(|_| build(f.loops.iter().map(|l| self.cut_open(f, l)).collect::<Result<_, _>>()?))?;
        // A mirrored placement turns Su × Sv against the placed normal; the loops follow Su × Sv.
        Ok(if f.reversed != self.placement.is_mirrored() { face.inverse() } else { face })
    }

    /// Returns a wire of the shared edges of a loop; sides at poles are left out.
    fn wire(&mut self, l: &TrimLoop) -> Result<modeling::Wire, String> {
        let mut sides: Vec<modeling::Edge> = Vec::new();
        for u in &l.uses {
            // Poles are not there in space.
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
        Ok(sides.into())
    }

    /// Returns a wire of edges of its own for a loop, with a vertex of its own wherever two of them meet; a loop of one edge is cut in two.
    fn cut_open(&self, f: &Face, l: &TrimLoop) -> Result<modeling::Wire, String> {
        let mut curves: Vec<Curve> = Vec::new();
        for u in &l.uses {
            let curve = match u.edge {
                Some(id) => self.part.edges[id.0 as usize].curve.clone(),
                None => seam_curve(f, u)?,
            };
            if curve.bounds().diagonal() > SHORTEST_EDGE {
                curves.push(self.placed_curve(if u.reversed { curve.reversed() } else { curve }));
            }
        }
        // Truck's edges need two ends: a closed one is cut in the middle.
        if curves.len() == 1 {
            let [t0, t1] = curves[0].domain();
            let t = 0.5 * (t0 + t1);
            curves = vec![curves[0].restricted(t0, t), curves[0].restricted(t, t1)];
        }
        let joints: Vec<modeling::Vertex> =
            curves.iter().map(|c| modeling::Vertex::new(to_truck(c.evaluate(c.domain()[0])))).collect();
        let next = joints.iter().cycle().skip(1);
        curves.iter().zip(joints.iter().zip(next)).map(|(c, (a, b))| truck_edge(a, b, c)).collect()
    }

    /// Makes edges of truck for an edge of the part, once, and returns them in its direction: two where it is closed. Fails for a curve
    /// that truck does not take.
    fn edge(&mut self, id: EdgeId) -> Result<Vec<modeling::Edge>, String> {
        let index = id.0 as usize;
        if let Some(made) = &self.edges[index] {
            return Ok(made.clone());
        }
        let edge = &self.part.edges[index];
        let [front, back] = edge.vertices.map(|v| self.vertices[v.0 as usize].clone());
        let curve = self.placed_curve(edge.curve.clone());
        // A closed edge, which truck does not know, is two.
        let made = if front == back {
            let [t0, t1] = curve.domain();
            let t = 0.5 * (t0 + t1);
            let middle = modeling::Vertex::new(to_truck(curve.evaluate(t)));
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

    /// Moves the curve from the part's coordinates to its place in the scene.
    fn placed_curve(&self, mut curve: Curve) -> Curve {
        for p in &mut curve.points {
            *p = Homogeneous::weighted(self.placement.point(p.position()), p.w);
        }
        curve
    }
}

/// Returns an edge of truck from `a` to `b` along the curve.
fn truck_edge(a: &modeling::Vertex, b: &modeling::Vertex, c: &Curve) -> Result<modeling::Edge, String> {
    modeling::Edge::try_new(a, b, TruckCurve::NurbsCurve(curve_to_truck(c)?)).map_err(|e| format!("an edge: {e}"))
}

/// Returns the curve in space, in the part's coordinates and over the surface's parameters, of a use without an edge: a line of constant u
/// or v, or one without length at a pole. Fails for any other use.
fn seam_curve(f: &Face, u: &EdgeUse) -> Result<Curve, String> {
    let [t0, t1] = u.uv.domain();
    let (a, b) = (u.uv.evaluate(t0), u.uv.evaluate(t1));
    // Seams are lines of constant parameter; anything else has no curve that both sides share.
    let constant = (0..2).find(|&k| u.uv.points.iter().all(|p| (p.position()[k] - a[k]).abs() < SAME_PARAMETER));
    let constant = constant.ok_or("a seam that is no line of constant parameter")?;
    let [from, to] = [a[1 - constant], b[1 - constant]];
    let line = f.surface.isoline(constant, a[constant]);
    let [low, high] = line.domain();
    let cut = [from.min(to).max(low), from.max(to).min(high)];
    // A stretch without length is a pole: a line from the point to itself.
    if cut[1] - cut[0] < NO_LENGTH * (high - low) {
        return Ok(Curve::line(line.evaluate(from), line.evaluate(from), [0.0, 1.0]));
    }
    let line = line.restricted(cut[0], cut[1]);
    Ok(if from > to { line.reversed() } else { line })
}

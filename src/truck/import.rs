//! Truck solids and shells → [`Model`].

use super::face::{WireEdge, convert_face};
use super::geometry::{curve, point};
use super::modeling;
use crate::math::polygon::is_inside_polygons;
use crate::math::{Aabb, Uv, Vector};
use crate::model::{Edge, EdgeId, Face, Model, Part, Shell, VertexId};
use std::collections::HashMap;

/// A model made from a truck shape, and the faces that could not be.
#[derive(Clone, Debug)]
pub struct Conversion {
    /// The shape as one part.
    pub model: Model,
    /// Faces left out.
    pub refused: Vec<Refusal>,
}

/// A face that was left out, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Which shell of the shape, from 0.
    pub shell: usize,
    /// Which face of that shell, from 0.
    pub face: usize,
    /// What is wrong with it.
    pub reason: String,
}

/// Returns the model of a solid: its outer shell, then its voids. All face normals point out of the material, whichever way truck's faces
/// were wound.
///
/// ```
/// use lampyris::truck::{self, modeling::{builder, Point3, Vector3}};
/// let corner = builder::vertex(Point3::new(0.0, 0.0, 0.0));
/// let edge = builder::tsweep(&corner, Vector3::new(10.0, 0.0, 0.0));
/// let face = builder::tsweep(&edge, Vector3::new(0.0, 20.0, 0.0));
/// let cuboid = builder::tsweep(&face, Vector3::new(0.0, 0.0, 30.0));
/// let made = truck::solid("block", &cuboid);
/// assert!(made.refused.is_empty());
/// assert_eq!(made.model.placed_face_count(), 6);
/// ```
pub fn solid(name: &str, solid: &modeling::Solid) -> Conversion {
    let mut made = Maker::default();
    for shell in solid.boundaries() {
        made.shell(shell, true);
    }
    made.finish(name)
}

/// Returns the model of a shell; normals are those of truck's faces, turned outward when the shell is closed.
pub fn shell(name: &str, shell: &modeling::Shell) -> Conversion {
    let mut made = Maker::default();
    // An open shell has no outside.
    let closed = shell.shell_condition() == modeling::ShellCondition::Closed;
    made.shell(shell, closed);
    made.finish(name)
}

/// The part under construction, with what of it is known by truck's ids.
#[derive(Default)]
struct Maker {
    part: Part,
    refused: Vec<Refusal>,
    vertices: HashMap<modeling::VertexID, VertexId>,
    edges: HashMap<modeling::EdgeID, Result<EdgeId, String>>,
}

impl Maker {
    /// Adds a shell with the faces that can be converted; the others are noted as refused.
    fn shell(&mut self, shell: &modeling::Shell, closed: bool) {
        let at = self.part.shells.len();
        let mut faces = Vec::new();
        for (i, face) in shell.face_iter().enumerate() {
            match self.face(face) {
                Ok(face) => faces.push(face),
                Err(reason) => self.refused.push(Refusal { shell: at, face: i, reason }),
            }
        }
        self.part.shells.push(Shell { faces, closed, ..Shell::default() });
    }

    /// Converts a face; its edges are added to the part where they are new. Fails with the reason.
    fn face(&mut self, face: &modeling::Face) -> Result<Face, String> {
        let mut wires: Vec<Vec<(EdgeId, bool)>> = Vec::new();
        for wire in face.absolute_boundaries() {
            let edges = wire.edge_iter().map(|e| Ok((self.edge(e)?, !e.orientation())));
            wires.push(edges.collect::<Result<_, String>>()?);
        }
        let edges = &self.part.edges;
        let wires: Vec<Vec<WireEdge>> = wires
            .iter()
            .map(|w| {
                w.iter()
                    .map(|&(id, reversed)| WireEdge { id, curve: &edges[id.0 as usize].curve, reversed })
                    .collect()
            })
            .collect();
        convert_face(&face.surface(), face.orientation(), &wires)
    }

    /// Returns the number of an edge in the part, to which it is added when it is met first; fails, every time, for a curve that cannot be
    /// had.
    fn edge(&mut self, e: &modeling::Edge) -> Result<EdgeId, String> {
        // By truck's id: neighbours hold the same edge, and must get the same curve.
        if let Some(known) = self.edges.get(&e.id()) {
            return known.clone();
        }
        let made = curve(&e.curve()).map(|curve| {
            let vertices = [self.vertex(e.absolute_front()), self.vertex(e.absolute_back())];
            self.part.edges.push(Edge { curve, vertices, entity: None });
            EdgeId(self.part.edges.len() as u32 - 1)
        });
        self.edges.insert(e.id(), made.clone());
        made
    }

    /// Returns the number of a vertex in the part, to which it is added when it is met first.
    fn vertex(&mut self, v: &modeling::Vertex) -> VertexId {
        *self.vertices.entry(v.id()).or_insert_with(|| {
            self.part.vertices.push(point(v.point()));
            VertexId(self.part.vertices.len() as u32 - 1)
        })
    }

    /// Turns closed shells that look the wrong way, puts the outer one first, and numbers refusals accordingly.
    fn finish(mut self, name: &str) -> Conversion {
        self.part.name = name.into();
        let edges = &self.part.edges;
        let bounds: Vec<Aabb> = self.part.shells.iter().map(|s| shell_bounds(s, edges)).collect();
        // The shell with the largest box holds the others, which are voids: their normals point inward.
        let outer = (0..bounds.len()).max_by(|&a, &b| bounds[a].diagonal().total_cmp(&bounds[b].diagonal()));
        for (i, shell) in self.part.shells.iter_mut().enumerate() {
            let inside_out = shell.closed && points_outward(shell) == Some(false);
            let is_void = Some(i) != outer;
            if shell.closed && inside_out != is_void {
                // An outer shell should look out of the material, and so should a void: into its hollow.
                shell.faces.iter_mut().for_each(|f| f.reversed = !f.reversed);
            }
        }
        if let Some(outer) = outer {
            self.part.shells.swap(0, outer);
            for r in &mut self.refused {
                // Refusals name shells by their place, which has changed for two of them.
                r.shell = if r.shell == outer {
                    0
                } else if r.shell == 0 {
                    outer
                } else {
                    r.shell
                };
            }
        }
        Conversion { model: Model::from_part(self.part), refused: self.refused }
    }
}

/// Returns the box around the surfaces and edges of a shell.
fn shell_bounds(shell: &Shell, edges: &[Edge]) -> Aabb {
    let used = shell.faces.iter().flat_map(|f| &f.loops).flat_map(|l| &l.uses).filter_map(|u| u.edge);
    let curves = used.map(|id| edges[id.0 as usize].curve.bounds());
    curves.chain(shell.faces.iter().map(|f| f.surface.bounds())).fold(Aabb::from_points([]), Aabb::union)
}

/// Whether the normals of a closed shell point outward, by a vote: where it reaches farthest in a direction, an outward normal does not
/// point back. `None` when the vote is tied or no face has a normal.
fn points_outward(shell: &Shell) -> Option<bool> {
    let samples: Vec<(Vector, Vector)> = shell.faces.iter().flat_map(face_samples).collect();
    let mut votes = 0i32;
    // Many directions, because a face may be hidden, or missing, in some.
    for k in 0..26 {
        // The 26 neighbours of a cell, slightly skewed so that flat sides do not tie.
        let c = if k < 13 { k } else { k + 1 };
        let skew = Vector::new(0.137, -0.071, 0.093);
        let d = Vector::new(f64::from(c % 3) - 1.0, f64::from(c / 3 % 3) - 1.0, f64::from(c / 9) - 1.0) + skew;
        // Where the shell reaches farthest lies its outside.
        if let Some((_, n)) = samples.iter().max_by(|a, b| a.0.dot(d).total_cmp(&b.0.dot(d))) {
            votes += if n.dot(d) > 0.0 { 1 } else { -1 };
        }
    }
    (votes != 0).then_some(votes > 0)
}

/// Returns the points inside a face, on a grid, with its normals; places without a normal are left out.
fn face_samples(face: &Face) -> Vec<(Vector, Vector)> {
    const GRID: usize = 12;
    const PIECES_OF_SPAN: usize = 16;
    let outline: Vec<Vec<Uv>> = face.loops.iter().map(|l| l.polygon(|_| PIECES_OF_SPAN)).collect();
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    let sign = if face.reversed { -1.0 } else { 1.0 };
    let at = |i: usize, a: f64, b: f64| a + (b - a) * (i as f64 + 0.5) / GRID as f64;
    (0..GRID * GRID)
        .map(|k| Uv::new(at(k / GRID, u0, u1), at(k % GRID, v0, v1)))
        .filter(|&uv| is_inside_polygons(&outline, uv))
        .filter_map(|uv| Some((face.surface.evaluate(uv), face.surface.normal(uv)? * sign)))
        .collect()
}

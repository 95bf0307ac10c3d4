//! Which triangles of the transition lie inside what the border bounds: of all once, then of those that refinement made.

use super::delaunay::{DelaunayMesh, Vertex};
use crate::math::Enclosure;
use crate::tessellate::flooding::{Side, Steps, faces_inside, flood};
use crate::tessellate::nodes::edge_key;
use rustc_hash::FxHashSet;
use spade::Triangulation;
use spade::handles::{FaceHandle, FixedVertexHandle, InnerTag};

/// A face of the triangulation other than the outer one.
type InnerFace<'c> = FaceHandle<'c, InnerTag, Vertex, (), spade::CdtEdge<()>, ()>;

/// Where the faces of a triangulation lie.
pub(super) struct Sides {
    /// What the border bounds, where constraints are missing: a walk over the faces would leak through the gap.
    by_centre: Option<Enclosure>,
    /// Of each face by its index, whether it lies inside; `None` where the walk from outside did not come.
    inside: Vec<Option<bool>>,
    /// Vertices that the triangulation had then.
    vertices: usize,
    /// Faces that were queried, and sides that were examined for it, since the beginning.
    asked: usize,
    looked: usize,
}

impl Sides {
    /// Asks all faces: by crossings of the border from outside, or by their centres within `by_centre` where constraints are missing.
    pub(super) fn new(mesh: &DelaunayMesh<'_, '_>, by_centre: Option<Enclosure>) -> Self {
        let cdt = &mesh.cdt;
        let vertices = cdt.num_vertices();
        if by_centre.is_some() {
            let inside = vec![None; cdt.num_all_faces()];
            let mut sides = Self { by_centre, inside, vertices, asked: 0, looked: 0 };
            cdt.inner_faces().for_each(|face| sides.ask_centre(mesh, face));
            return sides;
        }
        let (inside, Steps { asked, looked }) = faces_inside(cdt, |side| turns(mesh, side));
        Self { by_centre, inside, vertices, asked, looked }
    }

    /// Asks the faces that have come since. Each has a corner that has come too: a vertex that is inserted changes no others.
    pub(super) fn update(&mut self, mesh: &DelaunayMesh<'_, '_>) {
        let cdt = &mesh.cdt;
        self.inside.resize(cdt.num_all_faces(), None);
        let new = (self.vertices..cdt.num_vertices()).map(FixedVertexHandle::from_index);
        let faces = new.flat_map(|v| cdt.vertex(v).out_edges()).filter_map(|e| e.face().as_inner());
        let faces: Vec<InnerFace<'_>> = faces.collect();
        self.vertices = cdt.num_vertices();
        // A face that was divided or turned left its index to one of them.
        faces.iter().for_each(|f| self.inside[f.index()] = None);
        if self.by_centre.is_some() {
            for &face in faces.iter() {
                if self.inside[face.index()].is_none() {
                    self.ask_centre(mesh, face);
                }
            }
            return;
        }
        let around = faces.iter().flat_map(|f| f.adjacent_edges()).map(|e| e.rev().face().fix());
        // Each once: of the outer face all sides are looked at, and on a border of thousands all new faces lie beside it.
        let mut seen = FxHashSet::default();
        let known: Vec<_> = around.filter(|f| self.inside[f.index()].is_some() && seen.insert(f.index())).collect();
        let steps = flood(cdt, &mut self.inside, known, |side| turns(mesh, side));
        self.asked += steps.asked;
        self.looked += steps.looked;
    }

    /// Returns the nodes of the faces inside, in the order of the faces.
    pub(super) fn inner_triangles(&self, mesh: &DelaunayMesh<'_, '_>) -> Vec<[u32; 3]> {
        let inner = mesh.cdt.inner_faces().filter(|f| self.inside[f.index()] == Some(true));
        inner.map(nodes_of_face).collect()
    }

    /// Asks whether the centre of a face lies inside.
    fn ask_centre(&mut self, mesh: &DelaunayMesh<'_, '_>, face: InnerFace<'_>) {
        let [a, b, c] = nodes_of_face(face).map(|n| mesh.nodes[n].uv);
        self.inside[face.index()] = self.by_centre.as_ref().map(|border| border.encloses((a + b + c) / 3.0));
        self.asked += 1;
    }
}

/// Whether the border runs along a side an odd number of times, so that the answer turns there.
fn turns(mesh: &DelaunayMesh<'_, '_>, side: &Side<'_, Vertex>) -> bool {
    side.is_constraint_edge() && {
        let name = edge_key(side.from().data().node, side.to().data().node);
        mesh.border.get(&name).is_some_and(|n| n % 2 == 1)
    }
}

/// Returns the nodes of a face's corners.
fn nodes_of_face(face: InnerFace<'_>) -> [u32; 3] {
    face.vertices().map(|v| v.data().node)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Uv};
    use crate::nurbs::sweep;
    use crate::tessellate::face_surface::FaceSurface;
    use crate::tessellate::nodes::Nodes;
    use crate::tessellate::settings::ToleranceField;
    use crate::tessellate::taken_chords::NO_CHORDS;

    /// Corners along each loop of the border.
    const CORNERS: u32 = 40;

    /// A ring of a tube's parameters with an island in its hole, in loops of [`CORNERS`]; each point that is inserted, on either side,
    /// costs tests of the triangles around it alone, and the results are those of testing all anew.
    #[test]
    fn new_triangles_alone_are_asked() {
        let tube = sweep::cylinder(&Frame::IDENTITY, 10.0, [0.0, 3.0], [0.0, 40.0]);
        let field = ToleranceField::new([0.1; 2], [1.0, 10.0], Default::default(), 1.0);
        let surface = FaceSurface::new(&tube, false, field);
        let [[u0, u1], _] = tube.domain();
        let at = |radius: f64, angle: f64| {
            let (sin, cos) = angle.sin_cos();
            Uv::new(0.5 * (u0 + u1) + radius * (u1 - u0) * cos, 20.0 + radius * 40.0 * sin)
        };
        for centres in [false, true] {
            let mut nodes = Nodes::default();
            let (mut segments, mut lines) = (Vec::new(), Vec::new());
            for (k, radius) in [0.45, 0.3, 0.1].into_iter().enumerate() {
                let first = k as u32 * CORNERS;
                for i in 0..CORNERS {
                    let uv = at(radius, f64::from(i) * std::f64::consts::TAU / f64::from(CORNERS));
                    nodes.push_own(uv, tube.evaluate(uv));
                    segments.push([first + i, first + (i + 1) % CORNERS]);
                }
            }
            lines.extend(segments.iter().map(|s| s.map(|n| nodes[n].uv)));
            let mut mesh = DelaunayMesh::new(&surface, nodes, Uv::ONE, &NO_CHORDS);
            mesh.insert_nodes(&segments, &[]).expect("parameters of a tube");
            assert_eq!(mesh.constrain_border(&segments), [Vec::<[u32; 2]>::new(), Vec::new()]);
            let by_centre = || centres.then(|| Enclosure::new(lines.clone()));
            let mut sides = Sides::new(&mesh, by_centre());
            let at_first = sides.asked;
            assert!(at_first + 1 >= mesh.cdt.num_inner_faces(), "{at_first}");
            // In the ring, in its hole and on the island.
            for (k, radius) in [0.37, 0.4, 0.2, 0.05, 0.35].into_iter().enumerate() {
                let uv = at(radius, 0.7 + k as f64);
                let node = mesh.nodes.push_own(uv, tube.evaluate(uv));
                let vertex = mesh.insert_node(node, None);
                mesh.handles.push(vertex);
                sides.update(&mesh);
                assert_eq!(sides.inside, Sides::new(&mesh, by_centre()).inside);
            }
            let around = (3 * CORNERS..3 * CORNERS + 5).filter_map(|n| mesh.handles[n as usize]);
            let around: usize = around.map(|v| mesh.cdt.vertex(v).out_edges().count()).sum();
            assert!(sides.asked - at_first <= 2 * around, "{} of {around}", sides.asked - at_first);
            assert!(2 * around < at_first, "too small to tell");
            // Points beside as many sides of the outer loop: all its sides are looked at once, not once for each, which makes 16 a corner.
            let before = sides.looked;
            let beside = 10;
            for k in 0..beside {
                let uv = at(0.446, (f64::from(4 * k) + 0.5) * std::f64::consts::TAU / f64::from(CORNERS));
                let node = mesh.nodes.push_own(uv, tube.evaluate(uv));
                let vertex = mesh.insert_node(node, None);
                mesh.handles.push(vertex);
            }
            sides.update(&mesh);
            let looked = sides.looked - before;
            assert!(centres || looked > 0 && looked < 12 * CORNERS as usize, "{looked}");
        }
    }
}

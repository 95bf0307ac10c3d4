//! What rounds of meshing a part reuse of the one before: faces none of whose edges has changed, with their corners renumbered.

use super::border::edges::Division;
use super::face_mesh::FaceMesh;
use super::nodes::Position;
use super::taken_chords::TakenChords;
use crate::model::{EdgeId, Face, Part};
use rayon::prelude::*;

/// What a part looked like before some of its edges were sampled more densely.
pub(super) struct PreviousRound {
    pub(super) divisions: Vec<Division>,
    /// How many shared positions there were.
    pub(super) shared: usize,
    pub(super) meshes: Vec<Option<FaceMesh>>,
}

impl PreviousRound {
    /// Returns the meshes of faces on the edges divided anew, and which of them were kept: few edges change, and a face whose own did not
    /// is as it was, but for the numbers of its corners. The others are made by `mesh`.
    pub(super) fn meshed_again<'f, S: Sync>(
        self,
        part: &Part,
        faces: &[(&'f Face, S)],
        divisions: &[Division],
        mesh: impl Fn(&(&'f Face, S)) -> Option<FaceMesh> + Sync,
    ) -> (Vec<Option<FaceMesh>>, Vec<bool>) {
        let renumbering = Renumbering::new(part, (&self.divisions, self.shared), divisions);
        let is_unchanged =
            |face: &Face| !face.loops.iter().flat_map(|l| &l.uses).any(|u| renumbering.has_changed(u.edge));
        let renew = |(face, old): (&(&'f Face, S), Option<FaceMesh>)| match old {
            Some(old) if is_unchanged(face.0) => (Some(renumbering.renumbered(old)), true),
            _ => (mesh(face), false),
        };
        faces.par_iter().zip(self.meshes).map(renew).unzip()
    }
}

/// Maps shared positions from one division of a part's edges to another, and knows which edges differ between the two.
pub(super) struct Renumbering {
    /// By edge.
    changed: Vec<bool>,
    to: Vec<u32>,
    /// Whether a position of the first division is one of the second.
    is_kept: Vec<bool>,
}

impl Renumbering {
    /// Compares two divisions of a part's edges; `shared` is the number of positions that went with the first. Inner positions of changed
    /// edges keep their old numbers, which mean nothing any more.
    pub(super) fn new(part: &Part, (before, shared): (&[Division], usize), now: &[Division]) -> Self {
        let mut to: Vec<u32> = (0..shared as u32).collect();
        let mut is_kept = vec![true; shared];
        let mut changed = Vec::with_capacity(part.edges.len());
        for (old, new) in before.iter().zip(now) {
            changed.push(old.t != new.t);
            // Inner samples alone move: vertices come first in any division.
            for k in 0..old.t.len() as u32 - 2 {
                let position = (old.first + k) as usize;
                is_kept[position] = old.t == new.t;
                if old.t == new.t {
                    to[position] = new.first + k;
                }
            }
        }
        Self { changed, to, is_kept }
    }

    /// Whether an edge is divided otherwise than before; false without an edge, true for one that the part does not have.
    pub(super) fn has_changed(&self, edge: Option<EdgeId>) -> bool {
        edge.is_some_and(|e| self.changed.get(e.0 as usize).is_none_or(|&c| c))
    }

    /// Returns the mesh with its shared positions renumbered. That of a face with a changed edge is of no use until it is made anew.
    pub(super) fn renumbered(&self, mut mesh: FaceMesh) -> FaceMesh {
        for corner in &mut mesh.corners {
            if let Position::Shared(p) = &mut corner.position {
                *p = self.to[*p as usize];
            }
        }
        mesh.coincident.iter_mut().flatten().for_each(|p| *p = self.to[*p as usize]);
        mesh
    }

    /// Returns the chords with their ends renumbered, without those that end inside a changed edge, where no position is what it was.
    pub(super) fn renumbered_chords(&self, taken: &TakenChords) -> TakenChords {
        let renumbered = |p: u32| self.is_kept[p as usize].then(|| self.to[p as usize]);
        let mut out = TakenChords::default();
        out.extend(taken.iter().filter_map(|[a, b]| {
            let (a, b) = (renumbered(a)?, renumbered(b)?);
            Some([a.min(b), a.max(b)])
        }));
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Point, Uv, Vector};
    use crate::model::{Edge, EdgeUse, TrimLoop, VertexId};
    use crate::nurbs::{Curve, UvCurve, sweep};
    use crate::tessellate::face_mesh::Corner;
    use std::sync::atomic::{AtomicU32, Ordering};

    /// A face beside one edge; what else bounds it does not matter here.
    fn face_beside(edge: u32) -> Face {
        let uv = UvCurve::line(Uv::ZERO, Uv::X, [0.0, 1.0]);
        let uses = vec![EdgeUse { edge: Some(EdgeId(edge)), reversed: false, uv }];
        let plane = sweep::plane(&Frame::IDENTITY, [[0.0, 1.0]; 2]);
        Face { loops: vec![TrimLoop { uses }], ..Face::whole(plane) }
    }

    /// An edge with so many inner samples, of which the first is this shared position.
    fn division(inner: u32, first: u32) -> Division {
        Division { t: (0..inner + 2).map(|k| f64::from(k) / f64::from(inner + 1)).collect(), first }
    }

    /// A mesh with corners at these shared positions, of which the last two are one.
    fn mesh_at(shared: [u32; 3]) -> FaceMesh {
        let corner = |p| Corner { position: Position::Shared(p), normal: Vector::Z, uv: Uv::ZERO };
        let coincident = vec![[shared[1], shared[2]]];
        FaceMesh { corners: shared.map(corner).to_vec(), coincident, ..FaceMesh::default() }
    }

    /// Two edges between the vertices 0 and 1 with samples at 2, 3 and at 4, 5; the first gets a third, and those of the other move up.
    #[test]
    fn faces_beside_unchanged_edges_are_kept() {
        let curve = Curve::line(Point::ZERO, Point::X, [0.0, 1.0]);
        let edge = Edge { curve, vertices: [VertexId(0), VertexId(1)], entity: None };
        let part =
            Part { vertices: vec![Point::ZERO, Point::X], edges: vec![edge.clone(), edge], ..Part::default() };
        let before = PreviousRound {
            divisions: vec![division(2, 2), division(2, 4)],
            shared: 6,
            meshes: vec![Some(mesh_at([0, 2, 3])), Some(mesh_at([1, 4, 5])), None],
        };
        let faces = [0, 1, 1].map(face_beside);
        let faces: Vec<(&Face, ())> = faces.iter().map(|face| (face, ())).collect();
        let made = AtomicU32::new(0);
        let (meshes, kept) = before.meshed_again(&part, &faces, &[division(3, 2), division(2, 5)], |_| {
            made.fetch_add(1, Ordering::Relaxed);
            Some(mesh_at([0, 1, 6]))
        });
        // The first lies beside the edge that has changed, the last was not meshed before.
        assert_eq!((kept, made.into_inner()), (vec![false, true, false], 2));
        let positions = |mesh: &Option<FaceMesh>| {
            let mesh = mesh.as_ref().unwrap();
            (mesh.corners.iter().map(|c| c.position).collect::<Vec<_>>(), mesh.coincident.clone())
        };
        let at = |shared: [u32; 3]| (shared.map(Position::Shared).to_vec(), vec![[shared[1], shared[2]]]);
        assert_eq!(meshes.iter().map(positions).collect::<Vec<_>>(), [at([0, 1, 6]), at([1, 5, 6]), at([0, 1, 6])]);
    }
}

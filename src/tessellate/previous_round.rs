//! What rounds of meshing a part keep of the one before: faces of which no edge has changed, with the numbers of their corners put right.

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

//! Chords that an edge of the mesh has already: an edge between two positions belongs to two facets, be they of one face or of two.
//!
//! Two faces that share two vertices, such as both flanks of a blade, may each have a diagonal between them, and a diagonal may run
//! where an edge of the file is one chord. The mesh would have one edge with four facets there. All but one of the faces are meshed
//! again without it.

use super::face_mesh::FaceMesh;
use super::nodes::Position;
use rayon::prelude::*;
use rustc_hash::{FxBuildHasher, FxHashMap, FxHashSet};
use std::ops::Range;

/// Chords between shared positions that a face must not have inside.
#[derive(Clone, Debug, Default)]
pub(super) struct TakenChords(FxHashSet<[u32; 2]>);

/// Nothing is taken.
pub(super) static NO_CHORDS: TakenChords = TakenChords(FxHashSet::with_hasher(FxBuildHasher));

impl TakenChords {
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether the chord between two positions is taken; never if one of them is the face's own.
    pub(super) fn contains(&self, ends: [Position; 2]) -> bool {
        match ends {
            [Position::Shared(a), Position::Shared(b)] => self.0.contains(&[a.min(b), a.max(b)]),
            _ => false,
        }
    }

    /// Goes through the chords, by both positions in ascending order, in no order of their own.
    pub(super) fn iter(&self) -> impl Iterator<Item = [u32; 2]> {
        self.0.iter().copied()
    }

    /// Adds chords, each by both positions in ascending order.
    pub(super) fn extend(&mut self, more: impl IntoIterator<Item = [u32; 2]>) {
        self.0.extend(more);
    }
}

/// Returns the faces with diagonals that must go because the chord is the side of more than two facets of the shell, with these diagonals;
/// `shells` are the numbers of faces of each shell, in the order of `meshes`; the last of several diagonals stays where no other chord is.
/// Chords that a face had to give up before, `taken`, are not returned again, nor any of a face that `is_settled`.
pub(super) fn doubled_chords(
    shells: impl Iterator<Item = usize>,
    meshes: &[Option<FaceMesh>],
    taken: &[TakenChords],
    is_settled: impl Fn(usize) -> bool,
) -> Vec<(usize, Vec<[u32; 2]>)> {
    let mut doubled: Vec<(usize, Vec<[u32; 2]>)> = Vec::new();
    let mut first = 0;
    for faces in shells {
        let range = first..first + faces;
        first = range.end;
        let Chords { mut uses, diagonals } = Chords::new(meshes, range);
        for (k, chord) in diagonals {
            let stays = is_settled(k) || taken[k].0.contains(&chord);
            // Where only diagonals are, one of them stays.
            let Some(left) = uses.get_mut(&chord).filter(|left| **left > 2 && !stays) else { continue };
            // A diagonal is two sides: with it gone the chord has two facets less.
            *left -= 2;
            match doubled.last_mut() {
                Some((last, chords)) if *last == k => chords.push(chord),
                _ => doubled.push((k, vec![chord])),
            }
        }
    }
    doubled
}

/// The chords between shared positions of some faces, by both positions in ascending order.
struct Chords {
    /// How many sides of facets each chord is.
    uses: FxHashMap<[u32; 2], u32>,
    /// Chords that are two sides within one face, with that face, in order of the faces.
    diagonals: Vec<(usize, [u32; 2])>,
}

impl Chords {
    /// Counts how many sides of facets each chord of the faces in `range` is, and which chords one face has twice; unmeshed faces have
    /// none.
    fn new(meshes: &[Option<FaceMesh>], range: Range<usize>) -> Self {
        let own: Vec<(usize, FxHashMap<[u32; 2], u32>)> = range
            .into_par_iter()
            .with_min_len(16)
            .filter_map(|k| Some((k, own_chords(meshes[k].as_ref()?))))
            .collect();
        let most = own.iter().map(|(_, chords)| chords.len()).sum();
        let mut uses: FxHashMap<[u32; 2], u32> = FxHashMap::with_capacity_and_hasher(most, FxBuildHasher);
        let mut diagonals: Vec<(usize, [u32; 2])> = Vec::new();
        for (k, own) in own {
            // Counted by face first: a face that has a chord twice has it as a diagonal.
            for (chord, count) in own {
                *uses.entry(chord).or_default() += count;
                if count > 1 {
                    diagonals.push((k, chord));
                }
            }
        }
        diagonals.sort_unstable();
        Self { uses, diagonals }
    }
}

/// Returns how many sides of a face's facets each chord between shared positions is.
fn own_chords(mesh: &FaceMesh) -> FxHashMap<[u32; 2], u32> {
    let mut own: FxHashMap<[u32; 2], u32> =
        FxHashMap::with_capacity_and_hasher(2 * mesh.facets.len(), FxBuildHasher);
    for facet in &mesh.facets {
        let at = facet.corners.map(|c| mesh.corners[c as usize].position);
        for i in 0..4 {
            if let [Position::Shared(a), Position::Shared(b)] = [at[i], at[(i + 1) % 4]]
                // A triangle repeats a corner: that side is none.
                && a != b
            {
                *own.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
    }
    own
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Uv, Vector};
    use crate::tessellate::face_mesh::{Corner, MeshedFacet};

    #[test]
    fn a_chord_is_asked_of_a_face_that_can_still_give_it_up() {
        // Both faces of a shell have the diagonal from 0 to 2, the first of another shell too.
        let corner = |k| Corner { position: Position::Shared(k), normal: Vector::Z, uv: Uv::ZERO };
        let facet = |corners| MeshedFacet { corners, bound: 0.0, tolerance: 1.0 };
        let facets = vec![facet([0, 1, 2, 2]), facet([0, 2, 3, 3])];
        let mesh = Some(FaceMesh { corners: (0..4).map(corner).collect(), facets, ..FaceMesh::default() });
        let meshes = [mesh.clone(), mesh.clone(), mesh];
        let mut taken = vec![TakenChords::default(); 3];
        let asked = |taken: &[TakenChords], settled: usize| {
            doubled_chords([2, 1].into_iter(), &meshes, taken, |k| k == settled)
        };
        assert_eq!(asked(&taken, 9), [(0, vec![[0, 2]])]);
        assert_eq!(asked(&taken, 0), [(1, vec![[0, 2]])]);
        taken[0].extend([[0, 2]]);
        assert_eq!(asked(&taken, 9), [(1, vec![[0, 2]])]);
    }
}

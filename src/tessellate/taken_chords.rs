//! Chords that an edge of the mesh has already: an edge between two positions belongs to two facets, be they of one face or of two.
//!
//! Two faces that share two vertices, such as both flanks of a blade, may each have a diagonal between them, and a diagonal may run
//! where an edge of the file is one chord. The mesh would have one edge with four facets there. All but one of the faces are meshed
//! again without it.

use super::face_mesh::FaceMesh;
use super::nodes::Position;
use crate::model::Part;
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

    pub(super) fn extend(&mut self, more: impl IntoIterator<Item = [u32; 2]>) {
        self.0.extend(more);
    }
}

/// Returns the faces of a part with diagonals that must go because the chord is the side of more than two facets of the shell, with these
/// diagonals; the last of several diagonals stays where no other chord is. `taken` is what each face was asked to give up before, and is
/// not asked for again.
pub(super) fn doubled_chords(
    part: &Part,
    meshes: &[Option<FaceMesh>],
    taken: &[TakenChords],
) -> Vec<(usize, Vec<[u32; 2]>)> {
    let mut doubled: Vec<(usize, Vec<[u32; 2]>)> = Vec::new();
    let mut first = 0;
    for shell in &part.shells {
        let range = first..first + shell.faces.len();
        first = range.end;
        let Chords { mut uses, diagonals } = Chords::new(meshes, range);
        for (k, chord) in diagonals {
            let asked_before = taken[k].0.contains(&chord);
            // Where only diagonals are, one of them stays.
            let Some(left) = uses.get_mut(&chord).filter(|left| **left > 2 && !asked_before) else { continue };
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
        let mut uses: FxHashMap<[u32; 2], u32> = FxHashMap::default();
        let mut diagonals: Vec<(usize, [u32; 2])> = Vec::new();
        for k in range {
            let Some(mesh) = &meshes[k] else { continue };
            let mut own: FxHashMap<[u32; 2], u32> = FxHashMap::default();
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

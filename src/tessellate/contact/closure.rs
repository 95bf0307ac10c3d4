//! Whether facets fill their border without gap or overlap, decided by how often each side of a facet is used.

use crate::tessellate::face_mesh::FaceMesh;
use crate::tessellate::nodes::Position;
use rustc_hash::FxHashMap;

/// How often each side between two positions is used.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SideCounts(FxHashMap<[Position; 2], u32>);

impl SideCounts {
    /// Counts sides, whichever way they run; what is one point in space is none.
    pub(super) fn new(sides: impl Iterator<Item = [Position; 2]>) -> Self {
        let mut counts: FxHashMap<[Position; 2], u32> = FxHashMap::default();
        for [a, b] in sides.filter(|[a, b]| a != b) {
            *counts.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
        Self(counts)
    }

    /// Counts the sides of a face's facets.
    pub(super) fn of_facets(mesh: &FaceMesh) -> Self {
        let position = |c: u32| mesh.corners[c as usize].position;
        let sides = |f: [u32; 4]| (0..4).map(move |k| [f[k], f[(k + 1) % 4]].map(position));
        Self::new(mesh.facets.iter().flat_map(|f| sides(f.corners)))
    }

    /// Whether a face with these sides has this border: each of the border's sides is used as often as it stands there, which is twice
    /// for a seam, and any other by two facets.
    pub(super) fn fill(&self, border: &Self) -> bool {
        let asked = |side: &[Position; 2]| border.0.get(side).copied().unwrap_or(2);
        !self.0.is_empty()
            && self.0.iter().all(|(side, count)| *count == asked(side))
            && border.0.keys().all(|side| self.0.contains_key(side))
    }

    /// Returns the sides that one facet alone uses, with their positions replaced by what `moved` gives; `None` where it gives none.
    pub(super) fn border(&self, moved: impl Fn(Position) -> Option<Position>) -> Option<Self> {
        let single = self.0.iter().filter(|(_, count)| **count == 1);
        let sides: Option<Vec<[Position; 2]>> = single.map(|([a, b], _)| Some([moved(*a)?, moved(*b)?])).collect();
        Some(Self::new(sides?.into_iter()))
    }
}

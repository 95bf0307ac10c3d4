//! How often a face may be meshed anew, for a denser border or for chords that another face has: until its facets in all rounds together
//! weigh as much as the steps that its proofs may take. A face of 700,000 facets in a file of 17 kB was meshed six times.

use super::face_mesh::FaceMesh;
use super::settings::Settings;
use crate::model::Face;
use rustc_hash::FxHashSet;

/// Steps of a proof, as [`Settings::most_steps`] counts them, that take as long as one facet with its place in the triangulation: 20 µs.
const STEPS_OF_FACET: u64 = 10_000;

/// The facets that each face of a part has been meshed into, in all rounds together, and how many they may be before one more.
pub(super) struct RemeshBudget {
    made: Vec<u64>,
    most: u64,
}

impl RemeshBudget {
    /// Makes the budget of so many faces, of which nothing is spent yet.
    pub(super) fn new(faces: usize, settings: &Settings) -> Self {
        Self { made: vec![0; faces], most: settings.most_steps / STEPS_OF_FACET }
    }

    /// Counts the facets of a face that was meshed, or meshed anew.
    pub(super) fn spend(&mut self, face: usize, mesh: Option<&FaceMesh>) {
        self.made[face] += mesh.map_or(0, |m| m.facets.len() as u64);
    }

    /// Whether a face has used up its budget and is not to be meshed anew.
    pub(super) fn is_spent(&self, face: usize) -> bool {
        self.made[face] > self.most
    }

    /// Returns the edges that stay as they are divided: those of faces that are not to be meshed anew.
    pub(super) fn edges_of_spent<'f>(&self, faces: impl Iterator<Item = &'f Face>) -> FxHashSet<usize> {
        // Also where the face on the other side requests it: with the edge both would be meshed again.
        let spent = faces.enumerate().filter(|(k, _)| self.is_spent(*k));
        spent
            .flat_map(|(_, face)| &face.loops)
            .flat_map(|l| &l.uses)
            .filter_map(|u| Some(u.edge?.0 as usize))
            .collect()
    }
}

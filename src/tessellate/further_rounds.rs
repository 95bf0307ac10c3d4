//! Which faces may still be meshed anew with denser borders: a face of 700,000 facets in a file of 17 kB was meshed six times.

use super::face_mesh::FaceMesh;
use super::settings::Settings;
use crate::model::Face;
use rustc_hash::FxHashSet;

/// Steps of a proof, as [`Settings::most_steps`] counts them, that take as long as one facet with its place in the triangulation: 20 µs.
const STEPS_OF_FACET: u64 = 10_000;

/// The facets that each face of a part has been meshed into, in all rounds together.
pub(super) struct FurtherRounds {
    made: Vec<u64>,
    most: u64,
}

impl FurtherRounds {
    /// Before the first round, for a part of so many faces.
    pub(super) fn new(faces: usize, settings: &Settings) -> Self {
        Self { made: vec![0; faces], most: settings.most_steps / STEPS_OF_FACET }
    }

    /// Counts the facets of the faces that were meshed in this round: of those that `is_new` names.
    pub(super) fn count(&mut self, meshes: &[Option<FaceMesh>], is_new: impl Fn(usize) -> bool) {
        for (k, mesh) in meshes.iter().enumerate().filter(|(k, _)| is_new(*k)) {
            self.made[k] += mesh.as_ref().map_or(0, |m| m.facets.len() as u64);
        }
    }

    /// Whether a face has been meshed into as many facets as it may be for the sake of a better border.
    pub(super) fn are_over(&self, face: usize) -> bool {
        self.made[face] > self.most
    }

    /// Returns the edges that stay as they are divided: those of faces whose rounds are over.
    pub(super) fn settled_edges<'f>(&self, faces: impl Iterator<Item = &'f Face>) -> FxHashSet<usize> {
        // Also where the face on the other side asks: with the edge both would be meshed again.
        let over = faces.enumerate().filter(|(k, _)| self.are_over(*k));
        over.flat_map(|(_, face)| &face.loops)
            .flat_map(|l| &l.uses)
            .filter_map(|u| Some(u.edge?.0 as usize))
            .collect()
    }
}

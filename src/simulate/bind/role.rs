//! Faces by what light meets on them.

use super::bound_scene::BoundScene;
use crate::math::FaceId;
use crate::simulate::surfaces::Surface;

impl BoundScene {
    /// What a face can be for light, as [`BoundScene::faces_in_role`] takes it.
    pub const ROLES: [&'static str; 4] = ["mirror", "interface", "coated", "absorber"];

    /// Returns the placed faces with a role of [`BoundScene::ROLES`], in order: plain mirrors, bare interfaces, faces with a coating or
    /// scatter, or absorbers. Empty for any other word. An interface is listed whether or not it has a medium.
    pub fn faces_in_role(&self, role: &str) -> Vec<FaceId> {
        let is = |surface: &Surface| match surface {
            Surface::Mirror(_) => role == "mirror",
            Surface::Interface => role == "interface",
            Surface::Coated(_) => role == "coated",
            Surface::Absorber => role == "absorber",
        };
        let ids = (0u32..).zip(&self.faces);
        ids.filter(|(_, f)| is(&self.surfaces[f.surface as usize])).map(|(k, _)| FaceId(k)).collect()
    }
}

//! A scene bound to a model.

use crate::math::{Aabb, BoxTree, FaceId};
use crate::simulate::body::{AMBIENT, Body};
use crate::simulate::emitter::Emitter;
use crate::simulate::receiver::Receiver;
use crate::simulate::scene::{PowerUnit, Run, Scene};
use crate::simulate::surfaces::{FaceOptics, SceneLight, Surface};
use serde::Serialize;

/// The faces that one rule decides: of all rules that select a face, the last that gives a surface and the last that gives a medium decide.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RuleFaces {
    /// Number of the `[[material]]`, from 1; `None` for the faces that no rule names.
    pub rule: Option<usize>,
    /// Its selectors as the scene file has them; empty for all faces.
    pub selects: String,
    /// What it gives: the medium, the surface.
    pub gives: String,
    /// The faces, as their numbers in the model.
    pub faces: Vec<u32>,
}

/// A scene whose rules have found their faces: everything a simulation needs but the intersector.
#[derive(Clone, Debug)]
pub struct BoundScene {
    pub(crate) scene: Scene,
    /// Optics of each placed face.
    pub(crate) faces: Vec<FaceOptics>,
    /// The distinct surfaces, which faces name by index.
    pub(crate) surfaces: Vec<Surface>,
    /// The bodies, of which the first is the surroundings.
    pub(crate) bodies: Vec<Body>,
    pub(crate) light: SceneLight,
    /// Whether bodies may touch or lie inside each other, so that paths need a stack of media.
    pub(crate) nested: bool,
    /// Whether a face that may lie on one of another body has a surface of its own.
    pub(crate) coated_contacts: bool,
    pub(crate) emitters: Vec<Emitter>,
    pub(crate) receivers: Vec<Receiver>,
    /// Around all faces and the places of the sources, with room to spare.
    pub(crate) region: Aabb,
    /// Boxes around bodies and faces of opaque solids, which show the sources that lie clear of them; `None` where these are few.
    pub(crate) solids: Option<BoxTree>,
    /// Names of the instances, and the instance of each face.
    pub(crate) instances: Vec<String>,
    pub(crate) instance_of_face: Vec<u32>,
    /// The `#id` of each face in its file; `None` for one that came from none.
    pub(crate) entity_of_face: Vec<Option<u64>>,
    /// Which faces each rule decides.
    pub(crate) rules: Vec<RuleFaces>,
    /// Sentences about what in the scene is open or beyond its tables.
    pub(crate) notes: Vec<String>,
}

/// How far a ray that escapes is drawn, mm, at least: it is seen to leave a small model, and a lone source.
const DRAWN_LENGTH: f64 = 100.0;

/// How far a ray that escapes is drawn, in diagonals of the box around faces and sources. One leads out of it from anywhere in it; half of
/// one more is what is shown around it.
const DRAWN_DIAGONALS: f64 = 1.5;

impl BoundScene {
    /// Returns how far a ray that escapes is drawn, mm: past all faces, wherever it starts.
    pub(crate) fn drawn_length(&self) -> f64 {
        DRAWN_LENGTH.max(DRAWN_DIAGONALS * self.region.diagonal())
    }

    /// Returns the names of the instance and the medium of a body, by its number in lost rays, 0 for the surroundings; `None` beyond the
    /// last.
    pub fn body_names(&self, body: u32) -> Option<[&str; 2]> {
        self.bodies.get(body as usize).map(|b| [b.name.as_str(), b.medium.as_str()])
    }

    /// Returns how many faces are listed in the results, ranked by the power that they absorb and let out.
    pub(crate) fn listed_faces(&self) -> usize {
        self.scene.run.faces as usize
    }

    /// Whether the run tallies the power that enters and leaves through each face: `run.faces` is above 0.
    pub(crate) fn counts_faces(&self) -> bool {
        self.scene.run.faces > 0
    }

    /// The body that light enters through a face; `None` where the face lets none in or no medium lies behind it.
    pub fn entered_body(&self, face: FaceId) -> Option<u32> {
        let optics = self.faces.get(face.index())?;
        let lets_in = optics.body != AMBIENT && !self.surfaces[usize::from(optics.surface)].is_opaque();
        lets_in.then_some(optics.body)
    }

    /// Returns the index of a body over that of the surroundings, at the wavelength of the scene; 1 for a number without a body.
    pub fn relative_index(&self, body: u32) -> f64 {
        let ambient = self.bodies[AMBIENT as usize].index(None);
        self.bodies.get(body as usize).map_or(1.0, |b| b.index(None) / ambient)
    }

    /// Returns the only wavelength of its light, nm; `None` where there are several, and where lumens are counted of light of which the
    /// scene says no wavelength: that of the helium d line then stands for the indices of media alone.
    pub fn single_wavelength_nm(&self) -> Option<f64> {
        let SceneLight { wavelength, coloured } = self.light;
        let supposed = self.scene.run.unit == PowerUnit::Lumen && wavelength == Run::default().wavelength_nm;
        (!coloured && !supposed).then_some(wavelength)
    }

    /// Returns sentences that someone who reads the results must know: bodies that are open or too thin, light beyond the wavelengths of a
    /// table.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Returns which faces each rule of the scene decides; last, if there are any, those that no rule names.
    pub fn rules(&self) -> &[RuleFaces] {
        &self.rules
    }

    /// Returns the name of the instance of a placed face, by the face's number in the model; `None` where there is no such face.
    pub fn instance(&self, face: u32) -> Option<&str> {
        let instance = *self.instance_of_face.get(face as usize)?;
        self.instances.get(instance as usize).map(String::as_str)
    }

    /// Returns what a placed face is called in a sentence, by its number in the model, with its instance.
    pub(crate) fn face_label(&self, face: u32) -> String {
        let entity = self.entity_of_face.get(face as usize).copied().flatten();
        let what = entity.map_or_else(|| format!("face {face}"), |id| format!("face #{id}"));
        format!("{what} of '{}'", self.instance(face).unwrap_or_default())
    }

    /// Returns the scene as it was read.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Whether rays have to carry a medium: a face lets light into one, a source is stated to lie in one, or the surroundings absorb or
    /// scatter.
    pub(crate) fn has_media(&self) -> bool {
        // Any of these needs a medium on the ray: faces that let light in, sources inside of bodies, surroundings
        // that do something to light.
        let lets_in = |f: &FaceOptics| f.body != AMBIENT && !self.surfaces[f.surface as usize].is_opaque();
        let ambient = &self.bodies[AMBIENT as usize];
        self.faces.iter().any(lets_in)
            || self.emitters.iter().any(|e| !e.inside.is_empty())
            || ambient.absorbs()
            || ambient.scatter.is_some()
    }

    /// Returns the name of the instance that a placed face belongs to; empty where there is no such face.
    pub fn instance_of(&self, face: FaceId) -> &str {
        self.instance_of_face.get(face.index()).map_or("", |&i| &self.instances[i as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use std::path::Path;

    /// Rays of the first source would end in empty air 200 mm before what stands around the second.
    #[test]
    fn rays_are_drawn_past_all_that_is_there() {
        let drawn = |text: &str| {
            Scene::parse(text, "s.toml", Path::new(".")).unwrap().bind(&Model::default()).unwrap().drawn_length()
        };
        let one = "[[source]]\nkind = 'point'\n";
        assert_eq!(drawn(one), DRAWN_LENGTH);
        let two = format!("{one}{one}at = [0, 0, 300]\n");
        assert!((450.0..460.0).contains(&drawn(&two)), "{}", drawn(&two));
    }
}

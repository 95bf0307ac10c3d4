//! A scene bound to a model.

use crate::math::{Aabb, FaceId};
use crate::simulate::body::{AMBIENT, Body};
use crate::simulate::emitter::Emitter;
use crate::simulate::receiver::Receiver;
use crate::simulate::scene::Scene;
use crate::simulate::surfaces::{FaceOptics, SceneLight, Surface};
use serde::Serialize;

/// The faces that one rule decides; of several that select a face, the last one does.
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
    /// By placed face.
    pub(crate) faces: Vec<FaceOptics>,
    /// Those that faces name by index.
    pub(crate) surfaces: Vec<Surface>,
    /// The surroundings first.
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
    /// Names of the instances, and the instance of each face.
    pub(crate) instances: Vec<String>,
    pub(crate) instance_of_face: Vec<u32>,
    /// Which faces each rule decides.
    pub(crate) rules: Vec<RuleFaces>,
    /// Sentences about what in the scene is open or beyond its tables.
    pub(crate) notes: Vec<String>,
}

impl BoundScene {
    /// The instance and the medium of a body, as lost rays name it.
    pub fn body(&self, body: u32) -> Option<[&str; 2]> {
        self.bodies.get(body as usize).map(|b| [b.name.as_str(), b.medium.as_str()])
    }

    /// Whether the scene asks what passes each face.
    pub(crate) fn counts_faces(&self) -> bool {
        self.scene.run.faces > 0
    }

    /// The body that light enters through a face; `None` where the face lets none in or no medium lies behind it.
    pub fn entered_body(&self, face: FaceId) -> Option<u32> {
        let optics = self.faces.get(face.index())?;
        let lets_in = optics.body != AMBIENT && !self.surfaces[usize::from(optics.surface)].is_opaque();
        lets_in.then_some(optics.body)
    }

    /// The index of a body over that of the surroundings, at the wavelength of the scene; 1 for a number without a body.
    pub fn relative_index(&self, body: u32) -> f64 {
        let ambient = self.bodies[AMBIENT as usize].index(None);
        self.bodies.get(body as usize).map_or(1.0, |b| b.index(None) / ambient)
    }

    /// What someone who reads the results must know: bodies that are open, light beyond the wavelengths of a table.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Which faces each rule of the scene decides; last, if there are any, those that no rule names.
    pub fn rules(&self) -> &[RuleFaces] {
        &self.rules
    }

    /// The instance of a face, by the face's index in the model.
    pub fn instance(&self, face: u32) -> Option<&str> {
        let instance = *self.instance_of_face.get(face as usize)?;
        self.instances.get(instance as usize).map(String::as_str)
    }

    /// The scene as it was read.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Whether any face lets light into a medium.
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

    /// Name of the instance that a face belongs to.
    pub fn instance_of(&self, face: FaceId) -> &str {
        self.instance_of_face.get(face.index()).map_or("", |&i| &self.instances[i as usize])
    }
}

//! A scene bound to a model: what every placed face does to light, as tables indexed by [`FaceId`](crate::math::FaceId).
//!
//! The order of the modules, each of which uses only those before it, is in `tests/architecture/layers.rs`.

mod bodies;
mod bound_scene;
mod contacts;
mod doubled_solids;
mod face_rules;
mod face_selectors;
mod flush_receivers;
mod frames;
mod left_out;
mod luminous;
mod materials;
mod nearest;
mod notes;
mod overlapping_receivers;
mod role;
mod rule_table;
mod select;
mod source_light;

use super::body::{AMBIENT, Body};
use super::emitter::{self, Emitter, Loaded};
use super::receiver::Receiver;
use super::scene::{Key, ReceiverKind, Scene};
use super::surfaces::{FaceOptics, Surface};
use super::{Error, ErrorKind};
use crate::math::{Aabb, Frame, Vector};
use crate::model::Model;
pub use bound_scene::{BoundScene, RuleFaces};
use face_rules::FaceRules;
pub use face_selectors::face_selectors;
pub use left_out::LeftOut;
use luminous::LuminousSearch;
use materials::{BARE_INTERFACE, SurfaceTable};
use select::FaceSearch;

/// What the box of a scene is grown by, as a share of its diagonal: room for what facets and rounding put outside the splines' boxes.
const REGION_MARGIN: f64 = 1e-3;

/// Sources from which on boxes decide which of them lie clear of all solids: for fewer, probing some rays takes less time.
const MANY_SOURCES: usize = 64;

impl Scene {
    /// Finds what every rule of the scene means in a model (all its models assembled into one, see [`Scene::assemble`]).
    ///
    /// # Errors
    /// When the scene has no source, a rule, a source or a receiver means nothing in the model, values of a rule do not go together, a face
    /// is an interface of a part without a medium, a file of a source cannot be read, a medium has no index at the light's wavelengths, or
    /// there are more surfaces or media than the tracer distinguishes.
    pub fn bind(&self, model: &Model) -> Result<BoundScene, Error> {
        if self.sources.is_empty() {
            let error = self.error(ErrorKind::Value, &[], "the scene has no source");
            return Err(error.help("add a [[source]]"));
        }
        // Light first: media are tabulated at its wavelengths.
        let loaded: Vec<Option<Loaded>> =
            self.sources.iter().enumerate().map(|(i, s)| emitter::load(self, i, s)).collect::<Result<_, _>>()?;
        let light = source_light::scene_light(self, &loaded);
        let ranges = source_light::source_ranges(self, &loaded);
        let file_notes = notes::source_file_notes(self, &loaded);
        // Bodies, from the rules that give media.
        let rules = face_rules::find_rules(self, model)?;
        let labels = model.labels();
        let (mut bodies, body_of_face, nested) = bodies::find_bodies(self, model, &rules, &light, &labels)?;
        materials::check_interfaces(self, model, &rules, &body_of_face)?;
        source_light::check_indices(self, &loaded, &bodies)?;
        // Faces, from the rules that give surfaces and from what lies against what.
        let Faces { faces, surfaces, touching_pairs } = bind_faces(self, model, &rules, &body_of_face, nested)?;
        bodies::set_trapped_lengths(self, &mut bodies, &touching_pairs);
        let is_coated_contact = |f: &FaceOptics| {
            (f.touches_body || f.touches_sibling) && surfaces[f.surface as usize] != Surface::Interface
        };
        let coated_contacts = faces.iter().any(is_coated_contact);
        // Sources and receivers.
        let source_frames: Vec<Frame> =
            (0..self.sources.len()).map(|i| source_frame(self, model, i)).collect::<Result<_, _>>()?;
        let is_opaque = |f: &FaceOptics| f.body == AMBIENT && surfaces[f.surface as usize].is_opaque();
        let opaque: Vec<bool> = faces.iter().map(is_opaque).collect();
        let mut search = LuminousSearch::new(self, model, &opaque);
        let mut emitters = Vec::new();
        for (i, loaded) in loaded.into_iter().enumerate() {
            let area = search.as_mut().map_or(Ok(None), |search| search.luminous_faces(i, &labels))?;
            // Emitters need bodies: a source says by name what it lies in.
            emitters.push(Emitter::new(self, i, &bodies, &light, loaded, area)?.placed(&source_frames[i]));
        }
        let luminous_notes = search.map_or_else(Vec::new, LuminousSearch::into_notes);
        let receivers = bind_receivers(self, model)?;
        let faces_box = model.surface_bounds();
        let scene_box = receivers.iter().map(Receiver::bounds).fold(faces_box, Aabb::union);
        start_near(self, &mut emitters, &source_frames, &bodies[AMBIENT as usize], &scene_box)?;
        let region = emitters.iter().map(Emitter::extent).fold(faces_box, Aabb::union);
        let margin = if region.is_empty() { 0.0 } else { REGION_MARGIN * region.diagonal() };
        let region = region.grown(margin);
        let mut bound = BoundScene {
            scene: self.clone(),
            // Solids of one body that touch need a stack too, for both are entered before one is left.
            nested: nested || faces.iter().any(|f| f.touches_sibling),
            faces,
            surfaces,
            bodies,
            light,
            coated_contacts,
            emitters,
            receivers,
            region,
            solids: None,
            instances: labels,
            instance_of_face: model.placed_faces().map(|f| f.instance as u32).collect(),
            entity_of_face: model.placed_faces().map(|f| f.entity()).collect(),
            rules: rule_table::rule_table(self, &rules),
            notes: notes::range_notes(self, &rules, &ranges),
        };
        bound.notes.extend(notes::invisible_light_note(self, &ranges));
        bound.notes.extend(notes::unused_media_note(self));
        bound.notes.extend(notes::replaced_rules_note(&bound.rules));
        bound.solids = (bound.emitters.len() >= MANY_SOURCES).then(|| bodies::solids(&bound, model, margin));
        bound.notes.extend(file_notes);
        bound.notes.extend(luminous_notes);
        bound.notes.extend(placement_notes(&bound, &rules, model));
        Ok(bound)
    }
}

/// Returns what a reader must know of the bodies and receivers of a scene and of how they lie to each other.
fn placement_notes(bound: &BoundScene, rules: &[FaceRules], model: &Model) -> Vec<String> {
    let mut found = Vec::new();
    found.extend(notes::opening_note(bound, model));
    found.extend(notes::filled_void_note(bound, model));
    found.extend(notes::dark_far_field_note(bound));
    found.extend(notes::shut_body_note(bound, rules));
    found.extend(notes::thin_body_note(bound));
    found.extend(notes::ready_mesh_note(model));
    found.extend(doubled_solids::doubled_solid_notes(bound, model));
    found.extend(flush_receivers::flush_receiver_notes(bound, model));
    found.extend(overlapping_receivers::overlapping_receiver_notes(bound));
    found
}

/// The faces of a model as light meets them.
struct Faces {
    faces: Vec<FaceOptics>,
    surfaces: Vec<Surface>,
    /// Pairs of bodies that may touch.
    touching_pairs: Vec<[u32; 2]>,
}

/// Makes the optics of each placed face, the table of distinct surfaces that these name by index, and the pairs of bodies that may touch:
/// none where bodies are not `nested`. A face that no rule names is a bare interface where it has a medium, else `default_surface`.
///
/// # Errors
/// When a rule gives a surface of values that do not go together, or the rules together more surfaces than can be distinguished.
fn bind_faces(
    scene: &Scene,
    model: &Model,
    rules: &[FaceRules],
    body_of_face: &[u32],
    nested: bool,
) -> Result<Faces, Error> {
    let (touching, touching_pairs) = if nested {
        contacts::touching_bodies(scene, model, body_of_face)
    } else {
        (vec![false; rules.len()], Vec::new())
    };
    let siblings = contacts::touching_siblings(scene, model, body_of_face);
    let mut surfaces = SurfaceTable::new(scene);
    let mut faces = Vec::with_capacity(rules.len());
    let mut opaque_outside = Vec::with_capacity(rules.len());
    for ((f, FaceRules { surface: rule, .. }), &body) in model.placed_faces().zip(rules).zip(body_of_face) {
        // A face with a medium and no surface is the bare boundary of that medium; one with neither has the scene's
        // default.
        let is_bare = rule.is_none() && body != AMBIENT;
        let surface = if is_bare { BARE_INTERFACE } else { surfaces.index(*rule)? };
        let closed = f.shell.is_some_and(|s| model.part(f.part).shells[s].closed);
        // Opaque from outside: what a body with a medium does behind its face is the medium's affair.
        let opaque = body == AMBIENT && surfaces.is_opaque(surface);
        opaque_outside.push(opaque);
        faces.push(FaceOptics {
            surface,
            body,
            solid: f.solid as u32,
            opaque_solid: closed && opaque,
            touches_body: touching[f.id.index()],
            touches_sibling: siblings[f.id.index()],
            medium_on_opaque: false,
        });
    }
    let on_opaque = contacts::media_on_opaque(scene, model, body_of_face, &opaque_outside);
    for (face, on_opaque) in faces.iter_mut().zip(on_opaque) {
        face.medium_on_opaque = on_opaque;
    }
    Ok(Faces { faces, surfaces: surfaces.into_surfaces(), touching_pairs })
}

/// Lets the rays of sources that are far away start beside the scene, which lies in a box. Surroundings that absorb or scatter take a part
/// in what comes of them on their way; there they start where they are. `frames` are those that the sources are given in.
///
/// # Errors
/// When a source is so far away that its rays are not known within the scene.
fn start_near(
    scene: &Scene,
    emitters: &mut [Emitter],
    frames: &[Frame],
    ambient: &Body,
    scene_box: &Aabb,
) -> Result<(), Error> {
    if ambient.absorbs() || ambient.scatter.is_some() {
        return Ok(());
    }
    for (i, emitter) in emitters.iter_mut().enumerate() {
        // As the scene gives it: a unit vector would have lost a digit over such a distance.
        let direction = frames[i].direction(Vector::from_array(scene.sources[i].direction));
        emitter.start_near(scene_box, direction).map_err(|message| {
            let at = [Key::Name("source"), Key::Index(i), Key::Name("at")];
            let error = scene.error(ErrorKind::Value, &at, format!("this source cannot be traced: {message}"));
            error.help("put it nearer, or make it `collimated`: from so far away its light is parallel")
        })?;
    }
    Ok(())
}

/// Returns the frame, in the scene, that source `index` is given in; an error as of [`frames::frame`].
fn source_frame(scene: &Scene, model: &Model, index: usize) -> Result<Frame, Error> {
    let of = [Key::Name("source"), Key::Index(index)];
    frames::frame(scene, model, of, scene.sources[index].frame.as_deref())
}

/// Makes the receivers, each at its placement and with the faces whose absorbed power it counts.
///
/// # Errors
/// When one selects no face, or its `frame` names no single instance.
fn bind_receivers(scene: &Scene, model: &Model) -> Result<Vec<Receiver>, Error> {
    let mut search = FaceSearch::new(model);
    let mut receivers = Vec::new();
    for (i, r) in scene.receivers.iter().enumerate() {
        let faces = match r.kind {
            ReceiverKind::Absorbed => select::absorbing_faces(scene, i, &mut search)?,
            _ => Vec::new(),
        };
        let of = [Key::Name("receiver"), Key::Index(i)];
        let placement = frames::frame(scene, model, of, r.frame.as_deref())?;
        receivers.push(Receiver::new(r, faces).placed(&placement));
    }
    Ok(receivers)
}

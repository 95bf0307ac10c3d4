//! The bodies of a model with the media that the rules give them.

use super::bound_scene::BoundScene;
use super::face_rules::FaceRules;
use super::notes::belongs_to_open_shell;
use crate::math::{Aabb, BoxTree};
use crate::model::Model;
use crate::optics;
use crate::simulate::body::{AMBIENT, Body};
use crate::simulate::scene::{Key, Scene, medium};
use crate::simulate::surfaces::SceneLight;
use crate::simulate::wavelength_text::wavelength_text;
use crate::simulate::{Error, ErrorKind};
use std::collections::HashMap;

/// Makes the bodies, one for each instance, called by its label, and medium, with the surroundings as body 0. Returns them, the body of
/// each placed face (0 without a medium), and whether the boxes of any two, each grown by the glue distance, meet: bodies of which none do
/// can neither touch nor nest.
///
/// # Errors
/// When a medium is not known, or has no index at the wavelength of the scene.
pub(super) fn find_bodies(
    scene: &Scene,
    model: &Model,
    rules: &[FaceRules],
    light: &SceneLight,
    labels: &[String],
) -> Result<(Vec<Body>, Vec<u32>, bool), Error> {
    let ambient = match &scene.ambient {
        Some(name) => medium::find(&scene.media, name, &scene.origin, &[Key::Name("ambient")])?,
        None => optics::Medium::vacuum(),
    };
    let mut bodies = vec![Body::new(ambient, "surroundings".into(), light)];
    let mut places: HashMap<(usize, &str), usize> = HashMap::new();
    let mut of_face = vec![AMBIENT; rules.len()];
    for (f, &FaceRules { medium: rule, .. }) in model.placed_faces().zip(rules) {
        // Faces without a medium belong to the surroundings.
        let Some((rule, name)) = rule.and_then(|r| Some((r, scene.materials[r].medium.as_deref()?))) else {
            continue;
        };
        let body = match places.get(&(f.instance, name)) {
            Some(&body) => body,
            // Looked up once a body, not once a face.
            None => {
                let at = [Key::Name("material"), Key::Index(rule), Key::Name("medium")];
                let instance = labels[f.instance].clone();
                let medium = medium::find(&scene.media, name, &scene.origin, &at)?;
                let body = Body::new(medium, instance, light);
                if !body.has_valid_index() {
                    let message = format!("'{name}' has no index at {}", wavelength_text(light.wavelength));
                    return Err(scene.error(ErrorKind::Value, &at, message));
                }
                places.insert((f.instance, name), bodies.len());
                bodies.push(body);
                bodies.len() - 1
            }
        };
        bodies[body].open |= belongs_to_open_shell(&f, model);
        bodies[body].bounds = bodies[body].bounds.union(f.bounds());
        let gap = f.face.map_or(0.0, |face| face.gap * f.placement.scale.abs());
        bodies[body].gap = bodies[body].gap.max(gap);
        of_face[f.id.index()] = body as u32;
    }
    let boxes: Vec<Aabb> = bodies[1..].iter().map(|b| b.bounds.grown(scene.run.glue_distance())).collect();
    let nested = BoxTree::meeting_pairs(&boxes).next().is_some();
    Ok((bodies, of_face, nested))
}

/// Returns boxes around all bodies and all faces of opaque solids, which rays of a source may start in or on, each grown by `margin`, mm,
/// for what facets and rounding put outside.
pub(super) fn solids(bound: &BoundScene, model: &Model, margin: f64) -> BoxTree {
    let bodies = bound.bodies.iter().skip(1).map(|body| body.bounds);
    let opaque = model.placed_faces().filter(|f| bound.faces[f.id.index()].opaque_solid);
    let boxes: Vec<Aabb> = bodies.chain(opaque.map(|f| f.bounds())).map(|b| b.grown(margin)).collect();
    BoxTree::new(&boxes)
}

/// Sets for each body how far light may go in it by total reflection alone, mm: `caught_after` times the diagonal of its box; unchanged
/// (infinite) where it absorbs or has no faces. Bodies of one index that touch, by `pairs`, count as one with the box around them all.
pub(super) fn set_trapped_lengths(scene: &Scene, bodies: &mut [Body], pairs: &[[u32; 2]]) {
    // Union–find with halved paths (Tarjan & van Leeuwen 1984), since touching goes on from body to body; the lowest number
    // stands for its group.
    let mut united: Vec<u32> = (0..bodies.len() as u32).collect();
    /// Returns the number that stands for the group of a body, and shortens the way to it in `united`.
    fn group_of(united: &mut [u32], mut body: u32) -> u32 {
        while united[body as usize] != body {
            united[body as usize] = united[united[body as usize] as usize];
            body = united[body as usize];
        }
        body
    }
    for &[a, b] in pairs {
        let [one, other] = [a, b].map(|k| &bodies[k as usize]);
        if one.matches_index(other) {
            let [a, b] = [a, b].map(|k| group_of(&mut united, k));
            united[a.max(b) as usize] = a.min(b);
        }
    }
    // A path does not show where one body of its index ends and the next begins: what counts is the way through all of them.
    let mut whole = vec![(Aabb::EMPTY, false); bodies.len()];
    let of_body: Vec<usize> = (0..bodies.len() as u32).map(|k| group_of(&mut united, k) as usize).collect();
    for (body, &k) in bodies.iter().zip(&of_body).skip(1) {
        whole[k] = (whole[k].0.union(body.bounds), whole[k].1 | body.absorbs());
    }
    for (body, &k) in bodies.iter_mut().zip(&of_body).skip(1) {
        let (bounds, absorbs) = whole[k];
        // Where the body absorbs, a path ends by its power.
        if !(absorbs || bounds.is_empty()) {
            body.trapped_length = scene.run.caught_after * bounds.diagonal();
        }
    }
}

//! The selector of each face: the shortest one that means this face alone, to be put into a rule.

use crate::model::{Model, PlacedFace, are_shared};
use crate::simulate::scene::{FaceSelector, OneOrMany, SolidKey};
use std::collections::HashMap;

/// What a selector is made of; the earlier, the longer a face is likely to keep it when its file is written anew.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Key {
    Part,
    Instance,
    Solid,
    Name,
    Entity,
}

/// Combinations that are tried, in this order.
const COMBINATIONS: [&[Key]; 10] = [
    &[Key::Name],
    &[Key::Part, Key::Name],
    &[Key::Instance, Key::Name],
    &[Key::Entity],
    &[Key::Part, Key::Entity],
    &[Key::Instance, Key::Entity],
    &[Key::Instance, Key::Solid, Key::Entity],
    &[Key::Part, Key::Instance, Key::Entity],
    &[Key::Part, Key::Instance, Key::Solid],
    &[Key::Part, Key::Instance, Key::Solid, Key::Entity],
];

/// The names of a model's parts and instances, as selectors hold them.
struct Names<'m> {
    model: &'m Model,
    /// Whether an instance shares its name with another.
    shared: Vec<bool>,
}

impl<'m> Names<'m> {
    fn new(model: &'m Model) -> Self {
        Self { model, shared: are_shared(model.instances.iter().map(|i| i.name.as_str())) }
    }

    /// Returns the name of a face's instance, or its path where others have that name too.
    fn instance(&self, face: &PlacedFace<'_>) -> &'m str {
        let instance = &self.model.instances[face.instance];
        let is_told_by_path = self.shared[face.instance] && !instance.path.is_empty();
        if is_told_by_path { &instance.path } else { &instance.name }
    }
}

/// Returns the name if a selector can hold it: it is not empty, and no `*` makes it a pattern.
fn usable_name(name: &str) -> Option<&str> {
    (!name.is_empty() && !name.contains('*')).then_some(name)
}

/// Returns the selector of a face made of these keys; `None` where the face, its part or its instance lacks one of them.
fn selector_of_keys(keys: &[Key], face: &PlacedFace<'_>, names: &Names<'_>) -> Option<FaceSelector> {
    let model = names.model;
    let mut selector = FaceSelector::default();
    let name = |name: &str| Some(OneOrMany::One(usable_name(name)?.to_owned()));
    for key in keys {
        match key {
            Key::Part => selector.part = Some(name(&model.part(face.part).name)?),
            Key::Instance => selector.instance = Some(name(names.instance(face))?),
            Key::Solid => selector.solid = Some(OneOrMany::One(SolidKey::Number(face.solid))),
            Key::Name => selector.face = Some(name(face.name())?),
            Key::Entity => selector.entity = Some(OneOrMany::One(face.entity()?)),
        }
    }
    Some(selector)
}

/// Returns for each of these faces the shortest selector that means it alone among them: its name or `#id`, with part, instance and solid
/// where these are needed. Where no combination identifies it, all that it has with a point on it; a face without geometry has no point.
pub fn face_selectors(model: &Model, faces: &[PlacedFace<'_>]) -> Vec<FaceSelector> {
    let names = Names::new(model);
    let mut chosen: Vec<Option<FaceSelector>> = vec![None; faces.len()];
    for keys in COMBINATIONS {
        if chosen.iter().all(Option::is_some) {
            break;
        }
        // A selector identifies a face when no other face of these has the same text.
        let selectors: Vec<Option<FaceSelector>> =
            faces.iter().map(|f| selector_of_keys(keys, f, &names)).collect();
        let texts: Vec<Option<String>> = selectors.iter().map(|s| Some(s.as_ref()?.to_string())).collect();
        let mut uses: HashMap<&str, u32> = HashMap::new();
        for text in texts.iter().flatten() {
            *uses.entry(text).or_insert(0) += 1;
        }
        for ((slot, selector), text) in chosen.iter_mut().zip(selectors).zip(&texts) {
            if slot.is_none() && text.as_ref().is_some_and(|text| uses.get(text.as_str()) == Some(&1)) {
                *slot = selector;
            }
        }
    }
    chosen
        .into_iter()
        .zip(faces)
        .map(|(chosen, face)| chosen.unwrap_or_else(|| selector_by_point(face, &names)))
        .collect()
}

/// Returns a selector of everything that a face has but its name, and a point on it, mm, in scene coordinates; without the point where the
/// face has neither a surface nor facets.
fn selector_by_point(face: &PlacedFace<'_>, names: &Names<'_>) -> FaceSelector {
    let name = |name: &str| usable_name(name).map(|name| OneOrMany::One(name.to_owned()));
    // A point inside of the trims, which no other face is as near to.
    let on_surface = face.face.map(|f| f.surface.evaluate(f.inner_parameters()));
    let on_mesh = || {
        let mesh = &face.tessellated?.mesh;
        let [a, b, c, _] = (!mesh.facets.is_empty()).then(|| mesh.corners(0))?;
        Some((a + b + c) / 3.0)
    };
    FaceSelector {
        part: name(&names.model.part(face.part).name),
        instance: name(names.instance(face)),
        solid: Some(OneOrMany::One(SolidKey::Number(face.solid))),
        entity: face.entity().map(OneOrMany::One),
        at: on_surface.or_else(on_mesh).map(|p| OneOrMany::One(face.placement.point(p).to_array())),
        ..FaceSelector::default()
    }
}

//! The faces of a model that a rule of the scene means.

use super::nearest::Nearest;
use crate::math::Point;
use crate::model::{Model, PlacedFace};
use crate::simulate::emitter::Area;
use crate::simulate::scene::{FaceSelector, Key, OneOrMany, Scene, suggest};
use crate::simulate::{Error, ErrorKind};

/// Difference up to which two shares of a colour are the same: half a step of `#rrggbb`, 1/255.
const COLOUR_STEP: f64 = 2e-3;

/// Messages give places in steps of a thousandth of a millimetre.
const DECIMALS: f64 = 1e3;

/// Whether a name fits a pattern in which `*` stands for anything.
fn fits(pattern: &str, name: &str) -> bool {
    let mut pieces = pattern.split('*');
    let Some(mut rest) = name.strip_prefix(pieces.next().unwrap_or("")) else { return false };
    let mut last = None;
    for piece in pieces {
        if let Some(middle) = last.replace(piece) {
            match rest.find(middle) {
                Some(i) => rest = &rest[i + middle.len()..],
                None => return false,
            }
        }
    }
    last.map_or(rest.is_empty(), |end: &str| rest.ends_with(end))
}

fn any_fits(patterns: &Option<OneOrMany<String>>, name: &str) -> bool {
    patterns.as_ref().is_none_or(|p| p.as_slice().iter().any(|p| fits(p, name)))
}

/// Selects the placed faces that a rule means; an error when there is none, or when one of its points or names means none.
pub(super) fn faces(
    scene: &Scene,
    base: &[Key<'_>],
    rule: &FaceSelector,
    model: &Model,
    nearest: &mut Nearest<'_>,
) -> Result<Vec<usize>, Error> {
    let path = |key| base.iter().copied().chain([Key::Name(key)]).collect::<Vec<_>>();
    let colour = rule.colour.as_ref().and_then(|c| c.rgb());
    let selected = |f: &PlacedFace<'_>| {
        any_fits(&rule.part, &model.part(f.part).name)
            && any_fits(&rule.instance, &model.instances[f.instance].name)
            && any_fits(&rule.face, f.name())
            && rule.entity.as_ref().is_none_or(|e| f.entity().is_some_and(|id| e.as_slice().contains(&id)))
            && colour.is_none_or(|c| {
                f.colour(model).is_some_and(|have| have.0.iter().zip(c).all(|(a, b)| (a - b).abs() < COLOUR_STEP))
            })
    };
    let candidates: Vec<usize> = model.placed_faces().filter(selected).map(|f| f.id.index()).collect();
    each_name_means_something(scene, base, rule, model)?;
    if candidates.is_empty() {
        let message = "this matches no face of the model";
        return Err(scene.error(ErrorKind::NoMatch, &path(""), message).help("loosen its selectors, or remove it"));
    }
    let Some(points) = &rule.at else { return Ok(candidates) };
    let mut chosen = Vec::new();
    for p in points.as_slice() {
        let Some(face) = nearest.face(Point::from_array(*p), &candidates) else {
            let message = format!("no face is near to {p:?}");
            return Err(scene.error(ErrorKind::NoMatch, &path("at"), message).help("give a point on a face, mm"));
        };
        let bounds = nearest.bounds(&candidates);
        let distance = nearest.distance(face, Point::from_array(*p));
        if distance > bounds.diagonal() {
            let message =
                format!("{p:?} is {distance:.4} mm from the nearest face, farther away than the model is large");
            let error = scene.error(ErrorKind::NoMatch, &path("at"), message);
            let [a, b] = [bounds.min, bounds.max].map(|p| p.to_array().map(|x| (x * DECIMALS).round() / DECIMALS));
            return Err(error.help(format!("the faces that are meant lie between {a:?} and {b:?}, mm")));
        }
        chosen.push(face);
    }
    Ok(chosen)
}

fn each_name_means_something(
    scene: &Scene,
    base: &[Key<'_>],
    rule: &FaceSelector,
    model: &Model,
) -> Result<(), Error> {
    let parts = model.instances.iter().map(|i| model.part(i.part).name.as_str());
    let instances = model.instances.iter().map(|i| i.name.as_str());
    let faces = model.placed_faces().map(|f| f.face.map_or("", |f| f.name.as_str()));
    let lists = [
        ("part", &rule.part, parts.collect::<Vec<_>>()),
        ("instance", &rule.instance, instances.collect()),
        ("face", &rule.face, faces.collect()),
    ];
    for (key, patterns, names) in lists {
        for pattern in patterns.iter().flat_map(|p| p.as_slice()) {
            if names.iter().any(|n| fits(pattern, n)) {
                continue;
            }
            let at: Vec<_> = base.iter().copied().chain([Key::Name(key)]).collect();
            let error = scene.error(ErrorKind::NoMatch, &at, format!("no {key} is called '{pattern}'"));
            return Err(error.help(advice(pattern, names)));
        }
    }
    Ok(())
}

/// The faces that a source shines from.
pub(super) fn luminous_area(scene: &Scene, index: usize, model: &Model) -> Result<Option<Area>, Error> {
    let Some(on) = &scene.sources[index].on else { return Ok(None) };
    let base = [Key::Name("source"), Key::Index(index), Key::Name("on")];
    let chosen = faces(scene, &base, on, model, &mut Nearest::new(model))?;
    match Area::new(model, &chosen) {
        Some(area) => Ok(Some(area)),
        None => Err(scene.error(ErrorKind::NoMatch, &base, "these faces have no area to shine from")),
    }
}

/// The faces whose absorbed power a receiver counts.
pub(super) fn absorbing_faces(scene: &Scene, index: usize, model: &Model) -> Result<Vec<u32>, Error> {
    let receiver = &scene.receivers[index];
    let rule = FaceSelector {
        part: receiver.part.clone(),
        instance: receiver.instance.clone(),
        ..FaceSelector::default()
    };
    each_name_means_something(scene, &[Key::Name("receiver"), Key::Index(index)], &rule, model)?;
    let faces: Vec<u32> = model
        .placed_faces()
        .filter(|f| any_fits(&rule.part, &model.part(f.part).name))
        .filter(|f| any_fits(&rule.instance, &model.instances[f.instance].name))
        .map(|f| f.id.0)
        .collect();
    if faces.is_empty() {
        let at = [Key::Name("receiver"), Key::Index(index)];
        let error = scene.error(ErrorKind::NoMatch, &at, "this receiver matches no face of the model");
        let names = model.instances.iter().flat_map(|i| [model.part(i.part).name.as_str(), i.name.as_str()]);
        return Err(error.help(advice("", names.collect())));
    }
    Ok(faces)
}

/// The nearest name, or what names there are.
fn advice(word: &str, mut names: Vec<&str>) -> String {
    if let Some(near) = suggest::nearest(word, names.iter().copied().filter(|n| !n.is_empty())) {
        return format!("did you mean '{near}'?");
    }
    names.sort_unstable();
    names.dedup();
    names.retain(|n| !n.is_empty());
    match names.len() {
        0 => "the model has no such names".into(),
        n if n <= 12 => format!("there are: {}", names.join(", ")),
        n => format!("there are {n}, among them: {}", names[..12].join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::fits;

    #[test]
    fn stars_stand_for_anything() {
        for (pattern, name) in [
            ("led", "led"),
            ("led*", "led_2"),
            ("*PMMA", "cover_PMMA"),
            ("a*b*c", "axxbyyc"),
            ("*", ""),
            ("a*", "a"),
        ] {
            assert!(fits(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [("led", "led_2"), ("led*", "xled"), ("a*b*c", "acb"), ("ab*b", "ab"), ("", "x")] {
            assert!(!fits(pattern, name), "{pattern} {name}");
        }
    }
}

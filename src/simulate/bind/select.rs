//! The faces of a model that a rule of the scene means.

use super::nearest::Nearest;
use crate::math::Point;
use crate::math::units::PLACES_MM;
use crate::model::{Instance, Model, PlacedFace, SurfaceKind};
use crate::simulate::scene::{FaceSelector, Key, OneOrMany, Scene, SolidKey};
use crate::simulate::{Error, ErrorKind};
use crate::text;
use rustc_hash::FxHashSet;

/// Difference up to which two shares of a colour are the same: half a step of `#rrggbb`, 1/255.
const COLOUR_STEP: f64 = 2e-3;

/// Share of a radius that one may be given wrong by: reports give five digits.
const RADIUS_ROUNDING: f64 = 1e-4;

/// Messages give places in steps of a thousandth of a millimetre.
const DECIMALS: f64 = 1e3;

/// Whether a whole name fits a pattern in which each `*` stands for any characters, or none; upper and lower case differ.
pub(super) fn matches_pattern(pattern: &str, name: &str) -> bool {
    let mut pieces = pattern.split('*');
    let Some(mut rest) = name.strip_prefix(pieces.next().unwrap_or("")) else { return false };
    let mut last = None;
    for piece in pieces {
        // All pieces but the last are taken where they first stand, which leaves most for the others; the last must end the name.
        if let Some(middle) = last.replace(piece) {
            match rest.find(middle) {
                Some(i) => rest = &rest[i + middle.len()..],
                None => return false,
            }
        }
    }
    last.map_or(rest.is_empty(), |end: &str| rest.ends_with(end))
}

/// Whether a name fits any of the patterns; `true` where none is asked for.
fn matches_any(patterns: &Option<OneOrMany<String>>, name: &str) -> bool {
    patterns.as_ref().is_none_or(|p| p.as_slice().iter().any(|p| matches_pattern(p, name)))
}

/// Whether a face's solid is one of the wanted, by number or by name; `true` where none is asked for.
fn matches_solid(wanted: &Option<OneOrMany<SolidKey>>, face: &PlacedFace<'_>, model: &Model) -> bool {
    let Some(wanted) = wanted else { return true };
    let name = solid_name(face, model);
    wanted.as_slice().iter().any(|key| match key {
        SolidKey::Number(number) => *number == face.solid,
        SolidKey::Name(pattern) => name.is_some_and(|name| matches_pattern(pattern, name)),
    })
}

/// Returns the name of the solid of a face; a void's shell has that of the shell it is in. `None` for a face of no shell.
fn solid_name<'m>(face: &PlacedFace<'_>, model: &'m Model) -> Option<&'m str> {
    let shells = &model.part(face.part).shells[..=face.shell?];
    shells.iter().rfind(|s| !s.void).or(shells.first()).map(|s| s.name.as_str())
}

/// Whether a radius is the wanted one, mm, as exactly as reports give it.
fn is_same_radius(wanted: f64, have: f64) -> bool {
    (wanted - have).abs() <= RADIUS_ROUNDING * have
}

/// Whether a radius is one of the wanted, rising, mm.
fn is_any_radius(wanted: &[f64], have: f64) -> bool {
    // The first that is not too small: those behind it are farther off.
    let place = wanted.partition_point(|wanted| *wanted < have && !is_same_radius(*wanted, have));
    wanted.get(place).is_some_and(|wanted| is_same_radius(*wanted, have))
}

/// Returns the indices of the placed faces that have everything that a selector asks for; points (`at`) are not asked.
fn matching_faces(rule: &FaceSelector, model: &Model) -> Vec<usize> {
    // Lists may name thousands of faces and of radii.
    let entities: Option<FxHashSet<u64>> = rule.entity.as_ref().map(|e| e.as_slice().iter().copied().collect());
    let is_named =
        |f: &PlacedFace<'_>| entities.as_ref().is_none_or(|e| f.entity().is_some_and(|id| e.contains(&id)));
    let radii: Option<Vec<f64>> = rule.radius_mm.as_ref().map(|radii| {
        let mut rising = radii.as_slice().to_vec();
        rising.sort_by(f64::total_cmp);
        rising
    });
    let has_radius = |f: &PlacedFace<'_>| {
        radii.as_ref().is_none_or(|wanted| f.radius().is_some_and(|have| is_any_radius(wanted, have)))
    };
    let matches = |f: &PlacedFace<'_>| is_named(f) && has_radius(f) && matches_selector(rule, f, model);
    model.placed_faces().filter(matches).map(|f| f.id.index()).collect()
}

/// Whether a face has everything that a selector asks for; its `#id`, radius and points (`at`) are not asked.
fn matches_selector(rule: &FaceSelector, face: &PlacedFace<'_>, model: &Model) -> bool {
    let same_colour =
        |wanted: [f64; 3], have: [f64; 3]| have.iter().zip(wanted).all(|(a, b)| (a - b).abs() < COLOUR_STEP);
    matches_any(&rule.part, &model.part(face.part).name)
        && model.instances[face.instance].names().any(|name| matches_any(&rule.instance, name))
        && matches_any(&rule.face, face.name())
        && matches_any(&rule.kind, face.kind().word())
        && (rule.layer.is_none() || face.layer().is_some_and(|layer| matches_any(&rule.layer, layer)))
        && matches_solid(&rule.solid, face, model)
        && rule.colour.as_ref().is_none_or(|wanted| {
            wanted.rgb().zip(face.colour(model)).is_some_and(|(wanted, have)| same_colour(wanted, have.0))
        })
}

/// The faces of a model as selectors ask for them: what is worked out for one is kept for all.
pub(super) struct FaceSearch<'m> {
    model: &'m Model,
    nearest: Option<Nearest<'m>>,
    /// The names of each key of [`NAMES`], each once.
    names: [Option<Vec<&'m str>>; NAMES.len()],
    numbers: Option<FaceNumbers>,
}

/// The numbers that the faces of a model have, each once.
#[derive(Default)]
struct FaceNumbers {
    entities: FxHashSet<u64>,
    solids: FxHashSet<usize>,
    /// Rising, mm.
    radii: Vec<f64>,
}

impl FaceNumbers {
    /// Whether a face has this radius, mm.
    fn has_radius(&self, wanted: f64) -> bool {
        // The first that is not too small: those behind it are farther off.
        let place = self.radii.partition_point(|have| *have < wanted && !is_same_radius(wanted, *have));
        self.radii.get(place).is_some_and(|have| is_same_radius(wanted, *have))
    }
}

impl<'m> FaceSearch<'m> {
    pub(super) fn new(model: &'m Model) -> Self {
        Self { model, nearest: None, names: Default::default(), numbers: None }
    }

    /// Returns the names of a key of [`NAMES`], each once, in the order of the model.
    fn names(&mut self, key: usize) -> &[&'m str] {
        let model = self.model;
        self.names[key].get_or_insert_with(|| {
            let mut seen = FxHashSet::default();
            let mut names = NAMES[key].1(model);
            names.retain(|name| seen.insert(*name));
            names
        })
    }

    fn numbers(&mut self) -> &FaceNumbers {
        let model = self.model;
        self.numbers.get_or_insert_with(|| {
            let mut numbers = FaceNumbers::default();
            for face in model.placed_faces() {
                numbers.entities.extend(face.entity());
                numbers.solids.insert(face.solid);
                numbers.radii.extend(face.radius());
            }
            numbers.radii.sort_by(f64::total_cmp);
            numbers.radii.dedup();
            numbers
        })
    }
}

/// Returns the indices of the placed faces that a selector means; with points, for each of them the nearest of these, which may repeat.
/// `base` is where the selector stands in the scene, for messages.
///
/// # Errors
/// When no face fits, a name or number in it fits nothing in the model, its list of points is empty, or a point lies farther from the faces
/// than they are large.
pub(super) fn select_faces(
    scene: &Scene,
    base: &[Key<'_>],
    rule: &FaceSelector,
    search: &mut FaceSearch<'_>,
) -> Result<Vec<usize>, Error> {
    let path = |key| base.iter().copied().chain([Key::Name(key)]).collect::<Vec<_>>();
    if rule.at.as_ref().is_some_and(|points| points.as_slice().is_empty()) {
        let error = scene.error(ErrorKind::NoMatch, &path("at"), "an empty list of points means no face");
        return Err(error.help("give a point on each face that is meant, or leave `at` out"));
    }
    // Before the count: a name that nothing has is the better message than that nothing matches.
    refuse_what_nothing_has(scene, base, rule, search)?;
    let model = search.model;
    let candidates = matching_faces(rule, model);
    if candidates.is_empty() {
        let message = "this matches no face of the model";
        let help = match model.placed_face_count() {
            0 => empty_model_advice(scene),
            _ => "loosen its selectors, or remove it",
        };
        return Err(scene.error(ErrorKind::NoMatch, base, message).help(help));
    }
    let Some(points) = &rule.at else { return Ok(candidates) };
    if let Some(p) = points.as_slice().iter().find(|p| !p.iter().all(|x| PLACES_MM.contains(x))) {
        let message = format!("{p:?} is no point: its coordinates must be numbers from -1e30 to 1e30, mm");
        return Err(scene.error(ErrorKind::Value, &path("at"), message));
    }
    let nearest = search.nearest.get_or_insert_with(|| Nearest::new(model));
    let bounds = nearest.bounds(&candidates);
    let mut chosen = Vec::new();
    for p in points.as_slice() {
        let Some(face) = nearest.nearest_face(Point::from_array(*p), &candidates) else {
            let message = format!("none of the faces that are meant has a shape, so none is near to {p:?}");
            return Err(scene.error(ErrorKind::NoMatch, &path("at"), message).help("loosen the other selectors"));
        };
        let distance = nearest.distance(face, Point::from_array(*p));
        // A point that far off is a slip of unit or sign, and not meant for any face.
        if distance > bounds.diagonal() {
            let message = format!(
                "{p:?} is {distance:.4} mm from the nearest face, farther away than the faces meant are large"
            );
            let error = scene.error(ErrorKind::NoMatch, &path("at"), message);
            let [a, b] = [bounds.min, bounds.max].map(|p| p.to_array().map(|x| (x * DECIMALS).round() / DECIMALS));
            return Err(error.help(format!("the faces that are meant lie between {a:?} and {b:?}, mm")));
        }
        chosen.push(face);
    }
    Ok(chosen)
}

/// Where the names of a key stand in a model.
type NamesOf = fn(&Model) -> Vec<&str>;

/// The names that selectors are compared with, by their key: of what is placed, and of all kinds of surfaces.
const NAMES: [(&str, NamesOf); 6] = [
    ("part", |model| model.instances.iter().map(|i| model.part(i.part).name.as_str()).collect()),
    ("instance", |model| model.instances.iter().flat_map(Instance::names).collect()),
    ("face", |model| model.placed_faces().map(|f| f.name()).collect()),
    ("layer", |model| model.placed_faces().filter_map(|f| f.layer()).collect()),
    ("solid", |model| model.placed_faces().filter_map(|f| solid_name(&f, model)).collect()),
    ("kind", |_| SurfaceKind::ALL.map(SurfaceKind::word).to_vec()),
];

/// Checks that the colour of a selector is one, and that every name, number and radius in it fits something that is placed in the model; a
/// kind, any model. A rule of several names must not lose one of them to a slip of the pen while the others match.
///
/// # Errors
/// For a text that is no colour, and for the first name or number that fits nothing, with the nearest name or a list of names.
fn refuse_what_nothing_has(
    scene: &Scene,
    base: &[Key<'_>],
    rule: &FaceSelector,
    search: &mut FaceSearch<'_>,
) -> Result<(), Error> {
    let path = |key| base.iter().copied().chain([Key::Name(key)]).collect::<Vec<_>>();
    if let Some(colour) = &rule.colour {
        colour.check(&scene.origin, &path("colour"))?;
    }
    let solid_names = rule.solid.as_ref().map(|keys| {
        let names = keys.as_slice().iter().filter_map(|key| match key {
            SolidKey::Name(name) => Some(name.clone()),
            SolidKey::Number(_) => None,
        });
        OneOrMany::Many(names.collect())
    });
    let model = search.model;
    let asked = [&rule.part, &rule.instance, &rule.face, &rule.layer, &solid_names, &rule.kind];
    for (place, ((key, _), patterns)) in NAMES.into_iter().zip(asked).enumerate() {
        let Some(patterns) = patterns else { continue };
        let names = search.names(place);
        let fits_nothing = |pattern: &&String| !names.iter().any(|name| matches_pattern(pattern, name));
        if let Some(pattern) = patterns.as_slice().iter().find(fits_nothing) {
            let error = scene.error(ErrorKind::NoMatch, &path(key), format!("no {key} is called '{pattern}'"));
            return Err(error.help(advice(pattern, names.iter().copied(), key, scene, model)));
        }
    }
    if rule.entity.is_none() && rule.solid.is_none() && rule.radius_mm.is_none() {
        return Ok(());
    }
    let numbers = search.numbers();
    let refuse = |key: &'static str, message: String| {
        let error = scene.error(ErrorKind::NoMatch, &path(key), message);
        Err(error.help("`lampyris info FILE --faces` lists the faces of a model"))
    };
    for id in rule.entity.iter().flat_map(OneOrMany::as_slice) {
        if !numbers.entities.contains(id) {
            return refuse("entity", format!("no face is #{id} in its file"));
        }
    }
    for key in rule.solid.iter().flat_map(OneOrMany::as_slice) {
        if let SolidKey::Number(number) = key
            && !numbers.solids.contains(number)
        {
            return refuse("solid", format!("no part has a solid {number}"));
        }
    }
    for radius in rule.radius_mm.iter().flat_map(OneOrMany::as_slice) {
        if !numbers.has_radius(*radius) {
            return refuse("radius_mm", format!("no face has a radius of {radius} mm"));
        }
    }
    Ok(())
}

/// Returns the indices of the placed faces whose absorbed power a receiver counts: by its selector `on`, else by part and instance; all
/// faces where it has none of these.
///
/// # Errors
/// When these mean no face.
pub(super) fn absorbing_faces(scene: &Scene, index: usize, search: &mut FaceSearch<'_>) -> Result<Vec<u32>, Error> {
    let receiver = &scene.receivers[index];
    if let Some(on) = &receiver.on {
        let base = [Key::Name("receiver"), Key::Index(index), Key::Name("on")];
        let mut chosen = select_faces(scene, &base, on, search)?;
        // Two points on one face name it twice: what it absorbs counts once.
        chosen.sort_unstable();
        chosen.dedup();
        return Ok(chosen.into_iter().map(|f| f as u32).collect());
    }
    let rule = FaceSelector {
        part: receiver.part.clone(),
        instance: receiver.instance.clone(),
        ..FaceSelector::default()
    };
    let at = [Key::Name("receiver"), Key::Index(index)];
    refuse_what_nothing_has(scene, &at, &rule, search)?;
    let model = search.model;
    let faces: Vec<u32> = matching_faces(&rule, model).into_iter().map(|f| f as u32).collect();
    if faces.is_empty() {
        let error = scene.error(ErrorKind::NoMatch, &at, "this receiver matches no face of the model");
        let names = model.instances.iter().flat_map(|i| [model.part(i.part).name.as_str(), i.name.as_str()]);
        return Err(error.help(advice("", names, "part", scene, model)));
    }
    Ok(faces)
}

/// Returns advice that names the nearest name, or some where none is near, or says why a model has none that `key` could ask for.
pub(super) fn advice<'a>(
    word: &str,
    names: impl IntoIterator<Item = &'a str>,
    key: &str,
    scene: &Scene,
    model: &Model,
) -> String {
    text::nearest_or_listed(word, names).unwrap_or_else(|| match key {
        _ if model.placed_face_count() == 0 => empty_model_advice(scene).into(),
        "solid" => "its solids have no names: give the number, as in `solid = 0`".into(),
        "layer" => "the model has no layers".into(),
        "face" => "its faces have no names: `lampyris info FILE --faces` shows what else distinguishes them".into(),
        _ => "the model has no such names".into(),
    })
}

/// Returns what to do about a scene whose model has no faces.
fn empty_model_advice(scene: &Scene) -> &'static str {
    if scene.models.is_empty() {
        "the scene has no model: add a [[model]] with its `file`"
    } else if scene.models.iter().any(|entry| !entry.without.is_empty()) {
        "nothing of the model is left: `without` leaves out all its faces"
    } else {
        "the model has no faces"
    }
}

#[cfg(test)]
mod tests {
    use super::{FaceNumbers, is_any_radius, is_same_radius, matches_pattern};

    #[test]
    fn a_radius_is_found_as_every_one_that_is_compared_finds_it() {
        let numbers = FaceNumbers { radii: vec![0.5, 1.0, 1.00015, 1.0003, 40.0], ..FaceNumbers::default() };
        let near = (0..2000).map(|k| 0.9995 + f64::from(k) * 1e-6);
        for wanted in near.chain([0.0, 0.4999, 0.49996, 39.997, 40.003, 40.005, 41.0]) {
            let expected = numbers.radii.iter().any(|have| is_same_radius(wanted, *have));
            assert_eq!(numbers.has_radius(wanted), expected, "{wanted}");
            // The same numbers the other way round: a list that is asked for, and the radius of a face.
            let expected = numbers.radii.iter().any(|asked| is_same_radius(*asked, wanted));
            assert_eq!(is_any_radius(&numbers.radii, wanted), expected, "{wanted}");
        }
    }

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
            assert!(matches_pattern(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [("led", "led_2"), ("led*", "xled"), ("a*b*c", "acb"), ("ab*b", "ab"), ("", "x")] {
            assert!(!matches_pattern(pattern, name), "{pattern} {name}");
        }
    }
}

//! What someone who reads the results must know about the scene: bodies that are open or too thin, and light of wavelengths that a table or
//! a formula was not made for.

use super::bound_scene::{BoundScene, RuleFaces};
use super::face_rules::FaceRules;
use crate::model::{Model, PlacedFace};
use crate::optics::{catalogue, observer_range};
use crate::simulate::body::AMBIENT;
use crate::simulate::emitter::Loaded;
use crate::simulate::receiver::{Receiver, Shape};
use crate::simulate::scene::{ByWavelength, Material, PowerUnit, Reflectance, Run, Scene, medium};
use crate::simulate::surfaces::FaceOptics;
use crate::simulate::wavelength_text::wavelength_range_text;
use crate::text::{count_of, first_sentences};
use std::collections::{BTreeMap, BTreeSet};

/// Share of a wavelength that the end of a table may be missed by: single precision rounds by half of 2⁻²³, a change of units by less, and
/// larger differences show in the digits that are written.
const ROUNDING: f64 = 5e-7;

/// Tables, media, sources and remarks on files that are named; beyond them only the number is given.
pub(super) const NAMED: usize = 8;

/// Index beyond which the surroundings are no gas: vapours at normal pressure have up to 1.0018 (benzene).
const MOST_OF_GAS: f64 = 1.002;

/// A property that is known between two wavelengths alone, nm, and what it is called in a sentence.
struct KnownRange {
    what: String,
    range: [f64; 2],
    /// What is taken beyond them.
    beyond: &'static str,
}

/// Words for what is taken beyond a table's wavelengths.
const ENDS: &str = "its first and last values are used there";
/// Words for what is taken beyond a formula's wavelengths.
const FORMULA: &str = "the formula is used all the same there";

/// Returns one sentence for each of the first tables and formulas in use that the light of a source goes beyond, and one that counts the
/// others; `light` is first and last wavelength of each source, nm.
pub(super) fn range_notes(scene: &Scene, rules: &[FaceRules], light: &[[f64; 2]]) -> Vec<String> {
    let media = rules.iter().filter_map(|face| scene.materials.get(face.medium?)?.medium.as_deref());
    let media: BTreeSet<&str> = media.chain(scene.ambient.as_deref()).collect();
    let surfaces: BTreeSet<usize> = rules.iter().filter_map(|face| face.surface).collect();
    let mut known: Vec<KnownRange> = media.iter().flat_map(|name| medium_ranges(scene, name)).collect();
    for rule in surfaces {
        let Some(material) = scene.materials.get(rule) else { continue };
        known.extend(surface_ranges(material).map(|(key, range)| KnownRange {
            what: format!("`{key}` of [[material]] {}", rule + 1),
            range,
            beyond: ENDS,
        }));
    }
    first_sentences(known.iter().filter_map(|k| range_note(scene, k, light)), NAMED, |further| {
        format!(
            "the light of sources goes beyond {} of tables and formulas too",
            count_of(further as u64, "more range")
        )
    })
}

/// Returns the sentence about a table that the light of a source goes beyond, naming the first such source; `None` where no source does.
/// `light` is first and last wavelength of each source, nm.
fn range_note(scene: &Scene, known: &KnownRange, light: &[[f64; 2]]) -> Option<String> {
    let [from, to] = known.range;
    let outside = |[a, b]: &[f64; 2]| *a < from * (1.0 - ROUNDING) || *b > to * (1.0 + ROUNDING);
    // One sentence a table: the first source that is beyond it stands for all.
    let (source, [a, b]) = light.iter().enumerate().find(|(_, range)| outside(range))?;
    let whose = scene.source_label(source);
    let alone = if from == to { " alone" } else { "" };
    let [known_for, light] = [[from, to], [*a, *b]].map(wavelength_range_text);
    Some(format!(
        "{} is known for {known_for}{alone}, but {whose} has light of {light}: {}",
        known.what, known.beyond
    ))
}

/// Returns one sentence about the sources whose power is in lumens though the eye sees nothing of their light, naming the first; `None`
/// where there is none. `light` is first and last wavelength of each source, nm.
pub(super) fn invisible_light_note(scene: &Scene, light: &[[f64; 2]]) -> Option<String> {
    if scene.run.unit != PowerUnit::Lumen {
        return None;
    }
    let [from, to] = observer_range();
    let is_invisible = |&source: &usize| light[source][1] < from || light[source][0] > to;
    let invisible: Vec<usize> = (0..light.len()).filter(is_invisible).collect();
    let first = *invisible.first()?;
    let others = if invisible.len() > 1 { format!(" (and {} more)", invisible.len() - 1) } else { String::new() };
    Some(format!(
        "the power of {}{others} is in lumens, but the eye sees nothing of light of {}: give it in watts, without `unit = \"lm\"` in [run]",
        scene.source_label(first),
        wavelength_range_text(light[first])
    ))
}

/// Returns one sentence about the media of the scene that no rule names, nor the surroundings; `None` where all are named.
pub(super) fn unused_media_note(scene: &Scene) -> Option<String> {
    let named = scene.materials.iter().filter_map(|rule| rule.medium.as_deref());
    let named: BTreeSet<&str> = named.chain(scene.ambient.as_deref()).collect();
    let unused = scene.media.iter().map(|medium| medium.name.as_str()).filter(|name| !named.contains(name));
    let unused: Vec<&str> = unused.collect();
    match unused[..] {
        [] => None,
        [one] => Some(format!("[[medium]] '{one}' is not used: no [[material]] has `medium = \"{one}\"`")),
        _ => {
            let quoted = unused.iter().map(|name| format!("'{name}'"));
            let quoted = first_sentences(quoted, NAMED, |further| format!("{further} more")).join(", ");
            Some(format!("[[medium]] {quoted} are not used: no [[material]] has one of them as its `medium`"))
        }
    }
}

/// Returns what the readers of sources' files changed or supposed: the first sentences, each with its source in front, and one that counts
/// the others.
pub(super) fn source_file_notes(scene: &Scene, loaded: &[Option<Loaded>]) -> Vec<String> {
    let sentences = loaded.iter().enumerate().flat_map(|(index, loaded)| {
        let notes = match loaded {
            Some(Loaded::Rays(list)) => list.notes.as_slice(),
            Some(Loaded::Intensity { note, .. }) => note.as_slice(),
            None => &[],
        };
        notes.iter().map(move |note| format!("{}: {note}", scene.source_label(index)))
    });
    first_sentences(sentences, NAMED, |further| {
        format!("the files of sources lead to {}", count_of(further as u64, "more remark"))
    })
}

/// Returns the least and the greatest of these wavelengths; `None` without any.
fn least_and_greatest<'a>(mut nm: impl Iterator<Item = f64> + 'a) -> Option<[f64; 2]> {
    let first = nm.next()?;
    Some(nm.fold([first, first], |[a, b], x| [a.min(x), b.max(x)]))
}

/// Returns the wavelengths, nm, between which the catalogue formula, the transmittances of a catalogue file and the tables of a medium are
/// known; a table of the scene with one point is a constant and left out.
fn medium_ranges(scene: &Scene, name: &str) -> Vec<KnownRange> {
    let mut known = Vec::new();
    let mut add = |what: String, range: Option<[f64; 2]>, beyond| {
        known.extend(range.map(|range| KnownRange { what, range, beyond }))
    };
    let own = scene.media.iter().find(|m| m.name == name);
    let entry = own.map_or(Some(name), |m| m.catalogue.as_deref());
    if let Some(entry) = entry {
        // A catalogue of the user's says itself how far its formulas hold, also of a glass that has a namesake here.
        let glass = own.and_then(|m| m.glass.as_ref());
        let range = match glass {
            Some(glass) => glass.range_nm(),
            None => catalogue::range_nm(entry),
        };
        add(format!("the index of '{entry}'"), range, FORMULA);
        // What the scene says of absorption stands in place of the file's.
        if let Some(glass) = glass.filter(|_| own.is_some_and(|m| m.absorption_per_mm.is_none())) {
            let measured = least_and_greatest(glass.absorption().iter().map(|p| p[0]));
            add(format!("the transmittance of '{entry}'"), measured, ENDS);
        }
    }
    if let Some(medium::Medium { index_table, absorption_per_mm, .. }) = own {
        // A single point is a constant.
        let range = |t: &Vec<[f64; 2]>| if t.len() > 1 { least_and_greatest(t.iter().map(|p| p[0])) } else { None };
        add(format!("`index_table` of the medium '{name}'"), index_table.as_ref().and_then(range), ENDS);
        if let Some(ByWavelength::Table(t)) = absorption_per_mm {
            add(format!("`absorption_per_mm` of the medium '{name}'"), range(t), ENDS);
        }
    }
    known
}

/// Returns the keys of a material's tables over wavelength, with first and last wavelength, nm.
fn surface_ranges(m: &Material) -> impl Iterator<Item = (&'static str, [f64; 2])> {
    let coating =
        m.coating.as_ref().and_then(|rows| least_and_greatest(rows.iter().filter_map(|r| r.get(1).copied())));
    let reflectance = match &m.reflectance {
        Some(Reflectance::ByAngleAndWavelength(rows)) => least_and_greatest(rows.iter().map(|r| r[1])),
        _ => None,
    };
    [("coating", coating), ("reflectance", reflectance)].into_iter().filter_map(|(key, range)| Some((key, range?)))
}

/// Returns one sentence about the rules that later ones replace on all their faces; `None` where there is none.
pub(super) fn replaced_rules_note(rules: &[RuleFaces]) -> Option<String> {
    let replaced: Vec<String> = (rules.iter())
        .filter(|rule| rule.faces.is_empty())
        .filter_map(|rule| {
            let selects = if rule.selects.is_empty() { "all faces" } else { &rule.selects };
            Some(format!("[[material]] {} ({selects})", rule.rule?))
        })
        .collect();
    let last = replaced.last()?;
    Some(match replaced.len() {
        1 => format!("{last} decides no face: later rules replace it on all that it selects"),
        n => format!(
            "{last} and {} more rules decide no face: later ones replace them on all that they select",
            n - 1
        ),
    })
}

/// Whether a face belongs to no closed shell; `false` for ready meshes, of which that is not known.
pub(super) fn belongs_to_open_shell(f: &PlacedFace<'_>, model: &Model) -> bool {
    f.face.is_some() && f.shell.is_none_or(|s| !model.part(f.part).shells[s].closed)
}

/// Returns one sentence about the bodies that have faces in no closed shell, naming the first, and about a source in the box of one; `None`
/// where all are closed.
pub(super) fn opening_note(bound: &BoundScene, model: &Model) -> Option<String> {
    let open = |f: &PlacedFace<'_>| {
        belongs_to_open_shell(f, model)
            && bound.faces.get(f.id.index()).is_some_and(|optics| optics.body != AMBIENT)
    };
    let faces: Vec<PlacedFace<'_>> = model.placed_faces().filter(open).collect();
    let first = faces.first()?;
    let [instance, medium] = bound.body_names(bound.faces[first.id.index()].body)?;
    let bodies: BTreeSet<u32> = faces.iter().map(|f| bound.faces[f.id.index()].body).collect();
    let others = if bodies.len() > 1 { format!(" (and {} more)", bodies.len() - 1) } else { String::new() };
    let sheet = match (first.name(), first.entity()) {
        ("", Some(entity)) => format!(" (face #{entity})"),
        ("", None) => String::new(),
        (name, Some(entity)) => format!(" (face '{name}', #{entity})"),
        (name, None) => format!(" (face '{name}')"),
    };
    // The ways of its rays out of the scene give different answers where they pass the opening, so that none stands for the others.
    let within = |k: usize| {
        let e = &bound.emitters[k];
        let reaches = |&body: &u32| !bound.bodies[body as usize].bounds.intersection(e.extent()).is_empty();
        !e.media_stated && bodies.iter().any(reaches)
    };
    let asked = (0..bound.emitters.len()).find(|&k| within(k)).map_or_else(String::new, |k| {
        let source = bound.scene.source_label(k);
        format!("; {source} is in its box, and each ray is probed for what it starts in, many times the work: state it by `inside`")
    });
    Some(format!(
        "'{instance}'{others} has the medium '{medium}' but no closed shell{sheet}: light that passes its opening is lost; close it in \
         the model, or give it a surface instead of a medium{asked}"
    ))
}

/// Returns one sentence about the closed voids in bodies, naming the first, that hold the medium of the surroundings, where this is no gas;
/// `None` where there is none, or another body comes near each.
pub(super) fn filled_void_note(bound: &BoundScene, model: &Model) -> Option<String> {
    let ambient = bound.scene.ambient.as_ref()?;
    if bound.bodies[AMBIENT as usize].index(None) <= MOST_OF_GAS {
        return None;
    }
    // The body around each void, by instance and shell; none where a face is opaque or may touch what fills the void.
    let mut voids: BTreeMap<(usize, usize), Option<u32>> = BTreeMap::new();
    for f in model.placed_faces() {
        let is_of_void = |shell: &usize| {
            let shell = &model.part(f.part).shells[*shell];
            shell.void && shell.closed
        };
        let Some(shell) = f.shell.filter(is_of_void) else { continue };
        let face = &bound.faces[f.id.index()];
        let is_filled = face.touches_body || face.medium_on_opaque;
        let around = bound.entered_body(f.id).filter(|_| !is_filled);
        let body = voids.entry((f.instance, shell)).or_insert(around);
        *body = body.and(around);
    }
    let filled: Vec<u32> = voids.into_values().flatten().collect();
    let [instance, medium] = bound.body_names(*filled.first()?)?;
    let others = if filled.len() > 1 { format!(" (and {} more)", filled.len() - 1) } else { String::new() };
    Some(format!(
        "the closed void in '{instance}' ({medium}){others} holds '{ambient}', the `ambient` medium: anything else in it has to be a solid of \
         its own with a `medium`"
    ))
}

/// Returns one sentence about far fields, naming the first, in surroundings that absorb or scatter: light is counted there once it has left
/// the scene, after a way without end. `None` without far fields, and where the surroundings do nothing to light.
pub(super) fn dark_far_field_note(bound: &BoundScene) -> Option<String> {
    let body = &bound.bodies[AMBIENT as usize];
    let does = match (body.absorbs(), body.scatter.is_some()) {
        (true, true) => "absorbs and scatters",
        (true, false) => "absorbs",
        (false, true) => "scatters",
        (false, false) => return None,
    };
    let far: Vec<&Receiver> =
        bound.receivers.iter().filter(|r| matches!(r.shape, Shape::FarField { .. })).collect();
    let first = &far.first()?.name;
    let others = if far.len() > 1 { format!(" (and {} more)", far.len() - 1) } else { String::new() };
    Some(format!(
        "the far field '{first}'{others} lies without end away in '{}', the `ambient` medium, which {does} light: what it {does} does not \
         get there; count the light on a receiver of `kind = \"sphere\"` around the scene, or leave out `ambient`",
        body.medium
    ))
}

/// Returns one sentence about the first body none of whose faces lets light through, where the rule that gave it a surface stands above the
/// one that gave it its medium: a medium written last is meant to be seen. `None` where there is no such body.
pub(super) fn shut_body_note(bound: &BoundScene, rules: &[FaceRules]) -> Option<String> {
    let is_clear = |face: &FaceOptics| !bound.surfaces[usize::from(face.surface)].is_opaque();
    let clear: BTreeSet<u32> = bound.faces.iter().filter(|face| is_clear(face)).map(|face| face.body).collect();
    let shut =
        bound.faces.iter().zip(rules).filter(|(face, _)| face.body != AMBIENT && !clear.contains(&face.body));
    let (body, surface, medium) = shut.into_iter().find_map(|(face, rules)| match *rules {
        FaceRules { surface: Some(surface), medium: Some(medium) } if surface < medium => {
            Some((face.body, surface + 1, medium + 1))
        }
        _ => None,
    })?;
    let [name, substance] = bound.body_names(body)?;
    Some(format!(
        "no light gets into or out of '{name}' ({substance}): all its faces are opaque by [[material]] {surface}, which [[material]] {medium} \
         leaves as they are; `surface = \"interface\"` there makes them clear"
    ))
}

/// Returns one sentence about the faces that the file gives as ready meshes, naming the first; `None` where there is none.
pub(super) fn ready_mesh_note(model: &Model) -> Option<String> {
    let ready = || model.parts.iter().flat_map(|part| &part.tessellated);
    let first = ready().next()?;
    let name = match (first.name.as_str(), first.entity) {
        ("", None) => "a face".to_owned(),
        ("", Some(entity)) => format!("face #{entity}"),
        (name, None) => format!("face '{name}'"),
        (name, Some(entity)) => format!("face '{name}' (#{entity})"),
    };
    let (others, verb) = match ready().count() {
        1 => (String::new(), "is a ready mesh"),
        n => (format!(" (and {} more)", n - 1), "are ready meshes"),
    };
    Some(format!(
        "{name}{others} {verb} in the file and traced as given: how far that is from the surface it was made of is not known, and in no \
         error that is printed"
    ))
}

/// Glue distance that is advised for the thinnest body, as a share of its thickness: both of its faces are far beyond it.
const GLUE_OF_THICKNESS: f64 = 0.1;

/// Returns one sentence about the thinnest body that touches others and whose box is thinner than twice the glue distance along an axis;
/// `None` where there is none. A flat sheet is none: it has no thickness that a smaller glue distance could resolve.
pub(super) fn thin_body_note(bound: &BoundScene) -> Option<String> {
    let glue = bound.scene.run.glue_mm;
    let thickness = |k: u32| bound.bodies[k as usize].bounds.size().min_element();
    let touching: BTreeSet<u32> = bound.faces.iter().filter(|f| f.touches_body).map(|f| f.body).collect();
    // Twice the glue: a body as thin as that has both of its faces within the glue of one place.
    let is_thin = |k: u32| thickness(k) < 2.0 * glue && Run::allows_glue(GLUE_OF_THICKNESS * thickness(k));
    let thin = touching.into_iter().filter(|&k| k != AMBIENT && is_thin(k));
    let film = thin.min_by(|a, b| thickness(*a).total_cmp(&thickness(*b)))?;
    let [name, medium] = bound.body_names(film)?;
    let thick = thickness(film);
    Some(format!(
        "'{name}' ({medium}) is {thick:.1e} mm thick, hardly more than [run] glue_mm = {glue:e}, within which faces of touching bodies \
         are one: light may pass it by or be lost; set glue_mm to {:.0e}",
        GLUE_OF_THICKNESS * thick
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// 587.5618 nm of a file in single precision is 587.56182861328125, and 0.7003 µm are 700.3000000000001 nm.
    #[test]
    fn wavelengths_have_the_digits_that_are_known() {
        let scene = Scene::parse("[run]\nunit = 'lm'\n[[source]]\n", "s.toml", Path::new(".")).unwrap();
        let note = |range: [f64; 2], light: [f64; 2]| {
            range_note(&scene, &KnownRange { what: "the table".into(), range, beyond: ENDS }, &[light])
        };
        let single = f64::from(587.5618f32);
        let said = note([0.7003 * 1000.0, 1200.0], [single, single]).unwrap();
        assert!(said.contains("known for 700.3 to 1200 nm") && said.contains("light of 587.5618 nm:"), "{said}");
        // At the end of the table but for rounding.
        assert_eq!(note([500.0, 587.5618], [single, single]), None);
        let said = invisible_light_note(&scene, &[[0.9403 * 1000.0, 0.9803 * 1000.0]]).unwrap();
        assert!(said.contains("light of 940.3 to 980.3 nm:"), "{said}");
    }
}

//! What someone who reads the results must know about the scene: bodies that are open or too thin, and light of wavelengths that a table or
//! a formula was not made for.

use super::bound_scene::BoundScene;
use super::chosen::ChosenRules;
use crate::model::{Model, PlacedFace};
use crate::optics::catalogue;
use crate::simulate::body::AMBIENT;
use crate::simulate::emitter::Loaded;
use crate::simulate::scene::{ByWavelength, Material, Reflectance, Scene, medium};
use std::collections::BTreeSet;

/// Share of a wavelength that the end of a table may be missed by: a unit that was converted to nm and back.
const ROUNDING: f64 = 1e-9;

/// Something that is known between two wavelengths alone.
struct KnownRange {
    what: String,
    range: [f64; 2],
    /// What is taken beyond them.
    beyond: &'static str,
}

/// What happens beyond a table.
const ENDS: &str = "its first and last values are used there";
/// What happens beyond a formula's range.
const FORMULA: &str = "the formula is used all the same there";

/// One sentence for each table in use that some source's light lies outside of.
pub(super) fn beyond_tables(scene: &Scene, chosen: &ChosenRules, light: &[[f64; 2]]) -> Vec<String> {
    let media = chosen.iter().filter_map(|(_, rule)| scene.materials.get((*rule)?)?.medium.as_deref());
    let media: BTreeSet<&str> = media.chain(scene.ambient.as_deref()).collect();
    let surfaces: BTreeSet<usize> = chosen.iter().filter_map(|(rule, _)| *rule).collect();
    let mut known: Vec<KnownRange> = media.iter().flat_map(|name| medium_ranges(scene, name)).collect();
    for rule in surfaces {
        let Some(material) = scene.materials.get(rule) else { continue };
        known.extend(surface_ranges(material).map(|(key, range)| KnownRange {
            what: format!("`{key}` of [[material]] {}", rule + 1),
            range,
            beyond: ENDS,
        }));
    }
    known.iter().filter_map(|k| sentence(scene, k, light)).collect()
}

/// The sentence for a table that a source's light is beyond; `light` are the ends of each source's wavelengths.
fn sentence(scene: &Scene, known: &KnownRange, light: &[[f64; 2]]) -> Option<String> {
    let [from, to] = known.range;
    let outside = |[a, b]: &[f64; 2]| *a < from * (1.0 - ROUNDING) || *b > to * (1.0 + ROUNDING);
    // One sentence a table: the first source that is beyond it stands for all.
    let (source, [a, b]) = light.iter().enumerate().find(|(_, range)| outside(range))?;
    let whose = source_label(scene, source);
    let light = if a == b { format!("{a} nm") } else { format!("{a} to {b} nm") };
    let known_for = if from == to { format!("{from} nm alone") } else { format!("{from} to {to} nm") };
    Some(format!("{} is known for {known_for}, but {whose} has light of {light}: {}", known.what, known.beyond))
}

/// A source as sentences name it.
fn source_label(scene: &Scene, source: usize) -> String {
    match scene.sources.get(source).map(|s| s.name.as_str()) {
        Some(name) if !name.is_empty() => format!("the source '{name}'"),
        _ => format!("[[source]] {}", source + 1),
    }
}

/// What the readers of the sources' files changed or supposed.
pub(super) fn source_files(scene: &Scene, loaded: &[Option<Loaded>]) -> Vec<String> {
    let mut sentences = Vec::new();
    for (index, loaded) in loaded.iter().enumerate() {
        let Some(Loaded::Rays(list)) = loaded else { continue };
        sentences.extend(list.notes.iter().map(|note| format!("{}: {note}", source_label(scene, index))));
    }
    sentences
}

/// The least and the greatest.
fn ends<'a>(mut nm: impl Iterator<Item = f64> + 'a) -> Option<[f64; 2]> {
    let first = nm.next()?;
    Some(nm.fold([first, first], |[a, b], x| [a.min(x), b.max(x)]))
}

/// The wavelengths for which what a medium is made of is known, each with what happens beyond.
fn medium_ranges(scene: &Scene, name: &str) -> Vec<KnownRange> {
    let mut known = Vec::new();
    let mut add = |what: String, range: Option<[f64; 2]>, beyond| {
        known.extend(range.map(|range| KnownRange { what, range, beyond }))
    };
    let own = scene.media.iter().find(|m| m.name == name);
    let entry = own.map_or(Some(name), |m| m.catalogue.as_deref());
    if let Some(entry) = entry {
        add(format!("the index of '{entry}'"), catalogue::range_nm(entry), FORMULA);
    }
    if let Some(medium::Medium { index_table, absorption_per_mm, .. }) = own {
        // A single point is a constant.
        let range = |t: &Vec<[f64; 2]>| if t.len() > 1 { ends(t.iter().map(|p| p[0])) } else { None };
        add(format!("`index_table` of the medium '{name}'"), index_table.as_ref().and_then(range), ENDS);
        if let Some(ByWavelength::Table(t)) = absorption_per_mm {
            add(format!("`absorption_per_mm` of the medium '{name}'"), range(t), ENDS);
        }
    }
    known
}

/// Keys of a material's tables over wavelength, and from where to where they go.
fn surface_ranges(m: &Material) -> impl Iterator<Item = (&'static str, [f64; 2])> {
    let coating = m.coating.as_ref().and_then(|rows| ends(rows.iter().filter_map(|r| r.get(1).copied())));
    let reflectance = match &m.reflectance {
        Some(Reflectance::ByAngleAndWavelength(rows)) => ends(rows.iter().map(|r| r[1])),
        _ => None,
    };
    [("coating", coating), ("reflectance", reflectance)].into_iter().filter_map(|(key, range)| Some((key, range?)))
}

/// Whether a face is one of no closed shell. Of ready meshes nothing is known.
pub(super) fn is_open(f: &PlacedFace<'_>, model: &Model) -> bool {
    f.face.is_some() && f.shell.is_none_or(|s| !model.part(f.part).shells[s].closed)
}

/// One sentence about the bodies that have faces in no closed shell.
pub(super) fn openings(bound: &BoundScene, model: &Model) -> Option<String> {
    let open = |f: &PlacedFace<'_>| {
        is_open(f, model) && bound.faces.get(f.id.index()).is_some_and(|optics| optics.body != AMBIENT)
    };
    let faces: Vec<PlacedFace<'_>> = model.placed_faces().filter(open).collect();
    let first = faces.first()?;
    let [instance, medium] = bound.body(bound.faces[first.id.index()].body)?;
    let bodies: BTreeSet<u32> = faces.iter().map(|f| bound.faces[f.id.index()].body).collect();
    let others = if bodies.len() > 1 { format!(" (and {} more)", bodies.len() - 1) } else { String::new() };
    let sheet = match (first.name(), first.entity()) {
        ("", Some(entity)) => format!(" (face #{entity})"),
        ("", None) => String::new(),
        (name, Some(entity)) => format!(" (face '{name}', #{entity})"),
        (name, None) => format!(" (face '{name}')"),
    };
    Some(format!(
        "'{instance}'{others} has the medium '{medium}' but no closed shell{sheet}: light that passes its opening is lost; close it in \
         the model, or give it a surface instead of a medium"
    ))
}

/// One sentence about the thinnest body that touches others and is hardly thicker than the glue, along an axis.
pub(super) fn films(bound: &BoundScene) -> Option<String> {
    let glue = bound.scene.run.glue_mm;
    let thickness = |k: u32| bound.bodies[k as usize].bounds.size().min_element();
    let touching: BTreeSet<u32> = bound.faces.iter().filter(|f| f.touches_body).map(|f| f.body).collect();
    // Twice the glue: a body as thin as that has both of its faces within the glue of one place.
    let thin = touching.into_iter().filter(|&k| k != AMBIENT && thickness(k) < 2.0 * glue);
    let film = thin.min_by(|a, b| thickness(*a).total_cmp(&thickness(*b)))?;
    let [name, medium] = bound.body(film)?;
    let thick = thickness(film);
    Some(format!(
        "'{name}' ({medium}) is {thick:.1e} mm thick, hardly more than [run] glue_mm = {glue:e}, within which faces of touching bodies \
         are one: light may pass it by or be lost; set glue_mm to {:.0e}",
        0.1 * thick
    ))
}

//! The faces that a source shines from, and what lies against them.

use super::notes::NAMED;
use super::select::{FaceSearch, select_faces};
use crate::math::{Aabb, BoxTree};
use crate::model::{Model, PlacedFace};
use crate::simulate::emitter::{Area, Cover, CoveredArea};
use crate::simulate::scene::{Key, Scene, SourceKind};
use crate::simulate::{Error, ErrorKind};
use crate::text::{count_of, figures, first_sentences};
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

/// Share of the named area from which on a note says that it is covered: a sample of a thousand on one of a few faces.
const TOLD_SHARE: f64 = 1e-3;

/// Sentences about luminous faces, by what they say.
#[derive(Default)]
struct LuminousNotes {
    /// Sources that shine evenly in all directions.
    even: Vec<String>,
    /// Faces that do not shine, being ready meshes.
    dark: Vec<String>,
    /// Areas that are covered.
    covered: Vec<String>,
}

/// Finds the faces that the sources of a scene shine from, and the opaque faces that lie against these.
pub(super) struct LuminousSearch<'m> {
    scene: &'m Scene,
    model: &'m Model,
    search: FaceSearch<'m>,
    /// The opaque faces with geometry, by the lower x of their boxes.
    faces: Vec<PlacedFace<'m>>,
    /// Boxes around these, mm.
    boxes: Vec<Aabb>,
    tree: BoxTree,
    /// Of each placed face its place in `faces`; `None` for one that is not there.
    places: Vec<Option<usize>>,
    /// What was made of opaque faces to cover others, by their places; `None` for a ready mesh.
    covers: HashMap<usize, Option<Arc<Cover>>>,
    /// For each source whether the scene gives it a kind; empty where that is not known.
    written_kinds: Vec<bool>,
    notes: LuminousNotes,
}

impl<'m> LuminousSearch<'m> {
    /// Prepares the search; `None` where no source shines from faces. `opaque` says which placed faces let no light through.
    pub(super) fn new(scene: &'m Scene, model: &'m Model, opaque: &[bool]) -> Option<Self> {
        if scene.sources.iter().all(|source| source.on.is_none()) {
            return None;
        }
        let mut boxed: Vec<(PlacedFace<'m>, Aabb)> = (model.placed_faces())
            .filter(|f| opaque[f.id.index()])
            .map(|f| (f, f.bounds()))
            .filter(|(_, bounds)| !bounds.is_empty())
            .collect();
        boxed.sort_by(|a, b| a.1.min.x.total_cmp(&b.1.min.x));
        let (faces, boxes): (Vec<PlacedFace<'m>>, Vec<Aabb>) = boxed.into_iter().unzip();
        let mut places = vec![None; opaque.len()];
        for (place, face) in faces.iter().enumerate() {
            places[face.id.index()] = Some(place);
        }
        let (search, tree) = (FaceSearch::new(model), BoxTree::new(&boxes));
        Some(Self {
            scene,
            model,
            search,
            faces,
            boxes,
            tree,
            places,
            covers: HashMap::new(),
            written_kinds: scene.written_kinds(),
            notes: LuminousNotes::default(),
        })
    }

    /// Returns the faces that a source shines from, ready for points to be drawn on them; `None` for a source that is not on faces.
    /// `labels` says what to call the instances.
    ///
    /// # Errors
    /// When its selector means no face, faces without area, or faces that are covered throughout.
    pub(super) fn luminous_faces(&mut self, index: usize, labels: &[String]) -> Result<Option<Area>, Error> {
        let (scene, model) = (self.scene, self.model);
        let Some(on) = &scene.sources[index].on else { return Ok(None) };
        let base = [Key::Name("source"), Key::Index(index), Key::Name("on")];
        let chosen = select_faces(scene, &base, on, &mut self.search)?;
        let covers = self.possible_covers(&chosen);
        let Some(area) = Area::new(model, &chosen, &covers) else {
            return Err(scene.error(ErrorKind::NoMatch, &base, "these faces have no area to shine from"));
        };
        let source = scene.source_label(index);
        // A stated kind is intended.
        let is_written = self.written_kinds.get(index).copied().unwrap_or(false);
        let is_default = scene.sources[index].kind == SourceKind::Point && !is_written;
        self.notes.even.extend(is_default.then(|| even_note(&source)));
        self.notes.dark.extend(dark_note(&source, model, &chosen));
        if covers.is_empty() {
            return Ok(Some(area));
        }
        let measured = area.measure_cover();
        let [whole, free] =
            [|a: &CoveredArea| a.whole, |a: &CoveredArea| a.free].map(|f| measured.iter().map(f).sum::<f64>());
        if free <= 0.0 {
            let message = "opaque faces of other solids lie against all of these faces, so that no light gets out";
            let error = scene.error(ErrorKind::NoMatch, &base, message);
            return Err(error.help("name faces that are free, or give what lies against them a `medium`"));
        }
        let share = 1.0 - free / whole;
        let note = (share >= TOLD_SHARE).then(|| covered_note(&source, model, labels, &measured, share));
        self.notes.covered.extend(note);
        Ok(Some(area))
    }

    /// Returns the notes on the faces that were found: of each kind the first sentences, and one that counts the others.
    pub(super) fn into_notes(self) -> Vec<String> {
        let LuminousNotes { even, dark, covered } = self.notes;
        let kinds = [
            (even, "shine evenly in all directions too"),
            (dark, "name ready meshes too, which do not shine"),
            (covered, "have areas that are covered in the same way"),
        ];
        let told = |(sentences, what): (Vec<String>, &str)| {
            first_sentences(sentences, NAMED, |further| {
                format!("{} {what}", count_of(further as u64, "more source"))
            })
        };
        kinds.into_iter().flat_map(told).collect()
    }

    /// Returns for each chosen face that is opaque the opaque faces of other shells that come within the glue distance of its box, by the
    /// numbers of placed faces; faces without any are left out. What lets light in, or is the boundary of a medium, covers nothing: light
    /// goes on there.
    fn possible_covers(&mut self, chosen: &[usize]) -> HashMap<usize, Vec<Arc<Cover>>> {
        // A set: two points of a selector may mean one face.
        let shining: BTreeSet<usize> = chosen.iter().filter_map(|&face| self.places[face]).collect();
        let mut covers: HashMap<usize, Vec<Arc<Cover>>> = HashMap::new();
        for place in shining {
            let against = self.places_against(place);
            if !against.is_empty() {
                let over: Vec<Arc<Cover>> = against.into_iter().filter_map(|other| self.cover(other)).collect();
                covers.insert(self.faces[place].id.index(), over);
            }
        }
        covers
    }

    /// Returns the places of the opaque faces of other shells whose boxes come within the glue distance of that of an opaque face.
    fn places_against(&self, place: usize) -> Vec<usize> {
        let glue = self.scene.run.glue_distance();
        let shell = |place: usize| (self.faces[place].instance, self.faces[place].shell);
        let mut against = Vec::new();
        // With room for rounding: of two boxes the one of the lower place is grown, whichever of both shines.
        self.tree.any_meeting(&self.boxes[place].grown(glue).with_room(), |other| {
            let other = other as usize;
            let [low, high] = [place.min(other), place.max(other)].map(|place| self.boxes[place]);
            if shell(place) != shell(other) && !low.grown(glue).intersection(high).is_empty() {
                against.push(other);
            }
            false
        });
        against.sort_unstable();
        against
    }

    /// Returns an opaque face, by its place, ready to cover others, made when it is first asked for; `None` for a ready mesh.
    fn cover(&mut self, place: usize) -> Option<Arc<Cover>> {
        let (model, glue) = (self.model, self.scene.run.glue_distance());
        let (placed, bounds) = (self.faces[place], self.boxes[place]);
        let cover = self.covers.entry(place).or_insert_with(|| {
            let closed = placed.shell.is_some_and(|s| model.part(placed.part).shells[s].closed);
            Cover::new(&placed, closed, bounds, glue).map(Arc::new)
        });
        cover.clone()
    }
}

/// Returns the sentence about a source on faces whose kind the scene leaves to the default.
fn even_note(source: &str) -> String {
    format!(
        "{source} shines from each point of its faces with the same intensity in every direction (`kind = \"point\"`, the default); most \
         luminous faces follow the cosine law: `kind = \"lambertian\"`"
    )
}

/// Returns the sentence about the faces that a source names and that do not shine, being ready meshes; `None` where there are none.
fn dark_note(source: &str, model: &Model, chosen: &[usize]) -> Option<String> {
    let chosen: BTreeSet<usize> = chosen.iter().copied().collect();
    let named = || model.placed_faces().filter(|f| chosen.contains(&f.id.index()));
    let dark: Vec<f64> =
        named().filter_map(|f| Some(f.tessellated?.mesh.area() * f.placement.scale.powi(2))).collect();
    if dark.is_empty() {
        return None;
    }
    let (all, area) = (chosen.len(), figures(dark.iter().sum(), 3));
    Some(format!(
        "{} of the {} that {source} names do not shine, being ready meshes ({area} mm²): all of the power leaves from the rest",
        dark.len(),
        count_of(all as u64, "face"),
    ))
}

/// Returns the sentence about the share of its area that a source has covered, naming the face of which most is.
fn covered_note(source: &str, model: &Model, labels: &[String], measured: &[CoveredArea], share: f64) -> String {
    let covered = |a: &CoveredArea| a.whole - a.free;
    let most = measured.iter().max_by(|a, b| covered(a).total_cmp(&covered(b)));
    let face = most.and_then(|a| Some((a, model.placed_faces().find(|f| f.id == a.face)?)));
    let example = face.map_or_else(String::new, |(a, f)| {
        let name = match (f.entity(), f.name()) {
            (Some(entity), _) => format!("face #{entity}"),
            (None, "") => format!("face {}", f.id.0),
            (None, name) => format!("face '{name}'"),
        };
        format!(", most of it {:.0} % of {name} of '{}'", 100.0 * covered(a) / a.whole, labels[f.instance])
    });
    format!(
        "{:.1} % of the area that {source} names lies against opaque faces of other solids{example}: it does not shine, and all of the \
         power leaves from the rest",
        100.0 * share
    )
}

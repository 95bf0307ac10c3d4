//! The faces that a source shines from, and what lies against them.

use super::nearest::{Nearest, face_bounds};
use super::select::select_faces;
use crate::math::Aabb;
use crate::model::{Model, PlacedFace};
use crate::simulate::emitter::{Area, Cover, CoveredArea};
use crate::simulate::scene::{Key, Scene};
use crate::simulate::{Error, ErrorKind};
use std::collections::HashMap;
use std::sync::Arc;

/// Share of the named area from which on it is told that it is covered: a sample of a thousand on one of a few faces.
const TOLD_SHARE: f64 = 1e-3;

/// The luminous faces of a source.
pub(super) struct Luminous {
    pub(super) area: Area,
    /// One sentence about the area that is covered; `None` where all is free.
    pub(super) note: Option<String>,
}

/// Returns the faces that a source shines from, ready for points to be drawn on them; `None` for a source that is not on faces. `opaque`
/// says which placed faces let no light through, `labels` what to call the instances.
///
/// # Errors
/// When its selector means no face, faces without area, or faces that are covered throughout.
pub(super) fn luminous_faces(
    scene: &Scene,
    index: usize,
    model: &Model,
    opaque: &[bool],
    labels: &[String],
) -> Result<Option<Luminous>, Error> {
    let Some(on) = &scene.sources[index].on else { return Ok(None) };
    let base = [Key::Name("source"), Key::Index(index), Key::Name("on")];
    let chosen = select_faces(scene, &base, on, model, &mut Nearest::new(model))?;
    let covers = possible_covers(scene, model, &chosen, opaque);
    let Some(area) = Area::new(model, &chosen, &covers) else {
        return Err(scene.error(ErrorKind::NoMatch, &base, "these faces have no area to shine from"));
    };
    if covers.is_empty() {
        return Ok(Some(Luminous { area, note: None }));
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
    let name = &scene.sources[index].name;
    let source = if name.is_empty() { format!("[[source]] {}", index + 1) } else { format!("'{name}'") };
    let note = (share >= TOLD_SHARE).then(|| covered_note(&source, model, labels, &measured, share));
    Ok(Some(Luminous { area, note }))
}

/// Returns for each chosen face that is opaque the opaque faces of other shells that come within the glue distance of its box, by the
/// numbers of placed faces; faces without any are left out. What lets light in, or is the boundary of a medium, covers nothing: light goes
/// on there.
fn possible_covers(
    scene: &Scene,
    model: &Model,
    chosen: &[usize],
    opaque: &[bool],
) -> HashMap<usize, Vec<Arc<Cover>>> {
    let mut shines = vec![false; opaque.len()];
    for &face in chosen.iter().filter(|&&face| opaque[face]) {
        shines[face] = true;
    }
    let mut boxes: Vec<(PlacedFace<'_>, Aabb)> =
        model.placed_faces().filter(|f| opaque[f.id.index()]).map(|f| (f, face_bounds(&f))).collect();
    boxes.sort_by(|a, b| a.1.min.x.total_cmp(&b.1.min.x));
    let glue = scene.run.glue_mm;
    let mut made: HashMap<usize, Option<Arc<Cover>>> = HashMap::new();
    let mut covers: HashMap<usize, Vec<Arc<Cover>>> = HashMap::new();
    let mut note_cover = |over: &(PlacedFace<'_>, Aabb), under: usize| {
        let (placed, bounds) = over;
        let cover = made.entry(placed.id.index()).or_insert_with(|| {
            let closed = placed.shell.is_some_and(|s| model.part(placed.part).shells[s].closed);
            Cover::new(placed, closed, *bounds, glue).map(Arc::new)
        });
        covers.entry(under).or_default().extend(cover.clone());
    };
    for (i, a) in boxes.iter().enumerate() {
        // Sorted along x: from the first box that begins behind this one on, none meets it.
        for b in boxes[i + 1..].iter().take_while(|b| b.1.min.x <= a.1.max.x + glue) {
            let [one, other] = [a, b].map(|f| f.0.id.index());
            let same_shell = a.0.instance == b.0.instance && a.0.shell == b.0.shell;
            if same_shell || !(shines[one] || shines[other]) || a.1.grown(glue).intersection(b.1).is_empty() {
                continue;
            }
            if shines[one] {
                note_cover(b, one);
            }
            if shines[other] {
                note_cover(a, other);
            }
        }
    }
    covers
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

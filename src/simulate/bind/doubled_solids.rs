//! Solids that stand twice in one place, as where a file holds a body and a copy of it that was never moved.
//!
//! Known weakness: copies whose faces are split or parametrized otherwise are not found, nor those that lie on either side of a border
//! between the cells that places are rounded to.

use super::bound_scene::BoundScene;
use crate::math::{Point, Uv};
use crate::model::{Face, Model, PlacedFace};
use crate::text::{count_of, first_sentences};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Cells that places are rounded to, mm: more than the rounding of a file's coordinates, and less than any distance that is meant.
const CELL_MM: f64 = 1e-6;

/// Pairs of solids that are named; beyond them only the number is given.
const NAMED_PAIRS: usize = 3;

/// A solid: its instance, and its number in the part.
type SolidPlace = (usize, usize);

/// What solids of the same faces in one place share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Imprint {
    faces: usize,
    /// Sum of what the faces hash to, which their order does not change.
    sum: u64,
}

/// Returns sentences about closed solids that have the same faces in one place as another: one for each of the first pairs, and one that
/// counts the others.
pub(super) fn doubled_solid_notes(bound: &BoundScene, model: &Model) -> Vec<String> {
    let mut imprints: BTreeMap<SolidPlace, Imprint> = BTreeMap::new();
    for placed in model.placed_faces() {
        let is_closed = placed.shell.is_some_and(|shell| model.part(placed.part).shells[shell].closed);
        let Some(face) = placed.face.filter(|_| is_closed) else { continue };
        let imprint = imprints.entry((placed.instance, placed.solid)).or_default();
        imprint.faces += 1;
        imprint.sum = imprint.sum.wrapping_add(face_hash(&placed, face));
    }
    let mut first: BTreeMap<Imprint, SolidPlace> = BTreeMap::new();
    let mut pairs: Vec<[SolidPlace; 2]> = Vec::new();
    for (solid, imprint) in imprints {
        let earlier = *first.entry(imprint).or_insert(solid);
        if earlier != solid {
            pairs.push([earlier, solid]);
        }
    }
    let sentences = pairs.iter().map(|pair| {
        let [one, other] = pair.map(|(instance, solid)| format!("solid {solid} of '{}'", bound.instances[instance]));
        format!(
            "{one} and {other} have the same faces in one place: rounding decides which of them light meets first, and areas and volumes \
             count both; leave one out by `without` under [[model]] if it is a copy"
        )
    });
    first_sentences(sentences, NAMED_PAIRS, |further| {
        format!("the same holds for {} of solids", count_of(further as u64, "more pair"))
    })
}

/// Returns a number that copies of a face in one place share: of its box, and of the middle of its parameters.
fn face_hash(placed: &PlacedFace<'_>, face: &Face) -> u64 {
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    let middle = face.surface.evaluate(Uv::new(0.5 * (u0 + u1), 0.5 * (v0 + v1)));
    let bounds = placed.bounds();
    let cell = |p: Point| p.to_array().map(|x| (x / CELL_MM).round() as i64);
    let mut hasher = DefaultHasher::new();
    [bounds.min, bounds.max, placed.placement.point(middle)].map(cell).hash(&mut hasher);
    hasher.finish()
}

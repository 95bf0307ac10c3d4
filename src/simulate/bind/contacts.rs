//! Faces of two solids at one place: which faces may touch which.

use super::nearest::Nearest;
use crate::math::polygon::is_inside_polygons;
use crate::math::{Aabb, BoxTree, Point, Uv};
use crate::model::{Model, PlacedFace};
use crate::simulate::body::AMBIENT;
use crate::simulate::scene::Scene;
use crate::simulate::trim_loops::trim_polygons;

/// Marks the faces whose box comes within the glue distance of the box of a face of another body, and returns those pairs of bodies too, in
/// no particular order, some more than once and either way round. `of_face` is the body of each placed face; faces of the surroundings are
/// never marked.
pub(super) fn touching_bodies(scene: &Scene, model: &Model, of_face: &[u32]) -> (Vec<bool>, Vec<[u32; 2]>) {
    // Each box is grown by half of the glue, so that two within its whole meet.
    let boxed = |f: PlacedFace<'_>| (f.id.index(), f.bounds().grown(0.5 * scene.run.glue_distance()));
    let (faces, boxes): (Vec<usize>, Vec<Aabb>) =
        model.placed_faces().filter(|f| of_face[f.id.index()] != AMBIENT).map(boxed).unzip();
    let (mut touching, mut pairs) = (vec![false; of_face.len()], Vec::new());
    for meeting in BoxTree::meeting_pairs(&boxes) {
        let [a, b] = meeting.map(|k| faces[k]);
        if of_face[a] != of_face[b] {
            (touching[a], touching[b]) = (true, true);
            let pair = [of_face[a], of_face[b]];
            // Neighbouring faces of the same two bodies come one after another; others twice do no harm.
            if pairs.last() != Some(&pair) {
                pairs.push(pair);
            }
        }
    }
    (touching, pairs)
}

/// Marks the faces whose box comes within the glue distance of the box of a face of another shell of the same body. Only boxes are tested:
/// whether the shells touch is decided where light crosses there.
pub(super) fn touching_siblings(scene: &Scene, model: &Model, of_face: &[u32]) -> Vec<bool> {
    let mut siblings = vec![false; of_face.len()];
    let mut faces: Vec<PlacedFace<'_>> = (model.placed_faces())
        // Parts of one shell have no siblings.
        .filter(|f| of_face[f.id.index()] != AMBIENT && model.part(f.part).shells.len() > 1)
        .collect();
    faces.sort_by_key(|f| of_face[f.id.index()]);
    for body in faces.chunk_by(|a, b| of_face[a.id.index()] == of_face[b.id.index()]) {
        let boxes: Vec<Aabb> = body.iter().map(|f| f.bounds().grown(0.5 * scene.run.glue_distance())).collect();
        for meeting in BoxTree::meeting_pairs(&boxes) {
            let [a, b] = meeting.map(|k| &body[k]);
            // By boxes alone: whether the shells really touch at a point is tested where light crosses there.
            if a.shell != b.shell {
                (siblings[a.id.index()], siblings[b.id.index()]) = (true, true);
            }
        }
    }
    siblings
}

/// Questions of distance after which faces whose boxes meet are taken to touch: some seconds of work.
const MOST_DISTANCES: usize = 50_000;
/// Samples across a face in each parameter.
const SAMPLES: usize = 5;

/// Marks faces of bodies, and opaque faces without a medium (`opaque`), that lie on each other: both are flat, in one plane, and their
/// boxes meet, or a sample point of one is within the glue distance of the other. After [`MOST_DISTANCES`] distances, faces whose boxes
/// meet are marked without a check. All `false` where either is missing.
pub(super) fn media_on_opaque(scene: &Scene, model: &Model, of_face: &[u32], opaque: &[bool]) -> Vec<bool> {
    let mut on_opaque = vec![false; of_face.len()];
    // Nothing to find: no bodies, or nothing opaque.
    if of_face.iter().all(|b| *b == AMBIENT) || !opaque.contains(&true) {
        return on_opaque;
    }
    let placed: Vec<PlacedFace<'_>> = model.placed_faces().collect();
    let glue = scene.run.glue_distance();
    // Half the glue on either side makes it whole between two boxes.
    let box_of = |f: &PlacedFace<'_>| f.bounds().grown(0.5 * glue);
    let mut faces: Vec<(usize, Aabb)> = (placed.iter())
        .filter(|f| of_face[f.id.index()] != AMBIENT || opaque[f.id.index()])
        .map(|f| (f.id.index(), box_of(f)))
        .collect();
    // By their lower x: the order of the pairs decides which of them are marked without a check.
    faces.sort_by(|a, b| a.1.min.x.total_cmp(&b.1.min.x));
    let (faces, boxes): (Vec<usize>, Vec<Aabb>) = faces.into_iter().unzip();
    let mut nearest = Nearest::new(model);
    let mut samples: Vec<Option<Vec<Point>>> = vec![None; placed.len()];
    let mut distances = 0;
    for meeting in BoxTree::meeting_pairs(&boxes) {
        let [a, b] = meeting.map(|k| faces[k]);
        let [box_a, box_b] = meeting.map(|k| boxes[k]);
        let mixed = (of_face[a] == AMBIENT) != (of_face[b] == AMBIENT);
        if !mixed || (on_opaque[a] && on_opaque[b]) {
            continue;
        }
        // Flat faces are decided by their planes: a seat or a rim can be narrower than any samples are apart.
        let mut touch = nearest.are_in_one_plane([a, b], box_a.intersection(box_b), glue);
        // Both ways: the points of a large face may all miss a small one that lies on it.
        for (one, other, around) in [(a, b, box_b), (b, a, box_a)] {
            if touch {
                break;
            }
            let points = samples[one].get_or_insert_with(|| inner_points(&placed[one]));
            let near = around.grown(glue);
            touch = points.iter().filter(|p| near.contains(**p)).any(|p| {
                distances += 1;
                // Out of work, boxes decide: a face marked without need costs time, a missed one costs rays.
                distances > MOST_DISTANCES || nearest.is_within(other, *p, glue)
            });
        }
        if touch {
            (on_opaque[a], on_opaque[b]) = (true, true);
        }
    }
    on_opaque
}

/// Returns those of 5 × 5 samples over the domain of a face that lie inside its loops, mm, in scene coordinates; none for a ready mesh.
fn inner_points(f: &PlacedFace<'_>) -> Vec<Point> {
    let Some(face) = f.face else { return Vec::new() };
    let loops = trim_polygons(face);
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    // Middles of a grid: corners and borders of a face touch its neighbours in any case.
    let at = |k: usize, a: f64, b: f64| a + (b - a) * (k as f64 + 0.5) / SAMPLES as f64;
    (0..SAMPLES * SAMPLES)
        .map(|k| Uv::new(at(k / SAMPLES, u0, u1), at(k % SAMPLES, v0, v1)))
        .filter(|&uv| is_inside_polygons(&loops, uv))
        .map(|uv| f.placement.point(face.surface.evaluate(uv)))
        .collect()
}

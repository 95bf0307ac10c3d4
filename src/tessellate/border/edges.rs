//! Each edge is sampled once, in space, for the tighter of its faces; both faces use those very points.

use super::curve_chords::bisect_all;
use super::edge_chords::{EdgeSide, edge_parameters};
use super::opposite_sides;
use crate::math::Point;
use crate::model::{Edge, Face, Part};
use crate::tessellate::face_surface::FaceSurface;
use crate::tessellate::proof::flat_triangle::distance_to_chord;
use rayon::prelude::*;
use smallvec::SmallVec;

/// Share of an edge's sag within which two middles are those of one edge that stands twice in the file.
const SAME_CURVE: f64 = 1e-3;
/// Sides of a loop up to which all of them may be one chord.
const MAX_LENS_SIDES: usize = 4;

/// Where an edge is divided: its parameters, ascending, both ends included.
#[derive(Clone, Debug, Default)]
pub(in crate::tessellate) struct Division {
    pub(in crate::tessellate) t: Vec<f64>,
    /// Index of the first inner point among the part's shared positions.
    pub(in crate::tessellate) first: u32,
}

/// What an edge has by itself, before others have a say: how much denser than usual it is to be, and its parameters.
#[derive(Clone, Debug)]
pub(in crate::tessellate) struct OwnDivision {
    denser: u32,
    t: Vec<f64>,
}

/// Divides all edges of a part. Returns the divisions by edge, and the shared positions in the part's coordinates: its vertices, then inner
/// points edge by edge.
///
/// `sides`, `denser` and `further`, parameters to be added in any order, are by edge; an edge without sides is one chord. `own` is read and
/// rewritten: what edges have by themselves, kept from round to round, empty before the first.
pub(in crate::tessellate) fn divide(
    part: &Part,
    faces: &[(&Face, &FaceSurface<'_>)],
    sides: &[Vec<EdgeSide<'_, '_>>],
    (denser, further): (&[u32], &[Vec<f64>]),
    own: &mut Vec<OwnDivision>,
) -> (Vec<Division>, Vec<Point>) {
    // Most edges are as before in a further round, and dividing is the dearest part of it.
    let divide_alone = |(i, (edge, sides)): (usize, (&Edge, &Vec<EdgeSide<'_, '_>>))| match own.get(i) {
        Some(before) if before.denser == denser[i] => before.clone(),
        _ if sides.is_empty() => OwnDivision { denser: denser[i], t: edge.curve.domain().to_vec() },
        _ => OwnDivision { denser: denser[i], t: edge_parameters(&edge.curve, sides, denser[i]) },
    };
    *own = part.edges.par_iter().zip(sides).enumerate().map(divide_alone).collect();
    // Then edges that others have a say in.
    let mut times: Vec<Vec<f64>> = own.iter().map(|o| o.t.clone()).collect();
    // Each on what the one before has left: twins are separated when all else is done.
    opposite_sides::equalise(part, faces, sides, denser, &mut times);
    open_lenses(part, faces, &mut times);
    separate_twins(part, sides, &mut times);
    sample_positions(part, with_further(times.into_iter(), further))
}

/// Returns each edge's samples with its further ones, which may come in any order: ascending, each once.
fn with_further(times: impl Iterator<Item = Vec<f64>>, further: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let merge = |(mut t, further): (Vec<f64>, &Vec<f64>)| {
        t.extend(further);
        t.sort_by(f64::total_cmp);
        t.dedup();
        t
    };
    times.zip(further).map(merge).collect()
}

/// Returns the divisions at `times`, two or more ascending parameters of each edge, and the shared positions: vertices, then inner points
/// edge by edge.
pub(in crate::tessellate) fn sample_positions(part: &Part, times: Vec<Vec<f64>>) -> (Vec<Division>, Vec<Point>) {
    let inner = |(edge, t): (&Edge, &Vec<f64>)| -> Vec<Point> {
        t[1..t.len() - 1].iter().map(|&t| edge.curve.evaluate(t)).collect()
    };
    // In chunks: most edges have few points, and a task each would cost more than they do.
    let inner: Vec<Vec<Point>> = part.edges.par_iter().zip(&times).with_min_len(16).map(inner).collect();
    let mut divisions = Vec::with_capacity(times.len());
    let mut positions = part.vertices.clone();
    for (inner, t) in inner.into_iter().zip(times) {
        divisions.push(Division { t, first: positions.len() as u32 });
        positions.extend(inner);
    }
    (divisions, positions)
}

/// Halves the most bent edge of every loop whose edges, two to [`MAX_LENS_SIDES`] of them, are all one chord between the same two vertices,
/// which would leave nothing of the face. The seam of a sphere from pole to pole counts as two. Where all are straight nothing changes.
fn open_lenses(part: &Part, faces: &[(&Face, &FaceSurface<'_>)], times: &mut [Vec<f64>]) {
    for trim in faces.iter().flat_map(|(face, _)| &face.loops).filter(|l| l.uses.len() <= MAX_LENS_SIDES) {
        let edges: SmallVec<[usize; 4]> = trim.uses.iter().filter_map(|u| Some(u.edge?.0 as usize)).collect();
        if edges.len() < 2 || edges.iter().any(|&e| times.get(e).is_none_or(|t| t.len() != 2)) {
            continue;
        }
        let chord = |e: usize| {
            let [a, b] = part.edges[e].vertices;
            [a.0.min(b.0), a.0.max(b.0)]
        };
        // Different vertices leave a triangle at least.
        if edges.iter().any(|&e| chord(e) != chord(edges[0])) {
            continue;
        }
        let off = |e: usize| {
            let (curve, t) = (&part.edges[e].curve, &times[e]);
            distance_to_chord(curve.evaluate(0.5 * (t[0] + t[1])), &[curve.evaluate(t[0]), curve.evaluate(t[1])])
        };
        let most = edges.iter().rev().map(|&e| (off(e), e)).max_by(|x, y| x.0.total_cmp(&y.0));
        // With all of them straight there is no face between, and a corner would change nothing.
        if let Some((_, e)) = most.filter(|x| x.0 > 0.0) {
            bisect_all(&mut times[e]);
        }
    }
}

/// Halves all but the straightest of edges that are one chord between the same two vertices, which as one edge of the mesh would have more
/// than two facets. Edges that coincide with the straightest, one edge that stands twice in the file, stay as they are.
fn separate_twins(part: &Part, sides: &[Vec<EdgeSide<'_, '_>>], times: &mut [Vec<f64>]) {
    let chord = |e: usize| {
        let [a, b] = part.edges[e].vertices;
        [a.0.min(b.0), a.0.max(b.0)]
    };
    let mut single: Vec<usize> =
        (0..times.len()).filter(|&e| times[e].len() == 2 && !sides[e].is_empty()).collect();
    // In order of edges too, so that the same file always gives the same corner to the same edge.
    single.sort_unstable_by_key(|&e| (chord(e), e));
    for twins in single.chunk_by(|&a, &b| chord(a) == chord(b)).filter(|t| t.len() > 1) {
        let middle = |e: usize| part.edges[e].curve.evaluate(0.5 * (times[e][0] + times[e][1]));
        let off =
            |e: usize| distance_to_chord(middle(e), &[0, 1].map(|i| part.edges[e].curve.evaluate(times[e][i])));
        let mut bent: Vec<(f64, usize)> = twins.iter().map(|&e| (off(e), e)).collect();
        bent.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        // One edge that stands twice in a file stays one.
        let straightest = middle(bent[0].1);
        bent.retain(|&(off, e)| off > 0.0 && (middle(e) - straightest).length() > SAME_CURVE * off);
        for (_, e) in bent {
            bisect_all(&mut times[e]);
        }
    }
}

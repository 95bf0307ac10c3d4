//! Analysis of a shell by its edges: whether it is closed, and whether it is several shells that share no edge.
//!
//! Some exporters list the faces of bodies that touch, or are apart, as one closed shell: light goes from one body into the next only
//! where these are two. A piece within another one that looks the other way is a void; boxes show what may be within. Shells whose faces
//! have edges of their own each, and those with a piece that is not closed by its edges, are left as they are. Known weakness: a body in
//! the recess of another that looks the other way is taken as a void of it.

use super::orientation::{FaceBoxes, looks_inwards};
use crate::math::{Aabb, BoxTree};
use crate::model::{EdgeId, Face, Part};
use crate::nurbs::project;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Pieces above this many stay one shell: each is compared with all larger ones, 34 million pairs of so many.
const MAX_PIECES: usize = 8192;
/// Shares of the extent of an edge and of that of all such edges within which another one runs along it, of faces that have edges of their
/// own: wide, for a closed shell must not be opened; a shell of 900 mm leaves gaps of 0.006.
const BESIDE_SHARES: [f64; 2] = [0.01, 1e-4];

/// A solid of a shell that is several.
#[derive(Debug, Default)]
pub(super) struct SolidFaces {
    pub(super) outer: Vec<Face>,
    pub(super) voids: Vec<Vec<Face>>,
}

/// Which faces use an edge, and how.
struct EdgeSides {
    first: usize,
    uses: usize,
    /// Whether it is used along and against its parameter, as seen from outside.
    ways: [bool; 2],
}

impl EdgeSides {
    /// Whether faces lie on both sides: two, or one that meets itself, though it may run along the edge twice in one direction.
    fn is_joined(&self) -> bool {
        self.uses > 1
    }
}

/// What a piece of a shell is beside the larger ones.
#[derive(Clone, Copy, Debug)]
enum PieceRole {
    Solid,
    /// A void of the solid whose outer piece is this one.
    VoidOf(usize),
    /// Undecided: it stays in the shell of that piece.
    PartOf(usize),
}

/// Returns the sides of all edges of a shell, and for each face the first face to which edges lead from it.
fn edge_sides(faces: &[Face]) -> (FxHashMap<EdgeId, EdgeSides>, Vec<usize>) {
    let mut sides: FxHashMap<EdgeId, EdgeSides> = FxHashMap::default();
    let mut joined: Vec<usize> = (0..faces.len()).collect();
    for (k, face) in faces.iter().enumerate() {
        for edge_use in face.loops.iter().flat_map(|l| &l.uses) {
            let Some(edge) = edge_use.edge else { continue };
            let side = sides.entry(edge).or_insert(EdgeSides { first: k, uses: 0, ways: [false; 2] });
            side.uses += 1;
            // A face that looks the other way runs its loops the other way.
            side.ways[usize::from(edge_use.reversed != face.reversed)] = true;
            let [a, b] = [side.first, k].map(|face| first_joined(&mut joined, face));
            joined[a.max(b)] = a.min(b);
        }
    }
    let firsts = (0..faces.len()).map(|k| first_joined(&mut joined, k)).collect();
    (sides, firsts)
}

/// Follows faces to the first one that they are joined to, and makes the way there shorter.
fn first_joined(joined: &mut [usize], mut k: usize) -> usize {
    while joined[k] != k {
        joined[k] = joined[joined[k]];
        k = joined[k];
    }
    k
}

/// Whether a shell certainly has a border: an edge of one face alone, along which no other such edge runs.
pub(super) fn has_border(faces: &[Face], part: &Part) -> bool {
    let (sides, _) = edge_sides(faces);
    let mut single: Vec<EdgeId> = sides.iter().filter(|(_, s)| !s.is_joined()).map(|(edge, _)| *edge).collect();
    single.sort_unstable();
    let curve = |k: usize| &part.edges[single[k].0 as usize].curve;
    let boxes: Vec<Aabb> = (0..single.len()).map(|k| curve(k).bounds()).collect();
    let tree = BoxTree::new(&boxes);
    let extent = boxes.iter().fold(Aabb::EMPTY, |all, of_edge| all.union(*of_edge)).diagonal();
    let is_border = |k: usize| {
        let [a, b] = curve(k).domain();
        let middle = curve(k).evaluate(0.5 * (a + b));
        let near = (BESIDE_SHARES[0] * boxes[k].diagonal()).max(BESIDE_SHARES[1] * extent);
        let is_beside = |other: u32| {
            let other = other as usize;
            other != k && project::nearest(curve(other), middle).1 <= near
        };
        !tree.any_meeting(&Aabb::from_points([middle]).grown(near), is_beside)
    };
    // All of them: of a shell whose faces have edges of their own few may be at its border.
    (0..single.len()).into_par_iter().any(is_border)
}

/// Returns the number of the piece of each face, in the order of their first faces, and how many there are; `None` where there is but one,
/// where an edge does not run both ways, or where a face has no edges.
fn closed_pieces(faces: &[Face]) -> Option<(Vec<usize>, usize)> {
    let has_edges = |face: &Face| face.loops.iter().flat_map(|l| &l.uses).any(|u| u.edge.is_some());
    if !faces.iter().all(has_edges) {
        return None;
    }
    let (sides, firsts) = edge_sides(faces);
    if sides.values().any(|side| side.ways != [true; 2]) {
        return None;
    }
    let (mut numbers, mut count) = (Vec::with_capacity(faces.len()), 0);
    for (k, &first) in firsts.iter().enumerate() {
        // The first face of a piece comes before its others.
        let number = if first == k { count } else { numbers[first] };
        count += usize::from(first == k);
        numbers.push(number);
    }
    (2..=MAX_PIECES).contains(&count).then_some((numbers, count))
}

/// Returns the faces of a closed shell as solids: one, if it is not several shells without a common edge. All keep their order.
pub(super) fn separate_solids(faces: Vec<Face>) -> Vec<SolidFaces> {
    let Some((numbers, count)) = closed_pieces(&faces) else {
        return vec![SolidFaces { outer: faces, voids: Vec::new() }];
    };
    let mut pieces: Vec<Vec<Face>> = vec![Vec::new(); count];
    for (face, &number) in faces.iter().zip(&numbers) {
        pieces[number].push(face.clone());
    }
    let roles = piece_roles(&pieces);
    let mut solids: Vec<SolidFaces> = Vec::new();
    // Of each piece the solid, and which of its voids it is.
    let mut places: Vec<(usize, Option<usize>)> = vec![(0, None); count];
    for k in (0..count).filter(|k| matches!(roles[*k], PieceRole::Solid)) {
        places[k] = (solids.len(), None);
        solids.push(SolidFaces::default());
    }
    for k in 0..count {
        match roles[k] {
            PieceRole::Solid => {}
            PieceRole::PartOf(outer) => places[k] = places[outer],
            PieceRole::VoidOf(outer) => {
                let solid = places[outer].0;
                places[k] = (solid, Some(solids[solid].voids.len()));
                solids[solid].voids.push(Vec::new());
            }
        }
    }
    for (face, number) in faces.into_iter().zip(numbers) {
        let (solid, void) = places[number];
        match void {
            Some(void) => solids[solid].voids[void].push(face),
            None => solids[solid].outer.push(face),
        }
    }
    solids
}

/// Tells solids from voids, by the smallest of the larger pieces that may enclose each.
fn piece_roles(pieces: &[Vec<Face>]) -> Vec<PieceRole> {
    let boxes: Vec<FaceBoxes> = pieces.iter().map(|faces| FaceBoxes::new(faces)).collect();
    let mut by_size: Vec<usize> = (0..pieces.len()).collect();
    by_size.sort_by(|&a, &b| boxes[b].diagonal().total_cmp(&boxes[a].diagonal()));
    let mut roles = vec![PieceRole::Solid; pieces.len()];
    // Computed once for each: a body may have thousands of pieces in its box, and each takes hundreds of points on each face.
    let mut known: Vec<Option<Option<bool>>> = vec![None; pieces.len()];
    let mut looks = |piece: usize| *known[piece].get_or_insert_with(|| looks_inwards(&pieces[piece]));
    for (rank, &k) in by_size.iter().enumerate() {
        let around = by_size[..rank].iter().rev().find(|&&larger| boxes[larger].may_enclose(&boxes[k]));
        let Some(&around) = around else { continue };
        // What is in a void is seen from the solid that has it.
        let outer = match roles[around] {
            PieceRole::Solid => around,
            PieceRole::VoidOf(outer) | PieceRole::PartOf(outer) => outer,
        };
        roles[k] = match [outer, k].map(&mut looks) {
            // A block in the hole of a frame looks as the frame does.
            [Some(solid), Some(piece)] if solid == piece => PieceRole::Solid,
            [Some(_), Some(_)] => PieceRole::VoidOf(outer),
            _ => PieceRole::PartOf(outer),
        };
    }
    roles
}

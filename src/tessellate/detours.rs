//! Chords of a border that pass a corner of it on the wrong side by less than they stray: led over that corner they no longer cross the
//! chords that end there. What then lies between such a chord and its detour is for [`super::closing`].

use super::closing::HIGHEST;
use super::face_surface::FaceSurface;
use super::nodes::{Nodes, edge_key};
use super::proof::flat_triangle::distance_to_chord;
use super::transition::triangulate::{Outline, crossings};
use crate::math::Uv;
use rustc_hash::{FxHashMap, FxHashSet};

/// How often detours are looked for: one may come to cross another chord.
const MOST_ROUNDS: usize = 4;

/// Leads chords of the `border` in an outline over corners of others that they cross, where these are near enough.
pub(super) fn with_detours<'t>(
    surface: &FaceSurface<'_>,
    mut outline: Outline<'t>,
    border: &[[u32; 2]],
) -> Outline<'t> {
    let corners: FxHashSet<u32> = border.iter().flatten().copied().collect();
    let mut chords: FxHashSet<[u32; 2]> = border.iter().map(|&[a, b]| edge_key(a, b)).collect();
    for _ in 0..MOST_ROUNDS {
        let Some([conflicts, crossed]) = crossings(surface, &outline) else { break };
        let nodes = &outline.nodes;
        let mut detours: FxHashMap<[u32; 2], Vec<u32>> = FxHashMap::default();
        let pairs = conflicts.iter().flat_map(|a| crossed.iter().map(move |b| [*a, *b]));
        for pair in pairs.filter(|[a, b]| do_meet(nodes, *a, *b)) {
            let found = nearest_corner(nodes, pair).filter(|(corner, chord, off)| {
                let is_near = *off <= HIGHEST * surface.tolerance(nodes[*corner].uv);
                is_near && corners.contains(corner) && chords.contains(chord)
            });
            if let Some((corner, chord, _)) = found {
                detours.entry(chord).or_default().push(corner);
            }
        }
        if detours.is_empty() {
            break;
        }
        let led = |&chord: &[u32; 2]| match detours.get(&edge_key(chord[0], chord[1])) {
            Some(over) => led_over(nodes, chord, over),
            None => vec![chord],
        };
        outline.segments = outline.segments.iter().flat_map(led).collect();
        for (chord, over) in &detours {
            chords.extend(led_over(nodes, *chord, over).into_iter().map(|[a, b]| edge_key(a, b)));
        }
    }
    outline
}

/// Whether two chords without a common end cross or touch in the parameter plane.
fn do_meet(nodes: &Nodes, a: [u32; 2], b: [u32; 2]) -> bool {
    let side = |[p, q]: [Uv; 2], x: Uv| (q - p).perp_dot(x - p);
    let (p, q) = (a.map(|n| nodes[n].uv), b.map(|n| nodes[n].uv));
    let is_between = |chord: [Uv; 2], ends: [Uv; 2]| side(chord, ends[0]) * side(chord, ends[1]) <= 0.0;
    !a.iter().any(|n| b.contains(n)) && is_between(p, q) && is_between(q, p)
}

/// Returns, of the four ends of two chords, the one nearest to the other chord, with that chord by its nodes in ascending order and how far
/// it is from it, mm. `None` where it is nearest to an end.
fn nearest_corner(nodes: &Nodes, [a, b]: [[u32; 2]; 2]) -> Option<(u32, [u32; 2], f64)> {
    let off = |corner: u32, chord: [u32; 2]| {
        (
            corner,
            edge_key(chord[0], chord[1]),
            distance_to_chord(nodes[corner].place, &chord.map(|n| nodes[n].place)),
        )
    };
    let all = [off(a[0], b), off(a[1], b), off(b[0], a), off(b[1], a)];
    let nearest = all.into_iter().min_by(|x, y| x.2.total_cmp(&y.2))?;
    let share = share_along(nodes, nearest.1, nearest.0);
    (0.0 < share && share < 1.0).then_some(nearest)
}

/// Returns the pieces of a chord that is led over some corners, in the order in which they stand along it.
fn led_over(nodes: &Nodes, chord: [u32; 2], over: &[u32]) -> Vec<[u32; 2]> {
    let mut over: Vec<(f64, u32)> = over.iter().map(|&n| (share_along(nodes, chord, n), n)).collect();
    over.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
    over.dedup_by_key(|(_, n)| *n);
    let way: Vec<u32> = [chord[0]].into_iter().chain(over.into_iter().map(|(_, n)| n)).chain([chord[1]]).collect();
    way.windows(2).map(|piece| [piece[0], piece[1]]).collect()
}

/// Returns where along a chord a corner stands in space: 0 at its start, 1 at its end.
fn share_along(nodes: &Nodes, [a, b]: [u32; 2], corner: u32) -> f64 {
    let along = nodes[b].place - nodes[a].place;
    (nodes[corner].place - nodes[a].place).dot(along) / along.length_squared()
}

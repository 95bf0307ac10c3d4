//! Joins pairs of triangles to quads: a facet is two triangles anyway, so the pairs cost nothing and halve the count.

use super::creases::runs_along_crease;
use super::matching::{Candidate, TriangleCandidates, augment};
use super::triangulate::Transition;
use crate::math::Uv;
use crate::tessellate::face_surface::FaceSurface;
use crate::tessellate::nodes::{Node, Nodes, Position, ProvedFacet, edge_key};
use crate::tessellate::proof::pole;
use crate::tessellate::proof::prover::Prover;
use rustc_hash::{FxHashMap, FxHashSet};

/// A facet of the transition; a triangle repeats its third corner.
#[derive(Clone, Copy)]
pub(in crate::tessellate) struct TransitionFacet {
    pub(in crate::tessellate) facet: ProvedFacet<4>,
    /// Other parameters for a corner: a pole, seen in the middle of its facet.
    pub(in crate::tessellate) pole: Option<(usize, Uv)>,
}

impl From<ProvedFacet<4>> for TransitionFacet {
    fn from(facet: ProvedFacet<4>) -> Self {
        Self { facet, pole: None }
    }
}

impl TransitionFacet {
    /// Returns its sides, which of a triangle are one of no length too.
    pub(in crate::tessellate) fn sides(&self) -> [[u32; 2]; 4] {
        let nodes = self.facet.nodes;
        [0, 1, 2, 3].map(|k| [nodes[k], nodes[(k + 1) % 4]])
    }

    /// Lets the facet run the other way round, from the same first corner.
    pub(in crate::tessellate) fn turn_over(&mut self) {
        let [a, b, c, d] = self.facet.nodes;
        let last = if c == d { 2 } else { 3 };
        self.facet.nodes = if c == d { [a, c, b, b] } else { [a, d, c, b] };
        if let Some((at, _)) = &mut self.pole
            && *at > 0
        {
            *at = last + 1 - *at;
        }
    }
}

/// Cosine of the sharpest and bluntest corner that a quad may have: 1.8°.
const SHARPEST: f64 = 0.9995;
/// Cosine below which a quad is made before any triangle's lack of mates is looked at: corners from 60° to 120°.
const GOOD: f64 = 0.5;
/// Least cosine between the two triangles of a quad.
const FLATTEST: f64 = 0.5;

impl Candidate {
    /// Rank in which candidates are taken: triangles without area first, then the squarest.
    fn rank(&self) -> f64 {
        self.cosine.map_or(-1.0, |cosine| cosine)
    }
}

/// Joins triangles in pairs to quads, squarest first; the rest stay triangles. No quad lies across a `fixed` edge or a sharp crease;
/// triangles without area go into a neighbour or, without one, are dropped.
pub(in crate::tessellate) fn pair_triangles(
    transition: &Transition,
    fixed: &FxHashSet<[u32; 2]>,
    prover: &mut Prover<'_, '_>,
) -> Vec<TransitionFacet> {
    let (nodes, t) = (&transition.nodes, &transition.triangles);
    let node = |n: u32| nodes[n];
    let collapsed: Vec<bool> = t.iter().map(|t| is_collapsed(t.nodes.map(node))).collect();
    let candidates = candidates(transition, fixed, &collapsed, prover.surface);
    // First without: what pairs a triangle may lose again in `augment`.
    let mut taken = vec![false; t.len()];
    let mut facets = Vec::new();
    let chosen = choose_pairs(&candidates, &mut taken);
    for c in augment(&candidates, t.len(), &chosen) {
        let Candidate { cosine, triangles: [i, j], corners } = candidates[c];
        (taken[i], taken[j]) = (true, true);
        // A quad is traced as its two triangles: what is proved of both holds for it.
        let bound = t[i].bound.max(t[j].bound);
        let tolerance = t[i].tolerance.min(t[j].tolerance);
        if cosine.is_some() {
            let pole = pole::facet_parameters(prover.surface, &corners.map(|n| node(n).uv));
            facets.push(TransitionFacet { facet: ProvedFacet { nodes: corners, bound, tolerance }, pole });
            continue;
        }
        // One with area takes in the one without; both have two corners in one place otherwise.
        let (full, empty) = if collapsed[i] { (t[j].nodes, t[i].nodes) } else { (t[i].nodes, t[j].nodes) };
        // The collapsed triangle's piece of the surface is not empty: the facet must cover it too.
        let (uv, xyz) = (empty.map(|n| node(n).uv), full.map(|n| node(n).place));
        let whole = pole::covers_to_meridians(prover.surface, full.map(|n| node(n).uv));
        let bound = if whole { bound } else { bound.max(prover.triangle_bound(uv, xyz, tolerance)) };
        facets.push(facet_at_pole(nodes, prover, ProvedFacet { nodes: full, bound, tolerance }, corners));
    }
    for (i, tri) in t.iter().enumerate() {
        if !taken[i] && !collapsed[i] {
            facets.push(single_triangle(nodes, prover.surface, *tri));
        }
    }
    join_sectors(nodes, fixed, prover, facets)
}

/// Lists all pairs of triangles that may be joined, triangles without area first, then the squarest quads. `collapsed` says by triangle
/// whether it has no area.
fn candidates(
    transition: &Transition,
    fixed: &FxHashSet<[u32; 2]>,
    collapsed: &[bool],
    surface: &FaceSurface<'_>,
) -> Vec<Candidate> {
    let t = &transition.triangles;
    let node = |n: u32| transition.nodes[n];
    // The first triangle that has an edge, and which of its sides that is.
    let mut sides: FxHashMap<[u32; 2], (usize, usize)> = FxHashMap::default();
    let mut out: Vec<Candidate> = Vec::new();
    for (i, tri) in t.iter().enumerate() {
        for k in 0..3 {
            let (c, a) = (tri.nodes[k], tri.nodes[(k + 1) % 3]);
            // A side is met twice, once from either triangle: the second time makes the candidate.
            let name = edge_key(a, c);
            if fixed.contains(&name) || runs_along_crease(surface, node(a).uv, node(c).uv) {
                continue;
            }
            let Some(&(j, m)) = sides.get(&name) else {
                sides.insert(name, (i, k));
                continue;
            };
            // This triangle is (a, b, c) and the other holds the edge a–c.
            let corners = [a, tri.nodes[(k + 2) % 3], c, t[j].nodes[(m + 2) % 3]];
            if collapsed[i] || collapsed[j] {
                if collapsed[i] != collapsed[j] && node(a).position != node(c).position {
                    out.push(Candidate { cosine: None, triangles: [i, j], corners });
                }
            } else if both_hold(&t[i], &t[j])
                && let Some(cosine) = sharpest_corner(corners.map(node))
            {
                out.push(Candidate { cosine: Some(cosine), triangles: [i, j], corners });
            }
        }
    }
    // By number among equals, so that the same mesh comes of the same file.
    out.sort_by(|x, y| x.rank().total_cmp(&y.rank()).then(x.triangles.cmp(&y.triangles)));
    out
}

/// Whether a facet is a triangle with a pole as its third corner.
fn is_sector(f: &TransitionFacet) -> bool {
    f.pole.is_some() && f.facet.nodes[2] == f.facet.nodes[3]
}

/// Two sectors that become one quad.
#[derive(Clone, Copy)]
struct Join {
    /// The other facet, and the parameters of the pole between both.
    second: usize,
    pole: Uv,
    /// Bound with the other parameters of the pole, mm; that of the quad is at least this.
    bound: f64,
}

/// Joins triangles that meet at a pole, two and two, along a side that is not `fixed`: what is left of a sector there is a triangle, but
/// two of them are a convex quad with the meridian between them as its diagonal.
fn join_sectors(
    nodes: &Nodes,
    fixed: &FxHashSet<[u32; 2]>,
    prover: &mut Prover<'_, '_>,
    facets: Vec<TransitionFacet>,
) -> Vec<TransitionFacet> {
    // At a pole several nodes are one place.
    let fixed: FxHashSet<[Position; 2]> = fixed.iter().map(|&[a, b]| side_key(nodes, a, b)).collect();
    // A sector is (a, b, pole): the next one around starts at b.
    let sectors = facets.iter().enumerate().filter(|(_, f)| is_sector(f));
    let starts: FxHashMap<u32, usize> = sectors.map(|(i, f)| (f.facet.nodes[0], i)).collect();
    let next = |f: &TransitionFacet| {
        let [_, b, pole, _] = f.facet.nodes;
        let j = *starts.get(&b).filter(|_| !fixed.contains(&side_key(nodes, b, pole)))?;
        (nodes[facets[j].facet.nodes[2]].position == nodes[f.facet.nodes[2]].position).then_some(j)
    };
    let follows: Vec<Option<usize>> = facets.iter().map(|f| if is_sector(f) { next(f) } else { None }).collect();
    let mut has_previous = vec![false; facets.len()];
    follows.iter().flatten().for_each(|&j| has_previous[j] = true);
    // Rows of sectors that end are gone along from their start, those all around a pole from anywhere.
    let heads =
        (0..facets.len()).filter(|&i| !has_previous[i]).chain((0..facets.len()).filter(|&i| has_previous[i]));
    let mut joins: Vec<Option<Join>> = vec![None; facets.len()];
    let mut joined = vec![false; facets.len()];
    // Sectors all around a pole follow each other for ever.
    let mut seen = vec![false; facets.len()];
    // Two by two from the head on, so that rows of even length leave none over.
    for head in heads {
        let mut at = Some(head);
        while let Some(i) = at {
            if joined[i] || joins[i].is_some() || std::mem::replace(&mut seen[i], true) {
                break;
            }
            at = follows[i];
            let Some(j) = follows[i].filter(|&j| j != i && !joined[j] && joins[j].is_none()) else { continue };
            if let Some((pole, bound)) = prove_sector_quad(nodes, prover, &facets[i], &facets[j]) {
                joins[i] = Some(Join { second: j, pole, bound });
                joined[j] = true;
                at = follows[j];
            }
        }
    }
    let kept = facets.iter().enumerate().filter(|(i, _)| !joined[*i]);
    kept.map(|(i, f)| match joins[i] {
        None => *f,
        Some(Join { second, pole, bound }) => {
            let (f, g) = (&f.facet, &facets[second].facet);
            let facet = ProvedFacet {
                nodes: sector_quad(f, g),
                bound: f.bound.max(g.bound).max(bound),
                tolerance: f.tolerance.min(g.tolerance),
            };
            TransitionFacet { facet, pole: Some((2, pole)) }
        }
    })
    .collect()
}

/// Returns the key of a side by the positions of its ends, whichever way it runs.
fn side_key(nodes: &Nodes, a: u32, b: u32) -> [Position; 2] {
    let (a, b) = (nodes[a].position, nodes[b].position);
    [a.min(b), a.max(b)]
}

/// Returns the nodes of the quad of two neighbouring sectors, `f` before `g` around the pole, which is the third.
fn sector_quad(f: &ProvedFacet<4>, g: &ProvedFacet<4>) -> [u32; 4] {
    [f.nodes[1], g.nodes[1], f.nodes[2], f.nodes[0]]
}

/// Proves the quad of two sectors at one pole, `g` behind `f` around it. Returns the pole's parameters in it and a bound, mm: that of the
/// quad is the largest of this and their own, 0 where theirs are enough. `None` where the quad is not convex, folds, has too sharp a
/// corner or is not proved, or where their own bounds are beyond the tighter of their tolerances. Changes the prover's state alone.
fn prove_sector_quad(
    nodes: &Nodes,
    prover: &mut Prover<'_, '_>,
    f: &TransitionFacet,
    g: &TransitionFacet,
) -> Option<(Uv, f64)> {
    let tolerance = f.facet.tolerance.min(g.facet.tolerance);
    let ((_, x), (_, y)) = f.pole.zip(g.pole).filter(|_| f.facet.bound.max(g.facet.bound) <= tolerance)?;
    let corners = sector_quad(&f.facet, &g.facet).map(|n| nodes[n]);
    sharpest_corner(corners)?;
    // Both sectors hold the line between them; other poles have to be looked at anew.
    if let Some((2, pole)) = pole::facet_parameters(prover.surface, &corners.map(|n| n.uv)) {
        return Some((pole, 0.0));
    }
    let pole = 0.5 * (x + y);
    let first = bound_with_pole(nodes, prover, f.facet.nodes, pole, tolerance);
    let second = bound_with_pole(nodes, prover, g.facet.nodes, pole, tolerance);
    Some((pole, first?.max(second?)))
}

/// Returns the indices of pairs to make from `candidates`, which stand in order of squareness: good quads first, then those of triangles
/// that have but one mate left, then the rest. Skips triangles that are flagged in `taken`, and flags those it pairs.
fn choose_pairs(candidates: &[Candidate], taken: &mut [bool]) -> Vec<usize> {
    let mut chosen = Vec::new();
    let by_triangle = TriangleCandidates::new(candidates, taken.len(), |_| true);
    for (c, candidate) in candidates.iter().enumerate() {
        let [i, j] = candidate.triangles;
        if candidate.rank() < GOOD && !taken[i] && !taken[j] {
            (taken[i], taken[j]) = (true, true);
            // Good quads first in any case: to save a lonely triangle is not worth a bad one there.
            chosen.push(c);
        }
    }
    let is_free = |c: usize, taken: &[bool]| candidates[c].triangles.iter().all(|&t| !taken[t]);
    let only_mate = |t: usize, taken: &[bool]| {
        let mut open = by_triangle.of_triangle(t).filter(|&c| is_free(c, taken));
        open.next().filter(|_| open.next().is_none())
    };
    let mut lonely: Vec<usize> = (0..taken.len()).rev().collect();
    let mut rest = 0..candidates.len();
    loop {
        // Triangles that may have one mate left come first; where there is none, the next best pair.
        let c = match lonely.pop() {
            Some(t) if taken[t] => continue,
            Some(t) => match only_mate(t, taken) {
                Some(c) => c,
                None => continue,
            },
            None => match rest.find(|&c| is_free(c, taken)) {
                Some(c) => c,
                None => return chosen,
            },
        };
        let pair = candidates[c].triangles;
        pair.iter().for_each(|&t| taken[t] = true);
        chosen.push(c);
        // Neighbours of a pair just made may have lost all mates but one.
        for c in pair.iter().flat_map(|&t| by_triangle.of_triangle(t)) {
            lonely.extend(candidates[c].triangles.into_iter().filter(|&x| !taken[x]));
        }
    }
}

/// Whether two corners of a triangle share a position.
fn is_collapsed(n: [Node; 3]) -> bool {
    n[0].position == n[1].position || n[1].position == n[2].position || n[2].position == n[0].position
}

/// Makes a facet of the triangle `full`, which has taken in a neighbour without area. Where `quad` has a second node at one of its corners,
/// the pole, that comes third and gets parameters midway between both, if that is proved within tolerance: the bound, mm, may rise.
/// Otherwise, and for a sector, what [`single_triangle`] makes of it.
fn facet_at_pole(
    nodes: &Nodes,
    prover: &mut Prover<'_, '_>,
    full: ProvedFacet<3>,
    quad: [u32; 4],
) -> TransitionFacet {
    let t = full.nodes;
    let position = |n: u32| nodes[n].position;
    let twin = quad.iter().copied().find_map(|n| {
        let k = t.iter().position(|&f| f != n && position(f) == position(n) && !t.contains(&n))?;
        Some((k, n))
    });
    // Without the other node of the pole there is no middle to see it from, and a sector is proved as it is.
    let Some((k, n)) = twin.filter(|_| !pole::is_sector(prover.surface, t.map(|n| nodes[n].uv))) else {
        return single_triangle(nodes, prover.surface, full);
    };
    let corners = [t[(k + 1) % 3], t[(k + 2) % 3], t[k], t[k]];
    let middle = 0.5 * (nodes[t[k]].uv + nodes[n].uv);
    match bound_with_pole(nodes, prover, corners, middle, full.tolerance) {
        Some(bound) => TransitionFacet {
            facet: ProvedFacet { nodes: corners, bound: full.bound.max(bound), tolerance: full.tolerance },
            pole: Some((2, middle)),
        },
        None => single_triangle(nodes, prover.surface, full),
    }
}

/// Makes a facet of a triangle alone; if it is a sector, it is turned so that the pole is its third corner.
fn single_triangle(nodes: &Nodes, surface: &FaceSurface<'_>, full: ProvedFacet<3>) -> TransitionFacet {
    let t = full.nodes;
    let uv = t.map(|n| nodes[n].uv);
    let pole = pole::facet_parameters(surface, &uv).filter(|_| pole::is_sector(surface, uv));
    let k = pole.map_or(2, |(k, _)| k);
    let corners = [t[(k + 1) % 3], t[(k + 2) % 3], t[k], t[k]];
    let facet = ProvedFacet { nodes: corners, bound: full.bound, tolerance: full.tolerance };
    TransitionFacet { facet, pole: pole.map(|(_, uv)| (2, uv)) }
}

/// Returns a bound, mm, of the triangle a, b, c with other parameters `pole` of its third corner, those of the facet that is handed on,
/// whose piece of the surface may lie outside the one that was proved; `None` where it exceeds the tolerance.
fn bound_with_pole(
    nodes: &Nodes,
    prover: &mut Prover<'_, '_>,
    [a, b, c, _]: [u32; 4],
    pole: Uv,
    tolerance: f64,
) -> Option<f64> {
    let n = [a, b, c].map(|n| nodes[n]);
    let (uv, xyz) = ([n[0].uv, n[1].uv, pole], n.map(|n| n.place));
    let mut worst = prover.triangle_bound(uv, xyz, tolerance);
    for i in 0..2 {
        worst = worst.max(prover.side_bound([uv[i], pole], [xyz[i], xyz[2]], tolerance));
    }
    (worst <= tolerance).then_some(worst)
}

/// Whether two triangles may share the tighter of their tolerances: both bounds are within it, or one of them does not hold anyway.
fn both_hold(a: &ProvedFacet<3>, b: &ProvedFacet<3>) -> bool {
    a.bound.max(b.bound) <= a.tolerance.min(b.tolerance) || a.bound > a.tolerance || b.bound > b.tolerance
}

/// Returns the largest absolute cosine of a corner of a quad; `None` when it is not convex, folds along its diagonal, or has a corner
/// beyond [`SHARPEST`].
fn sharpest_corner(n: [Node; 4]) -> Option<f64> {
    let p = n.map(|x| x.place);
    let (n1, n2) = ((p[1] - p[0]).cross(p[2] - p[0]), (p[2] - p[0]).cross(p[3] - p[0]));
    let (l1, l2) = (n1.length(), n2.length());
    if !(l1 > 0.0 && l2 > 0.0) || n1.dot(n2) < FLATTEST * l1 * l2 {
        return None;
    }
    let up = n1 + n2;
    let mut worst = 0f64;
    for i in 0..4 {
        let (x, y) = (p[(i + 1) % 4] - p[i], p[(i + 3) % 4] - p[i]);
        if x.cross(y).dot(up) <= 0.0 {
            return None;
        }
        worst = worst.max((x.dot(y) / (x.length() * y.length())).abs());
    }
    (worst < SHARPEST).then_some(worst)
}

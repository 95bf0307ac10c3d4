//! Opposite sides of a face get the same samples, so that the rows of cells between them end in corners on both.
//!
//! Two edges are opposite when both run along parameter lines of one direction, from the same parameter to the same
//! parameter. The one with more samples hands its own on, from face to face, as long as the next has at least half
//! as many: a transition between unequal sides has as many facets as the longer one anyway.

use super::curve_chords::breaks;
use super::edge_chords::{EdgeSide, divide_further};
use crate::model::{EdgeUse, Face, Part};
use crate::tessellate::face_surface::FaceSurface;
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

/// Uses of a face beyond which no opposite ones are looked for: pairs grow with the square.
const MAX_USES: usize = 400;
/// Share by which a side may grow beyond the samples handed to it before it keeps its own.
const GROWTH: f64 = 1.2;
/// Share of the domain within which sides start and end at the same parameter: ten times what [`LEVEL`] lets one wander.
const SAME_RANGE: f64 = 1e-6;
/// Share of the domain within which a side keeps to a parameter line.
const LEVEL: f64 = 1e-7;
/// Share of the edge's domain by which samples must ascend, and within which they are the same.
const SAME_SAMPLE: f64 = 1e-9;
/// Halvings that invert a uv curve: down to the spacing of numbers.
const INVERSION_HALVINGS: usize = 60;
/// Steps in which a side's shape is looked at.
const STEPS: u32 = 8;

/// A use of an edge that runs along a parameter line of the face.
struct ParameterRun<'f> {
    edge: usize,
    edge_use: &'f EdgeUse,
    /// The parameter that changes: 0 for u, 1 for v.
    direction: usize,
    /// From where to where, ascending, in shares of the domain.
    range: [f64; 2],
    /// The other parameter, in shares of the domain.
    level: f64,
}

/// Two uses that face each other, each with the index of its edge.
type Pair<'f> = [(usize, &'f EdgeUse); 2];

/// Makes the samples of opposite edges equal, in `times`: the ascending parameters at which each edge of the part is divided. Edges beyond
/// its length, and planes, are passed over. `denser` and `sides` are by edge, as for `edges::divide`.
pub(in crate::tessellate) fn equalise<'f>(
    part: &Part,
    faces: &[(&'f Face, &FaceSurface<'_>)],
    sides: &[Vec<EdgeSide<'_, '_>>],
    denser: &[u32],
    times: &mut [Vec<f64>],
) {
    // On a plane there are no rows of cells to line up.
    let bent: Vec<&(&Face, &FaceSurface<'_>)> = faces.iter().filter(|(_, s)| !s.affine).collect();
    let of_face = |&&(face, surface): &&(&'f Face, &FaceSurface<'_>)| pairs_of(face, surface, times.len());
    let each: Vec<Vec<(Pair<'_>, usize)>> = bent.par_iter().with_min_len(8).map(of_face).collect();
    let pairs: Vec<(Pair<'_>, usize)> = each.into_iter().flatten().collect();
    let mut of_edge: FxHashMap<usize, Vec<usize>> = FxHashMap::default();
    for (k, ([a, b], _)) in pairs.iter().enumerate() {
        of_edge.entry(a.0).or_default().push(k);
        of_edge.entry(b.0).or_default().push(k);
    }
    let equaliser = Equaliser { part, sides, denser, pairs: &pairs, of_edge: &of_edge, times };
    // Nothing is handed on from one group to another: done one after the other, they took a tenth of the time of four threads.
    let groups = equaliser.groups();
    let found: Vec<Vec<(usize, Vec<f64>)>> =
        groups.par_iter().map(|group| equaliser.equalise_group(group)).collect();
    for (edge, kept) in found.into_iter().flatten() {
        times[edge] = kept;
    }
}

/// The edges of a part with their samples and the pairs of opposite ones.
struct Equaliser<'w, 'f, 's, 'a> {
    part: &'w Part,
    sides: &'w [Vec<EdgeSide<'s, 'a>>],
    denser: &'w [u32],
    /// With the direction in which both run: 0 for u, 1 for v.
    pairs: &'w [(Pair<'f>, usize)],
    /// The pairs of each edge that has one.
    of_edge: &'w FxHashMap<usize, Vec<usize>>,
    times: &'w [Vec<f64>],
}

impl Equaliser<'_, '_, '_, '_> {
    /// Returns the groups of edges that pairs connect, each edge in one group; edges without a pair are in none.
    fn groups(&self) -> Vec<Vec<usize>> {
        let mut seen = vec![false; self.times.len()];
        let mut groups = Vec::new();
        for first in self.pairs.iter().map(|(p, _)| p[0].0) {
            if seen[first] {
                continue;
            }
            seen[first] = true;
            let (mut group, mut next) = (vec![first], 0);
            while next < group.len() {
                for &k in &self.of_edge[&group[next]] {
                    for (e, _) in self.pairs[k].0 {
                        if !seen[e] {
                            seen[e] = true;
                            group.push(e);
                        }
                    }
                }
                next += 1;
            }
            groups.push(group);
        }
        groups
    }

    /// Returns the edges of a group that take over samples, each once, with all of their new parameters; empty where none does.
    fn equalise_group(&self, group: &[usize]) -> Vec<(usize, Vec<f64>)> {
        // From the densest, so that samples are only ever handed to sides that would have had fewer.
        let mut order = group.to_vec();
        order.sort_by_key(|&e| (std::cmp::Reverse(self.times[e].len()), e));
        let mut now: FxHashMap<usize, Vec<f64>> = FxHashMap::default();
        let mut done: FxHashSet<usize> = FxHashSet::default();
        let mut out = Vec::new();
        for first in order {
            if !done.insert(first) {
                continue;
            }
            // From side to opposite side, as long as the next has at least half as many.
            let most = self.times[first].len();
            let mut queue = vec![first];
            while let Some(e) = queue.pop() {
                for &k in &self.of_edge[&e] {
                    let ([a, b], direction) = &self.pairs[k];
                    let (from, to) = if a.0 == e { (a, b) } else { (b, a) };
                    let (curve, own) = (&self.part.edges[to.0].curve, &self.times[to.0]);
                    // Sides that already took samples keep them; those far coarser would grow by what they have no
                    // need for; kinks are corners of their own.
                    if done.contains(&to.0) || 2 * own.len() < most || breaks(curve).len() > 2 {
                        continue;
                    }
                    let domain = curve.domain();
                    let handed =
                        transfer_samples(now.get(&e).unwrap_or(&self.times[e]), from.1, to.1, *direction, domain);
                    let Some(handed) = handed else { continue };
                    // What it has already holds already.
                    let kept = if are_same(&handed, own, domain) {
                        handed
                    } else {
                        let kept = divide_further(curve, &self.sides[to.0], self.denser[to.0], handed.clone());
                        // Where the samples handed over do not suffice by far the shapes are too unlike to share
                        // them.
                        if kept.len() as f64 > GROWTH * handed.len() as f64 {
                            continue;
                        }
                        kept
                    };
                    out.push((to.0, kept.clone()));
                    now.insert(to.0, kept);
                    done.insert(to.0);
                    queue.push(to.0);
                }
            }
        }
        out
    }
}

/// Whether samples are as many and the same within [`SAME_SAMPLE`] of the edge's domain.
fn are_same(a: &[f64], b: &[f64], [t0, t1]: [f64; 2]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() <= SAME_SAMPLE * (t1 - t0))
}

/// Returns the pairs of opposite uses of a face whose edges are among the first `edges` of the part, with the direction in which both run
/// (0 for u, 1 for v). None for a face of more than [`MAX_USES`] uses.
fn pairs_of<'f>(face: &'f Face, surface: &FaceSurface<'_>, edges: usize) -> Vec<(Pair<'f>, usize)> {
    let mut pairs = Vec::new();
    let uses: Vec<&EdgeUse> = face.loops.iter().flat_map(|l| &l.uses).collect();
    if uses.len() > MAX_USES {
        return pairs;
    }
    let runs: Vec<ParameterRun<'_>> =
        uses.iter().filter_map(|u| parameter_run(u, surface)).filter(|a| a.edge < edges).collect();
    for (i, a) in runs.iter().enumerate() {
        for b in &runs[i + 1..] {
            // Ranges must agree at both ends, or rows of cells would run out at the side.
            let near = |x: f64, y: f64| (x - y).abs() <= SAME_RANGE;
            let same = a.direction == b.direction && near(a.range[0], b.range[0]) && near(a.range[1], b.range[1]);
            if same && a.edge != b.edge && !near(a.level, b.level) {
                pairs.push(([(a.edge, a.edge_use), (b.edge, b.edge_use)], a.direction));
            }
        }
    }
    pairs
}

/// Describes a use that runs along a parameter line without turning back; `None` for any other, and for one without an edge.
fn parameter_run<'f>(edge_use: &'f EdgeUse, surface: &FaceSurface<'_>) -> Option<ParameterRun<'f>> {
    let edge = edge_use.edge?.0 as usize;
    let [t0, t1] = edge_use.uv.domain();
    let domain = surface.spline.domain();
    let at = |i: u32| {
        let uv = edge_use.uv.evaluate(t0 + (t1 - t0) * f64::from(i) / f64::from(STEPS));
        [0, 1].map(|d| (uv[d] - domain[d][0]) / (domain[d][1] - domain[d][0]))
    };
    // Most uses that do not run along a line show it at both ends: two evaluations turn them away before nine are made.
    let (from, to) = (at(0), at(STEPS));
    if (0..2).all(|d| (from[d] - to[d]).abs() > LEVEL) {
        return None;
    }
    let shape: Vec<[f64; 2]> = (0..=STEPS).map(at).collect();
    (0..2).find_map(|d| {
        let flat = shape.iter().all(|p| (p[1 - d] - shape[0][1 - d]).abs() <= LEVEL);
        let up = to[d] > from[d];
        let steady = shape.windows(2).all(|w| (w[1][d] > w[0][d]) == up && w[1][d] != w[0][d]);
        let (a, b) = (from[d], to[d]);
        (flat && steady).then(|| ParameterRun {
            edge,
            edge_use,
            direction: d,
            range: [a.min(b), a.max(b)],
            level: shape[0][1 - d],
        })
    })
}

/// Returns the parameters of `to`, ascending over `[t0, t1]`, where it has the same surface parameter `d` (0 for u, 1 for v) as `from` at
/// `times`; `None` when two of them coincide.
fn transfer_samples(times: &[f64], from: &EdgeUse, to: &EdgeUse, d: usize, [t0, t1]: [f64; 2]) -> Option<Vec<f64>> {
    let x = |t: f64| to.uv.evaluate(t)[d];
    let up = x(t1) > x(t0);
    // Most sides are straight lines of the parameter plane, run evenly.
    let even = to.uv.degree == 1 && to.uv.points.len() == 2 && to.uv.points[0].z == to.uv.points[1].z;
    let [s0, s1] = to.uv.domain();
    let invert = |goal: f64| {
        if even {
            return (s0 + (s1 - s0) * (goal - x(s0)) / (x(s1) - x(s0))).clamp(t0, t1);
        }
        let (mut lo, mut hi) = (t0, t1);
        for _ in 0..INVERSION_HALVINGS {
            let m = 0.5 * (lo + hi);
            if (x(m) < goal) == up { lo = m } else { hi = m }
        }
        0.5 * (lo + hi)
    };
    // Ends stay to the bit: they are vertices, which are not the edge's own to move.
    let mut out: Vec<f64> = times[1..times.len() - 1].iter().map(|&t| invert(from.uv.evaluate(t)[d])).collect();
    out.sort_by(f64::total_cmp);
    out.insert(0, t0);
    out.push(t1);
    let least = SAME_SAMPLE * (t1 - t0);
    // Samples that coincide or turn back show that the uv curve does not run one way.
    out.windows(2).all(|w| w[1] - w[0] > least).then_some(out)
}

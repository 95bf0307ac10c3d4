//! From chains to the boundary of a region without periods: chains that wind around the surface are joined by seams,
//! lone ones run to a pole or a natural border, closed surfaces get their outer boundary, holes move inside it.

use super::fit::Budget;
use super::holes::{Border, free_start, place_hole};
use super::lobes::{cancelling_lobes, loops_with_extent};
use super::loops::{Chain, Piece, Source};
use super::obstacles::{Obstacles, unrolled_polygon};
use super::tolerances::{SEAM_LENGTH_WEIGHT, STRAIGHT_SEAM_SHARE};
use super::way_search::{Goals, SeamPath};
use crate::math::Uv;
use crate::math::polygon::signed_area;
use crate::nurbs::UvCurve;
use crate::step::chart::Chart;
use rustc_hash::FxHashSet;

/// Most pairs of ends that a straight seam is tried between: each costs a look at all obstacles.
const MOST_PAIRS: usize = 4096;
/// Counterparts of a start that are kept at least, the best ones: rims of thousands of edges have millions of pairs.
const LEAST_PAIRS_OF_START: usize = 16;

/// The boundary of a face in the plane of its chart.
pub(crate) struct Boundary {
    /// Closed loops, material on the left.
    pub(crate) loops: Vec<Chain>,
    /// Straight seams in the parameter plane, by their number in [`Source::Seam`].
    pub(crate) seams: Vec<[Uv; 2]>,
    /// Repairs that were necessary.
    pub(crate) repairs: Vec<&'static str>,
}

/// What seams are laid through.
struct SeamDomain<'c> {
    chart: &'c Chart,
    /// The holes that seams miss, in parameters.
    holes: Vec<Vec<Uv>>,
    /// What the search for a way past them takes its work from.
    budget: &'c Budget,
}

/// Arranges the chains of a face, given with the material on their left, to closed loops; without chains the face is the whole surface.
/// Fails where chains bound nothing, and where the budget is used up. `implicit_outer`: the surface's own border is the outer loop.
pub(crate) fn bound_region(
    mut chains: Vec<Chain>,
    chart: &Chart,
    implicit_outer: bool,
    budget: &Budget,
) -> Result<Boundary, &'static str> {
    chains.retain(|c| !c.pieces.is_empty());
    let mut out = Boundary { loops: Vec::new(), seams: Vec::new(), repairs: Vec::new() };
    if chains.iter().any(|c| c.is_edge_turned) {
        out.repairs.push("a loop wound around the surface twice: one of its two rims was turned around");
    }
    // In the unwrapped plane a loop around a closed surface ends whole periods from its start: alone it bounds no region.
    let (winding, plain): (Vec<Chain>, Vec<Chain>) = chains.into_iter().partition(Chain::is_winding);
    // A seam that the file runs forth and back bounds nothing by intent, other edges do not.
    let has_edges = plain.iter().any(|c| !c.is_cut_open());
    let is_given = !plain.is_empty();
    // Loops without extent: a vertex, or an edge run forth and back.
    let (plain, polygons) = loops_with_extent(plain, chart);
    // Nothing winds around: without any loop the face is the whole surface, else the loops bound it by themselves.
    if winding.is_empty() {
        if plain.is_empty() {
            if has_edges {
                out.repairs.push("its loops enclose nothing: the whole of its surface is taken");
            }
            let whole = natural_boundary(chart, &[], &mut out.seams);
            out.loops.push(whole.map_err(|reason| if is_given { "its loops enclose nothing" } else { reason })?);
            return Ok(out);
        }
        return bound_without_winding(plain, &polygons, chart, &mut out, implicit_outer).map(|()| out);
    }
    let domain = SeamDomain { chart, holes: polygons, budget };
    let mut outer = match winding.len() {
        1 => extend_to_border(winding.into_iter().next().ok_or("no loop")?, &domain, &mut out.seams, true)?,
        2 => {
            let mut two = winding.into_iter();
            let (Some(a), Some(mut b)) = (two.next(), two.next()) else { return Err("no loop") };
            // One must run each way, or the material would lie on the same side of both. On a surface closed both ways the first
            // one decides which side is meant.
            if a.winding == b.winding {
                b.reverse();
                out.repairs
                    .push("two loops wind around the surface in the same sense: the second was turned around");
            } else if a.winding != b.winding.map(|w| -w) {
                return Err("two loops wind around the surface in different directions");
            }
            join_winding_pair(a, b, &domain, &mut out.seams)?
        }
        _ => return Err("more than two loops wind around the surface"),
    };
    // Material lies on the left, so an outer loop runs counter-clockwise.
    if signed_area(&outer.polygon()) < 0.0 {
        outer.reverse();
        out.repairs.push("the loops ran against the face's orientation");
    }
    add_with_holes(outer, plain, chart, &mut out);
    Ok(out)
}

/// Adds to `out` an outer loop and its holes, moved into it.
fn add_with_holes(outer: Chain, holes: impl IntoIterator<Item = Chain>, chart: &Chart, out: &mut Boundary) {
    let border = Border::new(&outer);
    let holes: Vec<Chain> = holes.into_iter().map(|h| place_hole(h, &border, chart, &mut out.repairs)).collect();
    out.loops.push(outer);
    out.loops.extend(holes);
}

/// Adds loops that wind around nothing, with these polygons, to `out`: the largest is the outer one, except on a closed surface, where
/// loops that all run clockwise leave the rest of the surface as the face, and one that bounds as much either way decides nothing.
fn bound_without_winding(
    mut plain: Vec<Chain>,
    polygons: &[Vec<Uv>],
    chart: &Chart,
    out: &mut Boundary,
    implicit_outer: bool,
) -> Result<(), &'static str> {
    // The sign of an area that cancels is rounding.
    let lobes: Vec<Option<f64>> =
        plain.iter().zip(polygons).map(|(c, polygon)| cancelling_lobes(c, polygon)).collect();
    if !implicit_outer && is_closed(chart) && lobes.iter().any(Option::is_some) {
        return Err("its loop crosses itself");
    }
    let areas: Vec<f64> = plain.iter().zip(lobes).map(|(c, lobes)| lobes.unwrap_or_else(|| c.area())).collect();
    // A loop that runs along an edge twice was cut open by the file: it goes around the face, not around a hole.
    let all_holes = areas.iter().all(|&a| a < 0.0) && !plain.iter().any(Chain::is_cut_open);
    if implicit_outer || all_holes && is_closed(chart) {
        let outer = natural_boundary(chart, polygons, &mut out.seams)?;
        add_with_holes(outer, plain, chart, out);
        return Ok(());
    }
    let largest = (0..areas.len()).max_by(|&a, &b| areas[a].abs().total_cmp(&areas[b].abs())).ok_or("no loop")?;
    let mut outer = plain.remove(largest);
    if areas[largest] < 0.0 {
        outer.reverse();
        out.repairs.push("the outer loop ran against the face's orientation");
    }
    add_with_holes(outer, plain, chart, out);
    Ok(())
}

/// Whether the surface has no border at all: each direction is periodic or ends in poles.
fn is_closed(chart: &Chart) -> bool {
    (0..2).all(|d| {
        chart.period[d].is_some()
            || chart.range[d].iter().all(|x| chart.poles.iter().any(|p| p.fixed == d && p.parameter == *x))
    })
}

/// Returns the border of the whole surface: seams, poles and natural borders, cut where no hole is. Adds the seams to `seams`; fails on an
/// unbounded surface and where holes leave no place.
fn natural_boundary(chart: &Chart, holes: &[Vec<Uv>], seams: &mut Vec<[Uv; 2]>) -> Result<Chain, &'static str> {
    let mut range = [[0.0; 2]; 2];
    for d in 0..2 {
        range[d] = match chart.period[d] {
            // A period begins where the seam cuts no hole.
            Some(period) => {
                let base = if chart.range[d][0].is_finite() { chart.range[d][0] } else { 0.0 };
                let start = free_start(d, base, period, holes).ok_or("holes leave no place for a seam")?;
                [start, start + period]
            }
            None => chart.range[d],
        };
        if !range[d].iter().all(|x| x.is_finite()) {
            return Err("an unbounded surface without a loop");
        }
    }
    let [[u0, u1], [v0, v1]] = range;
    let corner = [Uv::new(u0, v0), Uv::new(u1, v0), Uv::new(u1, v1), Uv::new(u0, v1)];
    let is_pole = |fixed: usize, at: f64| chart.poles.iter().any(|p| p.fixed == fixed && p.parameter == at);
    let mut add = |a: Uv, b: Uv| {
        seams.push([a, b]);
        Source::Seam(seams.len() - 1)
    };
    let mut side = |fixed: usize, at: f64, a: Uv, b: Uv| {
        if is_pole(fixed, at) { Source::Nothing } else { add(a, b) }
    };
    let bottom = side(1, v0, corner[0], corner[1]);
    let right = side(0, u1, corner[1], corner[2]);
    // Where the surface is closed, opposite sides are one seam run both ways.
    let top = if chart.period[1].is_some() { bottom } else { side(1, v1, corner[3], corner[2]) };
    let left = if chart.period[0].is_some() { right } else { side(0, u0, corner[0], corner[3]) };
    let piece = |source: Source, a: Uv, b: Uv, reversed: bool| Piece {
        source,
        reversed,
        curve: UvCurve::line(a, b, [0.0, 1.0]),
        accuracy: 0.0,
    };
    Ok(Chain::closed(vec![
        piece(bottom, corner[0], corner[1], false),
        piece(right, corner[1], corner[2], false),
        piece(top, corner[3], corner[2], true),
        piece(left, corner[0], corner[3], true),
    ]))
}

/// Closes one loop that winds around: to the pole or natural border on its left, by a seam run both ways, and adds what it makes to
/// `seams`. A loop that has nothing there is turned around if it may be; else fails.
fn extend_to_border(
    chain: Chain,
    domain: &SeamDomain<'_>,
    seams: &mut Vec<[Uv; 2]>,
    may_turn: bool,
) -> Result<Chain, &'static str> {
    let chart = domain.chart;
    // Winding along +u has its material at larger v; along +v at smaller u.
    let (along, forward) = match chain.winding {
        [1, 0] => (0, true),
        [-1, 0] => (0, false),
        [0, 1] => (1, true),
        [0, -1] => (1, false),
        _ => return Err("a loop winds around the surface more than once"),
    };
    let across = 1 - along;
    let upper = if along == 0 { forward } else { !forward };
    let polygon = chain.polygon();
    // The loop's mean height decides which poles and borders lie on its left.
    let mean = polygon.iter().map(|p| p[across]).sum::<f64>() / polygon.len() as f64;
    let side = |x: f64| if upper { x > mean } else { x < mean };
    let pole = chart.poles.iter().find(|p| p.fixed == across && side(p.parameter));
    let natural = chart.range[across][usize::from(upper)];
    let at = match pole {
        Some(p) => p.parameter,
        None if natural.is_finite() && chart.period[across].is_none() => natural,
        // Nothing closes it on its left: the loop runs the wrong way if something does on its right.
        None if chart.period[across].is_none() && may_turn && !chart.poles.is_empty() => {
            let mut turned = chain;
            turned.reverse();
            return extend_to_border(turned, domain, seams, false);
        }
        None if chart.period[across].is_some() => {
            return Err("one loop winds around a surface closed both ways and bounds nothing there");
        }
        None => return Err("a loop winds around an unbounded surface and nothing closes it"),
    };
    let displacement = chain.displacement(chart);
    // Straight across from a vertex that sees the border, or around the holes before it.
    let starts: Vec<Uv> = chain.pieces.iter().map(Piece::start).collect();
    let borders = [unrolled_polygon(&polygon, displacement)];
    let obstacles = Obstacles::new(&domain.holes, &borders, displacement);
    let foot_of = |p: Uv| {
        let mut foot = p;
        foot[across] = at;
        foot
    };
    let straight = (0..starts.len()).find(|&i| obstacles.leave_free(starts[i], foot_of(starts[i])));
    let seam = match straight {
        Some(i) => SeamPath { start: i, goal: 0, points: vec![starts[i], foot_of(starts[i])] },
        None => {
            let metric = chart.derivatives(starts[0]);
            obstacles
                .way_around(&starts, &Goals::Line(&foot_of), &metric, domain.budget)?
                .ok_or("no way from the loop to the pole past the holes")?
        }
    };
    let chain = started_at(chain, seam.start, displacement);
    let foot = seam.points[seam.points.len() - 1];
    let up = seam_pieces(&seam.points, seams);
    // Along a pole there is no edge; along a natural border one is added.
    let border = if pole.is_some() {
        Piece::straight(foot + displacement, foot)
    } else {
        seams.push([foot, foot + displacement]);
        let curve = UvCurve::line(foot, foot + displacement, [0.0, 1.0]);
        Piece { source: Source::Seam(seams.len() - 1), reversed: true, curve, accuracy: 0.0 }
    };
    let mut pieces = chain.pieces;
    pieces.extend(up.iter().map(|p| p.clone().shifted(displacement)));
    pieces.push(border);
    pieces.extend(run_back(up));
    Ok(Chain { bridged: chain.bridged, ..Chain::closed(pieces) })
}

/// Returns the winding chain starting with piece `first`; the pieces before it come last, one displacement on.
fn started_at(mut chain: Chain, first: usize, displacement: Uv) -> Chain {
    let head: Vec<Piece> = chain.pieces.drain(..first).map(|p| p.shifted(displacement)).collect();
    chain.pieces.extend(head);
    chain
}

/// Joins two loops that wind in opposite senses by a seam run both ways, past the holes, and adds its pieces to `seams`; fails where no way
/// is found.
fn join_winding_pair(
    a: Chain,
    b: Chain,
    domain: &SeamDomain<'_>,
    seams: &mut Vec<[Uv; 2]>,
) -> Result<Chain, &'static str> {
    let chart = domain.chart;
    let displacement = a.displacement(chart);
    let border_a = unrolled_polygon(&a.polygon(), displacement);
    let border_b = unrolled_polygon(&b.polygon(), -displacement);
    let starts_a: Vec<Uv> = a.pieces.iter().map(Piece::start).collect();
    let starts_b: Vec<Uv> = b.pieces.iter().map(Piece::start).collect();
    let along = usize::from(a.winding[0] == 0);
    let mut pairs: Vec<(f64, usize, usize, Uv)> = Vec::new();
    let by_cost = |x: &(f64, usize, usize, Uv), y: &(f64, usize, usize, Uv)| {
        x.0.total_cmp(&y.0).then_with(|| (x.1, x.2).cmp(&(y.1, y.2)))
    };
    let kept = LEAST_PAIRS_OF_START.max(MOST_PAIRS / starts_a.len());
    for (i, &p) in starts_a.iter().enumerate() {
        let d = chart.derivatives(p);
        let first = pairs.len();
        for (j, &q) in starts_b.iter().enumerate() {
            // The nearest of all copies: a seam never needs to go around the surface.
            let mut q = chart.nearest_representative(q, p);
            // On a torus the second loop is the one on the left of the first.
            if let Some(period) = chart.period[1 - along] {
                let left = if along == 0 { a.winding[0] > 0 } else { a.winding[1] < 0 };
                let ahead = q[1 - along] - p[1 - along];
                if left && ahead < 0.0 {
                    q[1 - along] += period;
                } else if !left && ahead > 0.0 {
                    q[1 - along] -= period;
                }
            }
            let step = q - p;
            let length = (d.du * step.x + d.dv * step.y).length();
            // Straight across beats short: the seam is then an isoline and the domain one period wide.
            let slant = (step[along] / chart.period[along].unwrap_or(1.0)).abs();
            let slant = if slant < STRAIGHT_SEAM_SHARE { 0.0 } else { slant + 0.01 };
            pairs.push((slant * chart.size + SEAM_LENGTH_WEIGHT * length, i, j, q));
        }
        if pairs.len() > first + kept {
            pairs[first..].select_nth_unstable_by(kept, by_cost);
            pairs.truncate(first + kept);
        }
    }
    pairs.sort_unstable_by(by_cost);
    pairs.truncate(MOST_PAIRS);
    let borders = [border_a, border_b];
    let obstacles = Obstacles::new(&domain.holes, &borders, displacement);
    let straight = pairs.iter().find(|(_, i, _, q)| obstacles.leave_free(starts_a[*i], *q));
    let seam = match straight {
        Some(&(_, i, j, q)) => SeamPath { start: i, goal: j, points: vec![starts_a[i], q] },
        None => {
            let goals = seam_goals(pairs.iter().map(|&(_, _, j, q)| (j, q)), &obstacles);
            let metric = chart.derivatives(starts_a[0]);
            obstacles
                .way_around(&starts_a, &Goals::Points(&goals), &metric, domain.budget)?
                .ok_or("no seam between the two loops misses the holes")?
        }
    };
    // Around the first loop, over the seam one turn further on, around the second, and back over the seam: what lies between
    // both loops is bounded by one.
    let a = started_at(a, seam.start, displacement);
    let mut b = started_at(b, seam.goal, -displacement);
    b.shift(seam.points[seam.points.len() - 1] - b.pieces[0].start());
    let up = seam_pieces(&seam.points, seams);
    b.shift(displacement);
    let mut pieces = a.pieces;
    pieces.extend(up.iter().map(|p| p.clone().shifted(displacement)));
    pieces.extend(b.pieces);
    pieces.extend(run_back(up));
    Ok(Chain { bridged: a.bridged.max(b.bridged), ..Chain::closed(pieces) })
}

/// Returns where a seam may end, each place once: at these places, by their number in the second loop, and beside a hole of several turns,
/// such as a slot along a helix, as many turns on.
fn seam_goals(ends: impl Iterator<Item = (usize, Uv)>, obstacles: &Obstacles<'_>) -> Vec<(usize, Uv)> {
    let (displacement, turns) = (obstacles.displacement, obstacles.turns());
    let copies = |(j, q): (usize, Uv)| (-turns..=turns).map(move |turn| (j, q + displacement * f64::from(turn)));
    let mut goals: Vec<(usize, Uv)> = ends.flat_map(copies).collect();
    let mut seen = FxHashSet::default();
    goals.retain(|(j, q)| seen.insert((*j, q.to_array().map(f64::to_bits))));
    goals
}

/// Makes a straight piece of seam between each two of `points`, in parameters, and appends each to the list of seams.
fn seam_pieces(points: &[Uv], seams: &mut Vec<[Uv; 2]>) -> Vec<Piece> {
    let mut pieces = Vec::with_capacity(points.len() - 1);
    for side in points.windows(2) {
        seams.push([side[0], side[1]]);
        let curve = UvCurve::line(side[0], side[1], [0.0, 1.0]);
        pieces.push(Piece { source: Source::Seam(seams.len() - 1), reversed: false, curve, accuracy: 0.0 });
    }
    pieces
}

/// Returns the pieces of a seam in opposite order and direction.
fn run_back(pieces: Vec<Piece>) -> impl Iterator<Item = Piece> {
    pieces.into_iter().rev().map(|p| Piece { reversed: true, ..p })
}

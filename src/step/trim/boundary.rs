//! From chains to the boundary of a region without periods: chains that wind around the surface are joined by seams,
//! lone ones run to a pole or a natural border, closed surfaces get their outer boundary, holes move inside it.

use super::loops::{Chain, Piece, Source, contains, signed_area};
use super::tolerances::{CROSSING_NOISE, EMPTY_LOOP_SHARE, SEAM_LENGTH_WEIGHT, STRAIGHT_SEAM_SHARE};
use crate::math::Uv;
use crate::nurbs::UvCurve;
use crate::step::chart::Chart;

/// What the arrangement gives.
pub(crate) struct Boundary {
    /// Closed loops, material on the left.
    pub(crate) loops: Vec<Chain>,
    /// Straight seams in the parameter plane, by their number in [`Source::Seam`].
    pub(crate) seams: Vec<[Uv; 2]>,
    /// What had to be put right.
    pub(crate) repairs: Vec<&'static str>,
}

/// Arranges the chains of a face, given with the material on their left.
pub(crate) fn bound_region(
    mut chains: Vec<Chain>,
    chart: &Chart,
    implicit_outer: bool,
) -> Result<Boundary, &'static str> {
    chains.retain(|c| !c.pieces.is_empty());
    let mut out = Boundary { loops: Vec::new(), seams: Vec::new(), repairs: Vec::new() };
    let (winding, mut plain): (Vec<Chain>, Vec<Chain>) = chains.into_iter().partition(Chain::is_winding);
    // Loops without extent: a vertex, or an edge run forth and back.
    let scale = plain.iter().map(|c| signed_area(&c.polygon()).abs()).fold(0.0, f64::max);
    plain.retain(|c| signed_area(&c.polygon()).abs() > EMPTY_LOOP_SHARE * scale);
    if winding.is_empty() {
        if plain.is_empty() {
            out.loops.push(natural_boundary(chart, &[], &mut out.seams)?);
            return Ok(out);
        }
        bound_without_winding(&mut plain, chart, &mut out, implicit_outer)?;
        return Ok(out);
    }
    let obstacles: Vec<Vec<Uv>> = plain.iter().map(Chain::polygon).collect();
    let mut outer = match winding.len() {
        1 => {
            extend_to_border(winding.into_iter().next().ok_or("no loop")?, chart, &obstacles, &mut out.seams, true)?
        }
        2 => {
            let mut two = winding.into_iter();
            let (Some(a), Some(b)) = (two.next(), two.next()) else { return Err("no loop") };
            if a.winding != b.winding.map(|w| -w) {
                return Err("two loops wind around the surface in the same sense");
            }
            join_winding_pair(a, b, chart, &obstacles, &mut out.seams)?
        }
        _ => return Err("more than two loops wind around the surface"),
    };
    let border = outer.polygon();
    if signed_area(&border) < 0.0 {
        outer.reverse();
        out.repairs.push("the loops ran against the face's orientation");
    }
    out.loops.push(outer);
    for hole in plain {
        out.loops.push(place_hole(hole, &border, chart, &mut out.repairs));
    }
    Ok(out)
}

/// Moves a hole by periods into the border and turns it clockwise.
fn place_hole(mut hole: Chain, border: &[Uv], chart: &Chart, repairs: &mut Vec<&'static str>) -> Chain {
    let polygon = hole.polygon();
    let options = |d: usize| if chart.period[d].is_some() { vec![0, -1, 1, -2, 2] } else { vec![0] };
    let inside = |shift: Uv| {
        let n = polygon.len();
        let hits = (0..5).filter(|k| contains(border, polygon[k * n / 5] + shift)).count();
        hits >= 3
    };
    let shift = options(0)
        .into_iter()
        .flat_map(|i| options(1).into_iter().map(move |j| (i, j)))
        .map(|(i, j)| chart.whole_periods([i, j]))
        .find(|&s| inside(s));
    match shift {
        Some(shift) => {
            hole.shift(shift);
            if signed_area(&polygon) > 0.0 {
                hole.reverse();
                repairs.push("a hole was turned around");
            }
        }
        None => {
            if signed_area(&polygon) < 0.0 {
                hole.reverse();
                repairs.push("a loop outside the others was turned around");
            }
        }
    }
    hole
}

/// Loops that wind around nothing: the largest is the outer one, except on a closed surface, where loops that all run
/// clockwise leave the rest of the surface as the face.
fn bound_without_winding(
    plain: &mut Vec<Chain>,
    chart: &Chart,
    out: &mut Boundary,
    implicit_outer: bool,
) -> Result<(), &'static str> {
    let areas: Vec<f64> = plain.iter().map(|c| signed_area(&c.polygon())).collect();
    // A loop that runs along an edge twice was cut open by the file: it goes around the face, not around a hole.
    let all_holes = areas.iter().all(|&a| a < 0.0) && !plain.iter().any(Chain::is_cut_open);
    if implicit_outer || all_holes && is_closed(chart) {
        let polygons: Vec<Vec<Uv>> = plain.iter().map(Chain::polygon).collect();
        let outer = natural_boundary(chart, &polygons, &mut out.seams)?;
        let border = outer.polygon();
        out.loops.push(outer);
        for hole in plain.drain(..) {
            out.loops.push(place_hole(hole, &border, chart, &mut out.repairs));
        }
        return Ok(());
    }
    let largest = (0..areas.len()).max_by(|&a, &b| areas[a].abs().total_cmp(&areas[b].abs())).ok_or("no loop")?;
    let mut outer = plain.remove(largest);
    if areas[largest] < 0.0 {
        outer.reverse();
        out.repairs.push("the outer loop ran against the face's orientation");
    }
    let border = outer.polygon();
    out.loops.push(outer);
    for hole in plain.drain(..) {
        let turned = place_hole(hole, &border, chart, &mut out.repairs);
        out.loops.push(turned);
    }
    Ok(())
}

/// Whether the surface has no border at all.
fn is_closed(chart: &Chart) -> bool {
    (0..2).all(|d| {
        chart.period[d].is_some()
            || chart.range[d].iter().all(|x| chart.poles.iter().any(|p| p.fixed == d && p.at == *x))
    })
}

/// The whole surface: its natural borders, seams and poles, cut where no hole is.
fn natural_boundary(chart: &Chart, holes: &[Vec<Uv>], seams: &mut Vec<[Uv; 2]>) -> Result<Chain, &'static str> {
    let mut range = [[0.0; 2]; 2];
    for d in 0..2 {
        range[d] = match chart.period[d] {
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
    let is_pole = |fixed: usize, at: f64| chart.poles.iter().any(|p| p.fixed == fixed && p.at == at);
    let mut add = |a: Uv, b: Uv| {
        seams.push([a, b]);
        Source::Seam(seams.len() - 1)
    };
    let mut side = |fixed: usize, at: f64, a: Uv, b: Uv| {
        if is_pole(fixed, at) { Source::Nothing } else { add(a, b) }
    };
    let bottom = side(1, v0, corner[0], corner[1]);
    let right = side(0, u1, corner[1], corner[2]);
    let top = if chart.period[1].is_some() { bottom } else { side(1, v1, corner[3], corner[2]) };
    let left = if chart.period[0].is_some() { right } else { side(0, u0, corner[0], corner[3]) };
    let piece = |source: Source, a: Uv, b: Uv, reversed: bool| Piece {
        source,
        reversed,
        curve: UvCurve::line(a, b, [0.0, 1.0]),
    };
    Ok(Chain::closed(vec![
        piece(bottom, corner[0], corner[1], false),
        piece(right, corner[1], corner[2], false),
        piece(top, corner[3], corner[2], true),
        piece(left, corner[0], corner[3], true),
    ]))
}

/// A start of the period that no hole spans: the middle of the widest gap between them.
fn free_start(d: usize, base: f64, period: f64, holes: &[Vec<Uv>]) -> Option<f64> {
    if holes.is_empty() {
        return Some(base);
    }
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for hole in holes {
        let lo = hole.iter().map(|p| p[d]).fold(f64::INFINITY, f64::min);
        let hi = hole.iter().map(|p| p[d]).fold(f64::NEG_INFINITY, f64::max);
        let start = (lo - base).rem_euclid(period);
        spans.push((start, start + (hi - lo)));
    }
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut end = spans.iter().map(|s| s.1 - period).fold(f64::NEG_INFINITY, f64::max);
    let mut best = (0.0, 0.0);
    for &(a, b) in &spans {
        if a - end > best.1 {
            best = (0.5 * (a + end), a - end);
        }
        end = end.max(b);
    }
    (best.1 > 0.0).then_some(base + best.0)
}

/// One loop that winds around: to the pole or natural border on its left.
fn extend_to_border(
    chain: Chain,
    chart: &Chart,
    holes: &[Vec<Uv>],
    seams: &mut Vec<[Uv; 2]>,
    may_turn: bool,
) -> Result<Chain, &'static str> {
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
    let mean = polygon.iter().map(|p| p[across]).sum::<f64>() / polygon.len() as f64;
    let side = |x: f64| if upper { x > mean } else { x < mean };
    let pole = chart.poles.iter().find(|p| p.fixed == across && side(p.at));
    let natural = chart.range[across][usize::from(upper)];
    let at = match pole {
        Some(p) => p.at,
        None if natural.is_finite() && chart.period[across].is_none() => natural,
        // Nothing closes it on its left: the loop runs the wrong way if something does on its right.
        None if chart.period[across].is_none() && may_turn && !chart.poles.is_empty() => {
            let mut turned = chain;
            turned.reverse();
            return extend_to_border(turned, chart, holes, seams, false);
        }
        None => return Err("a loop winds around an unbounded surface and nothing closes it"),
    };
    let displacement = chain.displacement(chart);
    // Straight across from a vertex that sees the border.
    let starts: Vec<Uv> = chain.pieces.iter().map(Piece::start).collect();
    let own = unrolled_polygon(&polygon, displacement);
    let sees = |&i: &usize| {
        let mut to = starts[i];
        to[across] = at;
        !holes.iter().any(|h| segment_crosses(h, true, starts[i], to, displacement))
            && !segment_crosses(&own, false, starts[i], to, displacement)
    };
    let first = (0..starts.len()).find(sees).ok_or("no vertex sees the pole past the holes")?;
    let chain = started_at(chain, first, displacement);
    let from = chain.pieces[0].start();
    let mut foot = from;
    foot[across] = at;
    seams.push([from, foot]);
    let seam = Source::Seam(seams.len() - 1);
    let up = UvCurve::line(from, foot, [0.0, 1.0]);
    let far = Piece { source: seam, reversed: false, curve: up.clone() }.shifted(displacement);
    let border = if pole.is_some() {
        Piece::straight(foot + displacement, foot)
    } else {
        seams.push([foot, foot + displacement]);
        let curve = UvCurve::line(foot, foot + displacement, [0.0, 1.0]);
        Piece { source: Source::Seam(seams.len() - 1), reversed: true, curve }
    };
    let mut pieces = chain.pieces;
    pieces.extend([far, border, Piece { source: seam, reversed: true, curve: up }]);
    Ok(Chain { bridged: chain.bridged, ..Chain::closed(pieces) })
}

/// The polygon with its end point, for a chain that winds.
fn unrolled_polygon(polygon: &[Uv], displacement: Uv) -> Vec<Uv> {
    let mut open = polygon.to_vec();
    open.push(polygon[0] + displacement);
    open
}

/// The chain starting with another piece.
fn started_at(mut chain: Chain, first: usize, displacement: Uv) -> Chain {
    let head: Vec<Piece> = chain.pieces.drain(..first).map(|p| p.shifted(displacement)).collect();
    chain.pieces.extend(head);
    chain
}

/// Whether a segment properly meets a polygon, or one of its copies by `period`.
fn segment_crosses(polygon: &[Uv], closed: bool, a: Uv, b: Uv, period: Uv) -> bool {
    let n = polygon.len();
    let sides = if closed { n } else { n - 1 };
    [-2.0, -1.0, 0.0, 1.0, 2.0].iter().any(|&k| {
        let by = period * k;
        let lo = a.min(b) - by;
        let hi = a.max(b) - by;
        (0..sides).any(|i| {
            let (p, q) = (polygon[i], polygon[(i + 1) % n]);
            if p.x.max(q.x) < lo.x || p.x.min(q.x) > hi.x || p.y.max(q.y) < lo.y || p.y.min(q.y) > hi.y {
                return false;
            }
            let (p, q) = (p + by, q + by);
            let side = |o: Uv, d: Uv, x: Uv| (d - o).perp_dot(x - o);
            let (s1, s2, s3, s4) = (side(a, b, p), side(a, b, q), side(p, q, a), side(p, q, b));
            let noise = CROSSING_NOISE * (b - a).length() * (q - p).length();
            (s1 > noise && s2 < -noise || s1 < -noise && s2 > noise)
                && (s3 > noise && s4 < -noise || s3 < -noise && s4 > noise)
        })
    })
}

/// Two loops that wind in opposite senses, joined by a seam run twice.
fn join_winding_pair(
    a: Chain,
    b: Chain,
    chart: &Chart,
    holes: &[Vec<Uv>],
    seams: &mut Vec<[Uv; 2]>,
) -> Result<Chain, &'static str> {
    let displacement = a.displacement(chart);
    let (border_a, border_b) =
        (unrolled_polygon(&a.polygon(), displacement), unrolled_polygon(&b.polygon(), -displacement));
    let starts_a: Vec<Uv> = a.pieces.iter().map(Piece::start).collect();
    let starts_b: Vec<Uv> = b.pieces.iter().map(Piece::start).collect();
    let along = usize::from(a.winding[0] == 0);
    let mut pairs: Vec<(f64, usize, usize, Uv)> = Vec::new();
    for (i, &p) in starts_a.iter().enumerate() {
        let d = chart.derivatives(p);
        for (j, &q) in starts_b.iter().enumerate() {
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
    }
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0));
    pairs.truncate(4096);
    let clear = |from: Uv, to: Uv| {
        !holes.iter().any(|h| segment_crosses(h, true, from, to, displacement))
            && ![&border_a, &border_b].into_iter().any(|h| segment_crosses(h, false, from, to, displacement))
    };
    let found = pairs.iter().find(|(_, i, _, q)| clear(starts_a[*i], *q));
    let Some(&(_, i, j, q)) = found else { return Err("no straight seam between the two loops misses the holes") };
    let a = started_at(a, i, displacement);
    let mut b = started_at(b, j, -displacement);
    b.shift(q - b.pieces[0].start());
    let p = a.pieces[0].start();
    seams.push([p, q]);
    let seam = Source::Seam(seams.len() - 1);
    let up = UvCurve::line(p, q, [0.0, 1.0]);
    b.shift(displacement);
    let mut pieces = a.pieces;
    pieces.push(Piece { source: seam, reversed: false, curve: up.clone() }.shifted(displacement));
    pieces.extend(b.pieces);
    pieces.push(Piece { source: seam, reversed: true, curve: up });
    Ok(Chain { bridged: a.bridged.max(b.bridged), ..Chain::closed(pieces) })
}

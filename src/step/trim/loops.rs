//! Loops in the unwrapped parameter plane: edge uses chained end to end, poles closed by their sides.

use super::tolerances::{EMPTY_STEP, POLE_RESOLUTION_MM, POLE_TURN_SLACK, WIDE_STEP};
use crate::math::Uv;
use crate::math::polygon::{is_inside_sides, polygon_sides};
use crate::nurbs::{ControlPoint, UvCurve, area_within};
use crate::step::chart::{Chart, Pole};
use rustc_hash::FxHashSet;

/// Where a piece of a loop comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Source {
    /// An edge of the part, by its number in the task.
    Edge(usize),
    /// A seam that was added to this face, by its number.
    Seam(usize),
    /// A pole, or a small step between edges that do not meet.
    Nothing,
}

/// A part of a loop, in the chart's parameters.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) source: Source,
    /// Whether the loop runs against the curve.
    pub(crate) reversed: bool,
    /// Over the parameter of its edge or seam; from 0 to 1 for a step.
    pub(crate) curve: UvCurve,
    /// Distance, mm, within which its ends are at a pole; 0 of what is no edge.
    pub(crate) accuracy: f64,
}

impl Piece {
    /// Returns the last (true) or first point of the curve, whichever way the loop runs it.
    fn end_point(&self, end: bool) -> Uv {
        let n = self.curve.points.len() - 1;
        self.curve.points[if end { n } else { 0 }].position()
    }

    pub(crate) fn start(&self) -> Uv {
        self.end_point(self.reversed)
    }

    pub(crate) fn end(&self) -> Uv {
        self.end_point(!self.reversed)
    }

    /// Returns the point half-way in the curve's parameter.
    fn middle(&self) -> Uv {
        let [a, b] = self.curve.domain();
        self.curve.evaluate(0.5 * (a + b))
    }

    /// Returns the piece moved by `by` in the parameter plane.
    pub(crate) fn shifted(mut self, by: Uv) -> Self {
        if by != Uv::ZERO {
            for p in &mut self.curve.points {
                let w = p.z;
                *p += (by * w).extend(0.0);
            }
        }
        self
    }

    /// Returns a straight step that belongs to no edge.
    pub(crate) fn straight(from: Uv, to: Uv) -> Self {
        let curve = UvCurve::line(from, to, [0.0, 1.0]);
        Self { source: Source::Nothing, reversed: false, curve, accuracy: 0.0 }
    }

    /// Appends points of the piece to `polygon`, in the direction of the loop and evenly over each span of the curve, from its start on;
    /// its end, where the next piece starts, is left out. `density` is how many times the points of a first test; a straight piece has one
    /// a span.
    fn append_points(&self, density: usize, polygon: &mut Vec<Uv>) {
        let start = polygon.len();
        let breaks = self.curve.breakpoints();
        let per_span = if self.curve.degree == 1 { 1 } else { density * 16usize.div_ceil(breaks.len() - 1).max(3) };
        for pair in breaks.windows(2) {
            for k in 0..per_span {
                polygon.push(self.curve.evaluate(pair[0] + (pair[1] - pair[0]) * k as f64 / per_span as f64));
            }
        }
        polygon.push(self.end_point(true));
        if self.reversed {
            polygon[start..].reverse();
        }
        polygon.pop();
    }
}

/// A chain of pieces, each beginning where the one before ends, that closes up to whole periods.
#[derive(Clone, Debug)]
pub(crate) struct Chain {
    pub(crate) pieces: Vec<Piece>,
    /// Periods from the start of the first piece to the end of the last.
    pub(crate) winding: [i32; 2],
    /// Largest step that had to be bridged, mm.
    pub(crate) bridged: f64,
    /// Whether it was run backwards, since its sides at a pole fit no other way.
    pub(crate) is_against_sense: bool,
    /// Whether one of its edges, which runs all around by itself, was turned around.
    pub(crate) is_edge_turned: bool,
}

impl Chain {
    /// Pieces that close without winding.
    pub(crate) fn closed(pieces: Vec<Piece>) -> Self {
        Self { pieces, winding: [0, 0], bridged: 0.0, is_against_sense: false, is_edge_turned: false }
    }

    /// Returns a polygon of points along the chain, without the end.
    pub(crate) fn polygon(&self) -> Vec<Uv> {
        self.polygon_of_density(1)
    }

    /// Returns the polygon with about so many times the points on curved pieces.
    pub(crate) fn polygon_of_density(&self, density: usize) -> Vec<Uv> {
        let mut points = Vec::new();
        for piece in &self.pieces {
            piece.append_points(density, &mut points);
        }
        points
    }

    /// Returns the signed area inside a closed chain, along its curves.
    pub(crate) fn area(&self) -> f64 {
        area_within(self.pieces.iter().map(|p| (&p.curve, p.reversed)))
    }

    /// Whether it runs around a period, so that it closes on the surface but not in the plane.
    pub(crate) fn is_winding(&self) -> bool {
        self.winding != [0, 0]
    }

    /// Whether the chain runs along an edge of the file twice, as along a seam.
    pub(crate) fn is_cut_open(&self) -> bool {
        let mut seen = FxHashSet::default();
        self.pieces.iter().any(|p| matches!(p.source, Source::Edge(_)) && !seen.insert(p.source))
    }

    /// Moves all pieces in the parameter plane.
    pub(crate) fn shift(&mut self, by: Uv) {
        self.pieces = std::mem::take(&mut self.pieces).into_iter().map(|p| p.shifted(by)).collect();
    }

    /// Turns the chain around: order and direction of its pieces, and its winding.
    pub(crate) fn reverse(&mut self) {
        self.pieces.reverse();
        for piece in &mut self.pieces {
            piece.reversed = !piece.reversed;
        }
        self.winding = self.winding.map(|w| -w);
    }

    /// Returns the displacement from start to end that the winding stands for.
    pub(crate) fn displacement(&self, chart: &Chart) -> Uv {
        chart.whole_periods(self.winding)
    }
}

/// Whether a point is inside a polygon; on its border either answer may come.
pub(crate) fn contains(polygon: &[Uv], p: Uv) -> bool {
    is_inside_sides(polygon_sides(polygon), p)
}

/// Chains edge uses, in their order, to a loop; each is shifted by whole periods to begin where the one before ends, within `tolerance` mm,
/// or after a straight step.
///
/// Loops whose sides at a pole do not fit the sense in which they wind are tried with the sides run the other way: such
/// loops run against their face's orientation. Of a loop that winds twice one edge that runs all around is turned.
pub(crate) fn close_loop(uses: Vec<Piece>, chart: &Chart, tolerance: f64) -> Chain {
    let first = chain_uses(uses.clone(), chart, tolerance, false);
    // On a surface with one pole nothing could close a loop that touches it and winds around it all the same.
    let lone = chart.poles.len() == 1 && first.pieces.iter().any(|p| p.source == Source::Nothing);
    let allowed = if lone { 0 } else { 1 };
    if first.winding.iter().all(|w| w.abs() <= allowed) {
        return first;
    }
    let mut second = chain_uses(uses.clone(), chart, tolerance, true);
    if second.is_winding() {
        return turn_closed_edge(&uses, first.winding, chart, tolerance).unwrap_or(first);
    }
    second.reverse();
    second.is_against_sense = true;
    second
}

/// Chains the uses of a loop that winds twice with one of them turned around, which closes it: both rims of a wall with a seam between run
/// the same way then. Of such uses, each of which runs all around by itself, the one is turned that leaves the material on the left; `None`
/// where none closes the loop.
fn turn_closed_edge(uses: &[Piece], winding: [i32; 2], chart: &Chart, tolerance: f64) -> Option<Chain> {
    let along = (0..2).find(|&d| winding[d].abs() == 2 && winding[1 - d] == 0)?;
    let turn = 0.5 * f64::from(winding[along]) * chart.period[along]?;
    let runs_around = |piece: &Piece| {
        let (start, end) = (piece.start(), piece.end());
        let [p, q] = [start, end].map(|uv| chart.derivatives(uv).point);
        let is_turn = ((end - start)[along] / turn).round() == 1.0;
        matches!(piece.source, Source::Edge(_)) && is_turn && (q - p).length() <= 10.0 * tolerance
    };
    let turned = |k: usize| {
        let mut uses = uses.to_vec();
        uses[k].reversed = !uses[k].reversed;
        Chain { is_edge_turned: true, ..chain_uses(uses, chart, tolerance, false) }
    };
    let closed = (0..uses.len()).filter(|&k| runs_around(&uses[k])).map(turned).filter(|chain| !chain.is_winding());
    closed.max_by(|a, b| a.area().total_cmp(&b.area()))
}

/// Puts uses one behind the other by whole periods, and counts how often the loop winds around; `turned` runs sides at a pole the other
/// way.
fn chain_uses(uses: Vec<Piece>, chart: &Chart, tolerance: f64, turned: bool) -> Chain {
    let connection = Connection { chart, tolerance, turned, extent: control_extent(&uses) };
    let mut chain = Chain::closed(Vec::with_capacity(uses.len() + 2));
    for (i, next) in uses.into_iter().enumerate() {
        if i == 0 {
            chain.pieces.push(next);
            continue;
        }
        let shift = connection.connect(&mut chain, &next);
        chain.pieces.push(next.shifted(shift));
    }
    let Some(first) = chain.pieces.first().cloned() else { return chain };
    // Back to the start: what the shift says is the winding.
    let shift = connection.connect(&mut chain, &first);
    for d in 0..2 {
        chain.winding[d] = chart.period[d].map_or(0, |p| (shift[d] / p).round() as i32);
    }
    chain
}

/// Returns the size of the box around the control points of pieces, each in the period in which it was found.
fn control_extent(pieces: &[Piece]) -> Uv {
    let points = pieces.iter().flat_map(|p| p.curve.points.iter().map(|q| q.position()));
    let (lo, hi) = points.fold((Uv::INFINITY, Uv::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    hi - lo
}

/// How pieces of a loop are joined.
struct Connection<'c> {
    chart: &'c Chart,
    /// Distance within which ends are one, mm.
    tolerance: f64,
    /// Whether sides at a pole run the other way.
    turned: bool,
    /// Size of the loop in parameters.
    extent: Uv,
}

impl Connection<'_> {
    /// Appends steps from the end of the chain to the start of `next`, sides along a pole included; returns the shift that `next` needs.
    fn connect(&self, chain: &mut Chain, next: &Piece) -> Uv {
        let Self { chart, tolerance, turned, .. } = *self;
        let Some(last) = chain.pieces.last().cloned() else { return Uv::ZERO };
        let (from, start) = (last.end(), next.start());
        let near = chart.nearest_representative(start, from);
        let (p, q) = (chart.derivatives(from).point, chart.derivatives(near).point);
        // How roughly other edges of the face end says nothing of these two.
        let reach = 4.0 * last.accuracy.max(next.accuracy).max(POLE_RESOLUTION_MM);
        let near_pole = |pole: &&Pole| (pole.point - p).length() <= reach && (pole.point - q).length() <= reach;
        // Of two in one point, as at the ends of a canal that touches itself, the one that both pieces run into.
        let off =
            |pole: &Pole| (from[pole.fixed] - pole.parameter).abs() + (near[pole.fixed] - pole.parameter).abs();
        let pole = chart.poles.iter().filter(near_pole).min_by(|a, b| off(a).total_cmp(&off(b)));
        let Some(pole) = pole else {
            let distance = (p - q).length();
            // A little apart is one point written twice; more than that is bridged, and reported.
            if distance > 10.0 * tolerance || distance > tolerance && self.is_wide(near - from) {
                chain.bridged = chain.bridged.max(distance);
                chain.pieces.push(Piece::straight(from, near));
            }
            return near - start;
        };
        let free = 1 - pole.fixed;
        let same_edge = last.source == next.source;
        let low = (last.middle()[pole.fixed] > pole.parameter) != turned;
        let amount = run_along_pole(pole, chart, low, start[free] - from[free], same_edge);
        let target = from[free] + amount;
        // Down to the pole, along it, and back: the first and last step are usually empty.
        let mut corner = from;
        for (d, value) in [(pole.fixed, pole.parameter), (free, target), (pole.fixed, start[pole.fixed])] {
            let mut to = corner;
            to[d] = value;
            if (to[d] - corner[d]).abs() > EMPTY_STEP * (1.0 + value.abs()) {
                chain.pieces.push(Piece::straight(corner, to));
                corner = to;
            }
        }
        let mut shift = Uv::ZERO;
        shift[free] = target - start[free];
        shift
    }

    /// Whether a step is more than [`WIDE_STEP`] of the loop's size in u or v: it is then a side of the loop, and not closed by moving both
    /// ends. Of a ring between two half circles on the same two vertices that left no width.
    fn is_wide(&self, step: Uv) -> bool {
        step.abs().cmpgt(WIDE_STEP * self.extent).any()
    }
}

/// Returns how far the loop runs along a pole, in the parameter that changes there, with the material on its left. `low` is whether it
/// comes from larger values of the fixed one; `difference` is from where it leaves the chain to the next start.
fn run_along_pole(pole: &Pole, chart: &Chart, low: bool, difference: f64, same_edge: bool) -> f64 {
    let free = 1 - pole.fixed;
    let Some(period) = chart.period[free] else { return difference };
    // Along v = low run to +u, along v = high to -u; along u = high to +v, along u = low to -v.
    let forward = if pole.fixed == 1 { low } else { !low };
    let amount = if forward { difference.rem_euclid(period) } else { (-difference).rem_euclid(period) };
    let noise = POLE_TURN_SLACK * period;
    let amount =
        if amount < noise || amount > period - noise { if same_edge { period } else { 0.0 } } else { amount };
    if forward { amount } else { -amount }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_between_edges_that_miss_one_another_count_in_the_area() {
        let side = |from: [f64; 2], to: [f64; 2]| Piece::straight(from.into(), to.into());
        let open = Chain::closed(vec![side([0.0, 0.0], [1.0, 0.0]), side([1.0, 1.0], [0.0, 1.0])]);
        assert_eq!(open.area(), 1.0);
        let shifted = Chain::closed(open.pieces.iter().map(|p| p.clone().shifted(Uv::new(3.0, -2.0))).collect());
        assert_eq!(shifted.area(), 1.0);
    }
}

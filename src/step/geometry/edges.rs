//! Edges: curves cut to their vertices, running from the start vertex to the end vertex.

use super::closing::{CompositeEdges, CurveUse};
use super::composite::coincident;
use super::curves::{CurveShape, DirectedCurve};
use super::joints::Joint;
use super::tolerances::{
    ACCURACY_MM, EMPTY_EDGE_MM, EMPTY_PARAMETER, EMPTY_SHARE, EQUAL_POINTS_MM, LOOSE_VERTEX_MM, VERTEX_MM,
    VERTEX_SHARE,
};
use super::{GeometryReader, Outcome, Refusal};
use crate::math::Point;
use crate::nurbs::Curve;

/// Problem of a line that passes a vertex by.
const PASSED_BY: &str = "the line of an edge passes one of its vertices by: it runs between them";
/// Problem of an edge whose sense is wrong.
const WRONG_SENSE: &str = "the sense of an edge contradicts its vertices: it runs from the first to the second";
/// Problem of an edge whose curve was in pieces.
const BRIDGED: &str = "segments of the curve of an edge lie apart: straight pieces join them";
/// Problem of an edge along a curve that overlaps itself.
const CUT: &str = "segments of the curve of an edge overlap: what they have in common is cut off one of them";
/// Problem of an edge over the ends of a curve that do not meet.
const CLOSED: &str = "the ends of the curve of an edge lie apart: a straight piece joins them";
/// Problem of an edge over the ends of a curve that overlap.
const CLOSED_BY_CUT: &str =
    "the ends of the curve of an edge overlap: what they have in common is cut off one of them";
/// Longest chain of edges that are parts of edges.
const MAX_PARENTS: usize = 4;

/// An edge's curve, cut to its vertices and running from the first to the second.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrimmedEdge {
    /// `None` for an edge without length.
    pub(crate) curve: Option<Curve>,
    /// Distance between the curve's ends and the vertices, mm.
    pub(crate) gap: f64,
    /// Repairs that were necessary.
    pub(crate) repair: Option<&'static str>,
    /// Whether it is part of a closed curve, of which the same vertices bound another part.
    pub(crate) is_arc: bool,
}

/// What is known of an edge besides its own entity.
#[derive(Clone, Copy)]
pub(crate) struct EdgeContext<'c> {
    /// Whether a loop has no other edge: of a closed curve it is then the whole, though its vertices are two that lie apart by rounding.
    pub(crate) is_alone: bool,
    /// Whether the file has its vertices in the wrong order.
    pub(crate) is_swapped: bool,
    /// Those of its part along composite curves.
    pub(crate) others: &'c CompositeEdges,
}

impl<'f, 'a> GeometryReader<'f, 'a> {
    /// Reads an edge's curve between its vertices, mm; that of a SUBEDGE is cut from its parent's. Refuses other kinds of edges.
    pub(crate) fn edge(&self, id: u64, context: EdgeContext<'_>) -> Outcome<TrimmedEdge> {
        let e = self.entity(id)?;
        let vertices = e.attributes("EDGE", 1).or_else(|| e.attributes("EDGE_CURVE", 1));
        let Some(vertices) = vertices.or_else(|| e.attributes("SUBEDGE", 1)) else {
            return Err(Refusal::new(e, "this kind of edge is not supported"));
        };
        let mut owner = e;
        for _ in 0..MAX_PARENTS {
            let Some(a) = owner.attributes("SUBEDGE", 3) else { break };
            owner = self.resolve(owner, a.id(0), "parent edge")?;
        }
        // A simple EDGE_CURVE has its vertices before its geometry.
        let own = owner.attributes("EDGE_CURVE", 3);
        let (curve, sense) = own.map_or((None, true), |a| (a.id(0), a.flag(1) != Some(false)));
        let [first, last] = if context.is_swapped { [1, 0] } else { [0, 1] };
        let edge = self.edge_between(e.id, [vertices.id(first), vertices.id(last)], curve, (sense, context))?;
        // A part of an edge may run either way along it.
        let repair = edge.repair.filter(|&repair| owner.id == e.id || repair != WRONG_SENSE);
        Ok(TrimmedEdge { repair, ..edge })
    }

    /// Reads edge #`id` from its first to its second vertex, mm: that part of `curve`, or all of a closed one where both vertices are one
    /// place; the straight line where the file gives no curve, none where it has no length. `sense` is whether it runs along `curve`; a
    /// wrong one is corrected. Refuses missing vertices, vertices that leave nothing of the curve but lie apart, and a part of a curve with
    /// segments, or ends, too far apart to be joined.
    fn edge_between(
        &self,
        id: u64,
        vertices: [Option<u64>; 2],
        curve: Option<u64>,
        (sense, context): (bool, EdgeContext<'_>),
    ) -> Outcome<TrimmedEdge> {
        let e = self.entity(id)?;
        let [Some(v0), Some(v1)] = vertices else { return Err(Refusal::new(e, "a vertex is missing")) };
        let (p, q) = (self.vertex(v0)?, self.vertex(v1)?);
        let closed = v0 == v1 || p == q;
        let Some(curve) = curve else {
            // No geometry: straight.
            let length = (q - p).length();
            let curve = (!closed && length >= EMPTY_EDGE_MM).then(|| Curve::line(p, q, [0.0, length]));
            return Ok(TrimmedEdge { curve, ..TrimmedEdge::default() });
        };
        let directed = self.curve(curve, 0)?;
        let is_alone = context.is_alone;
        let usage = CurveUse { vertices: [p, q], sense, is_closed: closed, is_alone };
        let directed = self.close_for_edge(e, curve, directed, &usage, context.others)?;
        // A loop of one edge encloses something: next to nothing of the curve cannot be meant.
        let closed = closed || is_alone && directed.shape.period().is_some() && coincident(p, q, LOOSE_VERTEX_MM);
        let edge = trim_to_vertices(&directed, p, q, closed, sense)
            .ok_or_else(|| Refusal::new(e, "its vertices leave nothing of its curve"))?;
        // A trimmed curve has the parameter of the whole one, also where it is run backwards.
        let joints = edge.curve.as_ref().map_or_else(Vec::new, |part| directed.shape.joints_along(part.domain()));
        self.require_joined(&joints)?;
        let told = joints.first().map(told_of_joint);
        Ok(TrimmedEdge { repair: edge.repair.or(told), ..edge })
    }
}

/// Returns the problem of an edge that runs over a joint.
fn told_of_joint(joint: &Joint) -> &'static str {
    match (joint.is_closing, joint.overlaps) {
        (false, false) => BRIDGED,
        (false, true) => CUT,
        (true, false) => CLOSED,
        (true, true) => CLOSED_BY_CUT,
    }
}

/// Returns the edge from `p` to `q` along a curve, the whole of it if `closed`; `sense` is whether the edge runs along the curve as the
/// file names it, which is corrected on an open curve, and noted. A line that passes a vertex by is replaced by the segment between both;
/// an edge whose vertices coincide has no curve. `None` where nothing of the curve lies between vertices that are apart, or its numbers
/// are not finite.
pub(crate) fn trim_to_vertices(
    directed: &DirectedCurve,
    p: Point,
    q: Point,
    closed: bool,
    sense: bool,
) -> Option<TrimmedEdge> {
    let shape = &directed.shape;
    // The edge's sense is relative to the curve as the file names it, which may be reversed itself.
    let forward = sense != directed.reversed;
    let (a, b) = if forward { (p, q) } else { (q, p) };
    let (mut ta, mut tb) = (shape.parameter(a), shape.parameter(b));
    let accuracy = VERTEX_MM + VERTEX_SHARE * p.abs().max_element();
    // The edges beside it end in its vertices: a line that misses one would leave a gap there, or be another edge's.
    // By as much as files say that they are inaccurate it may miss one without a word.
    let [least, most] = misses_of_line(shape, [(ta, a), (tb, b)]);
    if most > LOOSE_VERTEX_MM && (p - q).length() > LOOSE_VERTEX_MM {
        let curve = Some(Curve::line(p, q, [0.0, (q - p).length()]));
        let is_gap = least <= LOOSE_VERTEX_MM && most <= ACCURACY_MM[1];
        let (gap, repair) = if is_gap { (most, None) } else { (0.0, Some(PASSED_BY)) };
        return Some(TrimmedEdge { curve, gap, repair, ..TrimmedEdge::default() });
    }
    match shape.period() {
        Some(period) => {
            let noise = EMPTY_SHARE * period;
            if let CurveShape::Spline { curve, .. } = shape {
                // A vertex on the seam of a closed spline may have been found at either end.
                let [d0, d1] = curve.domain();
                let seam = curve.evaluate(d0);
                if coincident(a, seam, accuracy) || (ta - d1).abs() < noise {
                    ta = d0;
                }
                if coincident(b, seam, accuracy) {
                    tb = if closed { d0 } else { d1 };
                }
            }
            if closed {
                tb = ta + period;
            } else {
                tb = ta + (tb - ta).rem_euclid(period);
                if tb - ta < noise || period - (tb - ta) < noise && coincident(p, q, accuracy) {
                    // Two vertices in one place: the whole curve, or nothing of it.
                    return if coincident(p, q, accuracy) { Some(TrimmedEdge::default()) } else { None };
                }
            }
        }
        None => {
            if let CurveShape::Spline { curve, .. } = shape {
                let [d0, d1] = curve.domain();
                if closed {
                    if coincident(p, q, accuracy)
                        && (curve.evaluate(d0) - curve.evaluate(d1)).length() > LOOSE_VERTEX_MM
                    {
                        return Some(TrimmedEdge::default());
                    }
                    (ta, tb) = (d0, d1);
                }
            }
            if tb < ta {
                // The sense flag is wrong, which real files show now and then: the vertices decide.
                let curve = shape.segment(tb, ta);
                // Rounding alone may turn an edge between vertices that may be one.
                let repair = (!coincident(p, q, LOOSE_VERTEX_MM)).then_some(WRONG_SENSE);
                return finish_edge(curve, !forward, p, q).map(|edge| TrimmedEdge { repair, ..edge });
            }
            if !(tb - ta > 0.0) || (a - b).length() < EQUAL_POINTS_MM && matches!(shape, CurveShape::Line { .. }) {
                return coincident(p, q, LOOSE_VERTEX_MM).then(TrimmedEdge::default);
            }
        }
    }
    let length_scale = EMPTY_PARAMETER * (ta.abs() + tb.abs());
    if !(tb - ta > length_scale) {
        return coincident(p, q, LOOSE_VERTEX_MM).then(TrimmedEdge::default);
    }
    let is_arc = shape.period().is_some() && !closed;
    finish_edge(shape.segment(ta, tb), forward, p, q).map(|edge| TrimmedEdge { is_arc, ..edge })
}

/// Returns by how much a line misses two vertices, each at its parameter, the lesser first, mm; 0 of any other curve.
fn misses_of_line(shape: &CurveShape, ends: [(f64, Point); 2]) -> [f64; 2] {
    let CurveShape::Line { origin, direction } = shape else { return [0.0; 2] };
    let [a, b] = ends.map(|(t, vertex)| (*origin + *direction * t - vertex).length());
    [a.min(b), a.max(b)]
}

/// Returns the curve turned as the edge runs, with its gap to the vertices; `None` where it has no parameters left or is no number.
fn finish_edge(curve: Curve, forward: bool, p: Point, q: Point) -> Option<TrimmedEdge> {
    let curve = if forward { curve } else { curve.reversed() };
    let [a, b] = curve.domain();
    if !(b > a) || curve.points.iter().any(|x| !x.is_finite()) {
        return None;
    }
    // How far the curve's ends miss the vertices is the file's own gap, which the report gives.
    let gap = (curve.evaluate(a) - p).length().max((curve.evaluate(b) - q).length());
    let extent = curve.bounds().diagonal();
    if extent < EMPTY_EDGE_MM {
        return Some(TrimmedEdge { gap, ..TrimmedEdge::default() });
    }
    Some(TrimmedEdge { curve: Some(curve), gap, ..TrimmedEdge::default() })
}

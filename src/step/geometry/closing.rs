//! Curves whose ends do not quite meet, closed for the edges that run over these ends: by a joint like those between segments.
//!
//! A curve is closed where an edge takes all of it from one vertex to the same. A composite one, unless the file ends it with a
//! discontinuity, is closed where an edge would otherwise run against its sense, and another edge runs along what lies between its
//! vertices. Known weakness: beside a wider gap than the accuracy, and without such another edge, the sense is taken for wrong.

use super::composite::{coincident, is_closed_by_file};
use super::curves::{COMPOSITES, CurveShape, DirectedCurve};
use super::joints::{
    JoinedCurve, Joint, cut_overlap, doubles_back, elevate_degree, end_point, joint_crossing, joint_margin,
    start_point, step_between,
};
use super::tolerances::{ACCURACY_MM, EMPTY_LOOP_MM, LOOSE_VERTEX_MM, STATED_BRIDGE_SHARE};
use super::{GeometryReader, Outcome, Refusal};
use crate::math::{Homogeneous, Point};
use crate::nurbs::{ControlPoint, Curve};
use crate::step::part21::Entity;
use rustc_hash::FxHashMap;
use std::sync::OnceLock;

/// Edges by the basis curve, see [`GeometryReader::basis_curve`], along which they run: composite ones, and replicas and offsets of them.
#[derive(Debug, Default)]
pub(crate) struct CompositeEdges(FxHashMap<u64, EdgesAlong>);

/// The edges along one basis curve.
#[derive(Debug, Default)]
struct EdgesAlong {
    edges: Vec<u64>,
    /// See [`GeometryReader::taken_middles`]; found when one of the edges asks for them.
    middles: OnceLock<Vec<f64>>,
}

/// How an edge uses a curve.
pub(super) struct CurveUse {
    /// The first and the last vertex.
    pub(super) vertices: [Point; 2],
    /// Whether it runs along the curve as the file names it.
    pub(super) sense: bool,
    /// Whether both vertices are one.
    pub(super) is_closed: bool,
    /// Whether its loop has no other edge.
    pub(super) is_alone: bool,
}

impl CurveUse {
    /// Returns where its vertices are on a curve, in the order of the edge's sense: descending where it runs against that along an open
    /// curve.
    fn parameters(&self, curve: &DirectedCurve) -> [f64; 2] {
        let [first, last] = self.vertices.map(|vertex| curve.shape.parameter(vertex));
        if self.sense != curve.reversed { [first, last] } else { [last, first] }
    }

    /// Whether its vertices are the two ends of a curve, which are `width`, mm, apart.
    fn joins_ends(&self, curve: &Curve, width: f64) -> bool {
        let ([first, last], near) = (self.vertices, 0.5 * width);
        let are_ends =
            |p: Point, q: Point| coincident(p, start_point(curve), near) && coincident(q, end_point(curve), near);
        are_ends(first, last) || are_ends(last, first)
    }
}

impl<'f, 'a> GeometryReader<'f, 'a> {
    /// Returns the curve #`id` of the edge `e`, read as `directed`, for this use of it: closed where the edge runs over ends that lie apart
    /// by no more than is bridged between segments, else as it is. Refuses ends farther apart over which the edge runs all the same, as
    /// `others`, the edges of its part, may show.
    pub(super) fn close_for_edge(
        &self,
        e: Entity<'f, 'a>,
        id: u64,
        directed: DirectedCurve,
        usage: &CurveUse,
        others: &CompositeEdges,
    ) -> Outcome<DirectedCurve> {
        let CurveShape::Spline { curve, closed: are_one, joints } = &directed.shape else { return Ok(directed) };
        let curve_entity = self.entity(id)?;
        let owner = self.parameter_owner(curve_entity);
        let is_composite = owner.is_one_of(&COMPOSITES);
        // The ends of other curves are their own: only where all would be lost they are joined.
        if !is_composite && (*are_one || !usage.is_closed) {
            return Ok(directed);
        }
        let width = step_between(curve, curve).length();
        let size = curve.bounds().diagonal();
        let accuracy = self.units.accuracy_on_face(size);
        let is_met = if is_composite { *are_one && width <= accuracy } else { width <= LOOSE_VERTEX_MM };
        if is_met {
            return Ok(directed);
        }
        let is_near = width <= STATED_BRIDGE_SHARE * size;
        let is_over_ends = if usage.is_closed {
            // Of a curve no larger than its vertex nothing would be lost.
            is_near || usage.is_alone && size > EMPTY_LOOP_MM
        } else {
            let may_close = is_near && (width <= accuracy || is_closed_by_file(owner));
            let runs_over = || {
                let [from, to] = usage.parameters(&directed);
                let is_taken = || self.is_taken([to, from], curve_entity, others);
                to < from && (width <= accuracy || is_taken())
            };
            (*are_one || may_close && runs_over()) && !usage.joins_ends(curve, width)
        };
        if !is_over_ends {
            return Ok(directed);
        }
        let limit = self.units.widest_bridge(size).min(STATED_BRIDGE_SHARE * size);
        if !(width <= limit) {
            let reason = format!(
                "it runs over the ends of its curve, which are {width:.3e} mm apart; gaps of more than {limit:.1e} mm are not bridged"
            );
            return Err(Refusal::new(e, reason));
        }
        let mut closed = join_ends(owner.id, curve, [accuracy, limit]);
        closed.joints.extend(joints.iter().copied());
        Ok(DirectedCurve { shape: CurveShape::joined(closed), reversed: directed.reversed })
    }

    /// Returns those of some edges that run along composite curves, or replicas or offsets of them.
    pub(crate) fn composite_edges(&self, edges: impl IntoIterator<Item = u64>) -> CompositeEdges {
        let mut composite_edges = CompositeEdges::default();
        if self.file.entities_named(&COMPOSITES).next().is_none() {
            return composite_edges;
        }
        for id in edges {
            let geometry = self.file.entity(id).and_then(|e| e.attributes("EDGE_CURVE", 3));
            let curve = geometry.and_then(|a| a.entity(0));
            if let Some(curve) = curve.filter(|curve| self.parameter_owner(*curve).is_one_of(&COMPOSITES)) {
                let (basis, _) = self.basis_curve(curve);
                composite_edges.0.entry(basis.id).or_default().edges.push(id);
            }
        }
        composite_edges
    }

    /// Whether an edge, run as its sense says, takes the part from `low` to `high` of an open curve: the middle of what it takes is there.
    fn is_taken(&self, [low, high]: [f64; 2], curve: Entity<'f, 'a>, others: &CompositeEdges) -> bool {
        let (basis, _) = self.basis_curve(curve);
        let Some(along) = others.0.get(&basis.id) else { return false };
        let middles = along.middles.get_or_init(|| self.taken_middles(basis.id, &along.edges));
        let next = middles.partition_point(|middle| *middle <= low);
        middles.get(next).is_some_and(|middle| *middle < high)
    }

    /// Returns the middles, rising, of the parts that some edges take of #`basis`, their basis curve, which is read once. One that runs
    /// over the ends, or has a wrong sense, takes none.
    fn taken_middles(&self, basis: u64, edges: &[u64]) -> Vec<f64> {
        let Ok(curve) = self.curve(basis, 0) else { return Vec::new() };
        let middle = |id: &u64| {
            let [first, last] = self.use_of_basis(*id)?.parameters(&curve);
            (first < last).then_some(0.5 * (first + last))
        };
        let mut middles: Vec<f64> = edges.iter().filter_map(middle).collect();
        middles.sort_unstable_by(f64::total_cmp);
        middles
    }

    /// Returns how the EDGE_CURVE #`id` uses its basis curve, against which the one that it names may run. `None` where its vertices or its
    /// curve are missing.
    fn use_of_basis(&self, id: u64) -> Option<CurveUse> {
        let e = self.file.entity(id)?;
        let ends = e.attributes("EDGE", 1).or_else(|| e.attributes("EDGE_CURVE", 1))?;
        let vertices = [self.vertex(ends.id(0)?).ok()?, self.vertex(ends.id(1)?).ok()?];
        let geometry = e.attributes("EDGE_CURVE", 3)?;
        let (_, is_against) = self.basis_curve(geometry.entity(0)?);
        let sense = (geometry.flag(1) != Some(false)) != is_against;
        Some(CurveUse { vertices, sense, is_closed: ends.id(0) == ends.id(1), is_alone: false })
    }
}

/// Joins the end of a curve of the entity #`owner` to its start as two segments are joined: by a straight piece behind the end, or by
/// cutting off what both have in common; what is left keeps its parameter. The joint is known where the ends lie more than `accuracy`,
/// mm, apart; `limit`, mm, is what may be bridged.
fn join_ends(owner: u64, open: &Curve, [accuracy, limit]: [f64; 2]) -> JoinedCurve {
    let [start, end] = open.domain();
    // Clamped, so that the last control point is the end.
    let mut curve = open.restricted(start, end);
    let width = step_between(&curve, &curve).length();
    let margin = joint_margin(accuracy, width);
    let overlaps = width > ACCURACY_MM[0] && doubles_back(&curve, &curve);
    if overlaps {
        let (mut earlier, mut later) = (curve.clone(), curve.clone());
        cut_overlap(&mut earlier, &mut later, margin);
        let (from, to) = (later.domain()[0], earlier.domain()[1]);
        if from < to {
            curve = curve.restricted(from, to);
        }
    }
    let end = curve.domain()[1];
    let step = step_between(&curve, &curve).length();
    let is_bridged = !overlaps || step > margin && !doubles_back(&curve, &curve);
    let length = if is_bridged { step } else { 0.0 };
    let crossing = joint_crossing([&curve, &curve], overlaps.then_some(width), end, length, margin);
    let start = start_point(&curve);
    if is_bridged {
        let bridge = Curve::line(end_point(&curve), start, [0.0, length]);
        curve = curve.joined_with(&elevate_degree(&bridge, curve.degree));
    } else if let Some(last) = curve.points.last_mut() {
        *last = Homogeneous::weighted(start, last.w);
    }
    let joint = Joint { owner, overlaps, is_closing: true, width, limit, crossing };
    JoinedCurve { curve, joints: if width > accuracy { vec![joint] } else { Vec::new() } }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The border of a square of 10 mm from its corner at the origin on, the last side of which ends at a height there.
    fn outline(height: f64) -> Curve {
        let corners = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, height]];
        Curve::polyline(&[0.0, 10.0, 20.0, 30.0, 40.0 - height], &corners.map(|[x, y]| Point::new(x, y, 0.0)))
    }

    #[test]
    fn ends_are_joined_by_a_piece_or_cut() {
        for (height, overlaps) in [(0.05, false), (-0.05, true)] {
            let closed = join_ends(7, &outline(height), [1e-6, 0.1]);
            let length: f64 = closed.curve.points.windows(2).map(|p| (p[1] - p[0]).length()).sum();
            assert!((length - 40.0).abs() < 1e-9, "{height}: {length}");
            assert!(closed.joints.len() == 1 && closed.joints[0].overlaps == overlaps, "{height}");
            let shape = CurveShape::joined(closed);
            assert!(shape.period().is_some_and(|period| (period - 40.0).abs() < 1e-9), "{height}");
            let count = |from: f64, to: f64| shape.joints_along([from, to]).len();
            assert_eq!([count(0.0, 39.9), count(15.0, 39.95), count(35.0, 45.0), count(5.0, 45.0)], [0, 0, 1, 1]);
        }
    }

    #[test]
    fn ends_that_meet_within_the_accuracy_are_closed_without_a_joint() {
        let closed = join_ends(7, &outline(0.005), [0.01, 0.1]);
        assert!(closed.joints.is_empty());
        assert!(CurveShape::joined(closed).period().is_some_and(|period| (period - 40.0).abs() < 1e-9));
    }
}

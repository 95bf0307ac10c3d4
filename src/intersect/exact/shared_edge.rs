//! Which side of a shared edge a ray passes: one computation that both faces of the edge use, so that a ray which crosses
//! a closed shell at an edge finds exactly one of them.
//!
//! The edges near a root are seen along the ray, as plane curves about the ray at the origin, and the nearest one decides: by
//! its side where it is met in its inside, together with its neighbour in the loop where it is met at a vertex. Newton's
//! method runs to the nearest point from one of [`SEEDS`] fixed parameters and ends on one of [`STATIONS`], so that all
//! faces compute the same bits. A ray through a vertex itself falls into one of the sectors between its edges' directions.

use super::edge_use;
use super::geometry::{FaceRecord, Geometry, WIDEST_GAP};
use super::tolerances::VERTEX_RADIUS;
use super::trim::{Near, Trim};
use crate::math::{Point, Vector};
use crate::nurbs::Curve;

/// Fixed parameters from which the nearest point is sought.
const SEEDS: f64 = 64.0;
/// Fixed parameters at which it may lie; what is lost is the square of 1e-12 of the edge.
const STATIONS: f64 = (1u64 << 40) as f64;

/// Steps of Newton's method to the nearest point.
const EDGE_STEPS: usize = 24;
/// The longest step, in seeds: as far as a seed may be trusted to be on the right turn of the curve.
const LONGEST_STEP: f64 = 4.0 / SEEDS;
/// Steps of the parameter below this are rounding.
const LAST_EDGE_STEP: f64 = 1e-15;
/// Square of the least sine between a ray and an edge that it passes.
const LEAST_SINE_SQUARED: f64 = 1e-20;
/// As [`LEAST_SINE_SQUARED`], not squared, for chords.
const LEAST_SINE: f64 = 1e-10;
/// Ulps of the origin's largest coordinate within which a ray passes a vertex.
const VERTEX_ROUNDING: f64 = 256.0;
/// Directions at a vertex are chords over this part of the edge, which separates edges that touch there.
const CHORD: f64 = 1.0 / 1024.0;

/// How a ray passes an edge.
#[derive(Clone, Copy, Debug)]
struct EdgePassage {
    /// To the left of the edge in the sense of its parameter, seen along the ray.
    left: bool,
    /// Distance from the ray, in the units of the part.
    distance: f64,
    /// The direction of the edge there, across the ray.
    along: [f64; 2],
    /// Whether it is nearest at its end, `true`, or at its start; `None` in between.
    end: Option<bool>,
}

/// How a ray, given by its origin and the two directions across it in the part's coordinates, passes an edge near a parameter of it;
/// `None` when it runs along the edge.
fn nearest_passage(curve: &Curve, near: f64, [o, n1, n2]: [Vector; 3]) -> Option<EdgePassage> {
    let [t0, t1] = curve.domain();
    let seed = ((near - t0) / (t1 - t0) * SEEDS).round().clamp(0.0, SEEDS);
    // Relative to the domain.
    let mut s = seed / SEEDS;
    let at = |s: f64| {
        let c = curve.derivatives(if s == 1.0 { t1 } else { t0 + (t1 - t0) * s });
        // The end itself: t0 + (t1 − t0) may miss it by an ulp, and edges that end in one vertex would then not
        // meet there.
        let off = c.point - o;
        let x = [n1.dot(off), n2.dot(off)];
        let d = [n1.dot(c.first), n2.dot(c.first)];
        let length = d[0] * d[0] + d[1] * d[1];
        (length > LEAST_SINE_SQUARED * c.first.length_squared()).then_some((x, d, length))
    };
    for _ in 0..EDGE_STEPS {
        let (x, d, length) = at(s)?;
        let step = (x[0] * d[0] + x[1] * d[1]) / (length * (t1 - t0));
        let next = (s - step.clamp(-LONGEST_STEP, LONGEST_STEP)).clamp(0.0, 1.0);
        let done = (next - s).abs() <= LAST_EDGE_STEP;
        s = next;
        if done {
            break;
        }
    }
    // Rounded to a fixed station: the faces on both sides start from different seeds, and must come to the same
    // bits.
    s = (s * STATIONS).round() / STATIONS;
    let (x, along, _) = at(s)?;
    let left = along[1] * x[0] - along[0] * x[1] > 0.0;
    let end = (s == 0.0 || s == 1.0).then_some(s == 1.0);
    Some(EdgePassage { left, distance: x[0].hypot(x[1]), along, end })
}

impl Geometry {
    /// Whether a root of a face near its trims counts, by the sides of the shared edges; `None` where no edge can decide.
    ///
    /// The ray comes as its origin and the two directions across it, in the world. `facing` has the sign of `(Su × Sv) · d` at the root,
    /// `near` are the uses about it.
    pub(super) fn side_of_edges(
        &self,
        face: &FaceRecord,
        trim: &Trim,
        [origin, n1, n2]: [Vector; 3],
        facing: f64,
        near: &[Near],
    ) -> Option<bool> {
        let place = &face.placement;
        // Mirrored placements turn sides around; `facing` is measured in the world as well, so the frame stays the world's.
        let o: Point = place.local_point(origin);
        let frame = [o, place.local_direction(n1), place.local_direction(n2)];
        let curve = |owner: u32| {
            let edge = trim.uses[owner as usize].edge?;
            self.edges.get(face.part as usize)?.get(edge.0 as usize)
        };
        // The side on which the face lies, and the edge's direction in the loop, with the face to its left.
        let mirrored = facing < 0.0;
        // Vertices first: there several edges are equally near, and rounding would choose among them.
        if let Some(inside) = self.is_in_sector(face, trim, near, mirrored, frame) {
            return Some(inside);
        }
        let mut best: Option<(u32, EdgePassage)> = None;
        for n in near.iter().filter(|n| trim.uses[n.owner as usize].edge.is_some()) {
            let passed = nearest_passage(curve(n.owner)?, n.parameter, frame)?;
            if best.is_none_or(|b| passed.distance < b.1.distance) {
                best = Some((n.owner, passed));
            }
        }
        let (owner, first) = best?;
        let inside = |owner: u32, p: &EdgePassage| p.left ^ trim.uses[owner as usize].reversed ^ mirrored;
        let by_nearest = inside(owner, &first);
        // Passed at its inside an edge decides by itself; passed at its end, together with the next edge of the
        // loop.
        let Some(at_end) = first.end else { return Some(by_nearest) };
        let forward = at_end != trim.uses[owner as usize].reversed;
        let Some(other) = edge_use::next_bounding_use(&trim.uses, owner, forward) else { return Some(by_nearest) };
        let other_curve = curve(other)?;
        // Where the loop comes from the vertex, or goes to it.
        let its_end = forward == trim.uses[other as usize].reversed;
        let Some(second) = nearest_passage(other_curve, other_curve.domain()[usize::from(its_end)], frame) else {
            return Some(by_nearest);
        };
        let direction = |owner: u32, p: &EdgePassage| {
            let sign = if trim.uses[owner as usize].reversed { -1.0 } else { 1.0 };
            p.along.map(|x| sign * x)
        };
        let (a, b) = (direction(owner, &first), direction(other, &second));
        let turn = a[0] * b[1] - a[1] * b[0];
        // The loop turns towards the face at a convex corner.
        let convex = (turn > 0.0) == (forward != mirrored);
        let by_other = inside(other, &second);
        Some(if convex { by_nearest && by_other } else { by_nearest || by_other })
    }

    /// Whether a ray passes an edge near a root, and what goes on straight beyond its ends, on the face's side; true where it runs along.
    /// What comes in is as for [`Self::side_of_edges`].
    pub(super) fn is_within_edge(
        &self,
        face: &FaceRecord,
        trim: &Trim,
        [origin, n1, n2]: [Vector; 3],
        facing: f64,
        near: &Near,
    ) -> bool {
        let (here, place) = (&trim.uses[near.owner as usize], &face.placement);
        let curve = here.edge.and_then(|edge| self.edges.get(face.part as usize)?.get(edge.0 as usize));
        let frame = [place.local_point(origin), place.local_direction(n1), place.local_direction(n2)];
        let passed = curve.and_then(|curve| nearest_passage(curve, near.parameter, frame));
        passed.is_none_or(|p| p.left ^ here.reversed ^ (facing < 0.0))
    }

    /// Whether a ray, in the part's coordinates, through a vertex falls into one of the face's sectors there; `None` when it passes no
    /// vertex, or one with a corner that decides nothing: the ray runs along an edge of it, or nothing else bounds the face there. What
    /// other corners decided is dropped then, and the nearest edge is left to decide.
    ///
    /// Directions are compared, never subtracted: whatever their rounding, each falls into exactly one of the sectors about a
    /// vertex.
    fn is_in_sector(
        &self,
        face: &FaceRecord,
        trim: &Trim,
        near: &[Near],
        mirrored: bool,
        [o, n1, n2]: [Vector; 3],
    ) -> Option<bool> {
        let flat = |x: Vector| [n1.dot(x), n2.dot(x)];
        let angle = |x: [f64; 2]| x[1].atan2(x[0]);
        let rounding = VERTEX_ROUNDING * f64::EPSILON * o.abs().max_element();
        let mut found = None;
        for owner in near.iter().map(|n| n.owner) {
            for forward in [true, false] {
                let here = &trim.uses[owner as usize];
                let Some(edge) = here.edge else { continue };
                let end = usize::from(forward != here.reversed);
                let (place, missed) = self.ends[face.part as usize][edge.0 as usize][end];
                let vertex = flat(place - o);
                let radius =
                    (missed * face.placement.scale).clamp(VERTEX_RADIUS, WIDEST_GAP) / face.placement.scale;
                if !(vertex[0].hypot(vertex[1]) <= radius.max(rounding)) {
                    continue;
                }
                // Each `?` ends the search and drops `found`: the sectors of some corners alone do not divide what is about the vertex.
                let other = edge_use::next_bounding_use(&trim.uses, owner, forward)?;
                // Away from the vertex along the loop, and back from it.
                let (outgoing, incoming) = if forward { (other, owner) } else { (owner, other) };
                let away = |owner: u32, leaves: bool| {
                    let u = &trim.uses[owner as usize];
                    let at_end = leaves == u.reversed;
                    let curve = &self.edges[face.part as usize][u.edge?.0 as usize];
                    let [t0, t1] = curve.domain();
                    let (from, to) =
                        if at_end { (t1, t1 - (t1 - t0) * CHORD) } else { (t0, t0 + (t1 - t0) * CHORD) };
                    let chord = curve.evaluate(to) - curve.evaluate(from);
                    let d = flat(chord);
                    (d[0].hypot(d[1]) > LEAST_SINE * chord.length()).then(|| angle(d))
                };
                let (from, to) = (away(outgoing, true)?, away(incoming, false)?);
                // Seen from behind, the loop runs the other way.
                let (from, to) = if mirrored { (to, from) } else { (from, to) };
                let at = angle(vertex.map(|x| -x));
                // Half open, so that a ray along a direction falls into one sector and not into two or none.
                let inside = if from < to { from <= at && at < to } else { from <= at || at < to };
                // A face may touch one vertex with several corners: any of them may hold the ray.
                found = Some(inside || found == Some(true));
            }
        }
        found
    }
}

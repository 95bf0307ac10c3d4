//! The sequences that recorded paths belong to, so that the lines of a sequence can be drawn.

use super::arrivals::{Crossing, crossings};
use super::bind::BoundScene;
use super::outcome::{Event, PathVertex};
use super::plan::Plan;
use super::receiver::{Receiver, Shape};
use super::results::Results;
use super::sequence::{RayPaths, Sequence};
use super::settings::RunSettings;
use crate::math::Point;

/// A recorded path up to where a receiver counted its light.
#[derive(Clone, Debug)]
pub struct RecordedWay {
    /// The sequence that this light belongs to.
    pub sequence: Sequence,
    /// Its vertices and the place where it was counted, mm; of a path that split off those from there on. Light that left the scene for a
    /// far field ends on its way, 100 mm on or beyond all faces.
    pub points: Vec<Point>,
}

/// Returns the recorded paths whose light a receiver counted, each once for each time that it did, by as many steps as the results state
/// apart. `settings` are those of the run. Empty for a number without a receiver, and for results without recorded paths.
pub fn recorded_ways(
    bound: &BoundScene,
    settings: &RunSettings,
    receiver: usize,
    results: &Results,
) -> Vec<RecordedWay> {
    let Some(shape) = bound.receivers.get(receiver) else { return Vec::new() };
    let (plan, number) = (Plan::new(bound, settings), receiver as u32);
    let limit = results.tallies.sequences.limit();
    let mut ways = Vec::new();
    for ray in results.paths.chunk_by(|a, b| a.ray == b.ray) {
        let Some((source, _)) = plan.locate(ray[0].ray) else { continue };
        let paths = RayPaths::new(ray);
        for path in ray.chunk_by(|a, b| a.branch == b.branch) {
            let ends = ends_at(shape, path).into_iter().map(|end| {
                let steps = paths.steps(path[0].branch, end.bounce);
                let sequence = match end.face {
                    Some(face) => Sequence::absorbed(number, source as u32, steps, face),
                    None => Sequence::new(number, source as u32, steps),
                };
                let vertices = path[..end.vertices].iter().map(|v| v.point);
                RecordedWay { sequence: sequence.cut(limit), points: vertices.chain(end.beyond).collect() }
            });
            ways.extend(ends);
        }
    }
    ways
}

/// Where light of a recorded path was counted.
struct CountedEnd {
    /// Hits before it.
    bounce: u32,
    /// Vertices of the path up to there.
    vertices: usize,
    /// The place itself, mm, where that is no vertex.
    beyond: Option<Point>,
    /// The face that took it.
    face: Option<u32>,
}

/// Returns where a receiver counted light of a recorded path.
fn ends_at(receiver: &Receiver, path: &[PathVertex]) -> Vec<CountedEnd> {
    match &receiver.shape {
        Shape::Absorbed { faces } => {
            // Faces that take nothing end ways without light. What splits off there, was taken from the path that it splits off.
            let own = path.iter().enumerate().filter(|(_, vertex)| vertex.event != Event::Split);
            let taken = own.filter_map(|(k, vertex)| Some((k, vertex, vertex.face?)));
            let counted = taken.filter(|(_, _, face)| faces.binary_search(face).is_ok());
            let end = |(k, vertex, face): (usize, &PathVertex, u32)| CountedEnd {
                bounce: vertex.bounce,
                vertices: k + 1,
                beyond: None,
                face: Some(face),
            };
            counted.map(end).collect()
        }
        Shape::FarField { .. } => {
            let [.., before, last] = path else { return Vec::new() };
            let direction = (last.point - before.point).try_normalize();
            let counts = last.event == Event::Escaped
                && receiver.interactions.is_none_or(|n| n == last.bounce)
                && direction.is_some_and(|d| receiver.direction(d).is_some());
            let end = CountedEnd { bounce: last.bounce, vertices: path.len(), beyond: None, face: None };
            counts.then_some(end).into_iter().collect()
        }
        Shape::Plane { .. } | Shape::Disc { .. } | Shape::Sphere { .. } => {
            let end = |crossing: Crossing| CountedEnd {
                bounce: crossing.segment[1].bounce,
                vertices: crossing.first + 1,
                beyond: Some(crossing.point()),
                face: None,
            };
            crossings(receiver, path).into_iter().map(end).collect()
        }
    }
}

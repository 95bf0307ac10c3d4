//! Sequences: light grouped by the faces it met and what happened there, so that "which path makes this spot" is one look.

use super::bind::BoundScene;
use super::outcome::{Event, PathVertex};
use super::random::split_branch;
use super::receiver::Shape;
use super::tally::Sum;
use crate::math::Point;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Steps of a sequence that are told apart. Light that went on, caught in a guide or a cavity, is in the sequence of its first steps:
/// without a limit nearly every path of such a scene would be a sequence of its own.
pub const MOST_STEPS: usize = 32;

/// One thing that happened to light on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct SequenceStep {
    /// The placed face; `None` where light was scattered inside a medium.
    pub face: Option<u32>,
    /// What happened there.
    pub event: Event,
}

/// A way from a source to a receiver.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Sequence {
    /// The receiver, by its place in the scene.
    pub receiver: u32,
    /// The source, by its place in the scene.
    pub source: u32,
    /// What happened in between.
    pub steps: Vec<SequenceStep>,
    /// Whether more steps followed than are told apart.
    pub more: bool,
}

/// Where some light of a recorded path was counted.
#[derive(Clone, Copy, Debug)]
pub(crate) enum DepositPlace {
    /// On a plane, a sphere or in the far field.
    Receiver(u32),
    /// In a face, which receivers of absorbed power may name.
    Face(u32),
}

/// Some light of a recorded path that was counted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deposit {
    pub(crate) branch: u32,
    /// Hits before it.
    pub(crate) bounce: u32,
    pub(crate) place: DepositPlace,
    pub(crate) quanta: u64,
}

/// Power by sequence, quanta of one replicate.
pub(crate) type SequenceTally = BTreeMap<Sequence, u128>;

/// Power by sequence over replicates.
pub type SequenceSums = BTreeMap<Sequence, Sum>;

/// The vertices of one ray by the path that split off it; each list in the order of the path.
struct RayPaths<'v>(FxHashMap<u32, Vec<&'v PathVertex>>);

impl<'v> RayPaths<'v> {
    /// Groups the vertices of one ray by branch.
    fn new(vertices: &'v [PathVertex]) -> Self {
        let mut by_branch: FxHashMap<u32, Vec<&PathVertex>> = FxHashMap::default();
        vertices.iter().for_each(|v| by_branch.entry(v.branch).or_default().push(v));
        Self(by_branch)
    }

    /// Returns what happened to the light of a branch before its hit of this number, from the source on; empty for a branch without
    /// vertices.
    fn steps(&self, branch: u32, bounce: u32) -> Vec<SequenceStep> {
        let Some(vertices) = self.0.get(&branch) else { return Vec::new() };
        let mut steps = match vertices.first() {
            Some(first) if first.event == Event::Split => self.steps_before_split(branch, first.bounce),
            _ => Vec::new(),
        };
        let happened = vertices.iter().filter(|v| v.bounce < bounce);
        steps.extend(happened.filter_map(|v| {
            let event = match v.event {
                // What splits off is what the face reflects.
                Event::Split => Event::Reflected,
                Event::Reflected | Event::Transmitted | Event::Scattered => v.event,
                _ => return None,
            };
            Some(SequenceStep { face: v.face, event })
        }));
        steps
    }

    /// Returns the steps of the path that a branch split off from, up to there; empty where that path was not recorded. Branches are
    /// numbered by the splits before alone.
    fn steps_before_split(&self, branch: u32, bounce: u32) -> Vec<SequenceStep> {
        let parent = self.0.keys().find(|&&p| p != branch && split_branch(p, bounce) == branch);
        parent.map_or_else(Vec::new, |&p| self.steps(p, bounce))
    }
}

/// Adds the light of one ray, counted at `deposits`, to its sequences in `tally`. `vertices` are all of its paths.
pub(crate) fn add_ray(
    bound: &BoundScene,
    source: u32,
    vertices: &[PathVertex],
    deposits: &[Deposit],
    tally: &mut SequenceTally,
) {
    if deposits.is_empty() {
        return;
    }
    // Light that is counted several times on its way, as by receivers that let it pass, is in a sequence of each.
    let paths = RayPaths::new(vertices);
    for deposit in deposits {
        let mut steps = paths.steps(deposit.branch, deposit.bounce);
        let more = steps.len() > MOST_STEPS;
        steps.truncate(MOST_STEPS);
        let mut add = |receiver: u32, steps: Vec<SequenceStep>| {
            *tally.entry(Sequence { receiver, source, steps, more }).or_default() += u128::from(deposit.quanta);
        };
        match deposit.place {
            DepositPlace::Receiver(receiver) => add(receiver, steps),
            DepositPlace::Face(face) => {
                // A way that was cut does not tell how it ended.
                if !more {
                    steps.push(SequenceStep { face: Some(face), event: Event::Absorbed });
                }
                for (r, receiver) in bound.receivers.iter().enumerate() {
                    if matches!(&receiver.shape, Shape::Absorbed { faces } if faces.binary_search(&face).is_ok()) {
                        add(r as u32, steps.clone());
                    }
                }
            }
        }
    }
}

/// A recorded path and what happened on it.
#[derive(Clone, Debug)]
pub struct RecordedWay {
    /// What happened, in the order of the path.
    pub steps: Vec<SequenceStep>,
    /// Its vertices, mm; of a path that split off those from there on.
    pub points: Vec<Point>,
}

/// Returns the way of each recorded path from its source, at most [`MOST_STEPS`] steps. Vertices must stand in the order of rays, branches
/// and hits.
pub fn recorded_ways(vertices: &[PathVertex]) -> Vec<RecordedWay> {
    let mut ways = Vec::new();
    for ray in vertices.chunk_by(|a, b| a.ray == b.ray) {
        let paths = RayPaths::new(ray);
        for path in ray.chunk_by(|a, b| a.branch == b.branch) {
            let last = &path[path.len() - 1];
            let mut steps = paths.steps(last.branch, last.bounce);
            if last.event == Event::Absorbed {
                steps.push(SequenceStep { face: last.face, event: Event::Absorbed });
            }
            steps.truncate(MOST_STEPS);
            ways.push(RecordedWay { steps, points: path.iter().map(|v| v.point).collect() });
        }
    }
    ways
}

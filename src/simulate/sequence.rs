//! Sequences: light grouped by the faces it met and what happened there, so that "which path makes this spot" is one look.

use super::bind::BoundScene;
use super::outcome::{Event, PathVertex};
use super::random::split_branch;
use super::receiver::Shape;
use super::tally::Sum;
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

impl Sequence {
    /// Makes the way of light that a receiver counted after these steps.
    pub(super) fn new(receiver: u32, source: u32, mut steps: Vec<SequenceStep>) -> Self {
        let more = steps.len() > MOST_STEPS;
        steps.truncate(MOST_STEPS);
        Self { receiver, source, steps, more }
    }

    /// Makes the way of light that a face took after these steps.
    pub(super) fn absorbed(receiver: u32, source: u32, steps: Vec<SequenceStep>, face: u32) -> Self {
        let mut sequence = Self::new(receiver, source, steps);
        // A way that was cut does not tell how it ended.
        if !sequence.more {
            sequence.steps.push(SequenceStep { face: Some(face), event: Event::Absorbed });
        }
        sequence
    }
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
pub(super) struct RayPaths<'v>(FxHashMap<u32, Vec<&'v PathVertex>>);

impl<'v> RayPaths<'v> {
    /// Groups the vertices of one ray by branch.
    pub(super) fn new(vertices: &'v [PathVertex]) -> Self {
        let mut by_branch: FxHashMap<u32, Vec<&PathVertex>> = FxHashMap::default();
        vertices.iter().for_each(|v| by_branch.entry(v.branch).or_default().push(v));
        Self(by_branch)
    }

    /// Returns what happened to the light of a branch before its hit of this number, from the source on; empty for a branch without
    /// vertices.
    pub(super) fn steps(&self, branch: u32, bounce: u32) -> Vec<SequenceStep> {
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
        let steps = paths.steps(deposit.branch, deposit.bounce);
        let mut add = |sequence: Sequence| *tally.entry(sequence).or_default() += u128::from(deposit.quanta);
        match deposit.place {
            DepositPlace::Receiver(receiver) => add(Sequence::new(receiver, source, steps)),
            DepositPlace::Face(face) => {
                for (r, receiver) in (0..).zip(&bound.receivers) {
                    if matches!(&receiver.shape, Shape::Absorbed { faces } if faces.binary_search(&face).is_ok()) {
                        add(Sequence::absorbed(r, source, steps.clone(), face));
                    }
                }
            }
        }
    }
}
